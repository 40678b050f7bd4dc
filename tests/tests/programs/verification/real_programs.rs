//! Programs from public sources are read whole: no block of them is not understood, and what is
//! found in them is what a plain count of their words finds.

use std::{collections::BTreeSet, path::Path};

use facemill::cl_file::{AptFile, AptMeaning, AptPointKind, read_apt};
use facemill::nc_program::ReadProgram;
use facemill::nc_program::read::{
    CallKind, MacroKind, MotionKind, ReadCommand, ReadError, read_linuxcnc, read_siemens,
};
use facemill::nc_program::words::AxisKind;
use facemill_test_kit::SHARED_NC;

type Reader = fn(&[u8]) -> Result<ReadProgram, ReadError>;

const LINUXCNC: Reader = |text| read_linuxcnc(text);
const SIEMENS: Reader = |text| read_siemens(text);

const PROGRAMS: [(&str, Reader); 6] = [
    ("impeller-7bl-xyzac.ngc", LINUXCNC),
    ("xyzab-tdr-demo.ngc", LINUXCNC),
    ("5axisgui.ngc", LINUXCNC),
    ("Keychain_Schluesselanhaenger.mpf", SIEMENS),
    ("Coordinate_system_representation_Achskreuz.mpf", SIEMENS),
    ("Bottle_opener_Flaschenoeffner.txt", SIEMENS),
];

const APT_FILES: [&str; 3] = ["aamorim_Interface-glue.apt", "aamorim_basemach.apt", "aamorim_manufacture3-top.apt"];

fn shared(name: &str) -> Option<String> {
    let path = Path::new(SHARED_NC).join(name);
    let text = std::fs::read(&path).ok();
    if text.is_none() {
        eprintln!("skipped: {} is not there", path.display());
    }
    text.map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
}

