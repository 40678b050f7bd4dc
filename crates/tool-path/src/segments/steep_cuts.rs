//! Cuts on which the tool would go down into stock more steeply than it may.

use std::f64::consts::{FRAC_PI_2, PI};

use facemill_cl_data::{Cancelled, ClPoint, CuttingLaw, Monitor};
use facemill_cutter_location::links::approach::RAMP_SLACK;
use facemill_cutter_location::links::link::between;
use facemill_cutter_location::{Hints, Infeasible, PoseTest, SearchSettings, angle_between};
use facemill_inverse_kinematics::AxisValues;
use rayon::prelude::*;

use crate::linearity::{Linearity, turned_near};
use crate::segments::{Cut, Filler, LeftOut, PassSegment, PosePair};

/// Largest way of the tip, mm, and turn of the axis, rad, between two poses at which a block is
/// looked at.
const LARGEST_STEP: f64 = 0.5;
const LARGEST_TURN: f64 = 0.2 * PI / 180.0;

/// Least and greatest number of steps of a block. Along a block without RTCP the descent changes
/// evenly but for terms of third order: the least number shows it, with the ends extrapolated.
const LEAST_STEPS: f64 = 4.0;
const MOST_STEPS: f64 = 1e4;

/// Descent of a block, mm, that is rounding of its ends.
const ROUNDING: f64 = 2e-3;

/// Halvings of a block whose motion is too steep where its poses are not. Each makes the bow of the
/// motion a quarter, and the descent at its ends a half.
const MAX_HALVINGS: u32 = 5;

/// Cuts of passes, and the motion of the control between them.
pub struct CutMotion<'t, 'a> {
    /// Tests of poses.
    pub test: &'t PoseTest<'a>,
    /// Motion between blocks, and its tolerance.
    pub linearity: &'t Linearity,
    /// Search for poses to insert, where the posture between two is not feasible.
    pub fallback: Option<&'t SearchSettings>,
}

