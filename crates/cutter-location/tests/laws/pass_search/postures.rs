//! Postures along a pass: the cheapest sequence, prescribed ones.

use facemill_cl_data::{CcPoint, Pass, Posture, Silent};
use facemill_cutter_location::cusp::cut_point::Strip;
use facemill_cutter_location::{
    AxisTarget, Configuration, Hints, Infeasible, Outcome, PassSettings, PassTask, PlannedPass, PoseTest, PostureMode,
    SearchCurve, SearchOrder, SearchSettings, SmoothSettings, Workcell, plan_passes, search,
};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::{AxisKind, AxisValues};
use facemill_sample_parts::{PatchSpec, patch};
use facemill_tool_model::{Cusp, FeedCurvature, Outline, cl_from_cc, cusp_height_between};
use nalgebra::{Point3, Unit, Vector3};

use crate::kit::{Ball, Random, cc_on_patch, cc_on_plane, curve_deg, machine, obstacle, plane, stand, tool, workcell};
use crate::pass_search::pass_costs::{Cost, SMOOTH, seen};

/// A feed at which the rotary axes cannot follow everywhere, mm/s.
const FAST: f64 = 60.0;

fn settings(mode: PostureMode, max_turn_per_mm: f64) -> PassSettings {
    PassSettings { search: SearchSettings::default(), mode, max_turn_per_mm }
}

fn wavy() -> (PatchSpec, MeshTree) {
    let spec = PatchSpec::new([240.0, 240.0], 14.0, [2.0, 1.5]).unwrap();
    let tree = MeshTree::new(&patch(&spec, 120, 120).unwrap());
    (spec, tree)
}

fn wavy_tasks(spec: &PatchSpec, step: f64) -> Vec<PassTask> {
    let curve = curve_deg([2.0, 0.0], [25.0, -80.0], SearchOrder::TiltFirst, 1.0);
    (0..6)
        .map(|k| {
            let y = -70.0 + 26.0 * f64::from(k);
            let n = (160.0 / step) as usize;
            let points = (0..=n).map(|j| cc_on_patch(spec, -80.0 + step * j as f64, y, Vector3::x())).collect();
            let curve = if k % 2 == 0 { curve } else { curve.mirrored() };
            PassTask { pass: Pass::new(points), curve, strips: Vec::new(), given: Vec::new() }
        })
        .collect()
}

/// Returns a feasible posture and its axis values at the largest lift, where the graph has its
/// nodes.
fn lifted_free(test: &PoseTest<'_>, cc: &CcPoint, p: Posture) -> Option<(Posture, AxisValues)> {
    test.try_posture(cc, p, None, &mut Hints::default()).ok()?;
    let lift = cc.normal.into_inner() * test.cell.max_lift;
    let cl = cl_from_cc(test.cell.tool.cutter(), cc, p).translated(lift);
    Some((p, stand(test.cell, &cl).configuration.axes))
}

/// Returns every sequence that takes one of these at each point.
fn all_ways<T: Copy>(choices: &[Vec<T>]) -> Vec<Vec<T>> {
    choices.iter().fold(vec![Vec::new()], |ways, nodes| {
        ways.iter().flat_map(|way| nodes.iter().map(move |node| [way.as_slice(), &[*node]].concat())).collect()
    })
}

