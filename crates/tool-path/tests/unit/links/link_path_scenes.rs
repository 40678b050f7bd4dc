//! Scenes in which one kind of way is the fastest free one, and the result of the choice there.

use std::fmt::Write;

use facemill_cl_data::{ClPoint, Silent};
use facemill_cutter_location::links::link::ClearanceSurface;
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::{AxisKind, AxisValues, BranchPreference, Machine};
use facemill_nc_program::dialect::Decimals;
use facemill_nc_program::read::Compensation;
use facemill_nc_program::{Dialect, MappedAxis, ReadProgram, WordMap, WorkOffset, read_program};
use facemill_surface_model::TriMesh;
use facemill_tool_model::ToolAssembly;
use facemill_virtual_machine::{
    LinkDistances, LinkStage, ObstacleKind, ProgramLink, VerifySettings, VirtualObstacle, VirtualSetup,
    links_off_first_stock, verify,
};
use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use crate::links::choose::{Choice, Chooser};
use crate::links::clock::LinkClock;
use crate::links::link_path_laws::machine;
use crate::links::link_paths::{LinkEnds, RetractStrategy};
use crate::links::spindle_of;
use crate::links::words::LinkWords;

/// A slim mill of 20 mm.
fn tool() -> ToolAssembly {
    let file = r#"{
        "format": "facemill-tool/1", "name": "mill 20 r2", "number": 7, "radius_mm": 10, "corner_radius_mm": 2,
        "n_inserts": 2, "flute_length_mm": 20, "max_ramp_angle_deg": 90, "dead_core_radius_mm": 0, "spindle_rotation": "clockwise",
        "stick_out_mm": 120, "gauge_length_mm": 200,
        "body": { "clearance_mm": 1, "sections": [
            { "length_mm": 100, "diameter_low_mm": 18, "diameter_high_mm": 18 } ] },
        "holder": { "clearance_mm": 1, "sections": [
            { "length_mm": 80, "diameter_low_mm": 40, "diameter_high_mm": 40 } ] }
    }"#;
    ToolAssembly::from_json(file.as_bytes()).unwrap()
}

/// Tip and tool axis, workpiece frame.
type TipAndAxis = ([f64; 3], [f64; 3]);

const UP: [f64; 3] = [0.0, 0.0, 1.0];

/// A box, with its frame at a place and z along the tool there.
fn wall((tip, axis): TipAndAxis, low: [f64; 3], high: [f64; 3]) -> MeshTree {
    let (corners, triangles) = facemill_test_kit::box_mesh(low, high);
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &Vector3::from(axis)).unwrap();
    let work_from_wall = Isometry3::from_parts(Vector3::from(tip).into(), turn);
    let vertices = corners.iter().map(|p| work_from_wall * p).collect();
    MeshTree::new(&TriMesh::new(vertices, triangles).unwrap())
}

/// Four walls around the tool's axis, this far from it and this high above the tip.
fn pit(place: TipAndAxis, half: f64, height: f64) -> Vec<MeshTree> {
    let (outer, low) = (half + 8.0, -20.0);
    vec![
        wall(place, [half, -outer, low], [outer, outer, height]),
        wall(place, [-outer, -outer, low], [-half, outer, height]),
        wall(place, [-half, half, low], [half, outer, height]),
        wall(place, [-half, -outer, low], [half, -half, height]),
    ]
}

/// A link between two cuts, its obstacles, and its kind.
struct Scene {
    machine: &'static str,
    ends: [TipAndAxis; 2],
    /// Distance by which the tip is moved out at both ends in the original program.
    old: [[f64; 3]; 2],
    walls: Vec<MeshTree>,
    surface: ClearanceSurface,
}

/// A scene on its machine.
struct Shop {
    machine: Machine,
    tool: ToolAssembly,
    words: WordMap,
    table_from_work: Isometry3<f64>,
}

/// Clearance from obstacles, mm.
const CLEARANCE: f64 = 1.0;

const REGISTER: Compensation = Compensation::Length(7);

