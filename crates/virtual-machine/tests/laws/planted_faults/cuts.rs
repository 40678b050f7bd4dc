//! The cutter in what it must not cut.

use facemill_interference::MeshTree;
use facemill_nc_program::words::AxisKind;
use facemill_virtual_machine::{FindingKind, ObstacleKind, VerifySettings};
use nalgebra::{Point3, Unit, Vector3};

use super::pairs::{GOUGE, Outcome, Row, ran, ran_with, row};
use crate::kit::{CORNER, HEAD, RADIUS, Shop, Text, box_mesh, lift_of};

pub(crate) fn rows() -> Vec<Row> {
    use FindingKind::Gouge;
    vec![
        row("dip at a point", Gouge, dip),
        row("ridge between two points", Gouge, ridge),
        row("ridge between positions that lie far apart", Gouge, ridge_between_positions),
        row("tilt alone", Gouge, tilt),
        row("rotary words rounded to tenths", Gouge, rounded),
        row("chain of blocks along an arc", Gouge, arc),
        row("clamp in a cut", Gouge, clamp),
        row("check surface below its allowance", Gouge, check),
        row("upper edge of the flute under an overhang", Gouge, overhang),
    ]
}

/// Depth at the end of a block.
fn dip(scale: f64) -> Outcome {
    let shop = Shop::new();
    let text = Text::new(&shop).rapid([-100.0, 10.0, 300.0]).rapid([-100.0, 10.0, 20.0]).cut([-100.0, 10.0, 1.0]);
    let text = text.cut([-30.0, 10.0, -GOUGE * scale]).cut([40.0, 10.0, 1.0]).cut([40.0, 10.0, 60.0]);
    ran(&text, &shop.setup(), HEAD + 4)
}

/// A ridge that is 2 mm wide, and as high as the cutter may be deep; both ends of the block are
/// beside it.
fn over_a_ridge(shop: &mut Shop, scale: f64) -> String {
    shop.wall = MeshTree::new(&box_mesh([-1.0, -50.0, -5.0], [1.0, 50.0, GOUGE * scale]));
    let text = Text::new(shop).rapid([-60.0, 0.0, 300.0]).rapid([-60.0, 0.0, 20.0]).cut([-60.0, 0.0, 0.0]);
    text.cut([60.0, 0.0, 0.0]).cut([60.0, 0.0, 60.0]).text
}

fn ridge(scale: f64) -> Outcome {
    let mut shop = Shop::new();
    let text = over_a_ridge(&mut shop, scale);
    let mut setup = shop.setup();
    setup.obstacles[1].kind = ObstacleKind::Part;
    ran_with(&text, &setup, &VerifySettings::default(), HEAD + 4)
}

/// However far apart the settings let positions be, the cutter does not skip anything.
fn ridge_between_positions(scale: f64) -> Outcome {
    let mut shop = Shop::new();
    let text = over_a_ridge(&mut shop, scale);
    ran_with(&text, &shop.setup(), &VerifySettings { max_step: 500.0, ..VerifySettings::default() }, HEAD + 4)
}

/// The tip stays, and the tilt lowers the rim.
fn tilt(scale: f64) -> Outcome {
    let shop = Shop::new();
    let (lean, z) = ([0.05, 0.0, 1.0], lift_of(0.05) - GOUGE * scale);
    let text = Text::new(&shop).rapid([0.0, 0.0, 300.0]).rapid([0.0, 0.0, 20.0]).cut([0.0, 0.0, z]);
    let text = text.cut_tilted([0.0, 0.0, z], lean).cut_tilted([0.0, 0.0, 60.0], lean);
    ran(&text, &shop.setup(), HEAD + 4)
}

