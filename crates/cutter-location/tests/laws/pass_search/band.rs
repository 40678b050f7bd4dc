//! Smooth band where little is feasible, and where it would turn too fast.
//!
//! Most scenes put cages around the holder: three balls that leave it room for a few postures about
//! one of them. The postures that a plan may try there are few and known.

use facemill_cl_data::{CcPoint, Pass, Posture, Silent};
use facemill_cutter_location::{
    Hints, PassSettings, PassTask, PlannedPass, PoseTest, PostureMode, SearchCurve, SearchOrder, SearchSettings,
    SmoothSettings, Workcell, plan_passes, search,
};
use facemill_interference::MeshTree;
use facemill_tool_model::{Cutter, ToolAssembly};
use nalgebra::{Point3, Vector3};

use crate::kit::{Ball, Random, cc_on_plane, curve_deg, machine, obstacle, plane, posture_deg, tool, workcell};
use crate::pass_search::pass_costs::SMOOTH;
use crate::rods::beside;

/// Distance of neighbours in the lattice of the graph's nodes, deg of axis turn (docs/method.md).
const COARSE: f64 = 2.0;
/// Distance of neighbours in the fine lattice, deg of axis turn (docs/method.md).
const FINE: f64 = 0.25 * COARSE;
/// Radius of the holder of `kit::tool` with its clearance, and a height above the tip within it,
/// mm.
const HOLDER: f64 = 32.0;
const HEIGHT: f64 = 120.0;
/// Cages of points this far apart do not touch each other's holders, mm.
const APART: f64 = 200.0;

fn mill() -> ToolAssembly {
    tool(16.0, 2.0, 12.0)
}

/// Returns balls that leave the tool axis a triangle of postures about one, whose middle is `room`
/// (rad) from its sides; the triangle is turned by an angle about the axis.
fn cage(cutter: &Cutter, cc: &CcPoint, posture: Posture, room: f64, turn: f64) -> Vec<MeshTree> {
    let radius = 4.0;
    let away = HOLDER + radius + HEIGHT * room.tan();
    let at = |k: usize| {
        let (sin, cos) = (turn + std::f64::consts::TAU / 3.0 * k as f64).sin_cos();
        beside(cutter, cc, posture, [away * cos, away * sin, HEIGHT])
    };
    (0..3).map(|k| MeshTree::new(&Ball { center: at(k), radius }.mesh())).collect()
}

