//! Turns with the tool down in a program of two heads: taken back where the text has doubts, and
//! reported.
//!
//! One head turns alone, with the other one at home, or both turn at once
//! ([`pair_turns`](crate::dual::turns::pair_turns)).

pub(crate) mod pair_turns;

use facemill_inverse_kinematics::AxisValues;
use facemill_job::format::report::links::TurnsReport;
use facemill_job::setup::scene::Scene;
use facemill_tool_path::moves::MoveKind;

use crate::dual::links::DualLinks;
use crate::dual::moves::DualMove;
use crate::dual::output::{BlockPlace, DualTexts};
use crate::dual::parts::{ProgramPart, SectionTurn, TwoHeadContext};
use crate::program::heads::Doubts;
use crate::program::link_search::doubt_on;
use crate::program::planned_turns::turns_report_of;

/// Turn that the program cannot keep.
pub(crate) struct DoubtedSection {
    part: usize,
    section: usize,
    why: String,
}

/// Returns the turns on whose lines the program has a finding or a line that could not be
/// certified; `with_all` adds all others if there is one.
pub(crate) fn doubted_turns(
    parts: &[ProgramPart<'_>],
    texts: &DualTexts,
    doubts: Doubts<'_>,
    with_all: bool,
) -> Vec<DoubtedSection> {
    let mut turns: Vec<([usize; 2], Option<String>)> = Vec::new();
    for (part, p) in parts.iter().enumerate() {
        for (section, s) in p.sections.iter().enumerate() {
            if !matches!(s.turn, SectionTurn::Made { .. }) {
                continue;
            }
            let mut places: Vec<BlockPlace> = (0..s.turn_moves()).map(|at| BlockPlace { part, section, at }).collect();
            // A turn of both heads goes on to the first stop of their run.
            if p.sections.get(section + 1).is_some_and(|next| next.run.is_some()) {
                places.push(BlockPlace { part, section: section + 1, at: 0 });
            }
            let why = texts.lines_of(&places).and_then(|lines| doubt_on("the turn", lines, doubts));
            turns.push(([part, section], why));
        }
    }
    if turns.iter().all(|(_, why)| why.is_none()) {
        return Vec::new();
    }
    let others = || "with other turns the program repeatedly has findings".to_owned();
    let taken = turns.into_iter().filter(|(_, why)| with_all || why.is_some());
    taken.map(|([part, section], why)| DoubtedSection { part, section, why: why.unwrap_or_else(others) }).collect()
}

/// Replaces turns by the links that they were planned in place of, also in the moves that `links`
/// remember; returns whether there were any.
pub(crate) fn replace_by_links(
    parts: &mut [ProgramPart<'_>],
    mut links: Option<&mut DualLinks>,
    turns: Vec<DoubtedSection>,
) -> bool {
    let any = !turns.is_empty();
    for DoubtedSection { part, section, why } in turns {
        let sections = &mut parts[part].sections;
        let n_moves = sections[section].turn_moves();
        let state = std::mem::replace(&mut sections[section].turn, SectionTurn::Refused(why));
        let SectionTurn::Made { exit, lead } = state else { continue };
        // The first stop has the chip of the turn, and gets that of the entry.
        let chips = lead.iter().rev().find(|m| m.kind == MoveKind::Engage).map(|m| m.chips);
        sections[section].moves.splice(..n_moves, lead);
        if let Some(first) = sections.get_mut(section + 1).filter(|s| s.run.is_some()).and_then(|s| s.moves.first_mut())
        {
            *first = DualMove { kind: MoveKind::Engage, chips: chips.unwrap_or(first.chips), ..*first };
        }
        let Some(before) = section.checked_sub(1) else { continue };
        if let Some(links) = &mut links {
            links.extend_first([part, before], &exit);
        }
        sections[before].moves.extend(exit);
    }
    any
}

/// Returns the report on turns, with the lengths of both tips where both heads turn; `None` where
/// none were sought.
pub(crate) fn turns_report(
    parts: &[ProgramPart<'_>],
    texts: &DualTexts,
    context: &TwoHeadContext<'_>,
) -> Option<TurnsReport> {
    let mut turns = Vec::new();
    for sections in parts.iter().map(|p| &p.sections) {
        for (k, section) in sections.iter().enumerate() {
            match &section.turn {
                SectionTurn::NotSought => {}
                SectionTurn::Refused(why) => turns.push(Err(why.as_str())),
                SectionTurn::Made { .. } => {
                    let before = sections[..k].iter().rev().find_map(|s| s.moves.last());
                    let to_run = sections.get(k + 1).filter(|next| next.run.is_some()).and_then(|s| s.moves.first());
                    let moves = before.into_iter().chain(&section.moves[..section.turn_moves()]).chain(to_run);
                    let axes: Vec<&AxisValues> = moves.map(|m| &m.axes).collect();
                    let working = section.moves.first().map_or([false; 2], |m| m.working);
                    let of_head = |scene: &Scene<'_>| -> f64 {
                        let tip =
                            |axes: &AxisValues| scene.job.machine.cl_point(axes, scene.job.tool.gauge_length()).tip;
                        axes.windows(2).map(|w| (tip(w[1]) - tip(w[0])).norm()).sum()
                    };
                    let heads = context.scenes.iter().zip(working).filter(|(_, is_working)| *is_working);
                    turns.push(Ok(heads.map(|(scene, _)| of_head(scene)).sum()));
                }
            }
        }
    }
    turns_report_of(&turns, &texts.timed)
}

#[cfg(test)]
#[path = "../../../tests/unit/dual/turns.rs"]
mod tests;
