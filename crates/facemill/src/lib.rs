//! Five-axis face milling, from mesh to machine: planning, verification and rewriting of programs.
//!
//! [`Job::read`] reads a job with all files that it names. [`plan_setup`] plans one of its setups,
//! [`plan_job`] plans all of them and cuts their stock. [`verify_program`] runs a program from any
//! source in a setup, [`rapids::faster_rapids`] replaces its links, [`rewrite_feeds`] its feeds,
//! and [`lengths::lengths_of_program`] finds the shortest tool for it. [`Scene`] with [`UseScene`]
//! searches, plans, verifies and cuts one setup. [`files::write_all`] writes files whole or not at
//! all. Each stage is a separate crate, re-exported here.
//!
//! The command line is the default feature `cli`. A library leaves out its dependencies with
//! `facemill = { version = "0.1", default-features = false }`.
//!
//! ```no_run
//! use facemill::{Job, PlanSettings, SilentStages, plan_setup};
//! use std::path::Path;
//!
//! let job = Job::read(Path::new("assets/propeller/job.json"))?;
//! let planned = plan_setup(&job, 0, PlanSettings { verify: true, certificates: false }, &SilentStages)?;
//! assert!(planned.is_clean());
//! # Ok::<(), facemill::Failure>(())
//! ```

mod scene;

/// Pages with examples that the documentation of no crate has: its tests compile them here, because
/// each crate's own would be linked apart.
#[cfg(doctest)]
mod pages {
    #[doc = include_str!("../../../README.md")]
    struct Repository;

    #[doc = include_str!("../../blade-file/README.md")]
    struct BladeFile;

    #[doc = include_str!("../../called-program/README.md")]
    struct CalledProgram;

    #[doc = include_str!("../../channel-pair/README.md")]
    struct ChannelPair;

    #[doc = include_str!("../../cl-file/README.md")]
    struct ClFile;

    #[doc = include_str!("../../cl-path/README.md")]
    struct ClPath;

    #[doc = include_str!("../../cl-post/README.md")]
    struct ClPost;

    #[doc = include_str!("../../drawing/README.md")]
    struct Drawing;

    #[doc = include_str!("../../file-format/README.md")]
    struct FileFormat;

    #[doc = include_str!("../../job/README.md")]
    struct Job;

    #[doc = include_str!("../../nc-subprograms/README.md")]
    struct NcSubprograms;

    #[doc = include_str!("../../job-check/README.md")]
    struct JobCheck;

    #[doc = include_str!("../../level-region/README.md")]
    struct LevelRegion;

    #[doc = include_str!("../../mesh-store/README.md")]
    struct MeshStore;

    #[doc = include_str!("../../planner/README.md")]
    struct Planner;

    #[doc = include_str!("../../propeller-file/README.md")]
    struct PropellerFile;

    #[doc = include_str!("../../setup-programs/README.md")]
    struct SetupPrograms;

    #[doc = include_str!("../../test-kit/README.md")]
    struct TestKit;

    #[doc = include_str!("../../verification/README.md")]
    struct Verification;

    #[doc = include_str!("../../virtual-machine/README.md")]
    struct VirtualMachine;
}

pub use crate::scene::UseScene;
pub use facemill_job::duration_text::clock;
pub use facemill_job::examples::new_job;
pub use facemill_job::failure::Failure;
pub use facemill_job::files;
pub use facemill_job::files::REJECTED;
pub use facemill_job::format::job_settings::JobSetting;
pub use facemill_job::format::{job_file, report, solution_space_file};
pub use facemill_job::load::ad_hoc_setup::{AD_HOC_GOUGE_LIMIT, AdHocSetup, AdHocStock};
pub use facemill_job::load::job::{Job, Setup};
pub use facemill_job::load::job_files::JobFiles;
pub use facemill_job::load::job_source::{job_path, no_program};
pub use facemill_job::load::mesh_files::read_mesh;
pub use facemill_job::load::post_load::read_dialect_file;
pub use facemill_job::setup::scene::Scene;
pub use facemill_job::stages::{SilentStages, Stages};
pub use facemill_job::stock::map::StockRegion;
pub use facemill_job::stock::rest::read_rest;
pub use facemill_job::validate::limits::STOCK_TOLERANCES;
pub use facemill_job_check::{describe_job, describe_setup, new_job_for};
pub use facemill_nc_rewrite::feed_rewrite::rewrite_feeds;
pub use facemill_nc_rewrite::{lengths, rapids};
pub use facemill_planner::{
    PlanSettings, Planned, SolutionSpace, SolutionSpaceRequest, plan_job, plan_setup, replan_with_shorter_tools,
    solution_space, summary,
};
pub use facemill_tool_path::moves::order::PassOrderReport;
pub use facemill_verification::deviation::DeviationRequest;
pub use facemill_verification::program::{Verified, VerifyRequest, verify_program};
pub use facemill_verification::stock_run::CutRequest;

