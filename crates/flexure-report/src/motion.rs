//! The page of a moving chain: checked, reduced to what is drawn, and put into text.

use serde::Serialize;

use crate::Result;
use crate::check;
use crate::data::{Axis, Fact, MotionPage};
use crate::limits;
use crate::payload::{self, RecordPlot};

/// Everything that is drawn.
#[derive(Serialize)]
pub(crate) struct Payload<'a> {
    record: Option<RecordPlot<'a>>,
    chain: Option<ChainPlot<'a>>,
}

#[derive(Serialize)]
struct ChainPlot<'a> {
    time: &'a Axis,
    lines: &'a [[usize; 2]],
    /// In single precision, which is finer than a screen.
    points: Vec<Vec<[f32; 3]>>,
    free_base: bool,
}

/// What the template shows as text.
#[derive(Serialize)]
pub(crate) struct Text<'a> {
    title: &'a str,
    subtitle: &'a str,
    facts: &'a [Fact],
    warnings: [String; 0],
    caption: Option<&'a str>,
    /// The number of samples that the picture shows, where it is only the beginning.
    cut: Option<String>,
    signals: bool,
    bucket: usize,
    command: Option<&'a str>,
    version: &'static str,
}

/// Checks lengths; values may be NaN or infinite, they become gaps.
pub(crate) fn check(page: &MotionPage) -> Result<()> {
    check::record(&page.signals, &page.time)?;
    let chain = &page.chain;
    let most = chain.lines.iter().flatten().max().map_or(0, |most| most + 1);
    for (k, points) in chain.points.iter().enumerate() {
        let need = chain.points[0].len().max(most);
        check::same(format!("chain.points[{k}]"), points.len(), need, "point")?;
    }
    Ok(())
}

/// Reduces a checked page to what is drawn.
pub(crate) fn payload(page: &MotionPage) -> Payload<'_> {
    let chain = &page.chain;
    let single = |points: &Vec<[f64; 3]>| points.iter().map(|p| p.map(|x| x as f32)).collect();
    let shown = shown(page);
    Payload {
        record: payload::record(&page.signals, &page.time, 0),
        chain: (shown > 1).then(|| ChainPlot {
            time: &page.time,
            lines: &chain.lines,
            points: chain.points[..shown].iter().map(single).collect(),
            free_base: chain.free_base,
        }),
    }
}

/// The number of samples of the motion that are drawn.
fn shown(page: &MotionPage) -> usize {
    let points = &page.chain.points;
    let each = 3 * points.first().map_or(1, Vec::len).max(1);
    points.len().min((limits::CHAIN_COORDINATES / each).max(2))
}

/// The page's text.
pub(crate) fn text<'a>(page: &'a MotionPage, payload: &Payload<'_>) -> Text<'a> {
    let shown = shown(page);
    Text {
        title: &page.title,
        subtitle: &page.subtitle,
        facts: &page.facts,
        warnings: [],
        caption: payload.chain.as_ref().map(|_| page.chain.caption.as_str()),
        cut: (shown < page.chain.points.len()).then(|| shown.to_string()),
        signals: payload.record.is_some(),
        bucket: payload.record.as_ref().map_or(1, |r| r.time.bucket),
        command: page.command.as_deref(),
        version: env!("CARGO_PKG_VERSION"),
    }
}
