//! Needs of the lengths against the stock as it is at every moment, along the paths of the tool.

use facemill_cl_data::{Monitor, RoundFrustum};
use facemill_tool_model::{AssemblyLength, BuiltAssembly, Lengths, OpenAssembly, ToolAssembly, ToolSection};
use facemill_z_map::{Contact, DexelMap, Step, Sweep, TurnedBody};

use super::needs::{Needs, Raise};
use crate::motion::moves::Move;
use crate::motion::setup::VerifyError;
use crate::run::scene::RunScene;
use crate::run::segments::{Coarseness, Segment, segments};
use crate::stock::bodies::Bodies;

/// Moves that the stock is cut by in one go; where a body meets it there they are gone through
/// again one by one.
const MOVES_PER_BATCH: usize = 128;

/// How much longer than needed a length may be, mm.
const RESOLUTION: f64 = 5e-3;

/// First way up that is tried, mm; each further one is twice as long.
const FIRST_WAY: f64 = 0.25;

/// Times that the lengths are taken up on one way.
const MAX_RAISES: usize = 1000;

/// Name of the stock.
const STOCK: &str = "stock";

/// A run through a program with its stock.
pub(crate) struct StockNeeds<'r, 'a> {
    pub(crate) scene: &'r RunScene<'a>,
    pub(crate) moves: &'r [Move],
    pub(crate) assembly: &'r OpenAssembly,
    pub(crate) tolerance: f64,
    pub(crate) longest: f64,
    /// Whether the run ends where a body first meets the stock.
    pub(crate) is_until_first: bool,
    /// Lengths to be found.
    pub(crate) asks: [bool; 4],
}

impl StockNeeds<'_, '_> {
    /// Returns the needs of the lengths of the scene's tool against the stock: that tool's flute
    /// cuts it, and the bodies are checked against it as in
    /// [`run_stock`](crate::stock::run::run_stock).
    ///
    /// Where a body meets it on a way, the length goes up to where the body is free of that way: by
    /// doubled steps, and halves between the last that is not free and the first that is. Windows
    /// that the steps pass over are not found.
    pub(crate) fn find(
        &self,
        stock: &DexelMap,
        lengths: &Lengths,
        monitor: &dyn Monitor,
    ) -> Result<Needs, VerifyError> {
        let tool = self.scene.setup.tool;
        let mut stock = stock.clone();
        let slack = self.scene.settings.clearance_slack;
        let bodies = Bodies::new(tool, slack, [self.tolerance, stock.grid().cell()]);
        let reach = tool.gauge_length();
        let coarse = Coarseness { tolerance: self.tolerance, reach, max_way: bodies.max_way };
        let mut raised = Raised::new(self, *lengths)?;
        for batch in self.moves.chunks(MOVES_PER_BATCH) {
            monitor.checkpoint()?;
            let ways = self.ways(batch, &coarse);
            let before = stock.clone();
            if !self.cut(&ways, &bodies, &raised, &mut stock)? {
                continue;
            }
            if self.again(&ways, &bodies.cutter, before, &mut raised)? {
                break;
            }
        }
        Ok(raised.needs)
    }

