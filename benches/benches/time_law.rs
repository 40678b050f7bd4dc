//! Laws of motion: the published benchmark, and programs of 100 000 and a million blocks.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use facemill_feedrate::{
    AxisBounds, ProgramBlock, ProgramLaw, ProgramSettings, TimeLawSettings, minimum_time_law, program_law,
};
use facemill_inverse_kinematics::AxisValues;
use rustix::time::{ClockId, clock_gettime};

#[path = "../../crates/feedrate/tests/laws/time_law/spline_path.rs"]
#[expect(dead_code, reason = "the tests of the same path need more of it")]
mod spline_path;

const N_BLOCKS: usize = 100_000;

fn published(c: &mut Criterion) {
    let bounds = spline_path::published_bounds();
    let mut group = c.benchmark_group("time_law_published_path");
    group.sample_size(10).measurement_time(Duration::from_secs(8)).warm_up_time(Duration::from_millis(500));
    let efforts = [
        ("100_spans", TimeLawSettings { spans: 100, rounds: 2 }),
        ("default", TimeLawSettings::default()),
        ("thorough", TimeLawSettings { spans: 10_000, ..TimeLawSettings::default() }),
    ];
    for (name, settings) in efforts {
        let run = || minimum_time_law(&spline_path::SplinePath, black_box(&bounds), &settings).expect("a smooth path");
        println!("{name}: {:.4} s of motion with {} spans", run().total_time(), settings.spans);
        group.bench_function(name, |b| b.iter(|| run().total_time()));
    }
    group.finish();
}

/// Three linear and two rotary axes.
fn axes() -> [AxisBounds; 5] {
    let linear = AxisBounds { velocity: 250.0, acceleration: 2000.0, jerk: 30_000.0 };
    let rotary = AxisBounds { velocity: 1.0, acceleration: 10.0, jerk: 100.0 };
    [linear, linear, linear, rotary, rotary]
}

/// Numbers from −½ to ½.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut random = facemill_test_kit::Random(seed);
    move || random.unit() - 0.5
}

/// The blocks at 60 mm/s, each end off the waves by so much at most in each linear axis, mm.
fn jagged(n: usize, off: f64) -> (AxisValues, Vec<ProgramBlock>) {
    let mut random = noise(9);
    let (start, mut blocks) = dense(n, 60.0);
    for block in &mut blocks {
        (0..3).for_each(|k| block.end[k] += 2.0 * off * random());
    }
    (start, blocks)
}

/// Blocks of about 0.3 mm along waves, at a tip feed in mm/s.
fn dense(n: usize, tip_feed: f64) -> (AxisValues, Vec<ProgramBlock>) {
    let at = |k: usize| {
        let s = 0.3 * k as f64;
        let pass = s / 300.0;
        let x = 150.0 * (std::f64::consts::PI * pass).cos();
        let (y, z) = (0.2 * pass + 20.0 * (s / 40.0).sin(), 50.0 * (s / 37.0).cos());
        AxisValues::from([x, y, z, 0.3 * (s / 90.0).sin(), 0.2 * (s / 110.0).cos()])
    };
    let block = |k| ProgramBlock { end: at(k), tip_time: 0.3 / tip_feed, exact_stop: false };
    (at(0), (1..=n).map(block).collect())
}

/// Blocks of 5 mm to and fro with sharp corners.
fn sharp(n: usize) -> (AxisValues, Vec<ProgramBlock>) {
    let mut random = noise(5);
    let mut at = AxisValues::zeros(5);
    let mut block = || {
        at = AxisValues::from_fn(5, |k| at[k] + random() * if k < 3 { 10.0 } else { 0.05 });
        ProgramBlock { end: at, tip_time: 0.0, exact_stop: false }
    };
    (AxisValues::zeros(5), (0..n).map(|_| block()).collect())
}

fn timed((start, blocks): &(AxisValues, Vec<ProgramBlock>)) -> ProgramLaw {
    let settings = ProgramSettings::blended(AxisValues::from([0.01, 0.01, 0.01, 1e-4, 1e-4]));
    program_law(start, black_box(blocks), &axes(), &settings).expect("a good program")
}

/// Seconds of all processors that this process has used.
fn processor_seconds() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}

fn programs(c: &mut Criterion) {
    let mut group = c.benchmark_group("program_law_100k_blocks");
    group.sample_size(10).measurement_time(Duration::from_secs(10)).warm_up_time(Duration::from_millis(500));
    group.throughput(Throughput::Elements(N_BLOCKS as u64));
    type Make = fn(usize) -> (AxisValues, Vec<ProgramBlock>);
    let kinds: [(&str, Make); 5] = [
        ("dense_at_60_mm_s", |n| dense(n, 60.0)),
        ("dense_without_cap", |n| dense(n, 1e9)),
        ("jagged_by_0_02_mm", |n| jagged(n, 0.02)),
        ("jagged_by_0_1_mm", |n| jagged(n, 0.1)),
        ("sharp_corners", sharp),
    ];
    for (name, make) in kinds {
        let program = make(10 * N_BLOCKS);
        let (wall, processor) = (Instant::now(), processor_seconds());
        let law = timed(&program);
        let (wall, processor) = (wall.elapsed().as_secs_f64(), processor_seconds() - processor);
        let (time, parts) = (law.total_time(), law.parts());
        println!("{name}, a million blocks: {wall:.2} s, {processor:.2} s of processors; {time:.1} s in {parts} parts");
        let program = make(N_BLOCKS);
        group.bench_function(name, |b| b.iter(|| timed(&program).total_time()));
    }
    group.finish();
}

criterion_group!(benches, published, programs);
criterion_main!(benches);
