use std::sync::atomic::{AtomicUsize, Ordering};

use facemill_cl_data::{Cancelled, Monitor, Pass, Posture, Silent};
use facemill_cutter_location::{
    Hints, PassSettings, PassTask, PlannedPass, PoseTest, PostureMode, SearchOrder, SearchSettings, plan_passes, search,
};
use facemill_interference::MeshTree;
use facemill_sample_parts::{PatchSpec, patch};
use nalgebra::Vector3;

use crate::kit::{Ball, Random, cc_on_patch, curve_deg, machine, obstacle, tool, workcell};

/// Deep waves, so that neighbouring points need different postures.
fn wavy() -> (PatchSpec, MeshTree) {
    let spec = PatchSpec::new([240.0, 240.0], 14.0, [2.0, 1.5]).unwrap();
    let tree = MeshTree::new(&patch(&spec, 120, 120).unwrap());
    (spec, tree)
}

fn tasks(spec: &PatchSpec, step: f64) -> Vec<PassTask> {
    let curve = curve_deg([2.0, 0.0], [25.0, -80.0], SearchOrder::TiltFirst, 1.0);
    (0..8)
        .map(|k| {
            let y = -70.0 + 20.0 * f64::from(k);
            let n = (160.0 / step) as usize;
            let points = (0..=n).map(|j| cc_on_patch(spec, -80.0 + step * j as f64, y, Vector3::x())).collect();
            PassTask {
                pass: Pass::new(points),
                curve: if k % 2 == 0 { curve } else { curve.mirrored() },
                strips: Vec::new(),
                given: Vec::new(),
            }
        })
        .collect()
}

const SETTINGS: PassSettings = PassSettings {
    search: SearchSettings { u_step: 0.1, u_tolerance: 0.001, certified: None },
    mode: PostureMode::Smallest,
    max_turn_per_mm: 0.004,
};

/// Turn of the axis against surface and feed from one posture to another.
fn turn(a: Posture, b: Posture) -> f64 {
    let axis = |p: Posture| Vector3::new(p.tilt.sin() * p.rotate.cos(), p.tilt.sin() * p.rotate.sin(), p.tilt.cos());
    (axis(a) - axis(b)).norm()
}

#[test]
fn the_turn_between_neighbours_is_bounded_wherever_a_raised_posture_is_feasible() {
    let (spec, tree) = wavy();
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let cell = workcell(&machine, &tool, vec![obstacle("part", &tree)]);
    let test = PoseTest::new(&cell);
    let tasks = tasks(&spec, 2.0);
    let planned = plan_passes(&test, &tasks, &SETTINGS, &Silent).unwrap();
    let (mut pairs, mut steep_before, mut excused) = (0, 0, 0);
    for (task, pass) in tasks.iter().zip(planned.iter().map(|p| &p.outcomes)) {
        let smallest: Vec<Option<Posture>> = task
            .pass
            .points
            .iter()
            .map(|cc| search(&test, cc, &task.curve, &SETTINGS.search, 0.0, None, &mut Hints::default()))
            .map(|found| found.ok().map(|f| f.pose.posture))
            .collect();
        // The turn possible within one coarse tolerance of u.
        let slack = (0..1000)
            .map(|k| turn(task.curve.at(f64::from(k) * 1e-3), task.curve.at(f64::from(k + 1) * 1e-3)))
            .fold(0.0, f64::max);
        for k in 1..pass.points.len() {
            let (Ok(a), Ok(b)) = (&pass.points[k - 1], &pass.points[k]) else { continue };
            let ds = (task.pass.points[k].position - task.pass.points[k - 1].position).norm();
            let allowed = SETTINGS.max_turn_per_mm * ds + slack;
            pairs += 1;
            if let (Some(p), Some(q)) = (smallest[k - 1], smallest[k]) {
                steep_before += usize::from(turn(p, q) > allowed);
            }
            if turn(a.posture, b.posture) > allowed {
                // The lower of the two could not be raised: no posture above it that is near enough
                // is feasible.
                let (low, high, cc) = if a.posture.tilt < b.posture.tilt {
                    (a.posture, b.posture, &task.pass.points[k - 1])
                } else {
                    (b.posture, a.posture, &task.pass.points[k])
                };
                let near_enough = (0..=400).map(|j| task.curve.at(f64::from(j) / 400.0)).filter(|p| {
                    p.tilt > low.tilt && p.tilt <= high.tilt && turn(*p, high) <= SETTINGS.max_turn_per_mm * ds
                });
                for p in near_enough {
                    assert!(
                        test.try_posture(cc, p, None, &mut Hints::default()).is_err(),
                        "{low:?} beside {high:?} although {p:?} is feasible"
                    );
                }
                excused += 1;
            }
        }
    }
    println!("{pairs} pairs, {steep_before} too steep before, {excused} excused");
    assert!(steep_before > 20 && excused * 4 < steep_before, "{pairs} {steep_before} {excused}");
}

