//! Laws of meshes that are wound inside out: one message that names file, triangles and key, and
//! none if the mesh does not decide.

use std::path::Path;

use facemill_job::examples::new_job::{NewJob, new_job};
use facemill_job::load::job::Job;
use facemill_job::stages::SilentStages;
use facemill_job_check::describe_setup;
use facemill_nc_program::Dialect;
use facemill_surface_model::{NamedNode, TriMesh, write_obj};
use facemill_verification::program::{VerifyRequest, verify_program};
use nalgebra::{Isometry3, Point3};

use crate::plan::plan_setup;
use crate::plan_settings::PlanSettings;

/// Returns a round wall along x with an outline of these half-axes, wound outward and open at both
/// ends, mm.
fn wall(chord: f64, thickness: f64) -> TriMesh {
    let (n, rows) = (32, 12);
    let (vertices, triangles) = facemill_test_kit::grid_around([rows, n], |i, j| {
        let (s, c) = (f64::from(j) / f64::from(n) * std::f64::consts::TAU).sin_cos();
        Point3::new(-100.0 + 200.0 * f64::from(i) / f64::from(rows), 0.5 * chord * c, -0.5 * thickness * s)
    });
    TriMesh::new(vertices, triangles).unwrap()
}

fn blade() -> TriMesh {
    wall(100.0, 12.0)
}

/// Returns the patch job with another mesh in place of its own.
fn job_with(folder: &Path, mesh: &TriMesh, settings: &[&str]) -> Job {
    for (name, bytes) in new_job(&NewJob::Patch { size_mm: 400.0 }).unwrap() {
        let bytes = if name.ends_with(".obj") { obj(mesh) } else { bytes };
        std::fs::write(folder.join(name), bytes).unwrap();
    }
    let mut all = vec!["setups[0].clearance={\"sphere\":{\"radius_mm\":400}}".parse().unwrap()];
    all.extend(settings.iter().map(|s| s.parse().unwrap()));
    Job::read_with(&folder.join("job.json"), &all).unwrap()
}

fn obj(mesh: &TriMesh) -> Vec<u8> {
    write_obj(&[mesh], &[NamedNode { name: "part", mesh: 0, transform: Isometry3::identity() }]).unwrap()
}

/// Returns the lines of `check`, or its message.
fn verdict(mesh: &TriMesh, settings: &[&str]) -> Result<Vec<String>, String> {
    let folder = tempfile::tempdir().unwrap();
    describe_setup(&job_with(folder.path(), mesh, settings), 0).map_err(|e| e.to_string())
}

const TURNED: &str = "setups[0].meshes[0].reverse_winding=true";

#[test]
fn open_blades_that_are_wound_inward_are_refused_with_file_count_and_key() {
    let two = blade().joined(&blade().transformed(&Isometry3::translation(0.0, 0.0, 60.0)));
    let right = verdict(&two, &[]).unwrap();
    assert!(!right.iter().any(|line| line.contains("reverse_winding")), "{right:?}");
    let wrong = verdict(&two.clone().reversed(), &[]).unwrap_err();
    for part in
        ["setups[0].meshes[0]: ", ".obj: 1536 of 1536 triangles", "2 connected pieces", "\"reverse_winding\": true"]
    {
        assert!(wrong.contains(part), "{part}: {wrong}");
    }
    let mended = verdict(&two.clone().reversed(), &[TURNED]).unwrap();
    assert!(mended[3].contains("turned all of them (reverse_winding)"), "{mended:?}");
    assert_eq!(mended[4..], right[4..], "the same passes as of the mesh that is wound well");
    let wrong = verdict(&two, &[TURNED]).unwrap_err();
    assert!(wrong.contains("\"reverse_winding\": false"), "{wrong}");
}

#[test]
fn a_plan_of_an_inward_mesh_is_one_message() {
    let folder = tempfile::tempdir().unwrap();
    let job = job_with(folder.path(), &blade().reversed(), &[]);
    let settings = PlanSettings { verify: false, certificates: false };
    let message = plan_setup(&job, 0, settings, &SilentStages).err().unwrap().to_string();
    assert!(message.contains("reverse_winding") && !message.contains("gouges"), "{message}");
}

#[test]
fn of_a_mesh_of_mixed_winding_the_inward_piece_is_named_and_no_key_promised() {
    let mixed = blade().joined(&blade().reversed().transformed(&Isometry3::translation(0.0, 0.0, 60.0)));
    let message = verdict(&mixed, &[]).unwrap_err();
    for part in ["768 of 1536 triangles", "1 connected piece,", "from triangle 768 on", "mixed winding"] {
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn a_closed_part_that_is_wound_inward_is_refused_too() {
    let closed = facemill_interference::solid_mesh(&facemill_cl_data::Solid::Box(facemill_cl_data::RoundBox {
        half_extents: nalgebra::Vector3::new(100.0, 100.0, 20.0),
        rounding: 0.0,
    }))
    .unwrap();
    assert!(!verdict(&closed, &[]).is_err_and(|e| e.contains("reverse_winding")));
    let message = verdict(&closed.reversed(), &[]).unwrap_err();
    assert!(message.contains("12 of 12 triangles are wound inside out"), "{message}");
}

/// The same message, and none of thousands of gouges.
#[test]
fn a_program_is_not_verified_on_a_part_that_is_wound_inward() {
    let folder = tempfile::tempdir().unwrap();
    let verdict = |mesh: &TriMesh| {
        let job = job_with(folder.path(), mesh, &[]);
        let request = VerifyRequest { fast: true, ..VerifyRequest::new(Path::new("a.nc"), Dialect::Fanuc) };
        verify_program(&job, b"G90 G54 G21 G94\nM30\n", &request, &SilentStages).map(|_| ()).map_err(|e| e.to_string())
    };
    verdict(&blade()).unwrap();
    let message = verdict(&blade().reversed()).unwrap_err();
    assert!(message.contains("setups[0].meshes[0]: ") && message.contains("\"reverse_winding\": true"), "{message}");
}

#[test]
fn no_mesh_is_refused_that_may_be_a_surface_or_a_hollow() {
    // A flat plate and a bore of 90 mm that the cutter of 40 mm fits into: both may be intended,
    // and the user gets a note.
    let corners = [(-100.0, -100.0), (100.0, -100.0), (100.0, 100.0), (-100.0, 100.0)];
    let vertices = corners.iter().map(|&(x, y)| Point3::new(x, y, 0.0)).collect();
    let plate = TriMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let lines = verdict(&plate, &[]).unwrap().join("\n");
    assert!(lines.contains("does not decide on which side of 2 of 2 triangles the material is"), "{lines}");
    let lines = verdict(&wall(90.0, 90.0).reversed(), &[]).unwrap().join("\n");
    assert!(
        lines.contains("768 of 768 triangles are the wall of a hollow with room for the tool, or wound"),
        "{lines}"
    );
}
