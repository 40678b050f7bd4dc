//! Kinematics of the head-B, table-C mill, beside a solution written down for it by hand, and of a
//! head with two linear and two rotary axes over a turning workpiece, which needs roots of a
//! polynomial; branch and winding along a path.

use std::f64::consts::{PI, TAU};
use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use facemill_benches::{machine, table_poses};
use facemill_cl_data::{ClPoint, CuttingLaw};
use facemill_inverse_kinematics::machine_file::{DhRow, Joint, PrismaticJoint, RevoluteJoint, RevoluteRange, Sense};
use facemill_inverse_kinematics::motion::deviation_bound;
use facemill_inverse_kinematics::path::{PathSettings, SegmentKind, choose_along};
use facemill_inverse_kinematics::{AxisValues, BranchPreference, Machine};
use nalgebra::{Point3, Unit, Vector3};

const TOOL_LENGTH: f64 = 300.0;

/// The B-head, C-table mill by hand, for one fixed machine: what nothing general can be faster
/// than.
fn by_hand(cl: &ClPoint, tool_length: f64) -> [[f64; 5]; 2] {
    let (a, pivot) = (cl.axis.into_inner(), 350.0);
    let lean = a.x.hypot(a.y);
    let (b, c) = (lean.atan2(a.z), a.y.atan2(a.x));
    let (cos, sin) = (a.x / lean, a.y / lean);
    let p = cl.tip + a * (pivot + tool_length);
    let (x, y, z) = (cos * p.x + sin * p.y, cos * p.y - sin * p.x, p.z - pivot);
    [[x, y, z, b, c], [-x, -y, z, -b, c - PI.copysign(c)]]
}

fn row(a_mm: f64, alpha_deg: f64, d_mm: f64, theta_deg: f64) -> DhRow {
    DhRow { a_mm, alpha_deg, d_mm, theta_deg, joint: None, bodies: Vec::new() }
}

fn linear(axis: &str, row: DhRow) -> DhRow {
    let joint = PrismaticJoint {
        axis: axis.to_owned(),
        sense: Sense::Positive,
        min_mm: -5000.0,
        max_mm: 5000.0,
        home_mm: 0.0,
        max_velocity_mm_min: 20000.0,
        max_acceleration_mm_s2: None,
        max_jerk_mm_s3: None,
    };
    DhRow { joint: Some(Joint::Prismatic(joint)), ..row }
}

fn rotary(axis: &str, row: DhRow) -> DhRow {
    let joint = RevoluteJoint {
        axis: axis.to_owned(),
        sense: Sense::Positive,
        range: RevoluteRange::Endless,
        rollover: None,
        max_wind_up_turns: None,
        home_deg: 0.0,
        max_velocity_deg_min: 5000.0,
        max_acceleration_deg_s2: None,
        max_jerk_deg_s3: None,
    };
    DhRow { joint: Some(Joint::Revolute(joint)), ..row }
}

/// Workpiece on a level C, head with Y, Z, B and A. With a `nod` between B and A no two rotary axes
/// are parallel.
fn three_rotaries(nod_deg: f64) -> Machine {
    let mut file = machine().to_file();
    file.bed_bodies.clear();
    file.workpiece_chain.rows = vec![rotary("C", row(0.0, 90.0, 0.0, 90.0))];
    file.tool_chains[0].rows = vec![
        linear("Y", row(0.0, -90.0, 0.0, 0.0)),
        linear("Z", row(0.0, 90.0, 0.0, 0.0)),
        rotary("B", row(40.0, -90.0 + nod_deg, 60.0, 0.0)),
        rotary("A", row(25.0, 90.0 + nod_deg, 80.0, 90.0)),
        row(10.0, 90.0, 30.0, 0.0),
    ];
    Machine::from_file(file).expect("the machine is solvable")
}

