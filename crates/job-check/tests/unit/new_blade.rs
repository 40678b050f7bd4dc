use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

use facemill_job::examples::new_job::{NewJob, as_read, new_job};
use facemill_job::format::job_file::RoleFile;
use facemill_job::load::job::Job;
use facemill_job::load::mesh_files::read_mesh;

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

/// Hub that rises right behind the blade: no place along the span is clear of one as high as its
/// tip.
#[test]
fn a_hub_that_leaves_no_part_of_a_side_is_refused() {
    let rising = |top: f64| with_hub(&[[21.0, -8.0], [21.0, 4.3], [top, 4.5], [top, 8.0]]);
    let (_given, blade) = rising(25.0);
    assert!(new_job(&blade).is_ok(), "half of the span is left");
    let (_given, blade) = rising(31.5);
    let why = new_job(&blade).map(|files| files.len()).expect_err("nothing is left");
    assert!(why.contains("b.inf: ") && why.contains("nothing is left of the blade's suction side"), "{why}");
    assert!(why.contains("two cutter radii above the hub") && why.contains("leave the hub out"), "{why}");
}

/// The span is that of the blade alone, however far its hub reaches to one side.
#[test]
fn the_span_of_a_blade_on_its_hub_is_along_x() {
    let written = tempfile::tempdir().unwrap();
    let (_given, blade) = with_hub(&[[21.0, -8.0], [21.0, 60.0]]);
    for (name, bytes) in new_job(&blade).unwrap() {
        std::fs::write(written.path().join(name), bytes).unwrap();
    }
    let job = Job::read(written.path()).unwrap();
    for setup in &job.file.setups {
        let pose = &setup.work_from_part;
        let axis = Unit::new_normalize(Vector3::from(pose.rotation_axis));
        let turn = UnitQuaternion::from_axis_angle(&axis, pose.rotation_deg.to_radians());
        assert!((turn * Vector3::x()).x > 0.9999, "{}: {}", setup.name, turn * Vector3::x());
    }
}

