//! Operations of a setup as the stages need them: workcell, words, passes, feeds.

pub mod cell;
pub mod path;
pub mod pattern;
pub mod program_spec;
pub mod rolled;
pub mod word_map;

// Above the others: it gives each stage its view.
pub mod scene;
