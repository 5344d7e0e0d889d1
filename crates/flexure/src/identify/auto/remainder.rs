//! How much of a model's error a general function of the input still explains.
//!
//! The error is regressed on powers of the input and of the prediction, each at several lags, on one half of the fresh samples and
//! predicted on the other, in turn. The explained part is not noise; the rest bounds the noise from above, without any assumption on its
//! colour. Few samples allow only few regressors. Then regressions on the input alone, and on input and prediction, reach farther back, and
//! the one that explains most counts.

use super::limits::{LAGS, MODERATE, RIDGE, SAMPLES_PER_REGRESSOR};
use crate::identify::block::standardised;
use crate::linalg;
use crate::linear::correlation::mean;
use crate::linear::least_squares::regression;

/// The share of the error's variance that is explained out of sample; zero if nothing is, or the samples are too few.
pub(super) fn explained(error: &[f64], u: &[f64], predicted: &[f64]) -> f64 {
    let (u, p) = (moderate(u), moderate(predicted));
    let power = |v: &[f64], k: i32| standardised(&v.iter().map(|x| x.powi(k)).collect::<Vec<f64>>());
    let (u2, p2, p3) = (power(&u, 2), power(&p, 2), power(&p, 3));
    let signals: [&[f64]; 5] = [&u, &p, &u2, &p2, &p3];
    let sets = [1, 2, 5].map(|count| explained_by(error, &signals[..count]));
    sets.into_iter().fold(0.0, f64::max)
}

/// The share that these signals explain, with as many lags as the samples allow.
fn explained_by(error: &[f64], signals: &[&[f64]]) -> f64 {
    let n = error.len();
    let lags = LAGS.min(n / 2 / SAMPLES_PER_REGRESSOR / signals.len());
    if lags == 0 {
        return 0.0;
    }
    let columns: Vec<Vec<f64>> = signals
        .iter()
        .flat_map(|s| (0..lags).map(move |lag| s[lags - 1 - lag..n - lag].to_vec()))
        .collect();
    let error = &error[lags - 1..];
    let half = error.len() / 2;
    predicted_share(error, &columns, |k| k < half)
}

/// The share of the error's variance that a regression on columns predicts of one part from the other, in turn: `first` says which
/// samples are of the first part.
pub(super) fn predicted_share(error: &[f64], columns: &[Vec<f64>], first: impl Fn(usize) -> bool) -> f64 {
    let (mut unexplained, mut all) = (0.0, 0.0);
    for in_fit in [true, false] {
        let first = &first;
        let of = move |part: bool| (0..error.len()).filter(move |k| first(*k) == part);
        let pick = |v: &[f64]| -> Vec<f64> { of(in_fit).map(|k| v[k]).collect() };
        let mut target = pick(error);
        let level = mean(&target);
        target.iter_mut().for_each(|e| *e -= level);
        let fitted: Vec<Vec<f64>> = columns.iter().map(|c| pick(c)).collect();
        let mut equations = regression(&target, &fitted, 0);
        let size = columns.len();
        (0..size).for_each(|i| equations.normal[i * size + i] += RIDGE * target.len() as f64);
        let Some(c) = linalg::solve_positive_definite(&equations.normal, &equations.descent) else {
            return 0.0;
        };
        for t in of(!in_fit) {
            let guess: f64 = columns.iter().zip(&c).map(|(x, c)| c * x[t]).sum();
            unexplained += (error[t] - level - guess).powi(2);
            all += (error[t] - level).powi(2);
        }
    }
    if all > 0.0 {
        (1.0 - unexplained / all).max(0.0)
    } else {
        0.0
    }
}

/// The signal in standard deviations, cut so that single samples do not decide a regression on powers.
pub(super) fn moderate(v: &[f64]) -> Vec<f64> {
    standardised(v).iter().map(|x| x.clamp(-MODERATE, MODERATE)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::gaussian;

    #[test]
    fn noise_of_any_colour_is_not_explained_and_a_missed_function_is() {
        let (u, p, e) = (gaussian(2500, 1), gaussian(2500, 2), gaussian(2500, 3));
        assert!(explained(&e, &u, &p) < 0.02);
        let smooth: Vec<f64> = e.windows(5).map(|w| w.iter().sum()).collect();
        assert!(explained(&smooth, &u[4..], &p[4..]) < 0.1);
        let missed: Vec<f64> = (0..2500)
            .map(|t| e[t] + if t >= 3 { p[t - 3] * p[t - 3] } else { 0.0 })
            .collect();
        let share = explained(&missed, &u, &p);
        assert!((share - 2.0 / 3.0).abs() < 0.08, "{share}");
    }

    #[test]
    fn few_samples_are_spent_on_lags_of_the_input() {
        let (u, p, e) = (gaussian(250, 4), gaussian(250, 5), gaussian(250, 6));
        let late: Vec<f64> = (0..250)
            .map(|t| e[t] + if t >= 9 { 2.0 * u[t - 9] } else { 0.0 })
            .collect();
        let share = explained(&late, &u, &p);
        assert!(share > 0.6 && share < 0.9, "{share}");
        assert!(explained(&e, &u, &p) < 0.1);
    }

    #[test]
    fn too_few_samples_and_constants_explain_nothing() {
        assert_eq!(explained(&[1.0; 30], &[1.0; 30], &[1.0; 30]), 0.0);
        assert_eq!(explained(&[0.0; 2000], &[1.0; 2000], &[1.0; 2000]), 0.0);
    }
}
