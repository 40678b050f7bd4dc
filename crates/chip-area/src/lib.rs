//! Section area of the chip across the feed; multiplied by the feed, it is the removal rate.
//!
//! [`chip_of_pass`] covers a pass of a flat, ball or bull-nose cutter on a plane, a convex or a
//! concave surface, its axis tilted across the feed, along it or both, between stock, borders and
//! neighbouring passes. It reports the method, in closed form or not, and an error bound.
//! [`pass::table`] does the same for many cases as comma-separated values.
//!
//! [`largest_thickness`] returns the chip thickness of one tooth, for any cutter in any
//! orientation.
//!
//! [`chip_area`] takes CHIP's own sections, with the paper's angles. [`chip_area_between_outlines`]
//! covers any cutter that has a lower outline across the feed, by quadrature to a given accuracy.
//!
//! ```
//! use facemill_chip_area::{
//!     Beside, CutterEnd, Engagement, Method, NeighbourAxis, Orientation, PassSection, SectionSurface, chip_of_pass,
//! };
//!
//! // CHIP, table 3: ball of radius 6 on a convex surface of radius 20, whose axis is vertical but for 10°, 45° down the
//! // side; the second position is 1 mm farther up to the left, so that the first is its neighbour on the right.
//! let turn = (1.0 / 20.0f64).to_degrees();
//! let section = PassSection {
//!     cutter: CutterEnd { radius: 6.0, corner_radius: 6.0 },
//!     surface: SectionSurface::Convex { radius: 20.0 },
//!     engagement: Engagement {
//!         depth_of_cut: 2.0,
//!         left: Beside::Stock,
//!         right: Beside::Cut { step_over: 1.0 },
//!     },
//!     orientation: Orientation { lead: 0.0, lean: (45.0 - turn + 10.0).to_radians() },
//!     neighbour_axis: NeighbourAxis::Parallel,
//! };
//! let chip = chip_of_pass(&section)?;
//! assert_eq!(chip.method, Method::ClosedForm);
//! assert!((chip.area - 2.0774).abs() < 1e-4);
//! # Ok::<(), facemill_chip_area::PassError>(())
//! ```
//!
//! Modules; each imports only those above it:
//!
//! | module | holds |
//! |---|---|
//! | `outline` | section area of any cutter that has a lower outline across the feed |
//! | `section` | sections of a cutter: area of the chip in them |
//! | [`mod@pass`] | passes of a cutter over a surface: area and thickness of the chip, and tables of them |
//!
//! Lengths are mm, angles rad, areas mm². `docs/chip-area.md` derives every case. It must not know
//! machines or meshes.

mod outline;
pub mod pass;
mod section;

pub use crate::pass::error::{PassError, Pose};
pub use crate::pass::thickness::{CutterPose, largest_thickness};
pub use crate::section::error::{ChipAreaError, Position};
pub use outline::{OutlineError, chip_area_between_outlines};
pub use pass::{
    Beside, ChipArea, CutterEnd, Engagement, Method, NeighbourAxis, Orientation, PassSection, chip_of_pass,
};
pub use section::{ChipSection, SectionCutter, SectionSurface, StepSign, chip_area};