/// Returns the `.inf` file of a blade of the shared data; prints that it is skipped where it is
/// absent.
fn shared_blade(name: &str) -> Option<PathBuf> {
    let folder = std::env::var("FACEMILL_SHARED")
        .unwrap_or_else(|_| concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared").to_owned());
    let path = Path::new(&folder).join("data/blades").join(name);
    if !path.is_file() {
        println!("SKIPPED: {} is not there (set FACEMILL_SHARED to the folder of shared data)", path.display());
        return None;
    }
    Some(path)
}

/// Jobs of the shared blades on their hubs, whose passes are on most of each side.
#[test]
fn shared_blades_on_their_hubs_have_passes_on_most_of_their_sides() {
    for name in ["rotor37/BladeGen.inf", "hannover_rotor1/1_Rotor1_Blade.inf"] {
        let Some(from) = shared_blade(name) else { continue };
        let written = tempfile::tempdir().unwrap();
        let blade = NewJob::Blade { from, scale: 1.0, hub: true };
        for (file, bytes) in new_job(&blade).unwrap() {
            std::fs::write(written.path().join(file), bytes).unwrap();
        }
        // A name that programs have no room for is refused here.
        let job = Job::read(written.path()).unwrap_or_else(|why| panic!("{name}: {why}"));
        (0..2).for_each(|k| drop(crate::describe::describe_setup(&job, k).unwrap()));
        let text = as_read(&blade).unwrap().unwrap();
        println!("{text}");
        assert!(text.starts_with(&job.file.name), "{} of {text}", job.file.name);
        let shares = text.split("passes on ").nth(1).and_then(|text| text.strip_suffix(" of the sides")).unwrap();
        let shares: Vec<f64> = shares.split(" and ").map(|share| share.parse().unwrap()).collect();
        assert!(shares.len() == 2 && shares.iter().all(|share| *share > 0.65), "{text}");
    }
}

/// Text and points (mm) of a splitter in the profile file: half as long, with fewer points, and
/// this far beside the main blade, cm.
fn splitter(beside: f64) -> (String, Vec<[f64; 3]>) {
    let (mut text, mut points) = (String::from("## Splitter blade\n"), Vec::new());
    for k in 0..3 {
        writeln!(text, "# Profile {k}").unwrap();
        for j in 0..=40 {
            let (sin, cos) = (f64::from(j) * std::f64::consts::TAU / 40.0).sin_cos();
            let p = [20.0 + 6.0 * f64::from(k), beside + 0.3 * sin + 0.5 * sin * sin, 2.0 - 2.0 * cos];
            let p = p.map(|c: f64| (1e6 * c).round() / 1e6);
            writeln!(text, "{} {} {}", p[0], p[1], p[2]).unwrap();
            points.push(p.map(|c| 10.0 * c));
        }
    }
    (text, points)
}

/// Writes the blade with a splitter beside it.
fn with_splitter(beside: f64) -> (tempfile::TempDir, NewJob) {
    let given = folder();
    let inf = format!("{INF}Number of Blades Per Set: 2\nBlade 1 TE: EllipseEnd\n");
    std::fs::write(given.path().join("b.inf"), inf).unwrap();
    let text = format!("## Main blade\n{}{}", profile(), splitter(beside).0);
    std::fs::write(given.path().join("curves/p.crv"), text).unwrap();
    let from = given.path().join("b.inf");
    (given, NewJob::Blade { from, scale: 1.0, hub: false })
}

const BLADES: [&str; 2] = ["main", "splitter"];

#[test]
fn a_splitter_has_both_sides_in_setups_of_its_own_with_the_main_blade_as_an_obstacle() {
    let (_given, blade) = with_splitter(7.0);
    let written = tempfile::tempdir().unwrap();
    for (name, bytes) in new_job(&blade).unwrap() {
        std::fs::write(written.path().join(name), bytes).unwrap();
    }
    let job = Job::read(written.path()).unwrap();
    assert_eq!(job.file.name, "blade b, one of 11 sets of 2, scale 1");
    let sides = BLADES.iter().flat_map(|blade| ["suction", "pressure"].map(|side| (*blade, side)));
    for (k, (blade, side)) in sides.enumerate() {
        let setup = &job.file.setups[k];
        assert_eq!(setup.name, format!("{blade} {side} side"));
        assert_eq!(job.file.operations[k].setup.as_deref(), Some(setup.name.as_str()));
        crate::describe::describe_setup(&job, k).unwrap();
        let groups = |role: RoleFile| -> Vec<&str> {
            let of_role = setup.meshes.iter().filter(|mesh| mesh.role == role);
            of_role.flat_map(|mesh| mesh.groups.iter().flatten().map(String::as_str)).collect()
        };
        assert_eq!(groups(RoleFile::Drive), [format!("{blade}/{side}")]);
        let other = BLADES[usize::from(blade == "main")];
        for (role, blade) in [(RoleFile::Part, blade), (RoleFile::Check, other)] {
            let mut all = groups(role);
            all.sort_unstable();
            let names = ["leading-edge", "pressure", "root", "suction", "tip", "trailing-edge"];
            assert_eq!(all, names.map(|group| format!("{blade}/{group}")), "{}", setup.name);
        }
        let check = setup.meshes.iter().find(|mesh| mesh.role == RoleFile::Check).unwrap();
        assert_eq!(check.allowance_mm, 1.0);
        // The convex side of both faces +y.
        let turn = Unit::new_normalize(Vector3::from(setup.work_from_part.rotation_axis));
        let turn = UnitQuaternion::from_axis_angle(&turn, setup.work_from_part.rotation_deg.to_radians());
        let up = if side == "suction" { Vector3::y() } else { -Vector3::y() };
        assert!((turn * up).z > 0.99 && (turn * Vector3::x()).x > 0.99, "{}", setup.name);
    }
}

#[test]
fn every_given_point_of_a_set_is_a_vertex_of_its_blade_in_the_written_mesh() {
    let (_given, blade) = with_splitter(7.0);
    let written = tempfile::tempdir().unwrap();
    for (name, bytes) in new_job(&blade).unwrap() {
        std::fs::write(written.path().join(name), bytes).unwrap();
    }
    let mesh = read_mesh(&written.path().join("blade.obj"), None, None).unwrap().mesh;
    let main: Vec<[f64; 3]> = profile()
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split(' ').map(|word| 10.0 * word.parse::<f64>().unwrap()).collect::<Vec<_>>())
        .map(|words| [words[0], words[1], words[2]])
        .collect();
    for (blade, points) in BLADES.into_iter().zip([main, splitter(7.0).1]) {
        let groups = mesh.groups().iter().filter(|group| group.name.starts_with(&format!("{blade}/")));
        let triangles: Vec<[u32; 3]> =
            groups.flat_map(|group| mesh.triangles()[group.triangles.clone()].to_vec()).collect();
        // Each side of a triangle is one of another, the other way round.
        let sides = |corners: [u32; 3]| (0..3).map(move |k| [corners[k], corners[(k + 1) % 3]]);
        let all: BTreeSet<[u32; 2]> = triangles.iter().copied().flat_map(sides).collect();
        assert_eq!(all.len(), 3 * triangles.len(), "{blade}: a side twice");
        assert!(all.iter().all(|[a, b]| all.contains(&[*b, *a])), "{blade}: an open side");
        let vertices: BTreeSet<u32> = triangles.iter().flatten().copied().collect();
        let off = |p: &[f64; 3]| {
            let distances = vertices.iter().map(|&v| (mesh.vertices()[v as usize] - Point3::from(*p)).norm());
            distances.fold(f64::INFINITY, f64::min)
        };
        let worst = points.iter().map(off).fold(0.0, f64::max);
        assert!(!points.is_empty() && worst < 1e-6, "{blade}: {worst} mm off its points");
    }
}