#[test]
fn the_graphs_optimum_is_that_of_all_sequences_and_the_gap_is_true() {
    // Flat enough for these postures everywhere, but not so flat that none of them gouges.
    let spec = PatchSpec::new([240.0, 240.0], 7.0, [2.0, 1.5]).unwrap();
    let tree = MeshTree::new(&patch(&spec, 120, 120).unwrap());
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let cell = workcell(&machine, &tool, vec![obstacle("part", &tree)]);
    let test = PoseTest::new(&cell);
    // Few postures: tilts 12 and 14 degrees of the lattice, and what the search finds. No turn is
    // too fast, and every point is a layer.
    let curve = curve_deg([12.0, 0.0], [14.0, 0.0], SearchOrder::TiltFirst, 1.0);
    let max_turn = 1.0;
    let (mut undercut, mut too_fast) = (0, 0);
    // At the higher feed some steps, and some whole passes, are too fast for the rotary axes.
    for (y, feed) in [-60.0, -20.0, 20.0, 60.0].into_iter().flat_map(|y| [(y, 20.0), (y, FAST)]) {
        let points: Vec<CcPoint> =
            (0..7).map(|j| cc_on_patch(&spec, -60.0 + 17.0 * f64::from(j), y, Vector3::x())).collect();
        let task = PassTask { pass: Pass::new(points.clone()), curve, strips: Vec::new(), given: Vec::new() };
        let planned = plan_passes(
            &test,
            &[task],
            &settings(PostureMode::Smooth(SmoothSettings { feed, ..SMOOTH }), max_turn),
            &Silent,
        )
        .unwrap()
        .remove(0);
        let choices: Vec<Vec<(Posture, AxisValues)>> = points
            .iter()
            .map(|cc| {
                let found = search(&test, cc, &curve, &SearchSettings::default(), 0.0, None, &mut Hints::default());
                let of_lattice = [12.0f64, 14.0].map(|tilt| Posture { tilt: tilt.to_radians(), rotate: 0.0 });
                let all = of_lattice.into_iter().chain(found.ok().map(|f| f.pose.posture));
                all.filter_map(|p| lifted_free(&test, cc, p)).collect()
            })
            .collect();
        assert!(choices.iter().all(|c| !c.is_empty()), "the scene has postures everywhere");
        let length: f64 = points.windows(2).map(|p| (p[1].position - p[0].position).norm()).sum();
        let layer_time = length / feed / (points.len() - 1) as f64;
        let cost = Cost { cell: &cell, points: &points, max_turn_per_mm: max_turn, feed, layer_time };
        let least = cost.least(&choices);
        let optimum = planned.optimum.expect("a sequence was sought");
        assert!((optimum.graph - least).abs() < 1e-9 * least, "{} {least}", optimum.graph);
        let way: Vec<(Posture, AxisValues)> = planned
            .outcomes
            .points
            .iter()
            .map(|o| o.as_ref().map(|pose| (pose.posture, pose.configuration.axes)).unwrap())
            .collect();
        let smoothed = cost.of(&way);
        assert!((optimum.smoothed - smoothed).abs() < 1e-9 * smoothed, "{} {smoothed}", optimum.smoothed);
        assert!((optimum.gap() - (smoothed / least - 1.0)).abs() < 1e-8);
        let time = |k: usize| cost.length(k - 1) / feed;
        let jumps = (1..points.len()).filter(|&k| cost.fastest(way[k - 1].1, way[k].1, time(k)) > 1.0 + 1e-9).count();
        assert_eq!((optimum.layers, optimum.jumps), (points.len(), jumps));
        undercut += usize::from(optimum.smoothed < optimum.graph);
        let spread = all_ways(&choices).iter().map(|way| cost.of(way)).fold(0.0, f64::max) - least;
        too_fast += usize::from(spread > 1e4);
        assert!(jumps == 0 || feed == FAST);
    }
    assert!(too_fast >= 2, "the limit on the axes decides in {too_fast} of 8 passes only");
    println!("smoothing is cheaper than the graph in {undercut} of 8 passes, the axes' limit decides in {too_fast}");
}

