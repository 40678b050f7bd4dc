//! Bodies of tool and machine at part, stock, fixture and each other.

use facemill_cl_data::{PlacedSolid, RoundFrustum, Silent, Solid};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::{BodyFile, ShapeFile};
use facemill_nc_program::read::{ReadBlock, read_fanuc};
use facemill_tool_model::ToolAssembly;
use facemill_virtual_machine::verify;
use facemill_virtual_machine::{FindingKind, ObstacleKind, VerifySettings, VirtualSetup};
use nalgebra::{Isometry3, Point3};

use super::pairs::{Outcome, Row, SLACK, ran, ran_with, row};
use crate::kit::{CUTTER, HEAD, RADIUS, Shop, Text, box_mesh, dual};

pub(crate) fn rows() -> Vec<Row> {
    use FindingKind::{Collision, Gouge, HolderCollision, NearMiss, RapidCollision};
    vec![
        row("shank under a lip of the part", HolderCollision, |s| shank(s, ObstacleKind::Part, 0.0)),
        row("shank under a lip with stock", HolderCollision, |s| shank(s, ObstacleKind::Part, 3.0)),
        row("shank under a lip of a fixture", HolderCollision, |s| shank(s, ObstacleKind::Fixture, 0.0)),
        row("shank under a lip of raw stock", HolderCollision, |s| shank(s, ObstacleKind::Stock, 0.0)),
        row("holder at a wall of the part, one block", HolderCollision, |s| holder(s, ObstacleKind::Part, 0.0)),
        row("holder at a wall with stock", HolderCollision, |s| holder(s, ObstacleKind::Part, 3.0)),
        row("holder at a fixture", HolderCollision, |s| holder(s, ObstacleKind::Fixture, 0.0)),
        row("first section of the holder", HolderCollision, |s| section(s, 0)),
        row("second section of the holder", HolderCollision, |s| section(s, 1)),
        row("third section of the holder", HolderCollision, |s| section(s, 2)),
        row("spindle nose at the part", Collision, |s| nose(s, ObstacleKind::Part, 0.0)),
        row("spindle nose at stock", Collision, |s| nose(s, ObstacleKind::Part, 3.0)),
        row("spindle nose at a fixture", Collision, |s| nose(s, ObstacleKind::Fixture, 0.0)),
        row("head at the part", Collision, |s| head(s, ObstacleKind::Part, 0.0)),
        row("head at stock", Collision, |s| head(s, ObstacleKind::Part, 3.0)),
        row("head at a fixture", Collision, |s| head(s, ObstacleKind::Fixture, 0.0)),
        row("head at the bed", Collision, head_at_the_bed),
        row("cutter at the bed in a feed", Collision, |s| cutter_at_the_bed(s, false)),
        row("cutter at the bed in a rapid", RapidCollision, |s| cutter_at_the_bed(s, true)),
        row("turning table brings a post to the holder", HolderCollision, post_on_the_table),
        row("thin post between positions that lie far apart", HolderCollision, thin_post),
        row("near miss", NearMiss, near_miss),
        row("second head at the part", Gouge, second_head_at_the_part),
        row("tools of two heads", Collision, tools_of_two_heads),
    ]
}

/// The shank, of radius 22 and clearance 1, beside the edge of a lip that the cutter reaches under.
fn shank(scale: f64, kind: ObstacleKind, stock: f64) -> Outcome {
    let mut shop = Shop::new();
    let edge = 60.0 + stock;
    shop.wall = MeshTree::new(&box_mesh([-100.0, edge, 30.0], [100.0, edge + 40.0, 40.0]));
    let mut setup = shop.setup();
    (setup.obstacles[1].kind, setup.obstacles[1].stock) = (kind, stock);
    let y = 60.0 - 22.0 - (1.0 - SLACK * scale);
    let text = Text::new(&shop).rapid([-160.0, 0.0, 300.0]).rapid([-160.0, 0.0, 1.0]).cut([0.0, 0.0, 1.0]);
    ran(&text.cut([0.0, y, 1.0]).cut([0.0, -30.0, 1.0]), &setup, HEAD + 4)
}