impl Shop {
    /// The workpiece's origin is the tip with all linear axes in the middle of their ranges.
    fn new(name: &str) -> Self {
        let (machine, tool) = (machine(name), tool());
        let middle = AxisValues::from_fn(machine.axes().len(), |k| {
            let axis = &machine.axes()[k];
            if axis.kind == AxisKind::Linear { 0.5 * (axis.min + axis.max) } else { 0.0 }
        });
        let tip = machine.cl_point(&middle, tool.gauge_length()).tip;
        let travel = machine.length_compensation_travel().unwrap();
        let axis = |(k, a): (usize, &facemill_inverse_kinematics::Axis)| MappedAxis {
            letter: a.letter.as_str().parse().unwrap(),
            offset: 0.0,
            along_spindle: travel[k],
        };
        let axes = machine.axes().iter().enumerate().map(axis).collect();
        Self {
            words: WordMap::new(axes, WorkOffset::default(), tool.gauge_length()).unwrap(),
            table_from_work: Isometry3::translation(tip.x, tip.y, tip.z),
            machine,
            tool,
        }
    }

    fn setup<'a>(&'a self, scene: &'a Scene) -> VirtualSetup<'a> {
        let obstacle = |mesh: &'a MeshTree| VirtualObstacle {
            name: "wall".into(),
            mesh,
            kind: ObstacleKind::Fixture,
            allowance: 0.0,
            stock: 0.0,
        };
        VirtualSetup {
            machine: &self.machine,
            table_from_work: self.table_from_work,
            words: &self.words,
            table_from_rtcp_words: Some(self.table_from_work),
            tool: &self.tool,
            length_register: self.tool.number(),
            obstacles: scene.walls.iter().map(obstacle).collect(),
        }
    }

    fn axes_at(&self, (tip, axis): TipAndAxis, near: Option<&AxisValues>) -> AxisValues {
        let cl = ClPoint { tip: Point3::from(tip), axis: Unit::new_normalize(Vector3::from(axis)) };
        let cl = cl.transformed(&self.table_from_work);
        let length = self.tool.gauge_length();
        self.machine.nearest_inverse(&cl, length, near, BranchPreference::Positive).unwrap()
    }

    fn words(&self) -> LinkWords<'_> {
        LinkWords {
            machine: &self.machine,
            tool_length: self.tool.gauge_length(),
            words: &self.words,
            table_from_rtcp_words: Some(self.table_from_work),
            decimals: Decimals { linear: 4, rotary: 4, feed: 1, inverse_time: 4 },
        }
    }

    fn line(&self, code: &str, axes: &AxisValues) -> String {
        let (words, _) = self.words().rounded(REGISTER, axes).unwrap();
        words.iter().fold(code.to_owned(), |mut line, w| {
            write!(line, " {}{:.4}", w.letter, w.value).unwrap();
            line
        })
    }

    /// A cut to the start of the link, these rapids, and a cut from its end on.
    fn program(&self, scene: &Scene, link: &[AxisValues]) -> ReadProgram {
        let [start, end] = self.link_ends(scene);
        let moved = |at: &AxisValues, k: usize| {
            let cl = self.machine.cl_point(at, self.tool.gauge_length());
            let tip = cl.tip + Vector3::from(scene.old[k]);
            self.machine.with_tip_at(at, &tip, self.tool.gauge_length()).unwrap()
        };
        let mut text = String::from("%\nO1\nG21 G90 G94 G49\nT7 M6\nS2000 M3\n");
        text += &format!("{} H7\n", self.line("G0 G43", &moved(&start, 0)));
        text += &format!("{} F2000.\n", self.line("G1", &start));
        link.iter().for_each(|q| text += &format!("{}\n", self.line("G0", q)));
        text += &format!("{} F2000.\n", self.line("G1", &moved(&end, 1)));
        text += &format!("{}\nM30\n%\n", self.line("G0", &moved(&end, 1)));
        read_program(&text, Dialect::Fanuc).unwrap_or_else(|e| panic!("{e}\n{text}"))
    }

    fn link_ends(&self, scene: &Scene) -> [AxisValues; 2] {
        let start = self.axes_at(scene.ends[0], None);
        [start, self.axes_at(scene.ends[1], Some(&start))]
    }

    /// Out at the start, across, and in at the end.
    fn old_way(&self, scene: &Scene) -> Vec<AxisValues> {
        let [start, end] = self.link_ends(scene);
        let out = |at: &AxisValues, k: usize| {
            let tip = self.machine.cl_point(at, self.tool.gauge_length()).tip + Vector3::from(scene.old[k]);
            self.machine.with_tip_at(at, &tip, self.tool.gauge_length()).unwrap()
        };
        vec![out(&start, 0), out(&end, 1), end]
    }
}

