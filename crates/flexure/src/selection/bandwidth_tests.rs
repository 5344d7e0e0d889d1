//! The search for a bandwidth by leave-one-out.

use super::*;
use crate::selection::test_data::noisy;

#[test]
fn the_choice_is_near_the_best_bandwidth_in_hindsight() {
    let m = |x: f64| (3.0 * x).sin();
    let seeds = 20;
    let mean_ratio = (0..seeds).map(|seed| hindsight_ratio(seed, m)).sum::<f64>() / seeds as f64;
    // Relative loss of cross-validation over the best bandwidth falls like n^(-1/10): about 10 % here.
    assert!(mean_ratio < 1.15, "{mean_ratio}");
}

/// The mean squared error of the estimate at the chosen bandwidth over that at the best one.
fn hindsight_ratio(seed: u64, m: impl Fn(f64) -> f64) -> f64 {
    let (x, y) = noisy(seed, 4000, &m);
    let search = BandwidthSearch::leave_one_out(Kernel::Epanechnikov, &x, &y).unwrap();
    assert!(!search.at_edge);
    assert!(search.curve.windows(2).all(|w| w[0].bandwidth < w[1].bandwidth));
    let data = Sorted::new(&x, &y, None);
    let true_error = |h: f64| {
        let mut total = 0.0;
        crate::nonlinearity::kernel::for_each_sum(&data, Kernel::Epanechnikov, Degree::Constant, h, &data.x, |i, s| {
            total += (data.mean + s.t[0] / s.s[0] - m(data.x[i])).powi(2);
        });
        total
    };
    let best = (1..200)
        .map(|i| true_error(0.002 * i as f64))
        .fold(f64::INFINITY, f64::min);
    true_error(search.bandwidth) / best
}

#[test]
fn a_constant_calls_for_the_widest_window() {
    let (x, y) = noisy(7, 2000, |_| 1.0);
    let search = BandwidthSearch::leave_one_out(Kernel::Epanechnikov, &x, &y).unwrap();
    assert!(search.bandwidth > 1.0, "{}", search.bandwidth);
}

#[test]
fn the_choice_depends_neither_on_threads_nor_on_order() {
    let (x, y) = noisy(7, 3000, |x| x.abs());
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let search = |x: &[f64], y: &[f64], threads| {
        pool(threads).install(|| BandwidthSearch::leave_one_out(Kernel::Epanechnikov, x, y).unwrap())
    };
    let one = search(&x, &y, 1);
    assert_eq!(one, search(&x, &y, 3));
    let reversed = |v: &[f64]| v.iter().rev().copied().collect::<Vec<_>>();
    assert_eq!(one.bandwidth, search(&reversed(&x), &reversed(&y), 1).bandwidth);
}

#[test]
fn a_straight_line_calls_for_the_widest_local_line_but_not_for_the_widest_mean() {
    let (x, y) = noisy(11, 2000, |x| x);
    let search = |degree| BandwidthSearch::search(Kernel::Epanechnikov, degree, &x, &y, None).unwrap();
    let (line, mean) = (search(Degree::Linear), search(Degree::Constant));
    assert!(line.bandwidth > 1.0 && mean.bandwidth < 0.5);
    assert!(line.curve.last().unwrap().error < mean.curve.last().unwrap().error / 10.0);
}

#[test]
fn weights_choose_the_points_that_count() {
    let (x, y) = noisy(13, 1000, |x| (5.0 * x).sin());
    // Another 500 of weight zero, which follow another law.
    let (mut more_x, mut more_y) = noisy(17, 500, |_| 30.0);
    more_x.extend(&x);
    more_y.extend(&y);
    let w: Vec<f64> = (0..1500).map(|i| if i < 500 { 0.0 } else { 2.5 }).collect();
    let search =
        |x: &[f64], y: &[f64], w| BandwidthSearch::search(Kernel::Triangular, Degree::Constant, x, y, w).unwrap();
    let (one, other) = (search(&x, &y, None), search(&more_x, &more_y, Some(&w)));
    for (a, b) in one.curve.iter().zip(&other.curve) {
        assert!((a.error - b.error).abs() < 1e-9 * a.error, "{a:?} {b:?}");
    }
    let refused = BandwidthSearch::search(
        Kernel::Uniform,
        Degree::Linear,
        &x[..3],
        &y[..3],
        Some(&[1.0, 0.0, 1.0]),
    );
    assert!(
        refused
            .unwrap_err()
            .to_string()
            .contains("at least 3 samples, but there are 2")
    );
}

