//! The page of several models on one record: checked, reduced to what is plotted, and put into text.

use serde::Serialize;

use crate::Result;
use crate::check;
use crate::data::{ComparisonPage, Table};
use crate::joint::{MotionText, motion_plot, motion_text};
use crate::payload::PredictionPlot;

/// Everything that is plotted.
#[derive(Serialize)]
pub(crate) struct Payload<'a> {
    motions: Vec<PredictionPlot<'a>>,
    /// Whether the errors share a scale.
    same_scale: bool,
}

/// What the template shows as text.
#[derive(Serialize)]
pub(crate) struct Text<'a> {
    title: &'a str,
    subtitle: &'a str,
    tables: [&'a Table; 1],
    motions: Vec<MotionText<'a>>,
    command: Option<&'a str>,
    version: &'static str,
}

/// Checks lengths; values may be NaN or infinite, they become gaps.
pub(crate) fn check(page: &ComparisonPage) -> Result<()> {
    for (k, run) in page.runs.iter().enumerate() {
        check::prediction(&format!("runs[{k}].prediction"), &run.prediction)?;
    }
    Ok(())
}

/// Reduces a checked page to what its plots need.
pub(crate) fn payload(page: &ComparisonPage) -> Payload<'_> {
    Payload {
        motions: page.runs.iter().map(motion_plot).collect(),
        same_scale: true,
    }
}

/// The page's text.
pub(crate) fn text<'a>(page: &'a ComparisonPage, payload: &Payload<'_>) -> Text<'a> {
    let runs = page.runs.iter().zip(&payload.motions);
    Text {
        title: &page.title,
        subtitle: &page.subtitle,
        tables: [&page.table],
        motions: runs.map(|(run, plot)| motion_text(run, plot)).collect(),
        command: page.command.as_deref(),
        version: env!("CARGO_PKG_VERSION"),
    }
}