/// Result for a scene's link.
struct Looked {
    choice: Choice,
    /// The fastest free way of each kind on a ladder of distances, s; infinite where none is free.
    each: Vec<(RetractStrategy, f64)>,
}

/// Distances out that are tried, mm.
fn ladder(kind: RetractStrategy) -> Vec<f64> {
    // Distance 0 is the direct way, whatever its kind.
    let out = (1..=10).map(|k| 20.0 * f64::from(k)).chain([260.0, 320.0, 400.0, 600.0, 800.0, 1000.0]);
    if kind == RetractStrategy::Direct { vec![0.0] } else { out.collect() }
}

fn look(shop: &Shop, scene: &Scene, link: &ProgramLink, stage: &LinkStage<'_, '_>) -> Looked {
    let (length, words) = (shop.tool.gauge_length(), shop.words());
    let ends = LinkEnds {
        machine: &shop.machine,
        tool_length: length,
        table_from_work: shop.table_from_work,
        surface: &scene.surface,
        start: link.start,
        end: link.ends[link.ends.len() - 1],
        spindle: spindle_of(&shop.machine),
    };
    let views = [(&shop.machine, length)];
    let clock = LinkClock::new(&views);
    let rounded = |axes: &AxisValues| words.rounded(REGISTER, axes).map(|(_, rounded)| rounded);
    let choice = Chooser { heads: std::slice::from_ref(&ends), clock: &clock, law: link.law, rounded: &rounded }
        .choose(link, stage)
        .unwrap();
    let best = |kind: RetractStrategy| {
        let ways = ladder(kind).into_iter().filter_map(|out| ends.path(kind, out));
        let free = ways.filter(|way| stage.is_free(link, way));
        free.map(|way| clock.time(link.law, &link.start, &way).unwrap()).fold(f64::INFINITY, f64::min)
    };
    Looked { choice, each: RetractStrategy::TRIED.iter().map(|&kind| (kind, best(kind))).collect() }
}

/// Least lead of the fastest kind, s.
const MARGIN: f64 = 0.1;

/// Largest lag of the choice behind the ladder's best, s: its own ladder has other steps.
const STEPS: f64 = 0.02;

/// This kind's fastest free way is the fastest of all by far, and it is chosen: faster than the
/// link was, and run without a finding.
fn assert_taken(scene: &Scene, wanted: RetractStrategy) {
    let shop = Shop::new(scene.machine);
    let setup = shop.setup(scene);
    let settings = VerifySettings::default();
    let old = shop.program(scene, &shop.old_way(scene));
    let look =
        |link: &ProgramLink, stage: &LinkStage<'_, '_>| link.hold.is_none().then(|| look(&shop, scene, link, stage));
    let keep = LinkDistances { fixtures: CLEARANCE, first_stock: 0.0 };
    let found = links_off_first_stock(&old, &[&setup], (&settings, keep), &look, &Silent).unwrap();
    let [Looked { choice, each }] = &found.into_iter().flatten().collect::<Vec<_>>()[..] else { panic!("one link") };
    let best = each.iter().find(|(kind, _)| *kind == wanted).unwrap().1;
    let others = each.iter().filter(|(kind, _)| *kind != wanted);
    assert!(others.map(|o| o.1).fold(f64::INFINITY, f64::min) > best + MARGIN, "{wanted}: {each:?}");
    let taken = choice.better.as_ref().unwrap_or_else(|| panic!("{wanted} is not found"));
    assert_eq!(taken.kind, wanted, "{each:?}");
    assert!(taken.time < choice.before - MARGIN && taken.time < best + STEPS, "{wanted}: {taken:?} {best}");
    assert!(taken.time > choice.lower_bound - 1e-9, "{taken:?} {}", choice.lower_bound);
    let new = shop.program(scene, &taken.through);
    for (program, which) in [(&old, "old"), (&new, "new")] {
        let findings = verify(program, &setup, &settings, &Silent).unwrap().findings;
        assert!(findings.is_empty(), "{wanted}, {which}: {findings:#?}");
    }
}

