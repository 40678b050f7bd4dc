//! Laws of all dialects' writers.

use facemill_cl_data::{ControlTolerance, CuttingLaw, MotionLaw, RapidLaw};
use facemill_nc_program::dialect::{BlockNumbers, Decimals, PostFile, Template};
use facemill_nc_program::*;

use crate::kit::{AXES, Random, random_blocks, spec, words};
use crate::slow_control::{Look, State};

const MODES: [FeedMode; 3] = [FeedMode::G94, FeedMode::G93, FeedMode::Rtcp];

/// Words of letters and numbers, as most controls have them.
pub(crate) const WORD_ADDRESS: Look = Look {
    rapid: "G0",
    cut: "G1",
    rapid_mark: None,
    comment: '(',
    plus: false,
    point: true,
    all_numbered: false,
    any_point: false,
};

const KLARTEXT: Look = Look {
    rapid: "L",
    cut: "L",
    rapid_mark: Some("FMAX"),
    comment: ';',
    plus: true,
    point: false,
    all_numbered: true,
    any_point: false,
};

/// How the text of a dialect looks; the characters and the longest line of the manuals.
fn look(dialect: Dialect) -> (Look, usize) {
    match dialect {
        Dialect::Fanuc => (WORD_ADDRESS, 500),
        Dialect::Haas | Dialect::Mazak => (WORD_ADDRESS, 128),
        Dialect::LinuxCnc => (WORD_ADDRESS, 255),
        Dialect::Siemens840d => (Look { comment: ';', ..WORD_ADDRESS }, 512),
        Dialect::Heidenhain => (KLARTEXT, 150),
        _ => unreachable!("{dialect:?} needs a look"),
    }
}

/// A machine's law with axes that go linearly.
pub(crate) fn law(path: f64) -> MotionLaw {
    MotionLaw {
        cutting: CuttingLaw::TipAndRotariesLinear,
        rapid: RapidLaw::Linear,
        control_tolerance: ControlTolerance { path, orientation: path.to_radians() },
    }
}

pub(crate) fn home() -> AxisWords {
    words(&AXES.map(|l| (l, if l == AxisLetter::Z { 1500.0 } else { 0.0 })))
}

/// The settings of a file on a machine whose control may be off by a hundredth.
pub(crate) fn on_machine(post: &PostFile) -> PostSettings {
    post.settings(None).unwrap().on_machine(law(0.01), home()).unwrap()
}

/// The feed modes that a dialect has words for.
pub(crate) fn modes(dialect: Dialect) -> Vec<FeedMode> {
    let has = |mode: &FeedMode| PostFile { dialect, feed_mode: *mode, ..PostFile::default() }.settings(None).is_ok();
    MODES.into_iter().filter(has).collect()
}

fn each(mut test: impl FnMut(Dialect, FeedMode)) {
    for dialect in Dialect::ALL {
        let modes = modes(dialect);
        assert!(!modes.is_empty(), "{dialect:?}");
        modes.into_iter().for_each(|mode| test(dialect, mode));
    }
}

pub(crate) fn write(spec: &ProgramSpec, post: &PostFile) -> WrittenProgram {
    let written = write_program_with_lines(spec, &on_machine(post));
    written.unwrap_or_else(|e| panic!("{:?} {:?}: {e}", post.dialect, post.feed_mode))
}

