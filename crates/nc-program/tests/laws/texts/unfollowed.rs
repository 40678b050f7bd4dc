//! Words that controls accept and the readers do not follow: from there on nothing is known, until
//! the text ends it.

use facemill_nc_program::read::{
    AxisAt, MacroKind, MotionKind, NoteKind, ProgramReader, ReadBlock, ReadCommand, read_fanuc, read_haas,
    read_linuxcnc, read_siemens,
};
use facemill_nc_program::words::StateWord;
use facemill_nc_program::*;

const HEAD: &str = "G90 G94 G54\nG0 X1. Y2. Z3.\n";
const KLARTEXT: &str = "L X+1 Y+2 Z+3 R0 FMAX\n";

fn head(dialect: Dialect) -> &'static str {
    if dialect == Dialect::Heidenhain { KLARTEXT } else { HEAD }
}

fn read(text: &str, dialect: Dialect) -> ReadProgram {
    read_program(text, dialect).unwrap_or_else(|e| panic!("{dialect:?}: {e}\n{text}"))
}

fn is_not_followed(block: &ReadBlock) -> bool {
    block.commands.iter().any(|c| matches!(c, ReadCommand::Macro { kind: MacroKind::NotFollowed, .. }))
}

fn letter(name: char) -> AxisLetter {
    AxisLetter::new(name, 0).unwrap()
}

/// Where X, Y and Z are at the last motion; `None` without one, and of those that are not known.
fn last(program: &ReadProgram) -> Option<[Option<AxisAt>; 3]> {
    let (_, motion) = program.motions().last()?;
    Some(['X', 'Y', 'Z'].map(|name| motion.position.get(letter(name))))
}

/// Beginning, a line with words within, and end; empty where no end is known.
const MODAL: [(Dialect, &str, &str, &str); 30] = [
    (Dialect::Fanuc, "G41 D1 X5.", "G1 X6. Y7. F100.", "G40"),
    (Dialect::Haas, "G42 X5. D1", "G1 X6. Y7. F100.", "G40"),
    (Dialect::Haas, "G141 X5. I1. J0. K0. D1", "G1 X6. I1. J0. K0. F100.", "G40"),
    (Dialect::Fanuc, "G41.2 X5. D1", "G1 X6. F100.", "G40"),
    (Dialect::Fanuc, "G43.5 H1 X5. I0. J0. K1.", "G1 X6. I0. J0. K1. F100.", "G49"),
    (Dialect::Mazak, "G43.5 H1 X5. I0. J0. K1.", "G1 X6. I0. J0. K1. F100.", "G49"),
    (Dialect::Fanuc, "G68.2 X0. Y0. Z0. I10. J20. K30.", "G0 X6. Y7.", "G69"),
    (Dialect::Mazak, "G68.2 P1 Q123 X0. Y0. Z0. I10. J20. K30.", "G0 X6. Y7.", "G69"),
    (Dialect::Mazak, "G68.5 X0. Y0. I0. J0. K1. R30.", "G0 X6.", "G69.5"),
    (Dialect::Haas, "G268 X0. Y0. Z0. I10. J20. K0. Q321", "G0 X6.", "G269"),
    (Dialect::Fanuc, "G68 X0. Y0. R45.", "G0 X6.", "G69"),
    (Dialect::Fanuc, "G51 X0. Y0. Z0. P2.", "G0 X6.", "G50"),
    (Dialect::Fanuc, "G51.1 X0.", "G0 X6.", "G50.1"),
    (Dialect::Fanuc, "G16", "G0 X6. Y30.", "G15"),
    (Dialect::Fanuc, "G12.1", "G1 X6. C30. F100.", "G13.1"),
    (Dialect::Fanuc, "G44 H1 Z5.", "G0 X6.", "G49"),
    (Dialect::Fanuc, "G95", "G1 X6. F.2", "G94"),
    (Dialect::Fanuc, "G5 X1. Y1. I1. J1. P2. Q2.", "X6.", "G1"),
    (Dialect::Fanuc, "G33 Z-5. F2.", "Z-6.", "G0"),
    (Dialect::LinuxCnc, "G41 D1 X5", "G1 X6 F100", "G40"),
    (Dialect::LinuxCnc, "G41.1 D5 X5", "G1 X6 F100", "G40"),
    (Dialect::LinuxCnc, "G7", "G1 X6 F100", "G8"),
    (Dialect::Siemens840d, "G41 X5", "G1 X6 Y7 F100", "G40"),
    (Dialect::Siemens840d, "BSPLINE X5 Y6 PW=2", "X6 Y7", "G1"),
    (Dialect::Siemens840d, "TRANSMIT", "G1 X6 Y7 F100", "TRAFOOF"),
    (Dialect::Siemens840d, "G95", "G1 X6 F.2", "G94"),
    (Dialect::Siemens840d, "RNDM=2", "G1 X6 Y7 F100", "RNDM=0"),
    (Dialect::Heidenhain, "L X+5 Y+0 RL F100", "L X+6 Y+7", "L R0"),
    (Dialect::Heidenhain, "APPR LT X+5 Y+0 LEN15 RR F100", "L X+6 Y+7", "DEP LT LEN20 F1000"),
    (Dialect::Heidenhain, "M136", "L X+6 F0.2", "M137"),
];

