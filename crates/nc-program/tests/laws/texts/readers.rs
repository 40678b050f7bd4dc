//! Laws of the readers of all dialects: what does not matter, what is refused where, and that
//! nothing makes them panic.

use std::collections::BTreeSet;

use super::samples::{self, Sample};
use crate::kit::Random;
use facemill_nc_program::read::{
    FanucReader, FeedPlace, HeidenhainReader, ReadBlock, ReadCommand, ReadError, ReadFault, SiemensReader,
};
use facemill_nc_program::*;

#[test]
fn no_mutation_makes_a_reader_panic() {
    let mut random = Random(41);
    for Sample { name, text, read } in samples::all() {
        let mut refused = 0;
        for _ in 0..2500 {
            let mutant = mutated(&mut random, text.as_bytes());
            refused += usize::from(check_read(name, &mutant, read));
        }
        assert!((100..2500).contains(&refused), "{name} {refused}");
    }
}

#[test]
fn no_line_of_a_dialect_makes_another_panic() {
    let mut random = Random(42);
    let all = samples::all();
    let lines: Vec<&str> = all.iter().flat_map(|s| s.text.lines()).collect();
    for Sample { name, read, .. } in &all {
        for _ in 0..500 {
            let n = 1 + random.below(6);
            let text: Vec<&str> = (0..n).map(|_| lines[random.below(lines.len())]).collect();
            check_read(name, text.join("\n").as_bytes(), *read);
        }
    }
}

/// One to three bytes changed, taken out or put in, or a piece of the text copied to another place.
fn mutated(random: &mut Random, text: &[u8]) -> Vec<u8> {
    let sample = b"GXYZTQRLFMCAIDP09.-+/(%#[=\n E;&\"]),~:*\x00\xff";
    let mut text = text.to_vec();
    for _ in 0..=random.below(3) {
        let k = random.below(text.len());
        match random.below(5) {
            0 => text[k] = sample[random.below(sample.len())],
            1 if text.len() > 1 => drop(text.remove(k)),
            2 => text.insert(k, sample[random.below(sample.len())]),
            3 => text.truncate(k.max(1)),
            _ => {
                let piece = text[k..(k + 1 + random.below(12)).min(text.len())].to_vec();
                let at = random.below(text.len());
                text.splice(at..at, piece);
            }
        }
    }
    text
}

/// Reads, and checks that an error and every place are in the text and that numbers are finite;
/// whether it is refused.
fn check_read(name: &str, text: &[u8], read: fn(&[u8]) -> Result<ReadProgram, ReadError>) -> bool {
    match read(text) {
        Ok(program) => {
            for block in &program.blocks {
                let line_start = block.feed_place.line_start();
                assert_eq!(text[..line_start].iter().filter(|b| **b == b'\n').count() + 1, block.line as usize);
                if let Some(span) = block.feed_span() {
                    assert!(text[span.clone()].iter().all(|b| *b != b'\n') && span.start >= line_start, "{name}");
                }
                assert!(block.insert_feed_at().is_none_or(|at| at <= text.len()), "{name}");
                let motion = block.motion.as_ref();
                assert!(motion.is_none_or(|m| m.position.words().iter().all(|w| w.value.is_finite())), "{name}");
                assert!(motion.is_none_or(|m| m.feed.is_none_or(|f| f.value.is_finite())), "{name}");
            }
            false
        }
        Err(e) => {
            let line = text.split(|b| *b == b'\n').nth(e.line as usize - 1).expect("the line exists");
            assert!(e.column >= 1 && e.column as usize <= line.len().max(1), "{name}: {e}");
            assert!(!e.to_string().is_empty());
            true
        }
    }
}

