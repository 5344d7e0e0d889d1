//! A regression as the page that shows it.

use anyhow::Result;
use flexure_report::data::{Choice, Fact, Nonlinearity, RegressionPage, RegressionResiduals, Scatter, Slice, Surface};

use super::data::Data;
use super::estimate::{BandWords, Estimate, Evaluated};
use super::words::{FELL_BACK, fell_back, local_rule, percent, places, predicted_by, range, why};
use flexure_workbench::systems::labelled;
use flexure_workbench::text::number;
use flexure_workbench::text::{capitalised, kernel_words, list, score_curve};

/// Points of the curve.
const CURVE: usize = 301;
/// Points of the surface along each column.
const SURFACE: usize = 61;
/// Points of a slice.
const SLICE: usize = 121;
/// Places of the residuals' running mean and spread.
const RUNNING: usize = 41;

/// Fills in the page.
///
/// `shown` is the result's curve where that is what the page draws.
pub fn page(
    estimate: &Estimate,
    data: &Data,
    shown: Option<&Evaluated>,
    warnings: &[String],
    command: String,
) -> Result<RegressionPage> {
    let y_label = labelled(&data.y_name);
    let one = data.x.len() == 1;
    let evaluated;
    let along = match (one, shown) {
        (true, None) => {
            evaluated = estimate.evaluate(data, vec![data.along(0, CURVE)])?;
            Some(&evaluated)
        }
        (true, shown) => shown,
        (false, _) => None,
    };
    let surface = match data.x.len() {
        2 => Some(surface(estimate, data)?),
        _ => None,
    };
    let (slices, sliced) = match one {
        true => (Vec::new(), None),
        false => slices(estimate, data)?,
    };
    let band = along.and_then(|curve| curve.band.as_ref()).or(sliced.as_ref());
    let measured = |column: &[f64]| -> Vec<f64> { estimate.rows.iter().map(|&i| column[i]).collect() };
    Ok(RegressionPage {
        title: format!("{} against {}", data.y_name, data.names.join(", ")),
        subtitle: format!(
            "The mean of {} at given {}, estimated from {} rows of {}: {}.",
            data.y_name,
            data.names.join(", "),
            estimate.rows.len(),
            data.file,
            estimate.fit.name.title()
        ),
        facts: facts(estimate, band),
        warnings: warnings.to_vec(),
        curve: along.map_or_else(Nonlinearity::default, |at| curve(at, 0, data)),
        points: match one {
            true => Scatter {
                x: measured(data.x[0]),
                y: measured(data.y),
            },
            false => Scatter::default(),
        },
        surface,
        slices,
        residuals: residuals(estimate, data, &y_label),
        choices: [
            Some(choice(estimate, data)),
            local_choice(estimate),
            band.map(band_choice),
        ]
        .into_iter()
        .flatten()
        .collect(),
        command: Some(command),
    })
}

fn facts(estimate: &Estimate, band: Option<&BandWords>) -> Vec<Fact> {
    let fit = &estimate.fit;
    let fact = |name: &str, value: String, note: String| Fact {
        name: name.to_owned(),
        value,
        note,
    };
    let mut facts = vec![
        fact(
            "R squared",
            match estimate.validation.r_squared {
                known if known.is_finite() => format!("{known:.3}"),
                _ => "not known".to_owned(),
            },
            format!(
                "share of the variance that is predicted, by {}",
                predicted_by(&estimate.validation)
            ),
        ),
        fact(
            "Prediction error",
            number(estimate.validation.rms),
            format!("root mean square, by {}", estimate.validation.by),
        ),
        fact(
            "Residuals",
            number(estimate.residual_sd),
            "their standard deviation".to_owned(),
        ),
        fact(&capitalised(fit.name.parameter()), list(&fit.parameter), why(estimate)),
    ];
    if let Some(local) = &fit.local {
        let jumps = match local.jumps.as_slice() {
            [] => "one for every point".to_owned(),
            _ => format!("jumps at {}", places(local)),
        };
        facts.push(fact("Local bandwidths", range(local), jumps));
    }
    if let Some(band) = band {
        facts.push(fact(
            "Band",
            format!("{} %", percent(band.level)),
            format!("{}{}", band.kind, band.of),
        ));
    }
    facts.push(fact(
        "Rows",
        estimate.rows.len().to_string(),
        "of positive weight".to_owned(),
    ));
    facts
}

/// An estimate along column `along` as the page draws it.
fn curve(at: &Evaluated, along: usize, data: &Data) -> Nonlinearity {
    let band = at.band.as_ref();
    let edge = |values: &[f64]| if band.is_some() { values.to_vec() } else { Vec::new() };
    Nonlinearity {
        x_label: labelled(&data.names[along]),
        y_label: labelled(&data.y_name),
        x: at.x[along].clone(),
        y: at.y.clone(),
        lower: edge(&at.lower),
        upper: edge(&at.upper),
        band_label: band.map_or(String::new(), |band| {
            format!("{} % {}{}", percent(band.level), band.kind, band.of)
        }),
        ..Nonlinearity::default()
    }
}

