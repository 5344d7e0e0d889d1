//! The fast sums against direct summation.

use crate::error::{DataError, ParameterError};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_distr::{Cauchy, Distribution, StandardNormal};

use super::*;
use crate::nonlinearity::kernel::leave_one_out;

/// The brute-force twin of (13) and of the local line: weighted least squares, centred before squaring.
fn direct_fit(data: [&[f64]; 3], kernel: Kernel, degree: Degree, h: f64, q: f64, skip: Option<usize>) -> f64 {
    let [x, y, w] = data;
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    let k: Vec<f64> = (0..x.len())
        .map(|i| {
            let inside = (q - x[i]).abs() <= kernel.reach() * h && Some(i) != skip;
            if inside {
                w[i] * kernel.weight((q - x[i]) / h)
            } else {
                0.0
            }
        })
        .collect();
    let sum = |f: &dyn Fn(usize) -> f64| (0..x.len()).filter(|&i| k[i] > 0.0).map(|i| k[i] * f(i)).sum::<f64>();
    let s = sum(&|_| 1.0);
    let (cx, cy) = (sum(&|i| x[i] - q) / s, sum(&|i| y[i] - mean) / s);
    let spread = sum(&|i| (x[i] - q - cx).powi(2));
    if degree == Degree::Constant || !(spread > 1e-18 * h * h * s) {
        return mean + cy;
    }
    mean + cy - cx * sum(&|i| (x[i] - q - cx) * (y[i] - mean - cy)) / spread
}

fn direct(x: &[f64], y: &[f64], kernel: Kernel, h: f64, q: f64, skip: Option<usize>) -> f64 {
    direct_fit([x, y, &vec![1.0; x.len()]], kernel, Degree::Constant, h, q, skip)
}

/// Weights of very different size, a fifth of them zero.
fn weights(n: usize) -> Vec<f64> {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(55);
    (0..n)
        .map(|_| match rng.random_range(0..5) {
            0 => 0.0,
            k => 10f64.powi(k - 2) * rng.random_range(0.5..2.0),
        })
        .collect()
}

/// Abscissas that broke plain prefix sums elsewhere.
fn hard_abscissas(seed: u64, n: usize) -> Vec<(&'static str, Vec<f64>)> {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut draw =
        |f: &mut dyn FnMut(&mut rand_pcg::Pcg64) -> f64| -> Vec<f64> { (0..n).map(|_| f(&mut rng)).collect() };
    let cauchy = Cauchy::new(0.0, 1.0).unwrap();
    vec![
        ("uniform", draw(&mut |r| r.random_range(-2.0..2.0))),
        ("offset", draw(&mut |r| 1e6 + r.random_range(-2.0..2.0))),
        ("cauchy", draw(&mut |r| cauchy.sample(r))),
        (
            "clusters",
            draw(&mut |r| {
                let z: f64 = StandardNormal.sample(r);
                (r.random_range(0..4) as f64) * 0.7 + 1e-5 * z
            }),
        ),
        ("ties", draw(&mut |r| (r.random_range(0..12) as f64) * 0.25)),
    ]
}

fn response(x: &[f64], offset: f64) -> Vec<f64> {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(99);
    x.iter()
        .map(|x| {
            let e: f64 = StandardNormal.sample(&mut rng);
            offset + x.sin() + 0.3 * e
        })
        .collect()
}

#[test]
fn estimates_agree_with_direct_summation() {
    for (name, x) in hard_abscissas(1, 1500) {
        for offset in [0.0, 1e6] {
            let y = response(&x, offset);
            let mut sorted = x.clone();
            sorted.sort_by(f64::total_cmp);
            for kernel in Kernel::ALL {
                for h in [0.03, 0.4, 3.0] {
                    let fit = KernelRegression { kernel, bandwidth: h }.fit(&x, &y).unwrap();
                    let at: Vec<f64> = (0..60)
                        .map(|i| sorted[i * 25] + 0.3 * h * ((i % 3) as f64 - 1.0))
                        .collect();
                    for (q, got) in at.iter().zip(fit.predict(&at)) {
                        let want = direct(&x, &y, kernel, h, *q, None);
                        let error = (got - want).abs() / want.abs().max(1.0);
                        // The sample at 1e6 itself is only known to 1e-10, so the edges' weights are too.
                        assert!(error < 1e-11, "{name} {kernel:?} h={h} q={q}: {got} {want} ({error:e})");
                    }
                }
            }
        }
    }
}

