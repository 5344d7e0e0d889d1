//! What the page of a first look at a record shows.

use serde::Serialize;

use super::{Axis, Fact, Signal, Table};

/// Everything on the page of a first look at a record.
#[derive(Debug, Clone, Serialize)]
pub struct LookPage {
    /// The heading: the record's name.
    pub title: String,
    /// One sentence below it.
    pub subtitle: String,
    /// The command to type next, if there is one.
    pub next: Option<NextCommand>,
    /// The headline numbers, in order.
    pub facts: Vec<Fact>,
    /// What may spoil an identification, one sentence each.
    pub warnings: Vec<String>,
    /// What else is worth knowing, one sentence each.
    pub notes: Vec<String>,
    /// Range, mean and power of the columns.
    pub columns: Table,
    /// All signals, decimated by the page where they are long.
    pub record: Vec<Signal>,
    /// Their sample times, s, or sample numbers.
    pub time: Axis,
    /// Which column depends on which.
    pub dependences: Table,
    /// The correlations of the dependences that are drawn.
    pub correlations: Vec<LagPlot>,
    /// The power spectra of the signals.
    pub spectra: Vec<SpectrumPlot>,
    /// "Hz" or "cycles/sample".
    pub frequency_unit: String,
    /// How to make this page again: a command line.
    pub command: Option<String>,
}

/// The command to type next.
#[derive(Debug, Clone, Serialize)]
pub struct NextCommand {
    /// As it can be typed.
    pub command: String,
    /// Why this one.
    pub why: String,
    /// What to know before, one sentence each.
    pub notes: Vec<String>,
}

/// Correlations over lags.
#[derive(Debug, Clone, Serialize)]
pub struct LagPlot {
    /// For example "y after u".
    pub title: String,
    /// A sentence below it.
    pub caption: String,
    /// Lags, increasing.
    pub lags: Vec<f64>,
    /// A correlation for each.
    pub values: Vec<f64>,
    /// Half the width of the range of independent signals.
    pub limit: f64,
    /// Its level, for example "99 %".
    pub level: String,
}

/// The power spectrum of a signal.
#[derive(Debug, Clone, Serialize)]
pub struct SpectrumPlot {
    /// The signal's name.
    pub title: String,
    /// The density's name and unit.
    pub y_label: String,
    /// Frequencies, positive and increasing.
    pub frequency: Vec<f64>,
    /// The density at each. A value that is not positive is a gap.
    pub density: Vec<f64>,
}
