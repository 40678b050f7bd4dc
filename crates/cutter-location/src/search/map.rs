//! Map of the feasible set over tilt × rotate at one CC point (CLOPT fig. 3), in proven cells.
//!
//! A cell is proven free or blocked as a whole, by bounds on how the tool turns within it, or split
//! into quarters, down to a resolution. The proof holds for the answer of [`PoseTest::try_posture`]
//! for every posture of the cell, its edges included.

use std::sync::atomic::{AtomicUsize, Ordering};

use facemill_cl_data::{Cancelled, CcPoint, Monitor, Posture};
use rayon::prelude::*;

use crate::pose::pose_test::PoseTest;
use crate::pose::workcell::{Hints, Infeasible};
use crate::search::cell_proof::{PostureCell, Proof};

/// Tilts and rotates from one to another, rad, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapRange {
    /// Smallest and largest tilt.
    pub tilt: [f64; 2],
    /// Smallest and largest rotate.
    pub rotate: [f64; 2],
}

/// Reason why two ranges of angles cannot be mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// Tilt must grow, within 0..90°.
    #[error("the tilt range of a map must satisfy 0 <= smallest < largest < 90 degrees")]
    Tilt,
    /// Rotate must grow, by one turn at most.
    #[error("the rotate range of a map must satisfy smallest < largest <= smallest + 360 degrees")]
    Rotate,
    /// The resolution is not a positive number, or so fine that the map would not fit.
    #[error("the resolution must be a positive angle that divides each range into no more than {MAX_DIVISIONS} parts")]
    Resolution,
    /// The monitor cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Largest number of parts of a range: 4000 at each side make 16 million cells at worst, a
/// gigabyte.
pub const MAX_DIVISIONS: u32 = 4000;

/// Knowledge of the postures of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CellState {
    /// All are feasible: proven.
    Free,
    /// None is feasible: proven. All are blocked by this body and obstacle, limit or cone; places
    /// and values are those of the posture in the middle.
    Blocked(Infeasible),
    /// Neither could be proven for a cell of the finest size; holds the verdict on the posture in
    /// its middle, `None` where that is feasible.
    Uncertain(Option<Infeasible>),
}

/// A cell of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapCell {
    /// Its postures.
    pub range: MapRange,
    /// Knowledge of them.
    pub state: CellState,
}

/// Map of cells that cover the range without overlap, except for their edges.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SolutionMap {
    /// All postures.
    pub range: MapRange,
    /// No uncertain cell has a side longer than this, rad.
    pub resolution: f64,
    /// The cells, in blocks along rotate, then tilt.
    pub cells: Vec<MapCell>,
    /// Number of judged ranges, each with one pose test and attempts at a proof.
    pub judged: usize,
}

/// Parts of the range's area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AreaFractions {
    /// Proven free.
    pub free: f64,
    /// Proven blocked.
    pub blocked: f64,
    /// Neither.
    pub uncertain: f64,
}

/// Halvings from the largest cells to the finest: larger cells are hardly ever proven.
const LEVELS: u32 = 5;

/// Maps the feasible set of a CC point to an angular resolution, rad.
///
/// The result does not depend on the number of threads. The monitor advances by one for each of
/// [`n_steps`].
///
/// When range or resolution are invalid, or the monitor cancels.
pub fn map(
    test: &PoseTest<'_>,
    cc: &CcPoint,
    range: MapRange,
    resolution: f64,
    monitor: &dyn Monitor,
) -> Result<SolutionMap, MapError> {
    let divisions = range.divisions(resolution)?;
    let judged = AtomicUsize::new(0);
    let mapper = Mapper { test, cc, resolution, judged: &judged };
    let n_cells = divisions[0] * divisions[1];
    let blocks: Vec<Vec<MapCell>> = (0..n_cells)
        .into_par_iter()
        .map(|k| {
            monitor.checkpoint()?;
            let mut cells = Vec::new();
            mapper.divide(
                range.part([k % divisions[0], k / divisions[0]], divisions),
                &mut Hints::default(),
                &mut cells,
            );
            monitor.advance(1);
            Ok(cells)
        })
        .collect::<Result<_, Cancelled>>()?;
    let cells = blocks.into_iter().flatten().collect();
    Ok(SolutionMap { range, resolution, cells, judged: judged.into_inner() })
}

/// Counts the steps of [`map`]: its largest cells.
///
/// # Errors
/// When range or resolution are invalid.
pub fn n_steps(range: &MapRange, resolution: f64) -> Result<usize, MapError> {
    range.divisions(resolution).map(|[tilts, rotates]| tilts as usize * rotates as usize)
}

