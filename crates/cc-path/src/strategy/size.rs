//! Bounds on the size of a path: what does not fit is refused before it fills time and memory, with
//! the setting that makes it fit.

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::Point3;

use crate::error::{PathError, Remedy};
use crate::sections::Sections;
use crate::strategy::patch::Fineness;
use crate::strategy::settings::LaySettings;

/// Most passes of a path. A blade of 4 m cut at 0.2 mm has as many; more is a wrong setting.
pub(crate) const MAX_LEVELS: usize = 20_000;

/// Most points of a path: at 1 mm, 2 km of passes. A plan takes about 4 kB for each.
pub const MAX_POINTS: usize = 2_000_000;

/// Most facets that passes cross, each counted once for each pass: 100 bytes for each.
pub(crate) const MAX_CROSSINGS: usize = 20_000_000;

/// Most pieces that facets are cut up into, besides the facets themselves; halving of edges may
/// overshoot by four. 200 bytes for each.
pub(crate) const MAX_PIECES: usize = 2_000_000;

/// Causes of the distance of passes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepOverCause {
    /// Largest step-over, mm.
    pub(crate) largest: f64,
    /// Whether it, and not the strip width, decides everywhere.
    pub(crate) is_largest: bool,
}

impl StepOverCause {
    /// The remedy that lays passes so many times as far apart.
    pub(crate) fn remedy(&self, times: f64) -> Remedy {
        let remedy =
            if self.is_largest { Remedy::LargestStepOver(self.largest * times) } else { Remedy::StripWidth(times) };
        remedy.rounded_up()
    }
}

/// Refuses a region whose facets would be cut up into too many pieces; `facets` are their corners.
///
/// Pieces fall at least as fast as the longest edge or the largest bend of a piece grows.
///
/// # Errors
/// Returns an error with the setting that causes most of the pieces.
pub(crate) fn check_pieces(
    facets: impl Iterator<Item = [Point3<f64>; 3]>,
    sections: Option<&Sections>,
    fineness: &Fineness,
) -> Result<(), PathError> {
    let (mut by_length, mut by_bend) = (0.0, 0.0);
    for [a, b, c] in facets {
        let edges = [(a, b), (b, c), (c, a)];
        let most =
            |of: &dyn Fn(&Point3<f64>, &Point3<f64>) -> f64| edges.iter().map(|(p, q)| of(p, q)).fold(0.0, f64::max);
        by_length += halved_into(edges.map(|(p, q)| (p - q).norm() / fineness.max_edge)) - 1.0;
        by_bend += (most(&|p, q| sections.map_or(0.0, |s| s.bend(p, q)) / fineness.max_bend) - 1.0).max(0.0);
    }
    let n_pieces = f64::max(by_length, by_bend);
    let times = n_pieces / MAX_PIECES as f64;
    if times <= 1.0 {
        return Ok(());
    }
    let remedy = if by_bend >= by_length {
        Remedy::ChordTolerance(2.0 * fineness.max_bend * times)
    } else {
        Remedy::LargestStepOver(fineness.max_edge * times)
    };
    Err(PathError::TooManyPieces { n_pieces, limit: MAX_PIECES, remedy: remedy.rounded_up() })
}

/// Returns the number of pieces of a facet, about, when edges longer than 1 are halved until none
/// is: four from a facet with three such edges, three with two, two with one. A needle thus has
/// fewer than a facet with equal edges.
fn halved_into(mut edges: [f64; 3]) -> f64 {
    edges.sort_by(f64::total_cmp);
    let [short, middle, long] = edges.map(|length| length.max(1.0));
    let ratio = middle / short;
    // log2 3 is less than 13/8.
    short.powi(2) * (ratio * ratio.sqrt() * ratio.sqrt().sqrt().sqrt()) * (long / middle)
}

/// Points that a path may still have; shared by passes that get theirs at the same time.
///
/// Whether a path has too many does not depend on their order: each pass is refused by what is left
/// only when the sum is too large.
pub(crate) struct PointsLeft(AtomicUsize);

impl PointsLeft {
    pub(crate) fn new(most: usize) -> Self {
        Self(AtomicUsize::new(most))
    }

    pub(crate) fn get(&self) -> usize {
        self.0.load(Ordering::Relaxed)
    }

    /// Takes so many; `None` where they are not left.
    pub(crate) fn take(&self, n: usize) -> Option<()> {
        self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(n)).ok().map(drop)
    }
}

/// Returns the error for passes with too many points: because of the largest step where that alone
/// requires them, else of the chord tolerance.
///
/// A chord tolerance requires 1 / √tolerance points. `measured` is the measured share of the
/// length, and its points.
pub(crate) fn too_many_points(
    settings: &LaySettings,
    length: f64,
    n_passes: usize,
    measured: (f64, usize),
) -> PathError {
    let limit = settings.max_points as f64;
    // A pass has a point more than steps, and may end with a shorter one.
    let room = |taken: f64| (limit - taken).max(0.1 * limit);
    let (ends, steps) = (2.0 * n_passes as f64, length / settings.max_step);
    let n_points = (measured.1 as f64 / measured.0.max(f64::MIN_POSITIVE)).max(steps).max(limit);
    let remedy = if steps + ends > limit {
        Remedy::LargestStep(length / room(ends))
    } else {
        Remedy::ChordTolerance(settings.chord_tolerance * (ESTIMATE * n_points / room(steps + ends)).powi(2))
    };
    PathError::TooManyPoints { length, n_points, limit: settings.max_points, remedy: remedy.rounded_up() }
}

/// How much more points passes may need than an estimate from some of them says.
const ESTIMATE: f64 = 1.2;

#[cfg(test)]
#[path = "../../tests/unit/strategy/size.rs"]
mod tests;
