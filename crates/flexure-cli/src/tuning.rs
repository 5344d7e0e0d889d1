//! An estimator's tuning parameter among the options, and in words.

use flexure::nonlinearity::{EstimatorName, Kernel, Scores};
use flexure_report::data::ScoreCurve;
use serde_json::{Value, json};

use crate::arguments::{Auto, Usage};
use crate::outcome::number;

/// The parameter that was given by `--bandwidth` or by `--parameter`, whichever is the estimator's; `None` if neither was.
/// `option` is what the estimator was chosen by.
pub fn given(
    option: &str,
    name: EstimatorName,
    bandwidth: Auto<Vec<f64>>,
    parameter: Auto<f64>,
) -> Result<Option<Vec<f64>>, Usage> {
    let what = name.parameter();
    match (bandwidth.given(), parameter.given()) {
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
        (bandwidth, parameter) => Ok(bandwidth.or(parameter.map(|p| vec![p]))),
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

/// The kernel for reading, where the estimator has one: between `before` and `after`.
pub fn kernel_words(name: EstimatorName, kernel: Kernel, before: &str, after: &str) -> String {
    match name.has_bandwidth() {
        true => format!("{before}{} kernel{after}", kernel.name()),
        false => String::new(),
    }
}

/// The scores as the page draws them; `x` names the column of x.
pub fn score_curve(name: EstimatorName, scores: &Scores, chosen: &[f64], x: &str) -> ScoreCurve {
    let unit = match (name.has_bandwidth(), chosen.len()) {
        (true, 1) => format!(", in the unit of {x}"),
        (true, _) => ", geometric mean over the columns".to_owned(),
        (false, _) => String::new(),
    };
    let logarithmic = !name.counts() || name == EstimatorName::Neighbours;
    // Zero has no place on a logarithmic axis.
    let kept = || (scores.parameter.iter().zip(&scores.score)).filter(|(p, _)| !logarithmic || **p > 0.0);
    ScoreCurve {
        x_label: format!("{}{unit}", name.parameter()),
        y_label: scores.criterion.to_owned(),
        log_x: logarithmic,
        x: kept().map(|(p, _)| *p).collect(),
        y: kept().map(|(_, s)| *s).collect(),
        chosen: match chosen {
            [one] => *one,
            several => (several.iter().map(|h| h.ln()).sum::<f64>() / several.len() as f64).exp(),
        },
    }
}

/// How the parameter with the smallest score was found.
pub fn smallest(criterion: &str, scores: &Scores) -> String {
    match scores.binning_error {
        None => format!("smallest {criterion}"),
        Some(error) => format!(
            "smallest exact {criterion} among those around the best on data in bins, which is off by at most {} %",
            number(100.0 * error)
        ),
    }
}

/// The scores as JSON.
pub fn scores_json(scores: &Scores) -> Value {
    json!({ "criterion": scores.criterion, "parameter": scores.parameter, "score": scores.score, "at_edge": scores.at_edge,
        "binning_error": scores.binning_error })
}

/// Values of a parameter for reading: whole numbers as they are.
pub fn list(values: &[f64]) -> String {
    let shown = |v: f64| {
        if v.fract() == 0.0 && v.abs() < 1e6 {
            format!("{v}")
        } else {
            number(v)
        }
    };
    values.iter().map(|&v| shown(v)).collect::<Vec<_>>().join(", ")
}

/// With a capital letter at the start.
pub fn capitalised(words: &str) -> String {
    let mut letters = words.chars();
    letters
        .next()
        .map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