#[test]
fn nodes_that_do_not_stand_as_seated_leave_the_graph_and_the_gap_of_the_rest_is_true() {
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let curve = curve_deg([12.0, 0.0], [14.0, 0.0], SearchOrder::TiltFirst, 1.0);
    let points: Vec<CcPoint> = (0..6).map(|j| cc_on_plane(-35.0 + 14.0 * f64::from(j), 5.0)).collect();
    let tree = MeshTree::new(&plane(400.0));
    let mut random = Random(17);
    let (mut scenes, mut removed) = (0, 0);
    let time = |k: usize| (points[k + 1].position - points[k].position).norm() / SMOOTH.feed;
    let layer_time = (0..points.len() - 1).map(time).sum::<f64>() / (points.len() - 1) as f64;
    while scenes < 12 {
        // Balls about as high as the low end of the holder, which the largest lift clears.
        let balls: Vec<MeshTree> = (0..2)
            .map(|_| {
                let at = [random.between(-60.0, 40.0), random.between(-30.0, 40.0), random.between(38.0, 52.0)];
                MeshTree::new(&Ball { center: at.into(), radius: 4.0 }.mesh())
            })
            .collect();
        let obstacles = balls.iter().map(|b| obstacle("ball", b)).chain([obstacle("part", &tree)]).collect();
        let cell = Workcell { max_lift: 3.0, ..workcell(&machine, &tool, obstacles) };
        let test = PoseTest::new(&cell);
        let hints = &mut Hints::default();
        let lifted = |cc: &CcPoint, p: Posture| {
            let cl = cl_from_cc(cell.tool.cutter(), cc, p).translated(cc.normal.into_inner() * cell.max_lift);
            (cl, (p, stand(&cell, &cl).configuration.axes))
        };
        let mut free: Vec<Vec<(Posture, AxisValues)>> = Vec::new();
        let mut standing: Vec<Vec<(Posture, AxisValues)>> = Vec::new();
        for cc in &points {
            let found = search(&test, cc, &curve, &SearchSettings::default(), 0.0, None, hints);
            let of_lattice = [12.0f64, 14.0].map(|tilt| Posture { tilt: tilt.to_radians(), rotate: 0.0 });
            let all: Vec<Posture> = of_lattice.into_iter().chain(found.ok().map(|f| f.pose.posture)).collect();
            let nodes = all.iter().map(|p| lifted(cc, *p));
            let nodes = nodes.filter(|(cl, node)| {
                let hints = &mut Hints::default();
                test.gouge(cl, hints).is_none() && test.collision(&node.1, hints).is_none()
            });
            let nodes: Vec<(Posture, AxisValues)> = nodes.map(|(_, node)| node).collect();
            standing.push(nodes.iter().copied().filter(|n| test.try_posture(cc, n.0, None, hints).is_ok()).collect());
            free.push(nodes);
        }
        // Points where the graph has nodes and none of them is feasible as seated.
        if free.iter().any(Vec::is_empty) || standing.iter().all(|s| !s.is_empty()) {
            continue;
        }
        scenes += 1;
        let task = PassTask { pass: Pass::new(points.clone()), curve, strips: Vec::new(), given: Vec::new() };
        let planned =
            plan_passes(&test, &[task], &settings(PostureMode::Smooth(SMOOTH), 1.0), &Silent).unwrap().remove(0);
        let optimum = planned.optimum.expect("reported for every pass");
        let posed: Vec<usize> = (0..points.len()).filter(|&k| planned.outcomes.points[k].is_ok()).collect();
        assert!(posed.len() >= 2 && standing.iter().enumerate().all(|(k, s)| s.is_empty() || posed.contains(&k)));
        assert!(optimum.layers <= posed.len());
        // A point that gets a pose between others once it is no layer is not compared.
        if optimum.layers < posed.len() {
            continue;
        }
        removed += usize::from(posed.len() < points.len());
        let own: Vec<CcPoint> = posed.iter().map(|&k| points[k]).collect();
        let cost = Cost { cell: &cell, points: &own, max_turn_per_mm: 1.0, feed: SMOOTH.feed, layer_time };
        let below = cost.least(&posed.iter().map(|&k| free[k].clone()).collect::<Vec<_>>());
        let best = |k: &usize| if standing[*k].is_empty() { free[*k].clone() } else { standing[*k].clone() };
        let above = cost.least(&posed.iter().map(best).collect::<Vec<_>>());
        let near = 1e-9 * above;
        assert!(below - near <= optimum.graph && optimum.graph <= above + near, "{below} {} {above}", optimum.graph);
        let pose = |k: &usize| planned.outcomes.points[*k].as_ref().map(|p| (p.posture, p.configuration.axes)).unwrap();
        let smoothed = cost.of(&posed.iter().map(pose).collect::<Vec<_>>());
        assert!((optimum.smoothed - smoothed).abs() < 1e-9 * smoothed, "{} {smoothed}", optimum.smoothed);
    }
    assert!(removed >= 3, "layers are removed in {removed} of {scenes} scenes only");
}

