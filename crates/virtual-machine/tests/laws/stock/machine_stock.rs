//! Bodies of the machine against the stock as it is when they come near it: what has been cut away
//! is not met, and all else is as it was against the stock before cutting.

use facemill_cl_data::Silent;
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::{BodyFile, CuttingLawFile, ShapeFile};
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_virtual_machine::verify;
use facemill_virtual_machine::{
    Certificates, Finding, FindingKind, HeadFindings, HeldAsCut, Measure, ObstacleKind, VerifySettings,
    VirtualObstacle, VirtualSetup, certify, outside_layer, remaining_collisions, unresolved_findings,
};
use facemill_z_map::DexelMap;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::kit::{CORNER, HEAD, RADIUS, Shop, Text, box_mesh, dual};

const TOLERANCE: f64 = 0.01;

/// Distance of the lines, mm.
const CELL: f64 = 2.0;

/// Clearance of the guard, and the part of it that may be used up, mm.
const CLEARANCE: f64 = 3.0;
const SLACK: f64 = 0.1;

/// Radius of the guard, and its lower side above the tip, mm.
const GUARD: f64 = 60.0;
const ABOVE: f64 = 20.0;

/// Half the width of a slot that the guard needs, mm.
pub(crate) const NEEDED: f64 = GUARD + CLEARANCE;

const LOW: [f64; 3] = [-10.0, -120.0, 0.0];
const HIGH: [f64; 3] = [10.0, 120.0, 40.0];

/// The preset with one more body about its spindle: of this shape, here from the gauge line.
fn shop_with(shape: ShapeFile, position_mm: [f64; 3], clearance_mm: f64) -> Shop {
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    let spindle = file.tool_chains[0].rows.last_mut().unwrap();
    let rotation_xyz_deg = [0.0; 3];
    spindle.bodies.push(BodyFile { name: "guard".to_owned(), shape, position_mm, rotation_xyz_deg, clearance_mm });
    Shop::with_machine(Machine::from_file(file).unwrap())
}

/// A disc about the tool, 10 mm high.
pub(crate) fn shop_with_guard() -> Shop {
    let length = Shop::new().tool.gauge_length();
    let disc = ShapeFile::Cylinder { radius_mm: GUARD, height_mm: 10.0 };
    shop_with(disc, [0.0, 0.0, ABOVE - length], CLEARANCE)
}

/// Stock as it is before cutting, as mesh and as lines that are outside of it.
pub(crate) struct Block {
    mesh: MeshTree,
    pub(crate) outside: DexelMap,
}

impl Block {
    fn new(low: [f64; 3], high: [f64; 3], cell: f64) -> Self {
        let around = outside_layer(cell);
        let [from, to] = [low.map(|c| c - around), high.map(|c| c + around)];
        let outside = DexelMap::of_box(&Isometry3::identity(), from, to, cell).unwrap();
        Self { mesh: MeshTree::new(&box_mesh(low, high)), outside }
    }

    pub(crate) fn on_the_plate() -> Self {
        Self::new(LOW, HIGH, CELL)
    }

    pub(crate) fn setup<'a>(&'a self, shop: &'a Shop) -> VirtualSetup<'a> {
        let mut setup = shop.setup();
        let (name, kind) = ("block".to_owned(), ObstacleKind::Stock);
        setup.obstacles[1] = VirtualObstacle { name, mesh: &self.mesh, kind, allowance: 0.0, stock: 0.0 };
        setup
    }
}

/// Depth of cuts, mm: what the flute does not reach by less than a smaller one and the layer around
/// the stock would stay.
const DEPTH: f64 = 9.0;

