//! Jobs: a setup of a part on a machine, and all that is planned, verified or rewritten for it.
//!
//! [`mod@format`] has the files as they are written; [`load`] reads a job with all that it names, [`check`] refuses what cannot be
//! meant, [`setup`] makes of an operation what the stages of planning need, [`stock`] has the stock before a setup, [`examples`]
//! writes new jobs.
//!
//! It must not know how anything is planned or verified.

pub mod check;
pub mod duration_text;
pub mod examples;
pub mod failure;
pub mod files;
pub mod format;
pub mod load;
pub mod setup;
pub mod stages;
pub mod stock;
