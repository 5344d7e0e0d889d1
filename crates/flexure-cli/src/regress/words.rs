//! A regression in words and as JSON.

use flexure::nonlinearity::{EstimatorName, LocalBandwidths, LocalWindow, Side, Tuning};
use serde_json::{Value, json};

use super::Arguments;
use super::data::Data;
use super::estimate::{Estimate, Evaluated, Validation};
use flexure_workbench::text::number;
use flexure_workbench::text::{capitalised, kernel_words, list, scores_json, smallest};

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
        "estimator_asked": estimate.method.name.name(),
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
            json!({
                "rule": local_rule(local).0,
                "threshold": local.threshold,
                "prediction_rms": local.prediction_error.map(f64::sqrt),
                "prediction_rms_of_one_bandwidth": local.prediction_error_of_one.map(f64::sqrt),
                "x": of(|w| w.x), "bandwidth": of(|w| w.bandwidth), "side": sides, "jumps": local.jumps,
            })
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

/// How local bandwidths were chosen: the rule, and what speaks for them.
pub fn local_rule(local: &LocalBandwidths) -> (&'static str, String) {
    let rms = |error: Option<f64>| error.filter(|e| e.is_finite()).map(|e| number(e.sqrt()));
    match (
        local.threshold,
        rms(local.prediction_error),
        rms(local.prediction_error_of_one),
    ) {
        (Some(threshold), Some(local), Some(one)) => (
            "lepski",
            format!(
                "by Lepski's rule, intervals of {threshold} standard errors; either half of the rows predicted from the other with RMS error {local}, \
                 by one bandwidth {one}"
            ),
        ),
        (Some(threshold), ..) => (
            "lepski",
            format!("by Lepski's rule, intervals of {threshold} standard errors"),
        ),
        (None, ..) => ("plugin", "by the plug-in rule".to_owned()),
    }
}

/// Whether local bandwidths were tried and do not predict clearly better than one.
pub fn fell_back(estimate: &Estimate) -> bool {
    estimate.method.name == EstimatorName::LocalBandwidth && estimate.fit.local.is_none()
}

/// What is said where local bandwidths were tried in vain.
pub const FELL_BACK: &str = "not used: they do not predict clearly better than one for all points";

/// The abscissas of jumps, to digits that tell them apart within the data's range.
pub fn places(local: &LocalBandwidths) -> String {
    let windows = local.windows.iter().map(|w| w.x);
    let (low, high) = windows.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (x.min(low), x.max(high))
    });
    let shown: Vec<String> = local.jumps.iter().map(|&x| place(x, high - low)).collect();
    shown.join(", ")
}

/// An abscissa to a ten-thousandth of the range in which it lies.
fn place(x: f64, range: f64) -> String {
    let more = (x.abs() / range).log10().ceil();
    // An abscissa has no more than 17 digits.
    if !(more > 0.0 && more < 14.0) {
        return number(x);
    }
    let digits = 3 + more as usize;
    let rounded: f64 = format!("{x:.digits$e}").parse().unwrap_or(x);
    rounded.to_string()
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
            _ => format!("; jumps at {}", places(local)),
        };
        lines.push(format!(
            "  local bandwidths    {}{jumps}  ({})",
            range(local),
            local_rule(local).1
        ));
    } else if fell_back(estimate) {
        lines.push(format!("  local bandwidths    {FELL_BACK}"));
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
