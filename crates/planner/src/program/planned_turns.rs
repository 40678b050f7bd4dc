//! Turns with the tool down in a program: taken back where the text has doubts, and reported.

use std::collections::BTreeMap;

use facemill_job::format::report::links::{LinkReason, TurnsReport};
use facemill_tool_path::moves::{MoveKind, TurnState};
use facemill_virtual_machine::Finding;

use crate::passes::operation::PlannedOperation;
use crate::program::link_search::doubt_on;
use crate::program::output::Texts;
use crate::program::timed::Timed;

/// A turn that the program cannot keep.
pub(crate) struct DoubtedTurn {
    /// Index of its operation.
    operation: usize,
    /// Index of the piece that it leads to.
    piece: usize,
    why: String,
}

/// Returns the turns on whose lines the program has a finding or a line that could not be
/// certified; `with_all` adds all others if there is one.
pub(crate) fn doubted_turns(
    operations: &[PlannedOperation<'_>],
    texts: &Texts,
    doubts: (&[Finding], &[u32]),
    with_all: bool,
) -> Vec<DoubtedTurn> {
    let mut turns: Vec<(usize, usize, Option<String>)> = Vec::new();
    let mut at = 0;
    for (operation, o) in operations.iter().enumerate() {
        for (piece, moves) in o.moves.pieces.iter().enumerate() {
            if matches!(moves.turn, TurnState::Made(_)) {
                let last = at + moves.turn_moves().len().saturating_sub(1);
                turns.push((operation, piece, doubt_on("the turn", texts.lines_of_moves([at, last]), doubts)));
            }
            at += moves.moves.len();
        }
        at += o.moves.retract.len();
    }
    if turns.iter().all(|(.., why)| why.is_none()) {
        return Vec::new();
    }
    let others = || "with other turns the program repeatedly has findings".to_owned();
    let taken = turns.into_iter().filter(|(.., why)| with_all || why.is_some());
    taken.map(|(operation, piece, why)| DoubtedTurn { operation, piece, why: why.unwrap_or_else(others) }).collect()
}

/// Replaces turns by the links that they were planned in place of; returns whether there were any.
pub(crate) fn replace_by_links(operations: &mut [PlannedOperation<'_>], turns: Vec<DoubtedTurn>) -> bool {
    let any = !turns.is_empty();
    for DoubtedTurn { operation, piece, why } in turns {
        operations[operation].moves.take_back_turn(piece, why);
    }
    any
}

/// Returns the report on turns; `None` where none were sought.
pub(crate) fn turns_report(operations: &[PlannedOperation<'_>], timed: &Timed) -> Option<TurnsReport> {
    let mut turns = Vec::new();
    for pieces in operations.iter().map(|o| &o.moves.pieces) {
        for (k, piece) in pieces.iter().enumerate() {
            match &piece.turn {
                TurnState::NotSought => {}
                TurnState::Refused(why) => turns.push(Err(why.as_str())),
                TurnState::Made(_) => {
                    let before = k.checked_sub(1).and_then(|k| pieces[k].moves.last());
                    let tips: Vec<_> = before.into_iter().chain(piece.turn_moves()).map(|m| m.cl.tip).collect();
                    turns.push(Ok(tips.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>()));
                }
            }
        }
    }
    turns_report_of(&turns, timed)
}

/// Returns the report on the lengths of turns, mm, and the reasons for links in their place; `None`
/// without any.
pub(crate) fn turns_report_of(turns: &[Result<f64, &str>], timed: &Timed) -> Option<TurnsReport> {
    if turns.is_empty() {
        return None;
    }
    let mut report = TurnsReport::default();
    let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
    for turn in turns {
        match turn {
            Ok(length) => {
                report.turns_on_surface += 1;
                report.length_mm += length;
            }
            Err(why) => *reasons.entry(why).or_default() += 1,
        }
    }
    let of_turns = timed.moves.iter().filter(|m| m.kind == MoveKind::Turn);
    report.time_s = of_turns.map(|m| m.time).fold(0.0, std::ops::Add::add);
    report.links = reasons.values().sum();
    report.reasons = reasons.into_iter().map(|(why, links)| LinkReason { reason: why.to_owned(), links }).collect();
    report.reasons.sort_by_key(|r| std::cmp::Reverse(r.links));
    Some(report)
}

#[cfg(test)]
#[path = "../../tests/unit/program/planned_turns.rs"]
mod tests;
