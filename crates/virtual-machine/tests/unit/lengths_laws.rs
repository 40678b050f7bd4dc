//! Shortest lengths against closed forms, a slow oracle that samples obstacles and bodies, and the
//! ordinary run of the program as it is posted again.

use facemill_cl_data::Silent;
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::{AxisKind, Machine};
use facemill_nc_program::{Dialect, read_program};
use facemill_test_kit::Random;
use facemill_tool_model::{AssemblyLength, Lengths, OpenAssembly, Section, ToolAssembly};
use facemill_z_map::DexelMap;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::finding::{FindingKind, Verification};
use crate::kit;
use crate::kit::{HEAD, Shop, Text, box_mesh};
use crate::lengths::{ClearLengths, LengthSettings, LengthStock, clear_lengths, words_of_length};
use crate::motion::setup::{ObstacleKind, VerifySettings, VirtualObstacle, VirtualSetup};
use crate::run::verify::verify;
use crate::stock::run::run_stock;

const MARGIN: f64 = 0.5;

/// Largest error of a length, mm.
const OFF: f64 = 0.05;

/// Radius and clearance of the cutter body, and of both sections of the holder.
const BODY: (f64, f64) = (15.0, 1.0);

const LOWER: (f64, f64) = (30.0, 2.0);

const UPPER: (f64, f64) = (50.0, 2.0);

/// Own length of the upper section, mm.
const UPPER_LENGTH: f64 = 58.0;

/// Part of a clearance that a program may use up, mm.
const SLACK: f64 = 0.1;

fn tool() -> ToolAssembly {
    let mut file = kit::tool().to_file();
    let cylinder = |length_mm: f64, radius: f64| Section {
        length_mm,
        diameter_low_mm: 2.0 * radius,
        diameter_high_mm: 2.0 * radius,
    };
    file.body.sections = vec![cylinder(48.0, BODY.0)];
    file.holder.sections = vec![cylinder(40.0, LOWER.0), cylinder(UPPER_LENGTH, UPPER.0)];
    file.gauge_length_mm = 60.0 + 40.0 + UPPER_LENGTH;
    ToolAssembly::new(file).unwrap()
}

fn with_tool(tool: ToolAssembly, has_head: bool) -> Shop {
    let mut machine = Machine::head_b_table_c().unwrap().to_file();
    if !has_head {
        machine.tool_chains[0].rows.iter_mut().for_each(|row| row.bodies.clear());
    }
    let shop = Shop::with_machine(Machine::from_file(machine).unwrap());
    Shop { words: words_of_length(&shop.words, tool.gauge_length()).unwrap(), tool, ..shop }
}

type Boxes = Vec<[[f64; 3]; 2]>;

/// A setup with boxes as its fixtures and nothing else.
struct RunScene {
    shop: Shop,
    has_head: bool,
    boxes: Boxes,
    meshes: Vec<MeshTree>,
}

impl RunScene {
    fn new(boxes: Boxes) -> Self {
        let meshes = boxes.iter().map(|[low, high]| MeshTree::new(&box_mesh(*low, *high))).collect();
        Self { shop: with_tool(tool(), true), has_head: true, boxes, meshes }
    }

    /// On a machine whose head has no bodies.
    fn without_head(boxes: Boxes) -> Self {
        Self { shop: with_tool(tool(), false), has_head: false, ..Self::new(boxes) }
    }

    fn setup<'a>(&'a self, shop: &'a Shop) -> VirtualSetup<'a> {
        let fixture = |(k, mesh): (usize, &'a MeshTree)| VirtualObstacle {
            name: format!("box {k}"),
            mesh,
            kind: ObstacleKind::Fixture,
            allowance: 0.0,
            stock: 0.0,
        };
        VirtualSetup { obstacles: self.meshes.iter().enumerate().map(fixture).collect(), ..shop.setup() }
    }