#[test]
fn each_blade_of_a_set_has_natural_coordinates_of_its_own() {
    let text = format!("{}{}", profile(), splitter(7.0).0);
    let open = |_: &str| Ok(text.clone().into_bytes());
    let file = facemill_blade_file::read_blade("b.inf", INF.as_bytes(), open).unwrap();
    let blades = facemill_sample_jobs::lofted_blades(&file, 1.0, false).unwrap();
    assert_eq!(blades.iter().map(|blade| blade.name.as_str()).collect::<Vec<_>>(), BLADES);
    // Spans of both begin at x = 200 mm; chords along z begin at their leading edges.
    for (blade, [span, chord, from]) in blades.iter().zip([[120.0, 80.0, -40.0], [120.0, 40.0, 0.0]]) {
        let mesh = &blade.lofted.mesh;
        let mut seen = [0.0_f64; 2];
        for (p, [of_span, around]) in mesh.vertices().iter().zip(&blade.lofted.coordinates) {
            assert!((of_span - (p.x - 200.0) / span).abs() < 1e-6, "{}: {p}", blade.name);
            // The length around is longer than the chord, at most by the camber's share.
            assert!((around.abs() - (p.z - from) / chord).abs() < 0.06, "{}: {p} {around}", blade.name);
            seen = [seen[0].min(*around), seen[1].max(*around)];
        }
        assert!(seen[0] < -0.95 && seen[1] > 0.95, "{}: {seen:?}", blade.name);
    }
}

#[test]
fn each_blade_of_a_set_is_on_its_part_of_the_hub() {
    let (given, blade) = with_splitter(5.0);
    let NewJob::Blade { from, scale, .. } = blade else { unreachable!() };
    let inf =
        std::fs::read_to_string(&from).unwrap().replace("Profile Data", "Hub Data File: curves/h.crv\nProfile Data");
    std::fs::write(&from, inf).unwrap();
    std::fs::write(given.path().join("curves/h.crv"), "21 0 -8\n21 0 8\n").unwrap();
    let written = tempfile::tempdir().unwrap();
    let blade = NewJob::Blade { from, scale, hub: true };
    for (name, bytes) in new_job(&blade).unwrap() {
        std::fs::write(written.path().join(name), bytes).unwrap();
    }
    let job = Job::read(written.path()).unwrap();
    let text = as_read(&blade).unwrap().unwrap();
    let stated = text.split("passes on ").nth(1).unwrap().trim_end_matches(" of the sides");
    let stated: Vec<f64> = stated.split(" and ").map(|share| share.parse().unwrap()).collect();
    // Sides end at x = 320 mm and begin on the hub, of 210 mm; the splitter's at 50 to 58 mm of y.
    // Passes keep two radii of the cutter and 1 mm from the hub's highest place.
    let share = |y: f64| {
        let root = f64::sqrt(210.0 * 210.0 - y * y);
        (320.0 - 210.0 - 2.0 * job.tool.cutter().radius() - 1.0) / (320.0 - root)
    };
    let expected = [0.0, 0.0, 54.0, 54.0].map(share);
    let is_near = |(stated, expected): (&f64, &f64)| (stated - expected).abs() < 0.02;
    assert!(stated.len() == 4 && stated.iter().zip(&expected).all(is_near), "{stated:?}, not {expected:?}");
    for (k, blade) in BLADES.into_iter().flat_map(|blade| [blade; 2]).enumerate() {
        crate::describe::describe_setup(&job, k).unwrap();
        let groups = |role: RoleFile| -> Vec<String> {
            let of_role = job.file.setups[k].meshes.iter().filter(|mesh| mesh.role == role);
            of_role.flat_map(|mesh| mesh.groups.clone().unwrap_or_default()).collect()
        };
        let hubs = BLADES.iter().flat_map(|blade| ["hub", "hub-ends"].map(|part| format!("{blade}/{part}")));
        let checked = groups(RoleFile::Check);
        assert!(hubs.into_iter().all(|hub| checked.contains(&hub)), "{checked:?}");
        let part = groups(RoleFile::Part);
        assert!(
            !part.is_empty() && part.iter().all(|group| group.starts_with(blade) && !group.contains("hub")),
            "{part:?}"
        );
    }
}

#[test]
fn faults_of_a_blade_of_a_set_name_it() {
    let (given, blade) = with_splitter(7.0);
    let inf = format!("{INF}Blade 1 LE: CutOffEnd\nBlade 0 TE: EllipseEnd\n");
    std::fs::write(given.path().join("b.inf"), inf).unwrap();
    let why = new_job(&blade).expect_err("no flat edge");
    assert!(why.contains("b.inf: blade 1 (splitter): ") && why.contains("leading"), "{why}");
}
