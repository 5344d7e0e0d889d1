use crate::error::Stopped;
use std::ops::ControlFlow;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::nonlinearity::{
    Choice, Degree, Estimator, Kernel, KernelRegression, NearestNeighbours, PolynomialRegression, SplineRegression,
};
use crate::signal::gaussian;

/// An autoregression of order one and unit variance.
fn autoregression(seed: u64, n: usize, a: f64) -> Vec<f64> {
    let mut state = 0.0;
    let step = |e: f64| {
        state = a * state + (1.0 - a * a).sqrt() * e;
        state
    };
    gaussian(n + 100, seed).into_iter().map(step).skip(100).collect()
}

fn abscissas(seed: u64, n: usize) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..n).map(|_| rng.random_range(-2.0..2.0)).collect()
}

fn go_on(_: usize, _: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn polynomial(degree: usize) -> PolynomialRegression {
    PolynomialRegression {
        degree: Choice::Fixed(degree),
        ..PolynomialRegression::default()
    }
}

const SCHEMES: [Scheme; 3] = [Scheme::Wild, Scheme::Pairs, Scheme::MovingBlock { length: Some(1) }];

#[test]
fn bands_of_a_polynomial_are_those_of_least_squares() {
    let n = 60;
    let (x, e) = (abscissas(1, n), gaussian(n, 2));
    let y: Vec<f64> = x.iter().zip(&e).map(|(x, e)| 1.0 + x - 0.5 * x * x + 0.3 * e).collect();
    let at = [-1.5, 0.0, 1.9];
    let exact: Vec<f64> = {
        let fit = polynomial(2).fit(&[&x], &y, None).unwrap();
        let fitted = crate::nonlinearity::Regression::predict(&fit, &[&x]).unwrap();
        let left: f64 = y.iter().zip(fitted).map(|(y, m)| (y - m).powi(2)).sum();
        let sigma = (left / (n - 3) as f64).sqrt();
        // sigma^2 l' l with l' = phi(q)' (X'X)^-1 X'.
        let row = |x: f64| [1.0, x, x * x];
        let mut gram = [0.0; 9];
        x.iter()
            .map(|&x| row(x))
            .for_each(|r| (0..9).for_each(|k| gram[k] += r[k / 3] * r[k % 3]));
        let solve = |q| crate::linalg::solve_positive_definite(&gram, &row(q)).unwrap();
        let variance = |q: f64| solve(q).iter().zip(row(q)).map(|(a, b)| a * b).sum::<f64>();
        at.iter().map(|&q| sigma * variance(q).sqrt()).collect()
    };
    for scheme in SCHEMES {
        let method = BootstrapBand {
            scheme,
            resamples: 2000,
            ..BootstrapBand::default()
        };
        let band = method
            .for_estimator(&polynomial(2), &[&x], &y, None, &[&at], &mut go_on)
            .unwrap();
        for j in 0..at.len() {
            // A projection needs no correction; residuals by their place differ from their mean: 15 %.
            assert!((band.centre[j] - band.estimate[j]).abs() < 1e-9);
            let ratio = band.standard_error[j] / exact[j];
            assert!((ratio - 1.0).abs() < 0.25, "{scheme:?} {j}: {ratio}");
            // Student's quantile between 10 and 40 degrees of freedom, and what 2000 draws make of it.
            let factor = (band.upper[j] - band.centre[j]) / band.standard_error[j];
            assert!(factor > 1.9 && factor < 2.6, "{scheme:?} {j}: {factor}");
        }
    }
}

#[test]
fn bootstrap_and_robust_correction_agree_on_the_width() {
    let n = 800;
    let (x, e) = (abscissas(3, n), gaussian(n, 4));
    let y: Vec<f64> = x
        .iter()
        .zip(&e)
        .map(|(x, e)| x.sin() + (0.1 + 0.1 * x.abs()) * e)
        .collect();
    let at = [-1.0, 0.0, 1.0];
    let method = KernelRegression {
        kernel: Kernel::Epanechnikov,
        bandwidth: 0.6,
    };
    let fit = method.fit(&x, &y).unwrap().with_degree(Degree::Linear);
    let at_the_same_bandwidth = RobustBand {
        undersmoothing: 0.0,
        ..RobustBand::default()
    };
    let robust = at_the_same_bandwidth.for_kernel(&fit, &at).unwrap();
    let refit = |x: &[&[f64]], y: &[f64], w: Option<&[f64]>| -> Result<Box<dyn crate::nonlinearity::Regression>> {
        let fit = match w {
            None => method.fit(x[0], y)?,
            Some(w) => method.fit_weighted(x[0], y, w)?,
        };
        Ok(Box::new(fit.with_degree(Degree::Linear)))
    };
    for scheme in SCHEMES {
        let band = BootstrapBand {
            scheme,
            ..BootstrapBand::default()
        }
        .run(&refit, &[&x], &y, None, &[&at], &mut go_on);
        let band = band.unwrap();
        for j in 0..at.len() {
            // Twicing and the local quadratic are different kernels: int K^2 = 0.97 and 1.25, 12 % in the root.
            let ratio = band.standard_error[j] / robust.standard_error[j];
            assert!(ratio > 0.75 && ratio < 1.15, "{scheme:?} {j}: {ratio}");
            assert!((band.centre[j] - robust.centre[j]).abs() < robust.standard_error[j]);
        }
    }
}

#[test]
fn blocks_see_the_dependence_that_others_miss() {
    // The mean of an autoregression: its variance is (1 + a) / (1 - a) = 5.67 times that of independent errors.
    let n = 2000;
    let e = autoregression(5, n, 0.7);
    let x = vec![0.0; n];
    let error = |scheme| {
        let method = BootstrapBand {
            scheme,
            resamples: 499,
            ..BootstrapBand::default()
        };
        let band = method
            .for_estimator(&polynomial(0), &[&x], &e, None, &[&[0.0]], &mut go_on)
            .unwrap();
        (band.standard_error[0], band.method)
    };
    let (naive, printed) = error(Scheme::Wild);
    assert!((naive * (n as f64).sqrt() - 1.0).abs() < 0.15, "{naive}");
    assert!(printed.contains("wild bootstrap, 499 resamples") && printed.contains("errors independent"));
    let (blocks, printed) = error(Scheme::MovingBlock { length: None });
    assert!(
        printed.contains("blocks of") && printed.contains("may be dependent"),
        "{printed}"
    );
    let ratio = blocks / naive;
    assert!(ratio > 1.8 && ratio < 2.8, "{ratio}"); // root of 5.67: 2.38; blocks lose a part of it
}

#[test]
fn the_automatic_block_length_is_the_theory_s() {
    // (1.5 (2 a / (1 - a^2))^2)^(1/3) n^(1/3): for a = 0.7 and n = 1000 that is 22.4.
    let seeds = 40;
    let mean = |a: f64| {
        (0..seeds)
            .map(|s| automatic_block_length(&autoregression(s, 1000, a)) as f64)
            .sum::<f64>()
            / seeds as f64
    };
    assert!((mean(0.7) - 22.4).abs() < 4.0, "{}", mean(0.7));
    assert!(mean(0.0) < 4.0, "{}", mean(0.0));
    assert_eq!(automatic_block_length(&[1.0; 50]), 1);
    assert_eq!(automatic_block_length(&[1.0, 2.0]), 1);
}

#[test]
fn simultaneous_bands_are_wider_and_of_one_factor() {
    let n = 300;
    let (x, e) = (abscissas(6, n), gaussian(n, 7));
    let y: Vec<f64> = x.iter().zip(&e).map(|(x, e)| x.cos() + 0.2 * e).collect();
    let at: Vec<f64> = (0..15).map(|i| -1.4 + 0.2 * f64::from(i)).collect();
    let estimator = SplineRegression {
        penalty: Choice::Fixed(0.05),
        ..SplineRegression::default()
    };
    let band = |kind| {
        let method = BootstrapBand {
            kind,
            resamples: 299,
            ..BootstrapBand::default()
        };
        method
            .for_estimator(&estimator, &[&x], &y, None, &[&at], &mut go_on)
            .unwrap()
    };
    let [point, all] = [BandKind::Pointwise, BandKind::Simultaneous].map(band);
    assert_eq!(point.centre, all.centre);
    assert!((0..15).all(|j| all.upper[j] > point.upper[j] && all.lower[j] < point.lower[j]));
    let widths: Vec<f64> = (0..15)
        .map(|j| (all.upper[j] - all.centre[j]) / all.standard_error[j])
        .collect();
    assert!(widths.iter().all(|w| (2.4..4.5).contains(w)), "{widths:?}");
}

#[test]
fn two_columns_weights_threads_and_blocks_of_one() {
    let n = 200;
    let (a, b, e) = (abscissas(8, n), abscissas(9, n), gaussian(n, 10));
    let y: Vec<f64> = (0..n).map(|i| a[i] * b[i] + 0.1 * e[i]).collect();
    let w: Vec<f64> = (0..n).map(|i| (i % 4) as f64).collect();
    let estimator = NearestNeighbours {
        neighbours: Choice::Fixed(12),
        ..NearestNeighbours::default()
    };
    let at: [&[f64]; 2] = [&[0.5, 0.0], &[0.5, -1.0]];
    let run = |threads, scheme| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let method = BootstrapBand {
            scheme,
            resamples: 99,
            ..BootstrapBand::default()
        };
        pool.install(|| {
            method
                .for_estimator(&estimator, &[&a, &b], &y, Some(&w), &at, &mut go_on)
                .unwrap()
        })
    };
    for scheme in SCHEMES {
        let one = run(1, scheme);
        assert_eq!(one, run(3, scheme));
        assert!(one.x == at && one.lower[0] < 0.25 && 0.25 < one.upper[0], "{one:?}");
    }
    // Blocks of one point are pairs, except for the limit on the degrees of freedom.
    assert_eq!(run(1, Scheme::Pairs).standard_error, run(1, SCHEMES[2]).standard_error);
}

