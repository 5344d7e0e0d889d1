//! Choices by name.

use flexure::nonlinearity::{EstimatorName, Kernel, Rule};
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

/// One of several choices, by its name.
fn one_of<T: Copy>(what: &str, name: &str, all: &[T], name_of: fn(T) -> &'static str) -> PyResult<T> {
    let names: Vec<&str> = all.iter().map(|&choice| name_of(choice)).collect();
    known(what, name, &names, |name| {
        all.iter().copied().find(|&choice| name_of(choice) == name)
    })
}

/// A choice of the workbench.
pub fn choice<T: Named>(what: &str, name: &str) -> PyResult<T> {
    let names: Vec<&str> = T::ALL.iter().map(|choice| choice.name).collect();
    known(what, name, &names, T::parse)
}

/// An estimator.
pub fn estimator(name: &str) -> PyResult<EstimatorName> {
    one_of("estimator", name, &EstimatorName::ALL, EstimatorName::name)
}

/// A kernel.
pub fn kernel(name: &str) -> PyResult<Kernel> {
    one_of("kernel", name, &Kernel::ALL, Kernel::name)
}

/// A rule that chooses a parameter.
pub fn rule(name: &str) -> PyResult<Rule> {
    one_of("rule", name, &Rule::ALL, Rule::name)
}

/// How a setting of the workbench is written as an argument.
pub fn argument(name: &str, value: Option<&str>) -> String {
    let argument = match name {
        "select" => "rule",
        "band-method" => "band_method",
        "weights" => "sample_weight",
        "robust" => return "a sample_weight of zero".to_owned(),
        "torque-constant" => return "-torque".to_owned(),
        "estimator" if value == Some("local-bandwidth") => return "bandwidth='local'".to_owned(),
        other => other,
    };
    match value {
        Some(value) => format!("{argument}='{value}'"),
        None => argument.to_owned(),
    }
}