/// The holder's lower end, 60 above the tip and with a clearance of 2, over a wall.
fn holder(scale: f64, kind: ObstacleKind, stock: f64) -> Outcome {
    let shop = Shop::new();
    let mut setup = shop.setup();
    (setup.obstacles[1].kind, setup.obstacles[1].stock) = (kind, stock);
    let text = Text::new(&shop).rapid([115.0, 0.0, 300.0]).rapid([115.0, 0.0, 20.0]);
    ran(&text.cut([115.0, 0.0, stock + 2.0 - SLACK * scale]).cut([115.0, 0.0, 40.0]), &setup, HEAD + 3)
}

/// A holder of three sections of 20 mm, each 10 mm wider than the one below, at a lip that is as
/// high as one of them.
fn section(scale: f64, k: usize) -> Outcome {
    let sections: Vec<String> = [60, 80, 100]
        .map(|d| format!(r#"{{ "length_mm": 20, "diameter_low_mm": {d}, "diameter_high_mm": {d} }}"#))
        .to_vec();
    let file = format!(
        r#"{{ "format": "facemill-tool/1", "name": "mill 50 r4", "number": 7, "radius_mm": 25, "corner_radius_mm": 4,
            "n_inserts": 4, "flute_length_mm": 12, "max_ramp_angle_deg": 3, "spindle_rotation": "clockwise",
            "stick_out_mm": 60, "gauge_length_mm": 120,
            "body": {{ "clearance_mm": 1, "sections": [
                {{ "length_mm": 48, "diameter_low_mm": 44, "diameter_high_mm": 44 }} ] }},
            "holder": {{ "clearance_mm": 2, "sections": [{}] }} }}"#,
        sections.join(", ")
    );
    let tool = ToolAssembly::from_json(file.as_bytes()).unwrap();
    let mut shop = Shop::new();
    let edge = 30.0 + 10.0 * k as f64 + 2.0 - SLACK * scale;
    let low = 1.0 + 60.0 + 20.0 * k as f64 + 9.0;
    shop.wall = MeshTree::new(&box_mesh([-100.0, edge, low], [100.0, edge + 100.0, low + 2.0]));
    let setup = VirtualSetup { tool: &tool, ..shop.setup() };
    let text = Text::new(&shop).rapid([0.0, -90.0, 300.0]).rapid([0.0, -90.0, 1.0]).cut([0.0, 0.0, 1.0]);
    let mut outcome = ran(&text.cut([0.0, -90.0, 1.0]), &setup, HEAD + 3);
    let expected = format!("holder section {}", k + 1);
    outcome.findings.retain(|f| f.body.as_ref() == Some(&expected) || !f.kind.is_fault() || panic!("{f}"));
    outcome
}

/// Over a post beside the holder, at this height above the tip and with this clearance.
fn over_a_post(post: ([f64; 2], f64), clearance: f64, scale: f64, kind: ObstacleKind, stock: f64) -> Outcome {
    let ([near, far], height) = post;
    let mut shop = Shop::new();
    let top = 300.0 + height - clearance + SLACK * scale - stock;
    shop.wall = MeshTree::new(&box_mesh([-20.0, near, -10.0], [20.0, far, top]));
    let mut setup = shop.setup();
    (setup.obstacles[1].kind, setup.obstacles[1].stock) = (kind, stock);
    let text = Text::new(&shop).rapid([0.0, -200.0, 700.0]).rapid([0.0, -200.0, 300.0]).cut([0.0, 0.0, 300.0]);
    ran(&text.cut([0.0, -200.0, 300.0]), &setup, HEAD + 3)
}

/// The nose, of radius 90, is 120 above the tip and keeps 5.
fn nose(scale: f64, kind: ObstacleKind, stock: f64) -> Outcome {
    over_a_post(([60.0, 80.0], 120.0), 5.0, scale, kind, stock)
}

