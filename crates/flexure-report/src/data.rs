//! The content of a page as plain values, to be filled in by the caller.
//!
//! An empty list or `None` leaves its part off the page. A value that is not finite is drawn as a gap. Names with units are written as at
//! an axis, with the unit in parentheses at the end, for example "torque (N m)".

use serde::Serialize;

mod comparison;
mod control;
mod diagram;
mod joint;
mod look;
mod motion;
mod regression;
mod study;
pub use comparison::ComparisonPage;
pub use control::{ControlPage, TipPathPlot};
pub use diagram::{DiagramBlock, Flow, Sketch};
pub use joint::{Comparison, JointCurve, JointPage, ParameterTable};
pub use look::{LagPlot, LookPage, NextCommand, SpectrumPlot};
pub use motion::{ChainMotion, MotionPage};
pub use regression::{RegressionPage, RegressionResiduals, Scatter, Slice, Surface};
pub use study::{RateLine, RatePlot, RateRow, StudyPage, StudySection};

/// Everything on the page of an identification.
#[derive(Debug, Clone, Serialize)]
pub struct Page {
    /// The heading, for example "Elbow joint of the space arm".
    pub title: String,
    /// One sentence below it: what was identified from what.
    pub subtitle: String,
    /// The verdict on fresh data: the answer to "does this model hold?".
    pub verdict: Verdict,
    /// The headline numbers, in order.
    pub facts: Vec<Fact>,
    /// The model as a block diagram.
    pub diagram: Option<Flow>,
    /// The record that was used, decimated by the page where it is long.
    pub record: Vec<Signal>,
    /// Sample times of `record`, s, or sample numbers if there is no sample time.
    pub time: Axis,
    /// Samples of `record` from this index on were not used for the fit.
    pub fresh_from: usize,
    /// The estimated nonlinearity.
    pub nonlinearity: Nonlinearity,
    /// The joint effect of several inputs, or of two lags of one input.
    pub surface: Option<TitledSurface>,
    /// Further nonlinearities, or sections through that of several inputs.
    pub curves: Vec<TitledCurve>,
    /// What the periods of the record show without a model.
    pub approximation: Option<Approximation>,
    /// The linear parts, in the order in which the signal runs through them.
    pub linear: Vec<LinearPart>,
    /// Measured against predicted on the fresh part.
    pub prediction: Prediction,
    /// Residual tests on the fresh part.
    pub residuals: Residuals,
    /// What was chosen from data and why.
    pub choices: Vec<Choice>,
    /// Tables of candidates that were compared, for choices that no curve shows.
    pub candidates: Vec<Table>,
    /// Warnings, one sentence each.
    pub warnings: Vec<String>,
    /// The moving arm, for arm records.
    pub arm: Option<ArmMotion>,
    /// How to make this page again: a command line.
    pub command: Option<String>,
    /// The same in Python.
    pub python: Option<String>,
}

/// The answer to "does the model hold on fresh data?".
#[derive(Debug, Clone, Serialize)]
pub struct Verdict {
    /// The answer in short, for example "The model holds on fresh data".
    pub headline: String,
    /// Whether the residual tests found nothing against the model.
    pub holds: bool,
    /// The answer in a sentence or two, naming the test that refutes the model if one does. A line is a paragraph.
    pub text: String,
    /// The evidence for it in short lines, folded away below the text.
    pub details: Vec<String>,
}

/// A number with its name.
#[derive(Debug, Clone, Serialize)]
pub struct Fact {
    /// For example "Fit on fresh data".
    pub name: String,
    /// For example "97.3 %", ready to print.
    pub value: String,
    /// A short explanation, shown below it.
    pub note: String,
}

impl Fact {
    /// A number, ready to print.
    pub fn new(name: impl Into<String>, value: impl Into<String>, note: impl Into<String>) -> Self {
        Fact {
            name: name.into(),
            value: value.into(),
            note: note.into(),
        }
    }
}

/// An axis: evenly spaced values.
#[derive(Debug, Clone, Serialize)]
pub struct Axis {
    /// For example "time".
    pub name: String,
    /// For example "s"; empty if there is none.
    pub unit: String,
    /// The first value.
    pub start: f64,
    /// The distance between values.
    pub step: f64,
}

impl Axis {
    /// The times of samples from the one of index `first` on; their indices where there is no sample time.
    pub fn of_samples(sample_time: Option<f64>, first: usize) -> Self {
        let (name, unit, step) = match sample_time {
            Some(step) => ("time", "s", step),
            None => ("sample", "", 1.0),
        };
        Axis {
            name: name.to_owned(),
            unit: unit.to_owned(),
            start: first as f64 * step,
            step,
        }
    }
}