#[test]
fn weighted_estimates_agree_with_least_squares_at_the_point() {
    for (name, x) in hard_abscissas(3, 1200) {
        let y = response(&x, 1e3);
        let mut sorted = x.clone();
        sorted.sort_by(f64::total_cmp);
        for (degree, w) in [Degree::Constant, Degree::Linear]
            .into_iter()
            .flat_map(|d| [(d, None), (d, Some(weights(x.len())))])
        {
            let ones = vec![1.0; x.len()];
            let data = [&x[..], &y, w.as_ref().unwrap_or(&ones)];
            for kernel in Kernel::ALL {
                for h in [0.03, 0.4, 3.0] {
                    let method = KernelRegression { kernel, bandwidth: h };
                    let at: Vec<f64> = (0..60)
                        .map(|i| sorted[(i * 7) % 60 * 20] + 0.3 * h * ((i % 3) as f64 - 1.0))
                        .chain([f64::NAN, 1e9])
                        .collect();
                    let fit = match &w {
                        None => method.fit(&x, &y),
                        Some(w) => method.fit_weighted(&x, &y, w),
                    };
                    let estimates = fit.unwrap().with_degree(degree).predict(&at);
                    for (q, got) in at.iter().zip(estimates) {
                        let want = direct_fit(data, kernel, degree, h, *q, None);
                        let what = format!("{name} {kernel:?} {degree:?} {} h={h} q={q}: {got} {want}", w.is_some());
                        assert_eq!(got.is_nan(), want.is_nan(), "{what}");
                        if !want.is_nan() {
                            let error = (got - want).abs() / want.abs().max(1.0);
                            assert!(error < 1e-11, "{what} ({error:e})");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn leave_one_out_agrees_with_leaving_each_point_out() {
    for (name, x) in hard_abscissas(2, 400) {
        let y = response(&x, 3.0);
        for (degree, w) in [Degree::Constant, Degree::Linear]
            .into_iter()
            .flat_map(|d| [(d, vec![1.0; x.len()]), (d, weights(x.len()))])
        {
            let data = Sorted::new(&x, &y, Some(&w));
            for kernel in Kernel::ALL {
                for h in [0.05, 0.5, 4.0] {
                    let squares = (0..x.len()).filter(|&i| w[i] > 0.0).map(|i| {
                        let other = direct_fit([&x, &y, &w], kernel, degree, h, x[i], Some(i));
                        let other = if other.is_nan() {
                            data.mean + data.nearest(x[i], data_index(&data, x[i]))
                        } else {
                            other
                        };
                        w[i] * (y[i] - other).powi(2)
                    });
                    let want = squares.sum::<f64>() / w.iter().sum::<f64>();
                    let got = leave_one_out(&data, kernel, degree, &[h])[0];
                    // The line through two neighbours in the window's edge may shoot far off.
                    assert!(
                        (got - want).abs() < 1e-9 * want,
                        "{name} {kernel:?} {degree:?} h={h}: {got} {want}"
                    );
                }
            }
        }
    }
}

#[test]
fn scores_over_many_parts_are_exact_and_the_same_on_any_number_of_threads() {
    for (name, x) in hard_abscissas(7, 20_000) {
        if name == "clusters" || name == "ties" {
            continue; // Thousands of points in every window: too long to sum one by one.
        }
        let y = response(&x, 0.0);
        let data = Sorted::new(&x, &y, None);
        for kernel in [Kernel::Epanechnikov, Kernel::Triangular, Kernel::Triweight] {
            let scores = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| leave_one_out(&data, kernel, Degree::Constant, &[0.01, 0.003]))
            };
            let one = scores(1);
            assert_eq!(one, scores(2));
            assert_eq!(one, scores(5));
            for (h, got) in [0.01, 0.003].into_iter().zip(one) {
                let residual = |i: usize| {
                    let others = data.direct_sums(kernel, Degree::Constant, h, data.x[i], Some(i));
                    let fit = others.fit(Degree::Constant).map(|fit| fit.value);
                    data.y[i] - fit.unwrap_or_else(|| data.nearest(data.x[i], Some(i)))
                };
                let want = (0..data.len()).map(|i| residual(i).powi(2)).sum::<f64>() / data.len() as f64;
                assert!(
                    (got - want).abs() < 1e-11 * want,
                    "{name} {kernel:?} h={h}: {got} {want}"
                );
            }
        }
    }
}

#[test]
fn a_local_line_follows_a_line_up_to_the_boundary() {
    let x: Vec<f64> = (0..100).map(|i| (f64::from(i) / 99.0).powi(2)).collect();
    let y: Vec<f64> = x.iter().map(|x| 3.0 - 2.0 * x).collect();
    for kernel in Kernel::ALL {
        let fit = KernelRegression { kernel, bandwidth: 0.3 }
            .fit(&x, &y)
            .unwrap()
            .with_degree(Degree::Linear);
        for q in [0.0, 0.4, 1.0, 1.1] {
            assert!((fit.value(q) - (3.0 - 2.0 * q)).abs() < 1e-12, "{kernel:?} {q}");
        }
    }
}

#[test]
fn a_weight_of_two_is_an_observation_twice() {
    let (_, x) = hard_abscissas(6, 80).swap_remove(0);
    let y = response(&x, 0.0);
    let twice = |v: &[f64]| v.iter().chain(&v[..30]).copied().collect::<Vec<_>>();
    let w: Vec<f64> = (0..80).map(|i| if i < 30 { 2.0 } else { 1.0 }).collect();
    for kernel in Kernel::ALL {
        let method = KernelRegression { kernel, bandwidth: 0.5 };
        let a = method.fit_weighted(&x, &y, &w).unwrap().predict(&x);
        let b = method.fit(&twice(&x), &twice(&y)).unwrap().predict(&x);
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}

#[test]
fn bad_weights_are_refused() {
    let method = KernelRegression {
        kernel: Kernel::Epanechnikov,
        bandwidth: 1.0,
    };
    let message = |w: &[f64]| {
        method
            .fit_weighted(&[0.0, 1.0], &[0.0, 1.0], w)
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        message(&[1.0, -2.0]),
        "the weight of sample 1 is -2, but must be zero or positive, and finite"
    );
    assert!(message(&[1.0, f64::NAN]).contains("the weight of sample 1 is NaN"));
    assert!(message(&[1.0]).contains("'weights' has 1 samples where 2 were expected"));
    assert!(message(&[0.0, 0.0]).contains("needs at least 1 samples, but there are 0"));
}

/// The index of an isolated point (its abscissa occurs once).
fn data_index(data: &Sorted, x: f64) -> Option<usize> {
    data.x.iter().position(|&v| v == x)
}

#[test]
fn a_point_without_data_in_reach_is_not_a_number() {
    let fit = KernelRegression {
        kernel: Kernel::Triweight,
        bandwidth: 0.5,
    }
    .fit(&[0.0, 1.0], &[1.0, 2.0])
    .unwrap();
    assert!(fit.value(1.6).is_nan() && fit.value(f64::NAN).is_nan());
    assert_eq!(fit.value(0.2), 1.0);
}

#[test]
fn bad_input_is_refused() {
    let method = |bandwidth| KernelRegression {
        kernel: Kernel::Uniform,
        bandwidth,
    };
    for h in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            method(h).fit(&[0.0], &[0.0]),
            Err(Error::Parameter(ParameterError::OutOfRange { .. }))
        ));
    }
    assert!(matches!(
        method(1.0).fit(&[], &[]),
        Err(Error::Data(DataError::TooShort { .. }))
    ));
    assert!(matches!(
        method(1.0).fit(&[0.0, f64::NAN], &[0.0, 1.0]),
        Err(Error::Data(DataError::NonFinite { sample: 1, .. }))
    ));
    assert!(matches!(
        method(1.0).fit(&[0.0, 1.0], &[0.0]),
        Err(Error::Data(DataError::LengthMismatch { .. }))
    ));
}

#[test]
fn standard_errors_are_those_of_a_mean_for_one_wide_window() {
    // Uniform kernel over everything: the estimate is the mean, its standard error s / sqrt(n).
    let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
    let n = 4000;
    let x: Vec<f64> = (0..n).map(|_| rng.random_range(0.0..1.0)).collect();
    let y: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut rng)).collect();
    let fit = KernelRegression {
        kernel: Kernel::Uniform,
        bandwidth: 2.0,
    }
    .fit(&x, &y)
    .unwrap();
    let mean = y.iter().sum::<f64>() / n as f64;
    let s = (y.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1) as f64).sqrt();
    let error = fit.standard_errors(&[0.5])[0];
    assert!((error / (s / (n as f64).sqrt()) - 1.0).abs() < 1e-3, "{error}");
}

