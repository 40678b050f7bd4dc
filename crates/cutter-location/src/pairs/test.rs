//! Two heads of one machine that share an axis, tested together.

use std::f64::consts::TAU;

use facemill_cl_data::{CcPoint, Posture};
use facemill_inverse_kinematics::{AxisKind, AxisValues};

use crate::pairs::shared_axis::{PostureRange, SharedAxis};
use crate::pose::pose_test::PoseTest;
use crate::pose::workcell::{Configuration, FeasiblePose, Hints, Infeasible};

/// Two heads of one machine that share an axis. Both tests use views of the same machine with the
/// same axes in the same order, the first test for the head that is numbered 0.
#[derive(Clone, Copy)]
pub struct PairTest<'t, 'a> {
    /// One test for each head.
    pub tests: [&'t PoseTest<'a>; 2],
    /// Index of the axis that both share.
    pub shared: usize,
}

/// Both heads at a station, tested together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairPose {
    /// One for each head; its configuration has the other head's axes where they are parked.
    pub poses: [FeasiblePose; 2],
    /// All axes, both heads at the station.
    pub axes: AxisValues,
}

/// Reason why both heads cannot be at a station at once.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum PairBlocked {
    /// No value of the shared axis is possible for both heads with their postures; holds the range
    /// of each head's values, rad or mm, where it has some.
    NoCommonValue([Option<[f64; 2]>; 2]),
    /// The values before and after are too far apart for the axis to move from one to the other.
    Jump,
    /// At the value of the shared axis a head has no feasible posture.
    Head {
        /// The head, 0 or 1.
        head: usize,
        /// Why its first posture with that value is infeasible; `None` where it has none.
        why: Option<Infeasible>,
    },
    /// Every posture that a head has at the value of the shared axis leaves a cusp above the
    /// allowed one.
    Cusp {
        /// The head, 0 or 1.
        head: usize,
    },
    /// Each head can be there alone, but not both.
    Together {
        /// The head whose tool or bodies meet something, 0 or 1.
        head: usize,
        /// Obstacle that they meet.
        why: Infeasible,
    },
}

impl PairBlocked {
    /// Ranks the reasons by how much both heads can do before this one blocks them.
    pub(crate) fn progress(self) -> u8 {
        match self {
            Self::NoCommonValue(_) | Self::Jump => 0,
            Self::Head { .. } => 1,
            Self::Cusp { .. } => 2,
            Self::Together { .. } => 3,
        }
    }
}

/// Result at a station.
pub type PairOutcome = Result<PairPose, PairBlocked>;

impl<'t, 'a> PairTest<'t, 'a> {
    /// Joins the axis values of both heads, with the shared axis as the first head has it.
    pub fn joined(&self, of_heads: [&AxisValues; 2]) -> AxisValues {
        let moves = |head: usize, axis: usize| self.tests[head].cell.machine.moves_tool(axis);
        let from_second = |k: usize| moves(1, k) && !moves(0, k);
        AxisValues::from_fn(of_heads[0].len(), |k| of_heads[usize::from(from_second(k))].get_or_zero(k))
    }

    /// Joins both poses at one value of the shared axis and tests the heads against each other;
    /// each head was tested alone before.
    ///
    /// # Errors
    /// When the heads collide.
    pub(crate) fn together(&self, mut poses: [FeasiblePose; 2], value: f64, hints: &mut [Hints; 2]) -> PairOutcome {
        for pose in &mut poses {
            pose.configuration.axes[self.shared] = value;
        }
        let axes = self.joined([&poses[0].configuration.axes, &poses[1].configuration.axes]);
        match self.blocked(&axes, hints) {
            None => Ok(PairPose { poses, axes }),
            Some((head, why)) => Err(PairBlocked::Together { head, why }),
        }
    }

    /// Returns the head that collides at axis values, and its obstacle. Both are tested: as an
    /// obstacle, a body of the other head is larger than in that head's own test.
    pub fn blocked(&self, axes: &AxisValues, hints: &mut [Hints; 2]) -> Option<(usize, Infeasible)> {
        (0..2).find_map(|head| Some((head, self.tests[head].collision(axes, &mut hints[head])?)))
    }

    /// Returns the common part of stations that are blocked for the same cause.
    pub fn cause(&self, why: &PairBlocked) -> String {
        match why {
            PairBlocked::NoCommonValue(_) => format!("no common {}", self.letter()),
            other => self.describe(other),
        }
    }

