//! Data types of the pipeline, which one stage passes to the next.
//!
//! A planned operation passes through these stages: [`CcPoint`]s in [`Pass`]es (contact of the
//! cutter with the part), [`ClPoint`]s (tool poses), axis values (crate
//! `facemill-inverse-kinematics`), timed blocks, NC text. This crate holds the first two, the
//! [`Posture`] that leads from one to the other, and the terms of every guarantee: the
//! [`MotionLaw`] between two blocks and the [`ErrorBudget`] of an operation.
//!
//! Units are mm, rad and s; every position and direction is in the workpiece frame unless a name
//! says otherwise.
//!
//! ```
//! use facemill_cl_data::{CcPoint, Posture};
//! use nalgebra::{Point3, Vector3};
//!
//! let cc = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
//! let posture = Posture { tilt: 2f64.to_radians(), rotate: 0.0 };
//! // CLOPT (1): leaning by the tilt into the feed.
//! assert!((cc.tool_axis(posture).x - posture.tilt.sin()).abs() < 1e-15);
//! ```
//!
//! Modules; each imports only those above it:
//!
//! | module | holds |
//! |---|---|
//! | `aabb` | axis-aligned boxes |
//! | `cc_point` | cutter-contact points |
//! | `error_budget` | error budget of an operation |
//! | `monitor` | progress and cancellation of long computations |
//! | `motion_law` | motion laws of a machine: cuts, rapids and the tolerance of the control |
//! | `pass` | passes: points cut without lifting |
//! | `polyhedron` | convex polyhedra |
//! | `polyhedron_build` | a convex polyhedron around points, cut from their box by half spaces that hold them all |
//! | `solid` | convex bodies dilated by a ball: frusta, boxes, polyhedra |
//! | `split_mix` | numbers that only look random, for samples and tables |
//!
//! It must not know meshes, machines or files.

mod aabb;
mod cc_point;
mod error_budget;
mod monitor;
mod motion_law;
mod pass;
mod polyhedron;
mod polyhedron_build;
#[cfg(test)]
#[path = "../tests/unit/polyhedron_laws.rs"]
mod polyhedron_laws;
mod solid;
mod split_mix;

pub use aabb::Aabb;
pub use cc_point::{CcPoint, CcPointError, ClPoint, Posture};
pub use error_budget::ErrorBudget;
pub use monitor::{Cancelled, Monitor, Silent};
pub use motion_law::{ControlTolerance, CuttingLaw, MotionLaw, RapidLaw};
pub use pass::Pass;
pub use polyhedron::{ConvexPolyhedron, Face, NearestPoint};
pub use polyhedron_build::PolyhedronError;
pub use solid::{PlacedSolid, RoundBox, RoundFrustum, RoundHull, Solid};
pub use split_mix::{SplitMix64, mixed_bits};