/// The head, 300 wide, is 370 above the tip and keeps 10.
fn head(scale: f64, kind: ObstacleKind, stock: f64) -> Outcome {
    over_a_post(([115.0, 130.0], 370.0), 10.0, scale, kind, stock)
}

/// The preset with a post on its bed beside the plate's middle, so high above the plate; it
/// keeps 5.
fn with_post(top: f64) -> Shop {
    let foot = Shop::new().table_from_work * Point3::new(0.0, 180.0, 0.0);
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    file.bed_bodies = vec![BodyFile {
        name: "post".to_owned(),
        shape: ShapeFile::Cylinder { radius_mm: 60.0, height_mm: 600.0 },
        position_mm: [foot.x, foot.y, foot.z + top - 600.0],
        rotation_xyz_deg: [0.0; 3],
        clearance_mm: 5.0,
    }];
    Shop::with_machine(Machine::from_file(file).unwrap())
}

fn head_at_the_bed(scale: f64) -> Outcome {
    let shop = with_post(670.0 - 15.0 + SLACK * scale);
    let setup = VirtualSetup { obstacles: Vec::new(), ..shop.setup() };
    let text = Text::new(&shop).rapid([0.0, -250.0, 300.0]).cut([0.0, 0.0, 300.0]).cut([0.0, -250.0, 300.0]);
    ran(&text, &setup, HEAD + 2)
}

fn cutter_at_the_bed(scale: f64, is_rapid: bool) -> Outcome {
    let shop = with_post(700.0);
    let setup = VirtualSetup { obstacles: Vec::new(), ..shop.setup() };
    let (above, near) = ([0.0, 180.0, 1000.0], [0.0, 180.0, 705.0 - SLACK * scale]);
    let start = Text::new(&shop).rapid(above);
    let text = if is_rapid { start.rapid(near).rapid(above) } else { start.cut(near).cut(above) };
    ran(&text, &setup, HEAD + 2)
}

/// Where the tool is on the work when C alone is turned, and the middle of that circle.
pub(crate) fn turned(shop: &Shop, z: f64, degrees: f64) -> [Point3<f64>; 2] {
    let mut q = shop.axes_at([0.0, 0.0, z], [0.0, 0.0, 1.0]);
    q[4] += degrees.to_radians();
    let work_from_table = shop.table_from_work.inverse();
    [work_from_table * shop.machine.cl_point(&q, shop.tool.gauge_length()).tip, work_from_table * Point3::origin()]
}

/// The tool stands still, and a post beside the way of its axis over the table passes under the
/// holder.
fn post_on_the_table(scale: f64) -> Outcome {
    let mut shop = Shop::new();
    let [way, middle] = turned(&shop, 20.0, 40.0);
    let beside = way + (way - middle).xy().normalize().push(0.0) * 33.0;
    let (x, y, top) = (beside.x, beside.y, 20.0 + 60.0 - 2.0 + SLACK * scale);
    shop.wall = MeshTree::new(&box_mesh([x - 2.0, y - 2.0, 0.0], [x + 2.0, y + 2.0, top]));
    let word = shop.words.words(shop.axes_at([0.0, 0.0, 20.0], [0.0, 0.0, 1.0]).as_slice()).unwrap();
    let c = word.iter().find(|w| w.letter.letter() == 'C').unwrap().value;
    let text = Text::new(&shop).rapid([0.0, 0.0, 300.0]).rapid([0.0, 0.0, 20.0]).line(&format!("G0 C{:.4}", c + 80.0));
    ran(&text, &shop.setup(), HEAD + 3)
}

