//! Laws of pieces, of cuts inserted into them, and of their moves.

use facemill_cl_data::{CcPoint, CuttingLaw, Pass, Posture, RapidLaw, Silent};
use facemill_cutter_location::links::approach::{ApproachSettings, ApproachShape};
use facemill_cutter_location::links::link::{ClearanceSurface, LinkSettings};
use facemill_cutter_location::{
    Configuration, Hints, Obstacle, PoseTest, SearchCurve, SearchOrder, SearchSettings, Workcell,
};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::{AxisKind, AxisValues, Branch, BranchPreference, Machine};
use facemill_nc_program::dialect::RoundingBound;
use facemill_sample_parts::{AnalyticPart, AnalyticShape, MaterialSide};
use facemill_surface_model::TriMesh;
use facemill_tool_model::{FormatTag, Section, SpindleRotation, Stack, ToolAssembly, ToolFile, cl_from_cc};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::linearity::Linearity;
use crate::moves::{Move, MoveContext, MoveKind, MoveSettings, operation_moves, region_moves};
use crate::segments::pole::Tests;
use crate::segments::{Cut, Filler, LaidTask, PassSegment, PosePair, filled, split};

pub(crate) fn tool() -> ToolAssembly {
    let section = |length_mm, d| Section { length_mm, diameter_low_mm: d, diameter_high_mm: d };
    ToolAssembly::new(ToolFile {
        format: FormatTag::V1,
        name: "mill".to_owned(),
        number: 1,
        length_register: None,
        radius_mm: 25.0,
        corner_radius_mm: 2.0,
        n_inserts: 4,
        flute_length_mm: 20.0,
        dead_core_radius_mm: 0.0,
        max_ramp_angle_deg: 3.0,
        spindle_rotation: SpindleRotation::Clockwise,
        cutting_edge_angle_deg: None,
        stick_out_mm: 60.0,
        gauge_length_mm: 160.0,
        body: Stack { clearance_mm: 1.0, sections: vec![section(40.0, 36.0)] },
        holder: Stack { clearance_mm: 2.0, sections: vec![section(100.0, 60.0)] },
        assumed: Vec::new(),
    })
    .unwrap()
}

/// The plane z = 0 with a ball on it that sticks out by `out`.
pub(crate) fn plane_with_bump(place: Point3<f64>, out: f64) -> TriMesh {
    let plane = AnalyticPart::new(AnalyticShape::Plane { size: [600.0; 2] }).unwrap().mesh(8).unwrap();
    let shape = AnalyticShape::Sphere { radius: 1.0, material: MaterialSide::Inside };
    let ball = AnalyticPart::new(shape).unwrap().mesh(24).unwrap();
    plane.joined(&ball.transformed(&Isometry3::translation(place.x, place.y, out - 1.0)))
}

pub(crate) fn cell<'a>(machine: &'a Machine, tool: &'a ToolAssembly, tree: &'a MeshTree) -> Workcell<'a> {
    Workcell {
        machine,
        // Far from the table's axis, so that a turn of the table moves the part a lot.
        table_from_work: Isometry3::translation(900.0, 0.0, 900.0),
        tool,
        obstacles: vec![Obstacle {
            name: "part".to_owned(),
            mesh: tree.into(),
            gouge_allowance: Some(0.0),
            collision_allowance: 0.0,
            machine_body: None,
            pieces: None,
        }],
        preferred_branch: BranchPreference::Positive,
        axis_cone: None,
        gouge_tolerance: 0.02,
        max_lift: 0.2,
        lift_resolution: 1e-3,
        z_map: None,
    }
}

fn cc(x: f64) -> CcPoint {
    CcPoint::new(Point3::new(x, 0.0, 0.0), Vector3::z(), Vector3::x()).unwrap()
}

fn cut(test: &PoseTest<'_>, x: f64, rotate_deg: f64, branch: Branch) -> Cut {
    let posture = Posture { tilt: 5f64.to_radians(), rotate: f64::to_radians(rotate_deg) };
    let cl = cl_from_cc(test.cell.tool.cutter(), &cc(x), posture);
    let home = Configuration { axes: test.cell.machine.home(), branch };
    let near = test.configuration_like(&cl, &home).unwrap();
    let pose = test.try_posture(&cc(x), posture, Some(&near), &mut Hints::default()).unwrap();
    assert_eq!(test.cell.machine.branch_of(&pose.configuration.axes), branch);
    Cut { cc: cc(x), pose, inserted: false }
}

fn posture_deg(tilt: f64, rotate: f64) -> Posture {
    Posture { tilt: tilt.to_radians(), rotate: rotate.to_radians() }
}

