//! Laws of all dialects' writers.

use facemill_cl_data::{ControlTolerance, CuttingLaw, MotionLaw, RapidLaw};
use facemill_nc_program::*;

use crate::kit::{AXES, Random, random_blocks, spec, words};
use crate::slow_control::{Look, State};

const MODES: [FeedMode; 3] = [FeedMode::G94, FeedMode::G93, FeedMode::Rtcp];

const WORD_ADDRESS: Look = Look {
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

fn write(spec: &ProgramSpec, post: &PostFile) -> WrittenProgram {
    let written = write_program_with_lines(spec, &on_machine(post));
    written.unwrap_or_else(|e| panic!("{:?} {:?}: {e}", post.dialect, post.feed_mode))
}

/// Every word is within half a unit of what was given, what is left out is what the control remembers, and feeds are below
/// what was given by less than a unit.
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
            let post = PostFile { dialect, feed_mode: mode, max_line_length: limit, ..PostFile::default() };
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
        let long = PostFile { dialect, feed_mode: mode, max_line_length: 500, ..PostFile::default() };
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

/// What switches RTCP on and off, and what must come behind the end of RTCP.
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
fn dialect_files_say_what_the_types_say_and_nothing_else() {
    for dialect in Dialect::ALL {
        let file = dialect.file();
        assert!(file.check().is_ok(), "{dialect:?}");
        let again: DialectFile =
            facemill_file_format::from_json(facemill_file_format::to_json(&file).as_bytes()).unwrap();
        assert_eq!(file, again);
        let name = facemill_file_format::to_json(&dialect);
        assert_eq!(name.trim(), format!("\"{}\"", dialect.name()));
    }
    let error = |text: &str| facemill_file_format::from_json::<DialectFile>(text.as_bytes()).unwrap_err().to_string();
    let source = Dialect::Fanuc.source();
    assert!(error(&source.replace("\"rapid\":", "\"rapit\":")).contains("did you mean `rapid`?"));
    let check = |from: &str, to: &str| {
        assert!(source.contains(from), "{from}");
        let file: DialectFile = facemill_file_format::from_json(source.replace(from, to).as_bytes()).unwrap();
        file.check().unwrap_err().to_string()
    };
    let message = check("T{number} M6", "T{nmber} M6");
    assert_eq!(message, "dialect file, words.tool_change: `T{nmber} M6` holds {nmber}; known there: {number}");
    assert!(check("\"end\": \"H{register}\"", "\"end\": \"H{length}\"").contains("holds {length}"));
    assert!(check("facemill-dialect/1", "facemill-dialect/2").contains("format"));
    assert!(check("\"max_length\": 500", "\"max_length\": 5").contains("lines.max_length"));
}

#[test]
fn a_control_that_does_not_move_as_the_machine_says_is_refused() {
    let post = PostFile { dialect: Dialect::Haas, feed_mode: FeedMode::Rtcp, ..PostFile::default() };
    let turned = MotionLaw { cutting: CuttingLaw::TipLinearVectorTurned, ..law(0.0) };
    let error = post.settings(None).unwrap().on_machine(turned, home()).unwrap_err().to_string();
    assert!(error.contains("motion.cutting: tip_linear_vector_turned") && error.contains("Haas"), "{error}");
    // Without RTCP the axes go linearly whatever the machine says of RTCP.
    let joints = PostFile { feed_mode: FeedMode::G93, ..post.clone() }.settings(None).unwrap();
    assert_eq!(joints.on_machine(turned, home()).unwrap().cutting_law(), CuttingLaw::AxesLinear);
    assert_eq!(on_machine(&post).cutting_law(), CuttingLaw::TipAndRotariesLinear);
    let vectors = PostFile { orientation: Orientation::Vectors, ..post.clone() };
    assert!(vectors.settings(None).unwrap_err().to_string().starts_with("orientation: Haas has no tool vectors"));
    let look_ahead = PostFile { look_ahead: true, ..post };
    assert!(look_ahead.settings(None).unwrap_err().to_string().starts_with("look_ahead: Haas has no switch"));
}

/// Haas and Mazak are a file and a template each: what they say otherwise than FANUC.
#[test]
fn haas_and_mazak_are_fanuc_with_other_words() {
    let spec = spec(random_blocks(&mut Random(37), 10));
    let text = |dialect, feed_mode, look_ahead| {
        let post = PostFile { dialect, feed_mode, look_ahead, ..PostFile::default() };
        write(&spec, &post).text
    };
    let haas = text(Dialect::Haas, FeedMode::Rtcp, false);
    assert!(haas.starts_with("%\nO01001 ("), "{haas}");
    for line in ["G0 G90 G234 X11. Y12. Z13. H7\n", "IF [ABS[#2007+#2207-420.000] LE 0.01] GOTO 9001\n"] {
        assert!(haas.contains(line), "{line} in\n{haas}");
    }
    // What the machine file allows the control, rounded down.
    assert!(haas.contains("G187 E0.0100\n") && haas.contains("G187\n"), "{haas}");
    let mazak = text(Dialect::Mazak, FeedMode::Rtcp, true);
    for line in ["G61.1\n", "G5 P2\n", "G5 P0\n", "G64\n", "G0 G90 G43.4 X11. Y12. Z13. H7\n"] {
        assert!(mazak.contains(line), "{line} in\n{mazak}");
    }
    let body = |text: &str| {
        let body = text.split_once("G90 G94 G0").unwrap().1.split_once(" M9\n").unwrap().0.to_owned();
        let code = |l: &str| l.split_once(' ').filter(|(n, _)| n.starts_with('N')).map_or(l, |(_, c)| c).to_owned();
        body.lines().map(code).filter(|l| !l.starts_with("G187")).take(9).collect::<Vec<_>>()
    };
    let fanuc = text(Dialect::Fanuc, FeedMode::G94, false);
    for dialect in [Dialect::Haas, Dialect::Mazak] {
        assert_eq!(body(&text(dialect, FeedMode::G94, false)), body(&fanuc));
    }
    assert!(text(Dialect::Fanuc, FeedMode::G94, true).contains("G5.1 Q1\n"));
}

#[test]
fn what_a_control_has_no_word_for_is_refused_by_its_name() {
    let post = PostFile { dialect: Dialect::Haas, ..PostFile::default() };
    let first = Block::Rapid { words: words(&AXES.map(|l| (l, 0.0))) };
    let refused = |change: &dyn Fn(&mut ProgramSpec)| {
        let mut spec = spec(vec![first.clone()]);
        change(&mut spec);
        write_program(&spec, &on_machine(&post)).unwrap_err().to_string()
    };
    let mist = refused(&|s| s.coolant = Coolant::Mist);
    assert_eq!(mist, "coolant: Haas has no word for this: mist coolant");
    let offset = refused(&|s| s.work_offset = WorkOffset::new(106).unwrap());
    assert_eq!(offset, "work_offset: Haas has no word for this: work offset 106");
    let far = ProgramSpec { work_offset: WorkOffset::new(105).unwrap(), ..spec(vec![first.clone()]) };
    assert!(write(&far, &post).text.contains(" G154 P99\n"));
    let block = refused(&|s| s.program.blocks.push(Block::Coolant(Coolant::Mist)));
    assert!(block.starts_with("block 1: Haas has no word"), "{block}");
    let second = "X2".parse().unwrap();
    let axis = AxisSpec { letter: second, min: 0.0, max: 1.0, along_spindle: false, work_offset: 0.0 };
    assert!(refused(&|s| s.axes.push(axis)).starts_with("axis X2: Haas has no word"));
    let number = PostFile { program_number: 100_000, ..post.clone() };
    assert_eq!(number.settings(None).unwrap_err().to_string(), "program_number is 100000: it must be from 1 to 99999");
    let decimals = PostFile { decimals: Decimals { linear: 5, ..Decimals::default() }, ..post.clone() };
    assert!(decimals.settings(None).unwrap_err().to_string().starts_with("decimals.linear is 5"));
}

#[test]
fn linuxcnc_keeps_joints_without_rtcp_and_switches_kinematics_with_it() {
    let spec = spec(random_blocks(&mut Random(38), 10));
    let post = PostFile { dialect: Dialect::LinuxCnc, feed_mode: FeedMode::G93, ..PostFile::default() };
    let text = write(&spec, &post).text;
    assert!(!text.contains("M428") && !text.contains("M429") && text.contains("G64 P0.0100 Q0.0001\n"), "{text}");
    assert!(text.contains("G53 G0 Z1500.\n") && text.ends_with("M2\n"), "{text}");
    let exact = post.settings(None).unwrap().on_machine(law(0.0), home()).unwrap();
    let exact = write_program(&spec, &exact).unwrap();
    assert!(exact.contains("G61\n") && !exact.contains("G64"), "{exact}");
    let rtcp = write(&spec, &PostFile { feed_mode: FeedMode::Rtcp, ..post.clone() }).text;
    let mut rest = rtcp.as_str();
    for line in [
        "M429\n",
        "G53 G0 Z1500.\n",
        "G43 H7\n",
        "G0 G90 B14. C15.\n",
        "M428\n",
        "G0 G90 X11. Y12. Z13.\n",
        "M429\n",
        "G49\n",
        "G53 G0 Z1500.\n",
        "G53 G0 X0. Y0.\n",
        "G53 G0 B0. C0.\n",
    ] {
        rest = rest.split_once(line).unwrap_or_else(|| panic!("{line} in\n{rtcp}")).1;
    }
    let g94 = PostFile { feed_mode: FeedMode::G94, ..post.clone() }.settings(None).unwrap_err().to_string();
    assert!(g94.starts_with("feed_mode: LinuxCNC has no g94") && g94.ends_with("take g93"), "{g94}");
    let per_axis = MotionLaw { rapid: RapidLaw::PerAxis, ..law(0.0) };
    let error = post.settings(None).unwrap().on_machine(per_axis, home()).unwrap_err().to_string();
    assert!(error.contains("motion.rapid: per_axis; it does linear"), "{error}");
    // Without the machine nobody knows where home is.
    let error = write_program(&spec, &post.settings(None).unwrap()).unwrap_err().to_string();
    assert!(error.contains("linuxcnc.j2"), "{error}");
    let dwell = ProgramSpec {
        program: NcProgram { blocks: vec![spec.program.blocks[0].clone(), Block::Dwell { seconds: 1.5 }] },
        ..spec
    };
    assert!(write(&dwell, &post).text.contains("G4 P1.500\n"));
}
