//! The scenes that the peer harness writes, read from the folder that `PEER_DATA` names.

use std::fs;
use std::path::PathBuf;

use facemill_surface_model::TriMesh;
use nalgebra::{Point3, Unit, Vector3};
use rustix::time::{ClockId, clock_gettime};

/// The folder that an environment variable names.
///
/// # Panics
/// Where the variable is not set.
pub fn folder(variable: &str) -> PathBuf {
    std::env::var_os(variable).map(PathBuf::from).unwrap_or_else(|| panic!("{variable} names a folder"))
}

/// The mesh of a scene, such as `patch_200k`, mm.
///
/// # Panics
/// Where the file is not there or no mesh.
pub fn load_mesh(scene: &str) -> TriMesh {
    let bytes = fs::read(folder("PEER_DATA").join(format!("{scene}.mesh"))).expect("the scene is there");
    let count = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes")) as usize;
    let (n_vertices, n_triangles) = (count(0), count(8));
    let (vertices, rest) = bytes[16..].split_at(24 * n_vertices);
    let vertices = vertices.chunks_exact(24).map(|c| Point3::from(numbers::<3>(c))).collect();
    let index = |c: &[u8]| u32::from_le_bytes(c.try_into().expect("four bytes"));
    let triangles =
        rest.chunks_exact(12).take(n_triangles).map(|c| [index(&c[..4]), index(&c[4..8]), index(&c[8..])]).collect();
    TriMesh::new(vertices, triangles).expect("the scene is a mesh")
}

/// The CC points of a family of scenes, `patch` or `prop`, with their normals.
///
/// # Panics
/// Where the file is not there.
pub fn load_cc(family: &str) -> Vec<(Point3<f64>, Unit<Vector3<f64>>)> {
    let of = |d: [f64; 6]| (Point3::new(d[0], d[1], d[2]), Unit::new_normalize(Vector3::new(d[3], d[4], d[5])));
    load_records(family, "cc").into_iter().map(of).collect()
}

/// Records of `N` numbers of a file of a family of scenes.
///
/// # Panics
/// Where the file is not there.
pub fn load_records<const N: usize>(family: &str, name: &str) -> Vec<[f64; N]> {
    let bytes = fs::read(folder("PEER_DATA").join(format!("{family}_{name}.bin"))).expect("the records are there");
    bytes.chunks_exact(8 * N).map(numbers).collect()
}

fn numbers<const N: usize>(bytes: &[u8]) -> [f64; N] {
    std::array::from_fn(|k| f64::from_le_bytes(bytes[8 * k..8 * k + 8].try_into().expect("eight bytes")))
}

/// Seconds that this thread has run, to the nanosecond.
pub fn cpu_time() -> f64 {
    seconds(ClockId::ThreadCPUTime)
}

/// Seconds that have passed.
pub fn wall_time() -> f64 {
    seconds(ClockId::Monotonic)
}

fn seconds(clock: ClockId) -> f64 {
    let time = clock_gettime(clock);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