/// Uniform numbers, always the same.
pub(crate) use facemill_test_kit::Random;

pub(crate) fn curve() -> SearchCurve {
    let up = Posture { tilt: 0.0, rotate: 0.0 };
    SearchCurve::new(up, Posture { tilt: 0.4, rotate: 1.0 }, SearchOrder::TiltFirst, 1.0).unwrap()
}

/// Rotates of 170 and -170 deg are 20 deg apart, and not 340.
#[test]
fn halfway_between_two_postures_that_lean_back_the_tool_leans_back() {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let tree = MeshTree::new(&plane_with_bump(Point3::new(200.0, 200.0, 0.0), 0.0));
    let cell = cell(&machine, &tool, &tree);
    let test = PoseTest::new(&cell);
    let cuts = [cut(&test, 0.0, 170.0, Branch::Positive), cut(&test, 10.0, -170.0, Branch::Positive)];
    for (from, to) in [(0, 1), (1, 0)] {
        let pair = PosePair { from: &cuts[from], to: &cuts[to] };
        let middle = Filler::new(&test, None, curve()).middle(&pair, &mut Hints::default()).unwrap();
        let axis = middle.pose.cl.axis;
        assert!((axis.x + 5f64.to_radians().sin()).abs() < 1e-6 && axis.y.abs() < 1e-6, "{axis:?}");
    }
}

#[test]
fn a_pass_is_split_where_the_branch_changes_and_not_at_the_border() {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let tree = MeshTree::new(&plane_with_bump(Point3::new(200.0, 200.0, 0.0), 0.0));
    let cell = cell(&machine, &tool, &tree);
    let test = PoseTest::new(&cell);
    let (plus, minus) = (Branch::Positive, Branch::Negative);
    // With the tool upright the machine is at the pole, on either branch.
    let up = Posture { tilt: 0.0, rotate: 0.0 };
    let before = cut(&test, 40.0, 0.0, minus).pose;
    let upright = test.try_posture(&cc(60.0), up, Some(&before.configuration), &mut Hints::default()).unwrap();
    let of = |x: f64, branch| cut(&test, x, 0.0, branch).pose;
    let outcomes = vec![Ok(of(0.0, plus)), Ok(of(20.0, plus)), Ok(before), Ok(upright), Ok(of(80.0, minus))];
    let pass = Pass::new((0..5).map(|k| cc(20.0 * f64::from(k))).collect());
    let task = LaidTask { pass, uncut_left: true, curve: curve(), given: Vec::new() };
    let mut left_out = vec![];
    let pieces = split(&test, &[task], &[Pass::new(outcomes)], 0, &mut left_out);
    assert_eq!(pieces.iter().map(|p| p.cuts.len()).collect::<Vec<_>>(), [2, 3]);
    assert!(left_out.is_empty());
}

const ROUNDING: RoundingBound = RoundingBound { linear: 0.0005, rotary: 1e-5, vector: 0.0 };

pub(crate) fn linearity(tolerance: f64) -> Linearity {
    Linearity { tolerance, rounding: ROUNDING, law: CuttingLaw::AxesLinear }
}

/// Makes pieces of two cuts 20 mm apart that turn the axis by 40° about the normal, over a bump
/// that the cutter touches only between the two; returns the number of pieces, and of inserted
/// poses that are lifted. Where the piece ends in between, both cuts are alone and left out.
fn filled_over(out: f64, branch: Branch) -> (usize, usize) {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let tree = MeshTree::new(&plane_with_bump(Point3::new(12.0, 4.0, 0.0), out));
    let cell = cell(&machine, &tool, &tree);
    let test = PoseTest::new(&cell);
    let cuts = vec![cut(&test, 0.0, -80.0, branch), cut(&test, 20.0, -20.0, branch)];
    // A curve that ends at the posture of the cuts: nothing larger can be searched.
    let end = cuts[0].pose.posture;
    let start = Posture { tilt: end.tilt, rotate: 0.0 };
    let curve = SearchCurve::new(start, end, SearchOrder::TiltFirst, 1.0).unwrap();
    let piece = PassSegment { copy: 0, pass: 0, cuts, uncut_left: true, curve, part: None };
    let settings = SearchSettings { u_step: 1.0, u_tolerance: 0.01, certified: None };
    let mut left_out = Vec::new();
    let pieces =
        filled(&Tests::one(&test), &linearity(0.05), Some(&settings), vec![piece], &mut left_out, &Silent).unwrap();
    let mut lifted = 0;
    for cuts in pieces.iter().map(|p| &p.cuts) {
        for pair in cuts.windows(2) {
            let [a, b] = [0, 1].map(|k| pair[k].pose.configuration.axes);
            assert!(!linearity(0.05).judge(&test, &a, &b).1, "still too far apart");
        }
        for cut in cuts.iter().filter(|c| c.inserted) {
            let (cl, axes) = (cut.pose.cl, cut.pose.configuration.axes);
            assert!(test.gouge(&cl, &mut Hints::default()).is_none() && machine.branch_of(&axes) == branch);
            assert!(test.collision(&axes, &mut Hints::default()).is_none());
            let r = tool.cutter().corner_radius();
            // Lowest point of the cutter over the plane.
            let sin = (1.0 - cl.axis.z.powi(2)).sqrt();
            let low = cl.tip.z + r * cl.axis.z - (tool.cutter().radius() - r) * sin - r;
            assert!((-1e-6..=cell.max_lift + 1e-6).contains(&low), "{low}");
            lifted += usize::from(low > 1e-3);
        }
    }
    if pieces.len() == 1 {
        assert!(pieces[0].cuts.len() > 5 && pieces[0].points() == 2);
    }
    assert_eq!(pieces.iter().map(PassSegment::points).sum::<usize>() + left_out.len(), 2);
    (pieces.len(), lifted)
}

