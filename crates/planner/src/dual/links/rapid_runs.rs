//! Links among the moves of a program of two heads.

use facemill_tool_path::moves::MoveKind;

use crate::dual::output::BlockPlace;
use crate::dual::parts::ProgramPart;

/// All rapids between two cutting moves.
pub(crate) struct PairRapidRun {
    /// Places of its moves, in order; none where a turn leads to the pass.
    pub places: Vec<BlockPlace>,
    /// Reason why the run must stay.
    pub hold: Option<&'static str>,
}

/// Returns the rapids between cutting moves, in program order, without those before the first cut
/// and after the last. A run keeps its index when a turn is replaced by a link.
pub(crate) fn rapid_runs(parts: &[ProgramPart<'_>]) -> Vec<PairRapidRun> {
    let mut all: Vec<(BlockPlace, Option<MoveKind>)> = Vec::new();
    for (part, p) in parts.iter().enumerate() {
        for (section, s) in p.sections.iter().enumerate() {
            let place = |at: usize| BlockPlace { part, section, at };
            let kind = |kind: MoveKind| matches!(kind, MoveKind::Rapid | MoveKind::Turn).then_some(kind);
            all.extend(s.moves.iter().enumerate().map(|(at, m)| (place(at), kind(m.kind))));
        }
    }
    let changes = changes_of_spindles(parts);
    let mut runs = Vec::new();
    let mut at = 0;
    for run in all.chunk_by(|a, b| a.1 == b.1) {
        let is_between = at > 0 && at + run.len() < all.len();
        at += run.len();
        match run[0].1.filter(|_| is_between) {
            Some(MoveKind::Turn) => runs.push(PairRapidRun { places: Vec::new(), hold: None }),
            Some(_) => {
                let places: Vec<BlockPlace> = run.iter().map(|(place, _)| *place).collect();
                let hold = hold(parts, &changes, &places);
                runs.push(PairRapidRun { places, hold });
            }
            None => {}
        }
    }
    runs
}

/// Returns, for each part, whether the program changes the speed of a spindle before it.
fn changes_of_spindles(parts: &[ProgramPart<'_>]) -> Vec<bool> {
    let rpm = |part: &ProgramPart<'_>, head: usize| part.files[head].map(|f| f.feeds.spindle_rpm);
    let mut speeds = [0, 1].map(|h| parts.iter().find_map(|p| rpm(p, h)));
    let change = |part: &ProgramPart<'_>| {
        let now = [0, 1].map(|h| rpm(part, h).or(speeds[h]));
        std::mem::replace(&mut speeds, now) != now
    };
    parts.iter().map(change).collect()
}

/// Returns the action of the program on a link that must stay far from the part.
fn hold(parts: &[ProgramPart<'_>], changes: &[bool], places: &[BlockPlace]) -> Option<&'static str> {
    let (first, last) = (places.first()?, places.last()?);
    if changes[first.part + 1..=last.part].iter().any(|change| *change) {
        return Some("the speed of a spindle changes on it");
    }
    let working = |place: &BlockPlace| parts[place.part].sections[place.section].moves[place.at].working;
    places.iter().any(|place| working(place) != working(first)).then_some("a head goes home on it, or comes from there")
}
