//! Tilt and rotate search: a feasible tool pose for every CC point (CLOPT).
//!
//! A [`Workcell`] holds everything that decides about a pose: machine, tool, obstacles, tolerances.
//! [`Workcell::new`] starts one with the machine's own bodies. A [`PoseTest`] judges one posture at
//! one CC point and returns the pose, seated and with axis values, or [`Infeasible`] with the body
//! that blocks it. [`search`](fn@search) walks the paper's rational Bézier [`SearchCurve`] at one
//! point; [`certified_search`] also proves that no feasible posture was stepped over.
//! [`plan_passes`] searches along passes and keeps the axis from jumping.
//! [`map`](fn@search::map::map) proves for whole ranges of postures that all are feasible or none
//! is. [`links`] holds the moves that do not cut: entry and exit of a pass, and the way from one to
//! the next.
//!
//! A pose returned as feasible has been tested exactly as returned, with the verdicts of
//! `facemill-interference`: no point of the cutter is deeper than the gouge tolerance in an
//! obstacle, dilated bodies touch nothing, axis values are within their limits. This crate
//! guarantees nothing about the motion between two points: the virtual machine checks that on the
//! written program.
//!
//! Modules; each imports only those above it:
//!
//! | module | holds |
//! |---|---|
//! | `pose` | poses of a tool at a CC point, tested for limits, gouge and collision |
//! | [`mod@links`] | moves that do not cut: entries, exits, links and rewinding |
//! | [`mod@search`] | search of a feasible posture at one CC point, with and without proof |
//! | [`mod@cusp`] | cusps between neighbouring passes, and their largest step-over |
//! | `passes` | postures along whole passes: costs, graph, smoothing |
//! | `pairs` | postures of two heads that share an axis |
//!
//! It must not know NC text or job files.

pub mod cusp;
pub mod links;
mod pairs;
mod passes;
mod pose;
pub mod search;
#[cfg(test)]
#[path = "../tests/unit/test_scene.rs"]
mod test_scene;

pub use crate::links::rewind::{limited_rotaries, rewound_axis};
pub use crate::pairs::plan::{PairSettings, PairStation, plan_pair};
pub use crate::pairs::shared_axis::PostureRange;
pub use crate::pairs::test::{PairBlocked, PairOutcome, PairPose, PairTest};
pub use crate::passes::plan::plan_passes;
pub use crate::passes::smooth_pass::steps_beyond_limits;
pub use crate::passes::task::{
    AxisTarget, Optimum, Outcome, PassSettings, PassTask, PlannedPass, PostureMode, SmoothSettings,
};
pub use crate::pose::obstacle::{MeshHandle, Obstacle, Pieces, TableBody, table_bodies};
pub use crate::pose::pose_test::PoseTest;
pub use crate::pose::widened::Widened;
pub use crate::pose::workcell::{
    AxisCone, Body, Configuration, FeasiblePose, GOUGE_TOLERANCE, Hints, Infeasible, MAX_LIFT, Workcell, angle_between,
    tool_frame,
};
pub use crate::search::bezier::{SearchCurve, SearchCurveError, SearchOrder, TurnTable};
pub use crate::search::certified::{CertifiedSearch, MOST_TESTS, certified_search};
pub use crate::search::remedy::{Remedy, reliefs};
pub use search::{FoundPosture, SearchSettings, search};
