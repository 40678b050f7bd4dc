//! Whether a block certainly cuts, or certainly does not: a cutter that is smaller by all that
//! motion and stock may be off still meets material, and one that is larger by that, and by what
//! lies between the lines, meets none.

use std::collections::BTreeSet;
use std::f64::consts::SQRT_2;

use facemill_cl_data::ClPoint;
use facemill_nc_program::ReadProgram;
use facemill_tool_model::Cutter;
use facemill_z_map::{RoundRing, Step, Sweep, TurnedBody};

use crate::motion::moves::Move;
use crate::motion::setup::VerifySettings;
use crate::run::segments::Segment;
use crate::stock::run::Purpose;

/// A body that is smaller than the one it stands for, and begins higher above the tip.
pub(crate) struct Smaller {
    pub(crate) body: TurnedBody,
    /// By how much, mm.
    pub(crate) raised: f64,
}

impl Smaller {
    /// A cutter without all that is not `depth` (mm) below its surface; `None` where nothing is
    /// left.
    pub(crate) fn of(cutter: &Cutter, depth: f64) -> Option<Self> {
        eroded(cutter, depth).map(|body| Self { body, raised: depth })
    }

    /// The same, also where the flute ends; `None` where so much is not left of it.
    pub(crate) fn within(cutter: &Cutter, depth: f64) -> Option<Self> {
        let corner = (cutter.corner_radius() - depth).max(0.0);
        let flute = cutter.flute_length() - 2.0 * depth;
        (flute > corner).then(|| Self::of(cutter, depth)).flatten()
    }

    /// Its sweep on a segment of the whole body's way.
    pub(crate) fn along(&self, segment: &Segment) -> Sweep<'_> {
        let raised = |cl: &ClPoint| ClPoint { tip: cl.tip + cl.axis.into_inner() * self.raised, axis: cl.axis };
        Sweep { body: &self.body, from: raised(&segment.from), to: raised(&segment.to) }
    }
}

/// A smaller and a larger cutter that are tested on some blocks before they cut.
pub(crate) struct Probe {
    /// Indices of the blocks in the program.
    blocks: BTreeSet<usize>,
    /// The cutter, eroded; `None` where nothing would be left of it: then no block is known to cut.
    cutter: Option<Smaller>,
    /// The cutter with the diagonal of a cell around it, and twice `depth`: ways and stock may each
    /// be off by that.
    around: TurnedBody,
    /// How much it is smaller on all sides, and how much of a line's material is more than the ways
    /// may be off, mm.
    pub(crate) depth: f64,
}

impl Probe {
    /// For the lines that the settings name; `tolerance` is that of the cut stock, `cell` the
    /// distance of its lines, mm.
    pub(crate) fn new(
        program: &ReadProgram,
        settings: &VerifySettings,
        cutter: &Cutter,
        [tolerance, cell]: [f64; 2],
    ) -> Self {
        let lines: BTreeSet<u32> = settings.probed_lines.iter().copied().collect();
        let is_probed = |k: &usize| lines.contains(&program.blocks[*k].line);
        let depth = 2.0 * tolerance;
        let around = dilated(cutter, cell * SQRT_2 + 2.0 * depth);
        let blocks = (0..program.blocks.len()).filter(is_probed).collect();
        Self { blocks, cutter: Smaller::of(cutter, depth), around, depth }
    }

    /// Whether a move is tested.
    pub(crate) fn is_probed(&self, m: &Move) -> bool {
        !m.is_rapid && self.blocks.contains(&m.block)
    }

    /// Returns the queries on a segment of a move, in any order; none if the move has none.
    pub(crate) fn steps(&self, m: &Move, segment: &Segment) -> impl Iterator<Item = (Purpose, Step<'_>)> {
        let is_probed = self.is_probed(m);
        let around = Sweep { body: &self.around, from: segment.from, to: segment.to };
        let around = is_probed.then_some((Purpose::Around, Step::Ask(around)));
        let inner = self
            .cutter
            .iter()
            .filter(move |_| is_probed)
            .map(|cutter| (Purpose::Probe, Step::Ask(cutter.along(segment))));
        around.into_iter().chain(inner)
    }
}

/// All that is within `around` (mm) of a cutter.
pub(crate) fn dilated(cutter: &Cutter, around: f64) -> TurnedBody {
    let (r, rim) = (cutter.corner_radius(), cutter.rim_radius());
    let rings = [
        RoundRing { radius: rim, height: r, rounding: r + around },
        RoundRing { radius: cutter.radius(), height: cutter.flute_length(), rounding: around },
    ];
    TurnedBody::new(&rings).unwrap_or_else(|_| TurnedBody::of_cutter(cutter))
}

/// All of a cutter that is `depth` (mm) below its surface, but for the end of its flute where that
/// is not above the corner; its tip is at the origin, `depth` above the cutter's. `None` where
/// nothing is left.
fn eroded(cutter: &Cutter, depth: f64) -> Option<TurnedBody> {
    let corner = (cutter.corner_radius() - depth).max(0.0);
    let flute = (cutter.flute_length() - 2.0 * depth).max(corner);
    let cutter = Cutter::new(cutter.radius() - depth, corner, flute).ok()?;
    Some(TurnedBody::of_cutter(&cutter))
}