    /// Returns the configurations of a head (0 or 1) at a CC point with only limits tested: the
    /// first of each branch, in the plain posture of the range or else in another.
    pub fn configurations_over(&self, head: usize, cc: &CcPoint, range: &PostureRange) -> Vec<Configuration> {
        let others = range.tilts().flat_map(|tilt| range.rotates().map(move |rotate| Posture { tilt, rotate }));
        let mut found: Vec<Configuration> = Vec::new();
        for posture in std::iter::once(range.plain()).chain(others) {
            for stand in self.tests[head].lifted_configurations(cc, posture) {
                if found.iter().all(|f| f.branch != stand.branch) {
                    found.push(stand);
                }
            }
            if found.len() == BRANCHES {
                break;
            }
        }
        found
    }

    pub(crate) fn kind(&self) -> AxisKind {
        self.tests[0].cell.machine.axes()[self.shared].kind
    }

    /// Returns the least and largest number of full turns by which a value of the shared axis may
    /// be turned within its limits; `None` where there are none within them, or the axis is
    /// endless.
    pub(crate) fn turns(&self, value: f64) -> Option<[i64; 2]> {
        let axis = &self.tests[0].cell.machine.axes()[self.shared];
        if axis.endless || axis.kind == AxisKind::Linear {
            return None;
        }
        let [least, most] = [axis.min, axis.max].map(|limit| (limit - value) / TAU);
        let turns = [(least - TURN_SLACK).ceil() as i64, (most + TURN_SLACK).floor() as i64];
        (turns[0] <= turns[1]).then_some(turns)
    }

    pub(crate) fn letter(&self) -> String {
        self.tests[0].cell.machine.axes()[self.shared].letter.to_string()
    }

    /// Says in one sentence why both heads cannot be at a station at once.
    pub fn describe(&self, why: &PairBlocked) -> String {
        let axis = &self.tests[0].cell.machine.axes()[self.shared];
        let letter = self.letter();
        match why {
            PairBlocked::NoCommonValue(values) => {
                let of = |head: usize| match values[head] {
                    Some([low, high]) => {
                        let word = |v| axis.in_word_unit(v);
                        format!("head {} needs {letter} from {:.1} to {:.1}", head + 1, word(low), word(high))
                    }
                    None => format!("head {} reaches it with none", head + 1),
                };
                format!("no common {letter}: {}, {}", of(0), of(1))
            }
            PairBlocked::Jump => format!("{letter} would have to jump"),
            PairBlocked::Head { head, why } => {
                let what = match why {
                    Some(why) => self.tests[*head].describe(why),
                    None => "no posture of the range".to_owned(),
                };
                format!("head {} at the common {letter}: {what}", head + 1)
            }
            PairBlocked::Cusp { head } => {
                format!("head {} at the common {letter}: cusp above the operation's tolerance", head + 1)
            }
            PairBlocked::Together { head, why } => format!("both heads at once: {}", self.tests[*head].describe(why)),
        }
    }
}

impl PairTest<'_, '_> {
    /// Returns both heads at CC points between two stops, with the shared axis and both tilts
    /// halfway between theirs.
    ///
    /// # Errors
    /// Why they cannot be there.
    pub fn halfway(
        &self,
        ranges: &[PostureRange; 2],
        cc: &[CcPoint; 2],
        [from, to]: [&PairPose; 2],
        hints: &mut [Hints; 2],
    ) -> PairOutcome {
        let middle = |a: f64, b: f64| 0.5 * (a + b);
        let value = middle(from.axes.get_or_zero(self.shared), to.axes.get_or_zero(self.shared));
        let mut pose_of = |head: usize| {
            let near = from.poses[head].configuration;
            let axis = SharedAxis::new(self.tests[head], self.shared, ranges[head], cc[head], near);
            let tilt = middle(from.poses[head].posture.tilt, to.poses[head].posture.tilt);
            let found = axis.feasible(value, tilt, &mut hints[head]);
            let by_tilt = |p: Posture| p.tilt;
            let found = found.or_else(|_| axis.cheapest(value, tilt, &by_tilt, &mut hints[head]).map(|found| found.0));
            found.map_err(|why| PairBlocked::Head { head, why })
        };
        let poses = [pose_of(0)?, pose_of(1)?];
        self.together(poses, value, &mut [Hints::default(), Hints::default()])
    }
}

/// Branches of a machine.
const BRANCHES: usize = 2;

/// Fraction of a turn by which an axis at its limit may seem to be beyond it.
const TURN_SLACK: f64 = 1e-12;
