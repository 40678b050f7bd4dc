//! Depths of a cutter in a mesh to 1e-6 mm, on one thread, and the build of the tree that they
//! walk.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use facemill_benches::{Scene, blade_scene, bodies, patch_mesh, patch_scene, poses, propeller_mesh};
use facemill_interference::{Interference, MeshTree, lift_to_free, penetration};
use facemill_tool_model::Cutter;

/// Lifts and penetrations at postures sunk by 0.05 and by 3 mm: in the corner's skin, and with the
/// core in the surface.
fn depths(c: &mut Criterion, scene: &Scene, cutter: &Cutter) {
    let tree = MeshTree::new(&scene.mesh);
    let (solid, _) = bodies(cutter)[0].clone();
    let mut group = c.benchmark_group(format!("depth_{}", scene.name));
    group.measurement_time(Duration::from_secs(3));
    for (name, sunk) in [("skin", 0.05), ("core", 3.0)] {
        let sunk = poses(cutter, &scene.cc, -sunk);
        let hit: Vec<_> =
            sunk.iter().zip(&scene.cc).filter(|(pose, _)| !tree.verdict(&solid, pose, None).is_free()).collect();
        group.throughput(Throughput::Elements(hit.len() as u64));
        group.bench_function(format!("lift_{name}"), |b| {
            let lift = |(pose, cc): &(&_, &facemill_cl_data::CcPoint)| {
                lift_to_free(&tree, black_box(&solid), pose, cc.normal, 1e3, 1e-6)
            };
            b.iter(|| hit.iter().filter_map(lift).sum::<f64>());
        });
        group.bench_function(format!("penetration_{name}"), |b| {
            b.iter(|| hit.iter().filter_map(|(pose, _)| penetration(&tree, black_box(&solid), pose)).count());
        });
    }
    group.finish();
}

/// The tree over 2 million triangles, on all threads.
fn build(c: &mut Criterion) {
    let mut group = c.benchmark_group("tree_build");
    group.sample_size(10).measurement_time(Duration::from_secs(8));
    for (name, mesh) in [("patch_2m", patch_mesh(1000)), ("propeller_2m", propeller_mesh(348))] {
        group.throughput(Throughput::Elements(mesh.triangles().len() as u64));
        group.bench_function(name, |b| b.iter_with_large_drop(|| MeshTree::new(black_box(&mesh))));
    }
    group.finish();
}

fn depth(c: &mut Criterion) {
    depths(c, &patch_scene(300), &Cutter::new(25.0, 2.0, 50.0).expect("lengths are in range"));
    depths(c, &blade_scene(300), &Cutter::new(80.0, 6.0, 50.0).expect("lengths are in range"));
    build(c);
}

criterion_group!(benches, depth);
criterion_main!(benches);
