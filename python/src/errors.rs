//! The one place where errors become exceptions, with the same text.

use flexure::Error;
use pyo3::PyErr;
use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};

create_exception!(
    flexure,
    FlexureError,
    PyValueError,
    "What is wrong with the data, a parameter or a file: the message says what, where, and what to do."
);
create_exception!(
    flexure,
    DataError,
    FlexureError,
    "The data cannot be used: a missing column, samples that are not finite or do not vary, times that are not uniform, \
     lengths that differ."
);
create_exception!(
    flexure,
    TooShortError,
    DataError,
    "There are fewer samples, or fewer different ones, than the computation needs."
);
create_exception!(
    flexure,
    ParameterError,
    FlexureError,
    "A parameter is outside its valid range, or asks for more than the data can tell."
);
create_exception!(
    flexure,
    FileError,
    FlexureError,
    "A file cannot be read or written, or its content is wrong."
);
create_exception!(
    flexure,
    SimulationError,
    FlexureError,
    "A simulation could not be carried on: too many steps, or a motion that grows without bound."
);

/// The exception of a library's error.
pub fn of_library(error: &Error) -> PyErr {
    let text = error.to_string();
    match error {
        Error::Data(data) if data.is_too_short() => TooShortError::new_err(text),
        Error::Parameter(_) | Error::Arm(_) => ParameterError::new_err(text),
        Error::Simulation(_) => SimulationError::new_err(text),
        Error::Stopped(_) => PyRuntimeError::new_err(text),
        _ => DataError::new_err(text),
    }
}

/// The exception for any error of the crates. If the library's error is the cause, the exception is for that, since arrays have no file to
/// name.
pub fn of_any(error: &anyhow::Error) -> PyErr {
    let mut causes = error.chain();
    if let Some(cause) = causes.find_map(|cause| cause.downcast_ref::<Error>()) {
        return of_library(cause);
    }
    if let Some(flexure_io::Error::Data { cause, .. }) = error.downcast_ref() {
        return of_library(cause);
    }
    if error.is::<flexure_io::Error>() {
        return FileError::new_err(format!("{error:#}"));
    }
    FlexureError::new_err(format!("{error:#}"))
}