    fn lengths(&self, way: &dyn Fn(&Shop) -> String) -> ClearLengths {
        let program = read_program(way(&self.shop), Dialect::Fanuc).unwrap();
        let assembly = OpenAssembly::open(&self.shop.tool);
        let setup = self.setup(&self.shop);
        clear_lengths(&program, &setup, &assembly, None, &settings(), &Silent).unwrap_or_else(|e| panic!("{e}"))
    }

    /// The way written for a tool with these lengths by the kit, and run.
    fn run(&self, lengths: Lengths, way: &dyn Fn(&Shop) -> String) -> Verification {
        let shop = with_tool(OpenAssembly::open(&self.shop.tool).built(&lengths).unwrap().tool, self.has_head);
        let program = read_program(way(&shop), Dialect::Fanuc).unwrap();
        verify(&program, &self.setup(&shop), &VerifySettings::default(), &Silent).unwrap()
    }

    /// As returned, nothing but the cutter meets anything; each forced one shorter by the margin
    /// and what it may be off by, alone, is a collision on the block that forces it.
    fn holds(&self, found: &ClearLengths, way: &dyn Fn(&Shop) -> String) {
        let collisions = |lengths: Lengths| -> Vec<_> {
            let v = self.run(lengths, way);
            let of_body =
                |f: &crate::finding::Finding| matches!(f.kind, FindingKind::HolderCollision | FindingKind::Collision);
            v.findings.into_iter().filter(of_body).collect()
        };
        assert_eq!(collisions(found.lengths), []);
        for (k, forced) in found.forced_by.iter().enumerate() {
            let Some(forced) = forced else { continue };
            let mut shorter = found.lengths;
            shorter[k] -= MARGIN + OFF;
            if !is_tool(&shorter) {
                continue;
            }
            let met = collisions(shorter);
            let is_there = |f: &crate::finding::Finding| (f.first_line..=f.last_line).contains(&forced.line);
            assert!(met.iter().any(is_there), "L{} {forced:?}: {met:?}", k + 1);
        }
    }
}

/// Whether each length leaves those above it where they are.
fn is_tool(lengths: &Lengths) -> bool {
    let mut rested = *lengths;
    OpenAssembly::open(&tool()).rest(&mut rested);
    rested == *lengths
}

fn settings() -> LengthSettings {
    LengthSettings { verify: VerifySettings::default(), margin: MARGIN, longest: 600.0 }
}

/// Along y at this distance from x = 150, so high above the origin.
fn along(distance: f64, z: f64) -> impl Fn(&Shop) -> String {
    move |shop| {
        let x = 150.0 - distance;
        Text::new(shop).rapid([x, -80.0, 400.0]).rapid([x, -80.0, z]).cut([x, 80.0, z]).rapid([x, 80.0, 400.0]).text
    }
}

/// Height at which a cylinder with a clearance passes over an edge of this height at this distance
/// from its axis.
fn passes(edge: f64, distance: f64, (radius, clearance): (f64, f64)) -> f64 {
    let (kept, beside) = (clearance - SLACK, (distance - radius).max(0.0));
    edge + (kept * kept - beside * beside).max(0.0).sqrt()
}

#[test]
fn walls_beside_the_tool_ask_what_their_heights_and_distances_tell() {
    let wall = |x: f64, top: f64| [[x, -200.0, 0.0], [x + 8.0, 200.0, top]];
    for (distance, z) in [(26.0, 10.0), (30.9, 10.0), (31.5, 4.0)] {
        // A low wall that the lower section has to pass over, and a high one that only the upper
        // one reaches.
        let scene = RunScene::new(vec![wall(150.0, 60.0), wall(150.0 - distance + 45.0, 95.0)]);
        let way = along(distance, z);
        let found = scene.lengths(&way);
        let [_, l2, l3, l4] = found.least;
        assert!((l2 - passes(60.0 - z, distance, LOWER)).abs() < 0.01, "{:?}", found.least);
        assert!((l3 - passes(95.0 - z, 45.0, UPPER)).abs() < 0.01, "{:?}", found.least);
        assert_eq!([found.lengths[1] - l2, found.lengths[2] - l3], [MARGIN; 2]);
        // The flute has a corner, and the head is far above.
        assert!(found.forced_by[0].is_none() && found.lengths[0] == 4.0);
        assert!(found.forced_by[3].is_none() && l4 == found.lengths[2] + UPPER_LENGTH);
        let forced = found.forced_by[1].as_ref().unwrap();
        assert_eq!((forced.body.as_str(), forced.obstacle.as_str()), ("holder section 1", "box 0"));
        assert!((HEAD + 2..=HEAD + 4).contains(&forced.line) && forced.place_work_mm[2] == 60.0, "{forced:?}");
        assert!((forced.tip_work_mm[0] - (150.0 - distance)).abs() < 1e-3);
        assert_eq!(forced.block_text, way(&scene.shop).lines().nth(forced.line as usize - 1).unwrap());
        scene.holds(&found, &way);
    }
}

