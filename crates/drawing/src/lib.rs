//! Pictures of plans as SVG: passes by the use of their strips, chips along them, the map of the
//! feasible postures of one CC point, and tool assemblies and machines with their dimensions.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | [`svg_text`] | texts that fit: widths, broken lines, entries in rows |
//! | [`mod@assembly_svg`] | a tool assembly with its dimensions |
//! | [`mod@machine_svg`] | the kinematic chain of a machine with its pivots |
//! | [`mod@chips_svg`] | chip area and removal rate along passes |
//! | [`mod@passes_svg`] | passes, coloured by the use of their strips |
//! | [`solution_svg`] | map of the feasible postures of one CC point |
//!
//! It must not know jobs, nor how a plan was made.

pub mod assembly_svg;
pub mod chips_svg;
pub mod machine_svg;
pub mod passes_svg;
pub mod solution_svg;
pub mod svg_text;