#[test]
fn nothing_is_known_from_where_it_begins_until_it_ends_and_axes_are_named_again() {
    for (dialect, on, within, off) in MODAL {
        let head = head(dialect);
        let begun = read(&format!("{head}{on}\n{within}\n"), dialect);
        let [.., first, second] = begun.blocks.as_slice() else { panic!("{on}") };
        for block in [first, second] {
            assert!(is_not_followed(block) && block.motion.is_none(), "{dialect:?} {on}: {block:?}");
        }
        assert!(!begun.is_evaluated(), "{on}");
        // Between, an axis that is not named is not known; behind all, one that is.
        let one = if dialect == Dialect::Heidenhain { "L X+8 R0 FMAX" } else { "G0 X8." };
        let ended = read(&format!("{head}{on}\n{within}\n{off}\n{one}\n"), dialect);
        assert!(!is_not_followed(ended.blocks.last().unwrap()), "{dialect:?} {on} {off}");
        assert_eq!(last(&ended), Some([Some(AxisAt::Word(8.0)), None, None]), "{dialect:?} {on} {off}");
        // A block of another kind is read as ever.
        let spindle = read(&format!("{head}{on}\nM5\n"), dialect);
        assert_eq!(spindle.blocks.last().unwrap().commands, [ReadCommand::SpindleOff], "{on}");
    }
}

#[test]
fn what_is_of_one_block_alone_ends_with_it() {
    for (dialect, block) in [
        (Dialect::Haas, "G60 X5."),
        (Dialect::LinuxCnc, "G1 @5 ^30 F100"),
        (Dialect::LinuxCnc, "G0 @[2+3] ^#1"),
        (Dialect::LinuxCnc, "G1 X5 ^30 F100"),
        (Dialect::Siemens840d, "MEAS=1 G1 X5 F100"),
        (Dialect::Siemens840d, "MEASA[X]=(1,1,-1) G1 X5 F100"),
        (Dialect::Siemens840d, "MEAWA[X]=(2, 1) X5"),
        (Dialect::Fanuc, "G1 X5. ,A30. F100."),
        (Dialect::Fanuc, "G45 X5. D1"),
        (Dialect::Siemens840d, "G1 X5 LEAD=5"),
        (Dialect::Siemens840d, "G147 X5 DISR=5"),
        (Dialect::Siemens840d, "G1 AP=30 RP=5"),
        (Dialect::Siemens840d, "POS[X]=5"),
        (Dialect::Heidenhain, "CT X+5 Y+5"),
        (Dialect::Heidenhain, "FL PR+5"),
        (Dialect::Heidenhain, "L X+5 M92"),
    ] {
        let one = if dialect == Dialect::Heidenhain { "L X+8 R0 FMAX" } else { "G0 X8." };
        let read = read(&format!("{}{block}\n{one}\n", head(dialect)), dialect);
        let [.., left, behind] = read.blocks.as_slice() else { panic!("{block}") };
        assert!(is_not_followed(left) && !is_not_followed(behind), "{block}");
        assert_eq!(last(&read), Some([Some(AxisAt::Word(8.0)), None, None]), "{block}");
    }
}