/// A leaning tool: the wall's top edge in the frame of the tool. The head turns, so that words are
/// others for other lengths.
#[test]
fn a_leaning_tool_is_tested_along_its_axis() {
    let scene = RunScene::new(vec![[[150.0, -200.0, 0.0], [158.0, 200.0, 60.0]]]);
    let lean = 0.3_f64;
    let (axis, tip) = ([lean.sin(), 0.0, lean.cos()], [100.0, 0.0, 5.0]);
    let way = |shop: &Shop| {
        let start =
            Text::new(shop).rapid_tilted([-100.0, -80.0, 400.0], axis).rapid_tilted([tip[0], -80.0, tip[2]], axis);
        start.cut_tilted([tip[0], 80.0, tip[2]], axis).rapid_tilted([-100.0, 80.0, 400.0], axis).text
    };
    let found = scene.lengths(&way);
    // Both top edges seen along y, from the axis and along it.
    let seen = [150.0, 158.0].map(|x| {
        let p = [x - tip[0], 60.0 - tip[2]];
        (p[0] * axis[2] - p[1] * axis[0], p[0] * axis[0] + p[1] * axis[2])
    });
    let needs = |of: (f64, f64)| {
        let reached = seen.iter().filter(|(beside, _)| beside.abs() < of.0 + of.1 - SLACK);
        reached.map(|(beside, along)| passes(*along, beside.abs(), of)).fold(0.0, f64::max)
    };
    for (k, of) in [(0, BODY), (1, LOWER)] {
        let rests_on = if k == 0 { kit::CORNER } else { found.lengths[k - 1] };
        let expected = needs(of).max(rests_on);
        assert!((found.least[k] - expected).abs() < 0.01, "L{}: {} for {expected}", k + 1, found.least[k]);
    }
    assert!(found.forced_by.iter().any(Option::is_some));
    scene.holds(&found, &way);
}

/// Between a wall, which it has to pass over, and a shelf the upper section has no place: it goes
/// above the shelf.
#[test]
fn what_hangs_over_the_tool_is_passed_whole() {
    let wall = [[136.0, -200.0, 0.0], [142.0, 200.0, 55.0]];
    let shelf = [[145.0, -200.0, 100.0], [190.0, 200.0, 110.0]];
    // In from the side, below the shelf.
    let way = |shop: &Shop| {
        let (low, high) = ([100.0, -80.0, 10.0], [100.0, 80.0, 10.0]);
        let begun = Text::new(shop).rapid([0.0, -80.0, 400.0]).rapid([0.0, -80.0, 10.0]).cut(low).cut(high);
        begun.cut([0.0, 80.0, 10.0]).rapid([0.0, 80.0, 400.0]).text
    };
    // Alone the wall asks for 46.9, and the shelf leaves room below it.
    let low = RunScene::without_head(vec![wall]).lengths(&way);
    assert!((low.least[2] - passes(45.0, 36.0, UPPER)).abs() < 0.01, "{:?}", low.least);
    let room = RunScene::without_head(vec![shelf]).lengths(&way);
    assert!(room.forced_by[2].is_none(), "{:?}", room.forced_by);
    let scene = RunScene::without_head(vec![wall, shelf]);
    let both = scene.lengths(&way);
    assert!((both.least[2] - passes(100.0, 45.0, UPPER)).abs() < 0.01, "{:?}", both.least);
    assert_eq!(both.forced_by[2].as_ref().unwrap().obstacle, "box 1");
    scene.holds(&both, &way);
    // Over the axis itself no length is free.
    let roof = RunScene::new(vec![[[90.0, -10.0, 300.0], [110.0, 10.0, 5000.0]]]).lengths(&way);
    let (length, at) = roof.hopeless.unwrap();
    assert!(matches!(length, AssemblyLength::LowerHolder | AssemblyLength::Gauge | AssemblyLength::StickOut), "{at:?}");
    assert_eq!(at.obstacle, "box 0");
}