#[test]
fn a_point_alone_is_as_uncertain_as_the_others() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(8);
    let mut x: Vec<f64> = (0..2000).map(|_| rng.random_range(0.0..1.0)).collect();
    x.push(50.0);
    let y: Vec<f64> = x
        .iter()
        .map(|_| {
            let e: f64 = StandardNormal.sample(&mut rng);
            3.0 * e
        })
        .collect();
    let fit = KernelRegression {
        kernel: Kernel::Epanechnikov,
        bandwidth: 0.2,
    };
    let errors = fit.fit(&x, &y).unwrap().standard_errors(&[0.5, 50.0]);
    assert!(errors[0] < 0.3 && (errors[1] - 3.0).abs() < 0.3, "{errors:?}");
}

#[test]
fn scores_do_not_depend_on_the_size_of_the_weights() {
    let n = 3000;
    let x: Vec<f64> = (0..n).map(|i| (f64::from(i) * 0.618).fract()).collect();
    let y: Vec<f64> = x.iter().map(|x| (9.0 * x).sin() + (1e4 * x).cos()).collect();
    // Powers of two leave no rounding: every bit must be the same.
    let scores = |unit: f64, size: f64| {
        let w: Vec<f64> = (0..n).map(|i| size * f64::from(1 + i % 3)).collect();
        let y: Vec<f64> = y.iter().map(|y| unit * y).collect();
        let scores = leave_one_out(
            &Sorted::new(&x, &y, Some(&w)),
            Kernel::Epanechnikov,
            Degree::Constant,
            &[0.02, 0.3],
        );
        scores.iter().map(|s| s / (unit * unit)).collect::<Vec<f64>>()
    };
    let usual = scores(1.0, 1.0);
    for power in [-330.0, 330.0_f64] {
        assert_eq!(scores(1.0, power.exp2()), usual);
        assert_eq!(scores(power.exp2(), power.exp2()), usual);
        assert_eq!(scores((-power).exp2(), power.exp2()), usual);
    }
}