#[test]
fn poses_between_cuts_are_seated_over_a_small_bump_and_the_piece_ends_before_a_large_one() {
    for branch in [Branch::Positive, Branch::Negative] {
        assert_eq!(filled_over(-0.5, branch), (1, 0));
        let (pieces, lifted) = filled_over(0.12, branch);
        assert!(pieces == 1 && lifted > 0, "{pieces} {lifted}");
        assert_eq!(filled_over(0.6, branch).0, 0);
    }
}

/// A ball beside the cutter that may block the postures between those of two cuts.
fn ball_beside(random: &mut Random) -> TriMesh {
    let plane = plane_with_bump(Point3::new(250.0, 250.0, 0.0), -0.5);
    let (angle, away) = (random.between(-3.1, 3.1), random.between(30.0, 52.0));
    let shape = AnalyticShape::Sphere { radius: random.between(4.0, 14.0), material: MaterialSide::Inside };
    let place = Isometry3::translation(away * f64::cos(angle), away * f64::sin(angle), random.between(5.0, 30.0));
    plane.joined(&AnalyticPart::new(shape).unwrap().mesh(16).unwrap().transformed(&place))
}

#[test]
fn between_postures_far_apart_either_the_control_stays_near_or_the_piece_ends() {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let mut random = Random(5);
    let (mut ended, mut whole, mut scenes) = (0, 0, 0);
    while scenes < 60 {
        let tree = MeshTree::new(&ball_beside(&mut random));
        let cell = cell(&machine, &tool, &tree);
        let test = PoseTest::new(&cell);
        let mut posture = |low, high| posture_deg(random.between(10.0, 24.0), random.between(low, high));
        let postures = [posture(-165.0, -125.0), posture(-45.0, 0.0)];
        let at = |k: usize| {
            let pose = test.try_posture(&cc(0.5 * k as f64), postures[k / 2], None, &mut Hints::default()).ok()?;
            Some(Cut { cc: cc(0.5 * k as f64), pose, inserted: false })
        };
        // Two points in each of two postures.
        let cuts: Option<Vec<Cut>> = (0..4).map(at).collect();
        let Some(cuts) = cuts else { continue };
        scenes += 1;
        let curve = SearchCurve::new(posture_deg(5.0, 0.0), posture_deg(25.0, -170.0), SearchOrder::RotateFirst, 1.0);
        let piece = PassSegment { copy: 0, pass: 0, cuts, uncut_left: true, curve: curve.unwrap(), part: None };
        let (limit, settings, mut left_out) = (linearity(0.01), SearchSettings::default(), Vec::new());
        let pieces = filled(&Tests::one(&test), &limit, Some(&settings), vec![piece], &mut left_out, &Silent).unwrap();
        for pair in pieces.iter().flat_map(|p| p.cuts.windows(2)) {
            let [a, b] = [0, 1].map(|k| pair[k].pose.configuration.axes);
            assert!(!limit.judge(&test, &a, &b).1, "scene {scenes}: {postures:?}");
        }
        assert!(pieces.iter().all(|p| p.cuts.len() >= 2 && !p.cuts[0].inserted));
        assert_eq!(pieces.iter().map(PassSegment::points).sum::<usize>() + left_out.len(), 4);
        if pieces.len() == 1 { whole += 1 } else { ended += 1 }
    }
    assert!(ended >= 5 && whole >= 5, "{ended} end, {whole} do not");
}

