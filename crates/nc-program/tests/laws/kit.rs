//! Programs for the tests: seeded, with values that sit on rounding borders and repeat often.

use facemill_nc_program::dialect::PostFile;
use facemill_nc_program::read::{AxisAt, ReadMotion};
use facemill_nc_program::{
    AxisLetter, AxisSpec, AxisWords, Block, Coolant, FeedMode, NcProgram, PostSettings, ProgramSpec, SpindleSpec,
    ToolSpec, WorkOffset,
};

pub(crate) use facemill_test_kit::Random;

/// Axes of the sample machine, in its order.
pub(crate) const AXES: [AxisLetter; 5] = [AxisLetter::X, AxisLetter::Y, AxisLetter::Z, AxisLetter::B, AxisLetter::C];

pub(crate) fn words(values: &[(AxisLetter, f64)]) -> AxisWords {
    AxisWords::from_words(values.iter().copied()).unwrap()
}

pub(crate) fn settings(feed_mode: FeedMode) -> PostSettings {
    PostFile { feed_mode, ..post_file() }.settings(None).unwrap()
}

pub(crate) fn post_file() -> PostFile {
    facemill_file_format::from_json(br#"{"dialect": "fanuc"}"#).unwrap()
}

pub(crate) fn spec(blocks: Vec<Block>) -> ProgramSpec {
    let limits = [(-100.0, 2000.0), (-900.0, 900.0), (0.0, 1500.0), (-30.0, 110.0), (f64::NEG_INFINITY, f64::INFINITY)];
    let offsets = [0.0, -2.5, 100.0, 0.0, 45.0];
    let axes = AXES.iter().zip(limits).zip(offsets).map(|((&letter, (min, max)), work_offset)| AxisSpec {
        letter,
        min,
        max,
        along_spindle: letter == AxisLetter::Z,
        work_offset,
    });
    ProgramSpec {
        job_name: "Propeller (Prüfung)".to_owned(),
        tool: ToolSpec {
            number: 7,
            name: "face mill D160 r6".to_owned(),
            radius: 80.0,
            corner_radius: 6.0,
            length: 420.0,
            length_register: 7,
        },
        spindle: SpindleSpec { rpm: 350.4, clockwise: true },
        coolant: Coolant::Flood,
        work_offset: WorkOffset::default(),
        axes: axes.collect(),
        smallest_feed: 0.0,
        program: NcProgram { blocks },
        rapid: facemill_cl_data::RapidLaw::Linear,
        approach: Some(words(&[
            (AxisLetter::X, 11.0),
            (AxisLetter::Y, 12.0),
            (AxisLetter::Z, 13.0),
            (AxisLetter::B, 14.0),
            (AxisLetter::C, 15.0),
        ])),
    }
}

/// A rapid that names every axis, then `n` motions, each of which names some and changes some.
pub(crate) fn random_blocks(random: &mut Random, n: usize) -> Vec<Block> {
    let mut position: Vec<(AxisLetter, f64)> = AXES.iter().map(|l| (*l, random.coordinate())).collect();
    let mut blocks = vec![Block::Rapid { words: words(&position) }];
    for _ in 0..n {
        for word in &mut position {
            if random.below(3) == 0 {
                word.1 = random.coordinate();
            }
        }
        let named: Vec<_> = position.iter().copied().filter(|_| random.below(4) > 0).collect();
        if named.is_empty() {
            blocks.push(Block::Comment("nothing".to_owned()));
        } else if random.below(5) == 0 {
            blocks.push(Block::Rapid { words: words(&named) });
        } else {
            let feed = [100.0, 250.0, 0.06, 12345.67, 1.0 + random.unit() * 3000.0][random.below(5)];
            blocks.push(Block::Linear { words: words(&named), feed });
        }
    }
    blocks
}

/// Where an axis is at the end of a motion.
pub(crate) fn at(motion: &ReadMotion, axis: &str) -> Option<AxisAt> {
    motion.position.get(axis.parse().unwrap())
}

/// At a word.
pub(crate) fn word(value: f64) -> Option<AxisAt> {
    Some(AxisAt::Word(value))
}
