//! Sample jobs: a part, its tools, a machine and the job file, as files in memory.
//!
//! [`new_job`] makes one from a [`NewJob`]: a propeller of a series or of a table, both sides
//! of a propeller from its casting, a blade, a patch. [`as_read`] says how it understands a table.
//! [`lofted_blades`] has the meshes of a blade description with their natural coordinates.
//!
//! ```
//! use facemill_sample_jobs::{NewJob, new_job};
//!
//! let files = new_job(&NewJob::Patch { size_mm: 80.0 }, &|file| Err(format!("no file {}", file.display()))).unwrap();
//! assert_eq!(files[1].0, "job.json");
//! ```
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `job_parts` | pieces of job files: operations, tools, folders |
//! | `propeller_mesh` | propellers as files of meshes with names |
//! | `new_propeller` | propellers of a series or a table, one side up |
//! | `new_dual` | a propeller on a mill with two heads |
//! | `new_cast` | both sides of a propeller from its casting |
//! | `new_whole` | a whole propeller from its casting, with three tools |
//! | `blade_set` | blades of an `.inf` file as meshes |
//! | `new_blade` | blades from files of others |
//! | `new_job` | sample jobs by their descriptions |
//!
//! This crate must not know how jobs are read or planned, and opens no file by itself.

mod blade_set;
mod job_parts;
mod new_blade;
mod new_cast;
mod new_dual;
mod new_job;
mod new_propeller;
mod new_whole;
mod propeller_mesh;

pub use crate::blade_set::{SetBlade, lofted_blades};
pub use crate::job_parts::{ROTOR_SCALES, ReadFile, round_to};
pub use crate::new_job::{NewJob, Series, as_read, new_job};
pub use crate::propeller_mesh::propeller_glb;
