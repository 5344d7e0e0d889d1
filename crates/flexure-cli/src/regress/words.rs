//! A regression in words and as JSON.

use flexure::nonlinearity::{EstimatorName, LocalBandwidths, LocalWindow, Side, Tuning};
use serde_json::{Value, json};

use super::band::{BandMethod, FEWEST};
use super::data::Data;
use super::estimate::{Estimate, Evaluated, Validation};
use super::{Arguments, Outside};
use crate::outcome::number;
use crate::tuning::{capitalised, kernel_words, list, scores_json, smallest};

/// With a larger share of rows alone in their windows the user is warned.
const MANY_ALONE: f64 = 0.05;

/// Columns whose extent is this share of the bandwidth have no slope in a local fit.
const FLAT: f64 = 1e-8;

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
    if name == EstimatorName::LocalLinear && (0..data.x.len()).all(|j| fit_is_constant(estimate, data, j)) {
        warnings.push(
            "the bandwidth is so much wider than the data that no slope can be told: the fit is constant; take a bandwidth of the data's size"
                .to_owned(),
        );
    }
    let blocks = matches!(estimate.method.tuning, Tuning::FromData(rule) if rule.in_time());
    if estimate.dependent && !blocks {
        warnings.push(
            "neighbouring rows are correlated beyond what is estimated, as in a record in order of time: leave-one-out may then follow the \
             noise (undersmooth), and a band for independent rows is too narrow; --select block allows for it"
                .to_owned(),
        );
    }
    let (alone, rows) = (estimate.validation.alone, estimate.rows.len());
    if alone as f64 > MANY_ALONE * rows as f64 {
        warnings.push(format!(
            "no other row is within reach of {alone} of the {rows} rows: R squared counts them as predicted by their nearest rows, and the \
             curve is not known between them; take a wider bandwidth"
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
    let bare = curve
        .y
        .iter()
        .zip(&curve.lower)
        .filter(|(y, l)| y.is_finite() && l.is_nan())
        .count();
    if bare > 0 && curve.band.is_some() {
        warnings.push(format!(
            "at {bare} of the {} points of the result the band is NaN: the estimate is continued there, or too few data are within reach",
            curve.y.len()
        ));
    }
    if curve.band.is_none() && arguments.band_method == BandMethod::Auto && rows < FEWEST {
        warnings.push(format!("no band was made, as it needs {FEWEST} rows or more"));
    } else if curve.band.is_none() && arguments.band_method == BandMethod::Auto {
        warnings.push(format!(
            "no band was made, as --estimator {name} would have to be fitted to these {} rows many times over; --band-method bootstrap does",
            estimate.rows.len()
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

/// Whether the bandwidth of a local line is out of all proportion to the values of column `j`.
fn fit_is_constant(estimate: &Estimate, data: &Data, j: usize) -> bool {
    let parameter = &estimate.fit.parameter;
    let Some(h) = parameter.get(j).or(parameter.first()) else {
        return false;
    };
    let (low, high) = (estimate.rows.iter().map(|&i| data.x[j][i]))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (x.min(low), x.max(high))
        });
    high > low && h * FLAT > high - low
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
        "chosen_by": match estimate.method.tuning {
            Tuning::FromData(rule) => Some(rule.name()),
            Tuning::Fixed(_) => None,
        },
        "scores": fit.scores.as_ref().map(scores_json),
        "band": curve.band.as_ref().map(|band| json!({ "level": band.level, "kind": band.kind, "method": band.method })),
        "local_bandwidths": fit.local.as_ref().map(|local| {
            let of = |value: fn(&LocalWindow) -> f64| local.windows.iter().map(value).collect::<Vec<_>>();
            let sides: Vec<&str> = local.windows.iter().map(|w| side(w.side)).collect();
            json!({ "x": of(|w| w.x), "bandwidth": of(|w| w.bandwidth), "side": sides, "jumps": local.jumps })
        }),
        "residual_sd": estimate.residual_sd,
        "r_squared": estimate.validation.r_squared,
        "prediction_rms": estimate.validation.rms,
        "validation": estimate.validation.by,
        "rows_alone": estimate.validation.alone,
        "rows_not_predicted": estimate.validation.unpredicted,
        "dependent_rows": estimate.dependent,
        "curve": { "x": columns, "y": curve.y, "lower": curve.lower, "upper": curve.upper },
        "out": shown(&arguments.out),
        "report": shown(&arguments.report),
        "warnings": warnings,
    })
}

/// The side of a point to which its window reaches.
fn side(side: Side) -> &'static str {
    match side {
        Side::Left => "left",
        Side::Both => "both",
        Side::Right => "right",
    }
}

/// The narrowest and the widest of local bandwidths.
pub fn range(local: &LocalBandwidths) -> String {
    let bandwidths = || local.windows.iter().map(|w| w.bandwidth);
    let (least, most) = (
        bandwidths().fold(f64::INFINITY, f64::min),
        bandwidths().fold(0.0, f64::max),
    );
    format!("{} to {}", number(least), number(most))
}

/// A short account for a terminal.
pub fn summary(estimate: &Estimate, data: &Data, curve: &Evaluated, warnings: &[String]) -> String {
    let fit = &estimate.fit;
    let validation = &estimate.validation;
    let kernel = kernel_words(fit.name, estimate.method.kernel, ", ", "");
    let why = why(estimate);
    let mut lines = vec![
        format!(
            "{} of '{}' on '{}'{kernel}",
            capitalised(fit.name.title()),
            data.y_name,
            data.names.join("', '")
        ),
        format!("  {:<19} {}  ({why})", fit.name.parameter(), list(&fit.parameter)),
    ];
    if let Some(local) = &fit.local {
        let jumps = match local.jumps.as_slice() {
            [] => String::new(),
            jumps => format!(
                "; jumps at {}",
                jumps.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", ")
            ),
        };
        lines.push(format!("  local bandwidths    {}{jumps}", range(local)));
    }
    lines.extend([
        format!("  R squared           {}", judged(validation)),
        format!(
            "  residuals           standard deviation {}, {} rows",
            number(estimate.residual_sd),
            estimate.rows.len()
        ),
    ]);
    if let Some(band) = &curve.band {
        lines.push(format!(
            "  band                {} %, {}{}",
            percent(band.level),
            band.kind,
            band.of
        ));
    }
    lines.extend(warnings.iter().map(|w| format!("  warning: {w}")));
    lines.join("\n")
}

