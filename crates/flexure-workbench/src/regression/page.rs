//! A regression as the page that shows it.

use anyhow::{Context as _, Result};
use flexure::identify::result::Score;
use flexure_report::data::{Choice, Fact, Nonlinearity, RegressionPage, RegressionResiduals, Scatter, Slice, Surface};

use super::text::{FELL_BACK, fell_back, local_range, local_rule, places, predicted_by, why};
use super::{BandDescription, Evaluation, Regression, RegressionData, Report};
use crate::plots::median;
use crate::systems::score_curve;
use crate::text::{capitalised, kernel_text, list, number, percent};

/// Points of the curve.
const CURVE: usize = 301;
/// Points of the surface along each column.
const SURFACE: usize = 61;
/// Points of a slice.
const SLICE: usize = 121;
/// Places of the residuals' running mean and spread.
const RUNNING: usize = 41;

/// The page that shows everything that a report says. `own_grid` says that the requested points are a grid over the data; the page then
/// shows them. `command` makes the page again.
pub fn html(report: &Report, own_grid: bool, command: Option<String>) -> Result<String> {
    flexure_report::render_regression(&page(report, own_grid, command)?).context("the report")
}

/// Fills in the page; the evaluation of the report is its curve where that is a grid over the data's range.
fn page(report: &Report, own_grid: bool, command: Option<String>) -> flexure::Result<RegressionPage> {
    let (data, rows) = (report.data, &report.diagnosis.rows);
    let (x_names, y_name) = (data.names.x.join(", "), &data.names.y);
    let one = data.x.len() == 1;
    let evaluated;
    let along = match (one, own_grid) {
        (true, true) => Some(&report.evaluation),
        (true, false) => {
            evaluated = report.evaluate(vec![data.along(0, CURVE)])?;
            Some(&evaluated)
        }
        (false, _) => None,
    };
    let surface = match data.x.len() {
        2 => Some(surface(report)?),
        _ => None,
    };
    let slices = match one {
        true => Slices::default(),
        false => slices(report)?,
    };
    let band = along.and_then(|curve| curve.band.as_ref()).or(slices.band.as_ref());
    let measured = |column: &[f64]| -> Vec<f64> { rows.iter().map(|&i| column[i]).collect() };
    Ok(RegressionPage {
        title: format!("{y_name} against {x_names}"),
        subtitle: format!(
            "The mean of {y_name} at given {x_names}, estimated from {} rows of {}: {}.",
            rows.len(),
            data.file,
            report.regression.fit.name.title()
        ),
        facts: facts(report, band),
        warnings: report.warnings.clone(),
        curve: along.map_or_else(Nonlinearity::default, |at| curve(at, 0, data)),
        points: match one {
            true => Scatter::new(measured(data.x[0]), measured(data.y)),
            false => Scatter::default(),
        },
        surface,
        slices: slices.along,
        residuals: residuals(report),
        choices: [
            Some(choice(&report.regression, data)),
            local_choice(&report.regression),
            band.map(|band| Choice::new("Band", band.label(), capitalised(&band.method))),
        ]
        .into_iter()
        .flatten()
        .collect(),
        command,
    })
}

fn facts(report: &Report, band: Option<&BandDescription>) -> Vec<Fact> {
    let (fit, validation) = (&report.regression.fit, &report.validation);
    let r_squared = match validation.r_squared {
        known if known.is_finite() => format!("{known:.3}"),
        _ => "not known".to_owned(),
    };
    let share = format!(
        "share of the variance that is predicted, by {}",
        predicted_by(validation, &report.diagnosis)
    );
    let by = format!("root mean square, by {}", validation.by);
    let mut facts = vec![
        Fact::new("R squared", r_squared, share),
        Fact::new("Prediction error", number(validation.rms), by),
        Fact::new("Residuals", number(validation.residual_sd), "their standard deviation"),
        Fact::new(
            capitalised(fit.name.parameter()),
            list(&fit.parameter),
            why(&report.regression),
        ),
    ];
    if let Some(local) = &fit.local {
        let jumps = match local.jumps.as_slice() {
            [] => "one for every point".to_owned(),
            _ => format!("jumps at {}", places(local)),
        };
        facts.push(Fact::new("Local bandwidths", local_range(local), jumps));
    }
    if let Some(band) = band {
        let kind = format!("{}{}", band.kind, band.of);
        facts.push(Fact::new("Band", format!("{} %", percent(band.level)), kind));
    }
    facts.push(Fact::new(
        "Rows",
        report.diagnosis.rows.len().to_string(),
        "of positive weight",
    ));
    facts
}

/// An estimate along column `along` as the page draws it.
fn curve(at: &Evaluation, along: usize, data: &RegressionData) -> Nonlinearity {
    let band = at.band.as_ref();
    let edge = |values: &[f64]| if band.is_some() { values.to_vec() } else { Vec::new() };
    Nonlinearity {
        x_label: data.labels.of(&data.names.x[along]),
        y_label: data.labels.of(&data.names.y),
        x: at.x[along].clone(),
        y: at.y.clone(),
        lower: edge(&at.lower),
        upper: edge(&at.upper),
        band_label: band.map_or(String::new(), BandDescription::label),
        ..Nonlinearity::default()
    }
}

