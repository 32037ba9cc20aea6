//! Errors of the core as Python exceptions.

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use quarc::error::Error;

create_exception!(
    quarc_core,
    RejectedError,
    PyException,
    "The stream is malformed: reject id, message."
);
create_exception!(
    quarc_core,
    DeclinedError,
    PyException,
    "A stream exceeds the limits of this decoder."
);
create_exception!(quarc_core, UnwritableError, PyException, "A scene cannot be encoded.");

/// Convert an error to its exception.
pub fn raise(error: Error) -> PyErr {
    match error {
        Error::Rejected { reject, message, .. } => RejectedError::new_err((reject.id(), message)),
        Error::Encode(message) => UnwritableError::new_err(message),
        declined => DeclinedError::new_err(declined.to_string()),
    }
}