/// A slot along the block's top, of that depth and twice `half` wide, one block of the program for
/// each of its three passes.
pub(crate) fn slot(text: Text<'_>, half: f64) -> Text<'_> {
    let ys = [-(half - RADIUS), 0.0, half - RADIUS];
    ys.into_iter().fold(text, |text, y| pass(text, y, HIGH[2] - DEPTH))
}

/// Across the block at this height of the tip.
pub(crate) fn pass(text: Text<'_>, y: f64, z: f64) -> Text<'_> {
    let text = text.rapid([-120.0, y, 200.0]).rapid([-120.0, y, z]);
    text.cut([120.0, y, z]).rapid([120.0, y, 200.0])
}

/// Findings of the guard against the stock before cutting, and as it is.
pub(crate) struct Both {
    first: Vec<Finding>,
    pub(crate) now: Vec<Finding>,
}

pub(crate) fn both(text: &Text<'_>, setup: &VirtualSetup<'_>, settings: &VerifySettings, outside: &DexelMap) -> Both {
    let [both] = of_heads(&text.text, [setup], settings, outside);
    both
}

/// The same of each head.
fn of_heads<const N: usize>(
    text: &str,
    setups: [&VirtualSetup<'_>; N],
    settings: &VerifySettings,
    outside: &DexelMap,
) -> [Both; N] {
    let program = read_program(text, Dialect::Fanuc).unwrap();
    let cut = VerifySettings { as_cut: HeldAsCut::ALL, ..settings.clone() };
    let run = |setup, settings| verify(&program, setup, settings, &Silent).unwrap().findings;
    let first = setups.map(|setup| run(setup, settings));
    let then = setups.map(|setup| run(setup, &cut));
    let requested = |h: usize| unresolved_findings(setups[h], &first[h], &then[h]);
    let heads: [HeadFindings<'_>; N] = std::array::from_fn(|h| (setups[h], &cut, requested(h)));
    let mut lines = outside.clone();
    let left = remaining_collisions(&program, heads, &mut lines, TOLERANCE, &Silent).unwrap();
    lines.check_invariants().unwrap();
    let of_guard = |findings: &[Finding]| -> Vec<Finding> {
        findings.iter().filter(|f| f.body.as_deref() == Some("guard")).cloned().collect()
    };
    std::array::from_fn(|h| Both { first: of_guard(&first[h]), now: of_guard(&[&then[h][..], &left[h]].concat()) })
}

/// Positions far apart, between which bodies are followed: what is met is met all the same.
fn coarse() -> VerifySettings {
    VerifySettings { max_step: 4.0, max_turn: 0.05, between: 0.5, ..VerifySettings::default() }
}

/// First and last line of each collision.
fn collisions(findings: &[Finding]) -> Vec<(u32, u32)> {
    let collisions = findings.iter().filter(|f| f.kind == FindingKind::Collision);
    collisions.map(|f| (f.first_line - HEAD, f.last_line - HEAD)).collect()
}

fn distance(finding: &Finding) -> f64 {
    match finding.measure {
        Some(Measure::DistanceMm(d)) => d,
        _ => f64::NAN,
    }
}

/// Line of the pass below a slot, whose guard is in the slot; and of one that is before it.
pub(crate) const BEHIND: u32 = 15;
const BEFORE: u32 = 3;

/// The guard is 2 mm below the block's top in the pass at this height of the tip, and 7 mm above
/// the slot's floor.
pub(crate) const IN_SLOT: f64 = 18.0;

#[test]
fn a_slot_that_has_been_cut_is_not_met_and_one_that_is_too_narrow_or_not_yet_cut_is() {
    let (shop, block) = (shop_with_guard(), Block::on_the_plate());
    let (setup, settings) = (block.setup(&shop), VerifySettings::default());
    for (share, is_met) in [(0.9, true), (1.1, false)] {
        let behind = pass(slot(Text::new(&shop), share * NEEDED), 0.0, IN_SLOT);
        let found = both(&behind, &setup, &settings, &block.outside);
        assert_eq!(collisions(&found.first), [(BEHIND, BEHIND)], "{share}");
        let reported = if is_met { vec![(BEHIND, BEHIND)] } else { Vec::new() };
        assert_eq!(collisions(&found.now), reported, "{share}: {:?}", found.now);
        let before = slot(pass(Text::new(&shop), 0.0, IN_SLOT), share * NEEDED);
        let found = both(&before, &setup, &settings, &block.outside);
        assert_eq!(collisions(&found.now), [(BEFORE, BEFORE)], "{share}");
        assert_eq!(found.now[0].obstacle.as_deref(), Some("stock"));
    }
}

#[test]
fn what_is_left_beside_the_guard_is_never_reported_to_be_farther_than_it_is() {
    let (shop, block) = (shop_with_guard(), Block::on_the_plate());
    let setup = block.setup(&shop);
    // The cutter takes as much less, and what is left is seen so far around the lines; ways are
    // within twice the tolerance.
    let beside = 2.0 * outside_layer(CELL) + 4.0 * TOLERANCE;
    let settings = VerifySettings { near_miss: 4.0, ..VerifySettings::default() };
    for gap in [0.3, 4.3, 6.6] {
        let text = pass(slot(Text::new(&shop), GUARD + gap), 0.0, IN_SLOT);
        let found = both(&text, &setup, &settings, &block.outside).now;
        let nearest = found.iter().map(distance).fold(f64::INFINITY, f64::min);
        let least = (gap - beside - 1e-3).max(0.0);
        assert!(nearest <= gap + TOLERANCE && nearest >= least, "{gap}: {found:?}");
        for f in &found {
            let is_hit = distance(f) < CLEARANCE - SLACK;
            assert_eq!(f.kind, if is_hit { FindingKind::Collision } else { FindingKind::NearMiss }, "{gap}: {f}");
        }
    }
}

/// Over and beside the block at many distances and two angles, the cutter always outside: rapids
/// and feeds.
fn around(shop: &Shop) -> Text<'_> {
    let z = HIGH[2] - ABOVE;
    let mut text = Text::new(shop).rapid([-120.0, 155.0, 200.0]);
    for (k, above) in [-5.0, 2.85, 2.95, 3.1, 2.5].into_iter().enumerate() {
        let y = 152.0 + k as f64;
        text = text.rapid([-120.0, y, 200.0]).rapid([-120.0, y, z + above]).cut([-10.0 * k as f64, y, z + above]);
        text = text.rapid([120.0, y, z + above]).rapid([120.0, y, 200.0]);
    }
    for lean in [0.1, -0.15] {
        let axis = [0.0, -lean, 1.0];
        text = text.rapid_tilted([0.0, 170.0, 200.0], axis).rapid_tilted([0.0, 170.0, 30.0], axis);
        text = text.cut_tilted([20.0, 156.0, 26.0], axis).cut_tilted([40.0, 190.0, 26.0], [0.0, lean, 1.0]);
        text = text.rapid_tilted([40.0, 220.0, 200.0], [0.0, 0.0, 1.0]);
    }
    text
}

#[test]
fn without_a_cut_all_findings_are_those_against_the_stock_before_cutting() {
    let (shop, block) = (shop_with_guard(), Block::on_the_plate());
    let setup = block.setup(&shop);
    let settings = VerifySettings { near_miss: 0.05, ..VerifySettings::default() };
    let text = around(&shop);
    let Both { first, now } = both(&text, &setup, &settings, &block.outside);
    let kinds = |kind| first.iter().filter(|f| f.kind == kind).count();
    assert!(kinds(FindingKind::Collision) > 2 && kinds(FindingKind::NearMiss) > 1, "{first:#?}");
    assert!(now.iter().all(|f| f.obstacle.as_deref() == Some("stock") && f.note.starts_with("not proven")), "{now:?}");
    let named = |f: &Finding| Finding { obstacle: Some("block".to_owned()), note: String::new(), ..f.clone() };
    assert_eq!(first, now.iter().map(named).collect::<Vec<_>>());
    // A part with as much stock on it, which findings name as stock and not as the part.
    let thickness = 4.0;
    let [low, high] = [LOW.map(|v| v + thickness), HIGH.map(|v| v - thickness)];
    let part = MeshTree::new(&box_mesh(low, high));
    let mut thick = setup.clone();
    let (name, kind) = ("part".to_owned(), ObstacleKind::Part);
    thick.obstacles[1] = VirtualObstacle { name, mesh: &part, kind, allowance: 0.0, stock: thickness };
    let Both { first, now } = both(&text, &thick, &settings, &block.outside);
    let reported = collisions(&now);
    let is_reported = |(first, last): (u32, u32)| reported.iter().any(|(from, to)| *from <= first && last <= *to);
    assert!(!reported.is_empty() && collisions(&first).into_iter().all(is_reported), "{first:?} and {now:?}");
}

/// A pin of stock of 0.2 mm that a finger of 0.4 mm passes over, with no clearance: positions are a
/// mm apart.
#[test]
fn stock_that_is_met_between_two_positions_alone_is_found_until_it_is_cut() {
    let length = Shop::new().tool.gauge_length();
    let finger = ShapeFile::Box { size_mm: [0.4, 10.0, 10.0] };
    let shop = shop_with(finger, [0.0, 50.0, ABOVE + 5.0 - length], 0.0);
    let q = shop.axes_at([0.0, 0.0, IN_SLOT], [0.0, 0.0, 1.0]);
    let finger = shop.machine.body_poses(&q).find(|b| b.body.name() == "guard").unwrap().table_from_solid;
    let work_from_finger = shop.table_from_work.inverse() * finger;
    let along = work_from_finger.rotation * Vector3::x();
    let settings = VerifySettings { max_step: 100.0, max_turn: 1.0, ..VerifySettings::default() };
    let middle = work_from_finger * Point3::origin();
    for k in 0..5 {
        let pin = middle + along * (0.31 * f64::from(k));
        let (low, high) = ([pin.x - 0.1, pin.y - 0.1, 0.0], [pin.x + 0.1, pin.y + 0.1, HIGH[2]]);
        let block = Block::new(low, high, 0.2);
        let setup = block.setup(&shop);
        let over = |text: Text<'_>| {
            let [from, to] = [-6.0, 6.0].map(|s| along * s + Vector3::new(0.0, 0.0, IN_SLOT));
            let text = text.rapid([from.x, from.y, 200.0]).rapid([from.x, from.y, from.z]);
            text.cut(to.into()).rapid([to.x, to.y, 200.0]).text
        };
        let start = || Text::new(&shop).rapid([0.0, 0.0, 200.0]);
        let cut = |text: Text<'_>| {
            let z = HIGH[2] - 5.0;
            let text = text.rapid([pin.x - 60.0, pin.y, 200.0]).rapid([pin.x - 60.0, pin.y, z]);
            text.cut([pin.x + 60.0, pin.y, z]).rapid([pin.x + 60.0, pin.y, 200.0]).text
        };
        let whole = Text { text: over(start()), shop: &shop };
        let found = both(&whole, &setup, &settings, &block.outside);
        assert_eq!(collisions(&found.first), [(4, 4)], "{k}");
        assert_eq!(collisions(&found.now), [(4, 4)], "{k}");
        let behind = Text { text: over(Text { text: cut(start()), shop: &shop }), shop: &shop };
        let found = both(&behind, &setup, &settings, &block.outside);
        assert_eq!(collisions(&found.first), [(8, 8)], "{k}");
        assert_eq!(collisions(&found.now), [], "{k}");
    }
}

#[test]
fn stock_without_lines_stays_as_it_was_before_cutting() {
    let (shop, block) = (shop_with_guard(), Block::on_the_plate());
    let (setup, settings) = (block.setup(&shop), VerifySettings::default());
    let text = pass(slot(Text::new(&shop), 1.1 * NEEDED), 0.0, IN_SLOT);
    assert_eq!(collisions(&both(&text, &setup, &settings, &block.outside).now), []);
    let high = [HIGH[0], 50.0, HIGH[2]];
    let half = Block::new(LOW, high, CELL).outside;
    let found = both(&text, &setup, &settings, &half);
    assert_eq!(collisions(&found.now), [(BEHIND, BEHIND)], "{:?}", found.now);
}

#[test]
fn findings_are_the_same_on_any_number_of_threads() {
    let (shop, block) = (shop_with_guard(), Block::on_the_plate());
    let (setup, settings) = (block.setup(&shop), VerifySettings::default());
    let mut text = slot(Text::new(&shop), 1.1 * NEEDED);
    for y in [0.0, 3.0, -8.0, 6.0, 20.0] {
        text = pass(text, y, IN_SLOT);
    }
    let run = || both(&text, &setup, &settings, &block.outside).now;
    let of_one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(run);
    assert_eq!(collisions(&of_one).len(), 3, "{of_one:#?}");
    assert_eq!(of_one, run());
}

/// Certificates of a program whose stock is cut say nothing of the stock; of all else they say what
/// they did.
#[test]
fn certificates_leave_out_the_stock_that_is_cut_and_nothing_else() {
    let (shop, block) = (shop_with_guard(), Block::on_the_plate());
    let setup = block.setup(&shop);
    let over = Text::new(&shop).rapid([0.0, 152.0, 200.0]).cut([0.0, 152.0, 15.0]).cut([0.0, 180.0, -15.0]);
    let program = read_program(&over.text, Dialect::Fanuc).unwrap();
    let certified = |machine: bool| -> Vec<bool> {
        let as_cut = HeldAsCut { tool: false, machine };
        let settings = VerifySettings { as_cut, gouge_limit: 0.1, ..VerifySettings::default() };
        let Certificates { certificates, .. } = certify(&program, &setup, &settings, &Silent).unwrap();
        certificates.iter().map(|c| c.certified).collect()
    };
    // The second block brings the guard into the stock, the third one the cutter into the plate.
    assert_eq!((certified(false), certified(true)), (vec![true, false, false], vec![true, true, false]));
}

/// Fins and needles, thinner than the distance of the lines, that stand between two of them: beside
/// the cutter, and under the guard.
#[test]
fn obstacles_between_the_lines_are_met_anywhere_until_they_are_cut() {
    let shop = shop_with_guard();
    let region = [[-11.0, -71.0], [11.0, 71.0]];
    for k in 0..20 {
        let (x, thick) = (0.06 + 0.085 * f64::from(k), [0.02, 0.25][k as usize % 2]);
        let length = if k % 4 < 2 { 15.0 } else { thick };
        // Between lines at x = 0 and 2, y = 46 and 48.
        let y = 46.1 + 0.08 * f64::from(k);
        let stands = box_mesh([x, y, 0.0], [x + thick, y + length, HIGH[2]]);
        let lines = |around: f64| {
            DexelMap::of_mesh_within(&stands, &Isometry3::identity(), CELL, (around, true), region).unwrap()
        };
        assert_eq!(lines(0.0).volume(), 0.0, "{k} is seen by a line");
        let block = Block { mesh: MeshTree::new(&stands), outside: lines(outside_layer(CELL)) };
        let (setup, settings) = (block.setup(&shop), coarse());
        let met = both(&pass(Text::new(&shop), 0.0, IN_SLOT), &setup, &settings, &block.outside).now;
        assert_eq!(collisions(&met), [(BEFORE, BEFORE)], "{k}");
        // With its upper end off.
        let cut = pass(Text::new(&shop), y, HIGH[2] - DEPTH);
        let found = both(&pass(cut, 0.0, IN_SLOT), &setup, &settings, &block.outside);
        assert_eq!((collisions(&found.first).last(), collisions(&found.now)), (Some(&(7, 7)), Vec::new()), "{k}");
    }
}

/// Passes across the block in y and z of their tips.
struct Profile {
    /// Tips of what has been cut.
    cut: Vec<[f64; 2]>,
}

impl Profile {
    /// Whether any of the block is left, by cutters that are smaller by `smaller` on all sides,
    /// within `near` of a guard.
    fn holds(&self, smaller: f64, [y, z]: [f64; 2], near: f64) -> bool {
        // Of a smaller one without all that is outside of the round of its corner.
        let corner = if smaller > 0.0 { CORNER } else { 0.0 };
        let is_cut = |p: [f64; 2], tip: [f64; 2]| {
            let (across, above) = ((p[0] - tip[0]).abs(), p[1] - tip[1]);
            let reach = if above > corner { RADIUS - smaller } else { RADIUS - corner };
            across < reach && above > smaller && above < FLUTE - smaller
        };
        let is_near = |p: [f64; 2]| {
            let above = p[1] - z - ABOVE;
            let across = ((p[0] - y).abs() - GUARD).max(0.0);
            across.hypot((-above).max(above - 10.0).max(0.0)) < near
        };
        let points = (0..=480).flat_map(|j| (0..=80).map(move |k| [LOW[1] + 0.5 * f64::from(j), 0.5 * f64::from(k)]));
        points.filter(|p| is_near(*p)).any(|p| !self.cut.iter().any(|tip| is_cut(p, *tip)))
    }
}

const FLUTE: f64 = 12.0;

/// Passes at random against points of the block's section: what is there for certain is met, and
/// what is met may be there.
#[test]
fn the_guard_is_reported_where_points_of_the_block_are_left_and_nowhere_else() {
    let (shop, block) = (shop_with_guard(), Block::on_the_plate());
    let (setup, settings) = (block.setup(&shop), coarse());
    let mut state = facemill_test_kit::Random(5);
    let mut random = |low: f64, high: f64| state.between(low, high);
    let beside = outside_layer(CELL) + 4.0 * TOLERANCE;
    let (mut n_met, mut n_cleared) = (0, 0);
    for _ in 0..4 {
        // Most of what goes deeper comes later.
        let roughing =
            (0..7).map(|k| [random(0.0, 1.0), -118.0 + 40.0 * f64::from(k) + random(-3.0, 3.0), random(31.0, 33.0)]);
        let mut tips: Vec<[f64; 3]> = roughing.collect();
        tips.extend((0..5).map(|_| [random(0.5, 1.5), random(-120.0, 120.0), random(14.0, 22.0)]));
        tips.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let tips: Vec<[f64; 2]> = tips.into_iter().map(|[_, y, z]| [y, z]).collect();
        let text = tips.iter().fold(Text::new(&shop), |text, [y, z]| pass(text, *y, *z));
        let Both { first, now } = both(&text, &setup, &settings, &block.outside);
        let has = |found: &[Finding], line: u32| collisions(found).iter().any(|(a, b)| (*a..=*b).contains(&line));
        for (k, tip) in tips.iter().enumerate() {
            let line = 4 * k as u32 + 3;
            let (before, behind) = (Profile { cut: tips[..k].to_vec() }, Profile { cut: tips[..=k].to_vec() });
            let met = has(&now, line);
            assert!(met || !behind.holds(0.0, *tip, CLEARANCE - SLACK), "pass {k} of {tips:?}: {now:?}");
            assert!(!met || before.holds(beside, *tip, CLEARANCE + beside), "pass {k} of {tips:?}: {now:?}");
            n_met += u32::from(met);
            n_cleared += u32::from(!met && has(&first, line));
        }
    }
    assert!(n_met > 4 && n_cleared > 2, "{n_met} met, {n_cleared} cut before");
}

/// The second head's guard, 2 mm narrower than the slot that the first head mills on each side, in
/// it.
#[test]
fn what_one_head_has_cut_is_free_for_bodies_of_the_other() {
    let mut shop = dual::Shop::new();
    let mut file = shop.views[0].to_file();
    let shape = ShapeFile::Cylinder { radius_mm: RADIUS - 3.0, height_mm: 4.0 };
    let position_mm = [0.0, 0.0, 28.0 - dual::LENGTHS[1]];
    let guard = BodyFile { name: "guard".into(), shape, position_mm, rotation_xyz_deg: [0.0; 3], clearance_mm: 1.0 };
    file.tool_chains[1].rows.last_mut().unwrap().bodies.push(guard);
    shop.views = Machine::heads(file).unwrap();
    let block = Block::new([350.0, -80.0, 140.0], [450.0, 80.0, 150.0], 1.0);
    let setups = [0, 1].map(|h| {
        let mut setup = shop.setup(h);
        setup.obstacles[0] =
            VirtualObstacle { kind: ObstacleKind::Stock, mesh: &block.mesh, ..setup.obstacles[0].clone() };
        setup
    });
    // Through the plate; and with the flute above it, the guard in it.
    let ways = [|x: f64| [Some([x, 0.0, 139.0]), None], |x: f64| [None, Some([x, 0.0, 175.0])]];
    let away = |tips: [Option<[f64; 3]>; 2]| [0, 1].map(|h| tips[h].map(|[x, y, z]| [x, y, z + [200.0, -200.0][h]]));
    let found = |order: [usize; 2]| {
        let text = order.into_iter().fold(dual::Program::new(&shop), |program, h| {
            let [from, to] = [300.0, 500.0].map(ways[h]);
            program.rapid(0.1, away(from)).rapid(0.1, from).cut(0.1, to, 20.0).rapid(0.1, away(to))
        });
        let text = text.text();
        let cuts: Vec<u32> = (1..).zip(text.lines()).filter(|(_, l)| l.contains(" G1 ")).map(|(n, _)| n).collect();
        let [first, second] = of_heads(&text, setups.each_ref(), &coarse(), &block.outside);
        assert_eq!((first.first, first.now), (Vec::new(), Vec::new()));
        let line = cuts[order.iter().position(|h| *h == 1).unwrap()];
        let is_alone = |found: &[Finding]| found.iter().all(|f| f.first_line == line && f.last_line == line);
        assert!(!collisions(&second.first).is_empty() && is_alone(&second.first), "{:?}", second.first);
        assert!(is_alone(&second.now) && second.now.iter().all(|f| f.note.ends_with("head back")), "{:?}", second.now);
        !second.now.is_empty()
    };
    assert!(!found([0, 1]) && found([1, 0]));
}

/// From below through a thin block, a guard that is narrower than the cutter over it: what the
/// flute takes on the same way comes later.
#[test]
fn what_the_move_itself_cuts_behind_the_guard_is_met_and_not_a_second_time() {
    let length = Shop::new().tool.gauge_length();
    let disc = ShapeFile::Cylinder { radius_mm: RADIUS - 6.0, height_mm: 10.0 };
    let shop = shop_with(disc, [0.0, 0.0, ABOVE - length], 1.0);
    let block = Block::new([-10.0, -10.0, 100.0], [10.0, 10.0, 104.0], 1.0);
    let up = |text: Text<'_>| {
        let text = text.rapid([-200.0, 0.0, 200.0]).rapid([-200.0, 0.0, 60.0]).rapid([0.0, 0.0, 60.0]);
        text.cut([0.0, 0.0, 140.0]).text
    };
    let once = up(Text::new(&shop));
    let twice = Text { text: up(Text { text: once, shop: &shop }), shop: &shop };
    let found = both(&twice, &block.setup(&shop), &coarse(), &block.outside);
    assert_eq!(collisions(&found.first), [(4, 4), (8, 8)]);
    assert_eq!(collisions(&found.now), [(4, 4)]);
}

