//! Postures with a given value of one machine axis: two heads that share an axis have to agree on
//! it.
//!
//! A pose of the tool has five degrees of freedom, so a posture at a CC point gives every axis its
//! value. A fixed value of one axis leaves a curve of postures, at most a few on each tilt: the
//! shared axis costs each head one of its two freedoms.

use std::f64::consts::{PI, TAU};

use facemill_cl_data::{CcPoint, Posture};
use facemill_inverse_kinematics::AxisKind;
use facemill_tool_model::cl_from_cc;

use crate::pose::pose_test::PoseTest;
use crate::pose::workcell::{Configuration, FeasiblePose, Hints, Infeasible};

/// Allowed postures: tilt and rotate from the first to the second value, rad; rotate as [`Posture`]
/// counts it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PostureRange {
    /// Smallest and largest tilt.
    pub tilt: [f64; 2],
    /// Smallest and largest rotate.
    pub rotate: [f64; 2],
}

/// Steps of tilt, and of rotate, between the postures at which an axis is evaluated.
pub(crate) const TILT_STEPS: usize = 8;

const ROTATE_STEP: f64 = 6.0 * PI / 180.0;

/// Largest distance of the axis from the wanted value in a returned posture, rad or mm: the limit
/// of a double.
pub(crate) const SHARED_ACCURACY: f64 = 1e-10;

impl PostureRange {
    /// Tilts from the smallest to the largest.
    pub(crate) fn tilts(&self) -> impl Iterator<Item = f64> + use<> {
        let [low, high] = self.tilt;
        let n = if high > low { TILT_STEPS } else { 0 };
        (0..=n).map(move |k| if k == 0 { low } else { low + (high - low) * k as f64 / TILT_STEPS as f64 })
    }

    /// Returns a head's posture without other requirements.
    pub(crate) fn plain(&self) -> Posture {
        Posture { tilt: self.tilt[0], rotate: 0.0_f64.clamp(self.rotate[0], self.rotate[1]) }
    }

    pub(crate) fn rotates(&self) -> impl Iterator<Item = f64> + use<> {
        let [low, high] = self.rotate;
        let n = ((high - low) / ROTATE_STEP).ceil().clamp(1.0, 120.0);
        (0..=n as usize).map(move |k| low + (high - low) * k as f64 / n)
    }
}

/// An axis of a machine as a function of the posture at one CC point, on one branch.
pub(crate) struct SharedAxis<'t, 'a> {
    pub(crate) test: &'t PoseTest<'a>,
    /// Index of the axis.
    pub(crate) axis: usize,
    pub(crate) range: PostureRange,
    pub(crate) cc: CcPoint,
    /// The branch, and the values near which windings are taken.
    pub(crate) near: Configuration,
    /// For each tilt of the range the rotates of the range with the axis' value there.
    rows: Vec<(f64, Row)>,
}

/// Rotates in ascending order, each with the axis' value there; `None` where the machine cannot
/// take the posture.
type Row = Vec<(f64, Option<f64>)>;

impl<'t, 'a> SharedAxis<'t, 'a> {
    pub(crate) fn new(
        test: &'t PoseTest<'a>,
        axis: usize,
        range: PostureRange,
        cc: CcPoint,
        near: Configuration,
    ) -> Self {
        let mut found = Self { test, axis, range, cc, near, rows: Vec::new() };
        found.rows = range.tilts().map(|tilt| (tilt, found.row(&cc, tilt))).collect();
        found
    }

    fn row(&self, cc: &CcPoint, tilt: f64) -> Row {
        let at = |rotate: f64| (rotate, self.value_at(cc, Posture { tilt, rotate }));
        let mut row: Row = Vec::new();
        for next in self.range.rotates().map(at) {
            if let Some(&last) = row.last()
                && last.1.is_some() != next.1.is_some()
            {
                row.push(edge(last, next, at));
            }
            row.push(next);
        }
        row
    }

