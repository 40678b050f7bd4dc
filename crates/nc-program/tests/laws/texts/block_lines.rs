//! Where the blocks of a program are in its text.

use facemill_nc_program::dialect::PostFile;
use facemill_nc_program::read::ReadCommand;
use facemill_nc_program::*;

use crate::kit::{Random, post_file, settings, spec, words};

/// Some block of any kind that writes one line, many, or none.
fn any_block(r: &mut Random) -> Block {
    match r.below(9) {
        0 => Block::Comment("a long comment that goes over the end of the line ".repeat(1 + r.below(6))),
        1 => Block::Raw("M1\n\nG4 P100\n".repeat(r.below(3))),
        2 => Block::Home { axes: vec![AxisLetter::Z] },
        3 => Block::Home { axes: vec![] },
        4 => Block::LengthCompensation { register: 7, length: 420.0, words: words(&[(AxisLetter::Z, r.coordinate())]) },
        5 => Block::LengthCompensationOff,
        6 => Block::Rapid { words: words(&[(AxisLetter::X, r.coordinate())]) },
        _ => Block::Linear { words: words(&[(AxisLetter::Y, r.coordinate())]), feed: 1.0 + 500.0 * r.unit() },
    }
}

#[test]
fn every_mark_is_on_its_reported_line() {
    for seed in 0..40 {
        let mut r = Random(seed);
        let mut blocks = vec![Block::Rapid { words: words(&[(AxisLetter::X, 1.0), (AxisLetter::Z, 2.0)]) }];
        for k in 0..60 {
            blocks.push(any_block(&mut r));
            blocks.push(Block::Comment(format!("MARK {k}")));
        }
        let plain = PostFile { block_numbers: None, ..post_file() };
        let settings = if seed % 2 == 0 { settings(FeedMode::G94) } else { plain.settings(None).unwrap() };
        let spec = spec(blocks);
        let written = write_program_with_lines(&spec, &settings).unwrap();
        assert_eq!(written.text, write_program(&spec, &settings).unwrap());
        assert_eq!(written.block_lines.len(), spec.program.blocks.len());
        assert!(written.block_lines.is_sorted());
        let lines: Vec<&str> = written.text.lines().collect();
        let read = read_program(&written.text, Dialect::Fanuc).unwrap();
        for (block, &line) in spec.program.blocks.iter().zip(&written.block_lines) {
            if let Block::Comment(text) = block
                && text.starts_with("MARK")
            {
                assert_eq!(lines[line as usize - 1], format!("({text})"));
                let said = read.blocks.iter().find(|b| b.line == line).unwrap();
                assert_eq!(said.commands, [ReadCommand::Comment(text.clone())]);
            }
        }
    }
}
