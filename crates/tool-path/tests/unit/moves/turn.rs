use super::*;
use crate::move_laws::{Random, cell, curve, linearity, move_settings, plane_with_bump, tool};
use crate::moves::{MoveKind, MoveSettings, OperationMoves, TurnState, operation_moves, reach};
use crate::segments::PassSegment;
use facemill_cl_data::Silent;
use facemill_cutter_location::{AxisCone, Obstacle, Workcell};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::Machine;
use facemill_tool_model::{Cutter, ToolAssembly};
use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};

const TURNS: TurnSettings = TurnSettings { feed: 20.0, approach_feed: 20.0, test_step: 0.5 };

/// Feeds at which no link is faster.
const FAST_TURNS: TurnSettings = TurnSettings { feed: 1e3, approach_feed: 0.1, test_step: 0.5 };

/// Half the length of a pass, mm.
const HALF: f64 = 40.0;

/// Passes along x on z = 0, back and forth, `step` mm apart, whose lean to the uncut side is the
/// same in the workpiece frame.
fn zigzag(test: &PoseTest<'_>, n: usize, step: f64, [tilt, rotate]: [f64; 2]) -> Vec<PassSegment> {
    let pass = |pass: usize| {
        let sense = if pass.is_multiple_of(2) { 1.0 } else { -1.0 };
        let at = |k: usize| {
            let x = sense * HALF * (k as f64 / 10.0 - 1.0);
            let position = Point3::new(x, step * pass as f64, 0.0);
            let cc = CcPoint::new(position, Vector3::z(), Vector3::x() * sense).unwrap();
            let posture = Posture { tilt, rotate: rotate * sense };
            let pose = test.try_posture(&cc, posture, None, &mut Hints::default()).unwrap();
            Cut { cc, pose, inserted: false }
        };
        let cuts = (0..=20).map(at).collect();
        PassSegment { copy: 0, pass, cuts, uncut_left: sense > 0.0, curve: curve(), part: None }
    };
    (0..n).map(pass).collect()
}

/// A part mounted with a lean of the table's axis, so that no normal is at the pole.
fn leaning<'a>(machine: &'a Machine, tool: &'a ToolAssembly, tree: &'a MeshTree, lean: f64) -> Workcell<'a> {
    let mut cell = cell(machine, tool, tree);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), lean);
    cell.table_from_work = Isometry3::from_parts(cell.table_from_work.translation, turn);
    cell
}

/// Height of the lowest point of the cutter above z = 0.
fn lowest(cutter: &Cutter, cl: &ClPoint) -> f64 {
    let r = cutter.corner_radius();
    let sin = (1.0 - cl.axis.z.powi(2)).max(0.0).sqrt();
    cl.tip.z + r * cl.axis.z - cutter.rim_radius() * sin - r
}

#[test]
fn turns_on_a_plane_keep_contact_and_leave_and_arrive_along_the_passes() {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let tree = MeshTree::new(&plane_with_bump(Point3::new(250.0, 250.0, 0.0), -0.5));
    let mut random = Random(7);
    for scene in 0..24 {
        let cell = leaning(&machine, &tool, &tree, random.between(0.5, 0.9));
        let test = PoseTest::new(&cell);
        let (tilt, rotate, step) = (random.between(0.03, 0.2), random.between(0.0, 1.5), random.between(1.0, 12.0));
        let pieces = zigzag(&test, 2, step, [tilt, rotate]);
        let settings = move_settings();
        let [from, to] = [0, 1].map(|k| reach(&test, &settings, pieces[k].clone()).0.unwrap());
        let turn = TurnSearch::new(&test, &FAST_TURNS).find(&from, &to);
        let turn = turn.unwrap_or_else(|e| panic!("scene {scene}: {}", e.text(&test)));
        let cutter = tool.cutter();
        let ends = [&pieces[0].cuts[20].pose, &pieces[1].cuts[0].pose];
        let tips: Vec<Point3<f64>> = std::iter::once(ends[0].cl.tip)
            .chain(turn.poses.iter().map(|w| w.cl.tip))
            .chain([ends[1].cl.tip])
            .collect();
        for w in &turn.poses {
            let low = lowest(cutter, &w.cl);
            assert!(low.abs() < 1e-6, "scene {scene}: {low} mm off the plane");
            assert!(test.gouge(&w.cl, &mut Hints::default()).is_none());
            // The lowest point of the rim is the contact: no farther out than half the largest of
            // what the curve needs.
            let lean = Vector3::new(w.cl.axis.x, w.cl.axis.y, 0.0).normalize();
            let out = (w.cl.tip + lean * (cutter.rim_radius() * w.cl.axis.z)).x - HALF;
            assert!(out < 0.5 * step.max(cutter.rim_radius()) + 2.0, "scene {scene}: {out} mm beyond the border");
        }
        let way = |a: usize, b: usize| (tips[b] - tips[a]).normalize();
        let n = tips.len();
        assert!(
            way(0, 1).x > 0.97 && way(n - 2, n - 1).x < -0.97,
            "scene {scene}: {} {}",
            way(0, 1),
            way(n - 2, n - 1)
        );
        // No corner between two blocks.
        for k in 2..n {
            let turned = way(k - 2, k - 1).angle(&way(k - 1, k));
            assert!(turned < 0.45, "scene {scene}: corner of {turned} at {k} of {n}, passes {step} apart");
        }
        let branch = ends[0].configuration.branch;
        assert!(turn.poses.iter().all(|w| w.configuration.branch == branch));
    }
}