/// A place turned about z, deg.
fn about_z((tip, axis): TipAndAxis, deg: f64) -> TipAndAxis {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), deg.to_radians());
    let turned = |v: [f64; 3]| <[f64; 3]>::from(turn * Vector3::from(v));
    (turned(tip), turned(axis))
}

/// The tool leaning to +x by this angle, deg.
fn leaning(tip: [f64; 3], deg: f64) -> TipAndAxis {
    let (sin, cos) = deg.to_radians().sin_cos();
    (tip, [sin, 0.0, cos])
}

fn flat() -> ClearanceSurface {
    ClearanceSurface::Plane { origin: Point3::new(0.0, 0.0, 100.0), normal: Vector3::z_axis() }
}

const HEAD_HEAD: &str = "head-head-c-a";

const HEAD_TABLE: &str = "head-b-table-c";

const TABLE_TABLE: &str = "table-table-a-c";

/// Two places 300 mm apart, upright.
const SIDE_BY_SIDE: [TipAndAxis; 2] = [([-150.0, 0.0, 0.0], UP), ([150.0, 40.0, 0.0], UP)];

/// Links between two places side by side, upright, with these walls.
fn upright(machine: &'static str, walls: Vec<MeshTree>) -> Scene {
    let high = [0.0, 0.0, 250.0];
    Scene { machine, ends: SIDE_BY_SIDE, old: [high, high], walls, surface: flat() }
}

#[test]
fn with_nothing_in_the_way_a_link_is_direct() {
    for machine in [HEAD_HEAD, HEAD_TABLE, TABLE_TABLE] {
        assert_taken(&upright(machine, Vec::new()), RetractStrategy::Direct);
    }
}

#[test]
fn out_of_a_pit_a_link_is_lifted_first_and_into_one_last() {
    let [a, b] = SIDE_BY_SIDE;
    assert_taken(&upright(HEAD_HEAD, pit(a, 12.5, 60.0)), RetractStrategy::LiftedFirst);
    assert_taken(&upright(TABLE_TABLE, pit(b, 12.5, 60.0)), RetractStrategy::LiftedLast);
}

#[test]
fn over_a_thin_wall_half_way_a_link_has_a_peak() {
    let between = || vec![wall(([0.0; 3], UP), [-5.0, -200.0, -60.0], [5.0, 200.0, 60.0])];
    for machine in [HEAD_TABLE, TABLE_TABLE] {
        assert_taken(&upright(machine, between()), RetractStrategy::Peak);
    }
}

/// From a pit into a slot in which the tool leans; there is a wall behind the head, so it cannot
/// back out along the tool.
#[test]
fn between_two_pits_a_link_is_lifted_where_the_head_cannot_go_back() {
    let ends = [leaning([-150.0, 0.0, 0.0], 0.0), leaning([150.0, 0.0, 0.0], 40.0)];
    let slot = (ends[1].0, UP);
    let mut walls = pit(ends[0], 12.5, 100.0);
    walls.push(wall(slot, [-40.0, 12.5, -20.0], [60.0, 20.0, 60.0]));
    walls.push(wall(slot, [-40.0, -20.0, -20.0], [60.0, -12.5, 60.0]));
    walls.push(wall(slot, [-50.0, -20.0, -20.0], [-40.0, 20.0, 100.0]));
    walls.push(wall(slot, [770.0, -20.0, 500.0], [780.0, 20.0, 1000.0]));
    let surface = ClearanceSurface::Sphere { center: Point3::new(0.0, 0.0, -300.0), radius: 400.0 };
    let high = [0.0, 0.0, 300.0];
    assert_taken(&Scene { machine: HEAD_TABLE, ends, old: [high, high], walls, surface }, RetractStrategy::Lifted);
}

