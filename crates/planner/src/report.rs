//! Figures of a plan for its reader: report, summary, chips, rotary motion, lost time.

pub(crate) mod chip_files;
pub(crate) mod chip_points;
pub(crate) mod cl_paths;
pub(crate) mod cusps_kept;
pub(crate) mod efficiencies;
pub(crate) mod left_above;
pub(crate) mod lost_time;
pub(crate) mod operation_times;
pub(crate) mod pass_files;
pub(crate) mod reported_heads;
pub(crate) mod reporting;
pub(crate) mod rotary_motion;
pub(crate) mod rotary_reversals;
pub(crate) mod summary;