#[test]
fn smooth_postures_are_feasible_within_the_ranges_and_no_point_is_lost() {
    let (spec, tree) = wavy();
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let clamp = Ball { center: spec.at(15.0, -18.0).point, radius: 12.0 };
    let clamp_tree = MeshTree::new(&clamp.mesh());
    let cell = workcell(&machine, &tool, vec![obstacle("part", &tree), obstacle("clamp", &clamp_tree)]);
    let test = PoseTest::new(&cell);
    let tasks = wavy_tasks(&spec, 4.0);
    let planned = plan_passes(&test, &tasks, &settings(PostureMode::Smooth(SMOOTH), 0.02), &Silent).unwrap();
    let (mut free, mut refused) = (0, 0);
    for (task, pass) in tasks.iter().zip(&planned) {
        assert_eq!(pass.outcomes.points.len(), task.pass.points.len());
        let mut before: Option<&Configuration> = None;
        for (cc, outcome) in task.pass.points.iter().zip(&pass.outcomes.points) {
            let alone = search(&test, cc, &task.curve, &SearchSettings::default(), 0.0, None, &mut Hints::default());
            assert!(outcome.is_ok() || alone.is_err(), "a point that has a posture is left out");
            let Ok(pose) = outcome else {
                refused += 1;
                continue;
            };
            free += 1;
            let (start, end) = (task.curve.start(), task.curve.end());
            assert!(start.tilt <= pose.posture.tilt && pose.posture.tilt <= end.tilt);
            assert!(pose.posture.rotate.abs() <= end.rotate.abs() && pose.posture.rotate * end.rotate >= 0.0);
            let again = test.try_posture(cc, pose.posture, before, &mut Hints::default()).unwrap();
            assert_eq!((again.cl, again.lift), (pose.cl, pose.lift));
            before = Some(&pose.configuration);
        }
    }
    assert!(free > 200 && refused > 0, "{free} {refused}");
}

/// Returns the mean square of second differences of the rotary axes.
fn unrest(cell: &Workcell<'_>, pass: &PlannedPass) -> f64 {
    let axes: Vec<AxisValues> =
        pass.outcomes.points.iter().filter_map(|o| o.as_ref().ok()).map(|p| p.configuration.axes).collect();
    let rotary = (0..axes[0].len()).filter(|&k| cell.machine.axes()[k].kind == AxisKind::Rotary);
    rotary.map(|k| axes.windows(3).map(|w| (w[0][k] - 2.0 * w[1][k] + w[2][k]).powi(2)).sum::<f64>()).sum()
}

