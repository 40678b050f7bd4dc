//! Batches: many jobs, or many variants of one, planned by many processes, with results that are
//! there whole or not at all.
//!
//! [`Batch::read`](expand::Batch::read) reads a batch file and expands it into tasks, each one
//! setup of one job. [`Keys`](key::Keys) gives each task the checksum of everything that its result
//! depends on. [`perform`](perform::perform) runs a task and files its result in a
//! [`Store`](store::Store) under its key; [`run_tasks`](run::scheduler::run_tasks) starts a process
//! for each task without a result. [`batch_report`](report::batch_report) compares the results.
//!
//! Guarantees: a result is filed whole, under the key of the bytes that it was made from, and has
//! the same bytes whoever makes it, with how many threads, after however many kills. A task with a
//! result is not run again.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | [`mod@format`] | files as they are written: batches, tasks, results, failures, reports |
//! | [`mod@expand`] | batches read and expanded: axes of variation, patterns of names, bounds |
//! | [`mod@key`] | keys of tasks |
//! | [`mod@memory`] | memory of processes: bound and largest use |
//! | [`mod@store`] | folder of results: locks, results renamed into place, failures |
//! | [`mod@perform`] | one task in this process |
//! | [`mod@given`] | a task given to a process |
//! | [`mod@run`] | processes for tasks, causes of their ends, tries |
//! | [`mod@report`] | results compared: rows, best of each group, CSV and HTML |
//!
//! It must not know the command line.

pub mod expand;
pub mod format;
pub mod given;
pub mod key;
pub mod memory;
pub mod perform;
pub mod report;
pub mod run;
pub mod store;