#[test]
fn a_corner_that_is_rounded_is_reported_and_later_words_are_what_they_seem() {
    for (dialect, block, next) in [
        (Dialect::Fanuc, "G1 X5. ,R2. F100.", "G1 Y9."),
        (Dialect::Haas, "G1 X5. ,C2. F100.", "G1 Y9."),
        (Dialect::Mazak, "G1 X5. , R 2. F100.", "G1 Y9."),
        (Dialect::Siemens840d, "G1 X5 RND=2 F100", "G1 Y9"),
        (Dialect::Heidenhain, "L X+5 F100\nRND R2", "L Y+9"),
    ] {
        let read = read(&format!("{}{block}\n{next}\n", head(dialect)), dialect);
        assert_eq!(read.blocks.iter().filter(|b| is_not_followed(b)).count(), 1, "{block}");
        let at = [5.0, 9.0, 3.0].map(|v| Some(AxisAt::Word(v)));
        assert_eq!(last(&read), Some(at), "{block}");
    }
    assert!(read_linuxcnc("G1 X5 ,R2 F100").is_err());
}

#[test]
fn a_way_to_the_reference_within_what_is_not_followed_ends_where_it_says() {
    let text = format!("{HEAD}G68.2 X0. Y0. Z0. I10. J20. K30.\nG0 X5.\nG91 G28 Z0.\nG69\nG90 G0 X1. Y2.\n");
    let at = Some([Some(AxisAt::Word(1.0)), Some(AxisAt::Word(2.0)), Some(AxisAt::Reference(1))]);
    assert_eq!(last(&read(&text, Dialect::Fanuc)), at);
}

/// The point that it goes over is in words, which say no positions there.
#[test]
fn a_way_to_the_reference_over_a_point_in_words_that_are_not_followed_is_not_followed() {
    for (on, is_open) in [("G68 X0. Y0. R30.", true), ("G69", false)] {
        let program = read(&format!("{HEAD}{on}\nG28 Z50.\n"), Dialect::Fanuc);
        let block = program.blocks.last().unwrap();
        let motion = block.motion.as_ref().unwrap();
        assert_eq!((is_not_followed(block), motion.via.is_none()), (is_open, is_open), "{on}");
        assert_eq!(motion.position.get(letter('Z')), Some(AxisAt::Reference(1)), "{on}");
    }
}

/// F of one meaning is no number of another one.
#[test]
fn a_feed_is_lost_when_its_meaning_changes() {
    let feed = |text: &str, dialect: Dialect| {
        let program = read(text, dialect);
        let (_, motion) = program.motions().last().unwrap();
        (motion.feed.map(|feed| feed.value), motion.feed_mode)
    };
    for dialect in [Dialect::Fanuc, Dialect::Haas, Dialect::Mazak, Dialect::LinuxCnc, Dialect::Siemens840d] {
        let [mm, inch] = if dialect == Dialect::Siemens840d { ["G710", "G700"] } else { ["G21", "G20"] };
        for (words, expected) in [
            (mm, (Some(500.0), FeedMode::G94)),
            (inch, (None, FeedMode::G94)),
            (&format!("{inch}\n{mm}"), (None, FeedMode::G94)),
            ("G94", (Some(500.0), FeedMode::G94)),
            ("G95 F0.2\nG94", (None, FeedMode::G94)),
            ("G95\nG94", (None, FeedMode::G94)),
            ("G95 F0.2\nG94 F300.", (Some(300.0), FeedMode::G94)),
            ("G93", (None, FeedMode::G93)),
            ("G93\nG94", (None, FeedMode::G94)),
        ] {
            let text = format!("{HEAD}G1 X2. F500.\n{words}\nG1 X3. Y2. Z3.\n");
            assert_eq!(feed(&text, dialect), expected, "{dialect:?} {words}");
        }
    }
    for (words, expected) in [("M5", Some(500.0)), ("M136\nL X+6 F0.2\nM137", None)] {
        let text = format!("{KLARTEXT}L X+2 F500\n{words}\nL X+3 Y+2 Z+3\n");
        assert_eq!(feed(&text, Dialect::Heidenhain), (expected, FeedMode::G94), "{words}");
    }
}

