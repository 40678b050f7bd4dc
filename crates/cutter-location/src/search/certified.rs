//! Search with a proof: everything passed over on the curve is proven blocked, up to stretches of a
//! stated width.

use facemill_cl_data::CcPoint;

use crate::pose::pose_test::PoseTest;
use crate::pose::workcell::{Configuration, Hints, Infeasible};
use crate::search::bezier::SearchCurve;
use crate::search::cell_proof::PostureCell;
use crate::search::{FoundPosture, Reasons, SearchSettings, refine};

/// Result of [`certified_search`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CertifiedSearch {
    /// The pose, or the reason that blocked most of the curve.
    pub found: Result<FoundPosture, Infeasible>,
    /// Width of the proof: every feasible stretch of the curve before the result is shorter. The
    /// requested width, or a larger one where that would have taken more than [`MOST_TESTS`] tests.
    pub width: f64,
    /// Number of judged intervals, each with a pose test and an attempt at a proof.
    pub tests: usize,
}

/// Intervals judged before the width is doubled: half a second at worst, and about ten times the
/// number that a hard point takes at a thousandth.
pub const MOST_TESTS: usize = 4096;

/// Smallest width: below it, angles of postures differ by less than the resolution of written axis
/// values.
const FINEST: f64 = 1e-6;

/// Returns the first feasible posture of the curve from `from_u` on, where stretches shorter than
/// `settings.certified` may be missed (shorter than `settings.u_step`, where that is `None`).
///
/// Intervals of the curve are judged from the left. One is passed over where a single proof blocks
/// all its postures, and halved where no proof is found; where it is no longer than the width, both
/// ends and the middle are tested. So every feasible stretch before the result is shorter than the
/// width. The result itself is tested, and bisected against the last blocked u to
/// `settings.u_tolerance`. [`PoseTest::widened`] also reports a width that had to be larger than
/// requested, whether a posture is found or not.
pub fn certified_search(
    test: &PoseTest<'_>,
    cc: &CcPoint,
    curve: &SearchCurve,
    settings: &SearchSettings,
    from_u: f64,
    near: Option<&Configuration>,
    hints: &mut Hints,
) -> CertifiedSearch {
    let requested = settings.certified.unwrap_or(settings.u_step).max(FINEST);
    let mut width = requested;
    let mut tests = 0;
    loop {
        let mut walk = CertifiedWalk { test, cc, curve, settings, near, width, tests: 0, reasons: Reasons::default() };
        let end = walk.interval(from_u.min(1.0), 1.0, hints);
        tests += walk.tests;
        let found = match end {
            Step::OutOfTests => {
                width *= 2.0;
                continue;
            }
            Step::Found(found) => Ok(FoundPosture { width: Some(width), ..found }),
            Step::Blocked => Err(walk.reasons.most_frequent()),
        };
        if width > requested {
            test.widths.note(cc, width);
        }
        return CertifiedSearch { found, width, tests };
    }
}

struct CertifiedWalk<'w, 'a> {
    test: &'w PoseTest<'a>,
    cc: &'w CcPoint,
    curve: &'w SearchCurve,
    settings: &'w SearchSettings,
    near: Option<&'w Configuration>,
    width: f64,
    tests: usize,
    reasons: Reasons,
}

/// State of an interval of the curve.
enum Step {
    /// Proven blocked, or too short to matter.
    Blocked,
    Found(FoundPosture),
    OutOfTests,
}

impl CertifiedWalk<'_, '_> {
    fn interval(&mut self, from: f64, to: f64, hints: &mut Hints) -> Step {
        self.tests += 1;
        if self.tests > MOST_TESTS {
            return Step::OutOfTests;
        }
        let middle = 0.5 * (from + to);
        if let Err(why) = self.try_at(middle, hints)
            && let Some(proven) = self.cell(from, middle, to).blocked_by(&why)
        {
            self.reasons.count(proven);
            return Step::Blocked;
        }
        if to - from <= self.width {
            return self.short([from, middle, to], hints);
        }
        match self.interval(from, middle, hints) {
            Step::Blocked => self.interval(middle, to, hints),
            end => end,
        }
    }

    /// Judges an interval no longer than the width: its first feasible test, if any.
    fn short(&mut self, tested: [f64; 3], hints: &mut Hints) -> Step {
        let mut blocked = None;
        for u in tested {
            match self.try_at(u, hints) {
                Ok(found) => {
                    let tolerance = self.settings.u_tolerance;
                    return Step::Found(refine(|u| self.try_at(u, hints), blocked, found, tolerance));
                }
                Err(why) => {
                    blocked = Some(u);
                    self.reasons.count(why);
                }
            }
        }
        Step::Blocked
    }

    fn try_at(&self, u: f64, hints: &mut Hints) -> Result<FoundPosture, Infeasible> {
        self.test.try_posture(self.cc, self.curve.at(u), self.near, hints).map(|pose| FoundPosture {
            u,
            pose,
            width: None,
        })
    }

    /// Returns the cell of all postures of an interval: tilt and rotate are monotone along the
    /// curve, so its ends differ most from its middle.
    fn cell(&self, from: f64, middle: f64, to: f64) -> PostureCell<'_, '_> {
        let [start, center, end] = [from, middle, to].map(|u| self.curve.at(u));
        let half = |of: fn(&facemill_cl_data::Posture) -> f64| {
            let at = of(&center);
            (of(&start) - at).abs().max((of(&end) - at).abs()) + 4.0 * f64::EPSILON * (1.0 + at.abs())
        };
        PostureCell::new(self.test, self.cc, center, [half(|p| p.tilt), half(|p| p.rotate)]).near(self.near)
    }
}
