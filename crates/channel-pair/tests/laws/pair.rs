//! Laws of the two channel programs for Siemens 840D, writer and reader together.

use crate::head_kit::{axis, heads, letters, map, nine_axis_spec, random_joints, words_of};
use crate::kit::Random;
use facemill_channel_pair::*;
use facemill_nc_program::*;

/// Rapids, comments and cuts; the feeds are those of G93 in whichever mode they are written.
fn random_blocks(random: &mut Random, n: usize) -> Vec<Block> {
    let map = map();
    let joints = random_joints(random, n);
    let block = |(k, q): (usize, &Vec<f64>)| {
        let words = map.words(q).unwrap();
        let kind = if k == 0 { 0 } else { random.below(12) };
        let mut named = AxisWords::new();
        // Words are optional but for those that a first block must have.
        for word in words.iter().filter(|_| k == 0 || random.below(5) > 0) {
            named.set(word.letter, word.value).unwrap();
        }
        match kind {
            0 => Block::Rapid { words: named },
            1 => Block::Comment(format!("pass {k}")),
            _ => Block::Linear { words: named, feed: 3.0 + random.unit() * 500.0 },
        }
    };
    joints.iter().enumerate().map(block).collect()
}

fn settings(feed: SiemensFeed, blocks_per_mark: u32) -> SiemensSettings {
    SiemensSettings { feed, blocks_per_mark, ..SiemensSettings::default() }
}

fn write(blocks: Vec<Block>, settings: &SiemensSettings) -> Result<[String; 2], WriteError> {
    write_siemens_pair(&nine_axis_spec(blocks), &heads(), settings).map(|pair| pair.channels)
}

fn read(texts: &[String; 2]) -> Result<ReadPair, SiemensReadError> {
    read_siemens_pair([&texts[0], &texts[1]])
}

/// Rounds words as they are written: to nearest, halves away from zero.
fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// For each motion: whether it is a rapid, the positions of all axes at its end, and its feed.
fn motions(blocks: &[Block]) -> Vec<(bool, AxisWords, f64)> {
    let mut at = AxisWords::new();
    let mut all = Vec::new();
    for block in blocks {
        let (Block::Rapid { words } | Block::Linear { words, .. }) = block else { continue };
        words.iter().for_each(|w| at.set(w.letter, rounded(w.value)).unwrap());
        let feed = if let Block::Linear { feed, .. } = block { *feed } else { 0.0 };
        all.push((matches!(block, Block::Rapid { .. }), at, feed));
    }
    all
}

fn way(from: &AxisWords, to: &AxisWords, is_in: impl Fn(AxisLetter) -> bool) -> f64 {
    let ways = to.iter().filter(|w| is_in(w.letter)).map(|w| w.value - from.get(w.letter).unwrap());
    ways.map(|w| w * w).sum::<f64>().sqrt()
}

#[test]
fn every_block_is_recovered_and_takes_the_same_time_in_both_channels() {
    let mut random = Random(21);
    for round in 0..60 {
        let blocks = random_blocks(&mut random, 40);
        let feed = [SiemensFeed::G93, SiemensFeed::G94][round % 2];
        let texts = write(blocks.clone(), &settings(feed, 1 + random.below(9) as u32)).unwrap();
        let pair = read(&texts).unwrap_or_else(|e| panic!("{e}\n{}\n{}", texts[0], texts[1]));
        assert_eq!(pair.tool_lengths.map(f64::to_bits), [0, 1].map(|k| rounded(heads()[k].tool.length).to_bits()));
        let motions = motions(&blocks);
        assert_eq!(pair.blocks.len(), motions.len());
        let mut before = motions[0].1;
        for (found, (is_rapid, words, feed)) in pair.blocks.iter().zip(motions) {
            assert_eq!((found.is_rapid, found.words), (is_rapid, words));
            if !is_rapid {
                let [a, b] = found.times;
                // Half a unit of the last decimal of the times, by which each of them may be off.
                let queried = 60.0 / feed;
                match settings_feed(&texts) {
                    SiemensFeed::G93 => {
                        assert!((a - b).abs() <= 1e-6, "{a} {b}");
                        assert!(a >= queried - 1e-6 && a <= 60.0 / (feed - 1.001e-3) + 1e-6, "{a} {queried}");
                    }
                    SiemensFeed::G94 => {
                        for (time, number) in [(a, 1), (b, 2)] {
                            let own = |l: AxisLetter| l.number() == number || number == 1 && l.number() == 0;
                            let length = way(&before, &words, own);
                            // Rounded down to a tenth of a mm/min.
                            let f = length * feed;
                            let least = queried - 1e-6;
                            let most = if f > 0.2 { 60.0 * length / (f - 0.1001) } else { f64::INFINITY };
                            assert!(f <= 0.2 || time >= least && time <= most + 1e-6, "{time} {queried} {f}");
                        }
                    }
                }
            }
            before = words;
        }
    }
}