#[test]
fn a_bootstrap_reports_and_can_be_stopped() {
    let (x, y) = (abscissas(11, 50), gaussian(50, 12));
    let mut seen = Vec::new();
    let method = BootstrapBand {
        resamples: 100,
        ..BootstrapBand::default()
    };
    let run = |progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>| {
        method.for_estimator(&polynomial(1), &[&x], &y, None, &[&[0.0]], progress)
    };
    run(&mut |done, total| {
        seen.push((done, total));
        ControlFlow::Continue(())
    })
    .unwrap();
    assert!(
        seen.windows(2).all(|w| w[0].0 < w[1].0) && seen.last() == Some(&(132, 132)),
        "{seen:?}"
    );
    let stopped = run(&mut |done, _| {
        if done > 50 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    assert_eq!(
        stopped.unwrap_err(),
        Error::Stopped(Stopped::Sampling { done: 64, total: 132 })
    );
}

#[test]
fn bad_parameters_and_data_are_refused() {
    let (x, y) = (abscissas(11, 50), gaussian(50, 12));
    let usual = BootstrapBand {
        resamples: 99,
        ..BootstrapBand::default()
    };
    let run = |method: BootstrapBand, y: &[f64], at: &[&[f64]]| {
        method.for_estimator(&polynomial(1), &[&x[..y.len()]], y, None, at, &mut go_on)
    };
    let message = |method, y: &[f64], at: &[&[f64]]| run(method, y, at).unwrap_err().to_string();
    for length in [0, 26] {
        let scheme = Scheme::MovingBlock { length: Some(length) };
        let text = message(BootstrapBand { scheme, ..usual }, &y, &[&[0.0]]);
        assert!(
            text.contains("the block length of the bootstrap is") && text.contains("half the number of points"),
            "{text}"
        );
    }
    let text = message(BootstrapBand { resamples: 39, ..usual }, &y, &[&[0.0]]);
    assert!(text.contains("the number of resamples is 39"), "{text}");
    assert!(
        message(BootstrapBand { level: 1.5, ..usual }, &y, &[&[0.0]]).contains("the level of a confidence band is 1.5")
    );
    assert!(message(usual, &y[..4], &[&[0.0]]).contains("needs at least 5 samples, but there are 4"));
    assert!(message(usual, &y, &[&[0.0], &[0.0]]).contains("takes 1 column, but 2 were given"));
    let mut hole = y.clone();
    hole[7] = f64::NAN;
    assert!(message(usual, &hole, &[&[0.0]]).contains("column 'y' is NaN at sample 7"));
    // Beyond the data the estimate is not a number, and so is the band.
    let band = run(usual, &y, &[&[0.0, 99.0]]).unwrap();
    assert!(band.lower[0] < band.upper[0] && band.estimate[1].is_nan() && band.lower[1].is_nan());
}

#[test]
fn quantiles_are_those_of_one_more_draw() {
    let mut values: Vec<f64> = (1..=99).rev().map(f64::from).collect();
    assert_eq!(upper_quantile(&mut values, 0.95), 95.0);
    assert_eq!(upper_quantile(&mut values, 0.999), 99.0);
    assert!(upper_quantile(&mut [], 0.5).is_nan());
}
