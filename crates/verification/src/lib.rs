//! Programs from anywhere against a job.
//!
//! [`program`] reads the text of a program and runs it as a setup of a job is mounted: gouge,
//! collision, limits and feeds, with findings by line. [`stock_run`] cuts the stock, [`remaining`]
//! measures the material left on the regions that were asked for, [`deviation`] compares the part
//! with what is left of the stock.
//!
//! [`feeds`] checks feeds against the job's, [`sub_cell_check`] asks again what the lines of the
//! stock cannot tell, [`text_times`] times a text by the law, [`merged_heads`] makes one result of
//! the runs of two heads, [`virtual_setup`] puts a setup's obstacles on the machine,
//! [`assumptions`] names what a verification rests on.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | [`mod@assumptions`] | what the run of a program rests on besides its text |
//! | [`mod@deviation`] | the cut stock against the part: figures, and the part's surface in colours |
//! | [`mod@feeds`] | A program's feeds and spindle speeds against those that a job asks for |
//! | [`mod@merged_heads`] | runs and proofs of two heads as one |
//! | [`mod@text_times`] | times of a program by its text |
//! | [`mod@virtual_setup`] | the machine of a setup with all that is on it, for the virtual machine |
//! | [`mod@remaining`] | material that a program leaves on the surface that its operations are asked to cut, measured on its text |
//! | [`mod@stock_run`] | the stock of a job's setup as a program from anywhere cuts it |
//! | [`mod@sub_cell_check`] | what meets the stock where the lines that it is cut on do not show it |
//! | [`mod@program`] | A program from anywhere, run on the virtual machine as a job's setup stands |
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
