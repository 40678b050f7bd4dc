//! Passes by all strategies: planned, compared, pictured.

mod adverse_regions;
mod blocks_in_five_axes;
mod cl_files;
pub(crate) mod constant_scallop;
pub(crate) mod edges_and_roots;
pub(crate) mod flow_and_spiral;
pub(crate) mod islands;
pub(crate) mod leaning_borders;
pub(crate) mod left_above;
mod levels;
pub(crate) mod paths;
mod posts;
mod ramps_into_stock;
mod roughing;
pub(crate) mod several_tools;
pub(crate) mod solution_space;
pub(crate) mod turns;
mod uneven_castings;
