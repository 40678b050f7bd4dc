//! Postures along whole passes: costs, graph, smoothing.

pub(crate) mod band;
pub(crate) mod cost;
pub(crate) mod graph;
pub(crate) mod layers;
pub(crate) mod plan;
pub(crate) mod smooth_band;
pub(crate) mod smooth_pass;
pub(crate) mod task;
