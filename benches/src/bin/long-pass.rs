//! Smooth postures of one pass of very many points: time and memory.
//!
//! `cargo run --release -p facemill-benches --bin long-pass -- [POINTS]`

use std::time::Instant;

use facemill_benches::{machine, search_curve, tool, work_cell};
use facemill_cl_data::{CcPoint, Pass, Silent};
use facemill_cutter_location::cusp::cut_point::Strip;
use facemill_cutter_location::{
    PassSettings, PassTask, PoseTest, PostureMode, SearchSettings, SmoothSettings, plan_passes,
};
use facemill_interference::MeshTree;
use facemill_sample_parts::{PatchSpec, patch};
use nalgebra::Vector3;

/// Largest memory that the process has had, MB, where the system tells.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some(line.trim().trim_end_matches(" kB").parse::<f64>().ok()? / 1024.0)
}

fn main() {
    let points: usize = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(100_000);
    let spec = PatchSpec::new([3000.0, 200.0], 15.0, [6.0, 1.0]).expect("numbers are in range");
    let tree = MeshTree::new(&patch(&spec, 1200, 80).expect("numbers are in range"));
    let (machine, tool) = (machine(), tool(25.0, 2.0));
    let cell = work_cell(&machine, &tool, &tree, 0.06);
    let cc = |k: usize| {
        let p = spec.at(2900.0 * k as f64 / (points - 1) as f64 - 1450.0, 10.0);
        CcPoint::new(p.point, p.normal.into_inner(), Vector3::x()).expect("the patch is nowhere vertical")
    };
    let task = PassTask {
        pass: Pass::new((0..points).map(cc).collect()),
        curve: search_curve(),
        strips: Vec::new(),
        given: Vec::new(),
    };
    // Every tenth point a layer.
    let settings = PassSettings {
        search: SearchSettings::default(),
        mode: PostureMode::Smooth(SmoothSettings { feed: 20.0, cusp: 0.1, strip: Strip::on_plane(8.0), widest: 8.0 }),
        max_turn_per_mm: 0.1 * 2.0 / (2900.0 / points as f64) / 57.3,
    };
    let before = peak_memory();
    let start = Instant::now();
    let planned = plan_passes(&PoseTest::new(&cell), &[task], &settings, &Silent).expect("nobody cancels").remove(0);
    let seconds = start.elapsed().as_secs_f64();
    let posed = planned.outcomes.points.iter().filter(|o| o.is_ok()).count();
    println!("{points} points, {posed} with a pose, {seconds:.1} s; {:?}", planned.optimum);
    if let (Some(before), Some(after)) = (before, peak_memory()) {
        println!("peak memory {after:.0} MB, {before:.0} MB of it before");
    }
}