/// Every word is within half a unit of what was given, what is left out is what the control
/// remembers, and feeds are below what was given by less than a unit.
#[test]
fn a_control_that_remembers_words_goes_where_the_blocks_say() {
    let mut random = Random(31);
    each(|dialect, mode| {
        let (look, _) = look(dialect);
        for round in 0..20 {
            let blocks = random_blocks(&mut random, 60);
            let decimals = Decimals { linear: 2 + round % 3, rotary: 1 + round % 4, feed: round % 3, inverse_time: 3 };
            let post =
                PostFile { dialect, feed_mode: mode, decimals, trailing_zeros: round % 5 == 4, ..PostFile::default() };
            // With trailing zeros a number of no decimals is whole.
            let look = Look { any_point: post.trailing_zeros, ..look };
            let spec = ProgramSpec { smallest_feed: 0.0, ..spec(sayable(blocks, mode, decimals)) };
            let written = write(&spec, &post);
            let lines: Vec<&str> = written.text.lines().collect();
            let mut state = State::default();
            let mut expected = AxisWords::new();
            for (block, line) in spec.program.blocks.iter().zip(&written.block_lines) {
                let (named, feed) = match block {
                    Block::Rapid { words } => (words, None),
                    Block::Linear { words, feed } => (words, Some(*feed)),
                    _ => continue,
                };
                let line = lines[*line as usize - 1];
                state.run(line, &look, &["X", "Y", "Z", "B", "C"]);
                assert_eq!(state.is_rapid, feed.is_none(), "{dialect:?} {line}");
                for word in named.iter() {
                    expected.set(word.letter, word.value).unwrap();
                }
                for word in expected.iter() {
                    let unit = 10f64.powi(-i32::from(decimals.of(word.letter.kind())));
                    let said = state.words[&word.letter.to_string()];
                    assert!((said - word.value).abs() <= 0.5 * unit + 1e-9, "{dialect:?} {} in {line}", word.value);
                }
                if let Some(feed) = feed {
                    let places = if mode == FeedMode::G93 { decimals.inverse_time } else { decimals.feed };
                    let unit = 10f64.powi(-i32::from(places));
                    let said = if mode == FeedMode::G93 { state.own_feed } else { state.feed }.unwrap();
                    assert!(said > 0.0 && feed - said < unit * (1.0 + 1e-5), "{dialect:?} {feed} in {line}");
                    assert!(said <= feed + 1e-5 * unit || said == unit, "{dialect:?} {feed} in {line}");
                }
            }
        }
    });
}

/// Feeds that a word with so many decimals can say.
fn sayable(mut blocks: Vec<Block>, mode: FeedMode, decimals: Decimals) -> Vec<Block> {
    let places = if mode == FeedMode::G93 { decimals.inverse_time } else { decimals.feed };
    for block in &mut blocks {
        if let Block::Linear { feed, .. } = block {
            *feed = feed.max(0.6 * 10f64.powi(-i32::from(places)));
        }
    }
    blocks
}

#[test]
fn lines_are_as_short_as_the_control_wants_them_and_comments_in_its_characters() {
    let mut random = Random(32);
    each(|dialect, mode| {
        let (look, longest) = look(dialect);
        for limit in [75, 90, 120, longest.min(500) as u16] {
            let mut blocks = random_blocks(&mut random, 30);
            for text in ["Ende (schön) \u{1f600} ;{x}_%$\"<>~|@^` ", "a)b(c", "\n\r\tN5 G0 X9", "", "MSG,x (debug,#1)"]
            {
                blocks.push(Block::Comment(text.repeat(7)));
            }
            let post = PostFile { dialect, feed_mode: mode, max_line_length: Some(limit), ..PostFile::default() };
            let Ok(written) = write_program_with_lines(&spec(blocks), &on_machine(&post)) else {
                // A line that does not fit is an error, never cut.
                assert!(limit < 120, "{dialect:?} {mode:?}");
                continue;
            };
            for line in written.text.lines() {
                assert!(!line.is_empty() && line.len() <= usize::from(limit), "{dialect:?} {line}");
                assert!(line.bytes().all(|b| (b' '..=b'~').contains(&b)), "{dialect:?} {line}");
                assert!(!line.bytes().any(|b| b.is_ascii_lowercase()), "{dialect:?} {line}");
                let marks = line.matches(look.comment).count();
                assert!(marks <= 1, "{dialect:?} {line}");
                if look.comment == '(' {
                    assert_eq!(marks, line.matches(')').count(), "{dialect:?} {line}");
                }
                let code = line.split(look.comment).next().unwrap();
                assert!(!code.contains("SCHOEN") && !code.contains("DEBUG"), "{dialect:?} {line}");
                let template = line.starts_with("(ABORT,TOOL LENGTH");
                assert!(dialect != Dialect::LinuxCnc || template || !is_active(line), "{line}");
            }
        }
        let long = PostFile { dialect, feed_mode: mode, max_line_length: Some(500), ..PostFile::default() };
        assert_eq!(long.settings(None).is_ok(), longest >= 500, "{dialect:?}");
    });
}