/// A large table turns by 90 degrees under a row of posts, which takes longer than the lift.
#[test]
fn over_posts_on_a_slow_table_a_lifted_link_turns_all_along() {
    let a = leaning([1000.0, 0.0, 0.0], 3.0);
    let post = |deg: f64| wall((about_z(a, deg).0, UP), [-5.0, -5.0, -20.0], [5.0, 5.0, 250.0]);
    let walls = [16.0, 30.0, 60.0, 74.0].map(post).into();
    let high = [0.0, 0.0, 500.0];
    let ends = [a, about_z(a, 90.0)];
    let scene = Scene { machine: HEAD_TABLE, ends, old: [high, high], walls, surface: flat() };
    assert_taken(&scene, RetractStrategy::LiftedSpread);
}

/// Pits that are as wide as the tool, and lean away from each other.
#[test]
fn out_of_leaning_pits_a_link_goes_along_the_tool() {
    let ends = [leaning([-150.0, 0.0, 0.0], -45.0), leaning([150.0, 40.0, 0.0], 45.0)];
    let old = ends.map(|(_, axis)| axis.map(|v| 280.0 * v));
    for machine in [HEAD_HEAD, HEAD_TABLE] {
        let walls = ends.into_iter().flat_map(|end| pit(end, 12.5, 60.0)).collect();
        assert_taken(&Scene { machine, ends, old, walls, surface: flat() }, RetractStrategy::AlongTool);
    }
}

/// Pockets of a pattern about a slow table, wide enough for the table to turn a little while the
/// tool leaves them, and a post between them that the tool has to clear.
#[test]
fn out_of_wide_leaning_pits_on_a_slow_table_a_link_along_the_tool_turns_all_along() {
    let a = leaning([100.0, 0.0, 0.0], 40.0);
    let ends = [a, about_z(a, 90.0)];
    let mut walls: Vec<MeshTree> = ends.into_iter().flat_map(|end| pit(end, 20.0, 40.0)).collect();
    let between = about_z(([160.0, 0.0, 0.0], UP), 45.0);
    walls.push(wall(between, [-50.0, -50.0, -20.0], [50.0, 50.0, 130.0]));
    let old = ends.map(|(_, axis)| axis.map(|v| 400.0 * v));
    let scene = Scene { machine: HEAD_TABLE, ends, old, walls, surface: flat() };
    assert_taken(&scene, RetractStrategy::AlongToolSpread);
}

/// A column higher than the machine lifts, beside its home, and the tool level on both sides of it.
#[test]
fn from_one_side_of_a_column_to_the_other_a_link_goes_around() {
    let middle = [-900.0, 0.0, 0.0];
    let beside = |deg: f64| {
        let (tip, axis) = about_z(([300.0, 0.0, 0.0], [1.0, 0.0, 0.0]), deg);
        ([middle[0] + tip[0], tip[1], tip[2]], axis)
    };
    let column = wall((middle, UP), [-200.0, -200.0, -300.0], [200.0, 200.0, 700.0]);
    let surface = ClearanceSurface::Cylinder { origin: Point3::from(middle), axis: Vector3::z_axis(), radius: 290.0 };
    let aside = [900.0, 0.0, 0.0];
    let ends = [beside(-80.0), beside(80.0)];
    let scene = Scene { machine: HEAD_HEAD, ends, old: [aside, aside], walls: vec![column], surface };
    assert_taken(&scene, RetractStrategy::Around);
}
