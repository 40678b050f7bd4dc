//! Programs with passes for every control.

use facemill_cl_data::{ControlTolerance, CuttingLaw, MotionLaw, RapidLaw};
use facemill_nc_program::dialect::{PostFile, SubprogramPart, SubprogramPlace, SubprogramsFile};
use facemill_nc_program::{
    AxisLetter, AxisSpec, AxisWords, Block, Coolant, Dialect, FeedMode, NcProgram, PostSettings, ProgramSpec,
    SpindleSpec, ToolSpec, WorkOffset, write_program,
};
use facemill_test_kit::Random;

const LETTERS: [AxisLetter; 5] = [AxisLetter::X, AxisLetter::Y, AxisLetter::Z, AxisLetter::A, AxisLetter::C];

/// Settings of a control with subprograms; `None` where it has none in this place.
pub(crate) fn settings(dialect: Dialect, place: SubprogramPlace) -> Option<PostSettings> {
    let feed_mode = if dialect == Dialect::LinuxCnc { FeedMode::G93 } else { FeedMode::G94 };
    let subprograms = Some(SubprogramsFile { per: SubprogramPart::Pass, place, first_number: None });
    let post = PostFile { dialect, feed_mode, subprograms, ..PostFile::default() }.settings(None).ok()?;
    let law = MotionLaw {
        cutting: CuttingLaw::TipAndRotariesLinear,
        rapid: RapidLaw::Linear,
        control_tolerance: ControlTolerance { path: 0.01, orientation: 0.001 },
    };
    let home = AxisWords::from_words(LETTERS.into_iter().zip([0.0, 0.0, 500.0, 0.0, 0.0])).expect("five axes");
    Some(post.on_machine(law, home).expect("a machine of this control"))
}

/// A program of three operations with passes of random cuts, as the planner comments them.
pub(crate) fn program(random: &mut Random, settings: &PostSettings) -> String {
    let letters = LETTERS;
    let axis =
        |letter| AxisSpec { letter, min: -900.0, max: 900.0, along_spindle: letter == AxisLetter::Z, work_offset: 0.0 };
    let mut at = [0.0; 5];
    let mut blocks = Vec::new();
    for operation in 0..3 {
        // A name that takes more than one line.
        blocks.push(Block::Comment(format!("operation {operation} {}", "of a long name ".repeat(12))));
        for pass in 0..3 {
            blocks.push(Block::Comment(format!("PASS {} PLACE 1", pass + 1)));
            for k in 0..random.below(5) + 2 {
                // Words that stay are left out, so that passes depend on what came before.
                for value in &mut at {
                    if blocks.len() < 4 || random.below(2) == 0 {
                        *value = (random.between(-50.0, 50.0) * 1e3).round() / 1e3;
                    }
                }
                let words = AxisWords::from_words(letters.into_iter().zip(at)).expect("five axes");
                blocks.push(if k == 0 || random.below(4) == 0 {
                    Block::Rapid { words }
                } else {
                    Block::Linear { words, feed: [100.0, 250.0][random.below(2)] }
                });
            }
        }
        if operation == 0 {
            blocks.push(Block::SpindleOn { rpm: 500.0, clockwise: true, spindle: None });
        }
    }
    let spec = ProgramSpec {
        job_name: "part".to_owned(),
        tool: ToolSpec {
            number: 7,
            name: "mill".to_owned(),
            radius: 20.0,
            corner_radius: 2.0,
            length: 120.0,
            length_register: 7,
        },
        spindle: SpindleSpec { rpm: 800.0, clockwise: true },
        coolant: Coolant::Flood,
        work_offset: WorkOffset::default(),
        axes: letters.map(axis).to_vec(),
        smallest_feed: 0.01,
        program: NcProgram { blocks },
        rapid: RapidLaw::Linear,
        approach: None,
    };
    write_program(&spec, settings).expect("a program")
}