#[test]
fn a_mark_before_the_first_line_changes_nothing() {
    for dialect in [Dialect::Fanuc, Dialect::Haas, Dialect::LinuxCnc, Dialect::Siemens840d, Dialect::Heidenhain] {
        let cut = if dialect == Dialect::Heidenhain { "L X+5 F100\n" } else { "G1 X5. F100.\n" };
        for start in ["", "%\n"] {
            if !start.is_empty() && dialect == Dialect::Heidenhain {
                continue;
            }
            let text = format!("{start}{}{cut}", head(dialect));
            let marked = format!("\u{feff}{text}");
            let (plain, read) = (read(&text, dialect), read(&marked, dialect));
            let key = |p: &ReadProgram| -> Vec<_> {
                p.blocks.iter().map(|b| (b.line, b.text.clone(), b.motion.clone(), b.commands.clone())).collect()
            };
            assert_eq!(key(&read), key(&plain), "{dialect:?}");
            let span = read.blocks.last().and_then(ReadBlock::feed_span).unwrap();
            assert!(marked[span].starts_with("F100"), "{dialect:?}");
        }
        // On the first line itself.
        let first = format!("\u{feff}{cut}");
        let read = read_program(&first, dialect).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(&first[read.blocks[0].feed_span().unwrap()].trim_end_matches('.')[..4], "F100", "{dialect:?}");
    }
}

#[test]
fn text_before_the_first_mark_is_passed_by_where_the_program_is_between_two() {
    let body = "O1234 (PART)\nG90 G0 X1. Y2. Z3.\nM30\n";
    for dialect in [Dialect::Fanuc, Dialect::Haas, Dialect::Mazak] {
        for leader in ["PROGRAM 5 OF JOB\n\nMADE BY A POST\n", "; HEADER\n", "===\n"] {
            let text = format!("{leader}%\n{body}%\n");
            let found = read(&text, dialect);
            assert_eq!(last(&found), Some([1.0, 2.0, 3.0].map(|v| Some(AxisAt::Word(v)))), "{leader}");
            assert_eq!(found.notes, [], "{leader}");
            // Line by line, too.
            let mut lines = ProgramReader::of_text(dialect, text.as_bytes());
            let motions =
                text.split('\n').filter_map(|l| lines.read_line(l.as_bytes()).unwrap()).filter_map(|b| b.motion);
            assert_eq!(motions.count(), 1);
        }
        // A program in front of the mark is none of these: the text behind it is not run.
        let two = read(&format!("{body}%\n{body}%\n"), dialect);
        assert!(two.notes.iter().any(|n| n.kind == NoteKind::BehindEnd), "{:?}", two.notes);
        assert!(read_program(format!("NOTHING\n{body}%\n"), dialect).is_err());
        assert!(last(&read(&format!("%{body}%\n"), dialect)).is_some());
    }
}

#[test]
fn comments_may_have_parentheses_inside_but_no_words_behind_them() {
    let text = |comment: &str| format!("{HEAD}{comment}\nG1 X5. F100.\n");
    for comment in ["(TOOL (D10) BALL)", "(A (B (C)))", "G1 X4. F9. (END MILL (LONG))"] {
        let read = read(&text(comment), Dialect::Haas);
        assert!(read.is_evaluated() && last(&read).is_some(), "{comment}");
    }
    // Up to the first `)` it is a comment on other controls, and then there are words.
    let doubtful = read(&text("(DRILL (10) G0 Z-5.)"), Dialect::Fanuc);
    assert!(!doubtful.is_evaluated() && last(&doubtful).unwrap()[2].is_none());
    assert!(read_linuxcnc("(A (B) C)\n").is_err());
}

#[test]
fn a_motion_before_any_motion_word_is_a_rapid_and_one_behind_a_call_is_not_known() {
    let first = read("G90 G54\nG43 Z100. H1\nG0 X1. Y2.\n", Dialect::Haas);
    let kinds: Vec<MotionKind> = first.motions().map(|(_, m)| m.kind).collect();
    assert_eq!(kinds, [MotionKind::Rapid, MotionKind::Rapid]);
    let said: Vec<bool> = first.motions().map(|(b, _)| b.said.has(StateWord::Motion)).collect();
    assert_eq!(said, [false, true]);
    for (dialect, call) in [(Dialect::Fanuc, "M98 P1000"), (Dialect::LinuxCnc, "M100"), (Dialect::Siemens840d, "L100")]
    {
        let behind = read(&format!("{HEAD}{call}\nX5. Y5.\nG0 X8.\n"), dialect);
        let [.., open, _] = behind.blocks.as_slice() else { panic!("{call}") };
        assert!(is_not_followed(open) && open.motion.is_none(), "{call}");
        assert_eq!(last(&behind), Some([Some(AxisAt::Word(8.0)), None, None]), "{call}");
    }
}