/// R squared with what has to be known with it.
fn judged(validation: &Validation) -> String {
    let Validation { r_squared, rms, .. } = validation;
    if !r_squared.is_finite() {
        return "not known  (too few rows to predict any of them from the others)".to_owned();
    }
    format!(
        "{r_squared:.4}  ({}; RMS error {})",
        predicted_by(validation),
        number(*rms)
    )
}

/// How rows were predicted from the others, and which were not.
pub fn predicted_by(validation: &Validation) -> String {
    let Validation {
        by,
        alone,
        unpredicted,
        rows,
        ..
    } = validation;
    match (alone, unpredicted) {
        (0, 0) => (*by).to_owned(),
        (0, _) => format!("{by}, without the {unpredicted} of {rows} rows that could not be predicted"),
        _ => format!("{by}, with {alone} of {rows} rows predicted by their nearest as none is within reach"),
    }
}

/// How the parameter was chosen.
pub fn why(estimate: &Estimate) -> String {
    match (&estimate.method.tuning, &estimate.fit.scores) {
        (Tuning::Fixed(_), _) => "as given".to_owned(),
        (_, Some(scores)) => smallest(scores.criterion, scores),
        (Tuning::FromData(_), None) => "by the plug-in rule".to_owned(),
    }
}

/// A level in percent.
pub fn percent(level: f64) -> String {
    let rounded = (level * 1e4).round() / 1e2;
    rounded.to_string()
}