/// The preset's spindle nose, of radius 90, begins at the gauge line and keeps 5 mm; its head is
/// 250 mm above it and keeps 10.
#[test]
fn bodies_of_the_machine_ask_for_the_spindle_face() {
    for (x, body, expected) in [(160.0, "spindle nose", 410.0 + 5.0), (200.0, "head", 410.0 + 10.0 - 250.0)] {
        let scene = RunScene::new(vec![[[x, 50.0, 0.0], [x + 8.0, 200.0, 420.0]]]);
        let way = along(50.0, 10.0);
        let found = scene.lengths(&way);
        assert!((found.least[3] - (expected - SLACK)).abs() < 0.02, "{:?} for {expected}", found.least);
        let forced = found.forced_by[3].as_ref().unwrap();
        assert_eq!((forced.body.as_str(), forced.obstacle.as_str()), (body, "box 0"));
        scene.holds(&found, &way);
    }
}

/// Points on the faces of a box, so far apart.
fn points(low: [f64; 3], high: [f64; 3], apart: f64) -> Vec<Point3<f64>> {
    let n = [0, 1, 2].map(|k| ((high[k] - low[k]) / apart).ceil() as usize);
    let at = |k: usize, i: usize| low[k] + (high[k] - low[k]) * i as f64 / n[k] as f64;
    let mut out = Vec::new();
    for x in 0..=n[0] {
        for y in 0..=n[1] {
            let is_side = x == 0 || x == n[0] || y == 0 || y == n[1];
            let step = if is_side { 1 } else { n[2] };
            out.extend((0..=n[2]).step_by(step).map(|z| Point3::new(at(0, x), at(1, y), at(2, z))));
        }
    }
    out
}

/// How much nearer than the nearest sample a body may be, mm: s²/(2·c) of samples s = 0.35 mm from
/// it on faces, and 0.28 mm along the way, at the clearance c = 1.9 mm.
const BETWEEN: f64 = 0.055;

/// Whether cylinders from L1, L2 and L3 upward keep their clearances, and so much more, from all
/// points, at places of the tool.
fn is_free(lengths: &Lengths, more: f64, places: &[(Point3<f64>, Vector3<f64>)], points: &[Point3<f64>]) -> bool {
    let cylinders = [(lengths[0], lengths[1], BODY), (lengths[1], lengths[2], LOWER), (lengths[2], lengths[3], UPPER)];
    places.iter().all(|(tip, axis)| {
        points.iter().all(|p| {
            let along = (p - tip).dot(axis);
            let beside = (p - tip - axis * along).norm();
            cylinders.iter().filter(|(low, high, _)| high - low > 1e-9).all(|(low, high, (radius, clearance))| {
                let (out, up) = ((beside - radius).max(0.0), (low - along).max(along - high).max(0.0));
                out.hypot(up) >= clearance - SLACK + more
            })
        })
    })
}