/// Passes the workcell of a plane and these obstacles to a function.
fn in_cell<T>(balls: &[MeshTree], look: impl FnOnce(&PoseTest<'_>) -> T) -> T {
    let part = MeshTree::new(&plane(4000.0));
    let (machine, tool) = (machine(), mill());
    let obstacles = balls.iter().map(|b| obstacle("ball", b)).chain([obstacle("part", &part)]).collect();
    look(&PoseTest::new(&workcell(&machine, &tool, obstacles)))
}

fn is_free(test: &PoseTest<'_>, cc: &CcPoint, posture: Posture) -> bool {
    test.try_posture(cc, posture, None, &mut Hints::default()).is_ok()
}

fn settings(search: SearchSettings, max_turn_per_mm: f64) -> PassSettings {
    PassSettings { search, mode: PostureMode::Smooth(SMOOTH), max_turn_per_mm }
}

fn planned(test: &PoseTest<'_>, points: &[CcPoint], curve: SearchCurve, settings: &PassSettings) -> PlannedPass {
    let task = PassTask { pass: Pass::new(points.to_vec()), curve, strips: Vec::new(), given: Vec::new() };
    plan_passes(test, &[task], settings, &Silent).unwrap().remove(0)
}

/// The lattice over tilts and rotates (deg) as docs/method.md defines it, neighbours at most
/// `spacing` (deg) apart.
fn lattice(tilts: [f64; 2], rotates: [f64; 2], spacing: f64) -> Vec<Posture> {
    let steps = |extent: f64| (extent / spacing - 1e-9).ceil() as usize;
    let part = |ends: [f64; 2], k: usize, n: usize| ends[0] + (ends[1] - ends[0]) * k as f64 / n.max(1) as f64;
    let rows = steps(tilts[1] - tilts[0]);
    let row = |i: usize| {
        let tilt = part(tilts, i, rows);
        let n = steps((rotates[1] - rotates[0]).abs() * tilt.to_radians().sin());
        (0..=n).map(move |j| posture_deg(tilt, part(rotates, j, n)))
    };
    (0..=rows).flat_map(row).collect()
}

/// Ranges for places beside the curve: with so few postures that the lattices are as fine as
/// possible.
const TILTS: [f64; 2] = [6.0, 16.0];
const ROTATES: [f64; 2] = [0.0, -60.0];

fn curve_of_ranges() -> SearchCurve {
    curve_deg([TILTS[0], ROTATES[0]], [TILTS[1], ROTATES[1]], SearchOrder::TiltFirst, 4.0)
}

/// Returns whether neither the curve nor the lattice of the graph has a posture at a point.
fn is_beside(test: &PoseTest<'_>, cc: &CcPoint) -> bool {
    let found = search(test, cc, &curve_of_ranges(), &SearchSettings::default(), 0.0, None, &mut Hints::default());
    found.is_err() && lattice(TILTS, ROTATES, COARSE).iter().all(|p| !is_free(test, cc, *p))
}

/// Returns whether all postures of a disc about one are feasible, on a grid. The disc is large
/// enough to hold a posture of the fine lattice (half the diagonal of its meshes, and a little).
fn is_wide_place(test: &PoseTest<'_>, cc: &CcPoint, p: Posture) -> bool {
    let radius = 0.75 * FINE.to_radians();
    let grid = (-4..=4).flat_map(|i| (-4..=4).map(move |j| (0.25 * f64::from(i), 0.25 * f64::from(j))));
    grid.filter(|(x, y)| x.hypot(*y) <= 1.0).all(|(x, y)| {
        let near = Posture { tilt: p.tilt + radius * x, rotate: p.rotate + radius * y / p.tilt.sin() };
        is_free(test, cc, near)
    })
}

/// Returns a posture within the ranges, at least a degree from their borders, and an angle.
fn any_place(random: &mut Random) -> (Posture, f64) {
    let tilt = random.between(TILTS[0] + 1.0, TILTS[1] - 1.0);
    (posture_deg(tilt, random.between(ROTATES[1] + 8.0, ROTATES[0] - 8.0)), random.between(0.0, 3.0))
}

#[test]
fn a_place_as_wide_as_the_fine_lattice_is_found_where_curve_and_graph_have_none() {
    assert!(lattice(TILTS, ROTATES, FINE).len() <= 8 * 96, "the fine lattice is as fine as it may be");
    let mut random = Random(71);
    let cc = cc_on_plane(0.0, 0.0);
    let (mut scenes, mut tried) = (0, 0);
    while scenes < 12 && tried < 40 {
        tried += 1;
        let (place, turn) = any_place(&mut random);
        let balls = cage(mill().cutter(), &cc, place, 0.45f64.to_radians(), turn);
        scenes += in_cell(&balls, |test| {
            if !is_wide_place(test, &cc, place) || !is_beside(test, &cc) {
                return 0;
            }
            let plan = planned(test, &[cc], curve_of_ranges(), &settings(SearchSettings::default(), 0.02));
            assert_eq!(plan.optimum.unwrap().layers, 0, "the graph has no posture");
            assert!(plan.outcomes.points[0].is_ok(), "{place:?} is feasible");
            1
        });
    }
    assert!(scenes >= 12, "{scenes} of {tried} scenes");
}

#[test]
fn a_place_beside_the_curve_is_found_again_behind_many_points_without_one() {
    // One point with a place, more blocked ones than are all searched closely, and one with the
    // same place again.
    let blocked = 25;
    let ends = [cc_on_plane(0.0, 0.0), cc_on_plane(2.0 * APART, 0.0)];
    let between = (0..blocked).map(|k| cc_on_plane(APART + 0.1 * f64::from(k), 0.0));
    let points: Vec<CcPoint> = [ends[0]].into_iter().chain(between).chain([ends[1]]).collect();
    let mut random = Random(72);
    let (mut scenes, mut tried) = (0, 0);
    while scenes < 2 && tried < 12 {
        tried += 1;
        let (place, turn) = any_place(&mut random);
        let mut balls: Vec<MeshTree> =
            ends.iter().flat_map(|cc| cage(mill().cutter(), cc, place, 0.45f64.to_radians(), turn)).collect();
        // In the middle of all holders.
        balls.push(MeshTree::new(&Ball { center: Point3::new(APART, 0.0, 100.0), radius: 25.0 }.mesh()));
        scenes += in_cell(&balls, |test| {
            if !ends.iter().all(|cc| is_wide_place(test, cc, place) && is_beside(test, cc)) {
                return 0;
            }
            let plan = planned(test, &points, curve_of_ranges(), &settings(SearchSettings::default(), 0.02));
            let outcomes = &plan.outcomes.points;
            assert!(outcomes[1..=blocked as usize].iter().all(Result::is_err), "nothing is feasible in the middle");
            assert!(outcomes[0].is_ok() && outcomes[points.len() - 1].is_ok(), "{place:?} is feasible at both ends");
            1
        });
    }
    assert!(scenes >= 2, "{scenes} of {tried} scenes");
}

#[test]
fn a_point_with_room_for_its_node_only_stays_in_it() {
    // One tilt, so none above can be tried; rotates of the graph's lattice, which the fine one does
    // not have.
    let (tilts, rotates) = ([12.0, 12.0], [-20.0, -60.0]);
    let curve = curve_deg([12.0, rotates[0]], [12.0, rotates[1]], SearchOrder::TiltFirst, 1.0);
    let (coarse, fine) = (lattice(tilts, rotates, COARSE), lattice(tilts, rotates, FINE));
    let search_settings = SearchSettings { u_step: 0.35, ..SearchSettings::default() };
    // To and fro, unlike any smooth sequence.
    let nodes = [1, 4, 1, 4, 4, 1, 4, 1].map(|k: usize| coarse[k]);
    let points: Vec<CcPoint> = (0..nodes.len()).map(|k| cc_on_plane(APART * k as f64, 0.0)).collect();
    let room = 0.04f64.to_radians();
    let of_point = |(cc, node): (&CcPoint, &Posture)| cage(mill().cutter(), cc, *node, room, 0.3);
    let balls: Vec<MeshTree> = points.iter().zip(&nodes).flat_map(of_point).collect();
    in_cell(&balls, |test| {
        for (cc, node) in points.iter().zip(&nodes) {
            let free: Vec<Posture> = coarse.iter().chain(&fine).copied().filter(|p| is_free(test, cc, *p)).collect();
            assert_eq!(free, [*node], "nothing else is feasible");
            assert!(search(test, cc, &curve, &search_settings, 0.0, None, &mut Hints::default()).is_err());
        }
        let plan = planned(test, &points, curve, &settings(search_settings, 0.02));
        assert_eq!(plan.optimum.unwrap().layers, points.len());
        for (outcome, node) in plan.outcomes.points.iter().zip(&nodes) {
            let found = outcome.as_ref().expect("its node is feasible").posture;
            assert!((found.rotate - node.rotate).abs() * node.tilt.sin() < 2.0 * room, "{found:?} {node:?}");
        }
    });
}

/// Points over an edge rounded by a small radius between two planes: the normal turns by `bend`
/// (rad) within a few of them.
fn over_an_edge(bend: f64, at: usize, n: usize, step: f64) -> Vec<CcPoint> {
    const ROUNDED: usize = 3;
    let mut position = Point3::origin();
    (0..n)
        .map(|k| {
            let share = (k.saturating_sub(at) as f64 / ROUNDED as f64).min(1.0);
            let (sin, cos) = (bend * share).sin_cos();
            let (normal, feed) = (Vector3::new(sin, 0.0, cos), Vector3::new(cos, 0.0, -sin));
            position += feed * step;
            CcPoint::new(position, normal, feed).unwrap()
        })
        .collect()
}

#[test]
fn most_passes_that_smoothing_makes_turn_too_fast_are_bound_until_they_do_not() {
    let (machine, tool) = (machine(), mill());
    let cell: Workcell<'_> = workcell(&machine, &tool, Vec::new());
    let test = PoseTest::new(&cell);
    // Smoothed without the limit, the axis would swing through the ranges at the edge. They are so
    // small that a turn over all of them is within the limit between layers, but not between
    // neighbours.
    let curve = curve_deg([12.0, -20.0], [12.6, -22.0], SearchOrder::TiltFirst, 1.0);
    // A cusp that limits nothing.
    let smooth = SmoothSettings { cusp: 0.5, ..SMOOTH };
    let settings = PassSettings { mode: PostureMode::Smooth(smooth), ..settings(SearchSettings::default(), 5e-4) };
    let mut random = Random(73);
    // Rounds are few, so steps may remain, which are reported as jumps; without binding there are
    // some in every pass.
    let (mut settled, scenes) = (0, 20);
    for _ in 0..scenes {
        let (bend, at) = (random.between(0.015, 0.03), random.between(11.0, 19.0) as usize);
        let points = over_an_edge(bend, at, 32, random.between(3.5, 5.0));
        let plan = planned(&test, &points, curve, &settings);
        let optimum = plan.optimum.unwrap();
        assert!(optimum.graph < 1e4, "no step of the graph's sequence is beyond a limit: {optimum:?}");
        settled += usize::from(optimum.jumps == 0);
    }
    assert!(2 * settled >= scenes, "no step is beyond a limit in {settled} of {scenes} passes only");
}