pub(crate) fn move_settings() -> MoveSettings {
    let shape = ApproachShape::TangentialArc { radius: 60.0, angle: 0.3 };
    let approach = ApproachSettings {
        shape,
        step: 2.0,
        line_step: 2.0,
        test_step: 0.5,
        rapid_clearance: 5.0,
        max_retract: 300.0,
        straight: 0.0,
        bend: 0.0,
        still_across: None,
    };
    let clearance = ClearanceSurface::Plane { origin: Point3::new(0.0, 0.0, 60.0), normal: Vector3::z_axis() };
    MoveSettings {
        entry: approach,
        exit: approach,
        link: LinkSettings { clearance, rapid_clearance: 5.0, rapid_law: RapidLaw::Linear.into() },
        turns: None,
        shortest_order: false,
        linearity: linearity(0.05),
        rapid_linearity: linearity(2.5),
    }
}

#[test]
fn every_move_is_driven_where_it_was_tested_and_a_branch_changes_above_the_clearance_surface_only() {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let tree = MeshTree::new(&plane_with_bump(Point3::new(250.0, 250.0, 0.0), 0.0));
    let cell = cell(&machine, &tool, &tree);
    let test = PoseTest::new(&cell);
    let branches = [Branch::Positive, Branch::Negative, Branch::Negative, Branch::Positive];
    let pieces = |branches: [Branch; 4]| -> Vec<PassSegment> {
        let piece = |(pass, branch): (usize, &Branch)| {
            let at = |k: i32| cut(&test, -60.0 + 20.0 * f64::from(k), -60.0 + 5.0 * f64::from(k), *branch);
            PassSegment { copy: 0, pass, cuts: (0..6).map(at).collect(), uncut_left: true, curve: curve(), part: None }
        };
        branches.iter().enumerate().map(piece).collect()
    };
    let settings = move_settings();
    let mut left_out = vec![];
    // Cuts as found by the search are too far apart for the control: they are filled first, as in a
    // plan.
    let search = SearchSettings::default();
    let pieces = |branches| {
        filled(&Tests::one(&test), &settings.linearity, Some(&search), pieces(branches), &mut Vec::new(), &Silent)
            .unwrap()
    };
    let done = operation_moves(&test, &settings, pieces(branches), None, &mut left_out, &Silent).unwrap();
    assert!(left_out.is_empty() && done.pieces.len() == 4 && done.linearisation <= settings.linearity.tolerance);
    let on = |m: &Move| machine.branch_of(&m.axes);
    let mut changes = 0;
    let mut at: Option<Move> = None;
    for (piece, branch) in done.pieces.iter().zip(branches) {
        for m in &piece.moves {
            let length = tool.gauge_length();
            let reached = machine.cl_point(&m.axes, length).transformed(test.work_from_table());
            assert!((reached.tip - m.cl.tip).norm() < 1e-8 && (*reached.axis - *m.cl.axis).norm() < 1e-11);
            assert!(m.kind == MoveKind::Rapid || on(m) == branch, "{:?} off its branch", m.kind);
            assert!(test.gouge(&m.cl, &mut Hints::default()).is_none());
            assert!(test.collision(&m.axes, &mut Hints::default()).is_none());
            if let Some(before) = at.filter(|before| on(before) != on(m)) {
                assert!(m.kind == MoveKind::Rapid);
                for cl in [before.cl, m.cl] {
                    assert!(settings.link.clearance.height(&cl.tip) >= test.clearance_margin() - 1e-6);
                }
                changes += 1;
            }
            at = Some(*m);
        }
        assert!(piece.moves.iter().filter(|m| m.kind == MoveKind::Cut).count() >= 5);
    }
    assert_eq!(changes, 2);
    assert!(done.retract.iter().all(|m| on(m) == branches[3]));
    let one = operation_moves(&test, &settings, pieces([Branch::Negative; 4]), None, &mut left_out, &Silent).unwrap();
    assert!(one.pieces.iter().flat_map(|p| &p.moves).chain(&one.retract).all(|m| on(m) == Branch::Negative));
}

/// The plane z = 0 with lips 40 mm above it at both sides of a slot for x < 60: the body passes
/// between them, the cutter below does not.
fn undercut_slot() -> TriMesh {
    let lip = |y: f64| {
        let shape = AnalyticShape::Plane { size: [360.0, 60.0] };
        let top = AnalyticPart::new(shape).unwrap().mesh(8).unwrap();
        let under = top.transformed(&Isometry3::rotation(Vector3::new(std::f64::consts::PI, 0.0, 0.0)));
        let at = |z: f64| Isometry3::translation(-120.0, y, z);
        top.transformed(&at(44.0)).joined(&under.transformed(&at(40.0)))
    };
    plane_with_bump(Point3::new(250.0, 250.0, 0.0), 0.0).joined(&lip(-54.0)).joined(&lip(54.0))
}

