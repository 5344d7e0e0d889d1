//! Numbers and parameters of estimators as text.

use flexure::nonlinearity::{EstimatorName, Kernel, Scores};
use flexure_report::data::ScoreCurve;
use serde_json::{Value, json};

/// A number to four digits, without an exponent where it is of everyday size.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (1e-3..1e5).contains(&size) {
        let rounded = format!("{size:.3e}").parse().unwrap_or(size);
        let decimals = if size == 0.0 {
            0
        } else {
            (3 - f64::log10(rounded).floor() as i32).max(0) as usize
        };
        format!("{value:.decimals$}")
    } else {
        format!("{value:.3e}")
    }
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

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_are_short() {
        let shown = [0.0, 0.17391, 0.99999, 2.15, 1234.6, -99999.0, 1e-4, 2.5e7].map(number);
        assert_eq!(
            shown,
            ["0", "0.1739", "1.000", "2.150", "1235", "-99999", "1.000e-4", "2.500e7"]
        );
    }
}