/// A named signal.
#[derive(Debug, Clone, Serialize)]
pub struct Signal {
    /// The column's name.
    pub name: String,
    /// The unit, empty if unknown.
    pub unit: String,
    /// Its samples.
    pub values: Vec<f64>,
}

/// The estimated static nonlinearity with its band.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Nonlinearity {
    /// The input's name and unit.
    pub x_label: String,
    /// The output's name and unit.
    pub y_label: String,
    /// Abscissas, increasing.
    pub x: Vec<f64>,
    /// The estimate.
    pub y: Vec<f64>,
    /// The band's lower edge, as long as `x`, or empty.
    pub lower: Vec<f64>,
    /// The band's upper edge, as long as `x`, or empty.
    pub upper: Vec<f64>,
    /// What the band is, for example "95 % pointwise".
    pub band_label: String,
    /// The data's density at `x` (any scale), or empty.
    pub density: Vec<f64>,
    /// The true curve for simulated data, or empty.
    pub truth: Vec<f64>,
    /// What the truth is and how it was aligned.
    pub truth_label: String,
}

/// A surface with its heading.
#[derive(Debug, Clone, Serialize)]
pub struct TitledSurface {
    /// The heading, for example "Joint nonlinearity".
    pub title: String,
    /// A sentence or two below the picture.
    pub text: String,
    /// The surface.
    pub surface: Surface,
}

/// A curve with its heading.
#[derive(Debug, Clone, Serialize)]
pub struct TitledCurve {
    /// The heading, for example "From 'b'".
    pub title: String,
    /// The curve.
    pub curve: Nonlinearity,
}

/// The best linear approximation over the excited frequencies, with the levels of its disturbances.
#[derive(Debug, Clone, Serialize)]
pub struct Approximation {
    /// What it was measured from, and what it shows: a sentence or two.
    pub text: String,
    /// Frequencies, increasing and positive: Hz, or cycles a sample if there is no sample time.
    pub frequency: Vec<f64>,
    /// "Hz" or "cycles/sample".
    pub frequency_unit: String,
    /// The response's magnitude, dB.
    pub magnitude_db: Vec<f64>,
    /// Its phase, degrees, unwrapped.
    pub phase_deg: Vec<f64>,
    /// The level of noise and nonlinear distortion together, dB, or empty.
    pub total_db: Vec<f64>,
    /// The level of noise, dB, or empty.
    pub noise_db: Vec<f64>,
    /// The level of nonlinear distortion, dB, or empty; minus infinity where the noise hides it.
    pub distortion_db: Vec<f64>,
}

/// A linear part.
#[derive(Debug, Clone, Default, Serialize)]
pub struct LinearPart {
    /// The heading, for example "Linear part".
    pub title: String,
    /// The text next to the transfer function, for example "Order 3, static gain 1."; may be empty.
    pub text: String,
    /// Numerator in z^-1.
    pub b: Vec<f64>,
    /// Denominator in z^-1.
    pub a: Vec<f64>,
    /// The time between two samples, s, if it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample_time: Option<f64>,
    /// Impulse response of the fitted transfer function, one value per sample.
    pub impulse: Vec<f64>,
    /// The unit of the impulse and the step response: the unit of the block's output over that of its input. It may be empty.
    pub response_unit: String,
    /// The correlation estimate of the impulse response that it was fitted to, or empty.
    pub impulse_estimate: Vec<f64>,
    /// Half width of the limits within which `impulse_estimate` is noise; 0 if unknown.
    pub impulse_limit: f64,
    /// Frequencies, increasing: Hz, or cycles a sample if there is no sample time. One of 0 is not drawn.
    pub frequency: Vec<f64>,
    /// "Hz" or "cycles/sample".
    pub frequency_unit: String,
    /// Magnitude, dB.
    pub magnitude_db: Vec<f64>,
    /// Phase, degrees, unwrapped.
    pub phase_deg: Vec<f64>,
    /// Half width of the magnitude's 95 % band, dB, pointwise; empty where it is not known.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub magnitude_error: Vec<f64>,
    /// Half width of the phase's band, degrees, or empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub phase_error: Vec<f64>,
    /// Poles `[re, im]`.
    pub poles: Vec<[f64; 2]>,
    /// The covariance `[re re, re im, im im]` of every pole, as many as `poles`, NaN where it is not known; or empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pole_covariances: Vec<[f64; 3]>,
    /// Zeros `[re, im]`.
    pub zeros: Vec<[f64; 2]>,
}

