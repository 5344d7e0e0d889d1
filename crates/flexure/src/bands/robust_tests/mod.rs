use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::*;
use crate::nonlinearity::{Kernel, KernelRegression};
use crate::selection::BandwidthSearch;

mod reference;

/// n points with noise of the standard deviation `noise(x)` around m, x uniform on [-2, 2].
fn noisy(seed: u64, n: usize, m: impl Fn(f64) -> f64, noise: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let point = |_| {
        let (x, e): (f64, f64) = (rng.random_range(-2.0..2.0), StandardNormal.sample(&mut rng));
        (x, m(x) + noise(x) * e)
    };
    (0..n).map(point).unzip()
}

fn fit(x: &[f64], y: &[f64], kernel: Kernel, bandwidth: f64) -> KernelFit {
    KernelRegression { kernel, bandwidth }
        .fit(x, y)
        .unwrap()
        .with_degree(Degree::Linear)
}

#[test]
fn weights_of_the_ordinates_are_repetitions_in_the_estimate() {
    let (x, y) = noisy(3, 60, f64::sin, |_| 0.1);
    let w: Vec<f64> = (0..60).map(|i| f64::from(i % 3)).collect();
    let repeated = |v: &[f64]| -> Vec<f64> { (0..60).flat_map(|i| std::iter::repeat_n(v[i], i % 3)).collect() };
    let method = KernelRegression {
        kernel: Kernel::Biweight,
        bandwidth: 0.9,
    };
    let centre = |fit: KernelFit| {
        RobustBand {
            // The number of points is another.
            undersmoothing: 0.0,
            rho: 0.8,
            ..RobustBand::default()
        }
        .for_kernel(&fit, &[0.1, 1.9])
        .unwrap()
        .centre
    };
    let one = centre(method.fit_weighted(&x, &y, &w).unwrap());
    let other = centre(method.fit(&repeated(&x), &repeated(&y)).unwrap());
    assert!(one.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-12));
}

#[test]
fn the_noise_is_recovered_whatever_the_fit_takes_of_it() {
    // 20 points in a window: the raw squared residuals would be a sixth too small.
    let sigma = |x: f64| 0.1 + 0.2 * (x > 0.0) as u8 as f64;
    for kernel in [Kernel::Epanechnikov, Kernel::Gaussian, Kernel::Uniform] {
        let h = if kernel == Kernel::Gaussian { 0.22 } else { 0.5 };
        let mut sums = [[0.0; 2]; 2];
        for seed in 0..300 {
            let (x, y) = noisy(seed, 80, |x| 3.0 - x, sigma);
            let data = Sorted::new(&x, &y, None);
            let variances = noise_variances(Window { data: &data, kernel, h });
            // Away from the step, where the fit leaves its own share of both sides.
            for (x, v) in data.x.iter().zip(variances).filter(|(x, _)| x.abs() > 0.6) {
                let side = usize::from(*x > 0.0);
                sums[side][0] += v / sigma(*x).powi(2);
                sums[side][1] += 1.0;
            }
        }
        for [sum, count] in sums {
            // Squares of normal variables have the relative variance 2; neighbours share some of it.
            let tolerance = 4.0 * (2.0 / count).sqrt();
            assert!(
                (sum / count - 1.0).abs() < tolerance,
                "{kernel:?}: {} +- {tolerance}",
                sum / count
            );
        }
    }
}

