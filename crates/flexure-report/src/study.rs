//! The page of a convergence study: checked, and reduced to what is plotted.

use serde::Serialize;

use crate::check::{increasing, same};
use crate::data::{Fact, RateLine, RatePlot, RateRow, StudyPage, Verdict};
use crate::decimate::round;
use crate::{Error, Result};

/// Everything that is plotted, in the order of the page.
#[derive(Serialize)]
pub(crate) struct Payload<'a> {
    plots: Vec<Plot<'a>>,
}

#[derive(Serialize)]
struct Plot<'a> {
    y_label: &'a str,
    n: &'a [f64],
    lines: Vec<Line<'a>>,
    guides: Vec<Line<'a>>,
}

#[derive(Serialize)]
struct Line<'a> {
    name: &'a str,
    error: Vec<f64>,
}

/// What the template shows as text.
#[derive(Serialize)]
pub(crate) struct Text<'a> {
    title: &'a str,
    subtitle: &'a str,
    verdict: &'a Verdict,
    facts: &'a [Fact],
    warnings: &'a [String],
    sections: Vec<PagePart<'a>>,
    command: Option<&'a str>,
    version: &'static str,
}

#[derive(Serialize)]
struct PagePart<'a> {
    heading: &'a str,
    short: &'a str,
    lead: &'a str,
    /// The plots' headings and their places in the payload.
    plots: Vec<(&'a str, usize)>,
    rows: &'a [RateRow],
}

/// Checks lengths and abscissas.
pub(crate) fn check(page: &StudyPage) -> Result<()> {
    for (s, section) in page.sections.iter().enumerate() {
        for (p, plot) in section.plots.iter().enumerate() {
            let part = format!("sections[{s}].plots[{p}]");
            increasing(format!("{part}.n"), &plot.n)?;
            if let Some(&value) = plot.n.first().filter(|n| **n <= 0.0) {
                let part = format!("{part}.n");
                return Err(Error::NotPositive { part, value });
            }
            for (k, line) in plot.lines.iter().chain(&plot.guides).enumerate() {
                let part = format!("{part}.line {k}");
                same(part, line.error.len(), plot.n.len(), "number of samples")?;
            }
        }
    }
    Ok(())
}

/// The numbers behind the plots.
pub(crate) fn payload(page: &StudyPage) -> Payload<'_> {
    let plots = page.sections.iter().flat_map(|section| &section.plots);
    Payload {
        plots: plots.map(plot).collect(),
    }
}

fn plot(plot: &RatePlot) -> Plot<'_> {
    Plot {
        y_label: &plot.y_label,
        n: &plot.n,
        lines: plot.lines.iter().map(line).collect(),
        guides: plot.guides.iter().map(line).collect(),
    }
}

/// An error that is not positive has no place on a logarithmic axis and becomes a gap.
fn line(line: &RateLine) -> Line<'_> {
    let errors = line.error.iter();
    Line {
        name: &line.name,
        error: errors.map(|&e| if e > 0.0 { round(e) } else { f64::NAN }).collect(),
    }
}

/// The page's text.
pub(crate) fn text(page: &StudyPage) -> Text<'_> {
    let mut before = 0;
    let sections = page.sections.iter().map(|section| {
        let first = before;
        before += section.plots.len();
        PagePart {
            heading: &section.heading,
            short: &section.short,
            lead: &section.lead,
            plots: section
                .plots
                .iter()
                .enumerate()
                .map(|(k, plot)| (plot.title.as_str(), first + k))
                .collect(),
            rows: &section.rows,
        }
    });
    Text {
        title: &page.title,
        subtitle: &page.subtitle,
        verdict: &page.verdict,
        facts: &page.facts,
        warnings: &page.warnings,
        sections: sections.collect(),
        command: page.command.as_deref(),
        version: env!("CARGO_PKG_VERSION"),
    }
}
