//! Bodies and rapids at what the program itself has cut before, or has left.
//!
//! Lines are 1 mm apart and stand in the middles of cells. A wall that a pass has left begins at
//! the first line beyond the cutter's flank: passes are laid so that it is 0.3 mm beyond, and what
//! comes later is measured from that line.

use facemill_cl_data::Silent;
use facemill_nc_program::Dialect;
use facemill_nc_program::read::read_fanuc;
use facemill_nc_program::read_program;
use facemill_tool_model::ToolAssembly;
use facemill_virtual_machine::{FindingKind, HeldAsCut, VerifySettings, VirtualSetup, run_stock_of_heads};
use facemill_z_map::DexelMap;
use nalgebra::Isometry3;

use super::bodies::{feed_line, turned};
use super::pairs::{Outcome, Row, SLACK, row};
use super::stock::gap;
use crate::kit::stock::cut_stock;
use crate::kit::{HEAD, RADIUS, Shop, Text, dual};

/// That of the cut stock, mm: a tenth of what a pair is apart.
const TOLERANCE: f64 = 0.001;

pub(crate) fn rows() -> Vec<Row> {
    use FindingKind::{HolderCollision, RapidCollision};
    vec![
        row("holder at the wall of a pocket that was cut", HolderCollision, holder_in_a_pocket),
        row("shank at the step of a floor", HolderCollision, shank_at_a_step),
        row("axis that turns back over stock that was cut", RapidCollision, back_over_stock),
        row("rapid over a rib that was left and cut down", RapidCollision, over_a_rib),
        row("second head's shank in a slot of the first one", HolderCollision, second_heads_shank),
    ]
}

/// A box from corner to corner, cut by a program.
fn cut_box(setup: &VirtualSetup<'_>, text: &str, [low, high]: [[f64; 3]; 2], line: u32) -> Outcome {
    let mut stock = DexelMap::of_box(&Isometry3::identity(), low, high, 1.0).unwrap();
    let program = read_program(text, Dialect::Fanuc).unwrap();
    let settings = VerifySettings { as_cut: HeldAsCut::TOOL, ..VerifySettings::default() };
    let run = cut_stock(&program, setup, &settings, &mut stock, TOLERANCE);
    assert!(run.removed_mm3 > 1e4, "{}", run.removed_mm3);
    Outcome { findings: run.findings, line }
}

