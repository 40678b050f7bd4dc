//! Machine tools as Denavit-Hartenberg chains: machine file, forward and inverse solution, limits,
//! bodies.
//!
//! A [`Machine`] is read from a [machine file](machine_file::MachineFile): two chains from the bed,
//! one to the table, one to the spindle nose, of DH rows or of
//! [axis lines](machine_file::LineChain). [`AxisValues`] are the values on its scales.
//! [`Machine::forward`] returns the tool pose in the table frame, [`Machine::inverse`] the axis
//! values for a CL point, and [`Machine::axis_ranges`] those for a whole set of CL points.
//! [`Motion`] is the motion between two positions, [`deviation_bound`] bounds its distance from the
//! intended motion, and [`linearise`] inserts positions to hold a tolerance.
//! [`Machine::body_poses`] places the machine's own bodies.
//!
//! [`rows_from_axes`] makes the rows of a chain from directions and points;
//! [`Machine::joint_lines`], [`Machine::family`] and [`Machine::axis_reach`] interpret the rows of
//! a machine, [`import_autodesk_machine`] reads the files of another program, and
//! [`machine_from_measurements`] makes a file from measured pivots.
//!
//! ```
//! use facemill_cl_data::ClPoint;
//! use facemill_inverse_kinematics::{BranchPreference, Machine};
//! use nalgebra::{Point3, Unit, Vector3};
//!
//! let machine = Machine::head_b_table_c()?;
//! let axis = Unit::new_normalize(Vector3::new(0.2, 0.1, 1.0));
//! let cl = ClPoint { tip: Point3::new(900.0, 300.0, 400.0), axis };
//! let q = machine.nearest_inverse(&cl, 260.0, None, BranchPreference::Positive)?;
//! let reached = machine.cl_point(&q, 260.0);
//! assert!((reached.tip - cl.tip).norm() < 1e-9 && (*reached.axis - *cl.axis).norm() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Machines with three linear and two rotary joints in any order, on table or head, with axes in
//! general directions, are solved in closed form; those with two linear and three rotary joints by
//! all roots of a polynomial. Others are refused by name when the file is read. Every inverse
//! solution is checked by the forward one to 1e-9 mm and 1e-12 rad. Units are mm, rad and s; only F
//! words are mm/min.
//!
//! Modules; each imports only those above it:
//!
//! | module | holds |
//! |---|---|
//! | `axes` | axes of a machine and their values |
//! | `machine_file` | machine file and its faults |
//! | `solver` | closed solutions for two and three rotary axes |
//! | `machine` | machines: forward solution, limits, bodies |
//! | `import` | machine files from kinematics of other programs |
//! | `measured` | machine files from measured pivots and limits; measured poses |
//! | `motion` | motion of a control between two positions, and its deviation from the planned one |
//! | `inverse` | inverse solution: axis values of a tool pose |
//! | `path` | solutions along a path: branch and winding of every pose |
//!
//! It must not know cutting: no part, no tool but its length.
//!
//! [`deviation_bound`]: motion::deviation_bound
//! [`import_autodesk_machine`]: import::import_autodesk_machine
//! [`linearise`]: motion::linearise
//! [`machine_from_measurements`]: measured::machine_from_measurements
//! [`rows_from_axes`]: import::rows_from_axes

mod axes;
#[cfg(test)]
#[path = "../tests/unit/elimination_laws.rs"]
mod elimination_laws;
pub mod import;
pub mod inverse;
mod machine;
pub mod machine_file;
pub mod measured;
pub mod motion;
pub mod path;
mod solver;

pub use crate::axes::axis::{Axis, AxisKind, AxisLetter, Carrier, Rollover};
pub use crate::axes::axis_values::{AxisValues, MAX_AXES};
pub use crate::inverse::control_choice::{POLE_CONE, UnclearChoice};
pub use crate::machine::bodies::{BodyPose, LinkId, MachineBody};
pub use crate::machine::limits::MACHINE_LIMITS;
pub use crate::machine::preset::{preset, preset_dual_xyzb, preset_head_b_table_c, preset_names};
pub use crate::machine::{FeedRange, Machine};
pub use crate::machine_file::error::MachineError;
pub use crate::motion::{BlockLaw, Motion, MotionError};
pub use crate::solver::inverse_solution::{
    Branch, BranchPreference, InverseSolution, InverseSolutions, MAX_SOLUTIONS, Unreachable,
};
