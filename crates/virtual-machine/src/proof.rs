//! Proofs of moves, and their gaps.

pub(crate) mod certificate;
pub(crate) mod doubts;
pub(crate) mod prover;
/// Proof of a move.
#[derive(Clone, Debug)]
pub(crate) struct Proof {
    /// The depth, mm, where one is proven.
    pub(crate) depth: Option<ProvenDepth>,
    /// Whether every body keeps its required clearance.
    pub(crate) bodies_clear: bool,
    /// Smallest distance of a body.
    pub(crate) clearance: Option<ProvenDistance>,
    /// The first thing that could not be proven.
    pub(crate) open: Option<Open>,
    /// Intervals that were taken.
    pub(crate) intervals: u32,
}

/// Proven depths, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ProvenDepth {
    /// Of the motion as it is programmed.
    pub(crate) programmed: f64,
    /// Of what the control may make of it.
    pub(crate) with_control: f64,
}

/// Unproven claim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Open {
    /// That the cutter is not deeper in an obstacle than its limit, or in rapid out of it.
    Cutter { obstacle: usize, limit: f64, is_rapid: bool },
    /// That a body keeps its distance from an obstacle.
    Body { body: usize, obstacle: usize, required: f64 },
    /// Anything: the axes have no such motion.
    Motion,
}

/// A proven distance, mm, with the indices of its body and obstacle.
pub(crate) type ProvenDistance = (f64, (usize, usize));

impl Proof {
    pub(crate) fn unknown() -> Self {
        Self { depth: None, bodies_clear: false, clearance: None, open: Some(Open::Motion), intervals: 0 }
    }

    /// Of two moves one after the other.
    pub(crate) fn and(self, other: Self) -> Self {
        let clearance = match (self.clearance, other.clearance) {
            (Some(a), Some(b)) => Some(if b.0 < a.0 { b } else { a }),
            (a, b) => a.or(b),
        };
        let bodies_clear = self.bodies_clear && other.bodies_clear;
        Self {
            depth: self.depth.zip(other.depth).map(|(a, b)| a.max(b)),
            bodies_clear,
            clearance: clearance.filter(|_| bodies_clear),
            open: self.open.or(other.open),
            intervals: self.intervals + other.intervals,
        }
    }
}

impl ProvenDepth {
    pub(crate) fn max(self, other: Self) -> Self {
        Self {
            programmed: self.programmed.max(other.programmed),
            with_control: self.with_control.max(other.with_control),
        }
    }
}
