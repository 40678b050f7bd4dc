//! BladeGen and TurboGrid blade descriptions: an `.inf` file, and the curves that it names.
//!
//! [`read_blade`] reads a [`BladeFile`] in mm: of each [`ProfileBlade`] of a set, the
//! [`ProfileSection`]s from hub to shroud with the marks of their edges; hub and shroud as
//! polylines from inlet to outlet, axis and number of blade sets. [`BladeInfo`] is the `.inf` file
//! alone. A [`BladeFileError`] names file and line, and the remedy.
//!
//! In an `.inf` file each line is `key: value`; keys that describe no geometry are skipped. In a
//! curve file each line has x, y and z of a point, and may have a mark: `le`, `te`, or for a
//! cut-off edge `le1`, `le2`, `te1`, `te2` at its two corners. Lines with `#` are comments that
//! begin a new section, lines with `!` are comments.
//!
//! A set may have splitter blades beside its main blade. Another blade begins in a profile file
//! with a comment such as `## Splitter blade`, or with a number of a profile that the blade has
//! already; the `.inf` file may also name several profile files. Its `Number of Blades Per Set`
//! must agree. Sections out of order are refused, so that a splitter is never taken for a part of
//! the main blade.
//!
//! Modules; each imports only those above it:
//!
//! | module | holds |
//! |---|---|
//! | `fault` | faults with file and line |
//! | `info` | the `.inf` file |
//! | `headers` | comments of a profile file that begin sections and blades |
//! | `curves` | hub, shroud and profile curves |
//! | `section_checks` | sections against each other: number, sense, order, crossings |
//! | `blade` | a blade from all of its files |
//!
//! It must not know meshes, and opens no file.

mod blade;
mod curves;
mod fault;
mod headers;
mod info;
mod section_checks;

pub use blade::{BladeFile, ProfileBlade, read_blade};
pub use curves::{MAX_POINTS, MAX_SECTION_POINTS, MIN_SECTION_POINTS, ProfileSection};
pub use fault::{BladeFault, BladeFileError};
pub use info::{BladeEnd, BladeInfo, EdgeEnd, RotationAxis};
