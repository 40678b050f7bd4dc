use nalgebra::Point3;

use crate::finding::episodes::Episodes;
use crate::run::cutter_depth::Depth;

/// Result of a run of moves.
#[derive(Default)]
pub(crate) struct ChunkResult {
    pub(crate) episodes: Episodes,
    /// Deepest place in each section, as [`crate::motion::setup::VerifySettings`] counts them.
    pub(crate) gouges: Gouges,
    pub(crate) clearance: Option<Clearance>,
    /// Indices of moves of which it is not known what happens between positions.
    pub(crate) open: Vec<usize>,
    pub(crate) n_positions: usize,
    pub(crate) cutting_time: f64,
    pub(crate) rapid_time: f64,
    pub(crate) cutting_length: f64,
}

/// Deepest place in each section so far; the first one of equal ones.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gouges(Vec<Option<Gouge>>);

impl Gouges {
    pub(crate) fn deepest(&self, section: usize) -> Option<Gouge> {
        self.0.get(section).copied().flatten()
    }

    /// Takes a place of a section where it is deeper than all before.
    pub(crate) fn add(&mut self, section: usize, gouge: Gouge) {
        if self.0.len() <= section {
            self.0.resize(section + 1, None);
        }
        let deepest = &mut self.0[section];
        if deepest.is_none_or(|d| gouge.depth.depth > d.depth.depth) {
            *deepest = Some(gouge);
        }
    }

    /// Takes those of later moves.
    pub(crate) fn add_all(&mut self, later: &Self) {
        for (section, gouge) in later.0.iter().enumerate() {
            if let Some(gouge) = gouge {
                self.add(section, *gouge);
            }
        }
    }

    pub(crate) fn deepest_of_all(&self) -> Option<Gouge> {
        self.0.iter().flatten().copied().reduce(|a, b| if b.depth.depth > a.depth.depth { b } else { a })
    }
}

/// Deepest place so far.
#[derive(Clone, Copy, Debug)]
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
