//! The solids of the tool assembly that cut the stock or are tested against it, and their order.

use facemill_tool_model::{ToolAssembly, ToolSection};
use facemill_z_map::{Step, Sweep, TurnedBody};

use crate::motion::moves::Move;
use crate::run::segments::Segment;
use crate::stock::probe::{Smaller, dilated};
use crate::stock::run::Purpose;

/// Smallest and largest way of a segment, mm. Within, it is what the flute is wider than the bodies
/// behind it.
const WAYS: [f64; 2] = [0.5, 8.0];

/// Height of the tested core, mm: the cutter's body, too, meets all that is higher.
const CORE_HEIGHT: f64 = 1.0;

/// The solids of the tool assembly that are swept.
pub(crate) struct Bodies {
    pub(crate) cutter: TurnedBody,
    /// Smaller by what ways and what is cut may be off; `None` where nothing is left.
    cutter_in_rapid: Option<Smaller>,
    /// With half the diagonal of a cell around it.
    cutter_with_cell: TurnedBody,
    core: Option<TurnedBody>,
    /// Each body as it is and with its clearance, by its index among the scene's.
    sections: Vec<(usize, TurnedBody, TurnedBody)>,
    pub(crate) max_way: f64,
    /// Whether bodies, cores and the cutter in rapid are tested only where a segment ends, and not
    /// on their way to there.
    at_ends: bool,
}

impl Bodies {
    pub(crate) fn new(tool: &ToolAssembly, slack: f64, [tolerance, cell]: [f64; 2]) -> Self {
        let cutter = tool.cutter();
        let mut widest = 0.0_f64;
        let mut sections = Vec::new();
        for (k, ToolSection { frustum: f, .. }) in tool.sections().into_iter().enumerate() {
            let frustum =
                |clearance: f64| TurnedBody::frustum([f.z_low, f.z_high], [f.radius_low, f.radius_high], clearance);
            // A section without length is none.
            let (Ok(plain), Ok(kept)) = (frustum(0.0), frustum((f.rounding - slack).max(0.0))) else { continue };
            widest = widest.max(if f.z_low <= cutter.flute_length() { f.radius_low.max(f.radius_high) } else { 0.0 });
            sections.push((k, plain, kept));
        }
        Self {
            cutter: TurnedBody::of_cutter(cutter),
            cutter_in_rapid: Smaller::of(cutter, 2.0 * tolerance),
            cutter_with_cell: dilated(cutter, cell * std::f64::consts::FRAC_1_SQRT_2),
            core: core(tool),
            sections,
            max_way: (cutter.radius() - widest.max(tool.dead_core_radius())).clamp(WAYS[0], WAYS[1]),
            at_ends: false,
        }
    }

    /// The same, tested only at positions, where segments end: an estimate.
    pub(crate) fn at_ends(self) -> Self {
        Self { at_ends: true, ..self }
    }

    /// Returns the queries and cuts on a segment, in order.
    pub(crate) fn steps(&self, m: &Move, segment: &Segment) -> Vec<(Purpose, Step<'_>)> {
        Phase::ALL.into_iter().flat_map(|phase| self.steps_in(phase, m, segment)).collect()
    }

    /// The same of one phase.
    pub(crate) fn steps_in(&self, phase: Phase, m: &Move, segment: &Segment) -> Vec<(Purpose, Step<'_>)> {
        let tested = if self.at_ends { &Segment { from: segment.to, ..*segment } } else { segment };
        let sweep = |body| Sweep { body, from: tested.from, to: tested.to };
        match (phase, m.is_rapid_of_tool()) {
            (Phase::Before, true) => {
                let inside =
                    self.cutter_in_rapid.iter().map(|cutter| (Purpose::Rapid, Step::Ask(cutter.along(tested))));
                inside.chain([(Purpose::NearRapid, Step::Ask(sweep(&self.cutter_with_cell)))]).collect()
            }
            (Phase::Before, false) => {
                let core = self.core.iter().map(|core| (Purpose::Core, Step::Ask(sweep(core))));
                let plain = self.sections.iter().map(|(k, plain, _)| (Purpose::Body(*k), Step::Ask(sweep(plain))));
                core.chain(plain).collect()
            }
            (Phase::Cut, true) => Vec::new(),
            (Phase::Cut, false) => {
                let Segment { from, to, .. } = *segment;
                vec![(Purpose::Cut, Step::Remove(Sweep { body: &self.cutter, from, to }))]
            }
            (Phase::Behind, _) => {
                self.sections.iter().map(|(k, _, kept)| (Purpose::Kept(*k), Step::Ask(sweep(kept)))).collect()
            }
        }
    }
}

/// Phases of a segment, one after the other, of all heads.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Tests bodies as they are, and cores.
    Before,
    Cut,
    /// Tests bodies with their clearance.
    Behind,
}

impl Phase {
    pub(crate) const ALL: [Self; 3] = [Self::Before, Self::Cut, Self::Behind];
}

/// The part of the cutter's bottom that does not cut, from where its recess ends; `None` where the
/// tool may plunge.
fn core(tool: &ToolAssembly) -> Option<TurnedBody> {
    let radius = tool.dead_core_radius();
    let recess = crate::run::dead_core::recess(tool);
    if radius <= 0.0 || !recess.is_finite() {
        return None;
    }
    TurnedBody::frustum([recess, recess + CORE_HEIGHT], [radius, radius], 0.0).ok()
}
