//! The stock as it is when something meets it.

use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_tool_model::ToolAssembly;
use facemill_virtual_machine::{FindingKind, HeldAsCut, RemovalLimit, VerifySettings, VirtualSetup};
use facemill_z_map::DexelMap;
use nalgebra::Isometry3;

use super::pairs::{Outcome, Row, ran, row};
use crate::kit::stock::cut_stock;
use crate::kit::{HEAD, RADIUS, Shop, Text};
use crate::stock::machine_stock::{BEHIND, Block, IN_SLOT, NEEDED, both, pass, shop_with_guard, slot};

/// That of the cut stock, mm.
const TOLERANCE: f64 = 0.01;

pub(crate) fn rows() -> Vec<Row> {
    use FindingKind::{Collision, DeadCore, HolderCollision, OverEngagement, RampTooSteep, RapidCollision};
    vec![
        row("rapid where nothing has been cut yet", RapidCollision, too_early),
        row("rapid through what a pass has left", RapidCollision, left_over),
        row("shank in a slot deeper than the flute", HolderCollision, deep_slot),
        row("way up through an overhang of the stock", RapidCollision, under_stock),
        row("plunge into cut stock", RampTooSteep, plunge),
        row("core of the cutter in stock", DeadCore, core).with(&[RampTooSteep]),
        row("too much at a time", OverEngagement, load),
        row("body of the head in a slot that is too narrow", Collision, narrow_slot),
    ]
}

/// Runs a text in a small block, cut on lines 1 mm apart.
fn cut(shop: &Shop, text: &Text<'_>, high: [f64; 3], settings: &VerifySettings, line: u32) -> Outcome {
    cut_with(shop.setup(), text, high, settings, line)
}

fn cut_with(setup: VirtualSetup<'_>, text: &Text<'_>, high: [f64; 3], settings: &VerifySettings, line: u32) -> Outcome {
    let low = [-high[0], -high[1], 0.0];
    let mut stock = DexelMap::of_box(&Isometry3::identity(), low, high, 1.0).unwrap();
    let program = read_program(&text.text, Dialect::Fanuc).unwrap();
    let settings = VerifySettings { as_cut: HeldAsCut::TOOL, ..settings.clone() };
    let run = cut_stock(&program, &setup, &settings, &mut stock, TOLERANCE);
    Outcome { findings: run.findings, line }
}

/// Gap of a rapid to the material of lines 1 mm apart, half the diagonal of a cell: 0.9 times that,
/// or 1.1.
pub(crate) fn gap(scale: f64) -> f64 {
    (2.0 - scale) * std::f64::consts::FRAC_1_SQRT_2
}

/// A rapid over a block, a pass at z = 15 through it, and a rapid over that: the first one comes
/// too near to what is not cut yet.
fn too_early(scale: f64) -> Outcome {
    let shop = Shop::new();
    let z = 20.0 + gap(scale);
    let text = Text::new(&shop).rapid([-90.0, 0.0, 200.0]).rapid([-90.0, 0.0, z]).rapid([90.0, 0.0, z]);
    let text = text.rapid([90.0, 0.0, 15.0]).cut([-90.0, 0.0, 15.0]);
    let z = 15.0 + gap(0.9);
    let text = text.rapid([-90.0, 0.0, z]).rapid([90.0, 0.0, z]);
    cut(&shop, &text, [50.0, 20.0, 20.0], &VerifySettings::default(), HEAD + 3)
}

/// A pass that leaves all below its height, and a rapid behind it.
fn left_over(scale: f64) -> Outcome {
    let shop = Shop::new();
    let z = 15.0 + gap(scale);
    let text = Text::new(&shop).rapid([-90.0, 0.0, 200.0]).rapid([-90.0, 0.0, 15.0]).cut([90.0, 0.0, 15.0]);
    let text = text.rapid([90.0, 0.0, z]).rapid([-90.0, 0.0, z]);
    cut(&shop, &text, [50.0, 20.0, 20.0], &VerifySettings::default(), HEAD + 5)
}

