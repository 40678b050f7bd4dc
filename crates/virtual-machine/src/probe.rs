//! Whether a block certainly cuts: a cutter that is smaller by all that motion and stock may be off still meets material.

use std::collections::BTreeSet;

use facemill_cl_data::ClPoint;
use facemill_nc_program::ReadProgram;
use facemill_tool_model::Cutter;
use facemill_z_map::{Step, Sweep, TurnedBody};

use crate::{VerifySettings, moves::Move, segments::Segment};

/// A smaller cutter that is asked on some blocks before they are cut.
pub(crate) struct Probe {
    /// Indices of the blocks in the program.
    blocks: BTreeSet<usize>,
    /// The cutter, eroded; `None` where nothing would be left of it: then no block is known to cut.
    cutter: Option<TurnedBody>,
    /// How much it is smaller on all sides, and how much of a line's material is more than the ways may be off, mm.
    pub(crate) depth: f64,
}

impl Probe {
    /// For the lines that the settings name; `tolerance` is that of the cut stock, mm.
    pub(crate) fn new(program: &ReadProgram, settings: &VerifySettings, cutter: &Cutter, tolerance: f64) -> Self {
        let lines: BTreeSet<u32> = settings.probed_lines.iter().copied().collect();
        let is_asked = |k: &usize| lines.contains(&program.blocks[*k].line);
        let depth = 2.0 * tolerance;
        Self { blocks: (0..program.blocks.len()).filter(is_asked).collect(), cutter: eroded(cutter, depth), depth }
    }

    /// The question on a segment of a move; `None` where none is asked.
    pub(crate) fn step(&self, m: &Move, segment: &Segment) -> Option<Step<'_>> {
        let body = self.cutter.as_ref().filter(|_| !m.is_rapid && self.blocks.contains(&m.block))?;
        let raised = |cl: &ClPoint| ClPoint { tip: cl.tip + cl.axis.into_inner() * self.depth, axis: cl.axis };
        Some(Step::Ask(Sweep { body, from: raised(&segment.from), to: raised(&segment.to) }))
    }
}

/// All of a cutter that is `depth` (mm) below its surface, but for the end of its flute where that is not above the corner;
/// its tip is at the origin, so that it stands `depth` above the cutter's. `None` where nothing is left.
fn eroded(cutter: &Cutter, depth: f64) -> Option<TurnedBody> {
    let corner = (cutter.corner_radius() - depth).max(0.0);
    let flute = (cutter.flute_length() - 2.0 * depth).max(corner);
    let cutter = Cutter::new(cutter.radius() - depth, corner, flute).ok()?;
    Some(TurnedBody::of_cutter(&cutter))
}
