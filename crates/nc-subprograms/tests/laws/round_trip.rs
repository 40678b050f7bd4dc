//! A program that is split and expanded again does what it did, for every control and place.

use facemill_nc_program::dialect::{SubprogramPlace, SubprogramRule};
use facemill_nc_program::read::{ReadBlock, ReadCommand};
use facemill_nc_program::{Dialect, ReadProgram, read_program};
use facemill_nc_subprograms::{
    Section, SplitError, SplitProgram, SplitSettings, expand, operation_sections, pass_sections, split,
};
use facemill_test_kit::Random;

use crate::kit::{program, settings};

type Sections = fn(&ReadProgram) -> Vec<Section>;

/// Meaning of each block, without its line and comments.
fn meaning(program: &ReadProgram) -> Vec<ReadBlock> {
    let blocks = program.blocks.iter().cloned().map(|mut block| {
        block.commands.retain(|c| !matches!(c, ReadCommand::Comment(_)));
        ReadBlock { line: 0, number: None, text: Box::default(), feed_place: Default::default(), ..block }
    });
    blocks.filter(|b| b.motion.is_some() || !b.commands.is_empty()).collect()
}

fn split_by(text: &str, dialect: Dialect, place: SubprogramPlace, sections: Sections) -> Option<(SplitProgram, usize)> {
    let settings = settings(dialect, place)?;
    let (_, rule) = settings.subprograms()?;
    let sections = sections(&read_program(text, dialect).expect("our program"));
    let split_settings = SplitSettings {
        dialect,
        rules: settings.rules(),
        rule,
        first_number: rule.first_number,
        program_number: 1001,
        prefix: "PASS",
    };
    Some((split(text, &sections, &split_settings).expect("subprograms"), sections.len()))
}

#[test]
fn a_split_program_does_what_the_flat_one_does() {
    let mut random = Random(11);
    let mut n = 0;
    for dialect in Dialect::ALL {
        for place in [SubprogramPlace::Program, SubprogramPlace::Files] {
            for (sections, expected) in [(pass_sections as Sections, 9), (operation_sections, 3)] {
                let Some(settings) = settings(dialect, place) else { continue };
                let text = program(&mut random, &settings);
                let Some((made, found)) = split_by(&text, dialect, place, sections) else { continue };
                assert_eq!(found, expected, "{dialect:?}\n{text}");
                assert_eq!(made.files.len(), if place == SubprogramPlace::Files { expected } else { 0 });
                let beside = |names: &[String]| {
                    let own = made.files.iter().find(|(file, _)| names.iter().any(|n| n.eq_ignore_ascii_case(file)))?;
                    Some((own.0.clone(), own.1.clone().into_bytes()))
                };
                let expanded = expand(made.main.as_bytes(), "main", dialect, &beside).expect("no fault");
                let expanded = expanded.unwrap_or_else(|| panic!("{dialect:?}\n{}", made.main));
                assert_eq!(expanded.n_calls, expected, "{dialect:?}\n{}", made.main);
                let called = read_program(&expanded.text, dialect).expect("our program");
                let flat = read_program(&text, dialect).expect("our program");
                assert_eq!(meaning(&called), meaning(&flat), "{dialect:?}\n{}", made.main);
                // Without the subprograms the cuts are not there.
                let main = read_program(&made.main, dialect);
                assert!(main.is_err() || main.is_ok_and(|main| meaning(&main) != meaning(&flat)));
                lines_are_those_of_the_files(&expanded);
                n += 1;
            }
        }
    }
    assert_eq!(n, 20, "controls and places with subprograms");
}

/// Every line of the text is, byte by byte, the line of the file that the map names.
fn lines_are_those_of_the_files(expanded: &facemill_nc_subprograms::ExpandedProgram) {
    let text = String::from_utf8_lossy(&expanded.text);
    for (k, line) in text.lines().enumerate() {
        let (file, at) = expanded.place(expanded.lines.written(k as u32 + 1));
        let file = expanded.files.iter().find(|f| f.name == file).expect("a file");
        let written = String::from_utf8_lossy(&file.text);
        assert_eq!(written.lines().nth(at as usize - 1), Some(line));
        assert_eq!(expanded.written_text(expanded.lines.written(k as u32 + 1)), line.trim());
    }
    // Runs are the same map, without gaps.
    let of_runs = expanded
        .lines
        .runs()
        .flat_map(|([first, last], written)| (first..=last).map(move |line| (line, written + (line - first))));
    let all: Vec<(u32, u32)> = (1..=text.lines().count() as u32).map(|k| (k, expanded.lines.written(k))).collect();
    assert_eq!(of_runs.collect::<Vec<_>>(), all);
}

/// A dialect file cannot name a place outside of the program's folder, and numbers end.
#[test]
fn files_outside_and_numbers_beyond_the_last_are_refused() {
    let settings = settings(Dialect::Fanuc, SubprogramPlace::Files).expect("M98");
    let text = program(&mut Random(2), &settings);
    let (_, rule) = settings.subprograms().expect("subprograms");
    let sections = pass_sections(&read_program(&text, Dialect::Fanuc).expect("our program"));
    let try_split = |file: &str, first_number: u32, sections: &[Section]| {
        let rule = SubprogramRule { file: file.to_owned(), ..rule.clone() };
        let (dialect, rules, rule) = (Dialect::Fanuc, settings.rules(), &rule);
        split(&text, sections, &SplitSettings { dialect, rules, rule, first_number, program_number: 1, prefix: "PASS" })
    };
    for name in ["../O{number}.nc", "/tmp/O{number}.nc", "a/b{number}", "..", "c:{number}", "{name}.nc"] {
        assert!(matches!(try_split(name, 2001, &sections), Err(SplitError::FileName { .. })), "{name}");
    }
    assert!(try_split("O{number}.nc", 9991, &sections).is_ok());
    let n = sections.len();
    let why = try_split("O{number}.nc", 9992, &sections).expect_err("too many");
    assert_eq!(why, SplitError::Numbers { n, first: 9992, last: 9999, control: settings.rules().name.clone() });
    assert_eq!(try_split("O{number}.nc", 2001, &[]), Err(SplitError::Empty));
    // A label of the program itself.
    let haas = crate::kit::settings(Dialect::Haas, SubprogramPlace::Program).expect("M97");
    let text = program(&mut Random(2), &haas);
    let (_, rule) = haas.subprograms().expect("subprograms");
    let sections = pass_sections(&read_program(&text, Dialect::Haas).expect("our program"));
    let (dialect, rules, first_number) = (Dialect::Haas, haas.rules(), 8995);
    let taken = split(
        &text,
        &sections,
        &SplitSettings { dialect, rules, rule, first_number, program_number: 1, prefix: "PASS" },
    );
    assert!(matches!(taken, Err(SplitError::Taken { number: 9001, .. })), "{taken:?}");
}
