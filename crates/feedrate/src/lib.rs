//! Constant cutting speed at the CL point (FEED), and laws of motion within velocity, acceleration
//! and jerk of every axis.
//!
//! A control in G94 takes F as the norm over all axes, 1 deg counted as 1 mm, so the tip speed
//! differs from F wherever a rotary axis takes part. [`feed_for_block`] returns the F at which the
//! tip moves as programmed, within the speeds of the axes and the control's range of F;
//! [`plan_feeds`] does so for a sequence of blocks. The same times give the F of G93
//! ([`BlockFeed::inverse_time`]).
//!
//! ```
//! use facemill_feedrate::{FeedBlock, FeedLimit, plan_feeds};
//! use facemill_inverse_kinematics::{AxisValues, Machine};
//!
//! let machine = Machine::head_b_table_c()?;
//! let start = AxisValues::from([800.0, 0.0, 600.0, 0.0, 0.0]);
//! let end = AxisValues::from([800.0, 0.0, 600.0, 0.0, 0.01]); // C turns by 0.573°: the tip moves 8 mm
//! let feeds = plan_feeds(&machine, 250.0, &start, &[FeedBlock { end, tip_feed: 1000.0 }])?;
//! assert_eq!(feeds[0].limit, FeedLimit::TipFeed);
//! assert!((feeds[0].time - 0.48).abs() < 1e-4 && (feeds[0].f_word - 71.6).abs() < 0.1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Where two heads cut at once one block has one time: [`feed_for_pair`] returns the largest feed
//! that exceeds neither tip's speed nor that of any axis.
//!
//! These functions take speeds as constant within a block, without acceleration, so times are lower
//! bounds. Feeds are mm/min, times s.
//!
//! [`program_law`] is a motion of a whole program from rest to rest that the axes can follow, with
//! corners blended within a tolerance: it gives the time of each block and the axis positions at
//! any time. [`minimum_time_law`] is the fastest motion along a smooth path. No limit is exceeded
//! at any time; `docs/time-law.md` explains and proves it.
//!
//! [`trapezoid_law`] models a control that limits only acceleration and hardly looks ahead over
//! blocks that turn rotary axes, as LinuxCNC does; [`deviation_law`] one that keeps to the lines
//! and slows down at corners, as Grbl does.
//!
//! Modules; each imports only those above it:
//!
//! | module | holds |
//! |---|---|
//! | `block_feed` | feed of one block that moves the tip at its programmed speed (FEED) |
//! | `plan` | feeds of a sequence of blocks |
//! | `pair` | feeds of blocks in which two heads move |
//! | `time_law` | laws of motion along a path in the least time |
//! | `program_law` | laws of motion along programs |
//! | `trapezoid_law` | motion of controls that limit acceleration, not jerk: with arcs in corners, or on the lines |
//! | `tube` | smoothest values within given tolerances |
//!
//! It must not know surfaces.

mod block_feed;
mod pair;
mod plan;
mod program_law;
mod time_law;
mod trapezoid_law;
mod tube;

pub use block_feed::{BlockFeed, FeedError, FeedLimit, feed_for_block, g94_length};
pub use pair::{PairFeed, PairLimit, feed_for_pair};
pub use plan::{FeedBlock, PlanFeedsError, plan_feeds, rapid_time};
pub use program_law::{
    MissingLimit, ProgramBlock, ProgramLaw, ProgramLawError, ProgramSettings, machine_bounds, program_blocks,
    program_law, program_law_of, within_look_ahead,
};
pub use time_law::{
    AxisBounds, AxisMotion, Jet, JointPath, MotionBounds, MotionLimit, PathPoint, TimeLaw, TimeLawError,
    TimeLawSettings, minimum_time_law,
};
pub use trapezoid_law::{DeviationSettings, TrapezoidLaw, TrapezoidSettings, deviation_law, trapezoid_law};
pub use tube::smoothest_within;