fn polynomial(c: &mut Criterion) {
    let mut group = c.benchmark_group("inverse_kinematics_three_rotaries");
    group.sample_size(20).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(500));
    for (name, nod_deg) in [("parallel", 0.0), ("general", 7.0)] {
        let machine = three_rotaries(nod_deg);
        let at = |k: usize, step: f64| {
            let t = 0.1 * k as f64 + step;
            AxisValues::from([300.0 * t.sin(), 400.0 * t.cos(), 0.9 * (1.3 * t).sin(), 0.8 * (0.7 * t).cos(), t])
        };
        let poses: Vec<ClPoint> = (0..1000).map(|k| machine.cl_point(&at(k, 0.0), TOOL_LENGTH)).collect();
        group.throughput(Throughput::Elements(poses.len() as u64));
        group.bench_function(format!("{name}_all_roots"), |b| {
            b.iter(|| poses.iter().filter(|cl| machine.inverse(black_box(cl), TOOL_LENGTH).is_ok()).count());
        });
        let near: Vec<AxisValues> = (0..1000).map(|k| at(k, 0.01)).collect();
        group.bench_function(format!("{name}_warm_start"), |b| {
            let solve = |(cl, q)| {
                machine.nearest_inverse(black_box(cl), TOOL_LENGTH, Some(q), BranchPreference::Nearest).is_ok()
            };
            b.iter(|| poses.iter().zip(&near).filter(|p| solve((p.0, p.1))).count());
        });
    }
    group.finish();
}

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
    group.bench_function("inverse_by_hand", |b| {
        b.iter(|| poses.iter().map(|cl| black_box(by_hand(black_box(cl), TOOL_LENGTH))[0][0]).sum::<f64>());
    });
    group.bench_function("inverse_both_branches_unchecked", |b| {
        b.iter(|| {
            let solve = |cl| black_box(machine.inverse_unchecked(black_box(cl), TOOL_LENGTH)).map_or(0, |s| s.len());
            poses.iter().map(solve).sum::<usize>()
        });
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

/// The head-B, table-C mill with C limited to ±`most_deg`.
fn limited_table(most_deg: f64) -> Machine {
    let mut file = machine().to_file();
    for row in &mut file.workpiece_chain.rows {
        if let Some(Joint::Revolute(joint)) = row.joint.as_mut() {
            joint.range = RevoluteRange::Limited { min_deg: -most_deg, max_deg: most_deg };
        }
    }
    Machine::from_file(file).expect("the machine is solvable")
}

/// A spiral of 1000 poses a turn, the tool leaning outward, a link behind every fourth turn.
fn spiral(n: usize) -> (Vec<ClPoint>, Vec<SegmentKind>) {
    let pose = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / 1000.0).sin_cos();
        let radius = 300.0 + 1e-3 * k as f64;
        let axis = Unit::new_normalize(Vector3::new(0.3 * cos, 0.3 * sin, 1.0));
        ClPoint { tip: Point3::new(radius * cos, radius * sin, 50.0), axis }
    };
    let segment = |k: usize| if k % 4000 == 3999 { SegmentKind::Link } else { SegmentKind::Cut };
    ((0..n).map(pose).collect(), (0..n - 1).map(segment).collect())
}

fn path_choice(c: &mut Criterion) {
    let mut group = c.benchmark_group("inverse_kinematics_path_choice");
    group.sample_size(10).measurement_time(Duration::from_secs(3)).warm_up_time(Duration::from_millis(500));
    for (name, machine) in
        [("endless", machine()), ("limited_200", limited_table(200.0)), ("limited_720", limited_table(720.0))]
    {
        let settings = PathSettings::new(&machine);
        let choose = |(poses, segments): &(Vec<ClPoint>, Vec<SegmentKind>)| {
            choose_along(&machine, black_box(poses), segments, None, TOOL_LENGTH, &settings).expect("reachable")
        };
        let [short, long] = [10_000, 100_000].map(spiral);
        group.throughput(Throughput::Elements(short.0.len() as u64));
        group.bench_function(format!("{name}_10k"), |b| b.iter(|| choose(&short)));
        group.throughput(Throughput::Elements(long.0.len() as u64));
        group.bench_function(format!("{name}_100k"), |b| b.iter(|| choose(&long)));
        // Linear in the number of poses: the median time for ten times as many.
        let median = |path: &(Vec<ClPoint>, Vec<SegmentKind>)| {
            let mut times: Vec<f64> = (0..5)
                .map(|_| {
                    let start = Instant::now();
                    black_box(choose(path));
                    start.elapsed().as_secs_f64()
                })
                .collect();
            times.sort_by(f64::total_cmp);
            times[2]
        };
        println!("{name}: 100,000 poses take {:.2} times as long as 10,000", median(&long) / median(&short));
    }
    group.finish();
}

criterion_group!(benches, kinematics, polynomial, path_choice);
criterion_main!(benches);
