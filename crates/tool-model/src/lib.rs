//! The tool: cutter, cutter body and holder as solids of revolution, and how a cutter touches a
//! surface.
//!
//! A tool file ([`ToolFile`], format [`FORMAT`]) becomes a checked [`ToolAssembly`]: a [`Cutter`]
//! (radius R, corner radius r) below a cutter body and a stack of holder frusta. All its lengths
//! are measured from the tool tip, and all its bodies are in the tool frame: origin at the tip, z
//! toward the spindle, mm.
//!
//! - [`cl_from_cc`] puts the cutter on a CC point (CLOPT (1), (2), torus form, flat limit).
//! - [`Cutter::test_bodies`] are the bodies whose freedom proves that no cutter point is deeper
//!   than the tolerance.
//! - [`Outline`] is the trace of the tilted cutter, seen along the feed; [`cusp_height_between`] is
//!   the ridge between two neighbouring passes on a surface of this [`FeedCurvature`], and
//!   [`silhouette_curvature`] the curvature of the trace at the contact.
//! - [`OpenAssembly`] is the assembly with its lengths L1 to L4 still open.
//!
//! ```
//! use facemill_cl_data::{CcPoint, Posture};
//! use facemill_tool_model::{Cutter, cl_from_cc};
//! use nalgebra::{Point3, Vector3};
//!
//! let cutter = Cutter::new(25.0, 2.0, 10.0)?;
//! let cc = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::x())?;
//! let cl = cl_from_cc(&cutter, &cc, Posture { tilt: 3f64.to_radians(), rotate: 0.0 });
//! // The cutter leans into the feed, touches with its leading edge, and its centre hangs back and up.
//! assert!(cl.axis.x > 0.0 && cl.tip.x < -22.0 && cl.tip.z > 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Every formula is closed except [`Outline::height_at`] and what is built on it, which iterate to
//! a stated accuracy.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `cutter` | cutters of radius R and corner radius r |
//! | `contact` | contact of cutter and surface: CC to CL points |
//! | `feed_curvature` | curvature of a surface seen along the feed |
//! | `outline` | outline of a cutter across the feed |
//! | `cusp` | ridge that two neighbouring passes leave between them |
//! | `silhouette` | curvature of the outline that a cutter shows in the direction of feed |
//! | `tool_file` | tool files |
//! | `assembly` | tool assemblies: cutter, shank, holder, spindle as solids of revolution |
//! | `open_assembly` | assemblies whose lengths are still open |
//! | `holder_library` | holders to choose from |
//!
//! The crate must not know meshes.

mod assembly;
mod contact;
mod cusp;
mod cutter;
mod feed_curvature;
mod holder_library;
mod open_assembly;
mod outline;
mod silhouette;
mod tool_file;

pub use assembly::{TOOL_LIMITS, ToolAssembly, ToolFileError, ToolSection};
pub use contact::cl_from_cc;
pub use cusp::{Cusp, cusp_height_between, step_over_for_cusp};
pub use cutter::{Cutter, CutterError};
pub use feed_curvature::FeedCurvature;
pub use holder_library::{HolderError, HolderFile, HolderLibrary, HoldersFile, HoldersFormatTag};
pub use open_assembly::{AssemblyLength, BuiltAssembly, Lengths, OpenAssembly};
pub use outline::Outline;
pub use silhouette::{SilhouetteCurvature, envelope_curvature, silhouette_curvature};
pub use tool_file::{AssumedMeasure, FORMAT, FormatTag, Section, SpindleRotation, Stack, ToolFile};