#[test]
fn smooth_postures_move_the_rotary_axes_less_than_the_smallest_ones() {
    let (spec, tree) = wavy();
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let cell = workcell(&machine, &tool, vec![obstacle("part", &tree)]);
    let test = PoseTest::new(&cell);
    let tasks = wavy_tasks(&spec, 2.0);
    let plan = |mode| plan_passes(&test, &tasks, &settings(mode, 0.01), &Silent).unwrap();
    let total = |planned: &[PlannedPass]| planned.iter().map(|p| unrest(&cell, p)).sum::<f64>();
    let (smallest, smooth) = (plan(PostureMode::Smallest), plan(PostureMode::Smooth(SMOOTH)));
    assert!(total(&smooth) < 0.5 * total(&smallest), "{} {}", total(&smooth), total(&smallest));
    // The reported jumps are the real ones.
    for (task, pass) in tasks.iter().zip(&smooth) {
        let cost =
            Cost { cell: &cell, points: &task.pass.points, max_turn_per_mm: 0.01, feed: SMOOTH.feed, layer_time: 1.0 };
        let jumps = (1..task.pass.points.len()).filter(|&k| {
            let (a, b) = (&task.pass.points[k - 1], &task.pass.points[k]);
            let (Ok(p), Ok(q)) = (&pass.outcomes.points[k - 1], &pass.outcomes.points[k]) else { return false };
            let length = (b.position - a.position).norm();
            let fastest = cost.fastest(p.configuration.axes, q.configuration.axes, length / SMOOTH.feed);
            (seen(a, p.posture) - seen(b, q.posture)).norm() > 0.01 * (1.0 + 1e-9) * length || fastest > 1.0 + 1e-9
        });
        assert_eq!(pass.optimum.unwrap().jumps, jumps.count());
    }
}

#[test]
fn smooth_plans_are_the_same_on_one_and_on_two_threads() {
    let (spec, tree) = wavy();
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let cell = workcell(&machine, &tool, vec![obstacle("part", &tree)]);
    let test = PoseTest::new(&cell);
    let tasks = wavy_tasks(&spec, 6.0);
    let on = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| plan_passes(&test, &tasks, &settings(PostureMode::Smooth(SMOOTH), 0.01), &Silent)).unwrap()
    };
    assert_eq!(on(1), on(2));
}

fn one_pass_on_a_plane(curve: SearchCurve) -> PassTask {
    let points = (0..15).map(|k| cc_on_plane(-70.0 + 10.0 * f64::from(k), 5.0)).collect();
    PassTask { pass: Pass::new(points), curve, strips: Vec::new(), given: Vec::new() }
}

fn on_a_plane(mode: PostureMode, curve: SearchCurve) -> Vec<Outcome> {
    planned_on_a_plane(mode, one_pass_on_a_plane(curve))
}

fn planned_on_a_plane(mode: PostureMode, task: PassTask) -> Vec<Outcome> {
    let tree = MeshTree::new(&plane(400.0));
    let (machine, tool) = (machine(), tool(16.0, 2.0, 12.0));
    let cell = workcell(&machine, &tool, vec![obstacle("part", &tree)]);
    plan_passes(&PoseTest::new(&cell), &[task], &settings(mode, 0.01), &Silent).unwrap().remove(0).outcomes.points
}

#[test]
fn on_twisted_surfaces_rotates_of_either_sign_are_those_of_the_lowest_cusps() {
    let curve = curve_deg([3.0, 0.0], [12.0, -80.0], SearchOrder::TiltFirst, 1.0);
    let mut helps = 0;
    for (curve, twist) in [curve, curve.mirrored()].into_iter().flat_map(|c| [(c, 4e-3), (c, -4e-3)]) {
        let strip =
            Strip { step_over: SMOOTH.strip.step_over, curvature: FeedCurvature { along: 0.0, twist, across: 3e-4 } };
        let planned = |strip: Strip| {
            let mut task = one_pass_on_a_plane(curve);
            task.strips = vec![Some(strip); task.pass.points.len()];
            planned_on_a_plane(PostureMode::Smooth(SMOOTH), task)
        };
        let height = |tilt: f64, rotate: f64| {
            let outline = Outline::new(tool(16.0, 2.0, 12.0).cutter(), Posture { tilt, rotate });
            match cusp_height_between(&outline, &outline, strip.step_over, &strip.curvature) {
                Cusp::Height(height) => height,
                Cusp::Uncut => f64::INFINITY,
            }
        };
        let (from, to) = (curve.start(), curve.end());
        let lowest = (0..=80)
            .map(|k| height(from.tilt, from.rotate + (to.rotate - from.rotate) * f64::from(k) / 80.0))
            .fold(f64::INFINITY, f64::min);
        // The lattice has few rotates.
        let straight = height(from.tilt, 0.0);
        let most = if straight > 1.5 * lowest { 0.8 * straight } else { 1.02 * straight };
        helps += usize::from(most < straight);
        let outcomes = planned(strip);
        // A wider gap counts as the widest strip.
        assert_eq!(planned(Strip { step_over: 100.0, ..strip }), outcomes);
        for outcome in outcomes {
            let posture = outcome.expect("a plane is free").posture;
            let left = height(posture.tilt, posture.rotate);
            assert!(left < most, "{twist} {posture:?}: {left}, straight {straight}, lowest {lowest}");
        }
    }
    assert_eq!(helps, 2, "one sign of twist for each curve");
}