fn settings_feed(texts: &[String; 2]) -> SiemensFeed {
    if texts[0].contains("FGROUP") { SiemensFeed::G94 } else { SiemensFeed::G93 }
}

/// Marks are where the channels must be together, in the same order in both, and never farther
/// apart than requested.
#[test]
fn marks_stand_around_rapids_and_passes_and_after_every_kth_block() {
    let mut random = Random(22);
    for round in 0..40 {
        let k = 1 + random.below(7);
        let last_mark = [2, 9, 99][round % 3];
        let blocks = random_blocks(&mut random, 50);
        let settings = SiemensSettings { last_mark, ..settings(SiemensFeed::G93, k as u32) };
        let texts = write(blocks.clone(), &settings).unwrap();
        let pair = read(&texts).unwrap();
        for (n, mark) in pair.marks.iter().enumerate() {
            assert_eq!(*mark, n as u32 % last_mark + 1);
        }
        for text in &texts {
            assert_eq!(text.lines().filter(|l| l.contains("WAITM(")).count(), pair.marks.len());
        }
        let mut in_row = 0;
        for pair in pair.blocks.windows(2) {
            let is_marked = pair[1].marks_before > pair[0].marks_before;
            assert!(is_marked || !pair[0].is_rapid && !pair[1].is_rapid);
            in_row = if is_marked { 0 } else { in_row + 1 };
            assert!(in_row < k, "{in_row} blocks without a mark");
        }
        // A comment begins a pass.
        let mut index = 0;
        for two in blocks.windows(2) {
            index += usize::from(!matches!(two[0], Block::Comment(_)));
            if matches!(two[1], Block::Comment(_)) && index < pair.blocks.len() && index > 0 {
                assert!(pair.blocks[index].marks_before > pair.blocks[index - 1].marks_before);
            }
        }
        // One after the last block, and two of the way home.
        assert_eq!(pair.marks.len(), pair.blocks.last().unwrap().marks_before + 3);
    }
}

#[test]
fn a_program_in_g94_is_timed_by_the_norm_over_all_nine_axes() {
    let start: Vec<(&str, f64)> =
        ["C", "X1", "Y1", "Z1", "B1", "X2", "Y2", "Z2", "B2"].into_iter().map(|name| (name, 0.0)).collect();
    let cut = |values: &[(&str, f64)], feed| Block::Linear { words: words_of(values), feed };
    let blocks = vec![
        Block::Rapid { words: words_of(&start) },
        cut(&[("X1", 3.0), ("B2", 4.0)], 100.0),
        cut(&[("Y2", 6.0)], 120.0),
        cut(&[("C", 1.5)], 30.0),
        cut(&[("C", 1.5)], 30.0),
    ];
    let settings = SiemensSettings { program_feed: FeedMode::G94, ..settings(SiemensFeed::G93, 10) };
    let texts = write(blocks, &settings).unwrap();
    let times: Vec<f64> = read(&texts).unwrap().blocks.iter().map(|b| b.times[0]).collect();
    assert_eq!(times, [0.0, 3.0, 3.0, 3.0, 0.0]);
    for (text, lines) in
        texts.iter().zip([["G1 X1=3. F20.", "G4 F3.", "G1 C1.5 F20."], ["G1 B2=4. F20.", "G1 Y2=6. F20.", "G4 F3."]])
    {
        for line in lines {
            assert!(text.lines().any(|l| l.ends_with(&format!(" {line}"))), "{line} in\n{text}");
        }
    }
}

#[test]
fn each_channel_has_the_words_of_its_head_and_says_that_it_is_an_estimate() {
    let texts = write(random_blocks(&mut Random(23), 20), &settings(SiemensFeed::G93, 5)).unwrap();
    for (k, text) in texts.iter().enumerate() {
        let head = text.lines().take_while(|l| l.starts_with(';')).collect::<String>();
        assert!(head.contains("ESTIMATE") && head.contains("WAIT MARKS") && head.contains("UNLESS C IS COUPLED"));
        for letter in letters() {
            let is_own = letter.number() as usize == k + 1 || k == 0 && letter.number() == 0;
            let word = if letter.number() > 0 { format!("{letter}=") } else { letter.to_string() };
            let is_there = text.lines().any(|l| l.contains("G0 ") && l.contains(&format!(" {word}")));
            assert_eq!(is_there, is_own, "{letter} in channel {}", k + 1);
        }
        assert!(text.contains(["T7 M6", "T12 M6"][k]) && text.contains(["S350 M3", "S512 M4"][k]));
        assert!(text.ends_with("M30\n") && text.is_ascii());
    }
}

