//! What the page of a convergence study shows.

use serde::Serialize;

use super::{Fact, Verdict};

/// Everything on the page of a convergence study.
#[derive(Debug, Clone, Serialize)]
pub struct StudyPage {
    /// The heading, for example "Convergence rates".
    pub title: String,
    /// One sentence below it: what was measured.
    pub subtitle: String,
    /// Whether theory and measurement agree.
    pub verdict: Verdict,
    /// The headline numbers, in order.
    pub facts: Vec<Fact>,
    /// Warnings, one sentence each.
    pub warnings: Vec<String>,
    /// The parts of the study.
    pub sections: Vec<StudySection>,
    /// How to make this page again: a command line.
    pub command: Option<String>,
}

/// One part of the study: plots above a table.
#[derive(Debug, Clone, Serialize)]
pub struct StudySection {
    /// The heading, for example "Refined identification".
    pub heading: String,
    /// Its name in the page's navigation.
    pub short: String,
    /// What was measured, and which theory it is compared with.
    pub lead: String,
    /// Errors over n.
    pub plots: Vec<RatePlot>,
    /// The slopes.
    pub rows: Vec<RateRow>,
}

/// Errors over the number of samples, both axes logarithmic.
#[derive(Debug, Clone, Serialize)]
pub struct RatePlot {
    /// The heading, for example "|x|".
    pub title: String,
    /// The error's name, for example "root mean square error at 0".
    pub y_label: String,
    /// The numbers of samples, positive and increasing.
    pub n: Vec<f64>,
    /// What was measured, at most eight lines.
    pub lines: Vec<RateLine>,
    /// Theory's slopes, dashed.
    pub guides: Vec<RateLine>,
}

/// One line of a [`RatePlot`].
#[derive(Debug, Clone, Serialize)]
pub struct RateLine {
    /// Its name in the legend.
    pub name: String,
    /// The error at each n; NaN where there is none.
    pub error: Vec<f64>,
}

/// One line of the table: a measured slope and the theory's exponent.
#[derive(Debug, Clone, Serialize)]
pub struct RateRow {
    /// What was measured.
    pub name: String,
    /// The slope, ready to print.
    pub slope: String,
    /// Its 95 % interval, ready to print.
    pub interval: String,
    /// Theory's exponent, ready to print, with "at most" before it where it is a bound.
    pub theory: String,
    /// Whether they agree.
    pub agrees: bool,
    /// The errors at the smallest and the largest n, ready to print.
    pub errors: String,
}