proptest! {
    /// Shifting and scaling x with h, and y, does to the estimate what the mathematics says.
    #[test]
    fn scaling_and_shifting(points in prop::collection::vec((-3.0..3.0f64, -5.0..5.0f64), 2..60),
                            scale in 0.01..100.0f64, gain in -10.0..10.0f64, offset in -50.0..50.0f64,
                            which in 0..6usize, q in -3.0..3.0f64) {
        let kernel = Kernel::ALL[which];
        let (x, y): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
        let fit = KernelRegression { kernel, bandwidth: 0.7 }.fit(&x, &y).unwrap();
        let xs: Vec<f64> = x.iter().map(|v| scale * v).collect();
        let ys: Vec<f64> = y.iter().map(|v| gain * v + offset).collect();
        let other = KernelRegression { kernel, bandwidth: 0.7 * scale }.fit(&xs, &ys).unwrap();
        let (a, b) = (fit.value(q), other.value(scale * q));
        // A point on the very edge of the window may be in or out after rounding.
        let on_edge = x.iter().any(|v| ((q - v).abs() - 0.7).abs() < 1e-9);
        prop_assume!(!on_edge);
        prop_assert_eq!(a.is_nan(), b.is_nan());
        if !a.is_nan() {
            prop_assert!((gain * a + offset - b).abs() < 1e-9 * (1.0 + b.abs() + gain.abs()));
        }
    }
}
