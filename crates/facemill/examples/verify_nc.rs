//! A program that somebody else wrote, run on a virtual machine: where it gouges or collides, by
//! line.
//!
//! `cargo run -p facemill --example verify_nc`

use std::error::Error;

use facemill::cl_data::Silent;
use facemill::interference::MeshTree;
use facemill::inverse_kinematics::{Machine, preset};
use facemill::nc_program::{Dialect, MappedAxis, WordMap, WorkOffset, read_program};
use facemill::sample_parts::{PatchSpec, patch};
use facemill::tool_model::ToolAssembly;
use facemill::virtual_machine::{
    FindingKind, ObstacleKind, Verification, VerifySettings, VirtualObstacle, VirtualSetup, verify,
};
use nalgebra::Isometry3;

/// Two passes over the part, with a planted fault: the second pass is too low (line 10).
const PROGRAM: &str = "\
G21 G90 G94
T1 M6
G54 S1500 M3
G0 G43 X-120. Y0. Z150. B0. C0. H1
G0 Z2.1
G1 X100. F1200.
G0 Z20.
G0 X-120. Y20.
G1 Z1.7
G1 X100.
G0 Z150.
M30
";

fn main() -> Result<(), Box<dyn Error>> {
    // The part: a wavy patch of 120 mm whose crests are 2 mm above its middle.
    let mesh = patch(&PatchSpec::new([120.0, 120.0], 2.0, [1.2, 1.0])?, 40, 40)?;
    let tree = MeshTree::new(&mesh);
    let machine = Machine::from_json(preset("head-b-table-c").ok_or("no such preset")?.as_bytes())?;
    let tool = ToolAssembly::from_json(include_bytes!("tutorial/tool.json"))?;

    // How the control is set: the work offset G54 is where the part's frame is on the table.
    let table_from_work = Isometry3::translation(0.0, 0.0, 300.0);
    let axes = machine.axes().iter().map(|axis| {
        let is_z = axis.letter == "Z";
        let letter = axis.letter.as_str().parse().expect("letters of presets are addresses");
        MappedAxis { letter, offset: if is_z { 300.0 } else { 0.0 }, along_spindle: f64::from(u8::from(is_z)) }
    });
    let words = WordMap::new(axes.collect(), WorkOffset::default(), tool.gauge_length())?;
    let part =
        VirtualObstacle { name: "patch".to_owned(), mesh: &tree, kind: ObstacleKind::Part, allowance: 0.0, stock: 0.0 };
    let setup = VirtualSetup {
        machine: &machine,
        table_from_work,
        words: &words,
        table_from_rtcp_words: Some(table_from_work),
        tool: &tool,
        length_register: tool.length_register(),
        obstacles: vec![part],
    };

    let run = |text: &str| -> Result<Verification, Box<dyn Error>> {
        let program = read_program(text, Dialect::Fanuc)?;
        Ok(verify(&program, &setup, &VerifySettings::default(), &Silent)?)
    };
    let verification = run(PROGRAM)?;
    println!("{} positions of {} blocks tested", verification.n_positions, verification.n_blocks);
    verification.findings.iter().for_each(|finding| println!("{finding}"));
    let faults: Vec<_> = verification.faults().collect();
    assert_eq!(faults.len(), 1);
    assert_eq!((faults[0].kind, faults[0].first_line), (FindingKind::Gouge, 10));

    // The mended program has none.
    let mended = run(&PROGRAM.replace("Z1.7", "Z2.1"))?;
    assert_eq!(mended.faults().count(), 0);
    let nearest = mended.smallest_clearance.expect("the holder is somewhere");
    println!("mended: no fault, the nearest body keeps {:.3} mm", nearest.distance_mm);
    Ok(())
}
