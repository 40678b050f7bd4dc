use std::borrow::Cow;

use crate::layout::level_set::LevelSet;
use crate::strategy::settings::Direction;

/// Where passes are cut out of a patch, and the triangles that reach there.
pub(crate) struct PassLevel<'a> {
    pub(crate) set: LevelSet<'a>,
    /// In rising order.
    pub(crate) among: Cow<'a, [u32]>,
    /// The direction in which its passes start at an end of the region and join the pass before
    /// inside it; `None` where any direction serves.
    pub(crate) starts: Option<Direction>,
}

/// Strips between neighbouring passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Strips {
    /// Number of strips that are somewhere wider than allowed.
    pub(crate) n_wide: usize,
    /// Longest way from one pass to the next, mm.
    pub(crate) widest: f64,
}