    /// Returns a value at the turn nearest to the reference: a limited axis has only turns within
    /// its limits, and would seem to jump between them where it continues.
    fn unwound(&self, value: f64) -> f64 {
        let kind = self.test.cell.machine.axes()[self.axis].kind;
        turned_to(kind, value, self.near.axes.get_or_zero(self.axis))
    }

    /// Returns the value of the axis in a posture; `None` where the machine cannot take it.
    #[cfg(test)]
    pub(crate) fn value(&self, posture: Posture) -> Option<f64> {
        self.value_at(&self.cc, posture)
    }

    fn value_at(&self, cc: &CcPoint, posture: Posture) -> Option<f64> {
        let cl = cl_from_cc(self.test.cell.tool.cutter(), cc, posture);
        let configuration = self.test.configuration_like(&cl, &self.near).ok()?;
        Some(self.unwound(configuration.axes.get_or_zero(self.axis)))
    }

    /// Returns the smallest and largest value over the evaluated postures of the range; `None`
    /// where there is none.
    pub(crate) fn values(&self) -> Option<[f64; 2]> {
        let mut range: Option<[f64; 2]> = None;
        for value in self.rows.iter().flat_map(|(_, row)| row).filter_map(|(_, value)| *value) {
            let [low, high] = range.unwrap_or([value, value]);
            range = Some([low.min(value), high.max(value)]);
        }
        range
    }

    /// Returns postures of one tilt with the axis at `value`, the smallest turn from the feed
    /// first.
    pub(crate) fn on_tilt(&self, tilt: f64, value: f64) -> Vec<Posture> {
        match self.rows.iter().find(|(known, _)| *known == tilt) {
            Some((_, row)) => self.on_row(&self.cc, tilt, value, row),
            None => self.on_row(&self.cc, tilt, value, &self.row(&self.cc, tilt)),
        }
    }

    fn on_row(&self, cc: &CcPoint, tilt: f64, value: f64, row: &[(f64, Option<f64>)]) -> Vec<Posture> {
        let excess = |rotate: f64| Some(self.value_at(cc, Posture { tilt, rotate })? - value);
        let mut found: Vec<f64> = Vec::new();
        for ends in row.windows(2) {
            let ((a, Some(at_a)), (b, Some(at_b))) = (ends[0], ends[1]) else { continue };
            if let Some(root) = self.bracketed((a, at_a - value), (b, at_b - value), &excess)
                && found.last().is_none_or(|last| (root - last).abs() > 1e-9)
            {
                found.push(root);
            }
        }
        found.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        found.into_iter().map(|rotate| Posture { tilt, rotate }).collect()
    }

    /// Finds where the excess changes its sign between two rotates, without a jump by half a turn.
    fn bracketed(
        &self,
        (mut a, mut at_a): (f64, f64),
        (mut b, mut at_b): (f64, f64),
        excess: &impl Fn(f64) -> Option<f64>,
    ) -> Option<f64> {
        let jumps = self.test.cell.machine.axes()[self.axis].kind == AxisKind::Rotary && (at_a - at_b).abs() > PI;
        if jumps || at_a * at_b > 0.0 {
            return None;
        }
        // Regula falsi, the end that stays halved (Illinois): never leaves the bracket.
        for _ in 0..MAX_STEPS {
            if at_a.abs() < ROOT_ACCURACY {
                return Some(a);
            }
            if at_b.abs() < ROOT_ACCURACY {
                return Some(b);
            }
            let middle = (a * at_b - b * at_a) / (at_b - at_a);
            if !(middle > a.min(b) && middle < a.max(b)) {
                break;
            }
            let at_middle = excess(middle)?;
            if at_middle * at_b < 0.0 {
                (a, at_a) = (b, at_b);
            } else {
                at_a *= 0.5;
            }
            (b, at_b) = (middle, at_middle);
        }
        (at_b.abs() < SHARED_ACCURACY).then_some(b)
    }

