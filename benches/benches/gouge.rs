//! Interference of a cutter, and of cutter, holder and box, with a mesh of 200,000 triangles:
//! verdicts, distances, motions, seating; parry3d in the same run as the plain reference.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use facemill_benches::{Scene, blade_scene, bodies, patch_scene, poses};
use facemill_cl_data::{CcPoint, Solid};
use facemill_interference::{Interference, MeshTree, MotionInterval, ParryMesh, SweepVerdict, TurnRange, lift_to_free};
use facemill_tool_model::Cutter;
use nalgebra::{Isometry3, Point3, Vector3};

/// A posture that hits, and where.
type Hit = (Isometry3<f64>, CcPoint);

/// CC points of a scene with the lifted poses that are free, and those that are not.
fn split(
    mesh: &dyn Interference,
    solid: &Solid,
    poses: &[Isometry3<f64>],
    cc: &[CcPoint],
) -> (Vec<Isometry3<f64>>, Vec<Hit>) {
    let mut free = Vec::new();
    let mut hit = Vec::new();
    for (pose, cc) in poses.iter().zip(cc) {
        if mesh.verdict(solid, pose, None).is_free() { free.push(*pose) } else { hit.push((*pose, *cc)) }
    }
    (free, hit)
}

/// A slide of 0.2 mm across the tool axis, with a turn of 0.1°.
fn slide(mesh_from_solid: Isometry3<f64>) -> MotionInterval {
    let (velocity, spin) = (mesh_from_solid * Vector3::x() * 0.1, mesh_from_solid * Vector3::z() * 1e-3);
    MotionInterval { mesh_from_solid, velocity, spin, half: 1.0, deviation: 1e-4 }
}

/// Turns about the tip by 0.05° across the tool axis and 0.5° about it, either way.
fn turn(mesh_from_solid: Isometry3<f64>) -> TurnRange {
    let turns = [mesh_from_solid * Vector3::x() * 1e-3, mesh_from_solid * Vector3::z() * 1e-2];
    TurnRange { mesh_from_solid, center: mesh_from_solid * Point3::origin(), turns, shift: 0.0 }
}

fn scene(c: &mut Criterion, scene: &Scene, cutter: &Cutter, name: &str) {
    let tree = MeshTree::new(&scene.mesh);
    let parry = ParryMesh::new(&scene.mesh);
    let bodies = bodies(cutter);
    let (solid, _) = bodies[0].clone();
    let lifted = poses(cutter, &scene.cc, 0.05);
    let (free, _) = split(&tree, &solid, &lifted, &scene.cc);
    let sunk = poses(cutter, &scene.cc, -0.05);
    let (_, hit) = split(&tree, &solid, &sunk, &scene.cc);
    let mut group = c.benchmark_group(format!("gouge_{}_{name}", scene.name));
    group.sample_size(10).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(500));
    group.throughput(Throughput::Elements(free.len() as u64));
    group.bench_function("free", |b| {
        b.iter(|| free.iter().filter(|p| tree.verdict(black_box(&solid), p, None).is_free()).count());
    });
    group.bench_function("free_with_holder_and_box", |b| {
        b.iter(|| {
            let all = |p: &&Isometry3<f64>| {
                bodies.iter().all(|(solid, pose)| tree.verdict(black_box(solid), &(**p * pose), None).is_free())
            };
            free.iter().filter(all).count()
        });
    });
    group.bench_function("core_distance", |b| {
        let reach = solid.rounding() + 0.1;
        b.iter(|| free.iter().filter_map(|p| tree.core_distance(black_box(&solid), p, reach, None)).count());
    });
    let moving: Vec<_> = free.iter().map(|&p| slide(p)).collect();
    group.bench_function("sweep", |b| {
        let clear = |m: &&MotionInterval| tree.sweep(black_box(&solid), m, None) == SweepVerdict::Clear;
        b.iter(|| moving.iter().filter(clear).count());
    });
    let turning: Vec<_> = free.iter().map(|&p| turn(p)).collect();
    group.bench_function("turn", |b| {
        let clear = |r: &&TurnRange| tree.turn(black_box(&solid), r, None) == SweepVerdict::Clear;
        b.iter(|| turning.iter().filter(clear).count());
    });
    group.throughput(Throughput::Elements(hit.len() as u64));
    group.bench_function("hit", |b| {
        b.iter(|| hit.iter().filter(|(p, _)| tree.verdict(black_box(&solid), p, None).is_free()).count());
    });
    group.bench_function("seat_to_1um", |b| {
        b.iter(|| hit.iter().filter_map(|(p, cc)| lift_to_free(&tree, &solid, p, cc.normal, 0.5, 1e-3)).count());
    });
    let few = &free[..free.len().min(5)];
    group.throughput(Throughput::Elements(few.len() as u64));
    group.bench_function("free_parry", |b| {
        b.iter(|| few.iter().filter(|p| parry.verdict(black_box(&solid), p, None).is_free()).count());
    });
    group.finish();
}

fn gouge(c: &mut Criterion) {
    let small = Cutter::new(25.0, 2.0, 50.0).expect("lengths are in range");
    let large = Cutter::new(80.0, 6.0, 50.0).expect("lengths are in range");
    scene(c, &patch_scene(300), &small, "r25");
    scene(c, &blade_scene(300), &large, "r80");
    // The other way round: a large disc over waves, a small one on a flat blade.
    scene(c, &patch_scene(300), &large, "r80");
    scene(c, &blade_scene(300), &small, "r25");
}

criterion_group!(benches, gouge);
criterion_main!(benches);
