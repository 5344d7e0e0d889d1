//! The fast sums against direct summation.

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_distr::{Cauchy, Distribution, StandardNormal};

use super::*;

/// The brute-force twin of (13).
fn direct(x: &[f64], y: &[f64], kernel: Kernel, h: f64, q: f64, skip: Option<usize>) -> f64 {
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    let (mut s, mut t) = (0.0, 0.0);
    for i in 0..x.len() {
        if Some(i) != skip {
            let k = if (q - x[i]).abs() <= kernel.reach() * h {
                kernel.weight((q - x[i]) / h)
            } else {
                0.0
            };
            s += k;
            t += k * (y[i] - mean);
        }
    }
    mean + t / s
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
fn leave_one_out_agrees_with_leaving_each_point_out() {
    for (name, x) in hard_abscissas(2, 400) {
        let y = response(&x, 3.0);
        let data = Sorted::new(&x, &y);
        for kernel in Kernel::ALL {
            for h in [0.05, 0.5, 4.0] {
                let want: f64 = (0..x.len())
                    .map(|i| {
                        let other = direct(&x, &y, kernel, h, x[i], Some(i));
                        let other = if other.is_nan() {
                            data.mean + data.nearest(x[i], data_index(&data, x[i]))
                        } else {
                            other
                        };
                        (y[i] - other).powi(2)
                    })
                    .sum::<f64>()
                    / x.len() as f64;
                let got = leave_one_out(&data, kernel, h);
                assert!(
                    (got - want).abs() < 1e-10 * want,
                    "{name} {kernel:?} h={h}: {got} {want}"
                );
            }
        }
    }
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
            Err(Error::InvalidParameter { .. })
        ));
    }
    assert!(matches!(method(1.0).fit(&[], &[]), Err(Error::TooShort { .. })));
    assert!(matches!(
        method(1.0).fit(&[0.0, f64::NAN], &[0.0, 1.0]),
        Err(Error::NonFinite { sample: 1, .. })
    ));
    assert!(matches!(
        method(1.0).fit(&[0.0, 1.0], &[0.0]),
        Err(Error::LengthMismatch { .. })
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
