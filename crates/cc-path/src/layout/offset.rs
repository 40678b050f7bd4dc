//! Passes at distances from a line on the surface: along edges and roots.

pub(crate) mod corner_normals;
pub(crate) mod edge_lines;
pub(crate) mod fillet;
pub(crate) mod offset_field;
pub(crate) mod offset_layout;
pub(crate) mod ridge;
pub(crate) mod ridge_profile;
pub(crate) mod rolling_ball;
pub(crate) mod root_sides;
