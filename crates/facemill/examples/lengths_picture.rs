//! Makes the picture of the lengths of a tool assembly: `cargo run --release -p facemill --example
//! lengths_picture` writes `docs/pictures/lengths.svg`.
//!
//! A tool goes past two walls, one that the holder's lower section has to pass over and one that
//! only its upper one reaches. Its lengths are found as `facemill lengths` finds them, and the
//! assembly is drawn before and after.

use std::path::Path;

use facemill::cl_data::{RoundFrustum, Silent, Solid};
use facemill::files;
use facemill::interference::MeshTree;
use facemill::inverse_kinematics::Machine;
use facemill::nc_program::{Dialect, MappedAxis, WordMap, WorkOffset, read_program};
use facemill::surface_model::TriMesh;
use facemill::tool_model::{AssemblyLength, OpenAssembly, ToolAssembly};
use facemill::virtual_machine::{
    ClearLengths, LengthSettings, ObstacleKind, VerifySettings, VirtualObstacle, VirtualSetup, clear_lengths,
};
use nalgebra::{Isometry3, Point3};

#[expect(dead_code, reason = "the other pictures use more of it")]
#[path = "pictures/figure.rs"]
mod figure;

use figure::{BLUE, Figure, GRAY, INK, Mm, RED};

type Failed = Box<dyn std::error::Error>;

const TOOL: &str = r#"{
    "format": "facemill-tool/1", "name": "bull nose 24 r4", "number": 1, "radius_mm": 12, "corner_radius_mm": 4,
    "n_inserts": 3, "flute_length_mm": 20, "max_ramp_angle_deg": 3, "spindle_rotation": "clockwise",
    "stick_out_mm": 80, "gauge_length_mm": 200,
    "body": { "clearance_mm": 1, "sections": [{ "length_mm": 60, "diameter_low_mm": 20, "diameter_high_mm": 20 }] },
    "holder": { "clearance_mm": 2, "sections": [
        { "length_mm": 60, "diameter_low_mm": 36, "diameter_high_mm": 36 },
        { "length_mm": 60, "diameter_low_mm": 63, "diameter_high_mm": 63 }] }
}"#;

/// Both walls, x and z, mm; they are 80 mm long.
const WALLS: [[[f64; 2]; 2]; 2] = [[[15.0, 0.0], [22.0, 35.0]], [[26.0, 0.0], [40.0, 62.0]]];

/// Along the walls, 2 mm above the table.
const PROGRAM: &str =
    "G21 G90 G94 G49\nT1 M6\nS8000 M3\nG0 G43 X0. Y-60. Z300. B0. C0. H1\nG0 Z2.\nG1 Y60. F800.\nG0 Z300.\nM30\n";

fn main() -> Result<(), Failed> {
    let tool = ToolAssembly::from_json(TOOL.as_bytes())?;
    let found = lengths(&tool)?;
    for (length, mm) in AssemblyLength::ALL.into_iter().zip(found.lengths) {
        println!("{length:?} {mm:.2} {:?}", found.forced_by[length.index()].as_ref().map(|by| &by.block_text));
    }
    files::write_one(Path::new("docs/pictures/lengths.svg"), picture(&tool, &found).into_bytes())?;
    Ok(())
}

fn lengths(tool: &ToolAssembly) -> Result<ClearLengths, Failed> {
    let machine = Machine::head_b_table_c()?;
    let travel = machine.length_compensation_travel().ok_or("no axis along the spindle")?;
    let axis = |(k, a): (usize, &facemill::inverse_kinematics::Axis)| -> Result<MappedAxis, Failed> {
        Ok(MappedAxis { letter: a.letter.as_str().parse()?, offset: 0.0, along_spindle: travel.get_or_zero(k) })
    };
    let axes = machine.axes().iter().enumerate().map(axis).collect::<Result<_, _>>()?;
    let words = WordMap::new(axes, WorkOffset::default(), tool.gauge_length())?;
    let meshes = WALLS.iter().map(wall).collect::<Result<Vec<_>, Failed>>()?;
    let fixture = |mesh| VirtualObstacle {
        name: "wall".to_owned(),
        mesh,
        kind: ObstacleKind::Fixture,
        allowance: 0.0,
        stock: 0.0,
    };
    let setup = VirtualSetup {
        machine: &machine,
        table_from_work: Isometry3::identity(),
        words: &words,
        table_from_rtcp_words: None,
        tool,
        length_register: tool.number(),
        obstacles: meshes.iter().map(|mesh| fixture(mesh)).collect(),
    };
    let settings = LengthSettings { verify: VerifySettings::default(), margin: 0.5, longest: 500.0 };
    let program = read_program(PROGRAM, Dialect::Fanuc)?;
    Ok(clear_lengths(&program, &setup, &OpenAssembly::open(tool), None, &settings, &Silent)?)
}