/// Pose after the rounding of rotary words; the height is chosen so that the depth is known.
fn rounded(scale: f64) -> Outcome {
    let shop = Shop::new();
    let lean = [0.05, 0.02, 1.0];
    let line = |z: f64| {
        let mut q = shop.axes_at([0.0, 10.0, z], lean);
        let words = shop.words.words(q.as_slice()).unwrap();
        let mut line = String::from("G1");
        for (k, w) in words.iter().enumerate() {
            let rotary = w.letter.kind() == AxisKind::Rotary;
            let tenths = (10.0 * w.value).round() / 10.0;
            q[k] += if rotary { (tenths - w.value).to_radians() } else { 0.0 };
            line += &if rotary { format!(" {}{tenths:.1}", w.letter) } else { format!(" {}{:.4}", w.letter, w.value) };
        }
        (line + " F1000.", shop.machine.cl_point(&q, shop.tool.gauge_length()))
    };
    let cl = line(0.0).1;
    let work_from_table = shop.table_from_work.inverse();
    let (tip, axis): (Point3<f64>, Unit<Vector3<f64>>) = (work_from_table * cl.tip, work_from_table * cl.axis);
    let (sin, cos) = (axis.xy().norm(), axis.z);
    let lowest = tip.z - (RADIUS - CORNER) * sin - CORNER * (1.0 - cos);
    let text = Text::new(&shop).rapid([0.0, 10.0, 300.0]).rapid_tilted([0.0, 10.0, 30.0], lean);
    let text = text.line(&line(-GOUGE * scale - lowest).0).cut_tilted([0.0, 10.0, 60.0], lean);
    ran(&text, &shop.setup(), HEAD + 3)
}

/// 40 chords of an arc of 300 mm radius; its lowest corner is too low.
fn arc(scale: f64) -> Outcome {
    let shop = Shop::new();
    let mut text = Text::new(&shop).rapid([-20.0, 0.0, 300.0]).rapid([-20.0, 0.0, 20.0]);
    for x in -20..=20 {
        let x = f64::from(x);
        text = text.cut([x, 0.0, x * x / 600.0 - GOUGE * scale]);
    }
    ran(&text.cut([20.0, 0.0, 60.0]), &shop.setup(), HEAD + 3 + 20)
}

fn clamp(scale: f64) -> Outcome {
    let mut shop = Shop::new();
    shop.wall = MeshTree::new(&box_mesh([-20.0, -20.0, 0.0], [20.0, 20.0, 15.0]));
    let text = Text::new(&shop).rapid([-100.0, 0.0, 300.0]).rapid([-100.0, 0.0, 15.0 - GOUGE * scale]);
    let text = text.cut([0.0, 0.0, 15.0 - GOUGE * scale]).cut([0.0, 0.0, 60.0]);
    ran(&text, &shop.setup(), HEAD + 3)
}

/// 0.5 mm are to stay on it.
fn check(scale: f64) -> Outcome {
    let shop = Shop::new();
    let mut setup = shop.setup();
    (setup.obstacles[0].kind, setup.obstacles[0].allowance) = (ObstacleKind::Check, 0.5);
    let text = Text::new(&shop).rapid([0.0, 0.0, 300.0]).rapid([0.0, 0.0, 20.0]);
    let text = text.cut([0.0, 0.0, 0.5 - GOUGE * scale]).cut([0.0, 0.0, 60.0]);
    ran(&text, &setup, HEAD + 3)
}

/// The cutter is 12 mm high and reaches 3 mm under a lip; heights seen from above do not tell it
/// from a wall.
fn overhang(scale: f64) -> Outcome {
    let mut shop = Shop::new();
    shop.wall = MeshTree::new(&box_mesh([-100.0, 22.0, 30.0], [100.0, 90.0, 40.0]));
    let (low, high) = (10.0, 18.0 + GOUGE * scale);
    let text = Text::new(&shop).rapid([0.0, -60.0, 300.0]).rapid([0.0, -60.0, low]).cut([0.0, -2.0, low]);
    let text = text.cut([0.0, -2.0, high]).cut([0.0, -60.0, low]);
    ran(&text, &shop.setup(), HEAD + 4)
}
