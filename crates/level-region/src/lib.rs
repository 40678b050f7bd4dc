//! Levels of roughing: the part of a plane that an upright cutter reaches past what is on it,
//! and the passes that it can cut there.
//!
//! A *level* is a plane across an axis. The tool comes along this axis, so all of the column over
//! the cutter has to be free of the bodies that *stand* on the level: its *room* are the places of
//! the tip where it is. What the flat bottom sweeps from there is its *reach*.
//!
//! ```
//! use facemill_interference::{MeshTree, solid_mesh};
//! use facemill_cl_data::{RoundFrustum, Solid};
//! use facemill_level_region::{Level, LevelPlane, Standing};
//! use facemill_tool_model::Cutter;
//! use nalgebra::{Point3, Vector3};
//!
//! // A pin of 10 mm is in the middle of stock of 60 mm; R 8, r 2, and 1 mm to be left.
//! let round = |radius| RoundFrustum { z_low: 0.0, z_high: 20.0, radius_low: radius, radius_high: radius, rounding: 0.0 };
//! let mesh = solid_mesh(&Solid::Frustum(round(5.0)))?;
//! let tree = MeshTree::new(&mesh);
//! let standing = || vec![Standing { mesh: &mesh, tree: &tree, allowance: 1.0 }];
//! let stock = solid_mesh(&Solid::Frustum(round(30.0)))?;
//!
//! let plane = LevelPlane::new(Vector3::z_axis(), 10.0);
//! let level = Level::new(plane, &Cutter::new(8.0, 2.0, 5.0)?, standing(), &stock);
//! let room = level.room(standing());
//! assert!(room.fits(&Point3::new(14.1, 0.0, 10.0)) && !room.fits(&Point3::new(13.9, 0.0, 10.0)));
//! // The flat bottom ends its corner radius before the allowance: 8 mm from the middle.
//! let is_near = |p: &Point3<f64>, x: f64| (p - plane.at(x, 0.0)).norm() < 0.5;
//! let is_swept = |x: f64| level.reach().middles().any(|(p, swept)| swept && is_near(&p, x));
//! assert!(is_swept(9.5) && !is_swept(7.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Guaranteed: the room is exact, by the verdicts of `facemill-interference`; a cell that counts as
//! swept can be swept, and one that may not be swept cannot; results do not depend on the number
//! of threads.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `plane` | planes of levels |
//! | `kept_off` | places of the tip that a cutter keeps off |
//! | `room` | room of an upright cutter on a level, past what is there |
//! | `nodes` | lattices of places of the tip, with whether the cutter fits at each |
//! | `reach` | part of a level that the cutter sweeps, on a lattice |
//! | `level` | a level over stock, with its reach |
//! | `pieces` | pieces of passes where the cutter has room |
//! | `contour` | passes around what is on a level |
//! | `passes` | all passes of a level |
//!
//! It must not know jobs and machines, and how passes are laid.

mod contour;
mod kept_off;
mod level;
mod nodes;
mod passes;
mod pieces;
mod plane;
mod reach;
mod room;

pub use crate::contour::{ContourPass, ContourSettings, contour_passes};
pub use crate::kept_off::KeptOff;
pub use crate::level::Level;
pub use crate::passes::{LevelPassSettings, SidedPass, level_passes};
pub use crate::pieces::{PieceSettings, fitting_pieces};
pub use crate::plane::LevelPlane;
pub use crate::reach::Reach;
pub use crate::room::{LevelRoom, Standing};
