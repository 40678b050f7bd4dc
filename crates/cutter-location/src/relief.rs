//! What would help where no posture is feasible.

use facemill_cl_data::{CcPoint, Posture};
use facemill_tool_model::ToolAssembly;

use crate::{Hints, PoseTest, SearchCurve, SearchSettings, Workcell, search};

/// A change with which a CC point has a feasible posture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Relief {
    /// The search curve may go on to this tilt, rad.
    Tilt(f64),
    /// The search curve may go on to this rotate, rad, with its sign.
    Rotate(f64),
    /// A cutter of this radius, mm: its body narrower in proportion, its corner as it is where that fits.
    Radius(f64),
    /// The same cutter sticking out this far, mm: its body longer by as much.
    StickOut(f64),
}

/// Farthest tilt that is tried, rad: beyond, a face mill cuts with its side.
const FARTHEST_TILT: f64 = 60.0 * std::f64::consts::PI / 180.0;

/// Smallest part of the radius that is tried.
const SMALLEST_RADIUS: f64 = 0.1;

/// Farthest rotate that is tried, rad: beyond, the tool leans backward.
const FARTHEST_ROTATE: f64 = 120.0 * std::f64::consts::PI / 180.0;

/// Largest growth of the stick-out that is tried, in radii.
const LONGEST: f64 = 4.0;

/// Amounts of a change that are tried before the smallest is bisected: what only helps in between is not found.
const TRIALS: u32 = 24;

/// How near below the reported amount the point is still blocked.
const BLOCKED_AT: f64 = 0.95;

/// Bisections: enough to exhaust a double.
const MAX_BISECTIONS: u32 = 60;

/// The smallest single changes of range or tool, each alone, with which the search of a CC point finds a posture: with the
/// change it does, with 95 % of it it does not. Changes that do not help, or only in amounts between the tried ones, are not
/// among them. A point that has a posture needs none.
pub fn reliefs(cell: &Workcell<'_>, cc: &CcPoint, curve: &SearchCurve, settings: &SearchSettings) -> Vec<Relief> {
    let found = |cell: &Workcell<'_>, curve: &SearchCurve| {
        let test = PoseTest::new(cell);
        search(&test, cc, curve, settings, 0.0, None, &mut Hints::default()).is_ok()
    };
    if found(cell, curve) {
        return Vec::new();
    }
    let test = PoseTest::new(cell);
    let reaches = |end: Posture| {
        let longer = curve.with_end(end);
        longer.is_some_and(|c| search(&test, cc, &c, settings, 0.0, None, &mut Hints::default()).is_ok())
    };
    let with_tool =
        |tool: Option<ToolAssembly>| tool.is_some_and(|tool| found(&Workcell { tool: &tool, ..cell.clone() }, curve));
    let (end, tool) = (curve.end(), cell.tool);
    let sign = if end.rotate < 0.0 { -1.0 } else { 1.0 };
    let radius = tool.cutter().radius();
    let tilt = smallest(FARTHEST_TILT - end.tilt, |more| reaches(Posture { tilt: end.tilt + more, ..end }));
    let to_turn = if end.rotate == 0.0 { 0.0 } else { FARTHEST_ROTATE - end.rotate.abs() };
    let rotate = smallest(to_turn, |more| reaches(Posture { rotate: end.rotate + sign * more, ..end }));
    let thinner = smallest(radius * (1.0 - SMALLEST_RADIUS), |less| with_tool(tool.with_radius(radius - less).ok()));
    let longer = smallest(LONGEST * radius, |more| with_tool(tool.longer_by(more).ok()));
    [
        tilt.map(|more| Relief::Tilt(end.tilt + more)),
        rotate.map(|more| Relief::Rotate(end.rotate + sign * more)),
        thinner.map(|less| Relief::Radius(radius - less)),
        longer.map(|more| Relief::StickOut(tool.stick_out() + more)),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// An amount up to `most` that is enough while 95 % of it are not; `None` where no tried one is.
fn smallest(most: f64, mut is_enough: impl FnMut(f64) -> bool) -> Option<f64> {
    if !(most > 0.0 && most.is_finite()) {
        return None;
    }
    let at = |k: u32| most * f64::from(k) / f64::from(TRIALS);
    let first = (1..=TRIALS).find(|&k| is_enough(at(k)))?;
    let (mut lacking, mut enough) = (at(first - 1), at(first));
    for _ in 0..MAX_BISECTIONS {
        if lacking >= BLOCKED_AT * enough {
            break;
        }
        let middle = 0.5 * (lacking + enough);
        if is_enough(middle) { enough = middle } else { lacking = middle }
    }
    // Told is only what was tried itself.
    (!is_enough(BLOCKED_AT * enough)).then_some(enough)
}

#[cfg(test)]
mod tests {
    use super::smallest;

    #[test]
    fn smallest_amounts_are_enough_and_their_largest_parts_are_not() {
        for threshold in [1e-3, 0.2, 3.0, 9.9] {
            let amount = smallest(10.0, |x| x >= threshold).unwrap();
            assert!(amount >= threshold && 0.95 * amount < threshold, "{amount} for {threshold}");
        }
        assert_eq!(smallest(10.0, |x| x > 10.0), None);
        assert_eq!(smallest(0.0, |_| true), None);
        assert_eq!(smallest(f64::NAN, |_| true), None);
    }
}
