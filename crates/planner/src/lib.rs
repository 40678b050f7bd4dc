//! Plans: from a job to the program of each setup, with report.
//!
//! [`plan_setup`] plans one setup of a [`Job`](facemill_job::load::Job): passes on the drive surface, a tested posture at every CC
//! point, entries, exits and links, blocks timed by FEED, the program's text, and the run of that text on the virtual machine.
//! [`plan_job`] plans all setups and cuts their stock. A plan is a list of files and a
//! [`Report`](facemill_job::format::report::Report).
//!
//! Guarantee of a plan without findings: every pose has been tested against the meshes with the verdicts of
//! `facemill-interference`; the written text, read back and run under the machine's motion law, gouges nothing deeper than the
//! error budget, collides with nothing and keeps all axis limits at positions at most 0.5 mm and 0.2° apart, and with certificates
//! between them, too.
//!
//! It must not know the command line, nor formulas: those belong to the stage crates.

mod along;
mod chip_files;
mod chip_points;
mod chips_svg;
mod cusps_kept;
mod dual;
mod extra_passes;
mod lost_time;
mod mending;
#[cfg(test)]
mod mesh_winding_laws;
mod move_settings;
mod operation;
mod output;
mod plan;
mod plan_stages;
mod plan_stock;
mod planned_links;
mod pole_detours;
mod program;
mod replan_lengths;
mod reporting;
mod rotary_motion;
mod solution_space;
mod solution_svg;
mod summary;
mod svg_text;
mod timing;
mod turning;
mod vector_blocks;

pub use plan::{PlanSettings, Planned, plan_setup};
pub use plan_stock::plan_job;
pub use replan_lengths::replan_with_shorter_tools;
pub use solution_space::{SolutionSpace, SolutionSpaceRequest, solution_space};
pub use summary::summary;
