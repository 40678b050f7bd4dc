//! Operations of a setup as the stages need them: workcell, words, passes, feeds.

pub(crate) mod after_programs;
pub mod cell;
pub mod cl_path;
pub mod left_stock;
pub(crate) mod level_passes;
pub mod link_times;
pub mod pass_surface;
pub mod path;
pub mod program_spec;
pub mod programs_before;
pub mod rolled;
pub mod word_map;

// Above the others: it gives each stage its view.
pub mod scene;
