//! Search of a feasible posture at one CC point, with and without proof.

pub(crate) mod bezier;
pub(crate) mod cell_proof;
pub(crate) mod certified;
pub(crate) mod lattice;
pub(crate) mod machine_proof;
pub mod map;
pub(crate) mod remedy;

use facemill_cl_data::CcPoint;

use crate::pose::pose_test::PoseTest;
use crate::pose::workcell::{Configuration, FeasiblePose, Hints, Infeasible};
use crate::search::bezier::SearchCurve;
use crate::search::certified::certified_search;

/// Settings for the walk along the curve (CLOPT, chapter III).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchSettings {
    /// Coarse step in u. Larger: fewer tests, but shorter feasible stretches may be stepped over.
    pub u_step: f64,
    /// Width of the bracket at which bisection ends. Larger: postures larger than needed.
    pub u_tolerance: f64,
    /// Width of feasible stretches of u that may be missed: everything before the result is proven
    /// blocked except feasible stretches shorter than this ([`certified_search`]), or than
    /// [`FoundPosture::width`] where this width would take too many tests. `None` steps as the
    /// paper does.
    pub certified: Option<f64>,
}

impl Default for SearchSettings {
    fn default() -> Self {
        Self { u_step: 0.1, u_tolerance: 0.001, certified: None }
    }
}

/// A feasible pose and its place on the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FoundPosture {
    /// Parameter on the search curve.
    pub u: f64,
    /// The pose, tested at exactly this u.
    pub pose: FeasiblePose,
    /// Width of the proof: every feasible stretch of the curve between the start of the search and
    /// u is shorter. `None` where nothing is proven. More than `settings.certified` where that
    /// would have taken too many tests.
    pub width: Option<f64>,
}

/// Returns the pose with the smallest u that the paper's search finds at a CC point.
///
/// u runs from `from_u` in coarse steps; at the first feasible one, the bracket down to the step
/// before is bisected. Where feasibility is monotone along the curve beyond `from_u`, the result is
/// within `u_tolerance` of the smallest feasible u. Elsewhere, a feasible stretch shorter than the
/// step may be missed, but the returned pose itself has always been tested as feasible. With
/// `settings.certified` the result is that of [`certified_search`].
///
/// # Errors
/// When no tested posture is feasible: the reason that blocked most of them, the earliest among
/// equals.
pub fn search(
    test: &PoseTest<'_>,
    cc: &CcPoint,
    curve: &SearchCurve,
    settings: &SearchSettings,
    from_u: f64,
    near: Option<&Configuration>,
    hints: &mut Hints,
) -> Result<FoundPosture, Infeasible> {
    if settings.certified.is_some() {
        return certified_search(test, cc, curve, settings, from_u, near, hints).found;
    }
    let mut try_at =
        |u: f64| test.try_posture(cc, curve.at(u), near, hints).map(|pose| FoundPosture { u, pose, width: None });
    let mut blocked = None;
    let mut reasons = Reasons::default();
    for u in coarse_steps(from_u, settings.u_step) {
        match try_at(u) {
            Ok(found) => return Ok(refine(try_at, blocked, found, settings.u_tolerance)),
            Err(why) => {
                blocked = Some(u);
                reasons.count(why);
            }
        }
    }
    Err(reasons.most_frequent())
}

/// Returns `from`, `from + step`, …, and 1 as the last.
fn coarse_steps(from: f64, step: f64) -> impl Iterator<Item = f64> {
    let n = ((1.0 - from) / step - 1e-9).ceil().max(0.0) as usize;
    (0..=n).map(move |k| if k == n { 1.0 } else { from + k as f64 * step })
}

/// Bisects between a blocked and a feasible u; keeps the last feasible one.
pub(crate) fn refine(
    mut try_at: impl FnMut(f64) -> Result<FoundPosture, Infeasible>,
    blocked: Option<f64>,
    mut found: FoundPosture,
    tolerance: f64,
) -> FoundPosture {
    let Some(mut blocked) = blocked else { return found };
    while found.u - blocked > tolerance {
        let middle = 0.5 * (blocked + found.u);
        match try_at(middle) {
            Ok(better) => found = better,
            Err(_) => blocked = middle,
        }
    }
    found
}

/// Counts reasons of the same kind and bodies.
#[derive(Default)]
pub(crate) struct Reasons(Vec<(Infeasible, usize)>);

impl Reasons {
    pub(crate) fn count(&mut self, why: Infeasible) {
        match self.0.iter_mut().find(|(known, _)| same_cause(known, &why)) {
            Some((_, n)) => *n += 1,
            None => self.0.push((why, 1)),
        }
    }

    pub(crate) fn most_frequent(self) -> Infeasible {
        // max_by_key takes the last of equals; reversed, that is the earliest.
        self.0.into_iter().rev().max_by_key(|(_, n)| *n).expect("at least u = 1 is tested").0
    }
}

/// Returns whether two reasons blame the same cause, at any place.
fn same_cause(a: &Infeasible, b: &Infeasible) -> bool {
    match (a, b) {
        (Infeasible::OutsideCone { .. }, Infeasible::OutsideCone { .. })
        | (Infeasible::Unreachable(_), Infeasible::Unreachable(_))
        | (Infeasible::Ramp { .. }, Infeasible::Ramp { .. })
        | (Infeasible::OtherBranch(_), Infeasible::OtherBranch(_))
        | (Infeasible::FromBelow, Infeasible::FromBelow)
        | (Infeasible::Singular { .. }, Infeasible::Singular { .. })
        | (Infeasible::Rewind { .. }, Infeasible::Rewind { .. })
        | (Infeasible::TooLong, Infeasible::TooLong) => true,
        (Infeasible::Gouge { obstacle: p, .. }, Infeasible::Gouge { obstacle: q, .. }) => p == q,
        (Infeasible::Collision { body: b1, obstacle: p, .. }, Infeasible::Collision { body: b2, obstacle: q, .. }) => {
            b1 == b2 && p == q
        }
        _ => false,
    }
}

#[cfg(test)]
#[path = "../tests/unit/search.rs"]
mod tests;
