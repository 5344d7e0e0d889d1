//! The page of a first look at a record: checked, reduced to what is plotted, and put into text.

use serde::Serialize;

use crate::check::{self, increasing, same};
use crate::data::{Fact, LookPage, NextCommand, Table};
use crate::decimate::{head, round, thin};
use crate::limits;
use crate::payload::{RecordPlot, label, record};
use crate::{Error, Result};

/// Everything that is plotted.
#[derive(Serialize)]
pub(crate) struct Payload<'a> {
    record: Option<RecordPlot<'a>>,
    correlations: Vec<Lags<'a>>,
    spectra: Vec<Spectrum<'a>>,
}

#[derive(Serialize)]
struct Lags<'a> {
    lags: Vec<f64>,
    values: Vec<f64>,
    limit: f64,
    level: &'a str,
}

#[derive(Serialize)]
struct Spectrum<'a> {
    x_label: String,
    y_label: &'a str,
    frequency: Vec<f64>,
    density: Vec<f64>,
}

/// What the template shows as text.
#[derive(Serialize)]
pub(crate) struct Text<'a> {
    title: &'a str,
    subtitle: &'a str,
    next: Option<&'a NextCommand>,
    facts: &'a [Fact],
    warnings: &'a [String],
    notes: &'a [String],
    columns: &'a Table,
    dependences: &'a Table,
    /// Title and caption.
    correlations: Vec<[&'a str; 2]>,
    spectra: Vec<&'a str>,
    /// Samples of the record, and samples per bucket where they are decimated.
    record: Option<(String, usize)>,
    command: Option<&'a str>,
    version: &'static str,
}

/// Checks lengths, axes and abscissas; values may be NaN or infinite, they become gaps.
pub(crate) fn check(page: &LookPage) -> Result<()> {
    check::record(&page.record, &page.time)?;
    check::table("columns", &page.columns)?;
    check::table("dependences", &page.dependences)?;
    for (k, plot) in page.correlations.iter().enumerate() {
        increasing(format!("correlations[{k}].lags"), &plot.lags)?;
        same(
            format!("correlations[{k}].values"),
            plot.values.len(),
            plot.lags.len(),
            "lag",
        )?;
    }
    for (k, plot) in page.spectra.iter().enumerate() {
        let part = format!("spectra[{k}].frequency");
        increasing(part.clone(), &plot.frequency)?;
        if let Some(&value) = plot.frequency.first().filter(|f| **f <= 0.0) {
            return Err(Error::NotPositive { part, value });
        }
        same(
            format!("spectra[{k}].density"),
            plot.density.len(),
            plot.frequency.len(),
            "frequency",
        )?;
    }
    Ok(())
}

/// Reduces a checked page to what its plots need.
pub(crate) fn payload(page: &LookPage) -> Payload<'_> {
    let positive = |d: &f64| if *d > 0.0 { round(*d) } else { f64::NAN };
    Payload {
        record: record(&page.record, &page.time, 0),
        correlations: (page.correlations.iter())
            .map(|plot| Lags {
                lags: head(&plot.lags, limits::LAGS),
                values: head(&plot.values, limits::LAGS),
                limit: plot.limit,
                level: &plot.level,
            })
            .collect(),
        spectra: (page.spectra.iter())
            .map(|plot| Spectrum {
                x_label: label("frequency", &page.frequency_unit),
                y_label: &plot.y_label,
                frequency: thin(&plot.frequency, limits::CURVE_POINTS),
                density: thin(&plot.density, limits::CURVE_POINTS).iter().map(positive).collect(),
            })
            .collect(),
    }
}

/// The page's text.
pub(crate) fn text<'a>(page: &'a LookPage, payload: &Payload<'_>) -> Text<'a> {
    let samples = page.record.first().map_or(0, |signal| signal.values.len());
    Text {
        title: &page.title,
        subtitle: &page.subtitle,
        next: page.next.as_ref(),
        facts: &page.facts,
        warnings: &page.warnings,
        notes: &page.notes,
        columns: &page.columns,
        dependences: &page.dependences,
        correlations: page
            .correlations
            .iter()
            .map(|c| [c.title.as_str(), c.caption.as_str()])
            .collect(),
        spectra: page.spectra.iter().map(|s| s.title.as_str()).collect(),
        record: payload
            .record
            .as_ref()
            .map(|plot| (samples.to_string(), plot.time.bucket)),
        command: page.command.as_deref(),
        version: env!("CARGO_PKG_VERSION"),
    }
}