    fn ways<'m>(&self, batch: &'m [Move], coarse: &Coarseness) -> Vec<(&'m Move, Segment)> {
        let of_tool = batch.iter().filter(|m| m.moves_tool);
        // A move without a known path cuts nothing, as in the run of the stock.
        let of_move =
            |m: &'m Move| segments(self.scene, m, coarse).unwrap_or_default().into_iter().map(move |s| (m, s));
        of_tool.flat_map(of_move).collect()
    }

    /// Cuts the stock, and returns whether one of the tested bodies met it.
    fn cut(
        &self,
        ways: &[(&Move, Segment)],
        bodies: &Bodies,
        raised: &Raised<'_>,
        stock: &mut DexelMap,
    ) -> Result<bool, VerifyError> {
        let mut steps = Vec::new();
        for (m, s) in ways {
            let sweep = |body| Sweep { body, from: s.from, to: s.to };
            let cuts = !m.is_rapid_of_tool();
            if cuts {
                steps.extend(raised.riders.iter().map(|r| Step::Ask(sweep(&r.plain))));
                steps.push(Step::Remove(sweep(&bodies.cutter)));
            }
            steps.extend(raised.riders.iter().map(|r| Step::Ask(sweep(&r.kept))));
        }
        let results = stock.run(&steps, self.tolerance).map_err(of_sweep)?;
        Ok(results.iter().any(|r| self.is_deep(r.deepest)))
    }

    /// A shallower contact may be rounding of the paths.
    fn is_deep(&self, met: Option<Contact>) -> bool {
        met.is_some_and(|c| c.depth > 2.0 * self.tolerance)
    }

    /// Goes through ways one by one, taking lengths up; whether the run is at its end.
    fn again(
        &self,
        ways: &[(&Move, Segment)],
        cutter: &TurnedBody,
        mut stock: DexelMap,
        raised: &mut Raised<'_>,
    ) -> Result<bool, VerifyError> {
        for (m, s) in ways {
            if !m.is_rapid_of_tool() {
                self.free(m, s, &stock, raised, BodyClearance::None)?;
                stock.remove(&Sweep { body: cutter, from: s.from, to: s.to }, self.tolerance).map_err(of_sweep)?;
            }
            self.free(m, s, &stock, raised, BodyClearance::Kept)?;
            if self.is_until_first && !raised.needs.is_none() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Takes lengths up until all bodies are free on a way.
    fn free(
        &self,
        m: &Move,
        s: &Segment,
        stock: &DexelMap,
        raised: &mut Raised<'_>,
        clearance: BodyClearance,
    ) -> Result<(), VerifyError> {
        let met = |body: &TurnedBody| -> Result<Option<Contact>, VerifyError> {
            let found = stock.meets(&Sweep { body, from: s.from, to: s.to }, self.tolerance).map_err(of_sweep)?;
            Ok(found.filter(|c| c.depth > 2.0 * self.tolerance))
        };
        for _ in 0..MAX_RAISES {
            let mut first = None;
            for (k, rider) in raised.riders.iter().enumerate().filter(|(_, r)| !raised.is_hopeless[r.rides.index()]) {
                if let Some(contact) = met(rider.body(clearance))? {
                    first = Some((k, contact));
                    break;
                }
            }
            let Some((k, contact)) = first else { return Ok(()) };
            let rider = &raised.riders[k];
            let now = raised.lengths[rider.rides.index()];
            let is_free = |way: f64| -> Result<bool, VerifyError> {
                let Some(body) = rider.higher(way, clearance) else { return Ok(true) };
                Ok(met(&body)?.is_none())
            };
            let way = if self.is_until_first { Some(FIRST_WAY) } else { free_way(self.longest - now, is_free)? };
            let raise = Raise {
                to: way.map_or(f64::INFINITY, |way| now + way),
                block: m.block,
                body: rider.name.clone(),
                obstacle: STOCK.to_owned(),
                place: contact.place,
                cl: s.to,
            };
            raised.take(rider.rides, raise)?;
            if self.is_until_first {
                return Ok(());
            }
        }
        Ok(())
    }
}

fn of_sweep(e: facemill_z_map::SweepError) -> VerifyError {
    VerifyError::Sweep { problem: e.to_string() }
}

/// The least way up that is free, by doubled steps and halves; `None` where none is up to the most.
fn free_way(most: f64, is_free: impl Fn(f64) -> Result<bool, VerifyError>) -> Result<Option<f64>, VerifyError> {
    let (mut blocked, mut free) = (0.0, FIRST_WAY.min(most));
    while !is_free(free)? {
        if free >= most {
            return Ok(None);
        }
        blocked = free;
        free = (2.0 * free).min(most);
    }
    while free - blocked > RESOLUTION {
        let middle = 0.5 * (blocked + free);
        *(if is_free(middle)? { &mut free } else { &mut blocked }) = middle;
    }
    Ok(Some(free))
}

/// Whether a body is tested as it is, or with the clearance that it keeps.
#[derive(Clone, Copy, PartialEq, Eq)]
enum BodyClearance {
    None,
    Kept,
}

/// A body with the length that it rides on.
struct Rider {
    name: String,
    rides: AssemblyLength,
    frustum: RoundFrustum,
    clearance: f64,
    plain: TurnedBody,
    kept: TurnedBody,
}

impl Rider {
    fn body(&self, clearance: BodyClearance) -> &TurnedBody {
        if clearance == BodyClearance::None { &self.plain } else { &self.kept }
    }

    /// The body so much higher; `None` where it has no volume.
    fn higher(&self, way: f64, clearance: BodyClearance) -> Option<TurnedBody> {
        let f = &self.frustum;
        let kept = if clearance == BodyClearance::None { 0.0 } else { self.clearance };
        TurnedBody::frustum([f.z_low + way, f.z_high + way], [f.radius_low, f.radius_high], kept).ok()
    }
}

/// The lengths so far, and the tested bodies.
struct Raised<'r> {
    assembly: &'r OpenAssembly,
    slack: f64,
    asks: [bool; 4],
    lengths: Lengths,
    is_hopeless: [bool; 4],
    riders: Vec<Rider>,
    needs: Needs,
}

impl<'r> Raised<'r> {
    fn new(run: &StockNeeds<'r, '_>, lengths: Lengths) -> Result<Self, VerifyError> {
        let mut raised = Self {
            assembly: run.assembly,
            slack: run.scene.settings.clearance_slack,
            asks: run.asks,
            lengths,
            is_hopeless: [false; 4],
            riders: Vec::new(),
            needs: Needs::default(),
        };
        raised.build()?;
        Ok(raised)
    }

    fn build(&mut self) -> Result<(), VerifyError> {
        let BuiltAssembly { tool, rides } = built(self.assembly, &self.lengths)?;
        self.riders.clear();
        for (section, rides) in tool.sections().into_iter().zip(rides) {
            let Some(rides) = rides.filter(|r| self.asks[r.index()]) else { continue };
            let ToolSection { name, frustum } = section;
            let clearance = (frustum.rounding - self.slack).max(0.0);
            let of = |kept: f64| {
                let (f, heights) = (&frustum, [frustum.z_low, frustum.z_high]);
                TurnedBody::frustum(heights, [f.radius_low, f.radius_high], kept)
            };
            // A section without length is none.
            let (Ok(plain), Ok(kept)) = (of(0.0), of(clearance)) else { continue };
            self.riders.push(Rider { name, rides, frustum, clearance, plain, kept });
        }
        Ok(())
    }

    fn take(&mut self, length: AssemblyLength, raise: Raise) -> Result<(), VerifyError> {
        let to = raise.to;
        self.needs.add(length, raise);
        if to.is_infinite() {
            self.is_hopeless[length.index()] = true;
            return Ok(());
        }
        self.lengths[length.index()] = to;
        self.assembly.rest(&mut self.lengths);
        self.build()
    }
}

/// The assembly with these lengths.
pub(crate) fn built(assembly: &OpenAssembly, lengths: &Lengths) -> Result<BuiltAssembly, VerifyError> {
    assembly.built(lengths).map_err(|e| VerifyError::Tool { problem: e.to_string() })
}

/// The tool of a built assembly.
pub(crate) fn tool_of(assembly: &OpenAssembly, lengths: &Lengths) -> Result<ToolAssembly, VerifyError> {
    Ok(built(assembly, lengths)?.tool)
}