#[test]
fn random_boxes_are_cleared_by_an_oracle_that_samples_and_by_no_shorter_length() {
    let mut rng = Random(41);
    let mut n_forced = [0; 4];
    for _ in 0..24 {
        let boxes: Boxes = (0..3)
            .map(|_| {
                let (x, y, side) = (rng.between(20.0, 90.0), rng.between(-40.0, 40.0), rng.between(4.0, 12.0));
                [[x, y, 0.0], [x + side, y + side, rng.between(15.0, 110.0)]]
            })
            .collect();
        let lean = rng.between(-0.35, 0.35);
        let axis = Vector3::new(lean.sin(), 0.0, lean.cos());
        let (from, to) = ([rng.between(-30.0, 0.0), -30.0, 3.0], [rng.between(-30.0, 0.0), 30.0, 3.0]);
        let scene = RunScene::new(boxes);
        let above = |p: [f64; 3]| (Point3::from(p) + axis * 300.0).coords.into();
        let way = |shop: &Shop| {
            let begun = Text::new(shop).rapid_tilted(above(from), axis.into()).rapid_tilted(from, axis.into());
            begun.cut_tilted(to, axis.into()).rapid_tilted(above(to), axis.into()).text
        };
        let found = scene.lengths(&way);
        if found.hopeless.is_some() {
            continue;
        }
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let again = one.install(|| scene.lengths(&way));
        assert_eq!((again.lengths, again.forced_by), (found.lengths, found.forced_by.clone()), "on one thread");
        let lerp = |a: [f64; 3], b: [f64; 3], t: f64| Point3::from(a) + (Point3::from(b) - Point3::from(a)) * t;
        let cut = (0..=110).map(|k| (lerp(from, to, f64::from(k) / 110.0), axis));
        let places: Vec<_> = cut.collect();
        let points: Vec<_> = scene.boxes.iter().flat_map(|[low, high]| points(*low, *high, 0.5)).collect();
        assert!(is_free(&found.lengths, 0.0, &places, &points), "{:?}", found.lengths);
        for k in 0..3 {
            if found.forced_by[k].is_none() {
                continue;
            }
            let mut shorter = found.lengths;
            shorter[k] = found.least[k] - OFF;
            // With a way down along the axis all that is met is met at its end.
            assert!(
                !is_free(&shorter, BETWEEN, &places, &points),
                "L{} {:?} {:?}",
                k + 1,
                found.least,
                found.forced_by[k]
            );
            n_forced[k] += 1;
        }
        scene.holds(&found, &way);
    }
    assert!(n_forced[0] > 0 && n_forced[1] > 2 && n_forced[2] > 2, "{n_forced:?}");
}

/// Through the middle of a block, so high.
fn slot(z: f64) -> impl Fn(&Shop) -> String {
    move |shop| {
        let start = Text::new(shop).rapid([-70.0, 0.0, 400.0]).rapid([-70.0, 0.0, z]);
        start.cut([70.0, 0.0, z]).rapid([70.0, 0.0, 400.0]).text
    }
}

