//! CLOPT's search at CC points and along a pass, on one thread.

use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use facemill_benches::{Scene, blade_scene, machine, patch_scene, tool};
use facemill_cl_data::{Pass, Posture, Silent};
use facemill_cutter_location::cusp::Strip;
use facemill_cutter_location::{
    Hints, Obstacle, PassSettings, PassTask, PoseTest, PostureMode, SearchCurve, SearchOrder, SearchSettings,
    SmoothSettings, Workcell, plan_passes, search,
};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::BranchPreference;
use facemill_tool_model::ToolAssembly;
use nalgebra::Isometry3;

fn scene(c: &mut Criterion, scene: &Scene, tool: &ToolAssembly) {
    let machine = machine();
    let tree = MeshTree::new(&scene.mesh);
    let cell = Workcell {
        machine: &machine,
        table_from_work: Isometry3::translation(0.0, 0.0, 700.0),
        tool,
        obstacles: vec![Obstacle {
            name: "part".to_owned(),
            mesh: &tree,
            gouge_allowance: Some(0.0),
            collision_allowance: 1.0,
            machine_body: None,
            pieces: None,
        }],
        preferred_branch: BranchPreference::Positive,
        axis_cone: None,
        gouge_tolerance: 0.02,
        max_lift: 0.05,
        lift_resolution: 0.002,
        z_map: None,
    };
    let test = PoseTest::new(&cell);
    let deg = |tilt: f64, rotate: f64| Posture { tilt: tilt.to_radians(), rotate: rotate.to_radians() };
    let curve =
        SearchCurve::new(deg(2.0, 0.0), deg(15.0, -85.0), SearchOrder::TiltFirst, 1.0).expect("ranges are valid");
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
    let tasks = [PassTask { pass: Pass::new(scene.cc.clone()), curve, strips: Vec::new() }];
    let pass_settings = |mode| PassSettings { search: settings, mode, max_turn_per_mm: 0.1f64.to_radians() };
    let smooth = SmoothSettings { feed: 20.0, cusp: 0.1, strip: Strip { step_over: 20.0, curvature: 0.0 } };
    for (name, mode) in [("pass", PostureMode::Smallest), ("smooth pass", PostureMode::Smooth(smooth))] {
        let settings = pass_settings(mode);
        group.bench_function(name, |b| b.iter(|| plan_passes(&test, &tasks, &settings, &Silent)));
    }
    group.finish();
}

fn bench(c: &mut Criterion) {
    scene(c, &patch_scene(500), &tool(25.0, 2.0));
    scene(c, &blade_scene(500), &tool(80.0, 6.0));
}

criterion_group!(benches, bench);
criterion_main!(benches);