/// In a slot that is wide enough, a tool half a degree off the pole that turns past it: no bound on
/// the rotary axes is known there.
#[test]
fn a_body_is_reported_where_no_bound_on_its_motion_in_the_cut_stock_is_known() {
    let mut file = shop_with_guard().machine.to_file();
    file.motion.cutting = CuttingLawFile::TipLinearVectorTurned;
    let shop = Shop::with_machine(Machine::from_file(file).unwrap());
    let block = Block::on_the_plate();
    let setup = block.setup(&shop);
    for (turn, is_known) in [("C0.", true), ("C150.", false)] {
        let text = slot(Text::new(&shop), 1.1 * NEEDED).rapid([-120.0, 0.0, 200.0]).line("G0 B0.5 C0.");
        let text = text.line("G0 G43.4 H7 X0. Y0. Z200.").line("G0 Z18.").line(&format!("G1 X1. B0.5 {turn} F500."));
        let Both { first, now } = both(&text, &setup, &coarse(), &block.outside);
        assert_eq!(collisions(&first), [(16, 17)], "{turn} {first:?}");
        assert_eq!(collisions(&now), if is_known { vec![] } else { vec![(17, 17)] }, "{turn} {now:?}");
        assert!(now.iter().all(|f| f.measure.is_none()), "{turn} {now:?}");
    }
}
