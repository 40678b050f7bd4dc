//! Page of a program: one HTML file with part, machine, program and proof, which opens from disk.
//!
//! [`page_data`](document::page_data) reads a program back, follows its axes, cuts the stock on
//! coarse lines and packs all of it with the report; [`report_html`](html::report_html) writes the
//! page, [`sheet_html`](html::sheet_html) the setup sheet alone,
//! [`job_html`](job_page::job_html) the page of a job with several programs, and
//! [`animation_glb`](animation::animation_glb) the motion for other viewers.
//!
//! The page takes positions from the text as verification does, not from a plan, and shows the
//! report as its file says it. Surfaces and stock are coarser than those that were tested; the page
//! says by how much. The same sources give the same bytes.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `packed` | arrays of numbers as text: differences, gzip, base64 |
//! | [`mod@format`] | data document of a page |
//! | `meshes` | triangles for the screen: surfaces with fewer triangles, and shapes of bodies |
//! | [`mod@motion`] | motions of a program for replay: positions of all axes, times, the tip's path |
//! | `clearance` | clearances at the ends of blocks |
//! | `contact` | angle between tool and surface where the cutter touches it |
//! | `stock` | stock as the program cuts it, and the deviation that is left |
//! | `program_text` | comments of a program that say which operation and pass follows |
//! | `line_figures` | figures of lines from certificates, chips and heights that are left |
//! | `postures` | maps of feasible postures of a plan, at their motions |
//! | `verdict` | verdict on a program by its report or verification |
//! | [`mod@document`] | the data of a page from job, program and report |
//! | [`mod@html`] | files of a page |
//! | [`mod@job_page`] | page of a job with several programs |
//! | [`mod@animation`] | machine, part and tool in motion as binary glTF, for other viewers |
//!
//! It must not know how a program was planned.

pub mod animation;
mod clearance;
mod contact;
pub mod document;
pub mod format;
pub mod html;
pub mod job_page;
mod line_figures;
mod meshes;
pub mod motion;
mod packed;
mod postures;
mod program_text;
mod stock;
mod verdict;

pub use crate::packed::{Arrays, ByteArray, NumberArray};
pub use crate::verdict::stamp_line;
