//! Laws of the FANUC writer and reader together.

use crate::kit::{AXES, Random, post_file, random_blocks, settings, spec, words};
use facemill_nc_program::dialect::{BlockNumbers, Decimals, PostFile, Template};
use facemill_nc_program::read::{AxisAt, Feed, MotionKind, ReadMotion, read_fanuc};
use facemill_nc_program::words::AxisKind;
use facemill_nc_program::*;

const MODES: [FeedMode; 3] = [FeedMode::G94, FeedMode::G93, FeedMode::Rtcp];

/// The moves of the body: all but the template's approach and its way home.
fn body_motions(read: &ReadProgram, n: usize) -> Vec<&ReadMotion> {
    let all: Vec<_> = read.motions().map(|(_, motion)| motion).collect();
    let end = all.iter().rposition(|m| m.kind != MotionKind::ReferenceReturn).unwrap() + 1;
    all[end - n..end].to_vec()
}

fn is_motion(block: &Block) -> bool {
    matches!(block, Block::Rapid { .. } | Block::Linear { .. })
}

fn named(block: &Block) -> (&AxisWords, Option<f64>) {
    match block {
        Block::Rapid { words } => (words, None),
        Block::Linear { words, feed } => (words, Some(*feed)),
        other => panic!("{other:?} is no motion"),
    }
}