fn surface(report: &Report) -> flexure::Result<Surface> {
    let (data, rows) = (report.data, &report.diagnosis.rows);
    let (x, y) = (data.along(0, SURFACE), data.along(1, SURFACE));
    let across: Vec<f64> = y.iter().flat_map(|_| x.iter().copied()).collect();
    let up: Vec<f64> = y.iter().flat_map(|&v| std::iter::repeat_n(v, SURFACE)).collect();
    let of = |column: usize| -> Vec<f64> { rows.iter().map(|&i| data.x[column][i]).collect() };
    Ok(Surface {
        x_label: data.labels.of(&data.names.x[0]),
        y_label: data.labels.of(&data.names.x[1]),
        z_label: data.labels.of(&data.names.y),
        z: report.regression.fit.regression.predict(&[&across, &up])?,
        x,
        y,
        points: Scatter::new(of(0), of(1)),
    })
}

/// The estimate along each column while the others stay at their medians.
#[derive(Default)]
struct Slices {
    along: Vec<Slice>,
    /// What the band is.
    band: Option<BandDescription>,
}

fn slices(report: &Report) -> flexure::Result<Slices> {
    let data = report.data;
    let d = data.x.len();
    let medians: Vec<f64> = (0..d)
        .map(|j| median(report.diagnosis.rows.iter().map(|&i| data.x[j][i])))
        .collect();
    // All slices are evaluated at once, since every evaluation of a bootstrap band is a separate computation; a simultaneous band then
    // holds on all slices together.
    let along = |j: usize, along: usize| match j == along {
        true => data.along(j, SLICE),
        false => vec![medians[j]; SLICE],
    };
    let columns = (0..d).map(|j| (0..d).flat_map(|k| along(j, k)).collect());
    let columns: Vec<Vec<f64>> = columns.collect();
    let all = report.evaluate(columns)?;
    let part = |values: &[f64], along: usize| values[along * SLICE..(along + 1) * SLICE].to_vec();
    let slice = |along: usize| {
        let others = (0..d).filter(|&j| j != along);
        let others: Vec<String> = others
            .map(|j| format!("{} = {}", data.names.x[j], number(medians[j]).replace('-', "−")))
            .collect();
        let at = Evaluation {
            x: all.x.iter().map(|column| part(column, along)).collect(),
            y: part(&all.y, along),
            lower: part(&all.lower, along),
            upper: part(&all.upper, along),
            band: all.band.clone(),
        };
        Slice {
            at: others.join(", "),
            curve: curve(&at, along, data),
        }
    };
    Ok(Slices {
        along: (0..d).map(slice).collect(),
        band: all.band.clone(),
    })
}

fn residuals(report: &Report) -> RegressionResiduals {
    let (data, diagnosis) = (report.data, &report.diagnosis);
    let y_label = data.labels.of(&data.names.y);
    // Over x if there is one column, otherwise over the estimate.
    let (x_label, x): (String, Vec<f64>) = match data.x.as_slice() {
        [x] => (
            data.labels.of(&data.names.x[0]),
            diagnosis.rows.iter().map(|&i| x[i]).collect(),
        ),
        _ => (format!("estimate of {y_label}"), diagnosis.fitted.clone()),
    };
    let mut residuals = RegressionResiduals {
        x_label,
        y_label: format!("residual of {y_label}"),
        points: Scatter::new(x, diagnosis.residuals.clone()),
        ..RegressionResiduals::default()
    };
    fill_running(&mut residuals);
    residuals
}

/// The mean and the standard deviation of the residuals among neighbouring abscissas; left empty for few points.
fn fill_running(residuals: &mut RegressionResiduals) {
    let pairs = residuals
        .points
        .x
        .iter()
        .copied()
        .zip(residuals.points.y.iter().copied());
    let mut points: Vec<(f64, f64)> = pairs.filter(|(x, v)| x.is_finite() && v.is_finite()).collect();
    points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let n = points.len();
    let half = (n / 20).max(5);
    if n < 2 * half {
        return;
    }
    for k in 0..RUNNING {
        let centre = k * (n - 1) / (RUNNING - 1);
        let near = &points[centre.saturating_sub(half)..(centre + half).min(n)];
        let count = near.len() as f64;
        let place = near.iter().map(|p| p.0).sum::<f64>() / count;
        if residuals.running_x.last().is_some_and(|last| place <= *last) {
            continue;
        }
        let mean = near.iter().map(|p| p.1).sum::<f64>() / count;
        let variance = near.iter().map(|p| (p.1 - mean).powi(2)).sum::<f64>() / count;
        residuals.running_x.push(place);
        residuals.running_mean.push(mean);
        residuals.running_spread.push(variance.sqrt());
    }
}

fn choice(regression: &Regression, data: &RegressionData) -> Choice {
    let fit = &regression.fit;
    let kernel = kernel_text(fit.name, regression.estimator.kernel, " (", ")");
    let value = format!("{}{kernel}", list(&fit.parameter));
    let scores = fit.scores.as_ref();
    Choice {
        curve: scores.map(|s| score_curve(Score::of_parameter(fit.name, s, &fit.parameter, &data.names.x[0]))),
        ..Choice::new(capitalised(fit.name.parameter()), value, why(regression))
    }
}

/// How local bandwidths were chosen, or that they were not.
fn local_choice(regression: &Regression) -> Option<Choice> {
    let name = "Local bandwidths";
    match &regression.fit.local {
        Some(local) => Some(Choice::new(
            name,
            local_range(local),
            capitalised(&local_rule(local).why),
        )),
        None => fell_back(regression).then(|| Choice::new(name, "none", capitalised(FELL_BACK))),
    }
}
