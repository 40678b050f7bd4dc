//! The cutter at rapid rate in obstacles on its way.

use facemill_interference::MeshTree;
use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::RapidLawFile;
use facemill_virtual_machine::{FindingKind, ObstacleKind};
use nalgebra::Isometry3;

use super::bodies::turned;
use super::pairs::{GOUGE, Outcome, Row, ran, row};
use crate::kit::{HEAD, Shop, Text, box_mesh};

pub(crate) fn rows() -> Vec<Row> {
    use FindingKind::RapidCollision;
    vec![
        row("rapid in the part", RapidCollision, |s| over(s, 0.0, ObstacleKind::Part, 0.0)),
        row("rapid in stock on the part", RapidCollision, |s| over(s, 3.0, ObstacleKind::Part, 0.0)),
        row("rapid in raw stock", RapidCollision, |s| over(s, 0.0, ObstacleKind::Stock, 15.0)),
        row("rapid through a clamp", RapidCollision, |s| over(s, 0.0, ObstacleKind::Fixture, 15.0)),
        row("rapid of which each axis goes by itself", RapidCollision, bent),
        row("axis that turns back through a clamp", RapidCollision, back_through_a_clamp),
    ]
}

/// Straight over the plate, with stock on it, or over a block of this height.
fn over(scale: f64, stock: f64, kind: ObstacleKind, block: f64) -> Outcome {
    let mut shop = Shop::new();
    shop.wall = MeshTree::new(&box_mesh([-20.0, -20.0, -5.0], [20.0, 20.0, if block > 0.0 { block } else { -1.0 }]));
    let mut setup = shop.setup();
    (setup.obstacles[0].stock, setup.obstacles[1].kind) = (stock, kind);
    let z = block + stock - GOUGE * scale;
    let text = Text::new(&shop).rapid([-260.0, 0.0, 300.0]).rapid([-260.0, 0.0, z]).rapid([0.0, 0.0, z]);
    ran(&text.rapid([0.0, 0.0, 100.0]), &setup, HEAD + 3)
}

/// The post is under the straight way, and in the bent one: Z has come down before X has gone half
/// its way.
fn bent(scale: f64) -> Outcome {
    let shop = |rapid: RapidLawFile| {
        let mut file = Machine::head_b_table_c().unwrap().to_file();
        file.motion.rapid = rapid;
        let mut shop = Shop::with_machine(Machine::from_file(file).unwrap());
        shop.table_from_work = Isometry3::translation(320.0, -110.0, 450.0);
        shop.wall = MeshTree::new(&box_mesh([-62.0, -10.0, -5.0], [-58.0, 10.0, 20.0 + GOUGE * scale]));
        shop
    };
    let run = |shop: &Shop| {
        let text = Text::new(shop).rapid([-150.0, 0.0, 300.0]).rapid([-150.0, 0.0, 100.0]);
        ran(&text.rapid([0.0, 0.0, 20.0]).rapid([0.0, 0.0, 300.0]), &shop.setup(), HEAD + 3)
    };
    let straight = run(&shop(RapidLawFile::Linear)).findings;
    assert!(straight.is_empty(), "{straight:#?}");
    run(&shop(RapidLawFile::PerAxis))
}

/// C turns by 200 degrees in one block while the cutter is low.
fn back_through_a_clamp(scale: f64) -> Outcome {
    let mut shop = Shop::new();
    let [way, _] = turned(&shop, 20.0, 100.0);
    let top = 20.0 + GOUGE * scale;
    shop.wall = MeshTree::new(&box_mesh([way.x - 3.0, way.y - 3.0, 0.0], [way.x + 3.0, way.y + 3.0, top]));
    let text = Text::new(&shop).rapid([0.0, 0.0, 300.0]).rapid([0.0, 0.0, 20.0]);
    ran(&text.line("G91 G0 C200.").line("G90 G0 Z2000."), &shop.setup(), HEAD + 3)
}
