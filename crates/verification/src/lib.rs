//! Verification of programs from any source against a job.
//!
//! [`program`] reads the text of a program and runs it on a job's setup as mounted: gouge,
//! collision, limits and feeds, with findings by line. [`stock_run`] cuts the stock, [`remaining`]
//! measures the material left on the operations' regions, [`deviation`] compares the part with the
//! remaining stock.
//!
//! [`efficiency`] compares the length of passes with the least that their postures permit,
//! [`feeds`] checks feeds against the job's, [`sub_cell_check`] checks collisions below the
//! resolution of the stock's lines, [`text_times`] times a text by the motion law, [`merged_heads`]
//! merges the runs of two heads, [`named_results`] names obstacles in results,
//! `assumptions` lists the assumptions of a verification.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `assumptions` | assumptions of a program's run besides its text |
//! | `text_passes` | passes that the text of a program cuts: where its cutter touches a surface |
//! | [`mod@deviation`] | comparison of the cut stock with the part: figures, and the part's surface in colours |
//! | [`mod@feeds`] | comparison of a program's feeds and spindle speeds with the job's |
//! | [`mod@merged_heads`] | runs and proofs of two heads, merged into one |
//! | [`mod@text_times`] | times of a program by its text |
//! | [`mod@named_results`] | failures of runs, and the names of files and groups in their results |
//! | [`mod@operation_region`] | regions that operations are to cut, and samples spread over them |
//! | [`mod@efficiency`] | length of passes over the least length that the strip widths permit |
//! | [`mod@material_left`] | heights left on samples of a surface |
//! | [`mod@remaining`] | material that a program leaves on the surface that its operations are to cut, measured on its text |
//! | [`mod@stock_run`] | the stock of a job's setup, cut by a program from any source |
//! | [`mod@sub_cell_check`] | collisions with the stock below the resolution of its lines |
//! | [`mod@program`] | a program from any source, run on the virtual machine in a job's setup |
//!
//! It must not know how a program was planned.

mod assumptions;
pub mod deviation;
pub mod efficiency;
pub mod feeds;
pub mod material_left;
pub mod merged_heads;
pub mod named_results;
pub mod operation_region;
pub mod program;
pub mod remaining;
pub mod stock_run;
pub mod sub_cell_check;
mod text_passes;
pub mod text_times;