fn method(kernel: Kernel, degree: Degree, scoring: Scoring) -> LeaveOneOut {
    LeaveOneOut {
        kernel,
        degree,
        scoring,
    }
}

#[test]
fn the_search_on_binned_data_is_as_good_as_the_exact_one_and_says_how_far_off_it_was() {
    let (x, y) = noisy(23, 20_000, |x| (4.0 * x).sin());
    for kernel in [
        Kernel::Uniform,
        Kernel::Triangular,
        Kernel::Epanechnikov,
        Kernel::Gaussian,
    ] {
        for degree in [Degree::Constant, Degree::Linear] {
            let search = |scoring| method(kernel, degree, scoring).search(&x, &y, None).unwrap();
            let (exact, binned) = (search(Scoring::Exact), search(Scoring::Binned));
            assert!(exact.binning.is_none() && exact.at_edge == binned.at_edge);
            let binning = binned.binning.as_ref().unwrap();
            // The uniform kernel jumps at the window's edge, and so do its sums where a bin comes in.
            let most = if kernel == Kernel::Uniform { 1e-3 } else { 1e-4 };
            assert!(binning.error < most, "{kernel:?} {degree:?}: {binning:?}");
            assert!(binning.exact.iter().any(|s| s.bandwidth == binned.bandwidth));
            let at = |h| {
                method(kernel, degree, Scoring::Exact)
                    .exact_scores(&x, &y, None, &[h])
                    .unwrap()[0]
                    .error
            };
            let (best, found) = (at(exact.bandwidth), at(binned.bandwidth));
            assert!(found < best * 1.0005, "{kernel:?} {degree:?}: {found} {best}");
            // Lines through a few points shoot far off, and change with every point in or out: at least 50 in a window.
            let narrowest = 50.0 * 4.0 / x.len() as f64 / 2.0;
            for score in binned.curve.iter().filter(|s| s.bandwidth > narrowest).step_by(7) {
                let error = (score.error / at(score.bandwidth) - 1.0).abs();
                assert!(error < 30.0 * most, "{kernel:?} {degree:?} {score:?}: {error}");
            }
        }
    }
}

#[test]
fn binned_searches_stand_outliers_offsets_and_ties() {
    let (uniform, _) = noisy(29, 20_000, |x| x);
    let heavy = |x: f64| (0.78 * x).tan();
    let scales: [(&str, &dyn Fn(f64) -> f64); 3] = [
        ("heavy tails", &heavy),
        ("offset", &|x| 1e6 + x),
        ("ties", &|x| (x * 5.0).floor()),
    ];
    for (name, map) in scales {
        let x: Vec<f64> = uniform.iter().map(|x| map(*x)).collect();
        let y: Vec<f64> = uniform
            .iter()
            .enumerate()
            .map(|(i, x)| 1e3 + x + 0.2 * (i as f64).sin())
            .collect();
        let search = |scoring| {
            method(Kernel::Epanechnikov, Degree::Constant, scoring)
                .search(&x, &y, None)
                .unwrap()
        };
        let (exact, binned) = (search(Scoring::Exact), search(Scoring::Binned));
        let lowest_of = |s: &BandwidthSearch| s.curve.iter().map(|c| c.error).fold(f64::INFINITY, f64::min);
        let ratio = lowest_of(&binned) / lowest_of(&exact);
        assert!((ratio - 1.0).abs() < 1e-3, "{name}: {ratio} {:?}", binned.binning);
    }
}

#[test]
fn a_binned_choice_depends_neither_on_threads_nor_on_order() {
    let (x, y) = noisy(31, 150_000, |x| x.abs());
    let search = |x: &[f64], y: &[f64], threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let method = method(Kernel::Epanechnikov, Degree::Constant, Scoring::Binned);
        pool.install(|| method.search(x, y, None).unwrap())
    };
    let one = search(&x, &y, 1);
    assert_eq!(one, search(&x, &y, 3));
    let reversed = |v: &[f64]| v.iter().rev().copied().collect::<Vec<_>>();
    assert_eq!(one, search(&reversed(&x), &reversed(&y), 2));
}

#[test]
fn weighted_data_are_never_put_in_bins() {
    let (x, y) = noisy(37, 500, |x| x);
    let search = |scoring| {
        let method = method(Kernel::Epanechnikov, Degree::Constant, scoring);
        method.search(&x, &y, Some(&vec![2.0; 500])).unwrap()
    };
    assert_eq!(search(Scoring::Binned), search(Scoring::Exact));
}

