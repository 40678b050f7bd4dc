//! Fields on a patch: values at its vertices, linear on its triangles.

pub(crate) mod accumulated;
pub(crate) mod ends;
pub(crate) mod field_bands;
pub(crate) mod field_layout;
pub(crate) mod gradients;
pub(crate) mod possible_flows;
pub(crate) mod spiral;
pub(crate) mod walk;
pub(crate) mod winding;
