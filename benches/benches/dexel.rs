//! Dexel map of 0.25 mm lines: a pass cut, the same pass lifted by 0.01 mm tested without a cut,
//! single cuts into full material, and a pass on one thread and on two.
//!
//! All but the last count the processor time of one thread: what else runs does not count, though
//! it takes the cache.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use facemill_cl_data::ClPoint;
use facemill_tool_model::Cutter;
use facemill_z_map::{DexelMap, Sweep, TurnedBody};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use rayon::{ThreadPool, ThreadPoolBuilder};
use rustix::time::{ClockId, clock_gettime};

/// Name, R, r and axis.
const CUTTERS: [(&str, f64, f64, [f64; 3]); 4] = [
    ("flat_upright", 25.0, 0.0, [0.0, 0.0, 1.0]),
    ("bull_upright", 25.0, 6.0, [0.0, 0.0, 1.0]),
    ("bull_tilted", 25.0, 6.0, [0.05, 0.03, 1.0]),
    ("ball_tilted", 12.0, 12.0, [0.2, 0.1, 1.0]),
];

fn stock(depth: f64, top: f64) -> DexelMap {
    DexelMap::of_box(&Isometry3::identity(), [0.0, 0.0, -depth], [300.0, 100.0, top], 0.25).expect("the box is a box")
}

fn pose(tip: [f64; 3], axis: [f64; 3]) -> ClPoint {
    ClPoint { tip: Point3::from(tip), axis: Unit::new_normalize(Vector3::from(axis)) }
}

/// 200 blocks of about 1 mm along a wavy line, a few mm deep.
fn pass(axis: [f64; 3], lift: f64) -> Vec<[ClPoint; 2]> {
    let at = |k: u32| {
        let x = 40.0 + f64::from(k);
        pose([x, 50.0 + 3.0 * (0.05 * x).sin(), lift - 4.0 - (0.03 * x).sin()], axis)
    };
    (0..200).map(|k| [at(k), at(k + 1)]).collect()
}

/// Four motions of 5 mm that do not touch each other.
fn apart(axis: [f64; 3]) -> Vec<[ClPoint; 2]> {
    let at = |k: u32| 40.0 + 60.0 * f64::from(k);
    (0..4).map(|k| [pose([at(k), 50.0, -4.0], axis), pose([at(k) + 5.0, 51.0, -4.2], axis)]).collect()
}

fn sweeps<'a>(body: &'a TurnedBody, motions: &[[ClPoint; 2]]) -> Vec<Sweep<'a>> {
    motions.iter().map(|&[from, to]| Sweep { body, from, to }).collect()
}

fn removed(map: &mut DexelMap, sweeps: &[Sweep]) -> u64 {
    map.remove_all(sweeps, 0.01).expect("motions are in range").iter().map(|cut| cut.lines).sum()
}

/// Lines under the outlines of all sweeps: those that lose something of a block that is higher than
/// the tool.
fn under_outlines(sweeps: &[Sweep]) -> u64 {
    let deep = stock(100.0, 100.0);
    sweeps.iter().map(|sweep| removed(&mut deep.clone(), std::slice::from_ref(sweep))).sum()
}

/// Processor time of this thread.
fn spent(work: impl FnOnce()) -> Duration {
    let now = || {
        let time = clock_gettime(ClockId::ThreadCPUTime);
        Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec.unsigned_abs() as u32)
    };
    let before = now();
    work();
    now() - before
}

fn threads(n: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(n).build().expect("threads start")
}

fn dexel(c: &mut Criterion) {
    let pool = threads(1);
    let mut group = c.benchmark_group("dexel");
    group.sample_size(10).warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(2));
    for (name, radius, corner, axis) in CUTTERS {
        let body = TurnedBody::of_cutter(&Cutter::new(radius, corner, 50.0).expect("lengths are in range"));
        let [along, lifted, single] = [pass(axis, 0.0), pass(axis, 0.01), apart(axis)];
        let [along, lifted, single] = [&along, &lifted, &single].map(|motions| sweeps(&body, motions));
        let whole = stock(60.0, 0.0);
        let mut cut = whole.clone();
        pool.install(|| removed(&mut cut, &along));
        let mut run = |what: &str, n: u64, map: &DexelMap, sweeps: &[Sweep]| {
            group.throughput(Throughput::Elements(n));
            group.bench_function(format!("{what}_{name}"), |b| {
                b.iter_custom(|n| {
                    let once = |_| {
                        let mut map = map.clone();
                        pool.install(|| {
                            spent(|| {
                                black_box(removed(&mut map, black_box(sweeps)));
                            })
                        })
                    };
                    (0..n).map(once).sum()
                });
            });
        };
        let n_under = under_outlines(&along);
        run("pass", n_under, &whole, &along);
        run("test", n_under, &cut, &lifted);
        run("cut", removed(&mut whole.clone(), &single), &whole, &single);
    }
    group.finish();
}

/// Wall time.
fn scaling(c: &mut Criterion) {
    let mut group = c.benchmark_group("dexel_threads");
    group.sample_size(10).warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(4));
    let (_, radius, corner, axis) = CUTTERS[2];
    let body = TurnedBody::of_cutter(&Cutter::new(radius, corner, 50.0).expect("lengths are in range"));
    let motions = pass(axis, 0.0);
    let sweeps = sweeps(&body, &motions);
    let whole = stock(60.0, 0.0);
    for n in [1, 2] {
        let pool = threads(n);
        group.bench_function(format!("pass_bull_tilted_{n}"), |b| {
            b.iter_custom(|n| {
                let once = |_| {
                    let mut map = whole.clone();
                    let start = Instant::now();
                    pool.install(|| black_box(removed(&mut map, &sweeps)));
                    start.elapsed()
                };
                (0..n).map(once).sum()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, dexel, scaling);
criterion_main!(benches);
