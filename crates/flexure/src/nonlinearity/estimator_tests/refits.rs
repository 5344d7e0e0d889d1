//! Leave-one-out scores against refits without each point.

use super::*;
use crate::linalg;
use crate::nonlinearity::estimator::Points;
use crate::nonlinearity::functions::Functions;
use crate::nonlinearity::least_squares::Nested;

/// The weighted least-squares fit on the first `terms` functions without the point `skip`, at `at`.
fn refit(functions: &Functions, terms: usize, p: &Points, skip: usize, at: f64) -> f64 {
    let mut v = vec![0.0; terms];
    let (mut rows, mut rhs) = (Vec::new(), Vec::new());
    for i in (0..p.len()).filter(|i| *i != skip) {
        functions.values(p.x[0][i], &mut v);
        let root = p.w[i].sqrt();
        rows.extend(v.iter().map(|v| root * v));
        rhs.push(root * p.y[i]);
    }
    let c = linalg::least_squares(&rows, terms, &rhs).unwrap();
    functions.values(at, &mut v);
    v.iter().zip(&c).map(|(v, c)| v * c).sum()
}

#[test]
fn of_a_series() {
    let (x, y, w) = sample(50);
    let points = Points::new("a test", 1, &[&x], &y, Some(&w)).unwrap();
    let total: f64 = w.iter().sum();
    for (functions, offset) in [
        (Functions::Fourier { low: -1.0, length: 2.0 }, points.mean()),
        (Functions::Cosine { low: -1.0, length: 2.0 }, points.mean()),
        (Functions::Legendre { centre: 0.0, half: 1.0 }, points.mean()),
        (
            Functions::Hermite {
                centre: 0.0,
                scale: 0.5,
            },
            0.0,
        ),
    ] {
        let scores = Nested::fit(functions.clone(), 9, &points, offset).scores(&points);
        assert_eq!(scores.len(), 9);
        for score in scores {
            let residual = |i| points.y[i] - refit(&functions, score.parameter, &points, i, points.x[0][i]);
            let want: f64 = (0..50).map(|i| points.w[i] * residual(i).powi(2) / total).sum();
            let error = (score.leave_one_out - want).abs() / want;
            assert!(error < 1e-10, "{functions:?} {} {error:e}", score.parameter);
        }
    }
}

#[test]
fn of_a_spline() {
    let (x, y, w) = sample(40);
    let total: f64 = w.iter().sum();
    let fit = SplineRegression::default().fit(&[&x], &y, Some(&w)).unwrap();
    for candidate in fit.search().unwrap().curve.iter().step_by(5) {
        let method = SplineRegression {
            penalty: Choice::Fixed(candidate.parameter),
            outside: Outside::Linear,
            ..Default::default()
        };
        // With a knot at every x the smoothing spline without a point is the smoothing spline of the others.
        let without = |i: usize| {
            let drop = |v: &[f64]| (0..40).filter(|j| *j != i).map(|j| v[j]).collect::<Vec<_>>();
            let fit = method.fit(&[&drop(&x)], &drop(&y), Some(&drop(&w))).unwrap();
            fit.predict(&[&[x[i]]]).unwrap()[0]
        };
        let want: f64 = (0..40).map(|i| w[i] * (y[i] - without(i)).powi(2) / total).sum();
        let error = (candidate.leave_one_out - want).abs() / want;
        // Near interpolation and near a straight line the normal equations are ill conditioned.
        let bar = if (2.02..39.9).contains(&candidate.degrees_of_freedom) {
            1e-10
        } else {
            1e-8
        };
        assert!(error < bar, "{} {error:e}", candidate.parameter);
    }
}

#[test]
fn of_the_haar_series() {
    let (mut x, y, w) = sample(50);
    x[49] = 1.9; // alone in its cell, and in the ones around
    let total: f64 = w.iter().sum();
    let fit = HaarRegression::default().fit(&[&x], &y, Some(&w)).unwrap();
    for candidate in &fit.search().unwrap().curve {
        let method = HaarRegression {
            levels: Choice::Fixed(candidate.parameter),
            outside: Outside::Nan,
        };
        let mut want = 0.0;
        for i in 0..50 {
            let mut others = w.clone();
            others[i] = 0.0;
            let keep = x.iter().enumerate().filter(|(j, _)| *j != i);
            let (low, high) = keep.fold((9.0_f64, -9.0_f64), |(l, h), (_, x)| (l.min(*x), h.max(*x)));
            if low > -1.0 || high < 1.9 {
                // The range would change. So the prediction is the mean over the smallest dyadic interval with other points.
                want += w[i] * by_hand(&x, &y, &others, candidate.parameter, x[i], y[i]).powi(2) / total;
            } else {
                let fit = method.fit(&[&x], &y, Some(&others)).unwrap();
                want += w[i] * (y[i] - fit.predict(&[&[x[i]]]).unwrap()[0]).powi(2) / total;
            }
        }
        let error = (candidate.leave_one_out - want).abs() / want;
        assert!(error < 1e-10, "{} {error:e}", candidate.parameter);
    }
}

/// The residual of the Haar series on [-1, 1.9] with the weights `w`.
fn by_hand(x: &[f64], y: &[f64], w: &[f64], levels: usize, at: f64, own: f64) -> f64 {
    for level in (0..=levels).rev() {
        let cells = f64::from(1 << level);
        let cell = |x: f64| ((x + 1.0) / 2.9 * cells).floor().min(cells - 1.0);
        let inside = (0..x.len()).filter(|&j| cell(x[j]) == cell(at));
        let (weight, sum) = inside.fold((0.0, 0.0), |(s, t), j| (s + w[j], t + w[j] * y[j]));
        if weight > 0.0 {
            return own - sum / weight;
        }
    }
    f64::NAN
}