#[test]
fn machine_values_in_increments_are_known_on_linuxcnc_alone() {
    for dialect in [Dialect::Fanuc, Dialect::Haas, Dialect::Mazak] {
        let read = read(&format!("{HEAD}G91\nG53 G0 Z0.\n"), dialect);
        assert_eq!(last(&read).unwrap()[2], None, "{dialect:?}");
        assert!(!read.is_evaluated(), "{dialect:?}");
    }
    let read = read(&format!("{HEAD}G91\nG53 G0 Z0.\n"), Dialect::LinuxCnc);
    assert_eq!(last(&read).unwrap()[2], Some(AxisAt::Machine(0.0)));
}

#[test]
fn functions_with_arguments_are_the_machine_builders() {
    for (dialect, text) in [(Dialect::Siemens840d, "M202(0.0024)"), (Dialect::Fanuc, "M202(0.0024)")] {
        let commands: Vec<_> = read(text, dialect).blocks.into_iter().flat_map(|b| b.commands).collect();
        assert!(commands.contains(&ReadCommand::Function(202)), "{commands:?}");
    }
}

#[test]
fn nothing_is_known_behind_a_code_or_statement_that_the_reader_does_not_know() {
    for (dialect, line) in [
        (Dialect::Fanuc, "G77.7"),
        (Dialect::Fanuc, "G10.6 X1."),
        (Dialect::Haas, "G2.4 X1. Y2. Z3. I1. J1. K1."),
        (Dialect::Mazak, "G41.1"),
        (Dialect::LinuxCnc, "G6.2 X1 Y2 P1"),
        (Dialect::LinuxCnc, "(PY, move)"),
        (Dialect::LinuxCnc, "X5 ; py,move"),
        (Dialect::Siemens840d, "G77"),
        (Dialect::Siemens840d, "INIT(2,\"/_N_MPF_DIR/_N_X_MPF\")"),
        (Dialect::Siemens840d, "START(2)"),
        (Dialect::Heidenhain, "PRESET SELECT #2"),
        (Dialect::Heidenhain, "SECTION MONITORING START"),
        (Dialect::Heidenhain, "FUNCTION MODE MILL \"KIN2\""),
        (Dialect::Heidenhain, "FUNCTION MODE MILL \"KIN2\"\nFUNCTION MODE MILL"),
        (Dialect::Heidenhain, "RND R2 M128"),
    ] {
        let axis = if dialect == Dialect::Heidenhain { "L Y+5 R0 FMAX" } else { "G0 Y5." };
        let program = read(&format!("{}{line}\n{axis}\n", head(dialect)), dialect);
        assert!(!program.is_evaluated(), "{dialect:?} {line}");
        let x = last(&program).and_then(|places| places[0]);
        let named_later = program.blocks.last().is_some_and(|b| b.motion.is_some());
        assert!(x.is_none() || !named_later, "{dialect:?} {line}: {x:?}");
    }
    // Comments that only begin alike are comments, and so are all of other controls.
    for (dialect, line) in [(Dialect::LinuxCnc, "(POLYGON)"), (Dialect::Fanuc, "(PY, move)")] {
        assert!(read(&format!("{HEAD}{line}\n"), dialect).is_evaluated(), "{line}");
    }
}

#[test]
fn powers_of_ten_of_siemens_are_numbers() {
    for (text, value) in
        [("G0 X=1EX1", 10.0), ("G0 X=1.5EX-1", 0.15), ("G0 X=-2EX+2+1", -199.0), ("G0 X=1EX39", f64::NAN)]
    {
        let program = read_program(text, Dialect::Siemens840d).ok();
        let x = program.and_then(|p| p.motions().last().and_then(|(_, m)| m.position.get(letter('X'))));
        assert_eq!(x, (!value.is_nan()).then_some(AxisAt::Word(value)), "{text}");
    }
}

