//! A program that is split and expanded again does what it did, for every control and place.

use facemill_nc_program::dialect::SubprogramPlace;
use facemill_nc_program::read::{ReadBlock, ReadCommand};
use facemill_nc_program::{Dialect, ReadProgram, read_program};
use facemill_nc_subprograms::{Section, SplitProgram, SplitSettings, expand, operation_sections, pass_sections, split};
use facemill_test_kit::Random;

use crate::kit::{program, settings};

type Sections = fn(&ReadProgram) -> Vec<Section>;

/// What a block does, without its line and comments.
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
    }
}
