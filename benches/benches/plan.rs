//! A whole small propeller: planned with and without verification, its program read, and feeds for
//! many blocks.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use facemill::new_job::{NewJob, Series, new_job};
use facemill::{Job, PlanSettings, Planned, SilentStages, plan_setup};
use facemill_benches::{machine, table_poses};
use facemill_feedrate::{FeedBlock, plan_feeds};
use facemill_inverse_kinematics::BranchPreference;
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;

const TOOL_LENGTH: f64 = 300.0;

fn plan_of(job: &Job, verify: bool) -> Planned {
    plan_setup(job, 0, PlanSettings { verify, certificates: false }, &SilentStages).unwrap_or_else(|e| panic!("{e}"))
}

fn propeller(c: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let files = new_job(&NewJob::Propeller { series: Series::Dtmb4119, diameter_mm: 400.0 }).expect("an example");
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).expect("a file in it");
    }
    let job = Job::read(&folder.path().join("job.json")).expect("a job");
    let planned = plan_of(&job, false);
    let mut group = c.benchmark_group("propeller_400");
    group.sample_size(10).measurement_time(Duration::from_secs(10));
    group.throughput(Throughput::Elements(planned.report.totals.cc_points as u64));
    group.bench_function("plan", |b| b.iter(|| plan_of(black_box(&job), false)));
    group.bench_function("plan_and_verify", |b| b.iter(|| plan_of(black_box(&job), true)));
    let (_, nc) = planned.files.iter().find(|f| f.0 == "program.nc").expect("a program");
    group.throughput(Throughput::Bytes(nc.len() as u64));
    group.bench_function("read_nc", |b| {
        b.iter(|| read_program(black_box(nc), Dialect::Fanuc).expect("own program").blocks.len());
    });
    group.finish();
}

fn feeds(c: &mut Criterion) {
    let machine = machine();
    let mut near = None;
    let blocks: Vec<FeedBlock> = table_poses(1000)
        .iter()
        .map(|cl| {
            let end =
                machine.nearest_inverse(cl, TOOL_LENGTH, near.as_ref(), BranchPreference::Nearest).expect("reachable");
            near = Some(end);
            FeedBlock { end, tip_feed: 1200.0 }
        })
        .collect();
    let start = blocks[0].end;
    let mut group = c.benchmark_group("feedrate_b_c");
    group.sample_size(20).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(500));
    group.throughput(Throughput::Elements(blocks.len() as u64 - 1));
    group.bench_function("plan_feeds", |b| {
        b.iter(|| plan_feeds(&machine, TOOL_LENGTH, &start, black_box(&blocks[1..])).expect("feeds exist").len());
    });
    group.finish();
}

criterion_group!(benches, propeller, feeds);
criterion_main!(benches);
