//! Files as they are written: batches, tasks, results, failures and reports.

pub mod batch_file;
pub mod report_file;
pub mod result_file;
pub mod task_file;
