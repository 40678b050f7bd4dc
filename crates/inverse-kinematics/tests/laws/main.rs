//! Laws of machines: their files, forward and inverse solutions, ways between positions, branches
//! and windings.

#[path = "../common/mod.rs"]
mod common;
mod meant;

mod axis_lines;
mod axis_paths;
mod axis_ranges;
mod deviation;
mod family;
mod heads;
mod import;
mod inverse;
mod line_files;
mod machine_file;
mod measured;
mod motion;
mod published;
mod three_rotaries;
mod touches;
