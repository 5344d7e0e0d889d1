//! A regression in words and as JSON.

use serde_json::{Value, json};

use super::data::Data;
use super::estimate::{Estimate, Evaluated};
use super::{Arguments, Outside};
use crate::outcome::number;
use crate::tuning::{capitalised, kernel_words, list, scores_json};

/// Fewer rows tell nothing of the residuals' dependence.
const FEWEST_FOR_DEPENDENCE: usize = 50;
/// The two-sided 99 % quantile of the normal distribution.
const SIGNIFICANT: f64 = 2.575_829_303_548_901;
/// A correlation below this does no harm however significant it is.
const HARMFUL: f64 = 0.1;

/// What the user should know before trusting the result.
pub fn warnings(estimate: &Estimate, data: &Data, curve: &Evaluated, arguments: &Arguments) -> Vec<String> {
    let mut warnings = Vec::new();
    let (name, parameter) = (estimate.fit.name, estimate.fit.name.parameter());
    if estimate.fit.scores.as_ref().is_some_and(|scores| scores.at_edge) {
        warnings.push(format!(
            "the score is smallest at the edge of the values tried ({parameter} {}): the regression is {}",
            list(&estimate.fit.parameter),
            if name.has_bandwidth() {
                "nearly straight or constant, or rougher than the data resolve"
            } else {
                "rougher than the values tried resolve"
            },
        ));
    }
    if let Some(r) = dependence(estimate).filter(|_| !estimate.given()) {
        warnings.push(format!(
            "the residuals of neighbouring rows are correlated ({r:.2}), as in a record in order of time: leave-one-out may then follow the noise \
             (undersmooth), and the band is too narrow; --select block allows for it"
        ));
    }
    let unknown = curve.y.iter().filter(|v| v.is_nan()).count();
    if unknown > 0 {
        let where_to = match (arguments.outside, &arguments.at) {
            (Outside::Nan, Some(_)) => "; --outside nearest or --outside linear continues the estimate beyond the data",
            _ => "",
        };
        warnings.push(format!(
            "at {unknown} of the {} points of the result there are no data within reach: the estimate there is NaN{where_to}",
            curve.y.len()
        ));
    }
    if estimate.band.is_none() {
        warnings.push(format!(
            "there is no confidence band for --estimator {name}: lower and upper are NaN"
        ));
    }
    if data.x.len() == 1 {
        let levels = distinct(data, 10);
        if levels < 10 && estimate.rows.len() > 10 * levels {
            warnings.push(format!(
                "column '{}' has only {levels} levels: between them the estimate rests on the estimator's shape, not on data",
                data.names[0]
            ));
        }
    }
    warnings
}

/// The number of distinct values of the first column, counted up to `most`.
fn distinct(data: &Data, most: usize) -> usize {
    let mut found: Vec<f64> = Vec::new();
    for i in data.rows() {
        let value = data.x[0][i];
        if !found.contains(&value) {
            found.push(value);
        }
        if found.len() == most {
            break;
        }
    }
    found.len()
}

/// The correlation of the residuals of neighbouring rows, where it is significant and positive.
pub fn dependence(estimate: &Estimate) -> Option<f64> {
    let residuals: Vec<f64> = estimate.residuals.iter().copied().filter(|r| r.is_finite()).collect();
    let n = residuals.len();
    if n < FEWEST_FOR_DEPENDENCE {
        return None;
    }
    let mean = residuals.iter().sum::<f64>() / n as f64;
    let squares: f64 = residuals.iter().map(|r| (r - mean).powi(2)).sum();
    let products: f64 = residuals.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum();
    let r = products / squares;
    (r > HARMFUL && r * (n as f64).sqrt() > SIGNIFICANT).then_some(r)
}

/// The object that `--json` prints.
pub fn json(estimate: &Estimate, data: &Data, curve: &Evaluated, warnings: &[String], arguments: &Arguments) -> Value {
    let fit = &estimate.fit;
    let columns: Vec<Value> = data
        .names
        .iter()
        .zip(&curve.x)
        .map(|(name, x)| json!({ "name": name, "values": x }))
        .collect();
    let shown = |path: &Option<std::path::PathBuf>| path.as_ref().map(|p| p.display().to_string());
    json!({
        "x": data.names,
        "y": data.y_name,
        "weights": arguments.weights,
        "samples": estimate.rows.len(),
        "estimator": fit.name.name(),
        "kernel": fit.name.has_bandwidth().then(|| estimate.method.kernel.name()),
        "parameter": fit.name.parameter(),
        "value": fit.parameter,
        "chosen_by": fit.scores.as_ref().map(|s| s.criterion),
        "scores": fit.scores.as_ref().map(scores_json),
        "band": estimate.band.as_ref().map(|kind| json!({ "level": estimate.level, "kind": kind })),
        "residual_sd": estimate.residual_sd,
        "r_squared": estimate.validation.r_squared,
        "prediction_rms": estimate.validation.rms,
        "validation": estimate.validation.by,
        "residual_correlation": dependence(estimate),
        "curve": { "x": columns, "y": curve.y, "lower": curve.lower, "upper": curve.upper },
        "out": shown(&arguments.out),
        "report": shown(&arguments.report),
        "warnings": warnings,
    })
}

/// A short account for a terminal.
pub fn summary(estimate: &Estimate, data: &Data, warnings: &[String]) -> String {
    let fit = &estimate.fit;
    let validation = &estimate.validation;
    let kernel = kernel_words(fit.name, estimate.method.kernel, ", ", "");
    let why = fit.scores.as_ref().map_or("as given", |s| s.criterion);
    let mut lines = vec![
        format!(
            "{} of '{}' on '{}'{kernel}",
            capitalised(fit.name.title()),
            data.y_name,
            data.names.join("', '")
        ),
        format!("  {:<19} {}  ({why})", fit.name.parameter(), list(&fit.parameter)),
        format!(
            "  R squared           {:.4}  ({}; RMS error {})",
            validation.r_squared,
            validation.by,
            number(validation.rms)
        ),
        format!(
            "  residuals           standard deviation {}, {} rows",
            number(estimate.residual_sd),
            estimate.rows.len()
        ),
    ];
    if let Some(kind) = &estimate.band {
        lines.push(format!("  band                {} %, {kind}", percent(estimate.level)));
    }
    lines.extend(warnings.iter().map(|w| format!("  warning: {w}")));
    lines.join("\n")
}

/// A level in percent.
pub fn percent(level: f64) -> String {
    let rounded = (level * 1e4).round() / 1e2;
    rounded.to_string()
}
