//! Cuts of a CL file as passes on a surface.
//!
//! A CL file says where the tool is, and not where it touches. [`read_cuts`] takes the cuts of one
//! tool from a file: its motion at feed between rapids, in one frame, with chords for arcs.
//! [`lay_cuts`] finds where the cutter touches the surface along them, and returns passes: CC
//! points, each with the file's tool pose.
//!
//! The place of contact is the place of the surface that is nearest to the cutter or deepest in it
//! ([`nearest_to_cutter`]); on a curved surface it is refined with smooth normals, until the
//! cutter's normal is the surface's. Where the bottom of the cutter lies flat on the surface, it
//! touches everywhere, and the contact is the leading place of the rim, as in
//! [`facemill_tool_model::cl_from_cc`].
//!
//! Guarantees: with [`ContactKind::OfTool`] tilt and rotate of a file's axis at a CC point lead
//! back to the file's pose within rounding; with [`ContactKind::OfSurface`] each CC point is on the
//! surface. The distance of cutter and surface is exact for facets that face the tool, to 1e-6 of
//! their size. Not guaranteed: that anything but these facets is clear of the tool.
//!
//! Modules; each imports only those above it:
//!
//! | module | holds |
//! |---|---|
//! | `fault` | reasons why a file makes no passes |
//! | `cuts` | motion of one tool at feed, between rapids |
//! | `cutter_distance` | signed distance of points from a cutter; the least one of a surface |
//! | `contact` | contact of a cutter at a pose with a surface |
//! | `samples` | poses along a cut |
//! | `turns` | turns of the tool axis along passes |
//! | `lay` | cuts to passes |
//!
//! It must not know jobs, machines and controls.

mod contact;
mod cuts;
mod cutter_distance;
mod fault;
mod lay;
mod samples;
mod turns;

pub use crate::contact::{Contact, ContactKind, contact};
pub use crate::cuts::{CutSettings, FilePoint, ToolCuts, read_cuts};
pub use crate::cutter_distance::{NearestPlace, cutter_distance, nearest_to_cutter};
pub use crate::fault::ClPathFault;
pub use crate::lay::{ClPass, ClPasses, FileContact, LaySettings, StandOff, lay_cuts};
pub use crate::turns::{AxisTurns, JUMP_DEG};
