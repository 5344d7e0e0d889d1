//! The study's results.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::fit::{LogSlope, slope};
use super::plan::Experiment;
use super::setting::Setting;
use crate::distributions::normal_quantile;

/// The level of a setting's interval, and the joint level of all verdicts of a table.
pub const LEVEL: f64 = 0.95;

/// A slope may differ from the exponent by this much, in addition to the effect of chance. At finite n terms of higher order (of relative
/// size h, h^2 and 1/(n h)) bend the line, and the intervals of L2 errors are narrow enough to show it.
pub const FINITE_SAMPLES: f64 = 0.01;

/// The error at one number of samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RatePoint {
    /// The number of pairs (X, Y).
    pub n: usize,
    /// The root mean square error over the runs.
    pub rms: f64,
    /// Its Monte Carlo standard error.
    pub standard_error: f64,
    /// The runs that gave an estimate.
    pub runs: usize,
    /// The runs that gave no estimate: at some point no data were within reach.
    pub missing: usize,
}

impl RatePoint {
    /// The point from the runs' mean squared errors.
    pub(super) fn new(n: usize, squared: &[Option<f64>]) -> Self {
        let known: Vec<f64> = squared.iter().flatten().copied().collect();
        let runs = known.len() as f64;
        let mean = known.iter().sum::<f64>() / runs;
        let variance = known.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (runs - 1.0);
        let rms = mean.sqrt();
        RatePoint {
            n,
            rms,
            standard_error: (variance / runs).sqrt() / (2.0 * rms),
            runs: known.len(),
            missing: squared.len() - known.len(),
        }
    }
}

/// One setting's errors, and the comparison of their slope with the theorem's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RateResult<S = Setting> {
    /// The setting.
    pub setting: S,
    /// The errors over n.
    pub points: Vec<RatePoint>,
    /// The slope of log error over log n; NaN with fewer than two points.
    pub slope: f64,
    /// The slope's 95 % interval.
    pub interval: [f64; 2],
    /// The interval at a higher level: with it, the intervals of all settings hold together with 95 %.
    pub joint_interval: [f64; 2],
    /// Whether theory and measurement agree: the theorem's exponent lies within [`FINITE_SAMPLES`] of the joint interval. If the exponent
    /// is only a bound, it may also lie above the interval.
    pub agrees: bool,
}

impl<S: Experiment> RateResult<S> {
    /// `settings` is the number of settings that are judged together.
    pub(super) fn new(setting: S, points: Vec<RatePoint>, settings: usize) -> Self {
        let LogSlope {
            value: slope,
            standard_error: error,
        } = slope(&points).unwrap_or(LogSlope::UNKNOWN);
        let around = |level: f64| {
            let half = normal_quantile(0.5 + 0.5 * level) * error;
            [slope - half, slope + half]
        };
        // Sidak: the settings' runs are independent.
        let joint_interval = around(LEVEL.powf(1.0 / settings.max(1) as f64));
        let exponent = setting.exponent();
        let [low, high] = [joint_interval[0] - FINITE_SAMPLES, joint_interval[1] + FINITE_SAMPLES];
        let agrees = low <= exponent && (exponent <= high || !setting.sharp() && high.is_finite());
        RateResult {
            setting,
            points,
            slope,
            interval: around(LEVEL),
            joint_interval,
            agrees,
        }
    }
}

/// All settings' results.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RateTable<S = Setting> {
    /// In the order of the study's settings.
    pub results: Vec<RateResult<S>>,
}

impl<S> RateTable<S> {
    /// Whether every setting agrees with theory, at 95 % for all settings together.
    pub fn agrees(&self) -> bool {
        self.results.iter().all(|r| r.agrees)
    }
}

impl<S: Experiment> fmt::Display for RateTable<S> {
    /// One line for each setting: slope, 95 % interval, theorem's exponent, verdict, errors at the ends.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<String> = self.results.iter().map(|r| r.setting.name()).collect();
        let width = names.iter().map(String::len).max().unwrap_or(0).max("setting".len());
        writeln!(
            f,
            "{:width$}  {:>7}  {:^18}  {:>8}  {:8}  error (n)",
            "setting", "slope", "95 % interval", "theorem", "verdict"
        )?;
        for (name, r) in names.iter().zip(&self.results) {
            let interval = format!("[{:.3}, {:.3}]", r.interval[0], r.interval[1]);
            let bound = if r.setting.sharp() { "" } else { "<= " };
            let theorem = format!("{bound}{:.3}", r.setting.exponent());
            let verdict = if r.agrees { "agrees" } else { "differs" };
            let ends = match (r.points.first(), r.points.last()) {
                (Some(a), Some(b)) => format!("{:.2e} ({}) to {:.2e} ({})", a.rms, a.n, b.rms, b.n),
                _ => String::new(),
            };
            writeln!(
                f,
                "{name:width$}  {:7.3}  {interval:^18}  {theorem:>8}  {verdict:8}  {ends}",
                r.slope
            )?;
        }
        Ok(())
    }
}