/// The reader refuses every line that is left out, doubled or changed, except in comments and free
/// numbers.
#[test]
fn nothing_but_what_the_writer_writes_is_read() {
    let texts = write(random_blocks(&mut Random(24), 12), &settings(SiemensFeed::G94, 4)).unwrap();
    assert!(read(&texts).is_ok());
    for channel in 0..2 {
        let lines: Vec<&str> = texts[channel].lines().collect();
        let body = lines.iter().position(|l| l.ends_with(" M8")).unwrap();
        let with = |k: usize, new: &[&str]| {
            let changed = [&lines[..k], new, &lines[k + 1..]].concat().join("\n");
            let mut pair = [&texts[0][..], &texts[1][..]];
            pair[channel] = &changed;
            read_siemens_pair(pair)
        };
        for (k, line) in lines.iter().enumerate().filter(|(_, l)| !l.starts_with(';')) {
            assert!(with(k, &[]).is_err(), "without {line}");
            assert!(with(k, &[line, line]).is_err(), "twice {line}");
            // A block of the body that leaves X1 out may also name it.
            let is_free =
                channel == 0 && k > body && line.contains(" G") && !line.contains(" G4") && !line.contains("X1=");
            let mut changes =
                vec![line.to_lowercase(), format!("/{line}"), format!("{line};"), format!("{line} X2=1. X1=1.")];
            changes.extend((!is_free).then(|| format!("{line} X1=1.")));
            for changed in changes {
                assert!(with(k, &[&changed]).is_err(), "{changed}");
            }
        }
    }
    let swapped = read_siemens_pair([&texts[1], &texts[1]]).unwrap_err();
    assert!(matches!(swapped.fault, SiemensFault::Axis(_)), "{swapped}");
    let other = write(random_blocks(&mut Random(25), 12), &settings(SiemensFeed::G94, 4)).unwrap();
    let mixed = read_siemens_pair([&texts[0], &other[1]]).unwrap_err();
    assert!(matches!(mixed.fault, SiemensFault::OtherChannel { .. }) && mixed.channel == 2, "{mixed}");
    assert!(read_siemens_pair(["", ""]).is_err());
}

#[test]
fn what_the_channels_cannot_say_is_refused_with_its_place() {
    let start = || random_blocks(&mut Random(26), 1)[0].clone();
    let refused = |blocks: Vec<Block>, settings: &SiemensSettings| write(blocks, settings).unwrap_err().to_string();
    let normal = SiemensSettings::default();
    let dwell = Block::Dwell { seconds: 1.0 };
    assert!(refused(vec![start(), dwell], &normal).starts_with("block 1: two channel programs hold"));
    let cut = |feed| Block::Linear { words: words_of(&[("X2", 4.0)]), feed };
    for feed in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9] {
        assert!(refused(vec![start(), cut(feed)], &normal).starts_with("block 1: "), "{feed}");
    }
    assert!(refused(vec![Block::Rapid { words: words_of(&[("X2", 4.0)]) }], &normal).contains("name every axis"));
    assert!(refused(vec![cut(1.0)], &normal).contains("must be a rapid"));
    let far = Block::Rapid { words: words_of(&[("X2", 1e7)]) };
    assert!(refused(vec![start(), far], &normal).starts_with("block 1: 10000000"));
    let wrong = |change: fn(&mut SiemensSettings)| {
        let mut settings = normal;
        change(&mut settings);
        refused(vec![start()], &settings)
    };
    assert!(wrong(|s| s.blocks_per_mark = 0).contains("blocks_per_mark"));
    assert!(wrong(|s| s.last_mark = 1).contains("last_mark") && wrong(|s| s.last_mark = 100).contains("last_mark"));
    assert!(wrong(|s| s.decimals.rotary = 7).contains("decimals"));
    assert!(wrong(|s| s.program_feed = FeedMode::Rtcp).contains("rtcp"));

    let mut spec = nine_axis_spec(vec![start()]);
    spec.axes[5].letter = axis("X3");
    let e = write_siemens_pair(&spec, &heads(), &normal).unwrap_err().to_string();
    assert!(e.starts_with("axis X3: its number is that of neither"), "{e}");
    let offset = ProgramSpec { work_offset: WorkOffset::new(100).unwrap(), ..nine_axis_spec(vec![start()]) };
    assert!(write_siemens_pair(&offset, &heads(), &normal).is_err());
    assert!(write_siemens_pair(&nine_axis_spec(vec![start()]), &heads()[..1], &normal).is_err());
}

#[test]
fn no_bytes_make_the_reader_panic() {
    let texts = write(random_blocks(&mut Random(27), 10), &settings(SiemensFeed::G93, 3)).unwrap();
    let mut random = Random(28);
    for _ in 0..3000 {
        let mut bytes = texts[0].clone().into_bytes();
        for _ in 0..=random.below(3) {
            let at = random.below(bytes.len());
            bytes[at] = b"0159.=GXN()[]; \n-WF"[random.below(19)];
        }
        if let Ok(text) = String::from_utf8(bytes) {
            let _ = read_siemens_pair([&text, &texts[1]]);
        }
    }
}
