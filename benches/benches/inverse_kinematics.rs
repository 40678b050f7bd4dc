//! Kinematics of the head-B, table-C mill.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use facemill_benches::{machine, table_poses};
use facemill_cl_data::CuttingLaw;
use facemill_inverse_kinematics::{AxisValues, BranchPreference, deviation_bound};

const TOOL_LENGTH: f64 = 300.0;

fn kinematics(c: &mut Criterion) {
    let machine = machine();
    let poses = table_poses(1000);
    let solve = |cl| machine.nearest_inverse(cl, TOOL_LENGTH, None, BranchPreference::Positive).expect("reachable");
    let axes: Vec<AxisValues> = poses.iter().map(solve).collect();
    let mut group = c.benchmark_group("inverse_kinematics_b_c");
    group.sample_size(20).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(500));
    group.throughput(Throughput::Elements(poses.len() as u64));
    group.bench_function("forward", |b| {
        b.iter(|| axes.iter().map(|q| machine.forward(black_box(q), TOOL_LENGTH).translation.x).sum::<f64>());
    });
    group.bench_function("inverse_both_branches_checked", |b| {
        b.iter(|| {
            poses
                .iter()
                .filter_map(|cl| machine.inverse(black_box(cl), TOOL_LENGTH).ok())
                .map(|s| s.len())
                .sum::<usize>()
        });
    });
    group.bench_function("nearest_inverse", |b| {
        b.iter(|| {
            let near =
                |(cl, q)| machine.nearest_inverse(black_box(cl), TOOL_LENGTH, Some(q), BranchPreference::Nearest);
            poses.iter().zip(&axes).filter(|p| near((p.0, p.1)).is_ok()).count()
        });
    });
    group.throughput(Throughput::Elements(axes.len() as u64 - 1));
    group.bench_function("deviation_bound", |b| {
        b.iter(|| {
            let bound =
                |w: &[AxisValues]| deviation_bound(&machine, CuttingLaw::AxesLinear, &w[0], &w[1], TOOL_LENGTH).tip;
            axes.windows(2).map(bound).sum::<f64>()
        });
    });
    group.finish();
}

criterion_group!(benches, kinematics);
criterion_main!(benches);
