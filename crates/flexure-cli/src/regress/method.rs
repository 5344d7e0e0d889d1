//! The options as a method; what contradicts itself is wrong usage.

use flexure::nonlinearity::{EstimatorName, NamedEstimator, Rule, Tuning};

use super::band::BandMethod;
use super::{Arguments, Method, Outside, band};
use crate::arguments::Usage;
use crate::tuning;

/// The columns of the result besides those of x.
const RESULT: [&str; 3] = ["y", "lower", "upper"];

/// The method that the options ask for.
pub fn method(arguments: &Arguments) -> Result<Method, Usage> {
    columns(arguments)?;
    let name = name(arguments);
    tuning::check_kernel("--estimator", name, arguments.kernel)?;
    band::check(arguments)?;
    let estimator = NamedEstimator {
        name,
        tuning: chosen(arguments)?,
        kernel: arguments.kernel.unwrap_or_default(),
        outside: match arguments.outside {
            Outside::Nan => flexure::nonlinearity::Outside::Nan,
            Outside::Nearest => flexure::nonlinearity::Outside::Nearest,
            Outside::Linear => flexure::nonlinearity::Outside::Linear,
        },
        seed: arguments.seed,
    };
    Ok(Method {
        estimator,
        level: arguments.band,
        simultaneous: arguments.simultaneous,
        band_method: arguments.band_method,
        block: arguments.block,
    })
}

/// The estimator. By default local bandwidths where they can be: in one column, unless some option is about one
/// bandwidth or about refits, which would take long.
pub fn name(arguments: &Arguments) -> EstimatorName {
    let one = arguments.x.len() > 1
        || arguments.bandwidth.clone().given().is_some()
        || arguments.parameter.given().is_some()
        || arguments.select.is_some()
        || matches!(arguments.band_method, BandMethod::Bootstrap | BandMethod::Block);
    arguments.estimator.unwrap_or(match one {
        true => EstimatorName::LocalLinear,
        false => EstimatorName::LocalBandwidth,
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
    let (got, most) = (x.len(), name(arguments).most_columns());
    if got > most {
        let name = name(arguments);
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
    let name = name(arguments);
    match tuning::given("--estimator", name, bandwidth, parameter)? {
        Some(values) if values.len() != 1 && values.len() != arguments.x.len() => Err(Usage(format!(
            "--bandwidth gives {} values for {} of x; give one for all, or one a column",
            values.len(),
            counted(arguments.x.len())
        ))),
        Some(values) => match arguments.select {
            Some(rule) => Err(Usage(format!(
                "--select {} chooses what {} gives; leave one of them out",
                rule.name(),
                if name.has_bandwidth() {
                    "--bandwidth"
                } else {
                    "--parameter"
                },
            ))),
            None => Ok(Tuning::Fixed(values)),
        },
        None => {
            let rule = match arguments.select.unwrap_or_default() {
                Rule::BlockBootstrap { .. } => Rule::BlockBootstrap { block: arguments.block },
                rule => rule,
            };
            if rule.suits(name, arguments.x.len()) {
                Ok(Tuning::FromData(rule))
            } else {
                Err(unsuited(arguments, rule))
            }
        }
    }
}

fn unsuited(arguments: &Arguments, rule: Rule) -> Usage {
    let (name, columns) = (name(arguments), arguments.x.len());
    let suited = Rule::ALL.into_iter().filter(|rule| rule.suits(name, columns));
    let instead = match rule {
        Rule::PlugIn if name.has_bandwidth() && columns == 1 => {
            "; the plug-in rule is made for the local line: --estimator local-linear"
        }
        _ => "",
    };
    Usage(format!(
        "--select {}: --estimator {name} with {} of x is chosen by {}{instead}",
        rule.name(),
        counted(columns),
        suited.map(Rule::name).collect::<Vec<_>>().join(", ")
    ))
}

fn counted(columns: usize) -> String {
    format!("{columns} column{}", if columns == 1 { "" } else { "s" })
}
