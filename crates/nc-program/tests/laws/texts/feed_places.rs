//! Every F word of every dialect can be cut out, put back and changed, and nothing else of the
//! program changes.

use super::samples::{self, Sample};
use crate::kit::{Random, random_blocks, settings, spec};
use facemill_nc_program::read::{FeedPlace, MacroKind, ReadBlock, ReadCommand, read_fanuc};
use facemill_nc_program::*;

#[test]
fn feeds_are_where_their_places_say() {
    for Sample { name, text, read } in samples::all() {
        let program = read(text.as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}"));
        let mut rebuilt = String::new();
        let mut end = 0;
        let mut count = 0;
        for block in &program.blocks {
            let Some(span) = block.feed_span() else { continue };
            assert_eq!(block.insert_feed_at(), Some(span.start), "{name}");
            let number = block.feed_place.number_span().unwrap();
            assert!(text[span.clone()].starts_with(['F', 'f']) && number.end == span.end, "{name}: {}", block.text);
            let line = text[..span.start].matches('\n').count() as u32 + 1;
            assert_eq!((line, text[span.clone()].contains('\n')), (block.line, false), "{name}");
            rebuilt.push_str(&text[end..span.start]);
            rebuilt.push_str(&text[span.clone()]);
            end = span.end;
            count += 1;
        }
        rebuilt.push_str(&text[end..]);
        assert_eq!(rebuilt, text, "{name}");
        assert!(count >= 2, "{name} has feeds");
    }
}

#[test]
fn places_count_the_bytes_of_line_ends() {
    for Sample { name, text, read } in samples::all() {
        let other = text.replace('\n', "\r\n");
        let (a, b) = (read(text.as_bytes()).unwrap(), read(other.as_bytes()).unwrap());
        let words = |program: &ReadProgram, text: &str| -> Vec<Option<String>> {
            let of = |b: &ReadBlock| Some(text[b.feed_span()?].to_owned());
            program.blocks.iter().map(of).collect()
        };
        assert_eq!(words(&a, text), words(&b, &other), "{name}");
        for (a, b) in a.blocks.iter().zip(&b.blocks) {
            // One byte more for each line end before it.
            let at = |block: &ReadBlock| block.insert_feed_at();
            assert_eq!(at(a).map(|at| at + a.line as usize - 1), at(b), "{name}: {}", a.text);
        }
    }
}

#[test]
fn a_changed_feed_changes_nothing_else() {
    for Sample { name, text, read } in samples::all() {
        let program = read(text.as_bytes()).unwrap();
        for (k, block) in program.blocks.iter().enumerate() {
            let Some(number) = block.feed_place.number_span() else { continue };
            let changed = format!("{}77.5{}", &text[..number.start], &text[number.end..]);
            check_changed(name, &program, &read(changed.as_bytes()).unwrap(), k);
        }
    }
}

#[test]
fn a_feed_put_in_changes_nothing_else() {
    for Sample { name, text, read } in samples::all() {
        let program = read(text.as_bytes()).unwrap();
        let mut count = 0;
        for (k, block) in program.blocks.iter().enumerate() {
            let (Some(at), None) = (block.insert_feed_at(), block.feed_span()) else { continue };
            if block.motion.as_ref().is_none_or(|m| m.kind.is_rapid()) {
                continue;
            }
            let changed = format!("{} F77.5 {}", &text[..at], &text[at..]);
            let read = read(changed.as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}\n{changed}"));
            check_changed(name, &program, &read, k);
            count += 1;
        }
        assert!(count >= 1, "{name} has moves without a feed");
    }
}

#[test]
fn written_programs_are_what_their_feeds_are_cut_out_of() {
    let mut random = Random(77);
    for round in 0..60 {
        let mode = [FeedMode::G94, FeedMode::G93, FeedMode::Rtcp][round % 3];
        let blocks = random_blocks(&mut random, 12);
        let text = write_program(&spec(blocks), &settings(mode)).unwrap();
        let program = read_fanuc(&text).unwrap();
        let words = text.lines().map(|l| l.split('(').next().unwrap().matches(" F").count()).sum::<usize>();
        assert_eq!(program.blocks.iter().filter(|b| b.feed_span().is_some()).count(), words);
        for (k, block) in program.blocks.iter().enumerate() {
            let Some(number) = block.feed_place.number_span() else { continue };
            let value: f64 = text[number.clone()].parse().unwrap();
            assert_eq!(block.motion.as_ref().unwrap().feed.unwrap().value, value);
            let changed = format!("{}77.5{}", &text[..number.start], &text[number.end..]);
            check_changed("written", &program, &read_fanuc(&changed).unwrap(), k);
        }
    }
}

/// The feed of block `k` is 77.5 now, and otherwise the programs are one.
fn check_changed(name: &str, before: &ReadProgram, after: &ReadProgram, k: usize) {
    assert_eq!(before.blocks.len(), after.blocks.len(), "{name}");
    let changed = &after.blocks[k];
    if let Some(motion) = changed.motion.as_ref().filter(|m| !m.kind.is_rapid()) {
        assert_eq!(motion.feed.map(|f| f.value), Some(77.5), "{name}: {}", changed.text);
    }
    for (a, b) in before.blocks.iter().zip(&after.blocks) {
        assert_eq!(without_feed(a), without_feed(b), "{name}: {}", a.text);
    }
    assert_eq!(before.tool_lengths, after.tool_lengths);
}

/// Returns the parts that must not change; macro text holds the line, the feed with it.
fn without_feed(block: &ReadBlock) -> ReadBlock {
    let mut block = ReadBlock { text: Box::default(), feed_place: FeedPlace::default(), ..block.clone() };
    if let Some(motion) = &mut block.motion {
        motion.feed = None;
    }
    let is_words = |c: &ReadCommand| {
        matches!(c, ReadCommand::Macro { kind: MacroKind::VariableWords | MacroKind::ToolVector, .. })
    };
    block.commands.retain(|c| !is_words(c));
    for command in &mut block.commands {
        if let ReadCommand::Macro { text, .. } = command {
            text.clear();
        }
    }
    block
}
