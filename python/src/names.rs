//! Choices by name.

use flexure::nonlinearity::{EstimatorName, Kernel};
use flexure_workbench::Named;
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

/// A choice of the workbench.
///
/// # Errors
/// As [`known`].
pub fn choice<T: Named>(what: &str, name: &str) -> PyResult<T> {
    let names: Vec<&str> = T::ALL.iter().map(|choice| choice.name).collect();
    known(what, name, &names, T::parse)
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

/// How a setting of the workbench is written as an argument.
pub fn argument(name: &str, value: Option<&str>) -> String {
    let argument = match name {
        "select" => "rule",
        "band-method" => "band_method",
        "weights" => "sample_weight",
        "torque-constant" => return "-torque".to_owned(),
        "estimator" if value == Some("local-bandwidth") => return "bandwidth='local'".to_owned(),
        other => other,
    };
    match value {
        Some(value) => format!("{argument}='{value}'"),
        None => argument.to_owned(),
    }
}