/// Straight along x through a box of ±60 mm at this y and z, in and out beside it.
fn pass(text: Text<'_>, y: f64, z: f64) -> Text<'_> {
    text.rapid([-120.0, y, 200.0]).rapid([-120.0, y, z]).cut([120.0, y, z]).rapid([120.0, y, 200.0])
}

/// Lines of each [`pass`].
const PASS: u32 = 4;

/// Line of the cut of the n-th pass, from 0.
fn line_of_pass(n: u32) -> u32 {
    HEAD + PASS * n + 3
}

/// How far beyond the flank of a pass the first line is that it leaves, mm.
const BEYOND: f64 = 0.3;

/// A pocket 6 mm deep, and a slot in its floor that is so deep that the holder, of radius 40 and
/// clearance 2, comes beside the pocket's wall.
fn holder_in_a_pocket(scale: f64) -> Outcome {
    let mut file = Shop::new().tool.to_file();
    file.flute_length_mm = 40.0;
    file.body.sections[0].length_mm = 5.0;
    (file.stick_out_mm, file.gauge_length_mm) = (45.0, 105.0);
    file.holder.sections[0].length_mm = 60.0;
    let tool = ToolAssembly::new(file).unwrap();
    let shop = Shop { tool, ..Shop::new() };
    let wall = 42.5;
    let mut text = Text::new(&shop);
    for y in [-30.0, 0.0, wall - BEYOND - RADIUS] {
        text = pass(text, y, 44.0);
    }
    text = pass(pass(text, 0.0, 12.0), wall - 40.0 - (2.0 - SLACK * scale), 3.0);
    cut_box(&shop.setup(), &text.text, [[-60.0, -60.0, 0.0], [60.0, 60.0, 50.0]], line_of_pass(4))
}

/// The shank, of radius 22 and clearance 1, beside what is left of a pass above it: the flute goes
/// under that.
fn shank_at_a_step(scale: f64) -> Outcome {
    let shop = Shop::new();
    let wall = 20.5;
    let text = pass(Text::new(&shop), wall - BEYOND - RADIUS, 10.0);
    let text = pass(text, wall - 22.0 - (1.0 - SLACK * scale), 3.0);
    cut_box(&shop.setup(), &text.text, [[-60.0, -60.0, 0.0], [60.0, 60.0, 20.0]], line_of_pass(1))
}

/// A post beside the table's middle is cut down by a pass; then C turns back by 200 degrees and
/// brings it under the cutter.
fn back_over_stock(scale: f64) -> Outcome {
    let shop = Shop::new();
    let [way, _] = turned(&shop, 20.0, 100.0);
    let at = |x: f64, z: f64| [way.x + x, way.y, z];
    let floor = 20.0 - gap(scale);
    let text = Text::new(&shop).rapid(at(-90.0, 200.0)).rapid(at(-90.0, floor)).cut(at(90.0, floor));
    let text = text.rapid(at(90.0, 200.0)).rapid([0.0, 0.0, 300.0]).rapid([0.0, 0.0, 20.0]);
    let text = text.line("G91 G0 C200.").line("G90 G0 Z2000.");
    let corners = [-15.0, 15.0].map(|by| [way.x + by, way.y + by, if by < 0.0 { 0.0 } else { 40.0 }]);
    // The flute is 12 mm high: the post is cut down in two passes.
    let first = floor + 10.0;
    let high = Text::new(&shop).rapid(at(-90.0, 200.0)).rapid(at(-90.0, first)).cut(at(90.0, first));
    let rest = text.text.split_once("M3\n").unwrap().1;
    cut_box(&shop.setup(), &(high.text + rest), corners, HEAD + 3 + 7)
}

/// Two slots leave a rib between them, which a third pass cuts down; a rapid goes over it from slot
/// to slot.
fn over_a_rib(scale: f64) -> Outcome {
    let shop = Shop::new();
    let text = [(-30.0, 9.0), (30.0, 9.0), (0.0, 14.0)].into_iter().fold(Text::new(&shop), |t, (y, z)| pass(t, y, z));
    let z = 14.0 + gap(scale);
    let text = text.rapid([0.0, -120.0, 200.0]).rapid([0.0, -120.0, z]).rapid([0.0, 120.0, z]);
    cut_box(&shop.setup(), &text.text, [[-60.0, -50.0, 0.0], [60.0, 50.0, 20.0]], HEAD + 3 * PASS + 3)
}

/// The first head mills a slot through a thin plate, above its rounded corner, and the shank of the
/// second one, of radius 22 and clearance 1, follows it from the other side beside the slot's wall.
fn second_heads_shank(scale: f64) -> Outcome {
    let shop = dual::Shop::new();
    let wall = 20.5;
    let first = |x: f64, z: f64| Some([x, wall - BEYOND - RADIUS, z]);
    let second = |x: f64, z: f64| Some([x, wall - 22.0 - (1.0 - SLACK * scale), z]);
    let both = |x: f64, away: f64| [first(x + 60.0, 139.0 + away), second(x, 175.0 - away)];
    let program = dual::Program::new(&shop).rapid(0.1, both(160.0, 200.0)).rapid(0.1, both(160.0, 0.0));
    let text = program.cut(0.1, both(680.0, 0.0), 20.0).rapid(0.1, both(680.0, 200.0)).text();
    let mut stock =
        DexelMap::of_box(&Isometry3::identity(), [250.0, -150.0, 144.0], [550.0, 150.0, 150.0], 1.0).unwrap();
    let (setups, settings) = ([0, 1].map(|head| shop.setup(head)), VerifySettings::default());
    let heads = setups.each_ref().map(|setup| (setup, &settings));
    let program = read_fanuc(&text).unwrap();
    let [front, back] = run_stock_of_heads(&program, heads, &mut stock, TOLERANCE, &Silent).unwrap();
    stock.check_invariants().unwrap();
    assert!(front.findings.is_empty() && front.removed_mm3 > 5e4, "{:?}", front.findings);
    Outcome { findings: back.findings, line: feed_line(&text, 0) }
}