#[test]
fn raising_loses_no_point_and_keeps_every_pose_feasible() {
    let (spec, tree) = wavy();
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    // A clamp on the part, in the way of two passes.
    let clamp = Ball { center: spec.at(15.0, -20.0).point, radius: 12.0 };
    let clamp_tree = MeshTree::new(&clamp.mesh());
    let cell = workcell(&machine, &tool, vec![obstacle("part", &tree), obstacle("clamp", &clamp_tree)]);
    let test = PoseTest::new(&cell);
    let tasks = tasks(&spec, 4.0);
    let planned = plan_passes(&test, &tasks, &SETTINGS, &Silent).unwrap();
    let (mut raised, mut refused) = (0, 0);
    for (task, pass) in tasks.iter().zip(planned.iter().map(|p| &p.outcomes)) {
        assert_eq!(pass.points.len(), task.pass.points.len());
        for (cc, outcome) in task.pass.points.iter().zip(&pass.points) {
            let alone = search(&test, cc, &task.curve, &SETTINGS.search, 0.0, None, &mut Hints::default());
            assert_eq!(outcome.is_ok(), alone.is_ok());
            if (cc.position - clamp.center).norm() < clamp.radius - clamp.chord_error() - cell.gouge_tolerance {
                assert!(outcome.is_err(), "the point itself is in the clamp");
            }
            let (Ok(pose), Ok(alone)) = (outcome, alone) else {
                refused += 1;
                continue;
            };
            assert!(pose.posture.tilt >= alone.pose.posture.tilt - 1e-12);
            raised += usize::from(pose.posture.tilt > alone.pose.posture.tilt + 1e-6);
            let again = test.try_posture(cc, pose.posture, None, &mut Hints::default()).unwrap();
            assert_eq!((again.cl, again.lift), (pose.cl, pose.lift));
            let reached = machine.cl_point(&pose.configuration.axes, tool.gauge_length());
            let meant = pose.cl.transformed(&cell.table_from_work);
            assert!((reached.tip - meant.tip).norm() < 1e-8 && (*reached.axis - *meant.axis).norm() < 1e-11);
        }
    }
    assert!(raised > 10 && refused > 0, "{raised} raised, {refused} refused");
}

#[test]
fn the_plan_is_the_same_on_one_and_on_two_threads() {
    let (spec, tree) = wavy();
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let cell = workcell(&machine, &tool, vec![obstacle("part", &tree)]);
    let test = PoseTest::new(&cell);
    let tasks = tasks(&spec, 4.0);
    let on = |n_threads: usize| -> Vec<PlannedPass> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| plan_passes(&test, &tasks, &SETTINGS, &Silent)).unwrap()
    };
    let one = on(1);
    for n_threads in [2, 2, 3] {
        assert_eq!(on(n_threads), one);
    }
}

/// Counts steps, and cancels after so many.
struct Counting {
    steps: AtomicUsize,
    cancel_after: usize,
}

impl Monitor for Counting {
    fn advance(&self, steps: usize) {
        self.steps.fetch_add(steps, Ordering::SeqCst);
    }
    fn is_cancelled(&self) -> bool {
        self.steps.load(Ordering::SeqCst) >= self.cancel_after
    }
}

#[test]
fn the_monitor_counts_every_point_and_stops_the_plan() {
    let (spec, tree) = wavy();
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let cell = workcell(&machine, &tool, vec![obstacle("part", &tree)]);
    let test = PoseTest::new(&cell);
    let tasks = tasks(&spec, 8.0);
    let n_points: usize = tasks.iter().map(|t| t.pass.points.len()).sum();
    let counting = |cancel_after| Counting { steps: AtomicUsize::new(0), cancel_after };
    let all = counting(usize::MAX);
    plan_passes(&test, &tasks, &SETTINGS, &all).unwrap();
    assert_eq!(all.steps.into_inner(), n_points);
    let stopped = counting(10);
    assert_eq!(plan_passes(&test, &tasks, &SETTINGS, &stopped), Err(Cancelled));
    // Each of a few threads may be in the middle of a point.
    assert!(stopped.steps.into_inner() < 10 + 2 * rayon::current_num_threads());
}

#[test]
fn the_plan_moves_with_part_and_mounting() {
    let (spec, _) = wavy();
    let mesh = patch(&spec, 120, 120).unwrap();
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let still = tasks(&spec, 4.0);
    let plan = |motion: &nalgebra::Isometry3<f64>| {
        let tree = MeshTree::new(&mesh.transformed(motion));
        let mut cell = workcell(&machine, &tool, vec![obstacle("part", &tree)]);
        cell.table_from_work *= motion.inverse();
        let moved = |t: &PassTask| PassTask { pass: t.pass.map(|cc| cc.transformed(motion)), ..t.clone() };
        let moved: Vec<PassTask> = still.iter().map(moved).collect();
        plan_passes(&PoseTest::new(&cell), &moved, &SETTINGS, &Silent).unwrap()
    };
    let here = plan(&nalgebra::Isometry3::identity());
    let mut random = Random(17);
    let motion = nalgebra::Isometry3::new(random.vector(1.0) * 500.0, random.vector(1.0) * 2.0);
    let there = plan(&motion);
    let mut planned = 0;
    for (a, b) in here.iter().zip(&there).flat_map(|(a, b)| a.outcomes.points.iter().zip(&b.outcomes.points)) {
        let (Ok(a), Ok(b)) = (a, b) else {
            assert_eq!(a.is_ok(), b.is_ok());
            continue;
        };
        planned += 1;
        // Rounding may end bisections one step apart: of u by 0.001 of the curve, of the lift by
        // its resolution.
        let meant = a.cl.transformed(&motion);
        assert!(turn(a.posture, b.posture) < 2e-3 && (a.lift - b.lift).abs() < 3e-3);
        assert!((meant.tip - b.cl.tip).norm() < 0.05 && (*meant.axis - *b.cl.axis).norm() < 2e-3);
    }
    assert!(planned > 100, "{planned}");
}
