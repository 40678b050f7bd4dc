//! Plans five-axis face milling: job file in, machine NC and reports out.
//!
//! [`Job::read`] reads a job with all it names, [`plan_setup`] plans one of its setups: passes on the drive surface, a
//! tested posture at every CC point, entries, exits and links, blocks timed by FEED, the program's text, and the run of
//! that text on the virtual machine; [`plan_job`] plans all of them and cuts their stock as well. What they return are files and
//! a [`Report`](report::Report); [`files::write_all`] writes them whole or not at all. The stages themselves are crates of
//! their own, re-exported here for library users.
//!
//! ```no_run
//! use facemill::{Job, PlanSettings, SilentStages, plan_setup};
//! use std::path::Path;
//!
//! let job = Job::read(Path::new("assets/propeller/job.json"))?;
//! let planned = plan_setup(&job, 0, PlanSettings { verify: true, certificates: false }, &SilentStages)?;
//! assert!(planned.is_clean());
//! # Ok::<(), crate::Failure>(())
//! ```
//!
//! What a plan without findings guarantees: every pose was tested against the meshes with the verdicts of
//! `facemill-interference`, and the written text, read back and run under the machine's motion law at positions at most
//! 0.5 mm and 0.2° apart, gouges nothing deeper than the error budget, collides with nothing and keeps all axis limits.
//! Between those positions nothing is proven yet.
//!
//! It must not know formulas: those belong to the stage crates.

mod across;
mod along;
mod between_lines;
mod cell;
mod check;
mod chip_files;
mod chip_points;
mod chips_svg;
mod clearance_surface;
mod cusps_kept;
mod deviation;
mod deviation_colours;
mod deviation_cusps;
mod deviation_figures;
mod deviation_report;
mod dual;
mod duration_text;
mod enclosure;
mod extra_passes;
mod failure;
pub mod files;
mod heads_merged;
mod incomplete;
pub mod job_file;
mod job_limits;
mod job_settings;
mod job_source;
pub mod lengths;
mod load;
mod lost_time;
mod machine_check;
mod machine_load;
#[cfg(test)]
mod machine_load_laws;
mod made_from;
mod mending;
mod mesh_files;
mod mesh_told;
mod mesh_winding;
#[cfg(test)]
mod mesh_winding_laws;
mod move_settings;
mod new_dual;
pub mod new_job;
mod new_machine;
mod obstacle_meshes;
mod open_meshes;
mod operation;
mod output;
mod part_size;
mod path;
mod pattern;
#[cfg(test)]
mod placement_laws;
mod plan;
mod plan_stages;
mod plan_stock;
mod pole_detours;
mod post_block_words;
mod post_load;
mod post_probe;
mod program;
mod program_spec;
mod program_stamp;
mod program_times;
pub mod rapids;
mod reach;
mod refeed;
mod refeed_checks;
mod refeed_law;
mod remaining;
mod remaining_report;
pub(crate) mod replan_lengths;
pub mod report;
mod report_chips;
mod report_cusps;
mod report_links;
mod report_lost_time;
mod report_outcome;
pub(crate) mod report_pairs;
mod report_stock;
mod report_turning;
mod reporting;
mod rest_stock;
mod rolled;
mod rotary_motion;
mod setup_order;
mod solution_space;
pub mod solution_space_file;
mod solution_svg;
mod stages;
mod stand;
mod stock;
mod stock_map;
mod stock_places;
mod summary;
mod summary_file;
mod svg_text;
mod text_times;
mod timing;
mod tip_feed;
mod turning;
mod validate;
mod validate_feeds;
mod vector_blocks;
mod verification_file;
mod verify_assumptions;
mod verify_feeds;
mod verify_program;
mod verify_stock;
mod virtual_setup;
mod walls;
mod word_map;

pub use crate::deviation_report::{CuspRatios, CuspReport, CuspsNotCompared};
pub use crate::duration_text::clock;
pub use crate::files::REJECTED;
pub use crate::job_limits::STOCK_TOLERANCES;
pub use crate::report_outcome::Outcome;
pub use crate::report_pairs::{PairReport, PairSplit};
pub use crate::report_stock::PlannedStockReport;
pub use crate::report_stock::StockReport;
pub use crate::verification_file::{VERIFICATION_FORMAT, VerificationFile};
pub use check::describe_setup;
pub use deviation::DeviationRequest;
pub use deviation_report::{DeviationAreas, DeviationBin, DeviationFigures, DeviationPlace, DeviationReport};
pub use facemill_tool_path::pass_order::PassOrderReport;
pub use failure::Failure;
pub use job_settings::JobSetting;
pub use job_source::{job_path, no_program};
pub use load::Job;
pub use machine_check::{MachineCheck, describe_heads, describe_hulls, describe_machine};
pub use machine_load::{BodyHull, ReadMachine, read_machine};
pub use made_from::{InputFile, MadeFrom};
pub use mesh_files::read_mesh;
pub use new_machine::{machine_names, new_job_for};
pub use plan::{PlanSettings, Planned, plan_setup};
pub use plan_stock::plan_job;
pub use program_stamp::{ProgramStamp, checksum};
pub use program_times::ProgramTimes;
pub use refeed::{MAX_TOOL_LENGTH, Refed, RefeedError, RefeedSettings, RefeedSummary, TipFeed, refeed, refeed_lines};
pub use refeed_law::{BLEND_TOLERANCES, RefeedLaw, RefeedLawTimes};
pub use remaining_report::{RemainingOnRegion, RemainingPlace, RemainingReport};
pub use replan_lengths::replan_with_shorter_tools;
pub use rest_stock::read_rest;
pub use solution_space::{SolutionSpace, SolutionSpaceRequest, solution_space};
pub use stages::{SilentStages, Stages};
pub use stand::{STAND_GOUGE_LIMIT, Stand, StandStock};
pub use stock_map::StockRegion;
pub use summary::summary;
pub use summary_file::{SUMMARY_FORMAT, SetupSummary, SummaryFile};
pub use verify_program::{Verified, VerifyRequest, verify_program};
pub use verify_stock::CutRequest;

pub use facemill_cc_path as cc_path;
pub use facemill_chip_area as chip_area;
pub use facemill_cl_data as cl_data;
pub use facemill_cutter_location as cutter_location;
pub use facemill_feedrate as feedrate;
pub use facemill_file_format as file_format;
pub use facemill_interference as interference;
pub use facemill_inverse_kinematics as inverse_kinematics;
pub use facemill_nc_program as nc_program;
pub use facemill_sample_parts as sample_parts;
pub use facemill_surface_model as surface_model;
pub use facemill_tool_model as tool_model;
pub use facemill_virtual_machine as virtual_machine;
pub use facemill_z_map as z_map;
