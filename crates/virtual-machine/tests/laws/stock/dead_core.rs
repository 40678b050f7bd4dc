//! Cores of face mills in stock, and twins whose ring has cleared the way.
//!
//! The tool has R 25, a core of radius 15 and may ramp at 3 degrees, so that its core is recessed
//! by 2 · 15 · tan 3° = 1.57 mm. On the plate, whose top is z = 0, lie 3 mm of stock.

use crate::kit::{HEAD, Shop, Text, box_mesh, lift_of};
use facemill_interference::MeshTree;
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_tool_model::ToolAssembly;
use facemill_virtual_machine::{FindingKind, Measure, ObstacleKind, Verification, VerifySettings, VirtualObstacle};

const RECESS: f64 = 2.0 * 15.0 * 0.052_407_779;
const STOCK: f64 = 3.0;

fn core_tool() -> ToolAssembly {
    ToolAssembly::from_json(
        br#"{
            "format": "facemill-tool/1", "name": "mill 50 r4", "number": 7, "radius_mm": 25, "corner_radius_mm": 4,
            "n_inserts": 4, "flute_length_mm": 12, "dead_core_radius_mm": 15, "max_ramp_angle_deg": 3,
            "spindle_rotation": "clockwise", "stick_out_mm": 60, "gauge_length_mm": 120,
            "body": { "clearance_mm": 1, "sections": [
                { "length_mm": 48, "diameter_low_mm": 44, "diameter_high_mm": 44 } ] },
            "holder": { "clearance_mm": 2, "sections": [
                { "length_mm": 60, "diameter_low_mm": 80, "diameter_high_mm": 80 } ] }
        }"#,
    )
    .unwrap()
}

/// Runs a text with stock as a thickness on the plate.
fn run(text: &Text<'_>) -> Verification {
    let mut setup = text.shop.setup();
    setup.obstacles.truncate(1);
    setup.obstacles[0].stock = STOCK;
    let tool = core_tool();
    setup.tool = &tool;
    text.verify_in(&setup)
}

/// Lines and depths of cores in stock.
fn cores(v: &Verification) -> Vec<(u32, f64)> {
    let of_core = v.findings.iter().filter(|f| f.kind == FindingKind::DeadCore);
    of_core
        .map(|f| {
            assert_eq!(f.body.as_deref(), Some("cutter"));
            let Some(Measure::DepthMm(depth)) = f.measure else { panic!("{f:?}") };
            (f.worst_line, depth)
        })
        .collect()
}

#[test]
fn a_pass_from_outside_is_clean_and_a_plunge_is_not() {
    let shop = Shop::new();
    let outside = || Text::new(&shop).rapid([-260.0, 0.0, 300.0]);
    let v = run(&outside().cut([-260.0, 0.0, 0.5]).cut([100.0, 0.0, 0.5]).cut([100.0, 0.0, 60.0]));
    assert_eq!(v.findings, []);
    let plunge = |z: f64| run(&Text::new(&shop).rapid([0.0, 0.0, 300.0]).cut([0.0, 0.0, z]).cut([0.0, 0.0, 60.0]));
    let found = cores(&plunge(0.5));
    assert_eq!(found.len(), 1, "{found:?}");
    let expected = STOCK - 0.5 - RECESS;
    assert!(found[0].0 == HEAD + 2 && (found[0].1 - expected).abs() < 0.06, "{found:?} {expected}");
    // Less deep than the recess the core stays above the stock.
    assert_eq!(cores(&plunge(STOCK - RECESS + 0.05)), []);
}

#[test]
fn ramps_up_to_the_largest_angle_are_clean_and_steeper_ones_are_not() {
    let shop = Shop::new();
    let ramp = |deg: f64| {
        let way = (STOCK - 0.2) / f64::to_radians(deg).tan();
        let text = Text::new(&shop).rapid([-100.0, 0.0, 300.0]).cut([-100.0, 0.0, STOCK + 0.2]);
        let text = text.cut([-100.0 + way + 0.4 / f64::to_radians(deg).tan(), 0.0, 0.0]);
        run(&text.cut([60.0, 0.0, 0.0]).cut([60.0, 0.0, 60.0]))
    };
    for deg in [0.8, 2.0, 3.0] {
        assert_eq!(ramp(deg).findings, [], "{deg}");
    }
    for deg in [4.5, 6.0, 20.0] {
        assert_eq!(cores(&ramp(deg)).len(), 1, "{deg}");
    }
}

