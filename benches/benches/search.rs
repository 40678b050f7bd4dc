//! CLOPT's search at CC points and along a pass, on one thread.

use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use facemill_benches::{
    Scene, blade_passes, blade_scene, machine, patch_passes, patch_scene, search_curve, tool, work_cell,
};
use facemill_cl_data::{CcPoint, Pass, Silent};
use facemill_cutter_location::cusp::cut_point::Strip;
use facemill_cutter_location::{
    Hints, PassSettings, PassTask, PoseTest, PostureMode, SearchSettings, SmoothSettings, plan_passes, search,
};
use facemill_interference::MeshTree;
use facemill_tool_model::ToolAssembly;

fn scene(c: &mut Criterion, scene: &Scene, passes: &[Vec<CcPoint>], tool: &ToolAssembly, step_over: f64) {
    let machine = machine();
    let tree = MeshTree::new(&scene.mesh);
    let cell = work_cell(&machine, tool, &tree, 0.05);
    let test = PoseTest::new(&cell);
    let curve = search_curve();
    let settings = SearchSettings::default();
    let mut group = c.benchmark_group(format!("search_{}", scene.name));
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    group.throughput(Throughput::Elements(scene.cc.len() as u64));
    group.bench_function("point", |b| {
        b.iter(|| {
            let mut hints = Hints::default();
            scene.cc.iter().filter(|cc| search(&test, cc, &curve, &settings, 0.0, None, &mut hints).is_ok()).count()
        });
    });
    let tasks: Vec<PassTask> = passes
        .iter()
        .map(|p| PassTask { pass: Pass::new(p.clone()), curve, strips: Vec::new(), given: Vec::new() })
        .collect();
    let points: usize = passes.iter().map(Vec::len).sum();
    group.throughput(Throughput::Elements(points as u64));
    let smooth = SmoothSettings { feed: 20.0, cusp: 0.1, strip: Strip::on_plane(step_over), widest: step_over };
    let one_core = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    for (name, mode) in [("passes", PostureMode::Smallest), ("smooth passes", PostureMode::Smooth(smooth))] {
        let settings = PassSettings { search: settings, mode, max_turn_per_mm: 0.1f64.to_radians() };
        group.bench_function(format!("{name} of {points}"), |b| {
            b.iter(|| one_core.install(|| plan_passes(&test, &tasks, &settings, &Silent)));
        });
    }
    group.finish();
}

fn bench(c: &mut Criterion) {
    scene(c, &patch_scene(10_000), &patch_passes(), &tool(25.0, 2.0), 3.4);
    scene(c, &blade_scene(10_000), &blade_passes(), &tool(80.0, 6.0), 17.0);
}

criterion_group!(benches, bench);
criterion_main!(benches);
