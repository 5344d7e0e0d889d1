//! The numbers behind the plots of a regression.

use serde::Serialize;

use super::scatter::{Cloud, Histogram, cloud, histogram};
use crate::data::{RegressionPage, ScoreCurve, Surface};
use crate::decimate::round;
use crate::payload::{NonlinearityPlot, nonlinearity, score};

/// Everything that is plotted; a part without data is `None` and has no place on the page.
#[derive(Serialize)]
pub(crate) struct Payload<'a> {
    pub curve: Option<NonlinearityPlot>,
    pub points: Option<Cloud>,
    pub surface: Option<SurfacePlot<'a>>,
    pub slices: Vec<NonlinearityPlot>,
    pub residuals: Option<ResidualPlot<'a>>,
    pub distribution: Option<Histogram>,
    pub scores: Vec<Option<ScoreCurve>>,
}

#[derive(Serialize)]
pub(crate) struct SurfacePlot<'a> {
    x_label: &'a str,
    y_label: &'a str,
    z_label: &'a str,
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
    points: Option<Cloud>,
}

#[derive(Serialize)]
pub(crate) struct ResidualPlot<'a> {
    x_label: &'a str,
    y_label: &'a str,
    pub points: Cloud,
    running_x: Vec<f64>,
    running_mean: Vec<f64>,
    running_low: Vec<f64>,
    running_high: Vec<f64>,
}

/// Reduces a checked page to what its plots need.
pub(crate) fn payload(page: &RegressionPage) -> Payload<'_> {
    let residuals = &page.residuals;
    let about = |sign: f64| {
        let both = residuals.running_mean.iter().zip(&residuals.running_spread);
        both.map(|(mean, spread)| round(mean + sign * spread)).collect()
    };
    Payload {
        curve: (!page.curve.x.is_empty()).then(|| nonlinearity(&page.curve)),
        points: cloud(&page.points),
        surface: page.surface.as_ref().and_then(surface),
        slices: page.slices.iter().map(|slice| nonlinearity(&slice.curve)).collect(),
        residuals: cloud(&residuals.points).map(|points| ResidualPlot {
            x_label: &residuals.x_label,
            y_label: &residuals.y_label,
            points,
            running_x: rounded(&residuals.running_x),
            running_mean: rounded(&residuals.running_mean),
            running_low: about(-1.0),
            running_high: about(1.0),
        }),
        distribution: histogram(&residuals.points.y),
        scores: page.choices.iter().map(score).collect(),
    }
}

fn rounded(values: &[f64]) -> Vec<f64> {
    values.iter().map(|&v| round(v)).collect()
}

/// A surface as it is drawn; `None` without a grid.
pub(crate) fn surface(s: &Surface) -> Option<SurfacePlot<'_>> {
    (s.x.len() > 1 && s.y.len() > 1).then(|| SurfacePlot {
        x_label: &s.x_label,
        y_label: &s.y_label,
        z_label: &s.z_label,
        x: rounded(&s.x),
        y: rounded(&s.y),
        z: rounded(&s.z),
        points: cloud(&s.points),
    })
}
