//! Rough estimates of the surface's output: the starts of the search.

use super::super::block::{
    EquationError, Judged, LARGEST_START_ORDER, Monitor, PRODUCT_PASSES, START_SAMPLES, Signals, delayed,
    dominant_products, least_lag, standardised,
};
use super::super::limits::CLIP;
use super::limits::{DEGREES, LAG_SAMPLES, LAGS_TOGETHER};
use crate::linear::correlation::mean;
use crate::nonlinearity::{Degree, Estimator, KernelEstimator, Outside, Regression};
use crate::vectors::combined;

/// The surface's output, at zero mean and unit variance, by every start.
pub(super) fn starts(data: &Signals, monitor: &mut Monitor<'_>) -> Vec<Vec<f64>> {
    let small = data.head(START_SAMPLES);
    let features = polynomials(data);
    let short: Vec<Vec<f64>> = features.iter().map(|f| f[..small.y.len()].to_vec()).collect();
    let lags = lags(&small, &short);
    let mut all = Vec::new();
    if monitor.keep_on()
        && let Some(c) = by_polynomials(&small, &short, lags.together)
    {
        all.push(combined(&features, &c));
    }
    if monitor.keep_on() {
        all.extend(by_kernel(data, &small, lags.alone));
    }
    all.iter().map(|v| standardised(v)).collect()
}

/// Products of Legendre polynomials of the clipped inputs, of total degree one and more.
fn polynomials(data: &Signals) -> Vec<Vec<f64>> {
    let degree = DEGREES[usize::from(data.u.len() > 2)];
    let clipped = |u: &Vec<f64>| u.iter().map(|u| (u / CLIP).clamp(-1.0, 1.0)).collect::<Vec<f64>>();
    let mut all: Vec<(usize, Vec<f64>)> = vec![(0, vec![1.0; data.y.len()])];
    for u in &data.u {
        let z = clipped(u);
        let mut powers = vec![vec![1.0; z.len()], z.clone()];
        for k in 1..degree {
            let (k, next) = (k as f64, k + 1);
            let value = |n: usize| ((2.0 * k + 1.0) * z[n] * powers[next - 1][n] - k * powers[next - 2][n]) / (k + 1.0);
            let column = (0..z.len()).map(value).collect();
            powers.push(column);
        }
        let mut more = Vec::new();
        for (had, column) in &all {
            for (k, power) in powers.iter().enumerate().take(degree - had + 1) {
                more.push((had + k, column.iter().zip(power).map(|(a, b)| a * b).collect()));
            }
        }
        all = more;
    }
    all.into_iter()
        .filter(|(degree, _)| *degree > 0)
        .map(|(_, c)| c)
        .collect()
}

/// The lags at which features explain the output best.
struct Lags {
    /// The first of several lags, together with the last outputs.
    together: usize,
    /// A single lag.
    alone: usize,
}

fn lags(data: &Signals, features: &[Vec<f64>]) -> Lags {
    let data = data.head(LAG_SAMPLES);
    let n = data.y.len();
    let at = |lag: usize| features.iter().map(move |f| delayed(&f[..n], lag, 1.0));
    let always = [vec![1.0; n], delayed(&data.y, 1, 1.0), delayed(&data.y, 2, 1.0)];
    let together = least_lag(&data, |lag| {
        let lagged = (lag..lag + LAGS_TOGETHER).flat_map(at);
        lagged.chain(always.iter().cloned()).collect()
    });
    let alone = least_lag(&data, |lag| at(lag).chain([always[0].clone()]).collect());
    Lags { together, alone }
}

/// The polynomials' coefficients from the best common denominator of several orders.
fn by_polynomials(data: &Signals, features: &[Vec<f64>], delay: usize) -> Option<Vec<f64>> {
    let late: Vec<Vec<f64>> = features.iter().map(|f| delayed(f, delay, 1.0)).collect();
    let mut best: Option<Judged<Vec<f64>>> = None;
    for order in 1..=LARGEST_START_ORDER {
        let unknowns = late.len() * (order + 1) + order;
        if 3 * unknowns > data.counted() {
            break;
        }
        let problem = EquationError {
            signals: &late,
            y: &data.y,
            constant: true,
            order,
            from: data.from,
        };
        let found = problem.best(PRODUCT_PASSES, |numerators, denominator| {
            let product = dominant_products(numerators, order + 1, 1)?.pop()?;
            let system = denominator.with_numerator(product.row);
            let of = product.column;
            let output = system.run(&combined(&late, &of));
            // The offset is free.
            let errors: Vec<f64> = (data.from..data.y.len()).map(|n| data.y[n] - output[n]).collect();
            let centre = mean(&errors);
            let squares: f64 = errors.iter().map(|e| (e - centre).powi(2)).sum();
            let score = data.bic(squares, of.len() + 2 * order + 1);
            Some(Judged { score, of })
        });
        let better = found.filter(|f| best.as_ref().is_none_or(|b| f.score < b.score));
        best = better.or(best);
    }
    best.map(|best| best.of)
}

/// Eq. (21): the kernel regression of the output some samples later on the inputs, evaluated at all inputs.
fn by_kernel(data: &Signals, small: &Signals, lag: usize) -> Option<Vec<f64>> {
    let n = small.y.len().checked_sub(lag)?;
    let x: Vec<&[f64]> = small.u.iter().map(|u| &u[..n]).collect();
    let estimator = KernelEstimator {
        degree: Degree::Linear,
        outside: Outside::Nearest,
        ..KernelEstimator::default()
    };
    let fit = estimator.fit(&x, &small.y[lag..], None).ok()?;
    let at: Vec<&[f64]> = data.u.iter().map(Vec::as_slice).collect();
    let mut values = fit.predict(&at).ok()?;
    values.iter_mut().filter(|v| !v.is_finite()).for_each(|v| *v = 0.0);
    Some(values)
}
