//! Formats of the files of jobs, reports and other results.

pub mod incomplete;
pub mod job_file;
pub mod job_report;
pub mod job_settings;
pub mod made_from;
pub mod moved_job;
pub mod program_stamp;
pub mod program_times;
pub mod report;
pub mod solution_space_file;
pub mod summary_file;
pub mod verification_file;