/// Moves of four passes, in the order of the passes given.
fn moves(tree: &MeshTree, change: impl Fn(&mut Vec<PassSegment>), turns: Option<TurnSettings>) -> OperationMoves {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let cell = leaning(&machine, &tool, tree, 0.7);
    let test = PoseTest::new(&cell);
    let mut pieces = zigzag(&test, 4, 5.0, [0.1, 1.2]);
    change(&mut pieces);
    let settings = MoveSettings { turns, linearity: linearity(0.5), ..move_settings() };
    let mut left_out = Vec::new();
    let done = operation_moves(&test, &settings, pieces, None, &mut left_out, &Silent).unwrap();
    assert!(left_out.is_empty());
    done
}

fn flat() -> MeshTree {
    MeshTree::new(&plane_with_bump(Point3::new(250.0, 250.0, 0.0), -0.5))
}

fn kinds(done: &OperationMoves) -> Vec<(MoveKind, [f64; 3])> {
    let all = done.pieces.iter().flat_map(|p| &p.moves).chain(&done.retract);
    all.map(|m| (m.kind, m.cl.tip.into())).collect()
}

#[test]
fn a_turn_that_is_taken_back_leaves_the_moves_as_without_turns() {
    let (turned, linked) = (moves(&flat(), |_| {}, Some(TURNS)), moves(&flat(), |_| {}, None));
    assert!(turned.pieces[1..].iter().all(|p| matches!(p.turn, TurnState::Made(_))));
    let rapids = |done: &OperationMoves| kinds(done).iter().filter(|k| k.0 == MoveKind::Rapid).count();
    // Only the way to the first pass and back from the last one.
    let first = turned.pieces[0].moves.iter().filter(|m| m.kind == MoveKind::Rapid).count();
    assert_eq!(rapids(&turned), first + turned.retract.len());
    let mut restored = turned;
    for piece in [2, 1, 3] {
        restored.take_back_turn(piece, "a test".to_owned());
    }
    assert_eq!(kinds(&restored), kinds(&linked));
    assert!(matches!(&restored.pieces[1].turn, TurnState::Refused(why) if why == "a test"));
    // What is no turn stays.
    restored.take_back_turn(1, "again".to_owned());
    restored.take_back_turn(9, "no piece".to_owned());
    assert_eq!(kinds(&restored), kinds(&linked));
}

fn refusals(done: &OperationMoves) -> Vec<Option<String>> {
    let why = |p: &crate::moves::PieceMoves| match &p.turn {
        TurnState::Refused(why) => Some(why.clone()),
        TurnState::NotSought | TurnState::Made(_) => None,
    };
    done.pieces.iter().map(why).collect()
}

#[test]
fn a_link_stays_across_a_hole_and_between_passes_of_one_way() {
    // The second pass is the rest of the first one, behind a hole.
    let hole = |pieces: &mut Vec<PassSegment>| {
        let rest = pieces[0].cuts.split_off(13);
        pieces[0].cuts.truncate(9);
        pieces.insert(1, PassSegment { cuts: rest, ..pieces[0].clone() });
    };
    let found = refusals(&moves(&flat(), hole, Some(TURNS)));
    assert!(found[1].as_ref().unwrap().contains("does not start beside"), "{found:?}");
    assert_eq!(found.iter().flatten().count(), 1, "{found:?}");
    // Every second pass alone: one way.
    let one_way = |pieces: &mut Vec<PassSegment>| {
        pieces.remove(3);
        pieces.remove(1);
    };
    assert_eq!(refusals(&moves(&flat(), one_way, Some(TURNS))).iter().flatten().count(), 1);
}

#[test]
fn a_link_stays_at_a_wall_higher_than_turns_are_lifted_and_over_a_low_one_the_turn_is_lifted() {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let flat = flat();
    let (reach_cell, settings) = (leaning(&machine, &tool, &flat, 0.7), move_settings());
    let reach_test = PoseTest::new(&reach_cell);
    let pieces = zigzag(&reach_test, 2, 5.0, [0.1, 0.0]);
    let [from, to] = [0, 1].map(|k| reach(&reach_test, &settings, pieces[k].clone()).0.unwrap());
    let highest = |out: f64| {
        let tree = MeshTree::new(&ball_beyond(out));
        let cell = leaning(&machine, &tool, &tree, 0.7);
        let test = PoseTest::new(&cell);
        let turn = TurnSearch::new(&test, &FAST_TURNS).find(&from, &to)?;
        let lows = turn.poses.iter().map(|w| lowest(tool.cutter(), &w.cl));
        assert!(turn.poses.iter().all(|w| test.gouge(&w.cl, &mut Hints::default()).is_none()));
        Ok(lows.fold(0.0, f64::max))
    };
    assert!(highest(0.0).unwrap() < 1e-6);
    let lifted = highest(0.4).unwrap();
    assert!((0.3..=1.0).contains(&lifted), "{lifted}");
    assert!(matches!(highest(4.0), Err(NoTurn::Blocked(Infeasible::Gouge { .. }))));
}