/// Lines between are of another language, in which words mean other things.
#[test]
fn a_part_in_the_iso_language_of_siemens_is_kept_and_nothing_is_known_from_there_on() {
    let text = format!("{HEAD}G291\nG43 H1 Z5. (COMMENT)\n#100=5.\nG1 X[#100] F100.\nN50 G290\nG1 X5 F100\nM30\n");
    let program = read(&text, Dialect::Siemens840d);
    assert!(!program.is_evaluated());
    let left: Vec<u32> = program.blocks.iter().filter(|b| is_not_followed(b)).map(|b| b.line).collect();
    assert_eq!(left, [3, 4, 5, 6, 8]);
    assert!(program.motions().all(|(b, _)| b.line < 3));
    assert_eq!(program.blocks.last().unwrap().commands, [ReadCommand::End]);
    // A part that is never left is so up to the end, which its M30 is.
    let open = read(&format!("{HEAD}G291\nX1.5 (A)\nN5 M30\n"), Dialect::Siemens840d);
    assert!(open.blocks.last().unwrap().commands.contains(&ReadCommand::End));
    // Measuring on the fly leaves the path as it is.
    let flying = read(&format!("{HEAD}MEAC[X]=(1,1,-1) G1 X5 F100\n"), Dialect::Siemens840d);
    assert_eq!(last(&flying).unwrap()[0], Some(AxisAt::Word(5.0)));
    assert!(read_siemens("VALUE=(1,2\n").is_err());
}

#[test]
fn lines_of_a_parameter_input_are_data_and_move_nothing() {
    for (dialect, begin) in [(Dialect::Fanuc, "G10 L50"), (Dialect::Mazak, "G10L50"), (Dialect::Fanuc, "N5 G10 L52")] {
        let text = format!("{HEAD}{begin}\nN1020 P1 R88\nN1420 P2 R10000\nN3401 R00000001\nG11\nG1 X5. F100.\n");
        let program = read(&text, dialect);
        assert!(!program.is_evaluated(), "{begin}");
        let settings: Vec<u32> = program
            .blocks
            .iter()
            .filter(|b| b.commands.iter().any(|c| matches!(c, ReadCommand::Macro { kind: MacroKind::Setting, .. })))
            .map(|b| b.line)
            .collect();
        assert_eq!(settings, [3, 4, 5, 6], "{begin}");
        assert!(program.blocks.iter().all(|b| b.number.is_none_or(|n| n < 1000)), "{begin}");
        assert_eq!(program.motions().last().unwrap().0.line, 8, "{begin}");
        assert_eq!(last(&program), Some([Some(AxisAt::Word(5.0)), None, None]), "{begin}");
    }
    // Nothing ends it: all is data, M30 too.
    let open = read(&format!("{HEAD}G10 L50\nN1020 P1 R88\nG1 X5. F100.\nM30\n"), Dialect::Fanuc);
    assert!(open.motions().all(|(b, _)| b.line < 3));
    assert!(!open.blocks.iter().any(|b| b.commands.contains(&ReadCommand::End)));
    assert!(read_haas("G10 L50\nN1020 P1 R88\n").is_err());
}

#[test]
fn words_behind_a_skip_mark_inside_a_block_may_be_left_out() {
    for (dialect, line) in [
        (Dialect::Fanuc, "N10 G1 X5. F100. /2 Y6."),
        (Dialect::Haas, "G1 X5. F100. / Y6."),
        (Dialect::Mazak, "N10 /3 G1 X5. Y6. F100."),
        (Dialect::Fanuc, "N10 /#5=6. G1 X5. Y6. F100."),
    ] {
        let program = read(&format!("{HEAD}{line}\n"), dialect);
        let block = program.blocks.last().unwrap();
        assert!(block.skippable, "{line}");
        assert!(program.notes.iter().any(|n| n.kind == NoteKind::Skippable), "{line}");
        assert_eq!(last(&program), Some([5.0, 6.0, 3.0].map(|v| Some(AxisAt::Word(v)))), "{line}");
    }
    // A feed that is put in is none of what may be left out.
    let text = format!("{HEAD}G1 X5. /2 M8\n");
    let at = read(&text, Dialect::Fanuc).blocks.last().unwrap().insert_feed_at().unwrap();
    assert!(text[..at].ends_with("X5."), "{}", &text[..at]);
    for wrong in ["G1 X5. /22 Y6.", "G1 X5. /. Y6.", "G1 X5. /X"] {
        assert!(read_fanuc(wrong).is_err(), "{wrong}");
    }
    assert!(read_linuxcnc("G1 X5 /2 Y6").is_err());
}