#[test]
fn a_tool_with_its_low_edge_behind_is_found_and_one_with_it_in_front_is_not() {
    let shop = Shop::new();
    let run_from = |from: f64| {
        let at = |x: f64, z: f64| [x, 0.0, z];
        let (tilt, z) = ([0.1, 0.0, 1.0], lift_of(0.1) + 0.05);
        let text = Text::new(&shop).rapid(at(from, 300.0)).rapid_tilted(at(from, 60.0), tilt);
        run(&text.cut_tilted(at(from, z), tilt).cut_tilted(at(0.0, z), tilt).cut_tilted(at(0.0, 60.0), tilt))
    };
    // The axis leans toward +x, where the bottom is lowest.
    assert_eq!(run_from(-260.0).findings, []);
    let found = cores(&run_from(260.0));
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].0, HEAD + 4);
}

#[test]
fn what_an_earlier_pass_removed_is_no_stock_and_what_it_left_is() {
    let shop = Shop::new();
    let text = |y: f64, cuts_before: bool| {
        let mut text = Text::new(&shop).rapid([-260.0, 0.0, 300.0]);
        let z = if cuts_before { 0.5 } else { 10.0 };
        text = text.cut([-260.0, 0.0, z]).cut([150.0, 0.0, z]).cut([150.0, 0.0, 60.0]);
        // Long enough for another chunk and to forget the last way.
        for k in 0..300 {
            text = text.cut([100.0 - 0.5 * f64::from(k), y, 50.0]);
        }
        text.cut([-50.0, y, 0.5]).cut([-50.0, y, 60.0])
    };
    assert_eq!(cores(&run(&text(0.0, true))), []);
    assert_eq!(cores(&run(&text(0.0, false))).len(), 1, "nothing was cut there");
    assert_eq!(cores(&run(&text(60.0, true))).len(), 1, "the slot is 50 mm wide");
    // Later passes do not count for earlier ones.
    let early = Text::new(&shop).rapid([0.0, 0.0, 300.0]).cut([0.0, 0.0, 0.5]).cut([0.0, 0.0, 60.0]);
    let later = early.rapid([-260.0, 0.0, 60.0]).cut([-260.0, 0.0, 0.5]).cut([150.0, 0.0, 0.5]);
    assert_eq!(cores(&run(&later)).iter().map(|c| c.0).collect::<Vec<_>>(), [HEAD + 2]);
}

#[test]
fn raw_stock_counts_and_a_tool_that_cuts_at_its_centre_may_plunge() {
    let shop = Shop::new();
    let block = MeshTree::new(&box_mesh([-200.0, -200.0, 0.0], [200.0, 200.0, STOCK]));
    let stock =
        VirtualObstacle { name: "stock".into(), mesh: &block, kind: ObstacleKind::Stock, allowance: 0.0, stock: 0.0 };
    let text = Text::new(&shop).rapid([0.0, 0.0, 300.0]).cut([0.0, 0.0, 0.5]).cut([0.0, 0.0, 60.0]);
    let tool = core_tool();
    let mut setup = shop.setup();
    setup.obstacles[1] = stock;
    assert_eq!(cores(&text.verify_in(&setup)), [], "the shop's own tool has no core");
    setup.tool = &tool;
    let found = cores(&text.verify_in(&setup));
    assert!(found.len() == 1 && (found[0].1 - (STOCK - 0.5 - RECESS)).abs() < 0.06, "{found:?}");
}

