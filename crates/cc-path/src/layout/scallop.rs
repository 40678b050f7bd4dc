//! Constant scallop: fronts that advance from seeds by the local strip width.

pub(crate) mod advance;
pub(crate) mod coverage;
pub(crate) mod lanes;
pub(crate) mod ridges;
pub(crate) mod scallop_layout;
mod seed_points;
pub(crate) mod seeds;
pub(crate) mod surface_path;
