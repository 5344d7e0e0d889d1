//! Choices by name.

use flexure::nonlinearity::{EstimatorName, Kernel};
use pyo3::prelude::*;

use crate::errors::ParameterError;

/// What `parse` makes of a name.
///
/// # Errors
/// `ParameterError`, which lists the names there are.
pub fn known<T>(what: &str, name: &str, names: &[&str], parse: impl Fn(&str) -> Option<T>) -> PyResult<T> {
    let message = || format!("the {what} is '{name}', but must be one of {}", names.join(", "));
    parse(name).ok_or_else(|| ParameterError::new_err(message()))
}

/// An estimator.
///
/// # Errors
/// As [`known`].
pub fn estimator(name: &str) -> PyResult<EstimatorName> {
    known(
        "estimator",
        name,
        &EstimatorName::ALL.map(EstimatorName::name),
        EstimatorName::parse,
    )
}

/// A kernel.
///
/// # Errors
/// As [`known`].
pub fn kernel(name: &str) -> PyResult<Kernel> {
    let parse = |name: &str| Kernel::ALL.into_iter().find(|k| k.name() == name);
    known("kernel", name, &Kernel::ALL.map(Kernel::name), parse)
}
