//! Programs from anywhere against a job.
//!
//! [`program`] reads the text of a program and runs it as a setup of a job is mounted: gouge, collision, limits and feeds, with
//! findings by line. [`stock_run`] cuts the stock, [`remaining`] measures the material left on the regions that were asked for,
//! [`deviation`] compares the part with what is left of the stock.
//!
//! [`feeds`] checks feeds against the job's, [`between_lines`] asks again what the lines of the stock cannot tell,
//! [`text_times`] times a text by the law, [`heads_merged`] makes one result of the runs of two heads, [`virtual_setup`] puts a setup's
//! obstacles on the machine, [`assumptions`] names what a verification rests on.
//!
//! It must not know how a program was planned.

pub mod assumptions;
pub mod deviation;
pub mod feeds;
pub mod merged_heads;
pub mod program;
pub mod remaining;
pub mod stock_run;
pub mod sub_cell_check;
pub mod text_times;
pub mod virtual_setup;
