//! Runs of programs against meshes: cutter, holder and machine bodies at every step and between
//! steps.

pub(crate) mod between;
pub(crate) mod chunk_result;
pub(crate) mod cutter_depth;
pub(crate) mod dead_core;
pub(crate) mod edges;
pub(crate) mod ramp;
pub(crate) mod report;
pub(crate) mod rotaries;
pub(crate) mod scene;
pub(crate) mod segments;
pub(crate) mod surface_normals;
pub(crate) mod track;
pub(crate) mod verify;
pub(crate) mod walker;