#[test]
fn the_result_is_the_same_on_any_number_of_threads() {
    let shop = Shop::new();
    let mut text = Text::new(&shop).rapid([-260.0, 0.0, 300.0]);
    for k in 0..500 {
        let (x, z) = (f64::from(k % 25) * 12.0 - 150.0, if k % 7 == 3 { 0.3 } else { 2.4 });
        text = text.cut([x, f64::from(k / 25) * 9.0 - 90.0, z]);
    }
    let program = read_program(&text.text, Dialect::Fanuc).unwrap();
    let tool = core_tool();
    let mut setup = shop.setup();
    setup.obstacles[0].stock = STOCK;
    setup.tool = &tool;
    let verify = || {
        facemill_virtual_machine::verify(&program, &setup, &VerifySettings::default(), &facemill_cl_data::Silent)
            .unwrap()
    };
    let on = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(verify);
    let one = on(1);
    assert!(!cores(&one).is_empty());
    assert_eq!(one, on(3));
}

/// Heights of stock on a grid of 1 mm, cut by upright rings: an account of its own.
struct Heights(Vec<f64>);

/// Half of the grid's side, mm.
const HALF: i32 = 110;

impl Heights {
    /// Cuts along a straight way and returns the most cells, within `core` of the axis, that stood
    /// higher than `above` over the recess at one place.
    fn cut(&mut self, from: [f64; 3], to: [f64; 3], inner: f64, core: f64, above: f64) -> usize {
        let way = (0..3).map(|k| (to[k] - from[k]).powi(2)).sum::<f64>().sqrt();
        let n = (way / 0.25).ceil().max(1.0) as u32;
        let mut most = 0;
        for k in 0..=n {
            let t = f64::from(k) / f64::from(n);
            let [x, y, z] = [0, 1, 2].map(|k| from[k] + t * (to[k] - from[k]));
            let mut cells = 0;
            for i in (x as i32 - 26)..=(x as i32 + 26) {
                for j in (y as i32 - 26)..=(y as i32 + 26) {
                    let height = &mut self.0[((i + HALF) * 2 * HALF + j + HALF) as usize];
                    let radius = (f64::from(i) - x).hypot(f64::from(j) - y);
                    cells += usize::from(radius <= core && *height > z + RECESS + above);
                    if (inner..=25.0).contains(&radius) {
                        let corner = 4.0 - (16.0 - (radius - 21.0).max(0.0).powi(2)).sqrt();
                        *height = height.min(z + corner);
                    }
                }
            }
            most = most.max(cells);
        }
        most
    }
}

#[test]
fn random_ways_agree_with_heights_of_the_stock() {
    let mut state = facemill_test_kit::Random(5);
    let mut unit = || state.unit();
    let shop = Shop::new();
    let (mut n_clean, mut n_found) = (0, 0);
    for _ in 0..30 {
        let mut at = [60.0 * unit() - 30.0, 60.0 * unit() - 30.0, STOCK + 0.2];
        let mut text = Text::new(&shop).rapid([at[0], at[1], 300.0]).cut(at);
        let full = || Heights(vec![STOCK; (4 * HALF * HALF) as usize]);
        // Once with all of the core and no more than the ring, once with what surely is found.
        let (mut strict, mut lenient) = (full(), full());
        let (mut any, mut many) = (0, 0);
        let steepest = if unit() < 0.5 { 2.9_f64 } else { 40.0 };
        for _ in 0..6 {
            // Some legs are short, so that steep ones go deep.
            let reach = if unit() < 0.5 { 15.0 } else { 70.0 };
            let [x, y] = [0, 1].map(|k| (at[k] + reach * (2.0 * unit() - 1.0)).clamp(-70.0, 70.0));
            let way = (x - at[0]).hypot(y - at[1]);
            let z = (at[2] - way * (steepest * unit()).to_radians().tan()).max(0.3);
            any = any.max(strict.cut(at, [x, y, z], 15.1, 12.0, 0.0));
            many = many.max(lenient.cut(at, [x, y, z], 14.0, 12.0, 0.35));
            at = [x, y, z];
            text = text.cut(at);
        }
        let found = cores(&run(&text.cut([at[0], at[1], 60.0])));
        assert!(any > 0 || found.is_empty(), "the core is clear everywhere: {found:?}");
        assert!(many < 120 || !found.is_empty(), "{many} mm2 of the core are in stock");
        n_clean += usize::from(any == 0);
        n_found += usize::from(many >= 120);
    }
    assert!(n_clean > 5 && n_found > 5, "{n_clean} clean, {n_found} found");
}
