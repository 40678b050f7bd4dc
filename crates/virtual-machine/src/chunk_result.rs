use nalgebra::Point3;

use crate::{cutter_depth::Depth, episodes::Episodes};

/// What a run of moves showed.
#[derive(Default)]
pub(crate) struct ChunkResult {
    pub(crate) episodes: Episodes,
    pub(crate) gouge: Option<Gouge>,
    pub(crate) clearance: Option<Clearance>,
    pub(crate) n_positions: usize,
    pub(crate) cutting_time: f64,
    pub(crate) rapid_time: f64,
    pub(crate) cutting_length: f64,
}

/// Deepest place so far.
#[derive(Clone, Copy)]
pub(crate) struct Gouge {
    pub(crate) depth: Depth,
    pub(crate) obstacle: usize,
    pub(crate) move_index: usize,
}

/// Nearest non-cutting body so far.
#[derive(Clone, Copy)]
pub(crate) struct Clearance {
    pub(crate) distance: f64,
    pub(crate) place: Point3<f64>,
    pub(crate) body: usize,
    pub(crate) obstacle: usize,
    pub(crate) move_index: usize,
}

/// The smallest of these, the first of equal ones.
pub(crate) fn nearest(all: impl Iterator<Item = Option<Clearance>>) -> Option<Clearance> {
    all.flatten().reduce(|a, b| if b.distance < a.distance { b } else { a })
}
