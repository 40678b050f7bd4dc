//! Z-map of a mesh: heights of the nodes on one thread, build with proven maxima, and the proof
//! that a body is above it.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use facemill_benches::{bodies, patch_mesh, patch_scene, poses, propeller_mesh};
use facemill_tool_model::Cutter;
use facemill_z_map::{NodeHeights, ZMap, ZMapSettings, certainly_free};
use nalgebra::Isometry3;

fn z_map(c: &mut Criterion) {
    let scene = patch_scene(200);
    let mut group = c.benchmark_group("z_map");
    group.sample_size(10).measurement_time(Duration::from_secs(4));
    for cell in [1.0, 0.25] {
        let settings = ZMapSettings { cell, margin: 0.0 };
        group.bench_function(format!("build_{}_cell_{cell}", scene.name), |b| {
            b.iter(|| ZMap::build(black_box(&scene.mesh), &Isometry3::identity(), &settings));
        });
    }
    let map = ZMap::build(&scene.mesh, &Isometry3::identity(), &ZMapSettings { cell: 1.0, margin: 0.0 })
        .expect("the map fits into memory");
    let cutter = Cutter::new(25.0, 2.0, 50.0).expect("lengths are in range");
    let poses = poses(&cutter, &scene.cc, 0.05);
    let (holder, from_holder) = bodies(&cutter)[1].clone();
    group.bench_function("certainly_free_holder_200_poses", |b| {
        b.iter(|| poses.iter().filter(|p| certainly_free(&map, black_box(&holder), &(**p * from_holder))).count());
    });
    group.finish();
}

/// Heights of the nodes of a map of 0.25 mm, on one thread.
fn heights(c: &mut Criterion) {
    let mut group = c.benchmark_group("z_map_heights");
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread starts");
    let settings = ZMapSettings { cell: 0.25, margin: 0.0 };
    let meshes = [
        ("patch_200k", patch_mesh(316)),
        ("patch_2m", patch_mesh(1000)),
        ("propeller_200k", propeller_mesh(110)),
        ("propeller_2m", propeller_mesh(348)),
    ];
    for (name, mesh) in meshes {
        let build = || NodeHeights::build(black_box(&mesh), &Isometry3::identity(), &settings);
        let n_nodes: usize = build().map_or(0, |map| map.n_nodes().iter().product());
        group.throughput(Throughput::Elements(n_nodes as u64));
        group.bench_function(name, |b| pool.install(|| b.iter(build)));
    }
    group.finish();
}

criterion_group!(benches, z_map, heights);
criterion_main!(benches);
