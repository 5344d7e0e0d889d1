//! The options as a method; what contradicts itself is wrong usage.

use flexure::nonlinearity::{EstimatorName, NamedEstimator, Tuning};
use flexure::selection::Criterion;

use super::{Arguments, Outside, Select};
use crate::arguments::Usage;
use crate::tuning;

/// The columns of the result besides those of x.
const RESULT: [&str; 3] = ["y", "lower", "upper"];

/// The method that the options ask for.
pub fn method(arguments: &Arguments) -> Result<NamedEstimator, Usage> {
    columns(arguments)?;
    let name = arguments.estimator;
    tuning::check_kernel("--estimator", name, arguments.kernel)?;
    if arguments.weights.is_some() && !name.takes_weights() {
        return Err(Usage(format!(
            "--weights: --estimator {name} takes no weights; leave them out, or choose another estimator"
        )));
    }
    Ok(NamedEstimator {
        name,
        tuning: chosen(arguments)?,
        kernel: arguments.kernel.unwrap_or_default(),
        outside: match arguments.outside {
            Outside::Nan => flexure::nonlinearity::Outside::Nan,
            Outside::Nearest => flexure::nonlinearity::Outside::Nearest,
            Outside::Linear => flexure::nonlinearity::Outside::Linear,
        },
    })
}

/// The columns must differ, and be as many as the estimator takes.
fn columns(arguments: &Arguments) -> Result<(), Usage> {
    let Arguments { x, y, weights, .. } = arguments;
    if let Some(name) = x.iter().find(|name| name.is_empty()) {
        return Err(Usage(format!(
            "--x '{}' names an empty column '{name}'; separate the names by single commas",
            x.join(",")
        )));
    }
    if let Some(i) = (1..x.len()).find(|&i| x[..i].contains(&x[i])) {
        return Err(Usage(format!("--x names the column '{}' twice; name it once", x[i])));
    }
    if x.contains(y) {
        return Err(Usage(format!(
            "--x and --y both name '{y}'; a column cannot be regressed on itself"
        )));
    }
    if let Some(weights) = weights.as_ref().filter(|w| *w == y) {
        return Err(Usage(format!(
            "--weights and --y both name '{weights}'; name two different columns"
        )));
    }
    let (got, most) = (x.len(), arguments.estimator.most_columns());
    if got > most {
        let name = arguments.estimator;
        let others = EstimatorName::ALL.into_iter().filter(|e| e.most_columns() >= got);
        let others: Vec<&str> = others.map(EstimatorName::name).collect();
        let instead = match others.as_slice() {
            [] => "; name fewer columns".to_owned(),
            names => format!("; name fewer, or take --estimator {}", names.join(" or ")),
        };
        let takes = if most == 1 {
            "one column".to_owned()
        } else {
            format!("at most {most} columns")
        };
        return Err(Usage(format!(
            "--estimator {name} takes {takes} of x, and --x names {got}{instead}"
        )));
    }
    if let Some(name) = x.iter().find(|name| RESULT.contains(&name.as_str()))
        && arguments.out.is_some()
    {
        return Err(Usage(format!(
            "--x names a column '{name}', and the result has a column of that name besides; rename it in the record, or leave -o out \
             and take --json"
        )));
    }
    Ok(())
}

/// The tuning parameter: a bandwidth by one option, all others by another.
fn chosen(arguments: &Arguments) -> Result<Tuning, Usage> {
    let (bandwidth, parameter) = (arguments.bandwidth.clone(), arguments.parameter);
    match tuning::given("--estimator", arguments.estimator, bandwidth, parameter)? {
        Some(values) if values.len() != 1 && values.len() != arguments.x.len() => Err(Usage(format!(
            "--bandwidth gives {} values for {} columns of x; give one for all, or one a column",
            values.len(),
            arguments.x.len()
        ))),
        Some(values) => Ok(Tuning::Fixed(values)),
        None => Ok(Tuning::FromData(match arguments.select {
            Select::Loo => Criterion::LeaveOneOut,
            Select::Gcv => Criterion::Generalized,
        })),
    }
}
