//! The same moves, said in every dialect, are read as the same: against a program that the test
//! itself knows.

use std::fmt::Write;

use crate::kit::Random;
use facemill_nc_program::read::{
    MotionKind, ReadError, read_fanuc, read_haas, read_heidenhain, read_linuxcnc, read_mazak, read_siemens,
};
use facemill_nc_program::*;

const LETTERS: [char; 5] = ['X', 'Y', 'Z', 'B', 'C'];

/// A move as it is meant.
struct Move {
    /// 0 rapid, 1 straight, 2 and 3 arcs.
    kind: usize,
    /// Where all axes are behind it, thousandths.
    end: [i64; 5],
    /// The axes that the block names, and which of them by their way.
    named: Vec<(usize, bool)>,
    /// A new feed, tenths.
    feed: Option<i64>,
    /// Centre of an arc, thousandths.
    centre: [i64; 2],
}

fn moves(random: &mut Random, n: usize) -> Vec<Move> {
    let mut at = [0; 5].map(|_: i64| random.below(200_000) as i64 - 100_000);
    let mut moves =
        vec![Move { kind: 0, end: at, named: (0..5).map(|k| (k, false)).collect(), feed: None, centre: [0; 2] }];
    for _ in 0..n {
        let kind = random.below(4);
        let mut named = Vec::new();
        let start = at;
        for (k, at) in at.iter_mut().enumerate() {
            let is_in_plane = k < 2;
            if kind >= 2 && is_in_plane || kind < 2 && random.below(3) > 0 {
                *at = [0, 1, -1, 500, random.below(300_000) as i64 - 150_000][random.below(5)];
                named.push((k, random.below(3) == 0));
            }
        }
        if named.is_empty() {
            continue;
        }
        let feed = (random.below(3) == 0 || moves.len() == 1).then(|| 1 + random.below(90_000) as i64);
        let centre = [start[0] + random.below(9000) as i64, start[1] - random.below(9000) as i64];
        moves.push(Move { kind, end: at, named, feed, centre });
    }
    moves
}

/// Thousandths as a number with a point, in one of the forms that controls take.
fn number(random: &mut Random, thousandths: i64, has_sign: bool) -> String {
    let sign = if thousandths < 0 { "-" } else { ["", "+"][usize::from(has_sign)] };
    let (whole, rest) = (thousandths.abs() / 1000, thousandths.abs() % 1000);
    match random.below(4) {
        0 if whole == 0 && rest > 0 => format!("{sign}.{rest:03}"),
        1 if rest == 0 => format!("{sign}{whole}."),
        2 => format!("{sign}00{whole}.{rest:03}0"),
        _ => format!("{sign}{whole}.{rest:03}"),
    }
}

fn gcode(random: &mut Random, moves: &[Move], has_modal: bool) -> String {
    let mut text = String::from("G21 G94 G17\n");
    let mut start = moves[0].end;
    let mut kind = None;
    for m in moves {
        // Of absolute and incremental words only one kind fits in a block.
        let is_incremental = m.named.iter().any(|(_, by)| *by) && m.kind < 2;
        text.push_str(["G90 ", "G91 "][usize::from(is_incremental)]);
        if kind != Some(m.kind) || !has_modal {
            let _ = write!(text, "G{} ", m.kind);
        }
        kind = Some(m.kind);
        for (k, _) in &m.named {
            let value = if is_incremental { m.end[*k] - start[*k] } else { m.end[*k] };
            let _ = write!(text, "{}{}", LETTERS[*k], number(random, value, false));
            text.push_str(["", " "][random.below(2)]);
        }
        if m.kind >= 2 {
            let [i, j] = [m.centre[0] - start[0], m.centre[1] - start[1]].map(|v| number(random, v, false));
            let _ = write!(text, "I{i} J{j}");
        }
        feed(&mut text, m);
        start = m.end;
    }
    text
}

fn siemens(random: &mut Random, moves: &[Move]) -> String {
    let mut text = String::from("G710 G94 G17 G90\n");
    let mut start = moves[0].end;
    for m in moves {
        let _ = write!(text, "G{}", m.kind);
        for (k, by) in &m.named {
            let letter = LETTERS[*k];
            let (way, end) = (number(random, m.end[*k] - start[*k], false), number(random, m.end[*k], false));
            let _ = match (by, random.below(3)) {
                (true, _) => write!(text, " {letter}=IC({way})"),
                (false, 0) => write!(text, " {letter}=AC({end})"),
                (false, 1) => write!(text, " {letter} = {end}"),
                (false, _) => write!(text, " {letter}{end}"),
            };
        }
        if m.kind >= 2 {
            let j = number(random, m.centre[1] - start[1], false);
            let _ = write!(text, " I=AC({}) J{j}", number(random, m.centre[0], false));
        }
        feed(&mut text, m);
        start = m.end;
    }
    text
}

