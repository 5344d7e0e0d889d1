//! The text of a regression's page, as its template reads it.

use serde::Serialize;

use super::payload::Payload;
use crate::data::{Fact, RegressionPage};
use crate::text::{ChoiceText, choices};

/// What the template shows as text, and which parts exist at all.
#[derive(Serialize)]
pub(crate) struct Text<'a> {
    title: &'a str,
    subtitle: &'a str,
    facts: &'a [Fact],
    warnings: &'a [String],
    curve: Option<CurveText<'a>>,
    surface: bool,
    slices: Vec<&'a str>,
    residuals: Option<ResidualText<'a>>,
    distribution: bool,
    choices: Vec<ChoiceText<'a>>,
    command: Option<&'a str>,
    version: &'static str,
}

#[derive(Serialize)]
struct CurveText<'a> {
    band: Option<&'a str>,
    truth: Option<&'a str>,
    /// How many points lie outside the picture, for reading.
    outside: Option<String>,
    counted: bool,
}

#[derive(Serialize)]
struct ResidualText<'a> {
    over: &'a str,
    outside: Option<String>,
    beyond: Option<String>,
}

/// The page's text; `payload` says which plots there will be.
pub(crate) fn text<'a>(page: &'a RegressionPage, payload: &Payload<'_>) -> Text<'a> {
    let curve = &page.curve;
    Text {
        title: &page.title,
        subtitle: &page.subtitle,
        facts: &page.facts,
        warnings: &page.warnings,
        curve: payload.curve.as_ref().map(|_| CurveText {
            band: (!curve.lower.is_empty()).then_some(curve.band_label.as_str()),
            truth: (!curve.truth.is_empty()).then_some(curve.truth_label.as_str()),
            outside: payload.points.as_ref().and_then(|cloud| points(cloud.outside)),
            counted: payload.points.as_ref().is_some_and(|cloud| cloud.counted()),
        }),
        surface: payload.surface.is_some(),
        slices: page.slices.iter().map(|slice| slice.at.as_str()).collect(),
        residuals: payload.residuals.as_ref().map(|plot| ResidualText {
            over: &page.residuals.x_label,
            outside: points(plot.points.outside),
            beyond: payload.distribution.as_ref().and_then(|h| points(h.outside)),
        }),
        distribution: payload.distribution.is_some(),
        choices: choices(&page.choices, &payload.scores),
        command: page.command.as_deref(),
        version: env!("CARGO_PKG_VERSION"),
    }
}

/// The number of points outside a picture, as text; `None` for none.
fn points(outside: usize) -> Option<String> {
    match outside {
        0 => None,
        1 => Some("1 point lies".to_owned()),
        n => Some(format!("{n} points lie")),
    }
}
