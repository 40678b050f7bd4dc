//! Findings as a reader wants them: one for a fault, however often the contact is lost and found
//! again.

use std::collections::BTreeMap;

use facemill_nc_program::ReadProgram;
use facemill_nc_program::read::MotionKind;

use crate::finding::{Finding, FindingKind};

/// Largest number of findings of one kind, bodies and axis that are reported one by one; the last
/// stands for all that follow.
const MOST_ALIKE: usize = 20;

/// Common parts of findings of one fault: kind, body, obstacle, axis and note.
type Alike = (FindingKind, Option<String>, Option<String>, Option<String>, String);

/// Pair that meets: body and obstacle.
type Pair = (Option<String>, Option<String>);

/// Findings without the near misses of bodies that meet each other on some of the same blocks.
fn without_near(findings: Vec<Finding>) -> Vec<Finding> {
    let is_collision = |k: FindingKind| {
        matches!(k, FindingKind::Collision | FindingKind::HolderCollision | FindingKind::RapidCollision)
    };
    let mut met: BTreeMap<Pair, Vec<[u32; 2]>> = BTreeMap::new();
    for f in findings.iter().filter(|f| is_collision(f.kind)) {
        met.entry((f.body.clone(), f.obstacle.clone())).or_default().push([f.first_line, f.last_line]);
    }
    let is_met = |f: &Finding| {
        let of_pair = met.get(&(f.body.clone(), f.obstacle.clone()));
        of_pair.into_iter().flatten().any(|[first, last]| *first <= f.last_line && f.first_line <= *last)
    };
    findings.into_iter().filter(|f| f.kind != FindingKind::NearMiss || !is_met(f)).collect()
}

/// Findings, without near misses of bodies that meet each other on some of the same blocks, and of
/// which those that are alike and without a rapid between them are one: it tells its first and last
/// line, how many there were ([`Finding::episodes`]), and all else of the worst. Where there are
/// still more than twenty alike, those from the twentieth on are one, too. In the order of their
/// first lines; those of the same one stay in theirs.
///
/// A joined finding's lines have blocks among them on which nothing is wrong; who asks what is
/// wrong on a block takes the findings as they are.
///
/// `rapid_lines` are those of the program, as [`rapid_lines`] tells.
#[must_use]
pub fn merge_findings(findings: Vec<Finding>, rapid_lines: &[u32]) -> Vec<Finding> {
    let rapid_between = |a: u32, b: u32| {
        let next = rapid_lines.partition_point(|line| *line <= a);
        rapid_lines.get(next).is_some_and(|line| *line < b)
    };
    let mut all: Vec<Finding> = Vec::new();
    // Where the last one of each is, and how many there are.
    let mut latest: BTreeMap<Alike, (usize, usize)> = BTreeMap::new();
    for finding in without_near(findings) {
        let (last, n) = latest.entry(alike(&finding)).or_insert((all.len(), 0));
        let goes_on = *n > 0 && !rapid_between(all[*last].last_line, finding.first_line);
        if goes_on || *n == MOST_ALIKE {
            all[*last].join(finding);
        } else {
            (*last, *n) = (all.len(), *n + 1);
            all.push(finding);
        }
    }
    all.sort_by_key(|f| f.first_line);
    all
}

/// Lines of the program's motions that are no cuts, in order.
#[must_use]
pub fn rapid_lines(program: &ReadProgram) -> Vec<u32> {
    let is_cut = |kind: MotionKind| matches!(kind, MotionKind::Linear | MotionKind::Arc { .. });
    let rapids = program.blocks.iter().filter(|b| b.motion.as_ref().is_some_and(|m| !is_cut(m.kind)));
    rapids.map(|b| b.line).collect()
}

fn alike(f: &Finding) -> Alike {
    (f.kind, f.body.clone(), f.obstacle.clone(), f.axis.clone(), f.note.clone())
}

impl Finding {
    /// Takes another one of the same fault in.
    fn join(&mut self, other: Self) {
        let (first_line, last_line) = (self.first_line.min(other.first_line), self.last_line.max(other.last_line));
        let episodes = self.episodes + other.episodes;
        self.take_worse(other);
        (self.first_line, self.last_line, self.episodes) = (first_line, last_line, episodes);
    }

    /// Tells the worst of another one of the same fault where that is worse; lines and number of
    /// episodes stay.
    pub fn take_worse(&mut self, other: Self) {
        let is_worse = match (&other.measure, &self.measure) {
            (Some(new), Some(old)) => new.is_worse_than(old),
            (Some(_), None) => true,
            _ => false,
        };
        if is_worse {
            let (first_line, last_line, episodes) = (self.first_line, self.last_line, self.episodes);
            *self = Self { first_line, last_line, episodes, ..other };
        }
    }
}

#[cfg(test)]
#[path = "../../tests/unit/finding/merge.rs"]
mod tests;
