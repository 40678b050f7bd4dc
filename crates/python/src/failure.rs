//! Failures as exceptions of Python.

#![allow(missing_docs, reason = "the macro that makes an exception adds no documentation")]

use facemill::Failure;
use pyo3::create_exception;
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;

create_exception!(
    facemill,
    Error,
    PyValueError,
    "Failure of facemill, with its message: wrong input (file and field), or an infeasible job."
);

/// Returns the exception of a failure; `exit_code` of it is that of the command.
pub fn raised(py: Python<'_>, failure: &Failure) -> PyErr {
    let code = match failure {
        Failure::NothingToCut(_) => 0,
        Failure::Infeasible(_) => 1,
        Failure::Input { .. } | Failure::Read { .. } => 2,
        Failure::Interrupted => return PyKeyboardInterrupt::new_err(failure.to_string()),
        _ => 3,
    };
    let error = Error::new_err(failure.to_string());
    match error.value(py).setattr("exit_code", code) {
        Ok(()) => error,
        Err(other) => other,
    }
}

/// Returns the exception of wrong arguments.
pub fn wrong(message: impl ToString) -> PyErr {
    Error::new_err(message.to_string())
}
