//! Parts of a regression for reading, which the summary and the page share.

use flexure::nonlinearity::{EstimatorName, LocalBandwidths, Tuning};

use super::{Diagnosis, Regression, Validation};
use crate::plots::extent;
use crate::text::number;

/// The text for local bandwidths that were tried but not used.
pub const FELL_BACK: &str = "not used: they do not predict clearly better than one for all points";

/// Whether local bandwidths were tried and do not predict clearly better than one.
pub fn fell_back(regression: &Regression) -> bool {
    regression.estimator.name == EstimatorName::LocalBandwidth && regression.fit.local.is_none()
}

/// How local bandwidths were chosen.
pub struct LocalRuleText {
    pub name: &'static str,
    /// The reason for them.
    pub why: String,
}

pub fn local_rule(local: &LocalBandwidths) -> LocalRuleText {
    let rms = |error: Option<f64>| error.filter(|e| e.is_finite()).map(|e| number(e.sqrt()));
    let Some(threshold) = local.threshold else {
        return LocalRuleText {
            name: "plugin",
            why: "by the plug-in rule".to_owned(),
        };
    };
    let rule = format!("by Lepski's rule, intervals of {threshold} standard errors");
    let why = match (rms(local.prediction_error), rms(local.prediction_error_of_one)) {
        (Some(own), Some(one)) => format!(
            "{rule}; either half of the rows predicted from the other with RMS error {own}, by one bandwidth {one}"
        ),
        _ => rule,
    };
    LocalRuleText { name: "lepski", why }
}

/// The abscissas of jumps, to enough digits to distinguish them within the data's range.
pub fn places(local: &LocalBandwidths) -> String {
    let [low, high] = extent(local.windows.iter().map(|w| w.x));
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
pub fn local_range(local: &LocalBandwidths) -> String {
    let [least, most] = extent(local.windows.iter().map(|w| w.bandwidth));
    format!("{} to {}", number(least), number(most))
}

/// R squared, with its conditions.
pub fn judged(validation: &Validation, diagnosis: &Diagnosis) -> String {
    let r_squared = validation.r_squared;
    if !r_squared.is_finite() {
        return "not known  (too few rows to predict any of them from the others)".to_owned();
    }
    format!(
        "{r_squared:.4}  ({}; RMS error {})",
        predicted_by(validation, diagnosis),
        number(validation.rms)
    )
}

/// How rows were predicted from the others, and which were not.
pub fn predicted_by(validation: &Validation, diagnosis: &Diagnosis) -> String {
    let (by, unpredicted) = (validation.by, validation.unpredicted);
    let (alone, rows) = (diagnosis.alone, diagnosis.rows.len());
    match (alone, unpredicted) {
        (0, 0) => by.to_owned(),
        (0, _) => format!("{by}, without the {unpredicted} of {rows} rows that could not be predicted"),
        _ => format!("{by}, with {alone} of {rows} rows predicted by their nearest as none is within reach"),
    }
}

/// How the parameter was chosen.
pub fn why(regression: &Regression) -> String {
    match (&regression.estimator.tuning, &regression.fit.scores) {
        (Tuning::Fixed(_), _) => "as given".to_owned(),
        (_, Some(scores)) => scores.smallest(scores.criterion),
        (Tuning::FromData(_), None) => "by the plug-in rule".to_owned(),
    }
}