fn read(name: &str, text: &str, reader: Reader) -> ReadProgram {
    reader(text.as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Content of a program.
#[derive(Debug, Default, PartialEq, Eq)]
struct Summary {
    blocks: usize,
    rapids: usize,
    linear: usize,
    arcs: usize,
    cycle_positions: usize,
    /// Motions that name a rotary axis.
    rotary: usize,
    axes: BTreeSet<String>,
    /// F words.
    feeds: usize,
    cycles: usize,
    calls: usize,
    settings: usize,
    branches: usize,
    not_evaluated: usize,
}

fn summary(program: &ReadProgram) -> Summary {
    let mut found = Summary { blocks: program.blocks.len(), ..Summary::default() };
    for block in &program.blocks {
        found.feeds += usize::from(block.feed_span().is_some());
        for command in &block.commands {
            let count = match command {
                ReadCommand::Call(call) if matches!(call.kind, CallKind::Cycle | CallKind::Definition) => {
                    &mut found.cycles
                }
                ReadCommand::Call(_) => &mut found.calls,
                ReadCommand::Macro { kind: MacroKind::Setting, .. } => &mut found.settings,
                ReadCommand::Macro { kind: MacroKind::Branch, .. } => &mut found.branches,
                ReadCommand::Macro { kind: MacroKind::VariableWords | MacroKind::ToolVector, .. } => {
                    &mut found.not_evaluated
                }
                _ => continue,
            };
            *count += 1;
        }
        let Some(motion) = &block.motion else { continue };
        *match motion.kind {
            MotionKind::Rapid | MotionKind::ReferenceReturn => &mut found.rapids,
            MotionKind::Linear => &mut found.linear,
            MotionKind::Arc { .. } => &mut found.arcs,
            MotionKind::Cycle { .. } => &mut found.cycle_positions,
            uncounted => panic!("{uncounted:?} is not counted"),
        } += 1;
        let axes = motion.position.iter().map(|(axis, _)| axis).filter(|axis| motion.position.is_programmed(*axis));
        let axes: Vec<_> = axes.collect();
        found.rotary += usize::from(axes.iter().any(|axis| axis.kind() == AxisKind::Rotary));
        found.axes.extend(axes.iter().map(ToString::to_string));
    }
    found
}

/// Motions by kind as a plain count of words finds them: rapid, linear, arcs, and those with a
/// rotary word. It knows modal G0 to G3, words in one piece, and nothing else.
fn plain_count(text: &str) -> [usize; 4] {
    let mut counts = [0; 4];
    let mut mode = 0;
    for line in text.lines() {
        let code = line.split(';').next().unwrap_or_default().to_ascii_uppercase();
        let is_setting = ["TRANS", "AROT", "MCALL", "MSG", "G10", "DEF", "(", "#", "O"];
        let body = code.trim_start_matches(|c: char| c == 'N' || c.is_ascii_digit()).trim_start();
        if is_setting.iter().any(|word| body.starts_with(word)) || body.starts_with('_') {
            continue;
        }
        let (mut moves, mut turns) = (false, false);
        for word in body.split_whitespace() {
            let (letter, rest) = word.split_at(1);
            let is_value = rest.is_empty() || rest.starts_with(|c: char| "0123456789.-+=#[".contains(c));
            match letter {
                "G" if ["0", "1", "2", "3"].contains(&rest) => mode = rest.parse().unwrap(),
                "X" | "Y" | "Z" | "W" if is_value => moves = true,
                "A" | "B" | "C" if is_value => (moves, turns) = (true, true),
                _ => {}
            }
        }
        counts[[0, 1, 2, 2][mode]] += usize::from(moves);
        counts[3] += usize::from(turns && moves);
    }
    counts
}

#[test]
fn published_programs_hold_what_a_plain_count_finds() {
    for (name, reader) in PROGRAMS {
        let Some(text) = shared(name) else { continue };
        let found = summary(&read(name, &text, reader));
        if name == "5axisgui.ngc" {
            // Its words have no blanks between them.
            continue;
        }
        let [rapids, linear, arcs, rotary] = plain_count(&text);
        // The reader alone distinguishes the positions of the drilling cycle.
        assert_eq!(found.rapids + found.linear + found.cycle_positions, rapids + linear, "{name}");
        assert!(found.cycle_positions > 0 || (found.rapids, found.linear) == (rapids, linear), "{name}");
        assert_eq!((found.arcs, found.rotary), (arcs, rotary), "{name}");
        let lines = text.lines().filter(|l| !l.trim().is_empty()).count();
        assert_eq!(found.blocks, lines, "{name}");
        let cycles = text.lines().filter(|l| l.contains("CYCLE")).count();
        assert_eq!(found.cycles, cycles, "{name}");
        let frames = text
            .lines()
            .filter(|l| l.contains("TRANS ") || l.contains("AROT ") || l.starts_with("g10") || l.starts_with("M61"));
        assert_eq!((found.settings, found.branches), (frames.count(), 0), "{name}");
        let is_feed = |w: &str| {
            w.starts_with(['F', 'f']) && w.len() > 1 && w[1..].bytes().all(|b| b.is_ascii_digit() || b == b'.')
        };
        // A blank may stand behind the F.
        let joined = text.replace("F ", "F");
        let words = joined.lines().flat_map(|l| l.split([';', '(']).next().unwrap().split_whitespace());
        assert_eq!(found.feeds, words.filter(|w| is_feed(w)).count(), "{name}");
    }
}

#[test]
fn feeds_of_published_programs_are_cut_out_and_put_back() {
    for (name, reader) in PROGRAMS {
        let Some(text) = shared(name) else { continue };
        let program = read(name, &text, reader);
        let (mut same, mut halved, mut end) = (String::new(), String::new(), 0);
        for block in &program.blocks {
            let Some(number) = block.feed_place.number_span() else { continue };
            for out in [&mut same, &mut halved] {
                out.push_str(&text[end..number.start]);
            }
            same.push_str(&text[number.clone()]);
            match text[number.clone()].parse::<f64>() {
                Ok(feed) => halved.push_str(&format!("{}", 0.5 * feed)),
                Err(_) => halved.push_str(&text[number.clone()]),
            }
            end = number.end;
        }
        same.push_str(&text[end..]);
        halved.push_str(&text[end..]);
        assert_eq!(same, text, "{name}");
        let again = read(name, &halved, reader);
        assert_eq!(again.blocks.len(), program.blocks.len(), "{name}");
        for ((_, a), (_, b)) in program.motions().zip(again.motions()) {
            assert_eq!((&a.position, a.kind, &a.arc), (&b.position, b.kind, &b.arc), "{name}");
            let is_variable = name == "5axisgui.ngc";
            assert!(is_variable || a.feed.map(|f| 0.5 * f.value) == b.feed.map(|f| f.value), "{name}");
        }
    }
}

/// Loops are kept and not run: dependences on their variables are reported, and nothing else.
#[test]
fn loops_of_a_published_program_are_kept() {
    let Some(text) = shared("5axisgui.ngc") else { return };
    let program = read("5axisgui.ngc", &text, LINUXCNC);
    let found = summary(&program);
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    assert_eq!(found.branches, lines.iter().filter(|l| l.starts_with('o')).count());
    let is_known =
        |command: &ReadCommand| !matches!(command, ReadCommand::Macro { kind: MacroKind::VariableWords, .. });
    let inside = lines.iter().position(|l| l.starts_with("o100 while")).unwrap()..lines.len();
    for block in &program.blocks {
        let line = lines[block.line as usize - 1];
        let uses = !line.starts_with(['#', 'o']) && line.contains('#');
        let is_unknown = uses && inside.contains(&(block.line as usize - 1));
        // The place where the frame is set does not matter to it: a setting is reported as such.
        let is_setting = line.starts_with("g10");
        assert_eq!(!block.commands.iter().all(is_known), is_unknown && !is_setting, "{line}");
    }
}

#[test]
fn published_apt_files_hold_what_a_plain_count_finds() {
    for name in APT_FILES {
        let Some(text) = shared(name) else { continue };
        let file = read_apt(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
        let lines = |start: &str| text.lines().filter(|l| l.starts_with(start)).count();
        assert_eq!(file.unknown, [], "{name}");
        assert!(file.statements.iter().all(|s| s.meaning != AptMeaning::Unknown), "{name}");
        assert_eq!(file.statements.len(), text.lines().filter(|l| !l.trim().is_empty()).count(), "{name}");
        assert_eq!(file.points.len(), lines("GOTO"), "{name}");
        let found = apt_summary(&file);
        assert_eq!((found.feeds, found.frames), (lines("FEDRAT"), lines("CSYS")), "{name}");
        assert_eq!(found.points.iter().sum::<usize>(), file.points.len(), "{name}");
        assert_eq!(found.points[2], lines("CIRCLE"), "{name}");
        assert_eq!(found.cycles, lines("CYCLE") - lines("CYCLE/OFF") - lines("CYCLE/INIT"), "{name}");
    }
}

/// Content of an APT file.
struct AptSummary {
    /// Rapid, linear, arc, at cycle positions.
    points: [usize; 4],
    feeds: usize,
    cycles: usize,
    frames: usize,
    offsets: usize,
}

fn apt_summary(file: &AptFile) -> AptSummary {
    let of = |kinds: &[AptPointKind]| file.points.iter().filter(|p| kinds.contains(&p.kind)).count();
    let points = [
        of(&[AptPointKind::Rapid, AptPointKind::Start]),
        of(&[AptPointKind::Linear]),
        of(&[AptPointKind::Arc]),
        of(&[AptPointKind::Cycle]),
    ];
    let count = |is_meant: fn(&AptMeaning) -> bool| file.statements.iter().filter(|s| is_meant(&s.meaning)).count();
    let cycles = file.statements.iter().filter(|s| s.meaning == AptMeaning::Cycle(true) && !s.text.contains("INIT"));
    AptSummary {
        points,
        feeds: count(|m| matches!(m, AptMeaning::Feed(_))),
        cycles: cycles.count(),
        frames: count(|m| matches!(m, AptMeaning::Frame(Some(_)))),
        offsets: count(|m| matches!(m, AptMeaning::RadiusCompensation(true))),
    }
}

/// The same features in short, counted by hand.
#[test]
fn short_programs_hold_what_was_put_in() {
    let siemens = "N10 ;Start\nDEF REAL _tol=.02, _HOME\n_HOME=610.\nCYCLE800()\nSUPA G0 Z=_HOME D0\nT=\"FACE; D80\"\nM6\n\
                   CYCLE832(_tol,1,1)\nG0 X0 Y0 Z5 B0 C0 S100 D1 M3\nG1 Z0 F200.\nX5\nG3 X7 Y2 I0 J2\n\
                   G2 X9 Y4 I=AC(9) J2 TURN=1\nTRANS X1\nAROT Z90\nG0 X=IC(5)\nMCALL CYCLE81(5,0,2,-3)\nX1 Y1\nMCALL\n\
                   MY_SUB(1,2)\nG0 X1 Y1 Z=R7\nIF R1>0 GOTOF AB\nAB:\nM30\n";
    let found = summary(&read("siemens", siemens, SIEMENS));
    let axes = ["B", "C", "X", "Y", "Z"].map(str::to_owned).into();
    let expected = Summary {
        blocks: 24,
        rapids: 4,
        linear: 2,
        arcs: 2,
        cycle_positions: 1,
        rotary: 1,
        axes,
        feeds: 1,
        cycles: 3,
        calls: 1,
        settings: 2,
        branches: 1,
        // X by a way from where the frame has moved it, and Z.
        not_evaluated: 2,
    };
    assert_eq!(found, expected);
    let linuxcnc = "#<r> = 60\ng21 g90\ng53 g0 x0y0z[#<r>*2]b0c0\nm428\ng93 g1 x1 a5 f 2.5\nx2 a6 f3\no1 while [#1 lt 5]\n\
                    g0 x#<r>\no1 endwhile\no<sub> call [1]\ng10 l2 p1 x0\ng94 g0 x1\nf100\nm2";
    let found = summary(&read("linuxcnc", linuxcnc, LINUXCNC));
    let expected = Summary {
        blocks: 14,
        rapids: 3,
        linear: 2,
        rotary: 3,
        axes: ["A", "B", "C", "X", "Y", "Z"].map(str::to_owned).into(),
        feeds: 3,
        calls: 1,
        settings: 1,
        branches: 2,
        not_evaluated: 1,
        ..Summary::default()
    };
    assert_eq!(found, expected);
}

/// The tables of docs/nc-programs-read.md, a row for each program that is there.
fn tables() -> Vec<String> {
    let mut rows = Vec::new();
    let read_all = || PROGRAMS.into_iter().filter_map(|(name, r)| Some((name, read(name, &shared(name)?, r))));
    rows.push(
        "| program | blocks | rapid | linear | arcs | at cycle positions | with rotary words | axes |".to_owned(),
    );
    rows.push("|---|---:|---:|---:|---:|---:|---:|---|".to_owned());
    for (name, program) in read_all() {
        let s = summary(&program);
        let axes = s.axes.iter().cloned().collect::<Vec<_>>().join(" ");
        rows.push(
            row(name, &[s.blocks, s.rapids, s.linear, s.arcs, s.cycle_positions, s.rotary]) + &format!(" {axes} |"),
        );
    }
    rows.push(
        "| program | F words | cycles | calls | settings of frames | branches | blocks not evaluated |".to_owned(),
    );
    rows.push("|---|---:|---:|---:|---:|---:|---:|".to_owned());
    for (name, program) in read_all() {
        let s = summary(&program);
        rows.push(row(name, &[s.feeds, s.cycles, s.calls, s.settings, s.branches, s.not_evaluated]));
    }
    let heading =
        "| file | statements | rapid | linear | arcs | at cycle positions | FEDRAT | cycles | frames | offsets |";
    rows.push(format!("{heading} unknown |"));
    rows.push("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|".to_owned());
    for name in APT_FILES {
        let Some(text) = shared(name) else { continue };
        let file = read_apt(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
        let s = apt_summary(&file);
        let counts = [s.feeds, s.cycles, s.frames, s.offsets, file.unknown.len()];
        rows.push(row(name, &[&[file.statements.len()][..], &s.points, &counts].concat()));
    }
    rows
}

fn row(name: &str, counts: &[usize]) -> String {
    let counts: Vec<_> = counts.iter().map(ToString::to_string).collect();
    format!("| `{name}` | {} |", counts.join(" | "))
}

#[test]
fn the_tables_in_the_docs_are_those_of_the_programs() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/nc-programs-read.md");
    let docs = std::fs::read_to_string(path).expect("the docs are there");
    for row in tables() {
        assert!(docs.contains(&row), "not in docs/nc-programs-read.md: {row}");
    }
}

#[test]
#[ignore = "prints the tables of docs/nc-programs-read.md"]
fn print_the_tables() {
    println!("{}", tables().join("\n"));
}
