use std::fmt::Write;

use nalgebra::{Unit, UnitQuaternion, Vector3};

use facemill_job::examples::new_job::{NewJob, new_job};
use facemill_job::format::job_file::RoleFile;
use facemill_job::load::job::Job;

const INF: &str =
    "Axis of Rotation: Z\nNumber of Blade Sets: 11\nGeometry Units: CM\nProfile Data File: curves/p.crv\n";

/// A cambered blade of 8 cm chord and 12 cm span along x, flow along z.
fn profile() -> String {
    let mut text = String::new();
    for k in 0..4 {
        writeln!(text, "# Profile {k}").unwrap();
        for j in 0..=60 {
            let (sin, cos) = (f64::from(j) * std::f64::consts::TAU / 60.0).sin_cos();
            let y = 0.4 * sin + 0.8 * sin * sin;
            writeln!(text, "{} {y:.6} {:.6}", 20 + 4 * k, -4.0 * cos).unwrap();
        }
    }
    text
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("curves")).unwrap();
    std::fs::write(folder.path().join("b.inf"), INF).unwrap();
    std::fs::write(folder.path().join("curves/p.crv"), profile()).unwrap();
    folder
}

#[test]
fn a_blade_lies_with_each_side_up_in_a_setup_of_its_own() {
    let (given, written) = (folder(), tempfile::tempdir().unwrap());
    let blade = NewJob::Blade { from: given.path().join("b.inf"), scale: 2.0, hub: false };
    let files = new_job(&blade).unwrap();
    assert_eq!(files, new_job(&blade).unwrap(), "the same bytes each time");
    for (name, bytes) in files {
        std::fs::write(written.path().join(name), bytes).unwrap();
    }
    let job = Job::read(written.path()).unwrap();
    assert_eq!(job.file.name, "blade b, one of 11, scale 2");
    for (k, name) in ["suction side", "pressure side"].into_iter().enumerate() {
        assert_eq!(job.file.setups[k].name, name);
        crate::describe::describe_setup(&job, k).unwrap();
        let pose = &job.file.setups[k].work_from_part;
        let axis = Unit::new_normalize(Vector3::from(pose.rotation_axis));
        let turn = UnitQuaternion::from_axis_angle(&axis, pose.rotation_deg.to_radians());
        // The convex side faces +y, the span is along +x.
        let up = if k == 0 { Vector3::y() } else { -Vector3::y() };
        assert!((turn * up).z > 0.99 && (turn * Vector3::x()).x > 0.99, "{name}");
        assert!(turn.quaternion().coords.iter().all(|c| c.is_finite()));
    }
}

#[test]
fn faults_name_the_file_and_links_out_of_the_folder_are_refused() {
    let given = folder();
    let from = given.path().join("b.inf");
    let why = |scale: f64| new_job(&NewJob::Blade { from: from.clone(), scale, hub: false }).expect_err("refused");
    assert!(why(f64::NAN).contains("scale") && why(1e3).contains("scale"));
    std::fs::write(given.path().join("curves/p.crv"), profile().replacen("20 ", "nan ", 1)).unwrap();
    assert!(why(1.0).contains("curves/p.crv, line 2: "), "{}", why(1.0));
    std::fs::remove_file(given.path().join("curves/p.crv")).unwrap();
    assert!(why(1.0).contains("b.inf, line 4: ") && why(1.0).contains("p.crv"), "{}", why(1.0));
    #[cfg(unix)]
    {
        let elsewhere = folder();
        let target = elsewhere.path().join("curves/p.crv");
        std::os::unix::fs::symlink(target, given.path().join("curves/p.crv")).unwrap();
        assert!(why(1.0).contains("link out of the folder"), "{}", why(1.0));
    }
}

/// Writes the blade with a hub through these radii and heights, cm.
fn with_hub(curve: &[[f64; 2]]) -> (tempfile::TempDir, NewJob) {
    let given = folder();
    let inf = INF.replace("Profile Data", "Hub Data File: curves/h.crv\nProfile Data");
    std::fs::write(given.path().join("b.inf"), inf).unwrap();
    let text: String = curve.iter().map(|[radius, z]| format!("{radius} 0 {z}\n")).collect();
    std::fs::write(given.path().join("curves/h.crv"), text).unwrap();
    let from = given.path().join("b.inf");
    (given, NewJob::Blade { from, scale: 1.0, hub: true })
}

#[test]
fn a_blade_on_its_hub_has_passes_on_the_share_that_its_name_states() {
    let written = tempfile::tempdir().unwrap();
    let (_given, blade) = with_hub(&[[21.0, -8.0], [21.0, 8.0]]);
    for (name, bytes) in new_job(&blade).unwrap() {
        std::fs::write(written.path().join(name), bytes).unwrap();
    }
    let job = Job::read(written.path()).unwrap();
    // Of the side from 21 to 32 cm, passes keep two radii of the cutter and 1 mm from the hub.
    let radius = job.tool.cutter().radius();
    let share = (110.0 - 2.0 * radius - 1.0) / 110.0;
    let stated = job.file.name.split("passes on ").nth(1).and_then(|text| text.split(' ').next()).unwrap();
    assert!((stated.parse::<f64>().unwrap() - share).abs() < 0.03, "{}: {share}", job.file.name);
    for k in 0..2 {
        crate::describe::describe_setup(&job, k).unwrap();
        let setup = &job.file.setups[k];
        assert!(setup.meshes.iter().any(|mesh| mesh.role == RoleFile::Check && mesh.allowance_mm == 1.0));
    }
}
