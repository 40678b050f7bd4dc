//! Motions that axes cannot make, or should not be sent on.

use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::CuttingLawFile;
use facemill_virtual_machine::{FindingKind, ObstacleKind};

use super::pairs::{Outcome, Row, ran, row};
use crate::kit::{HEAD, Shop, Text};

pub(crate) fn rows() -> Vec<Row> {
    use FindingKind::{AxisLimit, AxisSpike, LinkRewind, RampTooSteep, ReachFailure, Rewind, Singularity};
    vec![
        row("linear axis beyond its limit", AxisLimit, |s| high(&format!("G0 X{:.4}", 2290.0 + 0.001 * s), "G0 X0.")),
        row("rotary axis beyond its limit", AxisLimit, |s| high(&format!("G0 B{:.4}", 110.0 + 0.001 * s), "G0 B0.")),
        row("feed that a rotary axis cannot follow", AxisSpike, |s| {
            high(&format!("G1 B40. F{:.1}", 3600.0 * (1.0 + 0.02 * s)), "")
        }),
        row("feed that a linear axis cannot follow", AxisSpike, |s| {
            high(&format!("G1 X400. F{:.1}", 15000.0 * (1.0 + 0.02 * s)), "")
        }),
        row("vector that leads to no such branch", ReachFailure, unreached),
        // Beside the pole by half a degree: the tool axis turns by a tenth of a degree.
        row("far turn near the pole", Singularity, |s| {
            cut_from("G0 B0.5", &format!("G1 C{:.3} F1000.", 10.0 * s + 0.1))
        }),
        row("pole that is near", Singularity, |s| cut_from(&format!("G0 B{:.4}", 1.0 / s), "G1 C30. F1000.")),
        row("more than half a turn in a cut", Rewind, |s| cut_from("G0 B20.", &format!("G1 C{:.3} F1000.", 180.0 * s))),
        row("more than half a turn between cuts", LinkRewind, |s| {
            let line = format!("G0 C{:.3}", 180.0 * s);
            let shop = Shop::new();
            let text = Text::new(&shop).line("G0 X0. Y0. Z1500. B20. C0.").line("G1 X10. F1000.").line(&line);
            ran(&text.line("G1 X20."), &shop.setup(), HEAD + 3)
        }),
        row("ramp into stock", RampTooSteep, |s| ramp(s, ObstacleKind::Part)),
    ]
}

/// A block high above everything, and what comes behind it.
fn high(line: &str, behind: &str) -> Outcome {
    let shop = Shop::new();
    let text = Text::new(&shop).line("G0 X0. Y0. Z2000. B0. C0.").line(line).line(behind);
    ran(&text, &shop.setup(), HEAD + 2)
}

/// A cut from where a rapid leads to.
fn cut_from(rapid: &str, cut: &str) -> Outcome {
    let shop = Shop::new();
    let text = Text::new(&shop).line("G0 X0. Y0. Z1500. B0. C0.").line(rapid).line(cut).line("G1 X5.");
    ran(&text, &shop.setup(), HEAD + 3)
}

/// The same direction of the tool, with the head on its other side; the twin stays on this one.
fn unreached(scale: f64) -> Outcome {
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    file.motion.cutting = CuttingLawFile::TipLinearVectorTurned;
    let shop = Shop::with_machine(Machine::from_file(file).unwrap());
    let end = if scale > 1.0 { "B-20. C180." } else { "B20. C0." };
    let text = Text::new(&shop).line("G0 B0. C0.").line("G0 G43.4 H7 X-80. Y0. Z900.").line("G0 B20.");
    ran(&text.line(&format!("G1 X10. {end} F500.")), &shop.setup(), HEAD + 4)
}

/// 3 degrees are allowed, and a tenth more is not reported.
fn ramp(scale: f64, kind: ObstacleKind) -> Outcome {
    let shop = Shop::new();
    let mut setup = shop.setup();
    (setup.obstacles[0].kind, setup.obstacles[0].stock) = (kind, 3.0);
    let way = 1.5 / (3.0 + 0.1 * scale).to_radians().tan();
    let text = Text::new(&shop).rapid([-100.0, 0.0, 300.0]).cut([-100.0, 0.0, 3.2]).cut([-100.0 + way, 0.0, 1.7]);
    ran(&text.cut([60.0, 0.0, 1.7]).cut([60.0, 0.0, 40.0]), &setup, HEAD + 3)
}