#[test]
fn what_is_written_is_read_within_half_a_unit_and_feeds_below_what_was_given() {
    let mut random = Random(1);
    for round in 0..120 {
        let mode = MODES[round % 3];
        let blocks = random_blocks(&mut random, 60);
        let post = PostFile {
            feed_mode: mode,
            trailing_zeros: round % 2 == 0,
            decimals: Decimals { linear: 2 + (round % 4) as u8, ..Decimals::default() },
            ..post_file()
        };
        let settings = post.settings(None).unwrap();
        let text = write_program(&spec(blocks.clone()), &settings).unwrap();
        let read = read_fanuc(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        assert!(read.is_evaluated());
        assert_eq!(read.tool_length(), Some(420.0));

        let motions: Vec<_> = blocks.iter().filter(|b| is_motion(b)).collect();
        let read = body_motions(&read, motions.len());
        let bound = settings.rounding_bound();
        let mut expected = AxisWords::new();
        for (block, motion) in motions.iter().zip(read) {
            let (words, feed) = named(block);
            for word in words.iter() {
                expected.set(word.letter, word.value).unwrap();
            }
            assert_eq!(motion.kind, if feed.is_some() { MotionKind::Linear } else { MotionKind::Rapid });
            for word in expected.iter() {
                let Some(AxisAt::Word(value)) = motion.position.get(word.letter) else {
                    panic!("{} is unknown in\n{text}", word.letter)
                };
                let half_unit = match word.letter.kind() {
                    AxisKind::Linear => bound.linear,
                    AxisKind::Rotary => bound.rotary.to_degrees(),
                };
                assert!((value - word.value).abs() <= half_unit + 1e-9, "{} {value} {}", word.letter, word.value);
            }
            let unit = if mode == FeedMode::G93 { 0.001 } else { 0.1 };
            match (feed, motion.feed) {
                (None, None) => {}
                (Some(feed), Some(read)) => {
                    assert_eq!(read.mode, mode);
                    assert!(
                        (read.value <= feed + 1e-5 * unit || read.value == unit) && (feed - read.value).abs() < unit,
                        "{feed} {}",
                        read.value
                    );
                }
                other => panic!("{other:?}"),
            }
        }
    }
}

#[test]
fn writing_what_was_read_changes_nothing() {
    let mut random = Random(2);
    for round in 0..60 {
        let settings = settings(MODES[round % 3]);
        let blocks: Vec<_> = random_blocks(&mut random, 40).into_iter().filter(is_motion).collect();
        let first_text = write_program(&spec(blocks.clone()), &settings).unwrap();
        let first = read_fanuc(&first_text).unwrap();
        let again: Vec<Block> = body_motions(&first, blocks.len())
            .into_iter()
            .map(|motion| match motion.feed {
                None => Block::Rapid { words: motion.position.words() },
                Some(feed) => Block::Linear { words: motion.position.words(), feed: feed.value },
            })
            .collect();
        let second_text = write_program(&spec(again), &settings).unwrap();
        let second = read_fanuc(&second_text).unwrap();
        assert_eq!(body_motions(&first, blocks.len()), body_motions(&second, blocks.len()));
    }
}

/// A program that says everything in every block means the same as one with modal words left out.
#[test]
fn modal_suppression_changes_no_meaning() {
    let mut random = Random(3);
    for round in 0..60 {
        let mode = MODES[round % 2];
        let mut full = random_blocks(&mut random, 40);
        let mut position = AxisWords::new();
        for block in &mut full {
            if let Block::Rapid { words } | Block::Linear { words, .. } = block {
                for word in words.iter() {
                    position.set(word.letter, word.value).unwrap();
                }
                *words = position;
            }
        }
        // Written one by one, nothing can be left out.
        let mut plain = String::from("G21 G90 G54 G43 H7\n");
        for block in full.iter().filter(|b| is_motion(b)) {
            let (words, feed) = named(block);
            let code = if mode == FeedMode::G93 { "G93" } else { "G94" };
            plain += &format!("G90 {code} {}", if feed.is_some() { "G1" } else { "G0" });
            for word in words.iter() {
                // As the writer rounds: to nearest, halves away from zero.
                plain += &format!(" {}{:.3}", word.letter, (word.value * 1000.0).round() / 1000.0);
            }
            if let Some(feed) = feed {
                let unit = if mode == FeedMode::G93 { 1000.0 } else { 10.0 };
                // Down, but never to zero.
                plain += &format!(" F{:.3}", (feed * unit + 1e-6).floor().max(1.0) / unit);
            }
            plain.push('\n');
        }
        let n = full.iter().filter(|b| is_motion(b)).count();
        let plain = read_fanuc(&plain).unwrap();
        let written = read_fanuc(write_program(&spec(full), &settings(mode)).unwrap()).unwrap();
        assert_eq!(body_motions(&plain, n), body_motions(&written, n));
    }
}

/// Between motions, everything that makes the control forget or refer to something else.
#[test]
fn words_are_said_again_where_their_meaning_changes() {
    let at = words(&[(AxisLetter::X, 1.0), (AxisLetter::Z, 5.0)]);
    let cut = Block::Linear { words: at, feed: 100.0 };
    let between = [
        Block::WorkOffset(WorkOffset::new(2).unwrap()),
        Block::WorkOffset(WorkOffset::new(9).unwrap()),
        Block::LengthCompensation { register: 3, length: 100.0, words: words(&[(AxisLetter::Z, 5.0)]) },
        Block::LengthCompensationOff,
        Block::Home { axes: vec![AxisLetter::Z, AxisLetter::X] },
        Block::Raw("G91\nG1 X5.\n(raw)".to_owned()),
        Block::ToolCall { number: 3 },
        Block::SpindleOn { rpm: 100.0, clockwise: false, spindle: None },
        Block::SpindleOff,
        Block::Coolant(Coolant::Mist),
        Block::Dwell { seconds: 1.5 },
        Block::Stop,
        Block::Comment("note".to_owned()),
    ];
    for block in between {
        let blocks = vec![Block::Rapid { words: at }, cut.clone(), block.clone(), cut.clone()];
        let text = write_program(&spec(blocks), &settings(FeedMode::G94)).unwrap();
        let read = read_fanuc(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        assert_eq!(body_motions(&read, 1)[0].position.get(AxisLetter::X), Some(AxisAt::Word(1.0)), "{block:?}\n{text}");
        assert_eq!(body_motions(&read, 1)[0].position.get(AxisLetter::Z), Some(AxisAt::Word(5.0)), "{block:?}\n{text}");
        assert_eq!(body_motions(&read, 1)[0].feed, Some(Feed { mode: FeedMode::G94, value: 100.0 }));
    }
}

#[test]
fn text_keeps_to_the_rules_of_the_control() {
    let mut random = Random(4);
    for round in 0..30 {
        let mut blocks = random_blocks(&mut random, 50);
        blocks.push(Block::Comment("Ende (schön) \u{1f600} ".repeat(1 + round)));
        let post = PostFile { max_line_length: Some(80), ..post_file() };
        let text = write_program(&spec(blocks), &post.settings(None).unwrap()).unwrap();
        assert!(text.starts_with("%\nO1001 (") && text.ends_with("M30\n%\n"), "{text}");
        for line in text.lines() {
            assert!(line.len() <= 80 && !line.is_empty(), "{line}");
            assert!(line.bytes().all(|b| b == b' ' || b.is_ascii_graphic() && !b.is_ascii_lowercase()), "{line}");
            let n_open = line.matches('(').count();
            assert!(n_open <= 1 && n_open == line.matches(')').count(), "{line}");
            let code = line.split('(').next().unwrap();
            assert!(!code.contains("-0. ") && !code.ends_with("-0."), "{line}");
        }
    }
}

#[test]
fn program_is_made_of_safe_start_check_approach_motions_and_way_home() {
    let first = words(&AXES.map(|l| (l, 1.5)));
    let cut = Block::Linear { words: words(&[(AxisLetter::X, 2.0)]), feed: 800.0 };
    let text = write_program(&spec(vec![Block::Rapid { words: first }, cut]), &settings(FeedMode::G94)).unwrap();
    let expected = "\
%
O1001 (PROPELLER [PRUEFUNG])
(JOB PROPELLER [PRUEFUNG])
(TOOL T7 FACE MILL D160 R6)
(CUTTER RADIUS 80.000 CORNER RADIUS 6.000)
(TOOL LENGTH 420.000)
(MACHINE AXIS X FROM -100. TO 2000.)
(MACHINE AXIS Y FROM -900. TO 900.)
(MACHINE AXIS Z FROM 0. TO 1500.)
(MACHINE AXIS B FROM -30. TO 110.)
(F IS THE NORM OVER ALL AXES WITH 1 DEG AS 1 MM)
(G54 PLANNED AT X0. Y-2.5 Z100. B0. C45.)
(G0 PLANNED ALONG STRAIGHT LINES: PARAMETER 1401 BIT 1 IS 1)
N1 G17 G21 G40 G80 G90 G94
N2 G91 G28 Z0.
N3 G49
N4 G91 G28 X0. Y0.
N5 G91 G28 B0. C0.
N6 G90
N7 T7 M6
N8 IF [ABS[#11007+#10007-420.000] LE 0.01] GOTO 9001
N9 #3000=1(TOOL LENGTH H7 NOT 420.000)
N9001
N10 G54
N11 S350 M3
N12 G0 G90 B1.5 C1.5
N13 G0 G90 X1.5 Y1.5
N14 G0 G90 G43 Z1.5 H7
N15 M8
N16 G90 G94 G0 X1.5 Y1.5 Z1.5 B1.5 C1.5
N17 G1 X2. F800.
N18 M9
N19 M5
N20 G94
N21 G91 G28 Z0.
N22 G49
N23 G91 G28 X0. Y0.
N24 G91 G28 B0. C0.
N25 G90
N26 M30
%
";
    assert_eq!(text, expected);
}

#[test]
fn header_says_what_rapids_were_planned() {
    let first = words(&AXES.map(|l| (l, 1.5)));
    let mut spec = spec(vec![Block::Rapid { words: first }]);
    spec.rapid = facemill_cl_data::RapidLaw::PerAxis;
    let text = write_program(&spec, &settings(FeedMode::G94)).unwrap();
    assert!(text.contains("\n(G0 PLANNED WITH EACH AXIS AT ITS OWN SPEED: PARAMETER 1401 BIT 1 IS 0)\n"), "{text}");
    assert!(!text.contains("STRAIGHT LINES"));
}

#[test]
fn rtcp_is_switched_on_where_nothing_moves_and_off_where_the_spindle_axis_is_home() {
    let first = words(&AXES.map(|l| (l, 1.5)));
    let mut spec = spec(vec![Block::Rapid { words: first }]);
    let text = write_program(&spec, &settings(FeedMode::Rtcp)).unwrap();
    let lines = [
        "G0 G90 B14. C15.\n",
        "G0 G90 G43.4 X11. Y12. Z13. H7\n",
        "G90 G94 G0 X1.5 Y1.5 Z1.5 B1.5 C1.5\n",
        "G91 G28 Z0.\n",
        "G49\n",
        "G91 G28 X0. Y0.\n",
    ];
    let mut rest = text.split_once("M3\n").unwrap().1;
    for line in lines {
        rest = rest.split_once(line).unwrap_or_else(|| panic!("{line} in\n{text}")).1;
    }
    spec.approach = None;
    assert_eq!(write_program(&spec, &settings(FeedMode::Rtcp)), Err(WriteError::NoApproach));
}

#[test]
fn joints_come_back_from_the_text() {
    let axis = |letter, offset, along_spindle| MappedAxis { letter, offset, along_spindle };
    let axes = [(500.0, 0.0), (-20.0, 0.0), (300.0, 1.0), (0.1, 0.0), (-0.4, 0.0)];
    let axes = AXES.iter().zip(axes).map(|(l, (offset, along))| axis(*l, offset, along)).collect();
    let map = WordMap::new(axes, WorkOffset::default(), 420.0).unwrap();
    let mut random = Random(5);
    let joints: Vec<[f64; 5]> =
        (0..200).map(|_| std::array::from_fn(|k| (random.unit() - 0.5) * if k < 3 { 2000.0 } else { 6.0 })).collect();
    let words: Vec<_> = joints.iter().map(|q| map.words(q).unwrap()).collect();
    let mut blocks = vec![Block::Rapid { words: words[0] }];
    blocks.extend(words[1..].iter().map(|words| Block::Linear { words: *words, feed: 500.0 }));
    let settings = settings(FeedMode::G94);
    let read = read_fanuc(write_program(&spec(blocks), &settings).unwrap()).unwrap();
    let home = [1.0, 2.0, 3.0, 0.5, 0.25];
    for (motion, q) in body_motions(&read, joints.len()).iter().zip(&joints) {
        let back = map.joints_at(motion, &home).unwrap();
        for k in 0..5 {
            let bound = if k < 3 { settings.rounding_bound().linear } else { settings.rounding_bound().rotary };
            assert!((back[k] - q[k]).abs() <= bound + 1e-9, "{k}: {} {}", back[k], q[k]);
        }
    }
    let (_, last) = read.motions().last().unwrap();
    assert_eq!(map.joints_at(last, &home), Ok(home.to_vec()));
    // From home on, every position of the program is known: nothing hides in the header.
    let known = read.motions().skip_while(|(_, m)| m.position.iter().count() < 5);
    assert!(known.count() >= joints.len() + 3);
}

#[test]
fn block_numbers_start_again_and_leave_labels_out() {
    let first = words(&AXES.map(|l| (l, 0.0)));
    let mut blocks = vec![Block::Rapid { words: first }];
    for k in 0..200 {
        blocks.push(Block::Linear { words: words(&[(AxisLetter::X, f64::from(k))]), feed: 100.0 });
    }
    let post = PostFile { block_numbers: Some(BlockNumbers { start: 8990, step: 1 }), ..post_file() };
    let text = write_program(&spec(blocks.clone()), &post.settings(None).unwrap()).unwrap();
    assert_eq!(text.matches("N9001").count(), 1);
    assert!(text.contains("N9000 ") && text.contains("N9002 "));
    let post = PostFile { block_numbers: Some(BlockNumbers { start: 99_990, step: 3 }), ..post_file() };
    let text = write_program(&spec(blocks.clone()), &post.settings(None).unwrap()).unwrap();
    assert!(text.contains("N99999 ") && text.matches("N99990 ").count() > 1 && !text.contains("N100"));
    let post = PostFile { block_numbers: None, ..post_file() };
    let text = write_program(&spec(blocks), &post.settings(None).unwrap()).unwrap();
    assert_eq!(text.lines().filter(|l| l.starts_with('N')).collect::<Vec<_>>(), ["N9001"]);
}

#[test]
fn a_template_has_an_end_of_its_steps_and_of_its_text() {
    let first = Block::Rapid { words: words(&AXES.map(|l| (l, 0.0))) };
    let message = |text: &str| {
        let template = Template { name: "mine.j2".to_owned(), text: text.to_owned() };
        let post = post_file().settings(Some(template)).unwrap();
        write_program(&spec(vec![first.clone()]), &post).unwrap_err().to_string()
    };
    let nested = "%\n{% for a in range(900) %}{% for b in range(900) %}{% endfor %}{% endfor %}\n{{ body }}";
    assert!(message(nested).contains("200000 steps"), "{}", message(nested));
    let long = "%\n{% for a in range(900) %}{{ 'GGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGGG' * 100 }}{% endfor %}\n{{ body }}";
    assert!(message(long).contains("4194304 bytes"), "{}", message(long));
}

/// Each would make a text of many megabytes in a few steps.
const GROWING: [(&str, &str); 24] = [
    ("{% set a = a ~ a %}", "`set` is no statement"),
    ("{%- set a %}{{ body }}{{ body }}{% endset %}", "`set` is no statement"),
    ("{% with a = 'x' %}{% endwith %}", "`with` is no statement"),
    ("{% filter upper %}{{ body }}{% endfilter %}", "`filter` is no statement"),
    ("{% raw %}{% endraw %}", "`raw` is no statement"),
    ("{% for a in [1] recursive %}{{ loop([1]) }}{% endfor %}", "cannot call itself"),
    ("{% for a in ['x' ~ 'y'] %}{% endfor %}", "leave `~` out"),
    ("{% for a in ['x' + 'y'] %}{% endfor %}", "leave `+` out"),
    ("{% for a in ['x' * 9] %}{% endfor %}", "leave `*` out"),
    ("{% for a in [[1, 1], [1, 1]] %}{% endfor %}", "without lists in it"),
    ("{% for a in [(1, 1), (1, 1)] %}{% endfor %}", "without lists in it"),
    ("{% for a in range(2)|zip(range(2), range(2)) %}{% endfor %}", "zip"),
    ("{{ '%0999999999d'|format(1) }}", "two digits"),
    ("{{ '%*d'|format(999999999, 1) }}", "two digits"),
    ("{{ 'x' * 999999999 }}", "`*` needs a number up to 100"),
    ("{{ 'x' * 100 * 100 }}", "in a tag once"),
    ("{{ ('x' ~ 'x') * 100 }}", "without `~`"),
    ("{{ 'x' * tool.number }}", "`*` needs a number"),
    (
        "{{ 'xxxxxxxxxx'|replace('', 'xxxxxxxxxx')|replace('', 'xxxxxxxxxx')|replace('', 'xxxxxxxxxxxxxx') }}",
        "replace makes more",
    ),
    ("{{ range(1000)|join('xxxxxxxxxxxxxxx') }}", "join makes more"),
    ("{{ range(100000)|list }}", "more than 1000 numbers"),
    ("{{ 'a'|indent(999999999) }}", "indent"),
    ("{{ [1]|batch(999999999, 'x') }}", "batch"),
    ("{{ namespace(a='x') }}", "namespace"),
];

#[test]
fn nothing_that_a_template_makes_can_grow_without_bound() {
    let first = Block::Rapid { words: words(&AXES.map(|l| (l, 0.0))) };
    let written = |text: &str| {
        let template = Template { name: "mine.j2".to_owned(), text: format!("%\n{text}\n{{{{ body }}}}") };
        let post = post_file().settings(Some(template)).unwrap();
        write_program(&spec(vec![first.clone()]), &post).map_err(|e| e.to_string())
    };
    for (text, why) in GROWING {
        let e = written(text).expect_err(text);
        assert!(e.starts_with("template mine.j2, line 2: ") && e.contains(why), "{text}: {e}");
    }
    let long = format!("{{{{ {} }}}}", vec!["'x'"; 200].join(" ~ "));
    assert!(written(&long).unwrap_err().contains("a tag of more than 500 bytes"));
    assert!(written(&"(X)\n".repeat(20_000)).unwrap_err().contains("more than 65536"));
    let taken = [
        ("G4 F{{ '%05.1f'|format(spindle.rpm / 100) }}", "G4 F0"),
        ("({{ 'A' ~ 'B' }}{{ ', '|replace(',', '-') }}{{ ['C', 'D']|join('.') }})", "(AB- C.D)"),
        ("({% for a in ['%}', 'E'] if a != '%}' %}{{ a }}{% endfor %})", "(E)"),
        ("({{ '-' * 3 }} {{ 2 ** 3 }} {# * ~ set #}{{ 10 // 3 }})", "(--- 8 3)"),
        ("({% for a in range(3, 0, -1) %}{{ a + 1 }}{% endfor %})", "(432)"),
        ("({% for a in axes|selectattr('rotary')|reverse %}{{ a.letter }}{% endfor %})", "(CB)"),
    ];
    for (text, line) in taken {
        let program = written(text).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert!(program.contains(line), "{text}: {program}");
    }
}

#[test]
fn template_faults_name_their_line() {
    let first = Block::Rapid { words: words(&AXES.map(|l| (l, 0.0))) };
    let render = |text: &str| {
        let template = Template { name: "mine.j2".to_owned(), text: text.to_owned() };
        write_program(&spec(vec![first.clone()]), &post_file().settings(Some(template)).unwrap())
    };
    let message = |text: &str| render(text).unwrap_err().to_string();
    assert!(message("%\nG0\nT{{ tool.nmber }}\n{{ body }}").starts_with("template mine.j2, line 3: undefined value"));
    assert!(message("%\n{% if %}\n{{ body }}").starts_with("template mine.j2, line 2: syntax error"));
    assert!(message("%\n{{ tool.length|fixed(9) }}\n{{ body }}").contains("line 2"));
    assert!(message("%\n").contains("occurs on 0"));
    assert!(message("{{ body }}\n{{ body }}").contains("occurs on 2"));
    assert!(message("G1 {{ body }}").contains("must stand alone"));
    assert!(message("(Prüfung)\n{{ body }}").contains("'Ü'") || message("(Prüfung)\n{{ body }}").contains("'ü'"));
    assert!(message("(a (b))\n{{ body }}").contains("character '('"));
    assert!(message(&format!("({})\n{{{{ body }}}}", "x".repeat(200))).contains("longer than 120 characters"));
    assert_eq!(
        render("g0 x1. (low)\n\n  {{ body }}  \nM30").unwrap(),
        "N1 G0 X1. (LOW)\nN2 G90 G94 G0 X0. Y0. Z0. B0. C0.\nN3 M30\n"
    );
}

/// A block shorter than 60 µs is run in 60 µs: nothing moves faster than it was to.
#[test]
fn the_shortest_block_of_inverse_time_has_the_largest_feed() {
    let first = Block::Rapid { words: words(&AXES.map(|l| (l, 0.0))) };
    let with = |feed: f64| {
        let cut = Block::Linear { words: words(&[(AxisLetter::X, 0.001)]), feed };
        write_program(&spec(vec![first.clone(), cut]), &settings(FeedMode::G93))
    };
    assert!(with(1_794_163.12).unwrap().contains(" X0.001 F999999."));
    assert_eq!(with(1e300).unwrap(), with(999_999.0).unwrap());
    assert!(matches!(with(f64::INFINITY), Err(WriteError::Number { .. })));
}

#[test]
fn what_no_word_can_say_is_refused_with_its_block() {
    let first = Block::Rapid { words: words(&AXES.map(|l| (l, 0.0))) };
    let write = |block: Block| write_program(&spec(vec![first.clone(), block]), &settings(FeedMode::G94)).unwrap_err();
    let cut = |x: f64, feed: f64| Block::Linear { words: words(&[(AxisLetter::X, x)]), feed };
    assert_eq!(write(cut(f64::INFINITY, 1.0)).to_string(), "block 1: inf cannot be written as an axis word");
    assert_eq!(write(cut(1e6, 1.0)).to_string(), "block 1: 1000000 cannot be written as an axis word");
    assert_eq!(write(cut(1.0, 0.04)).to_string(), "block 1: 0.04 cannot be written as a feed in mm/min");
    for feed in [0.0, -5.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(write(cut(1.0, feed)), WriteError::Number { .. }));
    }
    let second_head = AxisLetter::new('X', 2).unwrap();
    let other = Block::Rapid { words: words(&[(second_head, 1.0)]) };
    assert_eq!(write(other).to_string(), "block 1: the machine has no axis X2");
    let cut_first = spec(vec![cut(1.0, 1.0)]);
    assert_eq!(write_program(&cut_first, &settings(FeedMode::G94)), Err(WriteError::FirstMotion));
    assert_eq!(write_program(&spec(vec![]), &settings(FeedMode::G94)), Err(WriteError::FirstMotion));
}

#[test]
fn axes_of_a_second_head_are_written_and_read() {
    let second = |letter| AxisLetter::new(letter, 2).unwrap();
    let mut spec = spec(vec![]);
    spec.axes.push(AxisSpec { letter: second('Z'), min: -1.0, max: 1.0, along_spindle: false, work_offset: 0.0 });
    spec.axes.push(AxisSpec { letter: second('B'), min: -1.0, max: 1.0, along_spindle: false, work_offset: 0.0 });
    let first = words(&[(AxisLetter::Z, 1.0), (second('Z'), -2.5), (second('B'), 30.0)]);
    spec.program.blocks = vec![Block::Rapid { words: first }];
    let text = write_program(&spec, &settings(FeedMode::G94)).unwrap();
    assert!(text.contains("G0 Z1. Z2=-2.5 B2=30.\n"), "{text}");
    let read = read_fanuc(&text).unwrap();
    assert_eq!(body_motions(&read, 1)[0].position.get(second('B')), Some(AxisAt::Word(30.0)));
}

#[test]
fn same_input_gives_the_same_bytes() {
    let blocks = random_blocks(&mut Random(6), 300);
    let write = || write_program(&spec(blocks.clone()), &settings(FeedMode::G94)).unwrap();
    assert_eq!(write(), write());
}

#[test]
fn feeds_are_rounded_down_but_not_below_the_smallest_of_the_control() {
    let mut r = Random(77);
    for round in 0..4000 {
        let mode = MODES[round % 3];
        let decimals = (r.below(4) as u8, 1 + r.below(3) as u8);
        let post = PostFile {
            feed_mode: mode,
            decimals: Decimals { feed: decimals.0, inverse_time: decimals.1, ..Decimals::default() },
            ..post_file()
        };
        let smallest_feed: f64 = [0.0, 0.25, 1.0, 12.34][r.below(4)];
        let unit = 10f64.powi(-i32::from(if mode == FeedMode::G93 { decimals.1 } else { decimals.0 }));
        let smallest = if mode == FeedMode::G93 { 0.0 } else { smallest_feed };
        // Often on a border, a hair beside one, or at the smallest feed.
        let feed = match r.below(5) {
            0 => smallest.max(unit),
            1 => unit * (1 + r.below(100_000)) as f64,
            2 => unit * ((1 + r.below(100_000)) as f64 + (r.unit() - 0.5) * 0.01),
            3 => smallest + unit * r.unit(),
            _ => 20_000.0 * r.unit(),
        };
        let all = words(&AXES.map(|l| (l, 1.5)));
        let cut = Block::Linear { words: words(&[(AxisLetter::X, 2.0)]), feed };
        let approach = Some(all);
        let spec = ProgramSpec { smallest_feed, approach, ..spec(vec![Block::Rapid { words: all }, cut]) };
        let text = write_program(&spec, &post.settings(None).unwrap());
        if feed < smallest || feed < 0.5 * unit {
            assert!(matches!(text, Err(WriteError::Number { .. })), "{mode:?} {feed} {smallest} {text:?}");
            continue;
        }
        let read = read_fanuc(text.unwrap_or_else(|e| panic!("{mode:?} {feed} {smallest} {decimals:?}: {e}"))).unwrap();
        let said = read.motions().filter_map(|(_, m)| m.feed).last().unwrap().value;
        assert!(said > 0.0 && said >= smallest - 1e-9, "{said} for {feed}, at least {smallest}");
        assert!((said - feed).abs() < unit * (1.0 + 1e-5), "{said} for {feed}");
        // Faster only where the next smaller word is one that the control does not take.
        let is_forced = said - unit < smallest.max(unit) - 1e-9;
        assert!(said <= feed + 1e-5 * unit || is_forced, "{said} for {feed}, at least {smallest}");
    }
}
