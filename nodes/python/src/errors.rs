//! Failures as exceptions.

use std::any::Any;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use pyo3::exceptions::{PyException, PyFileNotFoundError, PyRuntimeError};
use pyo3::prelude::*;

pyo3::create_exception!(
    stillmap,
    Error,
    PyException,
    "A job could not be done. The text says what was wrong and, on a second line, what to do."
);

/// A failure, in its own words.
pub(crate) fn error(failure: impl Display) -> PyErr {
    Error::new_err(failure.to_string())
}

/// A failure of work that reads `path`.
pub(crate) fn error_of_file(path: &Path, failure: impl Display) -> PyErr {
    if path.exists() { error(failure) } else { PyFileNotFoundError::new_err(failure.to_string()) }
}

/// Computes without the interpreter's lock. A panic, which is a defect, becomes an exception that can be caught as any other.
pub(crate) fn computed<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> PyResult<T> + Send,
) -> PyResult<T> {
    // What a panic leaves behind is not used again: a run is behind a lock, which it poisons.
    let result = py.detach(|| catch_unwind(AssertUnwindSafe(work)));
    result.unwrap_or_else(|panic| {
        let said = said_by(panic.as_ref());
        Err(PyRuntimeError::new_err(format!("a defect of stillmap, please report it: {said}")))
    })
}

fn said_by(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default()
}
