//! Tilt and rotate search: a feasible tool pose for every CC point (CLOPT).
//!
//! A [`Workcell`] is everything a pose is judged by: machine, tool, obstacles, tolerances. A [`PoseTest`] answers for one
//! posture at one CC point: the pose, seated and with axis values, or [`Infeasible`] with the body that blocks.
//! [`search`](fn@search) walks the paper's rational Bézier [`SearchCurve`] at one point, or with a proof that nothing feasible
//! was stepped over ([`certified_search`]); [`plan_passes`] does it along passes and keeps the axis from jumping.
//! [`map`](fn@map::map) proves for whole ranges of postures that all are feasible or none is. [`approach`] and [`link`] hold
//! the moves that do not cut: entry and exit of a pass, and the way from one to the next.
//!
//! What is returned as feasible has been tested as it stands, with the verdicts of `facemill-interference`: no point of
//! the cutter is deeper than the gouge tolerance in an obstacle, dilated bodies touch nothing, axis values are within their
//! limits. Nothing is said here about the motion between two points: the virtual machine judges that, on the written
//! program.
//!
//! It must not know NC text or job files.

pub mod approach;
mod band;
mod bezier;
mod cell_proof;
mod certified;
pub mod cusp;
pub mod cut_point;
mod lattice;
mod layers;
pub mod link;
mod machine_obstacles;
mod machine_proof;
pub mod map;
pub mod neighbours;
mod pair_costs;
mod pair_plan;
mod pair_test;
mod pair_values;
mod pass_cost;
mod pass_graph;
mod pass_plan;
mod pass_task;
mod pose_test;
mod rapid_block;
mod relief;
mod rewind;
mod search;
mod shared_axis;
mod smooth_band;
mod smooth_pass;
mod spun_bodies;
mod stance;
#[cfg(test)]
mod test_scene;
mod widened;
mod workcell;

pub use crate::pass_task::{
    AxisTarget, Optimum, Outcome, PassSettings, PassTask, PlannedPass, PostureMode, SmoothSettings,
};
pub use crate::widened::Widened;
pub use bezier::{SearchCurve, SearchCurveError, SearchOrder, TurnTable};
pub use certified::{CertifiedSearch, MOST_TESTS, certified_search};
pub use pair_plan::{PairSettings, PairStation, plan_pair};
pub use pair_test::{PairBlocked, PairOutcome, PairPose, PairTest};
pub use pass_plan::plan_passes;
pub use pose_test::PoseTest;
pub use relief::{Relief, reliefs};
pub use rewind::{limited_rotaries, rewound_axis};
pub use search::{Found, SearchSettings, search};
pub use shared_axis::PostureRange;
pub use smooth_pass::steps_beyond_limits;
pub use workcell::{
    AxisCone, Body, Configuration, FeasiblePose, Hints, Infeasible, Obstacle, Pieces, Workcell, angle_between,
    tool_frame,
};