/// A post 0.2 mm thick beside the middle of a long block. Positions are 500 mm apart; bodies are
/// followed all the same, to within 0.05 mm.
fn thin_post(scale: f64) -> Outcome {
    let mut shop = Shop::new();
    let between = VerifySettings::default().between;
    let into = if scale > 1.0 { SLACK + between * scale } else { SLACK * scale };
    let y = 40.0 + 2.0 - into;
    shop.wall = MeshTree::new(&box_mesh([-0.1, y, 105.0], [0.1, y + 0.2, 150.0]));
    let text = Text::new(&shop).rapid([-300.0, 0.0, 300.0]).rapid([-300.0, 0.0, 40.0]).cut([300.0, 0.0, 40.0]);
    let settings = VerifySettings { max_step: 500.0, max_turn: 1.0, ..VerifySettings::default() };
    ran_with(&text.text, &shop.setup(), &settings, HEAD + 3)
}

/// Inside the clearance by less than its slack, and just outside of it.
fn near_miss(scale: f64) -> Outcome {
    let shop = Shop::new();
    let text = Text::new(&shop).rapid([115.0, 0.0, 300.0]).rapid([115.0, 0.0, 20.0]);
    let text = text.cut([115.0, 0.0, 2.0 - 0.1 * (scale - 1.0)]).cut([115.0, 0.0, 40.0]);
    let outcome = ran(&text, &shop.setup(), HEAD + 3);
    assert!(outcome.findings.iter().all(|f| f.measure.is_some_and(|m| (m.value() - 1.99).abs() < 1e-3)));
    outcome
}

/// Line of the n-th feed move of a program of two heads.
pub(crate) fn feed_line(text: &str, n: usize) -> u32 {
    let program = read_fanuc(text).unwrap();
    let is_feed = |b: &&ReadBlock| b.motion.as_ref().is_some_and(|m| !m.kind.is_rapid());
    program.blocks.iter().filter(is_feed).nth(n).unwrap().line
}

fn second_head_at_the_part(scale: f64) -> Outcome {
    let shop = dual::Shop::new();
    let front = |y: f64, above: f64| Some([400.0, y, dual::FACES[0] + above]);
    let back = |y: f64, above: f64| Some([400.0, y, dual::FACES[1] - above]);
    let text = dual::Program::new(&shop)
        .rapid(0.1, [front(190.0, 40.0), back(-190.0, 40.0)])
        .cut(0.1, [front(190.0, 0.1), back(-190.0, 0.1)], 2.0)
        .cut(0.1, [front(50.0, 0.1), back(-60.0, -super::pairs::GOUGE * scale)], 6.0)
        .cut(0.1, [front(50.0, 40.0), back(-60.0, 40.0)], 2.0)
        .text();
    Outcome { findings: shop.verify(&text, 1).findings, line: feed_line(&text, 1) }
}

/// The cutters pass each other face to face, a tenth of a mm into each other and as much apart.
fn tools_of_two_heads(scale: f64) -> Outcome {
    let shop = dual::Shop::new();
    let cutter =
        RoundFrustum { z_low: 0.0, z_high: CUTTER.height, radius_low: RADIUS, radius_high: RADIUS, rounding: 0.0 };
    let cutter = PlacedSolid {
        name: "other cutter".into(),
        solid: Solid::Frustum(cutter),
        frame_from_solid: Isometry3::identity(),
    };
    let other = [vec![cutter], shop.tools[1].collision_bodies()].concat();
    let view = shop.views[0].with_tool_in_other_head(&other, dual::LENGTHS[1]);
    let gap = 1.0 - scale;
    let at = |side: f64, away: f64| {
        [
            Some([400.0 - 130.0 * side, 400.0, 150.0 + gap / 2.0 + away]),
            Some([400.0 + 130.0 * side, 400.0, 150.0 - gap / 2.0 - away]),
        ]
    };
    let text = dual::Program::new(&shop)
        .rapid(0.1, at(1.0, 200.0))
        .rapid(0.1, at(1.0, 0.0))
        .cut(0.1, at(-1.0, 0.0), 3.0)
        .rapid(0.1, at(-1.0, 200.0))
        .text();
    let program = read_fanuc(&text).unwrap();
    let setup = VirtualSetup { machine: &view, ..shop.setup(0) };
    let findings = verify(&program, &setup, &VerifySettings::default(), &Silent).unwrap().findings;
    Outcome { findings, line: feed_line(&text, 0) }
}
