//! A hood: a sheet that is curved about two directions, with passes laid over its short way, which
//! turn the rotary axes most.

use facemill::file_format::to_json;
use facemill::new_job::{NewJob, new_job};
use facemill::surface_model::{NamedNode, TriMesh, write_obj};
use facemill_test_kit::grid_by_rows;
use nalgebra::{Isometry3, Point3};
use serde_json::{Value, json};

use crate::jobs::set;

/// A hood above a square about the origin.
#[derive(Clone, Copy, Debug)]
pub struct Hood {
    /// Length of the sides of the square, mm.
    pub size: f64,
    /// Radii of curvature at the top, along x and along y, mm.
    pub radii: [f64; 2],
    /// Quads along each side.
    pub quads: u32,
    /// Programmed feed, mm/min.
    pub feed: f64,
}

impl Hood {
    /// The hood of the benchmarks: 1 m², 500,000 triangles.
    pub const LARGE: Self = Self { size: 1000.0, radii: [1250.0, 875.0], quads: 500, feed: 3000.0 };

    /// Files of a job that cuts it by planes along y, on the mill with the head B and the table C.
    ///
    /// # Panics
    /// When the example does not exist.
    pub fn files(&self) -> Vec<(String, Vec<u8>)> {
        let mut files = new_job(&NewJob::Patch { size_mm: self.size }).expect("an example");
        for (name, bytes) in &mut files {
            match name.as_str() {
                "patch.obj" => *bytes = self.obj(),
                "job.json" => *bytes = self.job(bytes),
                _ => {}
            }
        }
        files
    }

    fn job(&self, patch: &[u8]) -> Vec<u8> {
        let mut job: Value = serde_json::from_slice(patch).expect("JSON");
        let planes = json!({ "parallel_planes": { "normal": [1.0, 0.0, 0.0] } });
        let values = [
            ("/name", json!(format!("hood of {} mm", self.size))),
            ("/setups/0/clearance/plane/origin_mm/2", json!(30.0)),
            ("/operations/0/path/strategy/strategy", planes),
            ("/operations/0/feeds/cutting_mm_min", json!(self.feed)),
            ("/operations/0/feeds/approach_mm_min", json!(self.feed)),
        ];
        for (pointer, value) in values {
            set(&mut job, pointer, value);
        }
        to_json(&job).into_bytes()
    }

    fn obj(&self) -> Vec<u8> {
        let n = self.quads;
        let at = |k: u32| self.size * (f64::from(k) / f64::from(n) - 0.5);
        let height = |x: f64, y: f64| -0.5 * (x * x / self.radii[0] + y * y / self.radii[1]);
        let (vertices, triangles) = grid_by_rows([n, n], |i, j| Point3::new(at(i), at(j), height(at(i), at(j))));
        let mesh = TriMesh::new(vertices, triangles);
        let node = NamedNode { name: "hood", mesh: 0, transform: Isometry3::identity() };
        write_obj(&[&mesh.expect("a sheet")], &[node]).expect("a mesh")
    }
}
