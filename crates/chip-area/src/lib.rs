//! Section area of the chip across the feed, which times the feed is the removal rate.
//!
//! [`chip_area`] answers for CHIP's sections: a flat or ball cutter on a plane, a convex or a concave surface, with the
//! tool axis in the section plane, in closed form. [`chip_area_between_outlines`] answers for any cutter that has a
//! lower outline across the feed, such as a face mill tilted along the feed, by quadrature to a given accuracy.
//!
//! ```
//! use facemill_chip_area::{ChipSection, SectionCutter, SectionSurface, StepSign, chip_area};
//!
//! // CHIP, table 3: ball of radius 6 on a convex surface of radius 20, leaning by 10° to the left.
//! let section = ChipSection {
//!     cutter: SectionCutter::Ball { radius: 6.0 },
//!     surface: SectionSurface::Convex { radius: 20.0 },
//!     depth_of_cut: 2.0,
//!     step_over: 1.0,
//!     step_sign: StepSign::Positive,
//!     alpha0: 45f64.to_radians(),
//!     lean: -10f64.to_radians(),
//! };
//! let area = chip_area(&section)?;
//! assert!((area - 2.0774).abs() < 1e-4);
//! # Ok::<(), facemill_chip_area::ChipAreaError>(())
//! ```
//!
//! Lengths are mm, angles rad, areas mm². The section plane has x to the right and y up; what a value means there, and
//! what is an error, [`ChipSection`] and [`ChipAreaError`] say. It must not know machines or meshes.

mod elliptic;
mod error;
mod level_curve;
mod outline;
mod pass;
mod pass_error;
mod quadrature;
mod rim;
mod section;
mod slab;
pub mod table;
mod table_error;
mod tool_section;
mod turned;

pub use error::{ChipAreaError, Position};
pub use outline::{OutlineError, chip_area_between_outlines};
pub use pass::{
    Beside, ChipArea, CutterEnd, Engagement, Method, NeighbourAxis, Orientation, PassSection, chip_of_pass,
};
pub use pass_error::{PassError, Pose};
pub use section::{ChipSection, SectionCutter, SectionSurface, StepSign, chip_area};
