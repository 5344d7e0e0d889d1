//! The options as an estimator; options that contradict each other are wrong usage.

use flexure::nonlinearity::{EstimatorName, NamedEstimator, Rule, Tuning};
use flexure::text::counted;
use flexure_workbench::regression::BandMethod;

use super::Arguments;
use crate::arguments::{Usage, named_once};
use crate::tuning;

/// Most points of a grid over all columns.
const MOST_POINTS: f64 = 1e6;

/// The columns of the result in addition to those of x.
const RESULT: [&str; 3] = ["y", "lower", "upper"];

/// The estimator that the options ask for.
pub fn estimator(arguments: &Arguments) -> Result<NamedEstimator, Usage> {
    let name = name(arguments);
    check_columns(arguments, name)?;
    check_grid(arguments)?;
    tuning::check_kernel("--estimator", name, arguments.kernel)?;
    check_band(arguments, name)?;
    Ok(NamedEstimator {
        name,
        tuning: chosen(arguments, name)?,
        kernel: arguments.kernel.unwrap_or_default(),
        outside: arguments.outside,
        seed: arguments.seed,
    })
}

/// Refuses a grid of too many points.
fn check_grid(arguments: &Arguments) -> Result<(), Usage> {
    let columns = arguments.x.len();
    match arguments.grid.map(|n| (n, f64::from(n).powi(columns as i32))) {
        Some((n, points)) if points > MOST_POINTS => Err(Usage(format!(
            "--grid {n} along {columns} columns makes {points} points, and at most {MOST_POINTS} are allowed; take a coarser grid, or --at"
        ))),
        _ => Ok(()),
    }
}

/// Refuses a robust band for an estimator without one, and options without effect.
fn check_band(arguments: &Arguments, name: EstimatorName) -> Result<(), Usage> {
    use EstimatorName::{Kernel, LocalBandwidth, LocalLinear};
    let kernel = matches!(name, Kernel | LocalLinear | LocalBandwidth);
    if arguments.band_method == BandMethod::Robust && !(kernel && arguments.x.len() == 1) {
        return Err(Usage(
            "--band-method robust is for the estimators kernel, local-linear and local-bandwidth in one column of x; take --band-method bootstrap".to_owned(),
        ));
    }
    let blocks = matches!(arguments.select, Some(Rule::BlockBootstrap { .. }));
    if arguments.block.is_some() && !blocks && arguments.band_method != BandMethod::Block {
        return Err(Usage(
            "--block gives the rows in a block, for --select block-bootstrap or --band-method block; take one of them, or leave it out"
                .to_owned(),
        ));
    }
    if arguments.simultaneous && arguments.band_method == BandMethod::None {
        return Err(Usage(
            "--simultaneous needs a band, and --band-method none makes none; leave one of them out".to_owned(),
        ));
    }
    Ok(())
}

/// The estimator. The default is local bandwidths for one column, unless an option asks for one bandwidth or for refits (these would take
/// long).
fn name(arguments: &Arguments) -> EstimatorName {
    let one = arguments.x.len() > 1
        || arguments.bandwidth.is_some()
        || arguments.parameter.is_some()
        || arguments.select.is_some()
        || matches!(arguments.band_method, BandMethod::Bootstrap | BandMethod::Block);
    arguments.estimator.unwrap_or(match one {
        true => EstimatorName::LocalLinear,
        false => EstimatorName::LocalBandwidth,
    })
}

/// Checks that the columns differ, and that the estimator takes this number of them.
fn check_columns(arguments: &Arguments, name: EstimatorName) -> Result<(), Usage> {
    let Arguments { x, y, weights, .. } = arguments;
    if x.iter().any(String::is_empty) {
        return Err(Usage(format!(
            "--x '{}' names an empty column ''; separate the names by single commas",
            x.join(",")
        )));
    }
    named_once("x", x)?;
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
    let (got, most) = (x.len(), name.most_columns());
    if got > most {
        let others = EstimatorName::ALL.into_iter().filter(|e| e.most_columns() >= got);
        let others: Vec<&str> = others.map(EstimatorName::name).collect();
        let instead = match others.as_slice() {
            [] => "; name fewer columns".to_owned(),
            names => format!("; name fewer, or take --estimator {}", names.join(" or ")),
        };
        let takes = match most {
            1 => "one column".to_owned(),
            _ => format!("at most {most} columns"),
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
fn chosen(arguments: &Arguments, name: EstimatorName) -> Result<Tuning, Usage> {
    let columns = arguments.x.len();
    match tuning::given("--estimator", name, arguments.bandwidth.clone(), arguments.parameter)? {
        Some(values) if values.len() != 1 && values.len() != columns => Err(Usage(format!(
            "--bandwidth gives {} values for {} of x; give one for all, or one a column",
            values.len(),
            counted(columns, "column")
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
            match rule.suits(name, columns) {
                true => Ok(Tuning::FromData(rule)),
                false => Err(unsuited(name, columns, rule)),
            }
        }
    }
}

fn unsuited(name: EstimatorName, columns: usize, rule: Rule) -> Usage {
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
        counted(columns, "column"),
        suited.map(Rule::name).collect::<Vec<_>>().join(", ")
    ))
}
