use super::*;
use facemill_channel_pair::{ReadPair, read_siemens_pair};
use facemill_job::files::REJECTED;
use facemill_nc_program::dialect::PostFile;
use facemill_nc_program::{
    AxisLetter, AxisSpec, AxisWords, Block, Coolant, FeedMode, NcProgram, SpindleSpec, ToolSpec, WorkOffset,
};

const AXES: [&str; 9] = ["C", "X1", "Y1", "Z1", "B1", "X2", "Y2", "Z2", "B2"];

fn letter(k: usize) -> AxisLetter {
    AXES[k].parse().unwrap()
}

fn heads() -> Vec<HeadSpec> {
    let head = |n: u32| HeadSpec {
        name: format!("head {n}"),
        spindle_axis: format!("Z{n}").parse().unwrap(),
        spindle_number: n,
        tool: ToolSpec {
            number: n,
            name: "mill".to_owned(),
            radius: 25.0,
            corner_radius: 2.0,
            length: 160.0,
            length_register: n,
        },
        spindle: SpindleSpec { rpm: 900.0, clockwise: n == 1 },
    };
    vec![head(1), head(2)]
}

fn words(k: usize) -> AxisWords {
    // Every axis moves in every block, each by its own step.
    AxisWords::from_words((0..9).map(|a| (letter(a), (a as f64 + 1.0) * 0.125 * k as f64 - 3.5))).unwrap()
}

/// Feed in mm/min over all axes of a block that goes one step on.
const FEED: f64 = 421.7;

/// Two passes of so many blocks, a rapid and a comment before each.
fn spec(blocks: usize, work_offset: u16) -> ProgramSpec {
    let mut all = Vec::new();
    for pass in 0..2 {
        let from = pass * (blocks + 1);
        all.push(Block::Comment(format!("PASS {pass}")));
        all.push(Block::Rapid { words: words(from) });
        all.extend((1..=blocks).map(|k| Block::Linear { words: words(from + k), feed: FEED }));
    }
    let axis = |k: usize| AxisSpec {
        letter: letter(k),
        min: -1e3,
        max: 1e3,
        along_spindle: AXES[k].starts_with('Z'),
        work_offset: 0.0,
    };
    let first = heads().swap_remove(0);
    ProgramSpec {
        job_name: "both sides".to_owned(),
        tool: first.tool,
        spindle: first.spindle,
        coolant: Coolant::Flood,
        work_offset: WorkOffset::new(work_offset).unwrap(),
        axes: (0..9).map(axis).collect(),
        smallest_feed: 0.0,
        program: NcProgram { blocks: all },
        rapid: facemill_cl_data::RapidLaw::Linear,
        approach: None,
    }
}

fn post(feed_mode: FeedMode) -> PostSettings {
    PostFile { feed_mode, ..PostFile::default() }.settings(None).unwrap()
}

fn read(files: &[(String, Vec<u8>)]) -> ReadPair {
    let text = |k: usize| std::str::from_utf8(&files[k].1).unwrap();
    read_siemens_pair([text(0), text(1)]).unwrap()
}

/// One step goes an eighth of k mm or deg on the kth axis: the time of a block is the root of the
/// sum of squares over F.
#[test]
fn blocks_of_both_channels_take_the_time_of_the_program_in_one() {
    let step = 0.125 * (1..=9).map(|k| f64::from(k * k)).sum::<f64>().sqrt();
    for (mode, minutes) in [(FeedMode::G94, step / FEED), (FeedMode::G93, 1.0 / FEED)] {
        let found = read(&channel_files(&spec(3, 1), &heads(), &post(mode), "", "").unwrap());
        assert_eq!(found.blocks.len(), 8);
        for block in found.blocks.iter().filter(|b| !b.is_rapid) {
            // F has three decimals of 1/min, rounded down.
            let longest = 60.0 / (1.0 / minutes - 1e-3);
            for time in block.times {
                assert!(time >= 60.0 * minutes - 1e-9 && time <= longest + 1e-9, "{mode:?}: {time} for {minutes}");
            }
        }
    }
}

#[test]
fn channels_wait_around_passes_and_every_50_blocks() {
    let files = channel_files(&spec(120, 1), &heads(), &post(FeedMode::G94), "-top", REJECTED).unwrap();
    let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["program-top-channel-1.rejected.mpf", "program-top-channel-2.rejected.mpf"]);
    let found = read(&files);
    let marks: Vec<usize> = found.blocks.iter().map(|b| b.marks_before).collect();
    let rises: Vec<usize> = (1..marks.len()).filter(|&k| marks[k] > marks[k - 1]).collect();
    // The rapid of each pass is block 0 and 121.
    assert_eq!(rises, [1, 51, 101, 121, 122, 172, 222]);
}

#[test]
fn functions_without_a_word_on_840d_are_refused_by_name() {
    let refused = channel_files(&spec(1, 120), &heads(), &post(FeedMode::G94), "", "").unwrap_err().to_string();
    assert!(refused.contains("work_offset") && refused.contains("840D"), "{refused}");
    let refused = channel_files(&spec(1, 1), &heads(), &post(FeedMode::Rtcp), "", "").unwrap_err().to_string();
    assert!(refused.contains("channel programs for 840D: "), "{refused}");
}
