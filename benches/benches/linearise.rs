//! Positions that hold a tolerance between the poses of passes over a blade, and how many: against
//! uniform subdivision.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use facemill_benches::machine;
use facemill_cl_data::{ClPoint, CuttingLaw};
use facemill_inverse_kinematics::motion::linearise;
use facemill_inverse_kinematics::motion::{Linearisation, MotionTolerance, deviation_bound};
use facemill_inverse_kinematics::{AxisValues, BranchPreference, Machine};
use nalgebra::{Point3, Unit, Vector3};

const TOOL_LENGTH: f64 = 300.0;
const N_POSES: usize = 100_000;
/// Radius of the cutter, mm.
const RADIUS: f64 = 80.0;

/// Passes to and fro on cylinders about the table's axis, as over blades of 3 m: lean and height
/// wave along them.
fn poses(step: f64) -> Vec<ClPoint> {
    let mut poses = Vec::with_capacity(N_POSES);
    let mut pass = 0_u32;
    while poses.len() < N_POSES {
        let radius = 700.0 + 780.0 * poses.len() as f64 / N_POSES as f64;
        let n = (1.4 * radius / step) as u32;
        for k in 0..n {
            let along = f64::from(if pass.is_multiple_of(2) { k } else { n - 1 - k }) / f64::from(n - 1);
            let (sin, cos) = (1.4 * along).sin_cos();
            let around = Vector3::new(-sin, cos, 0.0);
            let outward = Vector3::new(cos, sin, 0.0);
            let slope = 0.45 + 0.2 * (4.0 * along + 0.01 * radius).sin();
            let lean = around * slope + outward * (0.1 * (7.0 * along).cos() - 0.2);
            let height = 500.0 - 200.0 * along + 30.0 * (5.0 * along).sin();
            let tip = Point3::from(outward * radius + Vector3::z() * height);
            poses.push(ClPoint { tip, axis: Unit::new_normalize(lean + Vector3::z()) });
        }
        pass += 1;
    }
    poses.truncate(N_POSES);
    poses
}

/// Whether a segment cut in `n` parts of equal time holds the tolerance.
fn holds(machine: &Machine, settings: &Linearisation, ends: &[ClPoint], start: &AxisValues, n: usize) -> bool {
    let mut from = *start;
    (1..=n).all(|k| {
        let t = k as f64 / n as f64;
        let axis = Unit::new_normalize(ends[0].axis.slerp(&ends[1].axis, t).into_inner());
        let cl = ClPoint { tip: ends[0].tip + (ends[1].tip - ends[0].tip) * t, axis };
        let to = machine.nearest_inverse(&cl, TOOL_LENGTH, Some(&from), BranchPreference::Nearest).expect("reachable");
        let bound = deviation_bound(machine, settings.law, &from, &to, TOOL_LENGTH);
        from = to;
        settings.tolerance.used_by(&bound) <= 1.0
    })
}

/// Blocks of uniform subdivision: every segment by the smallest number of its own, and all by the
/// largest of these.
fn uniform_blocks(machine: &Machine, settings: &Linearisation, poses: &[ClPoint]) -> (usize, usize) {
    let mut start = machine.home();
    let numbers = poses.windows(2).map(|ends| {
        let near = machine.nearest_inverse(&ends[0], TOOL_LENGTH, Some(&start), BranchPreference::Nearest);
        start = near.expect("reachable");
        (1..).find(|&n| holds(machine, settings, ends, &start, n)).unwrap_or(1)
    });
    let (sum, largest) = numbers.fold((0, 0), |(sum, largest), n: usize| (sum + n, largest.max(n)));
    (sum, largest * (poses.len() - 1))
}

fn linearisation(c: &mut Criterion) {
    let machine = machine();
    let tolerance = MotionTolerance::of_cutter(0.02, RADIUS);
    let mut group = c.benchmark_group("linearise_100k_poses");
    group.sample_size(10).measurement_time(Duration::from_secs(4)).warm_up_time(Duration::from_millis(500));
    group.throughput(Throughput::Elements(N_POSES as u64));
    for (name, step, law) in [
        ("steps_of_1.25_mm", 1.25, CuttingLaw::AxesLinear),
        ("steps_of_20_mm", 20.0, CuttingLaw::AxesLinear),
        ("steps_of_20_mm_rtcp", 20.0, CuttingLaw::TipAndRotariesLinear),
        ("steps_of_100_mm", 100.0, CuttingLaw::AxesLinear),
    ] {
        let poses = poses(step);
        let settings = Linearisation::new(law, TOOL_LENGTH, tolerance);
        let run = || linearise(&machine, black_box(&poses), &machine.home(), &settings).expect("nothing singular");
        let way = run();
        let (by_segment, by_all) = uniform_blocks(&machine, &settings, &poses);
        println!(
            "{name}: {} blocks; uniform by segment {by_segment}, uniform {by_all}; rim bound {:.5} mm",
            way.positions.len() - 1,
            way.rim
        );
        group.bench_function(name, |b| b.iter(|| run().positions.len()));
    }
    group.finish();
}

criterion_group!(benches, linearisation);
criterion_main!(benches);
