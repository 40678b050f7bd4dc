//! Pieces with their ways in and out.

use facemill_cutter_location::links::approach::{Approach, ApproachSettings};
use facemill_cutter_location::links::link::Waypoint;

use crate::segments::PassSegment;

/// A piece with its ways in and out.
pub struct Reached {
    /// The piece.
    pub piece: PassSegment,
    /// Into it.
    pub entry: Approach,
    /// Out of it.
    pub exit: Approach,
    /// Shapes of the ways in and out.
    pub(crate) shapes: [ApproachSettings; 2],
    /// Place among the pieces as laid.
    pub(crate) laid: usize,
}

impl Reached {
    /// Returns the place where rapids end before it.
    pub fn start(&self) -> Waypoint {
        outer(&self.entry)
    }

    /// Returns the place where rapids begin behind it.
    pub fn end(&self) -> Waypoint {
        outer(&self.exit)
    }
}

/// Returns the pose of an approach that is farthest from its pass.
pub(crate) fn outer(approach: &Approach) -> Waypoint {
    let cl = *approach.outward.last().expect("an approach has at least the poses of its arc");
    Waypoint { cl, configuration: approach.outer }
}
