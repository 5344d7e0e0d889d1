//! The page of a joint: checked, reduced to what is plotted, and put into text.

use serde::Serialize;

use crate::Result;
use crate::check;
use crate::data::{Comparison, Fact, JointCurve, JointPage, ParameterTable, Table, Verdict};
use crate::diagram::{DiagramText, diagram};
use crate::payload::{NonlinearityPlot, PredictionPlot, nonlinearity, prediction};
use crate::regression::{Cloud, cloud};
use crate::text::{name_and_unit, number};

/// Everything that is plotted.
#[derive(Serialize)]
pub(crate) struct Payload<'a> {
    curves: Vec<CurvePlot>,
    motions: Vec<PredictionPlot<'a>>,
}

#[derive(Serialize)]
struct CurvePlot {
    curve: NonlinearityPlot,
    dashed: &'static str,
    points: Option<Cloud>,
}

/// What the template shows as text.
#[derive(Serialize)]
pub(crate) struct Text<'a> {
    title: &'a str,
    subtitle: &'a str,
    verdict: Option<&'a Verdict>,
    diagram: Option<DiagramText>,
    facts: &'a [Fact],
    warnings: &'a [String],
    curves: Vec<CurveText<'a>>,
    tables: &'a [ParameterTable],
    others: Option<&'a Table>,
    motions: Vec<MotionText<'a>>,
    overview: Option<&'a Table>,
    axes: Vec<Text<'a>>,
    /// The indices of its first curve and its first motion on the page.
    first: [usize; 2],
    command: Option<&'a str>,
    python: Option<&'a str>,
    version: &'static str,
}

#[derive(Serialize)]
struct CurveText<'a> {
    heading: &'a str,
    caption: &'a str,
    form: &'a str,
    outside: Option<String>,
}

/// The text about a measured signal against a computed one.
#[derive(Serialize)]
pub(crate) struct MotionText<'a> {
    heading: &'a str,
    fit: String,
    rms: String,
    unit: Option<&'a str>,
    remark: &'a str,
    bucket: usize,
}

/// Checks lengths and abscissas; values may be NaN or infinite, they become gaps.
pub(crate) fn check(page: &JointPage) -> Result<()> {
    for (k, curve) in page.curves.iter().enumerate() {
        check::nonlinearity(&format!("curves[{k}].curve"), &curve.curve)?;
        let points = &curve.points;
        check::same(
            format!("curves[{k}].points.y"),
            points.y.len(),
            points.x.len(),
            "abscissa",
        )?;
    }
    for (k, motion) in page.motions.iter().enumerate() {
        check::prediction(&format!("motions[{k}].prediction"), &motion.prediction)?;
    }
    page.axes.iter().try_for_each(check)
}

/// Reduces a checked page to what its plots need.
pub(crate) fn payload(page: &JointPage) -> Payload<'_> {
    let curve = |c: &JointCurve| CurvePlot {
        curve: nonlinearity(&c.curve),
        dashed: c.dashed,
        points: cloud(&c.points),
    };
    let mut plots = Payload {
        curves: page.curves.iter().map(curve).collect(),
        motions: page.motions.iter().map(motion_plot).collect(),
    };
    for of_axis in page.axes.iter().map(payload) {
        plots.curves.extend(of_axis.curves);
        plots.motions.extend(of_axis.motions);
    }
    plots
}

/// The page's text.
pub(crate) fn text<'a>(page: &'a JointPage, payload: &Payload<'_>) -> Text<'a> {
    numbered(page, payload, &mut [0, 0])
}

/// The text of a page or of one of its axes, whose curves and motions are those from `next` on.
fn numbered<'a>(page: &'a JointPage, payload: &Payload<'_>, next: &mut [usize; 2]) -> Text<'a> {
    let first = *next;
    *next = [first[0] + page.curves.len(), first[1] + page.motions.len()];
    let curves = page.curves.iter().zip(&payload.curves[first[0]..]);
    let motions = page.motions.iter().zip(&payload.motions[first[1]..]);
    Text {
        title: &page.title,
        subtitle: &page.subtitle,
        verdict: page.verdict.as_ref(),
        diagram: page.diagram.as_ref().map(diagram),
        facts: &page.facts,
        warnings: &page.warnings,
        curves: curves
            .map(|(c, plot)| CurveText {
                heading: &c.heading,
                caption: &c.caption,
                form: &c.curve.truth_label,
                outside: plot
                    .points
                    .as_ref()
                    .filter(|cloud| cloud.outside > 0)
                    .map(|cloud| cloud.outside.to_string()),
            })
            .collect(),
        tables: &page.tables,
        others: page.others.as_ref(),
        motions: motions.map(|(m, plot)| motion_text(m, plot)).collect(),
        overview: page.overview.as_ref(),
        axes: page.axes.iter().map(|axis| numbered(axis, payload, next)).collect(),
        first,
        command: page.command.as_deref(),
        python: page.python.as_deref(),
        version: env!("CARGO_PKG_VERSION"),
    }
}

/// A measured signal against a computed one, reduced to what is drawn.
pub(crate) fn motion_plot(motion: &Comparison) -> PredictionPlot<'_> {
    let mut plot = prediction(&motion.prediction);
    plot.names = motion.names;
    plot
}

/// The text about a measured signal against a computed one, with this plot.
pub(crate) fn motion_text<'a>(motion: &'a Comparison, plot: &PredictionPlot<'_>) -> MotionText<'a> {
    MotionText {
        heading: &motion.heading,
        fit: format!("{:.2}", motion.prediction.fit_percent),
        rms: number(motion.prediction.rms, 4),
        unit: name_and_unit(&motion.prediction.y_label).1,
        remark: &motion.remark,
        bucket: plot.time.bucket,
    }
}
