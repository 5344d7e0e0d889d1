//! The page of a control scenario: checked, reduced to what is plotted, and put into text.

use std::fmt::Write as _;

use serde::Serialize;

use crate::Result;
use crate::check;
use crate::data::{ArmMotion, ControlPage, Fact, Table, TipPathPlot};
use crate::payload::{self, RecordPlot};
use crate::text::{ArmText, arm};

/// Points of a path that are drawn.
const PATH_POINTS: usize = 1500;
/// The drawing's width and height in its own units, and the part that stays empty around the paths.
const SIZE: f64 = 1000.0;
const MARGIN: f64 = 0.06;

/// Everything that is plotted.
#[derive(Serialize)]
pub(crate) struct Payload<'a> {
    record: Option<RecordPlot<'a>>,
    arm: Option<ArmMotion>,
}

/// What the template shows as text.
#[derive(Serialize)]
pub(crate) struct Text<'a> {
    title: &'a str,
    subtitle: &'a str,
    facts: &'a [Fact],
    warnings: &'a [String],
    tables: [&'a Table; 1],
    paths: Vec<PathText<'a>>,
    scale: Option<ScaleText>,
    signals: bool,
    bucket: usize,
    arm: Option<ArmText>,
    command: Option<&'a str>,
    version: &'static str,
}

#[derive(Serialize)]
struct PathText<'a> {
    name: &'a str,
    /// The outline, in the drawing's units.
    d: String,
}

/// A bar that shows a length.
#[derive(Serialize)]
struct ScaleText {
    end: f64,
    label: String,
}

/// Checks lengths; values may be NaN or infinite, they become gaps.
pub(crate) fn check(page: &ControlPage) -> Result<()> {
    check::table("table", &page.table)?;
    check::record(&page.signals, &page.time)?;
    for (k, path) in page.paths.iter().enumerate() {
        check::same(format!("paths[{k}].y"), path.y.len(), path.x.len(), "abscissa")?;
    }
    page.arm.as_ref().map_or(Ok(()), check::arm)
}

/// Reduces a checked page to what its plots need.
pub(crate) fn payload(page: &ControlPage) -> Payload<'_> {
    Payload {
        record: payload::record(&page.signals, &page.time, 0),
        arm: page.arm.as_ref().filter(|arm| arm.q[0].len() > 1).map(payload::arm),
    }
}

/// The box around all paths: its lower left corner and the length of its longer side.
fn frame(paths: &[TipPathPlot]) -> Option<([f64; 2], f64)> {
    let range = |of: fn(&TipPathPlot) -> &[f64]| {
        let values = || paths.iter().flat_map(&of).copied().filter(|v| v.is_finite());
        [
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        ]
    };
    let (x, y) = (range(|p| &p.x), range(|p| &p.y));
    let side = (x[1] - x[0]).max(y[1] - y[0]);
    let corner = [x, y].map(|r| 0.5 * (r[0] + r[1] - side));
    (side > 0.0 && side.is_finite()).then_some((corner, side))
}

/// A path's outline.
fn outline(path: &TipPathPlot, corner: [f64; 2], side: f64) -> String {
    let place = |v: f64, j: usize| SIZE * (MARGIN + (1.0 - 2.0 * MARGIN) * (v - corner[j]) / side);
    let step = path.x.len().div_ceil(PATH_POINTS).max(1);
    let mut d = String::new();
    let mut pen_up = true;
    for (x, y) in path.x.iter().zip(&path.y).step_by(step) {
        if !(x.is_finite() && y.is_finite()) {
            pen_up = true;
            continue;
        }
        let command = if pen_up { 'M' } else { 'L' };
        // Writing to a string does not fail.
        let _ = write!(d, "{command}{:.1} {:.1}", place(*x, 0), SIZE - place(*y, 1));
        pen_up = false;
    }
    d
}

/// The page's text.
pub(crate) fn text<'a>(page: &'a ControlPage, payload: &Payload<'_>) -> Text<'a> {
    let frame = frame(&page.paths);
    let paths = frame.map(|(corner, side)| {
        let one = |path: &'a TipPathPlot| PathText {
            name: &path.name,
            d: outline(path, corner, side),
        };
        page.paths.iter().map(one).collect()
    });
    let scale = frame.map(|(_, side)| {
        // 1, 2 or 5 times a power of ten, at most a fifth of the side.
        let most = 0.2 * side;
        let ten = 10.0_f64.powf(most.log10().floor());
        let length = [5.0, 2.0]
            .map(|k| k * ten)
            .into_iter()
            .find(|length| *length <= most)
            .unwrap_or(ten);
        ScaleText {
            end: SIZE * (MARGIN + (1.0 - 2.0 * MARGIN) * length / side),
            label: format!("{length} m"),
        }
    });
    Text {
        title: &page.title,
        subtitle: &page.subtitle,
        facts: &page.facts,
        warnings: &page.warnings,
        tables: [&page.table],
        paths: paths.unwrap_or_default(),
        scale,
        signals: payload.record.is_some(),
        bucket: payload.record.as_ref().map_or(1, |r| r.time.bucket),
        arm: payload.arm.as_ref().and(page.arm.as_ref()).map(arm),
        command: page.command.as_deref(),
        version: env!("CARGO_PKG_VERSION"),
    }
}