fn surface(estimate: &Estimate, data: &Data) -> Result<Surface> {
    let (x, y) = (data.along(0, SURFACE), data.along(1, SURFACE));
    let across: Vec<f64> = y.iter().flat_map(|_| x.iter().copied()).collect();
    let up: Vec<f64> = y.iter().flat_map(|&v| std::iter::repeat_n(v, SURFACE)).collect();
    let of = |column: usize| -> Vec<f64> { estimate.rows.iter().map(|&i| data.x[column][i]).collect() };
    Ok(Surface {
        x_label: labelled(&data.names[0]),
        y_label: labelled(&data.names[1]),
        z_label: labelled(&data.y_name),
        z: estimate.fit.regression.predict(&[&across, &up])?,
        x,
        y,
        points: Scatter { x: of(0), y: of(1) },
    })
}

/// The estimate along each column while the others stay at their medians, and what its band is.
fn slices(estimate: &Estimate, data: &Data) -> Result<(Vec<Slice>, Option<BandWords>)> {
    let d = data.x.len();
    let medians: Vec<f64> = (0..d).map(|j| median(&estimate.rows, data.x[j])).collect();
    // All at once, as every evaluation of a band by the bootstrap is a computation of its own; a simultaneous band
    // would then hold on all slices together.
    let along = |j: usize, along: usize| match j == along {
        true => data.along(j, SLICE),
        false => vec![medians[j]; SLICE],
    };
    let columns = (0..d).map(|j| (0..d).flat_map(|k| along(j, k)).collect());
    let columns: Vec<Vec<f64>> = columns.collect();
    let all = estimate.evaluate(data, columns)?;
    let part = |values: &[f64], along: usize| values[along * SLICE..(along + 1) * SLICE].to_vec();
    let slice = |along: usize| {
        let others = (0..d).filter(|&j| j != along);
        let words: Vec<String> = others
            .map(|j| format!("{} = {}", data.names[j], number(medians[j]).replace('-', "−")))
            .collect();
        let at = Evaluated {
            x: all.x.iter().map(|column| part(column, along)).collect(),
            y: part(&all.y, along),
            lower: part(&all.lower, along),
            upper: part(&all.upper, along),
            band: all.band.clone(),
        };
        Slice {
            at: words.join(", "),
            curve: curve(&at, along, data),
        }
    };
    Ok(((0..d).map(slice).collect(), all.band.clone()))
}

fn median(rows: &[usize], column: &[f64]) -> f64 {
    let mut values: Vec<f64> = rows.iter().map(|&i| column[i]).collect();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

fn residuals(estimate: &Estimate, data: &Data, y_label: &str) -> RegressionResiduals {
    // Over x where there is one, else over the estimate.
    let (x_label, x): (String, Vec<f64>) = match data.x.as_slice() {
        [x] => (labelled(&data.names[0]), estimate.rows.iter().map(|&i| x[i]).collect()),
        _ => (format!("estimate of {y_label}"), estimate.fitted.clone()),
    };
    let (running_x, running_mean, running_spread) = running(&x, &estimate.residuals);
    RegressionResiduals {
        x_label,
        y_label: format!("residual of {y_label}"),
        points: Scatter {
            x,
            y: estimate.residuals.clone(),
        },
        running_x,
        running_mean,
        running_spread,
    }
}

/// The mean and the standard deviation of the values among neighbouring abscissas: places, means, spreads.
fn running(x: &[f64], values: &[f64]) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let pairs = x.iter().copied().zip(values.iter().copied());
    let mut points: Vec<(f64, f64)> = pairs.filter(|(x, v)| x.is_finite() && v.is_finite()).collect();
    points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let (mut at, mut means, mut spreads) = (Vec::new(), Vec::new(), Vec::new());
    let n = points.len();
    let half = (n / 20).max(5);
    if n < 2 * half {
        return (at, means, spreads);
    }
    for k in 0..RUNNING {
        let centre = k * (n - 1) / (RUNNING - 1);
        let near = &points[centre.saturating_sub(half)..(centre + half).min(n)];
        let count = near.len() as f64;
        let place = near.iter().map(|p| p.0).sum::<f64>() / count;
        if at.last().is_some_and(|last| place <= *last) {
            continue;
        }
        let mean = near.iter().map(|p| p.1).sum::<f64>() / count;
        at.push(place);
        means.push(mean);
        spreads.push((near.iter().map(|p| (p.1 - mean).powi(2)).sum::<f64>() / count).sqrt());
    }
    (at, means, spreads)
}

fn choice(estimate: &Estimate, data: &Data) -> Choice {
    let fit = &estimate.fit;
    let name = capitalised(fit.name.parameter());
    let kernel = kernel_words(fit.name, estimate.method.kernel, " (", ")");
    let scores = fit.scores.as_ref();
    let curve = scores.map(|s| score_curve(fit.name, s, &fit.parameter, &data.names[0]));
    Choice {
        name,
        value: format!("{}{kernel}", list(&fit.parameter)),
        why: why(estimate),
        curve,
    }
}

/// How local bandwidths were chosen, or that they were not.
fn local_choice(estimate: &Estimate) -> Option<Choice> {
    let (value, why) = match &estimate.fit.local {
        Some(local) => (range(local), capitalised(&local_rule(local).1)),
        None if fell_back(estimate) => ("none".to_owned(), capitalised(FELL_BACK)),
        None => return None,
    };
    Some(Choice {
        name: "Local bandwidths".to_owned(),
        value,
        why,
        curve: None,
    })
}

fn band_choice(band: &BandWords) -> Choice {
    Choice {
        name: "Band".to_owned(),
        value: format!("{} % {}{}", percent(band.level), band.kind, band.of),
        why: capitalised(&band.method),
        curve: None,
    }
}