/// The flute is as long as the slot is deep, and the holder passes over what is left beside it.
#[test]
fn the_stock_that_is_left_asks_for_flute_and_stick_out() {
    const TOLERANCE: f64 = 0.01;
    let block = || DexelMap::of_box(&Isometry3::identity(), [-40.0, -40.0, 0.0], [40.0, 40.0, 50.0], 1.0).unwrap();
    let scene = RunScene::new(Vec::new());
    let (way, depth) = (slot(20.0), 30.0);
    let program = read_program(way(&scene.shop), Dialect::Fanuc).unwrap();
    let (assembly, before) = (OpenAssembly::open(&scene.shop.tool), block());
    let stock = LengthStock { before: &before, tolerance: TOLERANCE };
    let setup = scene.setup(&scene.shop);
    let found = clear_lengths(&program, &setup, &assembly, Some(stock), &settings(), &Silent).unwrap();
    // A depth up to twice the tolerance is no collision. The lower section reaches 5 mm beyond the
    // slot's side, and keeps its clearance from its edge.
    assert!((found.least[0] - depth).abs() < 2.0 * TOLERANCE + 0.01, "{:?}", found.least);
    assert!((found.least[1] - (depth + LOWER.1 - SLACK)).abs() < 2.0 * TOLERANCE + 0.01, "{:?}", found.least);
    let forced = found.forced_by[0].as_ref().unwrap();
    assert_eq!((forced.obstacle.as_str(), forced.line), ("stock", HEAD + 3), "{forced:?}");
    let met = |lengths: Lengths| {
        let shop = with_tool(assembly.built(&lengths).unwrap().tool, true);
        let program = read_program(way(&shop), Dialect::Fanuc).unwrap();
        let settings = VerifySettings::default();
        let mut stock = block();
        let run = run_stock(&program, &scene.setup(&shop), &settings, &mut stock, TOLERANCE, &Silent).unwrap();
        stock.check_invariants().unwrap();
        run.findings
    };
    assert_eq!(met(found.lengths), []);
    for k in 0..4 {
        let mut shorter = found.lengths;
        shorter[k] -= MARGIN + OFF;
        if let Some(forced) = found.forced_by[k].as_ref().filter(|_| is_tool(&shorter)) {
            let findings = met(shorter);
            let is_there = |f: &crate::finding::Finding| (f.first_line..=f.last_line).contains(&forced.line);
            assert!(findings.iter().any(is_there), "L{}: {findings:?}", k + 1);
        }
    }
}

#[test]
fn a_posted_program_holds_the_tip_and_goes_home_as_before() {
    let scene = RunScene::new(Vec::new());
    let way = |shop: &Shop| {
        let begun = Text::new(shop).rapid([10.0, -80.0, 300.0]).rapid_tilted([10.0, -80.0, 40.0], [0.3, 0.1, 1.0]);
        begun.cut_tilted([60.0, 30.0, 20.0], [-0.2, 0.2, 1.0]).line("G91 G28 Z0.").text
    };
    let longer = with_tool(scene.shop.tool.longer_by(77.0).unwrap(), true);
    let program = read_program(way(&scene.shop), Dialect::Fanuc).unwrap();
    let posted = crate::lengths::posted_for_length(&program, &scene.setup(&scene.shop), &longer.words);
    let tip = |block: &facemill_nc_program::read::ReadBlock, shop: &Shop| {
        let joints = shop.words.joints_at(block.motion.as_ref()?, shop.machine.home().as_slice()).ok()?;
        let mut axes = shop.machine.home();
        joints.iter().enumerate().for_each(|(k, joint)| axes[k] = *joint);
        Some((shop.machine.cl_point(&axes, shop.tool.gauge_length()), axes))
    };
    let mut places = Vec::new();
    for (a, b) in program.blocks.iter().zip(&posted.blocks) {
        let (Some((before, q)), Some((after, p))) = (tip(a, &scene.shop), tip(b, &longer)) else { continue };
        places.push(p);
        let is_home = a.text.contains("G28");
        assert!(is_home || (before.tip - after.tip).norm() < 1e-6 && (before.axis.cross(&after.axis)).norm() < 1e-12);
        assert!((0..5).all(|k| scene.shop.machine.axes()[k].kind == AxisKind::Linear || p[k] == q[k]), "{p:?} {q:?}");
    }
    // The tip was moved, and home the spindle goes alone.
    let [.., last, home] = &places[..] else { panic!() };
    assert!(places.len() == 4 && last[0] == home[0] && last[1] == home[1] && last[2] != home[2]);
    let words = |k: usize, p: &facemill_nc_program::ReadProgram| p.motions().nth(k).unwrap().1.position.words();
    assert!(words(0, &program).iter().zip(words(0, &posted).iter()).all(|(a, b)| a == b), "it stands upright");
    let (before, after) = (words(2, &program), words(2, &posted));
    assert!(before.iter().zip(after.iter()).any(|(a, b)| (a.value - b.value).abs() > 5.0));
    let same = crate::lengths::posted_for_length(&program, &scene.setup(&scene.shop), &scene.shop.words);
    assert_eq!(same.blocks, program.blocks);
}