#[test]
fn units_and_offsets_do_to_the_band_what_they_do_to_the_data() {
    let (x, y) = noisy(5, 400, |x| (2.0 * x).sin(), |x| 0.1 + 0.1 * x.abs());
    let at: Vec<f64> = (0..21).map(|i| -2.0 + 0.2 * f64::from(i)).collect();
    let along = |v: &[f64]| -> Vec<f64> { v.iter().map(|x| 1e3 + 8.0 * x).collect() };
    let ys: Vec<f64> = y.iter().map(|y| 500.0 - 3.0 * y).collect();
    for kind in [BandKind::Pointwise, BandKind::Simultaneous] {
        let method = RobustBand {
            kind,
            rho: 0.9,
            draws: 200,
            ..RobustBand::default()
        };
        for kernel in Kernel::ALL {
            let one = method.for_kernel(&fit(&x, &y, kernel, 0.3), &at).unwrap();
            let other = method
                .for_kernel(&fit(&along(&x), &ys, kernel, 2.4), &along(&at))
                .unwrap();
            for j in 0..at.len() {
                for (a, b) in [
                    (500.0 - 3.0 * one.lower[j], other.upper[j]),
                    (500.0 - 3.0 * one.centre[j], other.centre[j]),
                    (500.0 - 3.0 * one.estimate[j], other.estimate[j]),
                    (3.0 * one.standard_error[j], other.standard_error[j]),
                ] {
                    // A point on the very edge of a window may be in or out after rounding: not with these.
                    assert!(
                        (a - b).abs() < 1e-7 * (1.0 + b.abs()),
                        "{kernel:?} {kind:?} {j}: {a} {b}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_band_depends_neither_on_threads_nor_on_order() {
    let (x, y) = noisy(6, 500, f64::cos, |_| 0.3);
    let reversed = |v: &[f64]| v.iter().rev().copied().collect::<Vec<_>>();
    let method = RobustBand {
        kind: BandKind::Simultaneous,
        draws: 200,
        ..RobustBand::default()
    };
    let run = |threads, x: &[f64], y: &[f64]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            method
                .for_kernel(&fit(x, y, Kernel::Epanechnikov, 0.5), &[-1.0, 0.2, 1.9])
                .unwrap()
        })
    };
    let one = run(1, &x, &y);
    assert_eq!(one, run(3, &x, &y));
    assert_eq!(one, run(2, &reversed(&x), &reversed(&y)));
    let other = RobustBand { seed: 2, ..method }.for_kernel(&fit(&x, &y, Kernel::Epanechnikov, 0.5), &[0.0, 1.0]);
    assert_ne!(one.upper[0], other.unwrap().upper[0]);
}

#[test]
fn the_supremum_has_the_quantile_of_as_many_independent_variables() {
    // Windows that do not overlap: P(max |T| <= c) = (2 Phi(c) - 1)^k.
    let row = |k: usize| {
        Row {
            first: 40 * k,
            weights: vec![0.3; 40],
        }
        .standardised()
    };
    let rows: Vec<Row> = (0..9).map(row).collect();
    let c = supremum::quantile(&rows, 360, 0.95, 40_000, 1);
    let reached = (1.0 - 2.0 * crate::distributions::normal_below(-c)).powi(9);
    // Four standard errors of the share of 40,000 draws.
    assert!(
        (reached - 0.95).abs() < 4.0 * (0.95_f64 * 0.05 / 4e4).sqrt(),
        "{reached}"
    );
    // One and the same window many times over is one point.
    let c = supremum::quantile(&vec![row(0); 9], 40, 0.95, 40_000, 1);
    let reached = 1.0 - 2.0 * crate::distributions::normal_below(-c);
    assert!(
        (reached - 0.95).abs() < 4.0 * (0.95_f64 * 0.05 / 4e4).sqrt(),
        "{reached}"
    );
}

#[test]
fn cells_hardly_change_the_correlations() {
    let (x, y) = noisy(9, 3000, f64::cos, |x| 0.1 + x.abs());
    let data = Sorted::new(&x, &y, None);
    let window = Window {
        data: &data,
        kernel: Kernel::Epanechnikov,
        h: 0.4,
    };
    let variances = noise_variances(window);
    let smoother = Smoother {
        narrow: window,
        wide: window,
        degree: Degree::Linear,
        variances: &variances,
    };
    let correlation = |width: f64| {
        let cells = Cells::new(&data, &variances, width);
        let [a, b] = [0.3, 0.55].map(|q| {
            let row = smoother.at(q, &cells).unwrap().row;
            let mut all = vec![0.0; cells.x.len()];
            all[row.first..][..row.weights.len()].copy_from_slice(&row.weights);
            all
        });
        a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()
    };
    let (coarse, exact) = (correlation(0.4 / CELLS), correlation(0.0));
    assert!(
        (coarse - exact).abs() < 2e-3 && exact > 0.1 && exact < 0.9,
        "{coarse} {exact}"
    );
}

/// Coverages in percent, with their standard errors: of the pointwise band averaged over interior points, of the same at the left end of
/// the data's range, and of the simultaneous band.
fn coverage(degree: Degree, noise: fn(f64) -> f64) -> [(f64, f64); 3] {
    let m = |x: f64| (3.0 * x).sin();
    let at: Vec<f64> = (0..=20).map(|i| -1.5 + 0.15 * f64::from(i)).collect();
    let runs: Vec<[f64; 3]> = (0..400_u64)
        .into_par_iter()
        .map(|seed| {
            let (x, y) = noisy(1000 + seed, 400, m, noise);
            let kernel = Kernel::Epanechnikov;
            let bandwidth = BandwidthSearch::search(kernel, degree, &x, &y, None).unwrap().bandwidth;
            let fit = KernelRegression { kernel, bandwidth }
                .fit(&x, &y)
                .unwrap()
                .with_degree(degree);
            let share = |kind, at: &[f64]| {
                let band = RobustBand {
                    kind,
                    draws: 200,
                    seed,
                    ..RobustBand::default()
                }
                .for_kernel(&fit, at)
                .unwrap();
                let covers = |j: &usize| band.lower[*j] <= m(at[*j]) && m(at[*j]) <= band.upper[*j];
                (0..at.len()).filter(covers).count() as f64 / at.len() as f64
            };
            let all = share(BandKind::Simultaneous, &at);
            [
                share(BandKind::Pointwise, &at),
                share(BandKind::Pointwise, &[-2.0]),
                f64::from(all == 1.0),
            ]
        })
        .collect();
    [0, 1, 2].map(|k| {
        let mean = runs.iter().map(|r| r[k]).sum::<f64>() / runs.len() as f64;
        let variance = runs.iter().map(|r| (r[k] - mean).powi(2)).sum::<f64>() / (runs.len() - 1) as f64;
        (100.0 * mean, 100.0 * (variance / runs.len() as f64).sqrt())
    })
}

#[test]
fn bands_at_the_bandwidth_from_the_data_cover_what_they_promise() {
    for degree in [Degree::Linear, Degree::Constant] {
        for noise in [|_: f64| 0.2, |x: f64| 0.05 + 0.1 * x.abs()] {
            for (name, (share, error)) in ["interior", "end", "simultaneous"]
                .into_iter()
                .zip(coverage(degree, noise))
            {
                // Three binomial standard errors, 3.3 % for one event a run, about the accepted 93 to 97 %.
                let within = 93.0 - 3.0 * error <= share && share <= 97.0 + 3.0 * error;
                assert!(within && error < 1.5, "{degree:?} {name}: {share} +- {error}");
            }
        }
    }
}

#[test]
fn more_degrees_of_freedom_bring_student_to_normal() {
    for (freedom, quantile) in [
        (1.0, 12.706),
        (5.0, 2.5706),
        (30.0, 2.0423),
        (1e4, 1.9602),
        (1e9, 1.95996),
    ] {
        assert!(
            (student(1.959964, freedom) - quantile).abs() < 1e-3,
            "{freedom}: {}",
            student(1.959964, freedom)
        );
    }
    assert!(student(f64::NAN, 5.0).is_nan());
}

#[test]
fn where_nothing_is_known_nothing_is_said() {
    let (x, y) = noisy(2, 100, f64::cos, |_| 0.1);
    let band = RobustBand::default()
        .for_kernel(&fit(&x, &y, Kernel::Epanechnikov, 0.3), &[9.0, f64::NAN, 0.0])
        .unwrap();
    assert!(
        band.lower[0].is_nan() && band.estimate[1].is_nan() && band.upper[1].is_nan() && band.lower[2] < band.upper[2]
    );
    // Five points that are all fitted exactly tell nothing about the noise.
    let exact = fit(
        &[0.0, 1.0, 2.0, 3.0, 4.0],
        &[1.0, 0.0, 2.0, 5.0, 1.0],
        Kernel::Epanechnikov,
        0.5,
    );
    let band = RobustBand::default().for_kernel(&exact, &[1.0]).unwrap();
    assert!(band.estimate[0] == 0.0 && band.centre[0].abs() < 1e-12 && band.lower[0].is_nan());
}

#[test]
fn an_x_of_few_levels_gives_the_band_of_each_level_s_mean() {
    let (mut x, mut y) = noisy(4, 600, |_| 0.0, |_| 0.5);
    for i in 0..600 {
        x[i] = (i % 6) as f64;
        y[i] += x[i].powi(2);
    }
    let band = RobustBand::default()
        .for_kernel(&fit(&x, &y, Kernel::Epanechnikov, 0.4), &[3.0])
        .unwrap();
    let level: Vec<f64> = (0..100).map(|k| y[6 * k + 3]).collect();
    let mean = level.iter().sum::<f64>() / 100.0;
    let variance = level.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 99.0;
    assert!((band.centre[0] - mean).abs() < 1e-12);
    assert!((band.standard_error[0] - (variance / 100.0).sqrt()).abs() < 1e-9);
    // Student's quantile with 100 degrees of freedom is 1.984.
    assert!(((band.upper[0] - mean) / band.standard_error[0] - 1.984).abs() < 1e-3);
}

#[test]
fn bad_parameters_are_refused() {
    let (x, y) = noisy(2, 100, f64::cos, |_| 0.1);
    let good = fit(&x, &y, Kernel::Epanechnikov, 0.3);
    let message = |band: RobustBand, fit: &KernelFit| band.for_kernel(fit, &[0.0]).unwrap_err().to_string();
    let usual = RobustBand::default();
    for level in [0.0, 1.0, -0.1, f64::NAN] {
        let text = message(RobustBand { level, ..usual }, &good);
        assert!(
            text.contains("the level of a confidence band is") && text.contains("for example 0.95"),
            "{text}"
        );
    }
    let text = message(
        RobustBand {
            undersmoothing: 1.0,
            ..usual
        },
        &good,
    );
    assert!(text.contains("undersmoothing, an exponent, is 1"), "{text}");
    let text = message(RobustBand { rho: 0.0, ..usual }, &good);
    assert!(text.contains("rho") && text.contains("positive and finite"), "{text}");
    let text = message(
        RobustBand {
            kind: BandKind::Simultaneous,
            draws: 39,
            ..usual
        },
        &good,
    );
    assert!(
        text.contains("the number of draws is 39, but must be at least 2 / (1 - level)"),
        "{text}"
    );
    let text = message(usual, &fit(&x[..4], &y[..4], Kernel::Uniform, 1.0));
    assert_eq!(text, "a confidence band needs at least 5 samples, but there are 4");
}