fn wall([low, high]: &[[f64; 2]; 2]) -> Result<MeshTree, Failed> {
    let corner = |k: usize| {
        let at = |bit: usize, low: f64, high: f64| if k >> bit & 1 == 0 { low } else { high };
        Point3::new(at(0, low[0], high[0]), at(1, -40.0, 40.0), at(2, low[1], high[1]))
    };
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Ok(MeshTree::new(&TriMesh::new((0..8).map(corner).collect(), triangles)?))
}

/// Colours of walls, cutter, cutter body, lower and upper sections.
const WALL: &str = "#c9ced2";
const CUTTER: &str = "#e5b8a6";
const BODIES: [&str; 2] = ["#d4e0ea", "#b4cadb"];

/// Height of the tip above the table, mm.
const TIP: f64 = 2.0;

fn picture(tool: &ToolAssembly, found: &ClearLengths) -> String {
    let mut figure = Figure::new(760.0, 600.0, "Lengths of a tool assembly past two walls");
    figure.scale = [2.2, 2.2];
    for (k, (title, tool)) in [("as it is", tool), ("as short as it clears", &found.tool)].into_iter().enumerate() {
        figure.origin = [190.0 + 370.0 * k as f64, 570.0];
        for [low, high] in WALLS {
            figure.area(&rectangle([low[0], high[0]], [low[1], high[1]]), WALL);
        }
        let flute = tool.cutter().flute_length();
        figure.area(&rectangle([-12.0, 12.0], [TIP, TIP + flute]), CUTTER);
        for (body, color) in tool.collision_bodies().iter().zip(BODIES.into_iter().cycle()) {
            if let Solid::Frustum(f) = &body.solid {
                figure.area(&outline(f), color);
            }
        }
        figure.curve(&[[0.0, 0.0], [0.0, 222.0]], GRAY, 0.7, "6 3 1 3");
        figure.text([12.0, 212.0], [0.0, 0.0], [RED, BLUE][k], title);
        dimensions(&mut figure, &OpenAssembly::open(tool).lengths(), [RED, BLUE][k]);
    }
    for forced in found.forced_by.iter().flatten() {
        figure.dot([forced.place_work_mm[0], forced.place_work_mm[2]], INK);
    }
    figure.finish()
}

/// Lines to the left of the tool with the lengths on them.
fn dimensions(figure: &mut Figure, lengths: &[f64; 4], color: &str) {
    for (k, length) in lengths.iter().enumerate() {
        // The longest is next to the tool, so that no line crosses the text of another.
        let x = -52.0 + 6.0 * k as f64;
        figure.arrow([x, TIP], [x, TIP + length], color);
        figure.curve(&[[x, TIP + length], [0.0, TIP + length]], color, 0.5, "2 2");
        figure.text([x, TIP + length], [-64.0, 4.0], color, &format!("L{} {length:.1}", k + 1));
    }
}

fn rectangle([left, right]: Mm, [low, high]: Mm) -> [Mm; 4] {
    [[left, low], [right, low], [right, high], [left, high]]
}

fn outline(f: &RoundFrustum) -> [Mm; 4] {
    let (low, high) = (TIP + f.z_low, TIP + f.z_high);
    [[-f.radius_low, low], [f.radius_low, low], [f.radius_high, high], [-f.radius_high, high]]
}