#[test]
fn case_does_not_matter() {
    for Sample { name, text, read } in samples::all() {
        let lower = read(text.to_ascii_lowercase().as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_same(name, &read(text.as_bytes()).unwrap(), &lower);
    }
}

#[test]
fn line_ends_and_empty_lines_do_not_matter() {
    for Sample { name, text, read } in samples::all() {
        let program = read(text.as_bytes()).unwrap();
        let with_cr = read(text.replace('\n', "\r\n").as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_same(name, &program, &with_cr);
        if name != "heidenhain" {
            let spaced = read(text.replace('\n', "\n \t\n").as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_same(name, &program, &spaced);
        }
    }
}

/// FANUC and its relatives: blanks anywhere, comments in parentheses between any two words.
#[test]
fn blanks_and_comments_do_not_matter_on_fanuc_and_its_relatives() {
    let mut random = Random(43);
    for Sample { name, text, read } in samples::all().into_iter().take(4) {
        let program = read(text.as_bytes()).unwrap();
        for round in 0..200 {
            let mut changed = String::new();
            let mut depth = 0;
            let mut is_comment = false;
            for byte in text.chars() {
                match byte {
                    '(' => depth += 1,
                    ')' => depth -= 1,
                    ';' => is_comment = true,
                    '\n' => is_comment = false,
                    _ => {}
                }
                let is_code = depth == 0 && !is_comment && byte != ')' && byte != '\n';
                if is_code && random.below(8) == 0 {
                    changed.push_str([" ", "\t", "  "][random.below(3)]);
                }
                if is_code && round % 2 == 0 && random.below(12) == 0 {
                    changed.push_str(["(F9)", "( X1. )", "()"][random.below(3)]);
                }
                changed.push(byte);
            }
            let read = read(changed.as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}\n{changed}"));
            assert_same(name, &program, &read);
        }
    }
}

/// Siemens and Heidenhain: blanks wherever there is one, between a letter and its number, and
/// around signs; comments at the ends of lines.
#[test]
fn blanks_and_comments_do_not_matter_on_siemens_and_heidenhain() {
    let mut random = Random(44);
    for Sample { name, text, read } in samples::all().into_iter().skip(4) {
        let program = read(text.as_bytes()).unwrap();
        for _ in 0..200 {
            let mut changed = String::new();
            for line in text.lines() {
                let is_plain = !line.contains([';', '"', '%', '*'])
                    && !line.contains("Z1=")
                    && !line.ends_with('~')
                    && !line.contains("TNC:");
                let bytes = line.as_bytes();
                for k in 0..bytes.len() {
                    let is_letter = |k: usize| bytes.get(k).is_some_and(u8::is_ascii_alphabetic);
                    let begins = k == 0 || matches!(bytes[k - 1], b' ' | b'(' | b',');
                    let is_value = |b: u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+');
                    let is_alone = k > 0
                        && is_letter(k - 1)
                        && (k < 2 || !is_letter(k - 2) && bytes[k - 2] != b'_' && !bytes[k - 2].is_ascii_digit());
                    let is_word = "XYZFSIJ".contains(char::from(bytes[k.saturating_sub(1)]));
                    let may_part = is_plain && (bytes[k] == b' ' || is_alone && is_word && is_value(bytes[k]));
                    let around = is_plain && name == "siemens" && (matches!(bytes[k], b'=' | b')') || begins);
                    if (may_part || around) && random.below(4) == 0 {
                        changed.push_str([" ", "\t", "   "][random.below(3)]);
                    }
                    changed.push(char::from(bytes[k]));
                }
                if is_plain && random.below(4) == 0 {
                    changed.push_str([" ;F9", "; X1 \"", ";"][random.below(3)]);
                }
                changed.push('\n');
            }
            let read = read(changed.as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}\n{changed}"));
            assert_same(name, &program, &read);
        }
    }
}

/// The programs say the same: all but texts, comments, columns and line numbers.
fn assert_same(name: &str, a: &ReadProgram, b: &ReadProgram) {
    let said = |program: &ReadProgram| -> Vec<ReadBlock> {
        let blocks = program.blocks.iter().map(|block| {
            let mut block =
                ReadBlock { line: 0, text: Box::default(), feed_place: FeedPlace::default(), ..block.clone() };
            block.commands.retain(|c| !matches!(c, ReadCommand::Comment(_)));
            for command in &mut block.commands {
                match command {
                    ReadCommand::Macro { text, .. } | ReadCommand::ToolName(text) | ReadCommand::Mode(text) => {
                        text.clear()
                    }
                    ReadCommand::Call(call) => {
                        let plain = |t: &str| t.to_ascii_uppercase().split_whitespace().collect::<String>();
                        (call.name, call.arguments) = (plain(&call.name), plain(&call.arguments));
                    }
                    _ => {}
                }
            }
            block
        });
        blocks.collect()
    };
    let (a, b) = (said(a), said(b));
    for (a, b) in a.iter().zip(&b) {
        assert_eq!(a, b, "{name}");
    }
    assert_eq!(a.len(), b.len(), "{name}");
}

#[test]
fn an_unknown_word_is_reported_to_the_column() {
    let mut random = Random(45);
    for Sample { name, text, read } in samples::all() {
        let program = read(text.as_bytes()).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        for block in program.blocks.iter().filter(|b| b.motion.is_some()) {
            let line = lines[block.line as usize - 1];
            // Behind the last word, before a comment.
            let is_gcode = !matches!(name, "siemens" | "heidenhain");
            let comment = line.find(|c| c == ';' || c == '(' && is_gcode);
            let end = comment.map_or(line.len(), |at| line[..at].trim_end().len());
            let (word, is_character) = [("!", true), ("?", true), ("KKW7", false), ("WRONG", false)][random.below(4)];
            let mut changed = lines.clone();
            let new = format!("{} {word}{}", &line[..end], &line[end..]);
            changed[block.line as usize - 1] = &new;
            let error = read(changed.join("\n").as_bytes()).map(|_| ()).expect_err(&new);
            assert_eq!((error.line, error.column as usize), (block.line, end + 2), "{name}: {error}: {new}");
            match error.fault {
                ReadFault::Character(c) => assert!(is_character && word.starts_with(c), "{new}"),
                ReadFault::UnknownWord(reported) => assert!(!is_character && reported == word, "{new}: {reported}"),
                fault => panic!("{name}: {fault}: {new}"),
            }
        }
    }
}

#[test]
fn readers_that_keep_no_text_read_the_same() {
    fn lean<R>(
        text: &str,
        mut reader: R,
        read: fn(&mut R, &[u8]) -> Result<Option<ReadBlock>, ReadError>,
    ) -> Vec<ReadBlock> {
        let lines = text.split_inclusive('\n');
        lines.filter_map(|line| read(&mut reader, line.as_bytes()).unwrap()).collect()
    }
    for Sample { name, text, read } in samples::all() {
        let blocks = match name {
            "fanuc" => lean(text, FanucReader::new().without_text(), FanucReader::read_line),
            "haas" => lean(text, FanucReader::haas().without_text(), FanucReader::read_line),
            "mazak" => lean(text, FanucReader::mazak().without_text(), FanucReader::read_line),
            "linuxcnc" => lean(text, FanucReader::linuxcnc().without_text(), FanucReader::read_line),
            "siemens" => lean(text, SiemensReader::new().without_text(), SiemensReader::read_line),
            _ => lean(text, HeidenhainReader::new().without_text(), HeidenhainReader::read_line),
        };
        let mut rest = blocks.iter();
        for full in read(text.as_bytes()).unwrap().blocks {
            let says_nothing = full.commands.iter().all(|c| matches!(c, ReadCommand::Comment(_)))
                && full.motion.is_none()
                && full.feed_span().is_none()
                && !full.sets_state;
            if says_nothing && rest.as_slice().first().is_none_or(|b| b.line != full.line) {
                continue;
            }
            let lean = rest.next().unwrap();
            assert!(lean.text.is_empty(), "{name}");
            assert_eq!(
                (lean.line, &lean.motion, lean.feed_place),
                (full.line, &full.motion, full.feed_place),
                "{name}"
            );
            let is_code = |c: &&ReadCommand| !matches!(c, ReadCommand::Comment(_));
            let said = |b: &ReadBlock| b.commands.iter().filter(is_code).cloned().collect::<Vec<_>>();
            assert_eq!(said(lean), said(&full), "{name}");
        }
        assert_eq!(rest.len(), 0, "{name}");
    }
}

/// Nothing is dropped: another digit anywhere in a word with a meaning is another program, or none.
#[test]
fn every_digit_of_a_moving_block_counts() {
    let plain = |program: &ReadProgram| -> Vec<ReadBlock> {
        let blocks = program.blocks.iter().map(|block| {
            let mut block = ReadBlock { text: Box::default(), ..block.clone() };
            block.commands.retain(|c| !matches!(c, ReadCommand::Comment(_) | ReadCommand::Macro { .. }));
            block
        });
        blocks.collect()
    };
    let mut found = BTreeSet::new();
    for Sample { name, text, read } in samples::all() {
        let program = read(text.as_bytes()).unwrap();
        let before = plain(&program);
        for block in program.blocks.iter().filter(|b| b.motion.is_some()) {
            let start = block.feed_place.line_start();
            let line = text[start..].lines().next().unwrap();
            let is_gcode = !matches!(name, "siemens" | "heidenhain");
            let code = line.find(|c| c == ';' || c == '(' && is_gcode).map_or(line, |at| &line[..at]);
            for (k, digit) in code.bytes().enumerate().filter(|(_, b)| b.is_ascii_digit()) {
                let mut changed = text.as_bytes().to_vec();
                changed[start + k] = b'0' + (digit - b'0' + 1) % 10;
                if read(&changed).is_ok_and(|after| plain(&after) == before) {
                    let start = code[..k].rfind(' ').map_or(0, |at| at + 1);
                    found.insert((name, code[start..].split(' ').next().unwrap()));
                }
            }
        }
    }
    let expected = [
        // Neither of two variables is known; the value of a fixed point says nothing.
        ("siemens", "Y=AC(R2)"),
        ("siemens", "R9"),
        ("siemens", "Z1=0"),
        // Not known: where the axis was, which way is the shorter one; and the feed of M128.
        ("heidenhain", "IX+5"),
        ("heidenhain", "C+90"),
        ("heidenhain", "F2000"),
    ];
    assert_eq!(found, BTreeSet::from(expected));
}
