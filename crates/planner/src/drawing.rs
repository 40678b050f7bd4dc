//! Pictures of plans: SVG text and the map of the feasible postures.

pub(crate) mod passes_svg;
pub(crate) mod solution_svg;
pub(crate) mod svg_text;
