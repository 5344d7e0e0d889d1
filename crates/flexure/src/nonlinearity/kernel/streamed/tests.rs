use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_distr::{Cauchy, Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::*;
use crate::nonlinearity::{Degree, Kernel, KernelRegression, Regression};

/// X uniform on [-2, 2] and Y = sin 2X + N(0, 0.1^2).
fn data(seed: u64, n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let x: Vec<f64> = (0..n).map(|_| rng.random_range(-2.0..2.0)).collect();
    let noise: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut rng)).collect();
    let y = x.iter().zip(noise).map(|(x, e)| (2.0 * x).sin() + 0.1 * e).collect();
    (x, y)
}

fn of(x: &[f64], y: &[f64], most_bins: usize, block: u64) -> StreamedRegression {
    let mut sums = StreamedRegression::new(most_bins, block).unwrap();
    sums.push(0, x, y).unwrap();
    sums
}

fn predicted(sums: &StreamedRegression, bandwidth: Option<f64>) -> Vec<f64> {
    let fit = sums.fit(Kernel::Epanechnikov, Degree::Linear, bandwidth).unwrap();
    let at: Vec<f64> = (-20..=20).map(|i| f64::from(i) / 10.5).collect();
    fit.predict(&[&at]).unwrap()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn parts_in_any_order_are_the_whole() {
    let (x, y) = data(1, 30_000);
    let whole = of(&x, &y, 512, 100);
    let parts: Vec<StreamedRegression> = (x.chunks(4111).zip(y.chunks(4111)).enumerate())
        .map(|(k, (x, y))| {
            let mut part = StreamedRegression::new(512, 100).unwrap();
            part.push(4111 * k as u64, x, y).unwrap();
            part
        })
        .collect();
    for order in [[0, 1, 2, 3, 4, 5, 6, 7], [7, 2, 5, 0, 6, 1, 4, 3]] {
        let mut merged = StreamedRegression::new(512, 100).unwrap();
        for k in order {
            merged
                .merge(&StreamedRegression::from_bytes(&parts[k].to_bytes()).unwrap())
                .unwrap();
        }
        assert_eq!((merged.count(), merged.bin_width()), (30_000, whole.bin_width()));
        assert!(largest_difference(&predicted(&merged, None), &predicted(&whole, None)) < 1e-12);
    }
}

#[test]
fn with_narrow_bins_it_is_the_regression_of_the_points() {
    let (x, y) = data(2, 20_000);
    let at: Vec<f64> = (-20..=20).map(|i| f64::from(i) / 10.5).collect();
    for (most_bins, bound) in [(1 << 15, 1e-12), (1 << 10, 1e-4)] {
        let sums = of(&x, &y, most_bins, 100);
        let method = KernelRegression {
            kernel: Kernel::Epanechnikov,
            bandwidth: 0.3,
        };
        let direct = method.fit(&x, &y).unwrap().with_degree(Degree::Linear).predict(&at);
        let difference = largest_difference(&predicted(&sums, Some(0.3)), &direct);
        assert!(
            difference < bound,
            "{most_bins} bins of {}: {difference}",
            sums.bin_width()
        );
    }
}

#[test]
fn the_scores_are_those_of_the_points_left_out_fold_by_fold() {
    let (x, y) = data(3, 2000);
    // Every point is alone in its bin.
    let fit = of(&x, &y, 1 << 12, 30)
        .fit(Kernel::Triweight, Degree::Constant, None)
        .unwrap();
    let fold = |i: usize| i / 30 % FOLDS;
    for score in fit.search().unwrap().curve.iter().step_by(7) {
        let method = KernelRegression {
            kernel: Kernel::Triweight,
            bandwidth: score.bandwidth,
        };
        let squares = (0..FOLDS).map(|left_out| {
            let kept = |of: &[f64]| {
                (0..2000)
                    .filter(|i| fold(*i) != left_out)
                    .map(|i| of[i])
                    .collect::<Vec<f64>>()
            };
            let others = method.fit(&kept(&x), &kept(&y)).unwrap();
            let errors = (0..2000)
                .filter(|i| fold(*i) == left_out)
                .map(|i| y[i] - others.value(x[i]));
            errors.map(|e| e * e).sum::<f64>()
        });
        let want = squares.sum::<f64>() / 2000.0;
        assert!(
            (score.error / want - 1.0).abs() < 1e-9 || want.is_nan(),
            "{score:?} {want}"
        );
    }
}

#[test]
fn the_chosen_bandwidth_costs_little_beside_the_best_one() {
    let (x, y) = data(4, 40_000);
    let sums = of(&x, &y, 1 << 12, 100);
    let error = |bandwidth| {
        let fit = sums.fit(Kernel::Epanechnikov, Degree::Linear, bandwidth).unwrap();
        let at: Vec<f64> = (-190..=190).map(|i| f64::from(i) / 100.0).collect();
        let squares = fit
            .predict(&[&at])
            .unwrap()
            .iter()
            .zip(&at)
            .map(|(m, x)| (m - (2.0 * x).sin()).powi(2))
            .sum::<f64>();
        (squares / at.len() as f64).sqrt()
    };
    let best = (1..40)
        .map(|k| error(Some(0.02 * f64::from(k))))
        .fold(f64::INFINITY, f64::min);
    assert!(error(None) < 1.3 * best, "{} beside {best}", error(None));
}

/// Errors and abscissas with a correlation of 0.95 from row to row: bands that take rows for independent cover a third of this.
#[test]
fn the_band_covers_where_rows_depend_on_each_other() {
    let (mut inside, mut all) = (0, 0);
    for seed in 0..50 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let (mut x, mut e) = (0.0, 0.0);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let rows: Vec<(f64, f64)> = (0..20_000)
            .map(|_| {
                x = 0.95 * x + 0.3 * normal();
                e = 0.95 * e + 0.1 * normal();
                (x, f64::sin(2.0 * x) + e)
            })
            .collect();
        let (x, y): (Vec<f64>, Vec<f64>) = rows.into_iter().unzip();
        let fit = of(&x, &y, 1 << 11, 500)
            .fit(Kernel::Epanechnikov, Degree::Linear, None)
            .unwrap();
        let at: Vec<f64> = (-12..=12).map(|i| f64::from(i) / 10.0).collect();
        let band = fit.band(&at, 0.95).unwrap();
        all += at.len();
        inside += (0..at.len())
            .filter(|&i| (band.lower[i]..=band.upper[i]).contains(&(2.0 * at[i]).sin()))
            .count();
    }
    let share = inside as f64 / all as f64;
    assert!((0.93..0.975).contains(&share), "{share} of {all}");
}

