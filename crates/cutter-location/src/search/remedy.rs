//! Remedies for points without a feasible posture.

use facemill_cl_data::{CcPoint, Posture};
use facemill_tool_model::ToolAssembly;

use crate::pose::pose_test::PoseTest;
use crate::pose::workcell::{Hints, Workcell};
use crate::search;
use crate::search::SearchSettings;
use crate::search::bezier::SearchCurve;
use crate::search::certified::certified_search;

/// A change that gives a CC point a feasible posture.
///
/// Exhaustive, so that a new one is handled everywhere: reports advise on each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Remedy {
    /// Extends the search curve to this tilt, rad.
    Tilt(f64),
    /// Extends the search curve to this rotate, rad, with its sign.
    Rotate(f64),
    /// A cutter of this radius, mm: its body narrower in proportion, its corner unchanged where
    /// that fits.
    Radius(f64),
    /// The same cutter sticking out this far, mm: its body longer by as much.
    StickOut(f64),
    /// The search with a proof of this width: its posture was stepped over.
    CertifiedWidth(f64),
}

/// Farthest tilt that is tried, rad: beyond, a face mill cuts with its side.
const FARTHEST_TILT: f64 = 60.0 * std::f64::consts::PI / 180.0;

/// Smallest fraction of the radius that is tried.
const SMALLEST_RADIUS: f64 = 0.1;

/// Farthest rotate that is tried, rad: beyond, the tool leans backward.
const FARTHEST_ROTATE: f64 = 120.0 * std::f64::consts::PI / 180.0;

/// Largest growth of the stick-out that is tried, in radii.
const LONGEST: f64 = 4.0;

/// Number of amounts of a change that are tried before the smallest is bisected: an amount that
/// helps only in between is not found.
const TRIALS: u32 = 24;

/// Fraction of the reported amount at which the point is still blocked.
const BLOCKED_AT: f64 = 0.95;

/// Amounts that are tried in bisection: enough to exhaust a double.
const MAX_BISECTIONS: u32 = 60;

/// Width to which "blocked" is proven: shorter feasible stretches of the curve are ignored. Larger:
/// the reported need may be more than the real one. Smaller: slower, and the width may not be
/// reached in [`MOST_TESTS`](crate::search::certified::MOST_TESTS).
const WIDTH: f64 = 0.01;

/// Smallest width to which any curve can be searched within
/// [`MOST_TESTS`](crate::search::certified::MOST_TESTS) intervals: halving to 2^-11 takes 2^12 − 1
/// of them.
const SMALLEST_WIDTH: f64 = 1.0 / 2048.0;

/// Returns the smallest single changes of range or tool, each alone, that give a CC point a posture
/// on its search curve.
///
/// With the change, a posture has been tested as feasible. With 95 % of it the curve is proven
/// blocked, except for feasible stretches shorter than 0.01 of it (than `settings.certified`, where
/// that is less, down to 1/2048). Changes that do not help, or only in amounts between the tried
/// ones, are not among them, nor are postures beside the curve. A point where the search finds a
/// posture needs no change; one where it merely steps over a posture that the proof finds needs
/// [`Remedy::CertifiedWidth`].
pub fn reliefs(cell: &Workcell<'_>, cc: &CcPoint, curve: &SearchCurve, settings: &SearchSettings) -> Vec<Remedy> {
    let test = PoseTest::new(cell);
    if search(&test, cc, curve, settings, 0.0, None, &mut Hints::default()).is_ok() {
        return Vec::new();
    }
    let width = settings.certified.unwrap_or(WIDTH).clamp(SMALLEST_WIDTH, WIDTH);
    let proven = SearchSettings { certified: Some(width), ..*settings };
    let has_posture = |test: &PoseTest<'_>, curve: &SearchCurve| {
        certified_search(test, cc, curve, &proven, 0.0, None, &mut Hints::default()).found.is_ok()
    };
    if has_posture(&test, curve) {
        return vec![Remedy::CertifiedWidth(width)];
    }
    let reaches = |end: Posture| curve.with_end(end).is_some_and(|longer| has_posture(&test, &longer));
    let with_tool = |tool: Option<ToolAssembly>| {
        tool.is_some_and(|tool| has_posture(&PoseTest::new(&Workcell { tool: &tool, ..cell.clone() }), curve))
    };
    let (end, tool) = (curve.end(), cell.tool);
    let sign = if end.rotate < 0.0 { -1.0 } else { 1.0 };
    let radius = tool.cutter().radius();
    let tilt = smallest(FARTHEST_TILT - end.tilt, |more| reaches(Posture { tilt: end.tilt + more, ..end }));
    let to_turn = if end.rotate == 0.0 { 0.0 } else { FARTHEST_ROTATE - end.rotate.abs() };
    let rotate = smallest(to_turn, |more| reaches(Posture { rotate: end.rotate + sign * more, ..end }));
    let thinner = smallest(radius * (1.0 - SMALLEST_RADIUS), |less| with_tool(tool.with_radius(radius - less).ok()));
    let longer = smallest(LONGEST * radius, |more| with_tool(tool.longer_by(more).ok()));
    [
        tilt.map(|more| Remedy::Tilt(end.tilt + more)),
        rotate.map(|more| Remedy::Rotate(end.rotate + sign * more)),
        thinner.map(|less| Remedy::Radius(radius - less)),
        longer.map(|more| Remedy::StickOut(tool.stick_out() + more)),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Returns an amount up to `most` that is enough while 95 % of it is not; `None` where no tried
/// amount is enough, or every one found still has a smaller one that is.
fn smallest(most: f64, mut is_enough: impl FnMut(f64) -> bool) -> Option<f64> {
    if !(most > 0.0 && most.is_finite()) {
        return None;
    }
    let at = |k: u32| most * f64::from(k) / f64::from(TRIALS);
    let first = (1..=TRIALS).find(|&k| is_enough(at(k)))?;
    let (mut lacking, mut enough) = (at(first - 1), at(first));
    for _ in 0..MAX_BISECTIONS {
        let less = BLOCKED_AT * enough;
        if lacking < less {
            let middle = 0.5 * (lacking + enough);
            if is_enough(middle) { enough = middle } else { lacking = middle }
        } else if is_enough(less) {
            // Amounts that help are not all above those that do not: continue from the smaller
            // amount.
            (lacking, enough) = (0.0, less);
        } else {
            // Return only an amount that was tried itself.
            return Some(enough);
        }
    }
    None
}

#[cfg(test)]
#[path = "../../tests/unit/search/remedy.rs"]
mod tests;
