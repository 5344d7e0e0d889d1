//! The options as a method; what contradicts itself is wrong usage.

use flexure::nonlinearity::{EstimatorName, NamedEstimator, Tuning};
use flexure::selection::Criterion;

use super::{Arguments, Outside, Select};
use crate::arguments::{Auto, Usage};

/// The columns of the result besides those of x.
const RESULT: [&str; 3] = ["y", "lower", "upper"];

/// The method that the options ask for.
pub fn method(arguments: &Arguments) -> Result<NamedEstimator, Usage> {
    columns(arguments)?;
    let name = arguments.estimator;
    if arguments.kernel.is_some() && !name.has_bandwidth() {
        return Err(Usage(format!(
            "--kernel is for estimators with a kernel, and --estimator {name} has none; leave it out"
        )));
    }
    if arguments.weights.is_some() && !name.takes_weights() {
        return Err(Usage(format!(
            "--weights: --estimator {name} takes no weights; leave them out, or choose another estimator"
        )));
    }
    Ok(NamedEstimator {
        name,
        tuning: tuning(arguments)?,
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
fn tuning(arguments: &Arguments) -> Result<Tuning, Usage> {
    let name = arguments.estimator;
    let parameter = name.parameter();
    let chosen = || {
        Tuning::FromData(match arguments.select {
            Select::Loo => Criterion::LeaveOneOut,
            Select::Gcv => Criterion::Generalized,
        })
    };
    match (&arguments.bandwidth, &arguments.parameter) {
        (Auto::Given(_), _) if !name.has_bandwidth() => Err(Usage(format!(
            "--bandwidth: --estimator {name} has no bandwidth; its parameter is {parameter}, given by --parameter"
        ))),
        (_, Auto::Given(_)) if name.has_bandwidth() => Err(Usage(format!(
            "--parameter: the parameter of --estimator {name} is its {parameter}, given by --bandwidth"
        ))),
        (Auto::Given(h), _) if h.len() != 1 && h.len() != arguments.x.len() => Err(Usage(format!(
            "--bandwidth gives {} values for {} columns of x; give one for all, or one a column",
            h.len(),
            arguments.x.len()
        ))),
        (Auto::Given(h), _) => Ok(Tuning::Fixed(h.clone())),
        (_, Auto::Given(p)) if name.counts() && p.fract() != 0.0 => Err(Usage(format!(
            "--parameter {p}: the parameter of --estimator {name} is its {parameter}, a whole number"
        ))),
        (_, Auto::Given(p)) => Ok(Tuning::Fixed(vec![*p])),
        (Auto::Auto, Auto::Auto) => Ok(chosen()),
    }
}
