//! Plans: from a job to the program of each setup, with report.
//!
//! [`plan_setup`] plans one setup of a [`Job`](facemill_job::load::job::Job): passes on the drive
//! surface, a tested posture at every CC point, entries, exits and links, blocks timed by FEED, the
//! program's text, and the run of that text on the virtual machine. [`plan_job`] plans all setups
//! and cuts their stock. A plan is a list of files and a
//! [`Report`](facemill_job::format::report::Report).
//!
//! Guarantee of a plan without findings: every pose has been tested against the meshes with the
//! verdicts of `facemill-interference`; the written text, read back and run under the machine's
//! motion law, gouges nothing deeper than the error budget, collides with nothing and keeps all
//! axis limits at positions at most 0.5 mm and 0.2° apart, and with certificates between them, too.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `plan_stock` | the stock of a plan: cut by each setup's own program, from one setup to the next |
//! | `plan_settings` | options of a planning run |
//! | `stage_clock` | wall times of stages |
//! | `passes` | passes with tested postures, chips and ridges at every point, passes beside them |
//! | `program` | from moves to timed blocks and text |
//! | `report` | figures of a plan for its reader: report, summary, chips, rotary motion, lost time |
//! | `planned` | result of a planning run, with the postures of its passes |
//! | `plan_run` | the plan of a setup that has been read, for any number of heads, and its stages |
//! | `dual` | setups of a machine with two heads |
//! | `plan` | the complete plan of one setup |
//! | `plan_job` | all setups of a job, each on the stock that earlier ones leave |
//! | `replan_lengths` | the job planned again with shorter tools |
//! | `posture_maps` | maps of the feasible postures where each pass has the narrowest choice |
//! | `solution_space` | the proven map of one CC point |
//!
//! It must not know the command line, nor formulas: those belong to the stage crates.

mod dual;
#[cfg(test)]
#[path = "../tests/unit/mesh_winding_laws.rs"]
mod mesh_winding_laws;
mod passes;
mod plan;
mod plan_job;
mod plan_run;
mod plan_settings;
mod plan_stock;
mod planned;
mod posture_maps;
mod program;
mod replan_lengths;
mod report;
mod solution_space;
mod stage_clock;

pub use crate::passes::engagement::neighbour_reach;
pub use crate::plan::ReadSetup;
pub use crate::plan_job::{plan_job, plan_job_setup, plan_job_with_setups};
pub use crate::plan_settings::PlanSettings;
pub use crate::planned::{Planned, PosedPass};
pub use crate::posture_maps::posture_maps;
pub use crate::report::pass_files::path_text;
pub use crate::report::summary::summary;
pub use plan::plan_setup;
pub use replan_lengths::replan_with_shorter_tools;
pub use solution_space::{SolutionSpace, SolutionSpaceRequest, solution_space};