#[test]
fn bins_stay_few_and_precise_for_far_and_heavy_tailed_data() {
    let mut rng = Pcg64::seed_from_u64(5);
    let tails = Cauchy::new(0.0, 1.0).unwrap();
    let x: Vec<f64> = (0..50_000).map(|_| tails.sample(&mut rng)).collect();
    let sums = of(&x, &x, 1 << 12, 100);
    assert!(sums.in_order().len() <= 1 << 12 && sums.bin_width() < 0.1);
    for offset in [1e6, -1e9] {
        let (x, y) = data(6, 5000);
        let moved: Vec<f64> = x.iter().map(|x| x + offset).collect();
        let fit = of(&moved, &y, 1 << 12, 100)
            .fit(Kernel::Epanechnikov, Degree::Linear, Some(0.3))
            .unwrap();
        let own = of(&x, &y, 1 << 12, 100)
            .fit(Kernel::Epanechnikov, Degree::Linear, Some(0.3))
            .unwrap();
        let [here, there] = [
            own.predict(&[&[0.5]]).unwrap()[0],
            fit.predict(&[&[0.5 + offset]]).unwrap()[0],
        ];
        assert!((here - there).abs() < 1e-4, "{here} {there}");
    }
    let extremes = [1e300, -1e300, 1e-300, 0.0, f64::MIN_POSITIVE, -5e-324, 1e308];
    let sums = of(&extremes, &[1.0; 7], 64, 1);
    assert_eq!(sums.count(), 7);
    assert!(
        sums.in_order()
            .iter()
            .all(|(_, folds)| folds.iter().all(|bin| bin.x.is_finite()))
    );
}

#[test]
fn what_cannot_be_is_refused() {
    let mut sums = StreamedRegression::default();
    let text = |error: Error| error.to_string();
    assert!(text(sums.push(70, &[1.0, f64::NAN], &[0.0, 0.0]).unwrap_err()).contains("71"));
    assert!(text(sums.push(0, &[1.0], &[]).unwrap_err()).contains("length"));
    assert_eq!(sums.count(), 0);
    let fit = |sums: &StreamedRegression, h| sums.fit(Kernel::Epanechnikov, Degree::Linear, h).map(|_| ());
    assert!(fit(&sums, None).is_err());
    let (x, y) = data(7, 500);
    sums.push(0, &x, &y).unwrap();
    assert!(text(fit(&sums, None).unwrap_err()).contains("blocks"));
    assert!(fit(&sums, Some(0.2)).is_ok() && fit(&sums, Some(-1.0)).is_err() && fit(&sums, Some(f64::NAN)).is_err());
    assert!(fit(&of(&[2.0; 50], &[1.0; 50], 64, 1), None).is_err());
    let other = StreamedRegression::new(64, 1000).unwrap();
    assert!(text(sums.merge(&other).unwrap_err()).contains("numbers of bins differ"));
    assert!(StreamedRegression::new(3, 10).is_err() && StreamedRegression::new(100, 0).is_err());
}

#[test]
fn bytes_are_the_same_sums_and_damaged_ones_are_refused() {
    let (x, y) = data(8, 300);
    let sums = of(&x, &y, 64, 7);
    let bytes = sums.to_bytes();
    assert_eq!(StreamedRegression::from_bytes(&bytes).unwrap().to_bytes(), bytes);
    assert_eq!(
        predicted(&StreamedRegression::from_bytes(&bytes).unwrap(), Some(0.5)),
        predicted(&sums, Some(0.5))
    );
    for length in 0..bytes.len() {
        assert!(StreamedRegression::from_bytes(&bytes[..length]).is_err());
    }
    let longer = [bytes, vec![0]].concat();
    assert!(StreamedRegression::from_bytes(&longer).is_err());
}

proptest! {
    #[test]
    fn any_bytes_give_sums_or_an_error(at in 0_usize..400, value: u8) {
        let (x, y) = data(9, 40);
        let mut bytes = of(&x, &y, 64, 7).to_bytes();
        let at = at % bytes.len();
        bytes[at] = value;
        if let Ok(sums) = StreamedRegression::from_bytes(&bytes) {
            let fit = sums.fit(Kernel::Epanechnikov, Degree::Linear, Some(0.5));
            prop_assert!(fit.is_err() || sums.count() == 40);
        }
    }
}
