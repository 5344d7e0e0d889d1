//! What the surface makes of the inputs, roughly: where the search starts.

use super::super::block::branches::{Signals, dominant_products};
use super::super::block::{Monitor, Rational, delayed, normal_equations, solve};
use super::standardised;
use crate::nonlinearity::{Degree, Estimator, KernelEstimator, Outside, Regression};

/// Largest degree of the polynomials, for two inputs and for more.
const DEGREES: [usize; 2] = [4, 3];
/// Standard deviations at which an input of the polynomials is clipped.
const CLIP: f64 = 3.0;
/// Samples that the starts are made on.
const SAMPLES: usize = 5_000;
/// Orders of the common denominator, and passes of the Steiglitz-McBride iteration.
const LARGEST_ORDER: usize = 5;
const PASSES: usize = 6;
/// The longest lag that is looked for, and how many lags are looked at together.
const LONGEST_LAG: usize = 100;
const LAGS_TOGETHER: usize = 3;
const SEARCH_SAMPLES: usize = 3_000;

/// The surface's output, at zero mean and unit variance, by every start.
pub(super) fn starts(data: &Signals, monitor: &mut Monitor<'_>) -> Vec<Vec<f64>> {
    let small = data.head(SAMPLES);
    let features = polynomials(data);
    let short: Vec<Vec<f64>> = features.iter().map(|f| f[..small.y.len()].to_vec()).collect();
    let (first, strongest) = lags(&small, &short);
    let mut all = Vec::new();
    if monitor.keep_on()
        && let Some(c) = by_polynomials(&small, &short, first)
    {
        all.push(combined(&features, &c));
    }
    if monitor.keep_on() {
        all.extend(by_kernel(data, &small, strongest));
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

fn combined(columns: &[Vec<f64>], c: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; columns.first().map_or(0, Vec::len)];
    for (column, c) in columns.iter().zip(c) {
        sum.iter_mut().zip(column).for_each(|(s, x)| *s += c * x);
    }
    sum
}

/// The share of the output's squares that least squares over columns leaves.
fn left_over(y: &[f64], columns: &[Vec<f64>], from: usize) -> f64 {
    let minus: Vec<f64> = y.iter().map(|y| -y).collect();
    let equations = normal_equations(&minus, columns, from);
    let explained = |p: Vec<f64>| p.iter().zip(&equations.descent).map(|(p, d)| p * d).sum::<f64>();
    solve(&equations).map_or(f64::INFINITY, |p| (equations.cost - explained(p)) / equations.cost)
}

/// The lag from which on the features explain the output best together with the next ones and the last outputs, and the single lag
/// at which they explain it best.
fn lags(data: &Signals, features: &[Vec<f64>]) -> (usize, usize) {
    let data = data.head(SEARCH_SAMPLES);
    let n = data.y.len();
    let longest = LONGEST_LAG.min(data.counted() / 10);
    let at = |lag: usize| features.iter().map(move |f| delayed(&f[..n], lag, 1.0));
    let always = [vec![1.0; n], delayed(&data.y, 1, 1.0), delayed(&data.y, 2, 1.0)];
    let together = |lag: usize| -> f64 {
        let lagged = (lag..lag + LAGS_TOGETHER).flat_map(at);
        left_over(
            &data.y,
            &lagged.chain(always.iter().cloned()).collect::<Vec<_>>(),
            data.from,
        )
    };
    let alone = |lag: usize| -> f64 {
        let columns: Vec<Vec<f64>> = at(lag).chain([always[0].clone()]).collect();
        left_over(&data.y, &columns, data.from)
    };
    let least = |of: &dyn Fn(usize) -> f64| {
        let each = (0..=longest).map(|lag| (lag, of(lag)));
        each.fold((0, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a }).0
    };
    (least(&together), least(&alone))
}

/// The polynomials' coefficients from the best common denominator of several orders.
fn by_polynomials(data: &Signals, features: &[Vec<f64>], delay: usize) -> Option<Vec<f64>> {
    let late: Vec<Vec<f64>> = features.iter().map(|f| delayed(f, delay, 1.0)).collect();
    let mut best: Option<(f64, Vec<f64>)> = None;
    for order in 1..=LARGEST_ORDER {
        let unknowns = late.len() * (order + 1) + order;
        if 3 * unknowns > data.counted() {
            break;
        }
        let mut filter = Rational::pass();
        for _ in 0..PASSES {
            let y = filter.all_pole(&data.y);
            let minus: Vec<f64> = y.iter().map(|y| -y).collect();
            let filtered = late.iter().map(|f| filter.all_pole(f));
            let mut columns: Vec<Vec<f64>> = filtered
                .flat_map(|f| (0..=order).map(move |k| delayed(&f, k, 1.0)))
                .collect();
            columns.extend((1..=order).map(|k| delayed(&y, k, -1.0)));
            columns.push(filter.all_pole(&vec![1.0; y.len()]));
            let Some(p) = solve(&normal_equations(&minus, &columns, data.from)) else {
                break;
            };
            let (numerators, rest) = p.split_at(late.len() * (order + 1));
            let a: Vec<f64> = std::iter::once(1.0).chain(rest[..order].iter().copied()).collect();
            let Some(denominator) = Rational::from_polynomials(vec![1.0], &a) else {
                break;
            };
            let Some(mut product) = dominant_products(numerators, order + 1, 1) else {
                break;
            };
            let Some((c, b)) = product.pop() else { break };
            let system = Rational {
                b,
                ..denominator.clone()
            };
            filter = denominator;
            let output = system.run(&combined(&late, &c));
            // The offset is free.
            let errors: Vec<f64> = (data.from..data.y.len()).map(|n| data.y[n] - output[n]).collect();
            let centre = errors.iter().sum::<f64>() / errors.len() as f64;
            let squares: f64 = errors.iter().map(|e| (e - centre).powi(2)).sum();
            let score = data.bic(squares, c.len() + 2 * order + 1);
            if score.is_finite() && best.as_ref().is_none_or(|b| score < b.0) {
                best = Some((score, c));
            }
        }
    }
    best.map(|b| b.1)
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