/// Whether a comment does something on LinuxCNC.
fn is_active(line: &str) -> bool {
    let text = line.split_once('(').map_or("", |(_, text)| text.trim_start());
    ["MSG,", "DEBUG,", "PRINT,", "PROBEOPEN", "PROBECLOSE", "LOG", "PY", "ABORT,"].iter().any(|a| text.starts_with(a))
}

#[test]
fn every_line_is_a_comment_or_is_numbered_as_the_control_wants() {
    let mut random = Random(33);
    each(|dialect, mode| {
        let (look, _) = look(dialect);
        let spec = spec(random_blocks(&mut random, 40));
        let none = PostFile { dialect, feed_mode: mode, block_numbers: None, ..PostFile::default() };
        let some = PostFile { block_numbers: Some(BlockNumbers { start: 3, step: 2 }), ..none.clone() };
        let (none, some) = (write(&spec, &none).text, write(&spec, &some).text);
        assert_eq!(none.lines().count(), some.lines().count());
        if look.all_numbered {
            assert_eq!(none, some);
            let mut before = "";
            let mut k = 0;
            for line in none.lines() {
                if before.ends_with('~') {
                    assert!(!line.starts_with(|c: char| c.is_ascii_digit()), "{line}");
                } else {
                    assert!(line.starts_with(&format!("{k} ")), "{line}");
                    k += 1;
                }
                before = line;
            }
            return;
        }
        let mut next = 3;
        for (plain, numbered) in none.lines().zip(some.lines()) {
            if plain != numbered {
                assert_eq!(numbered, format!("N{next} {plain}"), "{dialect:?}");
                next += 2;
            }
        }
        assert!(next > 3 + 2 * 40, "{dialect:?}");
    });
}

#[test]
fn same_input_gives_the_same_bytes_in_every_dialect() {
    each(|dialect, mode| {
        let post = PostFile { dialect, feed_mode: mode, ..PostFile::default() };
        let text = || write(&spec(random_blocks(&mut Random(34), 200)), &post).text;
        assert_eq!(text(), text());
    });
}

/// Returns the words that switch RTCP on and off, and those that must come behind the end of RTCP.
fn rtcp_marks(dialect: Dialect) -> (&'static str, &'static str, &'static [&'static str]) {
    match dialect {
        Dialect::Fanuc | Dialect::Mazak => ("G43.4", "G49", &["G28 X", "G28 B", "M30"]),
        Dialect::Haas => ("G234", "G49", &["G28 X", "G28 B", "M30"]),
        Dialect::LinuxCnc => ("M428", "M429", &["G53 G0 Z", "G53 G0 X", "G53 G0 B", "M2"]),
        Dialect::Siemens840d => ("TRAORI", "TRAFOOF", &["SUPA Z", "SUPA X", "SUPA B", "M30"]),
        Dialect::Heidenhain => {
            ("FUNCTION TCPM", "FUNCTION RESET TCPM", &["L Z+1500 R0 FMAX M91", "L X+0", "L B+0", "M30"])
        }
        _ => unreachable!("{dialect:?} needs marks"),
    }
}