fn heidenhain(random: &mut Random, moves: &[Move]) -> String {
    let mut text = String::from("BEGIN PGM SAME MM\n");
    let mut start = moves[0].end;
    for m in moves {
        if m.kind >= 2 {
            let [x, y] = m.centre.map(|v| number(random, v, true));
            let _ = writeln!(text, "CC X{x} Y{y}");
        }
        text.push_str(if m.kind >= 2 { "C" } else { "L" });
        for (k, by) in &m.named {
            let value = if *by { m.end[*k] - start[*k] } else { m.end[*k] };
            let value = number(random, value, true)
                .replace('.', [".", ","][usize::from(random.below(2) == 0 && value % 1000 != 0)]);
            let _ = write!(text, " {}{}{value}", ["", "I"][usize::from(*by)], LETTERS[*k]);
        }
        match m.kind {
            0 => text.push_str(" FMAX"),
            2 => text.push_str(" DR-"),
            3 => text.push_str(" DR+"),
            _ => {}
        }
        if m.kind == 0 {
            text.push('\n')
        } else {
            feed(&mut text, m)
        }
        start = m.end;
    }
    text
}

fn feed(text: &mut String, m: &Move) {
    if let Some(tenths) = m.feed {
        let _ = write!(text, " F{}.{}", tenths / 10, tenths % 10);
    }
    text.push('\n');
}

#[test]
fn the_same_moves_are_read_from_every_dialect() {
    let mut random = Random(91);
    for round in 0..150 {
        let moves = moves(&mut random, 20);
        let gcode = gcode(&mut random, &moves, round % 2 == 0);
        check("fanuc", &gcode, read_fanuc(&gcode), &moves, true);
        check("haas", &gcode, read_haas(&gcode), &moves, true);
        check("mazak", &gcode, read_mazak(&gcode), &moves, true);
        check("linuxcnc", &gcode, read_linuxcnc(&gcode), &moves, true);
        let text = siemens(&mut random, &moves);
        check("siemens", &text, read_siemens(&text), &moves, true);
        let text = heidenhain(&mut random, &moves);
        check("heidenhain", &text, read_heidenhain(&text), &moves, false);
    }
}

/// `has_rapid_feeds`: rapids have an F, too, and it counts for later blocks.
fn check(name: &str, text: &str, read: Result<ReadProgram, ReadError>, moves: &[Move], has_rapid_feeds: bool) {
    let read = read.unwrap_or_else(|e| panic!("{name}: {e}\n{text}"));
    let found: Vec<_> = read.motions().map(|(_, m)| m).collect();
    assert_eq!(found.len(), moves.len(), "{name}\n{text}");
    let (mut feed, mut start) = (None, moves[0].end);
    for (found, m) in found.iter().zip(moves) {
        let clockwise = m.kind == 2;
        let kind =
            [MotionKind::Rapid, MotionKind::Linear, MotionKind::Arc { clockwise }, MotionKind::Arc { clockwise }];
        assert_eq!(found.kind, kind[m.kind], "{name}\n{text}");
        for (k, letter) in LETTERS.into_iter().enumerate() {
            let word = found.position.words().get(AxisLetter::new(letter, 0).unwrap()).expect("it is known");
            assert!((word - m.end[k] as f64 / 1000.0).abs() < 1e-9, "{name} {letter} {word} {:?}\n{text}", m.end);
        }
        feed = m.feed.filter(|_| m.kind > 0 || has_rapid_feeds).or(feed);
        let value = feed.map(|tenths| tenths as f64 / 10.0);
        assert_eq!(found.feed.map(|f| f.value), value.filter(|_| m.kind > 0), "{name}\n{text}");
        if let Some(arc) = &found.arc {
            let ways = [arc.i, arc.j];
            for k in 0..2 {
                let centre = arc.centre[k].or(ways[k].map(|way| start[k] as f64 / 1000.0 + way));
                let centre = centre.expect("the arc has a centre");
                assert!((centre - m.centre[k] as f64 / 1000.0).abs() < 1e-9, "{name}\n{text}");
            }
        }
        start = m.end;
    }
    assert!(read.is_evaluated(), "{name}\n{text}");
}