pub use facemill_batch as batch;
pub use facemill_blade_file as blade_file;
pub use facemill_called_program as called_program;
pub use facemill_cc_path as cc_path;
pub use facemill_channel_pair as channel_pair;
pub use facemill_chip_area as chip_area;
pub use facemill_cl_data as cl_data;
pub use facemill_cl_file as cl_file;
pub use facemill_cl_path as cl_path;
pub use facemill_cl_post as cl_post;
pub use facemill_cutter_location as cutter_location;
pub use facemill_drawing as drawing;
pub use facemill_feedrate as feedrate;
pub use facemill_file_format as file_format;
pub use facemill_interference as interference;
pub use facemill_inverse_kinematics as inverse_kinematics;
pub use facemill_job as job;
pub use facemill_job_check as job_check;
pub use facemill_level_region as level_region;
pub use facemill_mesh_store as mesh_store;
pub use facemill_nc_program as nc_program;
pub use facemill_nc_rewrite as nc_rewrite;
pub use facemill_nc_subprograms as nc_subprograms;
pub use facemill_planner as planner;
pub use facemill_propeller_file as propeller_file;
pub use facemill_report_page as report_page;
pub use facemill_sample_parts as sample_parts;
pub use facemill_setup_programs as setup_programs;
pub use facemill_surface_model as surface_model;
pub use facemill_tool_library as tool_library;
pub use facemill_tool_model as tool_model;
pub use facemill_tool_path as tool_path;
pub use facemill_verification as verification;
pub use facemill_virtual_machine as virtual_machine;
pub use facemill_z_map as z_map;

/// Machines: read, described and checked.
pub mod machines {
    pub use facemill_job::load::machine_load::{BodyHull, ReadMachine, read_machine};
    pub use facemill_job_check::machine_check::{MachineCheck, describe_heads, describe_hulls, describe_machine};
}

/// Files that jobs, plans and verifications leave.
pub mod formats {
    pub use facemill_job::format::incomplete::{incomplete_at_end, incomplete_because, not_met};
    pub use facemill_job::format::job_report::{
        ClampingReport, CuspsAtEnd, DatumReport, DatumShapeReport, JOB_REPORT_FORMAT, JobReport, LeftAtEnd,
        LeftAtEndPlace, PlacementReport, PoseReport, SecondToolReport, ToolProgramReport,
    };
    pub use facemill_job::format::made_from::{InputFile, MadeFrom};
    pub use facemill_job::format::moved_job::moved_job;
    pub use facemill_job::format::program_stamp::{ProgramStamp, checksum};
    pub use facemill_job::format::program_times::{NoLawReason, ProgramTimes};
    pub use facemill_job::format::summary_file::{
        JoinedProgramSummary, JoinedSectionSummary, SUMMARY_FORMAT, SetupSummary, SummaryFile,
    };
    pub use facemill_job::format::verification_file::{CalledFile, VERIFICATION_FORMAT, VerificationFile};
    pub use facemill_path_strategies::{
        ComparedStrategy, FastestStrategy, LaidPasses, PATHS_FORMAT, PassedOverStrategy, PathsFile, PlannedPasses,
        StrategiesFile,
    };
}

/// Feeds of programs that exist.
pub mod feeds {
    pub use facemill_nc_rewrite::feed_rewrite::law::{BLEND_TOLERANCES, FeedLaw, FeedLawTimes};
    pub use facemill_nc_rewrite::feed_rewrite::{
        FeedRewriteError, FeedRewriteSettings, FeedRewriteSummary, MAX_TOOL_LENGTH, RewrittenFeeds, TipFeed,
        rewrite_feed_lines,
    };
}

/// Strategies of a job: laid, listed and compared.
pub mod strategies {
    pub use facemill_path_strategies::{
        CompareRequest, ComparisonSteps, LaidPaths, NamedStrategy, compare_paths, default_strategies, fastest,
        lay_paths, listed_strategies,
    };
}