#[test]
fn given_bandwidths_are_scored_in_their_order_and_checked() {
    let (x, y) = noisy(41, 300, |x| x);
    let method = LeaveOneOut::default();
    let [a, b] = [0.5, 0.1].map(|h| method.exact_scores(&x, &y, None, &[h]).unwrap()[0]);
    assert_eq!(method.exact_scores(&x, &y, None, &[0.5, 0.1]).unwrap(), [a, b]);
    for h in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let message = method.exact_scores(&x, &y, None, &[0.1, h]).unwrap_err().to_string();
        assert!(message.contains("the bandwidth is"), "{message}");
    }
}

/// The scores of given bandwidths on data in bins.
fn binned_scores(method: LeaveOneOut, x: &[f64], y: &[f64], bandwidths: &[f64]) -> Vec<Score> {
    let smallest = bandwidths.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = bandwidths.iter().copied().fold(0.0, f64::max);
    let scales = BinnedScales::new(&Sorted::new(x, y, None), smallest, largest, method.bins());
    scored(bandwidths, scales.scores(method.kernel, method.degree, bandwidths))
}

#[test]
fn binned_scores_are_near_the_exact_ones() {
    let (x, y) = noisy(43, 150_000, |x| (4.0 * x).sin());
    let shifted = |x: &[f64], f: &dyn Fn(f64) -> f64| -> Vec<f64> { x.iter().map(|x| f(*x)).collect() };
    let bandwidths = [0.5, 0.02, 0.1];
    for kernel in [Kernel::Epanechnikov, Kernel::Triangular, Kernel::Gaussian] {
        for degree in [Degree::Constant, Degree::Linear] {
            let method = method(kernel, degree, Scoring::Exact);
            let exact = method
                .exact_scores(&x[..20_000], &y[..20_000], None, &bandwidths)
                .unwrap();
            let binned = binned_scores(method, &x[..20_000], &y[..20_000], &bandwidths);
            for (binned, exact) in binned.iter().zip(&exact) {
                assert!(binned.bandwidth == exact.bandwidth);
                let error = (binned.error / exact.error - 1.0).abs();
                assert!(error < 1e-3, "{kernel:?} {degree:?} {exact:?}: {error}");
            }
        }
    }
    // An outlier that makes too many bins, and an offset.
    let method = LeaveOneOut::default();
    let mut far = shifted(&x, &|x| 1e6 + x);
    far[7] = -1e9;
    let exact = method.exact_scores(&far, &y, None, &bandwidths).unwrap();
    for (binned, exact) in binned_scores(method, &far, &y, &bandwidths).iter().zip(&exact) {
        assert!((binned.error / exact.error - 1.0).abs() < 1e-3, "{binned:?} {exact:?}");
    }
    // Several parts, for any number of threads.
    let scores = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| binned_scores(method, &x, &y, &bandwidths))
    };
    assert_eq!(scores(1), scores(2));
    assert_eq!(scores(1), scores(5));
}

#[test]
fn binned_scores_stand_extreme_data_and_bandwidths() {
    let y: Vec<f64> = (0..300).map(|i| f64::from(i % 7)).collect();
    let line: Vec<f64> = (0..300).map(f64::from).collect();
    let columns = [
        vec![1.0; 300],
        line.iter().map(|x| 1e97 * (1.0 + x)).collect(),
        line.iter().map(|x| 1e-90 * x).collect(),
        line.iter().map(|x| if *x < 150.0 { -1e99 } else { 1e99 }).collect(),
        line,
    ];
    let far = [1e-300, 1e-200, 1.0, 1e200, 1.7e308];
    for kernel in [Kernel::Epanechnikov, Kernel::Triangular] {
        for degree in [Degree::Constant, Degree::Linear] {
            let method = method(kernel, degree, Scoring::Exact);
            for x in &columns {
                for bandwidths in [&far[..], &far[..1], &far[4..]] {
                    for n in [3, 300] {
                        let scores = binned_scores(method, &x[..n], &y[..n], bandwidths);
                        assert_eq!(scores.len(), bandwidths.len());
                        assert!(
                            scores.iter().all(|score| !score.error.is_nan()),
                            "{kernel:?} {degree:?} {:?} {scores:?}",
                            &x[..3]
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn constant_abscissas_do_not_break_the_search() {
    let search = BandwidthSearch::leave_one_out(Kernel::Gaussian, &[1.0; 5], &[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
    assert!(search.bandwidth > 0.0 && search.curve.iter().all(|s| s.error.is_finite()));
}
