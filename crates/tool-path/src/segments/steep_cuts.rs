//! Cuts on which the tool would go down into stock more steeply than it may.

use facemill_cl_data::{Cancelled, ClPoint, Monitor};
use facemill_cutter_location::links::approach::RAMP_SLACK;
use facemill_cutter_location::links::link::between;
use facemill_cutter_location::{Hints, Infeasible, PoseTest, angle_between};
use rayon::prelude::*;

use crate::segments::{Cut, LeftOut, PassSegment};

/// Largest way of the tip, mm, and turn of the axis, rad, between two poses at which a block is
/// looked at.
const LARGEST_STEP: f64 = 0.5;
const LARGEST_TURN: f64 = 0.2 * std::f64::consts::PI / 180.0;

/// Most poses of a block.
const MOST_POSES: f64 = 1e4;

/// Descent of a block, mm, that is rounding of its ends.
const ROUNDING: f64 = 2e-3;

/// Returns pieces without the blocks on which all of the cutter's bottom goes down into stock more
/// steeply than the tool may: a piece ends before such a block, and the next one begins behind it
/// with an entry of its own. A point between two such blocks is left out.
///
/// Stock is that of the workcell: nothing of it counts as cut.
///
/// # Errors
/// When the monitor cancels.
pub fn without_steep_cuts(
    test: &PoseTest<'_>,
    pieces: Vec<PassSegment>,
    left_out: &mut Vec<LeftOut>,
    monitor: &dyn Monitor,
) -> Result<Vec<PassSegment>, Cancelled> {
    let divided: Vec<(Vec<PassSegment>, Vec<LeftOut>)> = pieces
        .into_par_iter()
        .map(|piece| {
            monitor.checkpoint()?;
            Ok(divide(test, piece))
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut kept = Vec::with_capacity(divided.len());
    for (pieces, lost) in divided {
        kept.extend(pieces);
        left_out.extend(lost);
    }
    Ok(kept)
}

/// Divides a piece at its steep blocks; points that are then alone are left out.
fn divide(test: &PoseTest<'_>, mut piece: PassSegment) -> (Vec<PassSegment>, Vec<LeftOut>) {
    let mut hints = Hints::default();
    let steep: Vec<Option<f64>> =
        piece.cuts.windows(2).map(|w| steep_descent(test, &w[0].pose.cl, &w[1].pose.cl, &mut hints)).collect();
    if steep.iter().all(Option::is_none) {
        return (vec![piece], Vec::new());
    }
    // Runs between steep blocks, with the descent before or behind each.
    let mut runs: Vec<(Vec<Cut>, Option<f64>)> = Vec::new();
    for (cut, before) in std::mem::take(&mut piece.cuts).into_iter().zip(std::iter::once(None).chain(steep)) {
        match (runs.last_mut(), before) {
            (Some((run, _)), None) => run.push(cut),
            (last, _) => {
                if let Some((_, of_run)) = last {
                    *of_run = of_run.or(before);
                }
                runs.push((vec![cut], before));
            }
        }
    }
    let (mut pieces, mut lost) = (Vec::new(), Vec::new());
    for (cuts, steep) in runs {
        if cuts.len() >= 2 {
            pieces.push(PassSegment { cuts, ..piece.clone() });
            continue;
        }
        let reason = test.describe(&Infeasible::Ramp { angle: steep.unwrap_or_default() });
        let of = |cut: &Cut| LeftOut { place: cut.cc.position, reason: reason.clone(), searched: None };
        lost.extend(cuts.iter().filter(|cut| !cut.inserted).map(of));
    }
    (pieces, lost)
}

/// Returns the steepest descent into stock on a block, rad, if it is steeper than the tool may go.
fn steep_descent(test: &PoseTest<'_>, from: &ClPoint, to: &ClPoint, hints: &mut Hints) -> Option<f64> {
    let limit = test.cell.tool.max_ramp_angle() + RAMP_SLACK;
    if limit >= std::f64::consts::FRAC_PI_2 {
        return None;
    }
    let steps = ((to.tip - from.tip).norm() / LARGEST_STEP).max(angle_between(&from.axis, &to.axis) / LARGEST_TURN);
    let n = steps.ceil().clamp(1.0, MOST_POSES) as usize;
    let mut steepest: Option<f64> = None;
    let mut before = *from;
    for k in 1..=n {
        let here = if k == n { *to } else { between(from, to, k as f64 / n as f64) };
        let [down, across] = descent_of_bottom(&before, &here, test.cell.tool.cutter().radius());
        let angle = down.atan2(across);
        if down > limit.tan() * across + ROUNDING / n as f64
            && steepest.is_none_or(|steepest| angle > steepest)
            && test.cuts_stock(&here, hints)
        {
            steepest = Some(angle);
        }
        before = here;
    }
    steepest
}

/// Returns how far the point of a cutter's bottom goes down along the tool axis that goes down
/// least, and how far the tip goes square to it, mm.
///
/// The way down is linear over the bottom, so that it is least at the rim: that of the tip less
/// radius times turn. A cutter that follows a concave surface swings one half of its bottom up.
fn descent_of_bottom(from: &ClPoint, to: &ClPoint, radius: f64) -> [f64; 2] {
    let way = to.tip - from.tip;
    let axis = (from.axis.into_inner() + to.axis.into_inner()).normalize();
    let along = way.dot(&axis);
    [-along - radius * angle_between(&from.axis, &to.axis), (way - axis * along).norm()]
}

#[cfg(test)]
#[path = "../../tests/unit/segments/steep_cuts.rs"]
mod tests;