/// A pass that begins under lips has no way up from there: it is cut from where one leads up.
#[test]
fn passes_begin_and_end_where_a_way_leads_out() {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let tree = MeshTree::new(&undercut_slot());
    let cell = cell(&machine, &tool, &tree);
    let test = PoseTest::new(&cell);
    let settings = move_settings();
    let n = 24;
    let piece = |reversed: bool| {
        let mut cuts: Vec<Cut> =
            (0..n).map(|k| cut(&test, -60.0 + 10.0 * f64::from(k), 0.0, Branch::Positive)).collect();
        if reversed {
            cuts.reverse();
        }
        PassSegment { copy: 0, pass: usize::from(reversed), cuts, uncut_left: true, curve: curve(), part: None }
    };
    for reversed in [false, true] {
        let mut left_out = vec![];
        let done = operation_moves(&test, &settings, vec![piece(reversed)], None, &mut left_out, &Silent).unwrap();
        let kept: Vec<f64> = done.pieces[0].piece.cuts.iter().map(|cut| cut.cc.position.x).collect();
        assert_eq!(kept.len() + left_out.len(), n as usize);
        // The rim is under the lips until its rear, 25 mm behind the axis, is beyond x = 60.
        assert!(kept.iter().all(|x| *x > 60.0) && kept.len() > 5, "{kept:?}");
        let what = if reversed { "no exit" } else { "no entry" };
        for lost in &left_out {
            assert!(lost.reason.starts_with(&format!("{what}: no way to the clearance surface: ")), "{}", lost.reason);
        }
        for m in done.pieces.iter().flat_map(|piece| &piece.moves).chain(&done.retract) {
            assert!(test.gouge(&m.cl, &mut Hints::default()).is_none());
        }
    }
}

#[test]
fn links_count_the_shorter_turn_of_an_endless_table() {
    let (machine, tool) = (Machine::head_b_table_c().unwrap(), tool());
    let tree = MeshTree::new(&plane_with_bump(Point3::new(400.0, 400.0, 0.0), 0.0));
    // Half a turn about the table, so that small turns of the lean cross C 180.
    let about = Vector3::z() * std::f64::consts::PI;
    let table_from_work = Isometry3::new(Vector3::new(900.0, 0.0, 900.0), about);
    let cell = Workcell { table_from_work, ..cell(&machine, &tool, &tree) };
    let test = PoseTest::new(&cell);
    let settings = MoveSettings { shortest_order: true, ..move_settings() };
    let pieces: Vec<PassSegment> = [(-150.0, 5.0), (0.0, -5.0), (150.0, 5.0)]
        .into_iter()
        .enumerate()
        .map(|(pass, (from, rotate))| {
            let at = |k: i32| cut(&test, from + 2.0 * f64::from(k), rotate, Branch::Positive);
            PassSegment { copy: 0, pass, cuts: (0..4).map(at).collect(), uncut_left: true, curve: curve(), part: None }
        })
        .collect();
    let largest_turn = |a: &AxisValues, b: &AxisValues| {
        let rotary = (0..a.len()).filter(|&k| machine.axes()[k].kind == AxisKind::Rotary);
        rotary.map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
    };
    // As tested, the table is nearly a turn away from one pass to the next.
    let as_tested = |k: usize| pieces[k].cuts[0].pose.configuration.axes;
    assert!(largest_turn(&as_tested(0), &as_tested(1)) > 5.5);
    let turns = std::sync::Mutex::new(Vec::new());
    let link_time = |from: &AxisValues, through: &[AxisValues]| {
        let mut at = *from;
        for to in through {
            turns.lock().unwrap().push(largest_turn(&at, to));
            at = *to;
        }
        1.0
    };
    let context = MoveContext { region: None, link_time: Some(&link_time) };
    let mut left_out = Vec::new();
    let done = region_moves(&test, &settings, &context, pieces, None, &mut left_out, &Silent).unwrap();
    assert!(left_out.is_empty(), "{left_out:?}");
    let order = done.order.unwrap();
    assert!(order.timed_links >= 2 && order.is_exact, "{order:?}");
    let turns = turns.into_inner().unwrap();
    assert!(!turns.is_empty() && turns.iter().all(|turn| *turn < 1.0), "{turns:?}");
}