/// Measured against predicted on the fresh part.
#[derive(Debug, Clone, Serialize)]
pub struct Prediction {
    /// The output's name and unit.
    pub y_label: String,
    /// Times of the fresh part.
    pub time: Axis,
    /// Measured.
    pub measured: Vec<f64>,
    /// Free-run simulation of the model.
    pub predicted: Vec<f64>,
    /// 100 (1 - |y - yh| / |y - mean y|).
    pub fit_percent: f64,
    /// Root mean square of the error, in the output's unit.
    pub rms: f64,
}

/// Residual tests.
#[derive(Debug, Clone, Serialize)]
pub struct Residuals {
    /// Residual autocorrelation, normalised to 1 at lag 0, at lags 0, 1, ...
    pub autocorrelation: Vec<f64>,
    /// Normalised cross-correlation of residual and input, one value for each of `cross_lags`; at lag k, the residual is
    /// taken k samples after the input.
    pub cross_correlation: Vec<f64>,
    /// Lags of `cross_correlation`, in samples, increasing.
    pub cross_lags: Vec<f64>,
    /// Half width of the limits for a single lag of `autocorrelation`.
    pub limit: f64,
    /// The same of `cross_correlation`.
    pub cross_limit: f64,
    /// "99 %", the level of those limits.
    pub level: String,
    /// The tests with their verdicts.
    pub tests: Vec<Test>,
}

/// A statistical test and its verdict.
#[derive(Debug, Clone, Serialize)]
pub struct Test {
    /// For example "Whiteness (Ljung-Box, 25 lags)".
    pub name: String,
    /// The statistic.
    pub statistic: f64,
    /// Its critical value.
    pub limit: f64,
    /// Its p-value.
    pub p_value: f64,
    /// What it says about the model.
    pub outcome: TestOutcome,
    /// The verdict for reading.
    pub text: String,
}

/// What a test says about a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TestOutcome {
    /// The test found nothing.
    Passed,
    /// It refutes the model.
    Failed,
    /// The error is coloured (not white); this does not refute the model.
    Coloured,
    /// The test detects a misfit, but a negligible one.
    Negligible,
}

/// Something that was chosen from data.
#[derive(Debug, Clone, Serialize)]
pub struct Choice {
    /// For example "Bandwidth".
    pub name: String,
    /// For example "h = 0.083".
    pub value: String,
    /// Why: the criterion for reading.
    pub why: String,
    /// The criterion's curve, if there is one.
    pub curve: Option<ScoreCurve>,
}

impl Choice {
    /// A choice without a curve.
    pub fn new(name: impl Into<String>, value: impl Into<String>, why: impl Into<String>) -> Self {
        Choice {
            name: name.into(),
            value: value.into(),
            why: why.into(),
            curve: None,
        }
    }
}

/// A score over candidates.
#[derive(Debug, Clone, Serialize)]
pub struct ScoreCurve {
    /// The candidates' name.
    pub x_label: String,
    /// The score's name.
    pub y_label: String,
    /// Whether the candidates are spread logarithmically.
    pub log_x: bool,
    /// The candidates, increasing; positive if `log_x`.
    pub x: Vec<f64>,
    /// Their scores.
    pub y: Vec<f64>,
    /// The chosen candidate.
    pub chosen: f64,
}

/// A table of candidates.
#[derive(Debug, Clone, Serialize)]
pub struct Table {
    /// The heading, for example "Structures that were tried".
    pub title: String,
    /// A sentence or two below it: what was compared, and by what.
    pub text: String,
    /// The columns' names; all except the first are set as numbers.
    pub columns: Vec<String>,
    /// The rows, each with as many cells as there are columns, ready to print.
    pub rows: Vec<Vec<String>>,
    /// The row that was chosen, marked.
    pub chosen: Option<usize>,
    /// Whether the last column is text too, and set as such.
    pub ends_in_text: bool,
}

/// A two-link arm in motion.
#[derive(Debug, Clone, Serialize)]
pub struct ArmMotion {
    /// One sentence: which motion this is.
    pub caption: String,
    /// The links' lengths, m.
    pub lengths: [f64; 2],
    /// Sample times.
    pub time: Axis,
    /// Link angles, rad; the second is relative to the first link.
    pub q: [Vec<f64>; 2],
    /// Motor angles, rad, or empty for a rigid arm.
    pub qm: [Vec<f64>; 2],
    /// Torques, N m.
    pub tau: [Vec<f64>; 2],
}
