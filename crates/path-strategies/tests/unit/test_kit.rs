//! Jobs for the tests.

use facemill_job::examples::new_job::{NewJob, new_job};
use facemill_job::load::job::Job;
use facemill_surface_model::{NamedNode, TriMesh, write_obj};
use nalgebra::{Isometry3, Point3};
use serde_json::{Value, json};

/// Returns the job of a patch of 20 mm by 20 mm of this shape, with this path.
pub(crate) fn patch_job(folder: &tempfile::TempDir, z: fn(f64) -> f64, path: &Value) -> Job {
    let [n, m] = [160, 4];
    let at = |k: u32, n: u32| 20.0 * f64::from(k) / f64::from(n) - 10.0;
    let (vertices, triangles) =
        facemill_test_kit::grid_by_rows([n, m], |i, j| Point3::new(at(i, n), at(j, m), z(at(i, n))));
    let sheet = TriMesh::new(vertices, triangles).unwrap();
    for (name, bytes) in new_job(&NewJob::Patch { size_mm: 80.0 }).unwrap() {
        let bytes = match name.as_str() {
            "patch.obj" => {
                write_obj(&[&sheet], &[NamedNode { name: "patch", mesh: 0, transform: Isometry3::identity() }]).unwrap()
            }
            "job.json" => {
                let mut job: Value = serde_json::from_slice(&bytes).unwrap();
                job["operations"][0]["path"] = path.clone();
                job["setups"][0]["clearance"]["plane"]["origin_mm"][2] = json!(40.0);
                serde_json::to_vec(&job).unwrap()
            }
            _ => bytes,
        };
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    Job::read(&folder.path().join("job.json")).unwrap()
}
