//! Plans: from a job to the program of each setup, with report.
//!
//! [`plan_setup`] plans one setup of a [`Job`](facemill_job::load::job::Job): passes on the drive surface, a tested posture at every CC
//! point, entries, exits and links, blocks timed by FEED, the program's text, and the run of that text on the virtual machine.
//! [`plan_job`] plans all setups and cuts their stock. A plan is a list of files and a
//! [`Report`](facemill_job::format::report::Report).
//!
//! Guarantee of a plan without findings: every pose has been tested against the meshes with the verdicts of
//! `facemill-interference`; the written text, read back and run under the machine's motion law, gouges nothing deeper than the
//! error budget, collides with nothing and keeps all axis limits at positions at most 0.5 mm and 0.2° apart, and with certificates
//! between them, too.
//!
//! | module | step |
//! |---|---|
//! | `plan`, `plan_stages`, `plan_stock` | the whole way through one setup; its stages; the stock before each setup's program, and what it cuts |
//! | `operation`, `move_settings` | poses by `cutter_location::plan_passes`, copies by pattern, each tested again; moves by `tool_path` |
//! | `pole_detours`, `extra_passes` | passes beside the pole again, calmer, where that is faster; passes beside trimmed ones and where the cusp is not kept |
//! | `along` | ridges and chips at every CC point |
//! | `program`, `timing`, `vector_blocks`, `output` | blocks with feeds that the axes reach; tool vectors; NC and APT text, read back and run |
//! | `planned_links` | faster links, put into the moves before the program is run |
//! | `mending` | tested poses in the middle of blocks that cut too deep; written and run again, at most four times |
//! | `reporting`, `cusps_kept`, `lost_time`, `turning`, `rotary_motion`, `chip_points`, `chip_files`, `chips_svg`, `solution_svg`, `svg_text`, `summary` | what the user reads |
//! | `dual` | setups of a machine with two heads |
//! | `solution_space` | the proven map of one CC point |
//! | `replan_lengths` | the job planned again with shorter tools |
//!
//! It must not know the command line, nor formulas: those belong to the stage crates.

mod drawing;
mod dual;
#[cfg(test)]
mod mesh_winding_laws;
mod passes;
mod plan;
mod plan_job;
mod plan_stages;
mod plan_stock;
mod planned;
mod program;
mod replan_lengths;
mod report;
mod solution_space;
mod stage_clock;

pub use crate::plan_job::plan_job;
pub use crate::planned::{PlanSettings, Planned};
pub use crate::report::summary::summary;
pub use plan::plan_setup;
pub use replan_lengths::replan_with_shorter_tools;
pub use solution_space::{SolutionSpace, SolutionSpaceRequest, solution_space};
