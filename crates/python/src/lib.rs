//! Python package of facemill, its compiled half: the module `facemill._facemill`.
//!
//! Takes and returns plain values, bytes and numpy arrays; the classes that users see are in
//! `python/facemill`. Long calls run without Python's lock, and Ctrl-C ends them.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | [`mod@failure`] | failures as exceptions |
//! | [`mod@interrupt`] | long calls that Ctrl-C ends |
//! | [`mod@arrays`] | rows of numpy arrays |
//! | [`mod@meshes`] | mesh files from and to arrays |
//! | [`mod@kinematics`] | machines |
//! | [`mod@jobs`] | jobs, plans, verification and feeds |
//! | [`mod@poses`] | tests of poses |
//! | [`mod@batches`] | expansion, tasks and results of batches |

pub mod failure;
pub mod interrupt;

pub mod arrays;
pub mod meshes;

pub mod kinematics;

pub mod jobs;

pub mod poses;

pub mod batches;

use pyo3::prelude::*;

/// Compiled half of the package.
#[pymodule]
#[pyo3(name = "_facemill")]
fn exported(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    let error = m.py().get_type::<failure::Error>();
    // Of errors that Python code raises: wrong input.
    error.setattr("exit_code", 2)?;
    m.add("Error", error)?;
    m.add_class::<kinematics::Machine>()?;
    m.add_class::<poses::PoseTest>()?;
    m.add_function(wrap_pyfunction!(kinematics::preset_names, m)?)?;
    m.add_function(wrap_pyfunction!(meshes::read_mesh, m)?)?;
    m.add_function(wrap_pyfunction!(meshes::mesh_bytes, m)?)?;
    m.add_function(wrap_pyfunction!(jobs::plan, m)?)?;
    m.add_function(wrap_pyfunction!(jobs::write_plan, m)?)?;
    m.add_function(wrap_pyfunction!(jobs::verify, m)?)?;
    m.add_function(wrap_pyfunction!(jobs::feedrate, m)?)?;
    m.add_function(wrap_pyfunction!(jobs::example_job, m)?)?;
    m.add_function(wrap_pyfunction!(batches::confine, m)?)?;
    m.add_function(wrap_pyfunction!(batches::bound_memory, m)?)?;
    m.add_function(wrap_pyfunction!(batches::checksum, m)?)?;
    m.add_function(wrap_pyfunction!(batches::expand, m)?)?;
    m.add_function(wrap_pyfunction!(batches::run_task, m)?)?;
    m.add_function(wrap_pyfunction!(batches::prepare_store, m)?)?;
    m.add_function(wrap_pyfunction!(batches::stored, m)?)?;
    m.add_function(wrap_pyfunction!(batches::cause_of_end, m)?)?;
    m.add_function(wrap_pyfunction!(batches::exit_code_of, m)?)?;
    m.add_function(wrap_pyfunction!(batches::file_result, m)?)?;
    m.add_function(wrap_pyfunction!(batches::file_failure, m)?)
}