/// The flute is 12 mm high.
fn deep_slot(scale: f64) -> Outcome {
    let shop = Shop::new();
    let z = 20.0 - 12.0 - (scale - 1.0);
    let text = Text::new(&shop).rapid([-110.0, 0.0, 220.0]).rapid([-110.0, 0.0, z]).cut([110.0, 0.0, z]);
    cut(&shop, &text.rapid([110.0, 0.0, 220.0]), [50.0, 40.0, 20.0], &VerifySettings::default(), HEAD + 3)
}

/// A cutter with a thin shank cuts a groove into the side of a block, backs out of it, and goes up
/// beside the overhang: its outermost line is half a cell inside of the side, y = −20.
fn under_stock(scale: f64) -> Outcome {
    let file = Shop::new().tool.to_file();
    let mut thin = file;
    for section in &mut thin.body.sections {
        (section.diameter_low_mm, section.diameter_high_mm) = (20.0, 20.0);
    }
    let tool = ToolAssembly::new(thin).unwrap();
    let shop = Shop::new();
    let setup = VirtualSetup { tool: &tool, ..shop.setup() };
    let y = -20.0 + 0.5 - RADIUS - gap(scale);
    let text = Text::new(&shop).rapid([-90.0, -35.0, 200.0]).rapid([-90.0, -35.0, 4.0]).cut([0.0, -35.0, 4.0]);
    let text = text.cut([0.0, y, 4.0]).rapid([0.0, y, 200.0]);
    cut_with(setup, &text, [50.0, 20.0, 30.0], &VerifySettings::default(), HEAD + 5)
}

/// 3 degrees are allowed, and a tenth more is not reported.
fn plunge(scale: f64) -> Outcome {
    let shop = Shop::new();
    let way = 5.5 / (3.0 + 0.1 * scale).to_radians().tan();
    let text = Text::new(&shop).rapid([-20.0, 0.0, 200.0]).rapid([-20.0, 0.0, 21.0]);
    let text = text.cut([-20.0 + way, 0.0, 15.5]).cut([-20.0 + way, 0.0, 60.0]);
    cut(&shop, &text, [100.0, 30.0, 20.0], &VerifySettings::default(), HEAD + 3)
}

/// A core of radius 15 that is recessed by 2·15·tan 3°, deeper than that in stock by a tenth of a
/// mm, which is not reported.
fn core(scale: f64) -> Outcome {
    let mut file = Shop::new().tool.to_file();
    file.dead_core_radius_mm = 15.0;
    let tool = ToolAssembly::new(file).unwrap();
    let shop = Shop::new();
    let mut setup = VirtualSetup { tool: &tool, ..shop.setup() };
    setup.obstacles.truncate(1);
    setup.obstacles[0].stock = 3.0;
    let z = 3.0 - 30.0 * 3f64.to_radians().tan() - 0.1 * scale;
    let text = Text::new(&shop).rapid([0.0, 0.0, 300.0]).cut([0.0, 0.0, z]).cut([0.0, 0.0, 60.0]);
    ran(&text, &setup, HEAD + 2)
}

/// A slot as wide as the block, 40 mm, and 5 mm deep, at 2000 mm/min: 400 cm³/min. What is allowed,
/// with the slack of a tenth, is that over the number.
fn load(scale: f64) -> Outcome {
    let shop = Shop::new();
    let limit = RemovalLimit { largest: 40.0 * 5.0 * 2000.0 / 1.1 / scale, slowest: 200.0 };
    let text = Text::new(&shop).rapid([-90.0, 0.0, 200.0]).rapid([-90.0, 0.0, 15.0]).cut([90.0, 0.0, 15.0]);
    let settings = VerifySettings { removal: Some(limit), ..VerifySettings::default() };
    cut(&shop, &text.rapid([90.0, 0.0, 200.0]), [50.0, 20.0, 20.0], &settings, HEAD + 3)
}

/// A disc about the tool in a slot that is so much narrower or wider than the disc with its
/// clearance needs.
fn narrow_slot(scale: f64) -> Outcome {
    let (shop, block) = (shop_with_guard(), Block::on_the_plate());
    let text = pass(slot(Text::new(&shop), (2.0 - scale) * NEEDED), 0.0, IN_SLOT);
    let found = both(&text, &block.setup(&shop), &VerifySettings::default(), &block.outside);
    Outcome { findings: found.now, line: HEAD + BEHIND }
}
