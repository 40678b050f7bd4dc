//! Rates of the interference tests on the scenes and postures of the peer harness, as the harness'
//! own drivers print and write them: one JSON line per rate, verdicts as bytes.
//!
//! `PEER_DATA=… PEER_OUT=… cargo run --release -p facemill-benches --bin peer-scenes -- [SCENE]
//! [RUNS]`

use std::fs;
use std::hint::black_box;
use std::time::Instant;

use facemill_benches::peer::{cpu_time, folder, load_cc, load_mesh, load_records, wall_time};
use facemill_cl_data::{RoundBox, RoundFrustum, Solid};
use facemill_interference::{Interference, MeshTree, lift_to_free, penetration};
use facemill_surface_model::TriMesh;
use facemill_z_map::{NodeHeights, ZMap, ZMapSettings};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

/// Our name in the harness' tables.
const NAME: &str = "facemill";

fn main() {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().unwrap_or_else(|| "patch_200k".to_owned());
    let runs = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(5);
    let mesh = load_mesh(&scene);
    let build = |_| {
        let start = Instant::now();
        black_box(MeshTree::new(&mesh));
        start.elapsed().as_secs_f64()
    };
    let seconds = median((0..runs.max(1)).map(build));
    println!(r#"{{"peer":"{NAME}","scene":"{scene}","test":"build","threads":2,"seconds_wall":{seconds:.3}}}"#);
    let tree = MeshTree::new(&mesh);
    measure_z_map(&scene, &mesh, runs);
    let family = scene.split('_').next().unwrap_or("");
    let (poses, normals) = load_poses(family);
    let cutter = [cutter()];
    let holder = [holder(), head()];
    let all = [cutter[0].clone(), holder[0].clone(), holder[1].clone()];
    for (test, bodies) in [("gouge_round", &cutter[..]), ("holder", &holder[..]), ("full", &all[..])] {
        let hits = |pose: &Isometry3<f64>| {
            bodies
                .iter()
                .any(|(solid, at)| !tree.verdict(solid, &(pose * Translation3::new(0.0, 0.0, *at)), None).is_free())
        };
        let verdicts: Vec<u8> = poses.iter().map(|p| u8::from(hits(p))).collect();
        let file = folder("PEER_OUT").join(format!("{NAME}_{scene}_{test}.u8"));
        fs::write(file, &verdicts).expect("PEER_OUT names the output folder");
        for (kind, want) in [("free", 0u8), ("hit", 1)] {
            let some: Vec<Isometry3<f64>> =
                poses.iter().zip(&verdicts).filter(|(_, v)| **v == want).map(|(p, _)| *p).take(4000).collect();
            measure(&scene, &format!("{test}_{kind}"), &some, runs, |p| {
                black_box(hits(black_box(p)));
            });
        }
        if test == "gouge_round" {
            let hit = (0..poses.len()).filter(|&k| verdicts[k] == 1).map(|k| (poses[k], normals[k]));
            measure_depths(&scene, &tree, &hit.take(4000).collect::<Vec<_>>(), runs);
        }
    }
}

/// The cutter's depth at postures that hit: the lift along the CC point's normal, and the
/// penetration across the surface.
fn measure_depths(scene: &str, tree: &MeshTree, hit: &[(Isometry3<f64>, Unit<Vector3<f64>>)], runs: usize) {
    let (solid, _) = cutter();
    measure(scene, "lift_to_1e-6_hit", hit, runs, |(pose, normal)| {
        black_box(lift_to_free(tree, &solid, black_box(pose), *normal, 1e3, 1e-6));
    });
    measure(scene, "penetration_to_1e-6_hit", hit, runs, |(pose, _)| {
        black_box(penetration(tree, &solid, black_box(pose)));
    });
}

/// Nodes of a Z-map of 0.25 mm per second of processor time of one thread, and of wall time of two,
/// build included.
fn measure_z_map(scene: &str, mesh: &TriMesh, runs: usize) {
    let settings = ZMapSettings { cell: 0.25, margin: 0.0 };
    let frame = Isometry3::identity();
    let heights = || NodeHeights::build(mesh, &frame, &settings).map_or(0, |h| h.n_nodes().iter().product());
    let with_maxima =
        || ZMap::build(mesh, &frame, &settings).map_or(0, |m| m.n_cells().iter().map(|n| n + 1).product());
    for (threads, clock) in [(1, "cpu"), (2, "wall")] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
        let per_s = |build: &(dyn Fn() -> usize + Sync)| {
            pool.install(|| {
                let now = || if threads == 1 { cpu_time() } else { wall_time() };
                median((0..runs.max(1)).map(|_| {
                    let start = now();
                    build() as f64 / (now() - start)
                }))
            })
        };
        for (test, rate) in [("zmap_heights", per_s(&heights)), ("zmap_with_maxima", per_s(&with_maxima))] {
            println!(
                r#"{{"peer":"{NAME}","scene":"{scene}","test":"{test}","threads":{threads},"per_s_{clock}":{rate:.4e}}}"#
            );
        }
    }
}

fn median(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = numbers.collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn cutter() -> (Solid, f64) {
    let body = RoundFrustum { z_low: 2.0, z_high: 48.0, radius_low: 23.0, radius_high: 23.0, rounding: 2.0 };
    (Solid::Frustum(body), 0.0)
}

fn holder() -> (Solid, f64) {
    let body = RoundFrustum { z_low: 50.0, z_high: 150.0, radius_low: 31.5, radius_high: 31.5, rounding: 0.0 };
    (Solid::Frustum(body), 0.0)
}

fn head() -> (Solid, f64) {
    (Solid::Box(RoundBox { half_extents: Vector3::new(100.0, 100.0, 150.0), rounding: 0.0 }), 300.0)
}

/// Median rate by processor time of this thread.
fn measure<P>(scene: &str, test: &str, poses: &[P], runs: usize, f: impl Fn(&P)) {
    if poses.is_empty() {
        return;
    }
    let rounds = 1 + 40_000 / poses.len();
    let median = median((0..runs.max(1)).map(|_| {
        let start = cpu_time();
        (0..rounds).for_each(|_| poses.iter().for_each(&f));
        (cpu_time() - start) / rounds as f64
    }));
    println!(
        r#"{{"peer":"{NAME}","scene":"{scene}","test":"{test}","threads":1,"n":{},"per_s_cpu":{:.4e},"us_cpu":{:.3}}}"#,
        poses.len(),
        poses.len() as f64 / median,
        1e6 * median / poses.len() as f64
    );
}

/// Tool frames (origin at the tip, z along the axis, x along the box) and the normals of their CC
/// points.
fn load_poses(family: &str) -> (Vec<Isometry3<f64>>, Vec<Unit<Vector3<f64>>>) {
    let normals: Vec<_> = load_cc(family).into_iter().map(|(_, normal)| normal).collect();
    let pose = |d: [f64; 15]| {
        let (axis, x) = (Vector3::new(d[6], d[7], d[8]), Vector3::new(d[9], d[10], d[11]));
        let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, axis.cross(&x), axis]));
        let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
        (Isometry3::from_parts(Translation3::new(d[3], d[4], d[5]), rotation), normals[d[0] as usize])
    };
    load_records(family, "poses").into_iter().map(pose).unzip()
}
