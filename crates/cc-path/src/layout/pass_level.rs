use std::borrow::Cow;

use facemill_cl_data::Monitor;

use crate::distance::patch_vertices::PatchVertices;
use crate::layout::level_set::LevelSet;
use crate::layout::levels::{Band, count_wide, widest_strip};
use crate::layout::strip_width::StripWidth;
use crate::strategy::patch::Patch;
use crate::strategy::settings::{Direction, LaySettings};

/// Where passes are cut out of a patch, and the triangles that reach there.
pub(crate) struct PassLevel<'a> {
    pub(crate) set: LevelSet<'a>,
    /// In rising order.
    pub(crate) among: Cow<'a, [u32]>,
    /// The direction in which its passes start at an end of the region and join the pass before
    /// inside it; `None` where any direction serves.
    pub(crate) starts: Option<Direction>,
}

/// Patch, widths and settings that passes are laid by.
#[derive(Clone, Copy)]
pub(crate) struct PatchTask<'a> {
    pub(crate) patch: &'a Patch<'a>,
    pub(crate) vertices: &'a PatchVertices,
    pub(crate) settings: &'a LaySettings,
    pub(crate) strip_width: StripWidth<'a>,
    pub(crate) monitor: &'a dyn Monitor,
}

/// Gain of some passes together: length of passes as wide as allowed, and length and cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Gain {
    pub(crate) work: f64,
    pub(crate) cost: f64,
}

impl Gain {
    pub(crate) fn and(self, other: Self) -> Self {
        Self { work: self.work + other.work, cost: self.cost + other.cost }
    }

    pub(crate) fn rate(&self) -> f64 {
        self.work / self.cost
    }
}

/// Strips between neighbouring passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Strips {
    /// Number of strips that are somewhere wider than allowed.
    pub(crate) n_wide: usize,
    /// Longest way from one pass to the next, mm.
    pub(crate) widest: f64,
}

impl Strips {
    /// Strips between levels (in rising order) by the bands that they cross.
    pub(crate) fn between(bands: &[Band], levels: &[f64]) -> Self {
        Self { n_wide: count_wide(bands, levels), widest: widest_strip(bands, levels) }
    }
}