#[test]
fn rtcp_is_off_before_rotary_axes_go_home_and_before_the_end() {
    for dialect in Dialect::ALL {
        let post = PostFile { dialect, feed_mode: FeedMode::Rtcp, ..PostFile::default() };
        if post.settings(None).is_err() {
            continue;
        }
        let spec = spec(random_blocks(&mut Random(35), 20));
        let written = write(&spec, &post);
        let (on, off, behind) = rtcp_marks(dialect);
        let comment = look(dialect).0.comment;
        let lines: Vec<&str> = written.text.lines().map(|l| l.split(comment).next().unwrap()).collect();
        let first = written.block_lines[0] as usize - 1;
        let last = *written.block_lines.last().unwrap() as usize - 1;
        assert!(lines[..first].iter().any(|l| l.contains(on)), "{dialect:?}\n{}", written.text);
        let tail = &lines[last + 1..];
        let at = tail.iter().position(|l| l.contains(off)).unwrap_or_else(|| panic!("{dialect:?}\n{}", written.text));
        for mark in behind {
            let where_is = tail.iter().position(|l| l.contains(mark));
            assert!(where_is.is_some_and(|k| k > at), "{dialect:?} {mark}\n{}", written.text);
        }
        // And nothing of the program before switched it off.
        let on_at = lines.iter().position(|l| l.contains(on)).unwrap();
        assert!(!lines[on_at + 1..=last].iter().any(|l| l.contains(off)), "{dialect:?}\n{}", written.text);
    }
}

#[test]
fn a_wrong_variable_in_any_template_names_the_template_and_its_line() {
    each(|dialect, mode| {
        let spec = spec(random_blocks(&mut Random(36), 3));
        let own = Template::of(dialect);
        let post = PostFile { dialect, feed_mode: mode, ..PostFile::default() };
        let n = own.text.lines().count() + 1;
        let text = format!("{}\n{{{{ tool.nmber }}}}\n", own.text.trim_end_matches('\n'));
        let edited = Template { name: "shop.j2".to_owned(), text };
        let settings = post.settings(Some(edited)).unwrap().on_machine(law(0.01), home()).unwrap();
        let error = write_program(&spec, &settings).unwrap_err().to_string();
        assert!(error.starts_with(&format!("template shop.j2, line {n}: undefined value")), "{dialect:?} {error}");
    });
}

#[test]
fn the_longest_line_may_be_as_long_as_the_limit_and_no_longer() {
    let mut n = 0;
    each(|dialect, mode| {
        let spec = spec(random_blocks(&mut Random(39), 60));
        let with = |longest| {
            let post = PostFile { dialect, feed_mode: mode, max_line_length: Some(longest), ..PostFile::default() };
            write_program(&spec, &on_machine(&post))
        };
        let longest = with(120).unwrap().lines().map(str::len).max().unwrap() as u16;
        assert!(with(longest).is_ok(), "{dialect:?} {longest}");
        let Err(WriteError::LineTooLong { text, limit }) = with(longest - 1) else { panic!("{dialect:?} {longest}") };
        assert_eq!((text.len(), limit), (usize::from(longest), usize::from(longest) - 1));
        n += 1;
    });
    assert!(n > 10);
}

/// A control must not be allowed more than plan and verification assumed.
#[test]
fn tolerances_are_rounded_down() {
    let tolerance = ControlTolerance { path: 0.019_99, orientation: 0.029_99_f64.to_radians() };
    let words = [
        (Dialect::Haas, FeedMode::G94, "G187 E0.0199\n"),
        (Dialect::LinuxCnc, FeedMode::G93, "G64 P0.0199 Q0.0001\n"),
        (Dialect::Siemens840d, FeedMode::Rtcp, "CYCLE832(0.0199,11,0.0299)\n"),
        (Dialect::Heidenhain, FeedMode::Rtcp, "CYCL DEF 32.1 T0.0199\n"),
        (Dialect::Heidenhain, FeedMode::G94, "CYCL DEF 32.2 HSC-MODE:0 TA0.0299\n"),
    ];
    for (dialect, feed_mode, line) in words {
        let post = PostFile { dialect, feed_mode, ..PostFile::default() };
        let with = |control_tolerance| {
            let motion = MotionLaw { control_tolerance, ..law(0.0) };
            let settings = post.settings(None).unwrap().on_machine(motion, home()).unwrap();
            write_program(&spec(random_blocks(&mut Random(40), 3)), &settings)
        };
        assert!(with(tolerance).unwrap().contains(line), "{dialect:?} {line}");
        // A value too small for a word is not rounded to nothing or up.
        let tiny = with(ControlTolerance { path: 0.000_09, ..tolerance });
        assert!(matches!(tiny, Err(WriteError::Tolerance { key: "path_mm", .. })), "{dialect:?}");
    }
}