#[test]
fn a_fixed_posture_has_its_lead_and_leans_to_the_side_of_the_curve() {
    let fixed = Posture::from_lead_lean(3f64.to_radians(), 5f64.to_radians());
    for side in [-1.0, 1.0] {
        let curve = curve_deg([2.0, 0.0], [25.0, side * 80.0], SearchOrder::TiltFirst, 1.0);
        for outcome in on_a_plane(PostureMode::Fixed(fixed), curve) {
            let pose = outcome.unwrap();
            // On the plane z = 0 with the feed along x, by the axis alone.
            let axis = pose.cl.axis;
            assert!((axis.x / axis.z - 3f64.to_radians().tan()).abs() < 1e-12);
            assert!((axis.y / axis.z - side * 5f64.to_radians().tan()).abs() < 1e-12);
        }
    }
    // Backward: the rear of a disc would cut the plane, were it not tilted about its contact: lead
    // −3 tips it the other way.
    let back = Posture::from_lead_lean(-3f64.to_radians(), 0.0);
    let curve = curve_deg([2.0, 0.0], [25.0, 80.0], SearchOrder::TiltFirst, 1.0);
    assert!(on_a_plane(PostureMode::Fixed(back), curve).iter().all(|o| o.as_ref().unwrap().cl.axis.x < -0.05));
}

#[test]
fn the_tool_axis_meets_the_point_or_line_it_is_to_point_to() {
    let curve = curve_deg([0.0, 0.0], [80.0, 80.0], SearchOrder::TiltFirst, 1.0);
    let point = Point3::new(30.0, -60.0, 500.0);
    let line = AxisTarget::Line { origin: Point3::new(0.0, 0.0, 300.0), direction: Unit::new_normalize(Vector3::y()) };
    for (target, along) in [(AxisTarget::Point(point), None), (line, Some(Vector3::y()))] {
        let task = one_pass_on_a_plane(curve);
        for (cc, outcome) in task.pass.points.iter().zip(on_a_plane(PostureMode::Toward(target), curve)) {
            let pose = outcome.unwrap();
            let (to, origin) = match target {
                AxisTarget::Point(p) => (p - cc.position, p),
                AxisTarget::Line { origin, .. } => (origin - cc.position, origin),
                other => panic!("{other:?} has no law here"),
            };
            // Parallel to the axis from the CC point on: the target is met; a line, at a right
            // angle.
            let across = match along {
                None => to.cross(&pose.cl.axis).norm(),
                Some(d) => (to.cross(&pose.cl.axis)).dot(&d).abs().max(pose.cl.axis.dot(&d).abs() * 100.0),
            };
            assert!(across < 1e-9 && origin.z > 0.0, "{across}");
        }
    }
    // A target below the surface has no posture.
    let below = AxisTarget::Point(Point3::new(0.0, 0.0, -100.0));
    assert!(on_a_plane(PostureMode::Toward(below), curve).iter().all(|o| *o == Err(Infeasible::FromBelow)));
}