struct Mapper<'m, 'a> {
    test: &'m PoseTest<'a>,
    cc: &'m CcPoint,
    resolution: f64,
    judged: &'m AtomicUsize,
}

impl Mapper<'_, '_> {
    /// Collects the cells of a range: itself where something is proven for it or it is small
    /// enough, else those of its parts.
    fn divide(&self, range: MapRange, hints: &mut Hints, cells: &mut Vec<MapCell>) {
        self.judged.fetch_add(1, Ordering::Relaxed);
        let cell = PostureCell::new(self.test, self.cc, range.middle(), range.half());
        let state = match cell.judge(hints) {
            Proof::Free => CellState::Free,
            Proof::Blocked(why) => CellState::Blocked(why),
            Proof::None(middle) => {
                // Rounding of a halved range must not cause another level.
                let parts = range.half().map(|half| if 2.0 * half > self.resolution * (1.0 + 1e-9) { 2 } else { 1 });
                if parts != [1, 1] {
                    for k in 0..parts[0] * parts[1] {
                        self.divide(range.part([k % parts[0], k / parts[0]], parts), hints, cells);
                    }
                    return;
                }
                CellState::Uncertain(middle)
            }
        };
        cells.push(MapCell { range, state });
    }
}

impl MapRange {
    /// Returns the number of largest cells along tilt and rotate.
    fn divisions(&self, resolution: f64) -> Result<[u32; 2], MapError> {
        let ([tilt, steepest], [rotate, last]) = (self.tilt, self.rotate);
        if !(0.0 <= tilt && tilt < steepest && steepest < std::f64::consts::FRAC_PI_2) {
            return Err(MapError::Tilt);
        }
        if !(rotate.is_finite() && rotate < last && last - rotate <= std::f64::consts::TAU * (1.0 + 1e-12)) {
            return Err(MapError::Rotate);
        }
        let finest = f64::from(MAX_DIVISIONS) * resolution;
        if !(resolution > 0.0 && steepest - tilt <= finest && last - rotate <= finest) {
            return Err(MapError::Resolution);
        }
        let largest = resolution * f64::from(1 << LEVELS);
        Ok([steepest - tilt, last - rotate].map(|width| (width / largest - 1e-9).ceil().max(1.0) as u32))
    }

    /// Returns one of equal parts, by its place along tilt and rotate.
    fn part(&self, at: [u32; 2], parts: [u32; 2]) -> Self {
        let cut = |[from, to]: [f64; 2], k: u32, n: u32| {
            let edge = |k: u32| if k == n { to } else { from + (to - from) * f64::from(k) / f64::from(n) };
            [edge(k), edge(k + 1)]
        };
        Self { tilt: cut(self.tilt, at[0], parts[0]), rotate: cut(self.rotate, at[1], parts[1]) }
    }

    /// Returns the posture in the middle.
    pub fn middle(&self) -> Posture {
        let mean = |[a, b]: [f64; 2]| 0.5 * (a + b);
        Posture { tilt: mean(self.tilt), rotate: mean(self.rotate) }
    }

    /// Returns the largest differences of tilt and rotate from the middle, rounded up.
    fn half(&self) -> [f64; 2] {
        [self.tilt, self.rotate].map(|[a, b]| 0.5 * (b - a) + f64::EPSILON * (a.abs() + b.abs()))
    }

    /// Returns whether a posture is in the range.
    pub fn holds(&self, posture: &Posture) -> bool {
        let within = |v: f64, [from, to]: [f64; 2]| from <= v && v <= to;
        within(posture.tilt, self.tilt) && within(posture.rotate, self.rotate)
    }

    /// Returns the product of the widths, rad².
    fn area(&self) -> f64 {
        (self.tilt[1] - self.tilt[0]) * (self.rotate[1] - self.rotate[0])
    }
}

impl SolutionMap {
    /// Returns the fractions of the range that are free, blocked and uncertain.
    pub fn fractions(&self) -> AreaFractions {
        let mut sums = AreaFractions::default();
        for cell in &self.cells {
            match cell.state {
                CellState::Free => sums.free += cell.range.area(),
                CellState::Blocked(_) => sums.blocked += cell.range.area(),
                CellState::Uncertain(_) => sums.uncertain += cell.range.area(),
            }
        }
        // By the cells' own sum, so that a map with only one kind is entirely of that kind.
        let all = sums.free + sums.blocked + sums.uncertain;
        AreaFractions { free: sums.free / all, blocked: sums.blocked / all, uncertain: sums.uncertain / all }
    }
}