    /// Returns a tested pose with the axis at `value` and this tilt; its configuration may have the
    /// axis at another turn.
    ///
    /// # Errors
    /// `None` where no posture of the range has that value; else why the first one that has it is
    /// infeasible.
    /// taken.
    pub(crate) fn feasible(
        &self,
        value: f64,
        tilt: f64,
        hints: &mut Hints,
    ) -> Result<FeasiblePose, Option<Infeasible>> {
        let mut lift = 0.0;
        let mut reason = None;
        // Seating moves the tip. Where the axis depends on the tip, the posture follows, and the
        // next lift differs by little.
        for _ in 0..SEATINGS {
            let raised = CcPoint { position: self.cc.position + self.cc.normal.into_inner() * lift, ..self.cc };
            let mut seated = None;
            let postures = match lift {
                0.0 => self.on_tilt(tilt, value),
                _ => self.on_row(&raised, tilt, value, &self.row(&raised, tilt)),
            };
            for posture in postures {
                match self.test.try_posture(&raised, posture, Some(&self.near), hints) {
                    Ok(pose) if pose.configuration.branch != self.near.branch => {
                        reason = reason.or(Some(Infeasible::OtherBranch(self.near.branch)));
                    }
                    Ok(pose) => {
                        seated = Some(pose);
                        break;
                    }
                    Err(why) => reason = reason.or(Some(why)),
                }
            }
            let pose = seated.ok_or(reason)?;
            let strays = (self.unwound(pose.configuration.axes.get_or_zero(self.axis)) - value).abs();
            lift += pose.lift;
            if lift > self.test.cell.max_lift {
                break;
            }
            if strays <= SHARED_ACCURACY {
                return Ok(FeasiblePose { lift, ..pose });
            }
        }
        Err(reason)
    }

    /// Returns the tested pose with the axis at `value` whose posture costs least, among the tilts
    /// tried from `least` on, and its cost.
    ///
    /// # Errors
    /// As [`SharedAxis::feasible`], for the cheapest tilt with a posture.
    pub(crate) fn cheapest(
        &self,
        value: f64,
        least: f64,
        cost: &impl Fn(Posture) -> f64,
        hints: &mut Hints,
    ) -> Result<(FeasiblePose, f64), Option<Infeasible>> {
        let least = least.max(self.range.tilt[0]);
        let above = self.rows.iter().map(|(tilt, _)| *tilt).filter(|t| *t > least);
        let mut rows: Vec<(f64, f64)> = std::iter::once(least)
            .chain(above)
            .filter_map(|tilt| Some((cost(*self.on_tilt(tilt, value).first()?), tilt)))
            .collect();
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut reason = None;
        for (expected, tilt) in rows {
            match self.feasible(value, tilt, hints) {
                Ok(pose) => return Ok((pose, expected)),
                Err(why) => reason = reason.or(why),
            }
        }
        Err(reason)
    }
}

/// Returns the last rotate with a value between one with and one without, to a fraction of their
/// distance finer than the accuracy of any posture.
fn edge(a: (f64, Option<f64>), b: (f64, Option<f64>), at: impl Fn(f64) -> (f64, Option<f64>)) -> (f64, Option<f64>) {
    let (mut with, mut without) = if a.1.is_some() { (a, b.0) } else { (b, a.0) };
    for _ in 0..EDGE_HALVINGS {
        let middle = at(0.5 * (with.0 + without));
        if middle.1.is_some() { with = middle } else { without = middle.0 }
    }
    with
}

/// Halvings of the way to the edge of reach: from 6° to 1e-5°.
const EDGE_HALVINGS: usize = 19;

/// Returns a value of a rotary axis turned by full turns to be nearest to a reference.
pub(crate) fn turned_to(kind: AxisKind, value: f64, reference: f64) -> f64 {
    match kind {
        AxisKind::Rotary => value + ((reference - value) / TAU).round() * TAU,
        AxisKind::Linear => value,
    }
}

/// Steps of regula falsi: Illinois converges with order 1.44; a posture at the edge of reach takes
/// more.
const MAX_STEPS: usize = 80;

/// Accuracy of a root, rad or mm.
const ROOT_ACCURACY: f64 = 1e-13;

/// Largest number of seatings of a posture that follows its own lift.
const SEATINGS: usize = 4;

#[cfg(test)]
#[path = "../../tests/unit/pairs/shared_axis.rs"]
mod tests;