/// Returns pieces without the blocks on which all of the cutter's bottom goes down into stock more
/// steeply than the tool may: a piece ends before such a block, and the next one begins behind it
/// with an entry of its own. A point between two such blocks is left out.
///
/// Without RTCP the tip moves on a bow between two poses, whose ends may be too steep where the way
/// from one pose to the next is not: such a block gets poses between until it is flat enough.
///
/// Stock is that of the workcell: nothing of it counts as cut.
///
/// # Errors
/// When the monitor cancels.
pub fn without_steep_cuts(
    motion: &CutMotion<'_, '_>,
    pieces: Vec<PassSegment>,
    left_out: &mut Vec<LeftOut>,
    monitor: &dyn Monitor,
) -> Result<Vec<PassSegment>, Cancelled> {
    let divided: Vec<(Vec<PassSegment>, Vec<LeftOut>)> = pieces
        .into_par_iter()
        .map(|piece| {
            monitor.checkpoint()?;
            Ok(motion.divide(piece))
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut kept = Vec::with_capacity(divided.len());
    for (pieces, lost) in divided {
        kept.extend(pieces);
        left_out.extend(lost);
    }
    Ok(kept)
}

impl CutMotion<'_, '_> {
    /// Divides a piece at its steep blocks; points that are then alone are left out.
    fn divide(&self, mut piece: PassSegment) -> (Vec<PassSegment>, Vec<LeftOut>) {
        let mut hints = Hints::default();
        let filler = Filler::new(self.test, self.fallback, piece.curve);
        // Runs between steep blocks, with the descent before or behind each.
        let mut runs: Vec<(Vec<Cut>, Option<f64>)> = Vec::new();
        for cut in std::mem::take(&mut piece.cuts) {
            let Some((run, of_run)) = runs.last_mut() else {
                runs.push((vec![cut], None));
                continue;
            };
            let last = *run.last().expect("a run has a cut");
            match self.flattened(&filler, &last, &cut, MAX_HALVINGS, &mut hints) {
                Ok(inserted) => {
                    run.extend(inserted);
                    run.push(cut);
                }
                Err(steep) => {
                    *of_run = of_run.or(Some(steep));
                    runs.push((vec![cut], Some(steep)));
                }
            }
        }
        let (mut pieces, mut lost) = (Vec::new(), Vec::new());
        for (cuts, steep) in runs {
            // A piece without a steep block stays, whatever it has.
            if cuts.len() >= 2 || steep.is_none() {
                pieces.push(PassSegment { cuts, ..piece.clone() });
                continue;
            }
            let reason = self.test.describe(&Infeasible::Ramp { angle: steep.unwrap_or_default() });
            let of = |cut: &Cut| LeftOut { place: cut.cc.position, reason: reason.clone(), searched: None };
            lost.extend(cuts.iter().filter(|cut| !cut.inserted).map(of));
        }
        (pieces, lost)
    }

    /// Returns the cuts to insert between two so that no block between them goes down into stock
    /// too steeply; none where the block does not.
    ///
    /// # Errors
    /// With the steepest descent, rad, where the way from one pose to the next is too steep itself,
    /// or no poses between make it flat enough.
    fn flattened(
        &self,
        filler: &Filler<'_, '_>,
        from: &Cut,
        to: &Cut,
        halvings: u32,
        hints: &mut Hints,
    ) -> Result<Vec<Cut>, f64> {
        let ends = [from.pose.cl, to.pose.cl];
        if let Some(steep) = self.steep_descent(&ends, |t| between(&ends[0], &ends[1], t), hints) {
            return Err(steep);
        }
        let axes = [from, to].map(|cut| cut.pose.configuration.axes);
        let axes = [axes[0], turned_near(self.test, &axes[1], &axes[0])];
        let Some(steep) = self.steep_descent(&ends, |t| self.moved(&ends, &axes, t), hints) else {
            return Ok(Vec::new());
        };
        if halvings == 0 {
            return Err(steep);
        }
        let inserted = filler.refined(self.linearity, &PosePair { from, to }, hints).ok_or(steep)?;
        let (mut cuts, mut last) = (Vec::new(), *from);
        for next in inserted.into_iter().chain([*to]) {
            cuts.extend(self.flattened(filler, &last, &next, halvings - 1, hints)?);
            cuts.push(next);
            last = next;
        }
        cuts.pop();
        Ok(cuts)
    }

    /// Returns the pose at fraction `t` of a block, by the motion of the control.
    fn moved(&self, ends: &[ClPoint; 2], axes: &[AxisValues; 2], t: f64) -> ClPoint {
        let on_way = between(&ends[0], &ends[1], t);
        let at =
            AxisValues::from_fn(self.test.cell.machine.axes().len(), |k| axes[0][k] + (axes[1][k] - axes[0][k]) * t);
        let length = self.test.cell.tool.gauge_length();
        let by_axes = || self.test.cell.machine.cl_point(&at, length).transformed(self.test.work_from_table());
        match self.linearity.law {
            CuttingLaw::AxesLinear => by_axes(),
            CuttingLaw::TipAndRotariesLinear => ClPoint { axis: by_axes().axis, ..on_way },
            CuttingLaw::TipLinearVectorTurned => on_way,
        }
    }

    /// Returns the steepest descent into stock, rad, on a block with the poses `at` fractions of
    /// it, if it is steeper than the tool may go.
    fn steep_descent(&self, ends: &[ClPoint; 2], at: impl Fn(f64) -> ClPoint, hints: &mut Hints) -> Option<f64> {
        let tool = self.test.cell.tool;
        let limit = tool.max_ramp_angle() + RAMP_SLACK;
        if limit >= FRAC_PI_2 {
            return None;
        }
        let [from, to] = ends;
        let way = (to.tip - from.tip).norm() / LARGEST_STEP;
        let n = way.max(angle_between(&from.axis, &to.axis) / LARGEST_TURN).ceil().clamp(LEAST_STEPS, MOST_STEPS);
        let poses: Vec<ClPoint> = (0..=n as usize).map(|k| at(k as f64 / n)).collect();
        let mut descents: Vec<[f64; 2]> =
            poses.windows(2).map(|w| descent_of_bottom(&w[0], &w[1], tool.cutter().radius())).collect();
        extrapolate_ends(&mut descents);
        let is_steep = |[down, across]: [f64; 2]| down > limit.tan() * across + ROUNDING / n;
        let mut steepest: Option<f64> = None;
        for (k, descent) in descents.into_iter().enumerate().filter(|(_, descent)| is_steep(*descent)) {
            let angle = descent[0].atan2(descent[1]);
            if steepest.is_none_or(|steepest| angle > steepest) && self.test.cuts_stock(&poses[k + 1], hints) {
                steepest = Some(angle);
            }
        }
        steepest
    }
}

/// Gives the first and the last step of a block the descent at the very end of it, where that is
/// greater than its mean.
fn extrapolate_ends(descents: &mut [[f64; 2]]) {
    let n = descents.len();
    if n < 2 {
        return;
    }
    let at_end = |[end, next]: [[f64; 2]; 2]| [end[0] + 0.5 * (end[0] - next[0]).max(0.0), end[1]];
    let first = at_end([descents[0], descents[1]]);
    let last = at_end([descents[n - 1], descents[n - 2]]);
    (descents[0], descents[n - 1]) = (first, last);
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