/// The plane with a ball that sticks out of it beyond the end of the passes.
fn ball_beyond(out: f64) -> facemill_surface_model::TriMesh {
    let shape = facemill_sample_parts::AnalyticShape::Sphere {
        radius: 2.5,
        material: facemill_sample_parts::MaterialSide::Inside,
    };
    let ball = facemill_sample_parts::AnalyticPart::new(shape).unwrap().mesh(24).unwrap();
    let plane = plane_with_bump(Point3::new(250.0, 250.0, 0.0), -0.5);
    plane.joined(&ball.transformed(&Isometry3::translation(HALF + 6.0, 2.5, out - 2.5)))
}

#[test]
fn turns_slower_than_a_link_can_be_are_not_taken() {
    let slow = TurnSettings { feed: 0.01, ..TURNS };
    let found = refusals(&moves(&flat(), |_| {}, Some(slow)));
    assert!(found[1..].iter().all(|why| why.as_deref() == Some("a link is not slower")), "{found:?}");
}

#[test]
fn the_axis_of_a_turn_stays_in_the_cone() {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let tree = flat();
    let cell = leaning(&machine, &tool, &tree, 0.7);
    let test = PoseTest::new(&cell);
    let settings = move_settings();
    let pieces = zigzag(&test, 2, 5.0, [0.1, 0.3]);
    let [from, to] = [0, 1].map(|k| reach(&test, &settings, pieces[k].clone()).0.unwrap());
    // Both ends are in the cone; the lean that swings with the feed leaves it.
    let (axis, half_angle) = (Unit::new_normalize(Vector3::new(0.0, -0.1, 1.0)), 0.17);
    let largest = |turn: &Turn| turn.poses.iter().map(|w| w.cl.axis.angle(&axis)).fold(0.0, f64::max);
    let free = TurnSearch::new(&test, &FAST_TURNS).find(&from, &to).unwrap();
    assert!(largest(&free) > half_angle + 0.01, "a cone that forbids nothing: {}", largest(&free));
    let mut narrow = cell.clone();
    narrow.axis_cone = Some(AxisCone { axis, half_angle });
    let test = PoseTest::new(&narrow);
    let turn = TurnSearch::new(&test, &FAST_TURNS).find(&from, &to).unwrap();
    assert!(largest(&turn) <= half_angle, "{}", largest(&turn));
    // No way round is in this one.
    narrow.axis_cone = Some(AxisCone { axis: Vector3::z_axis(), half_angle: 0.05 });
    let test = PoseTest::new(&narrow);
    let found = TurnSearch::new(&test, &FAST_TURNS).find(&from, &to);
    assert!(matches!(found, Err(NoTurn::Blocked(Infeasible::OutsideCone { .. }))));
}

#[test]
fn the_side_away_from_the_contact_does_not_sink_into_stock() {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let tree = flat();
    let settings = move_settings();
    let find = |tilts: [f64; 2], stock: Option<f64>| {
        let mut cell = leaning(&machine, &tool, &tree, 0.7);
        let test = PoseTest::new(&cell);
        let piece = |k: usize| zigzag(&test, 2, 5.0, [tilts[k], 1.2]).swap_remove(k);
        let [from, to] = [0, 1].map(|k| reach(&test, &settings, piece(k)).0.unwrap());
        if let Some(thickness) = stock {
            let stock = Obstacle::part("stock", &tree);
            cell.obstacles.push(Obstacle { gouge_allowance: None, collision_allowance: thickness, ..stock });
        }
        TurnSearch::new(&PoseTest::new(&cell), &FAST_TURNS).find(&from, &to)
    };
    // From 17 to 2 degrees the far side of a disc of 50 mm sinks by 12 mm over a short turn.
    assert!(matches!(find([0.3, 0.03], Some(15.0)), Err(NoTurn::Blocked(Infeasible::Ramp { .. }))));
    assert!(find([0.1, 0.1], Some(15.0)).is_ok());
    assert!(find([0.1, 0.098], Some(15.0)).is_ok());
}

#[test]
fn both_sides_of_a_wall_are_no_neighbours() {
    let at = |normal: Vector3<f64>, feed: Vector3<f64>, z: f64| {
        CcPoint::new(Point3::new(0.0, 0.3, z), normal, feed).unwrap()
    };
    let last = at(Vector3::z(), Vector3::x(), 0.0);
    let beside = CcPoint { position: last.position + Vector3::y() * 2.0, feed: -last.feed, ..last };
    assert!(is_beside(&last, &beside, 25.0));
    let below = CcPoint { normal: -beside.normal, ..beside };
    assert!(!is_beside(&last, &below, 25.0));
}
