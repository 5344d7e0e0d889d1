//! An estimator's tuning parameter among the options.

use flexure::Error;
use flexure::error::ParameterError;
use flexure::nonlinearity::{EstimatorName, Kernel, NamedEstimator, Tuning};

use crate::arguments::{Auto, Usage};

/// The given parameter, from `--bandwidth` or `--parameter`, whichever the estimator has; `None` without either. `option` is the option
/// that chose the estimator.
pub fn given(
    option: &str,
    name: EstimatorName,
    bandwidth: Auto<Vec<f64>>,
    parameter: Auto<f64>,
) -> Result<Option<Vec<f64>>, Usage> {
    let what = name.parameter();
    match (bandwidth, parameter) {
        (Some(_), _) | (_, Some(_)) if !name.takes_parameter() => Err(Usage(format!(
            "{option} {name} chooses its bandwidths from the data alone; leave --bandwidth and --parameter out"
        ))),
        (Some(_), _) if !name.has_bandwidth() => Err(Usage(format!(
            "--bandwidth: {option} {name} has no bandwidth; its parameter is {what}, given by --parameter"
        ))),
        (_, Some(_)) if name.has_bandwidth() => Err(Usage(format!(
            "--parameter: the parameter of {option} {name} is its {what}, given by --bandwidth"
        ))),
        (_, Some(p)) if name.counts() && p.fract() != 0.0 => Err(Usage(format!(
            "--parameter {p}: the parameter of {option} {name} is {what}, a whole number"
        ))),
        (bandwidth, parameter) => {
            if let Some(parameter) = parameter {
                check_range(name, parameter)?;
            }
            Ok(bandwidth.or(parameter.map(|p| vec![p])))
        }
    }
}

/// Refuses a parameter that is invalid for every data set.
fn check_range(name: EstimatorName, parameter: f64) -> Result<(), Usage> {
    let estimator = NamedEstimator {
        name,
        tuning: Tuning::Fixed(vec![parameter]),
        ..NamedEstimator::default()
    };
    let x: Vec<f64> = (0..40).map(f64::from).collect();
    match estimator.fit(&[&x], &x, None) {
        Err(Error::Parameter(error @ ParameterError::OutOfRange { .. })) => Err(Usage(format!("--parameter: {error}"))),
        _ => Ok(()),
    }
}

/// Refuses a kernel for an estimator that has none.
pub fn check_kernel(option: &str, name: EstimatorName, kernel: Option<Kernel>) -> Result<(), Usage> {
    if kernel.is_some() && !name.has_bandwidth() {
        return Err(Usage(format!(
            "--kernel: {option} {name} has no kernel; leave it out, or choose an estimator that has one"
        )));
    }
    Ok(())
}
