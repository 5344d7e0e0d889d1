//! Scores, and the bandwidths chosen by them.

use super::*;

/// The mean of the ordinates nearest to point i, by the distance that the score uses.
fn nearest(x: &[Vec<f64>], y: &[f64], w: &[f64], i: usize) -> f64 {
    let extents: Vec<f64> = x
        .iter()
        .map(|column| {
            let weighty: Vec<f64> = column
                .iter()
                .zip(w)
                .filter(|(_, w)| **w > 0.0)
                .map(|(x, _)| *x)
                .collect();
            super::super::super::descent::Column::new(&weighty)
                .extent
                .unwrap_or(1.0)
        })
        .collect();
    let distance = |k: usize| -> f64 { (0..x.len()).map(|j| ((x[j][k] - x[j][i]) / extents[j]).powi(2)).sum() };
    let others = (0..y.len()).filter(|&k| k != i && w[k] > 0.0);
    let least = others.clone().map(distance).fold(f64::INFINITY, f64::min);
    let tied = others.filter(|&k| distance(k) == least);
    let sums = tied.fold((0.0, 0.0), |(total, sum), k| (total + w[k], sum + w[k] * y[k]));
    sums.1 / sums.0
}

#[test]
fn scores_agree_with_leaving_each_point_out() {
    let mut planes = 0;
    for d in [2, 3] {
        for (name, x) in hard_columns(20 + d as u64, 70, d) {
            for w in [None, Some(weights(70))] {
                let y = response(&x, 3.0);
                let ones = vec![1.0; 70];
                let weight = w.as_ref().unwrap_or(&ones);
                let positive: Vec<f64> = weight.iter().copied().filter(|w| *w > 0.0).collect();
                for (kernel, scale) in Kernel::ALL.into_iter().flat_map(|k| [(k, 0.3), (k, 1.3)]) {
                    let h: Vec<f64> = (0..d).map(|j| scale * (1.0 + 0.2 * j as f64)).collect();
                    let twin = |y: &[f64], degree, i: usize, skip| {
                        let direct = Direct {
                            x: &x,
                            y,
                            w: weight,
                            kernel,
                            h: &h,
                        };
                        let q: Vec<f64> = x.iter().map(|c| c[i]).collect();
                        direct.estimate(degree, &q, skip)
                    };
                    for degree in DEGREES {
                        let (mut left_out, mut residual, mut trace, mut vague) = (0.0, 0.0, 0.0, false);
                        for i in (0..70).filter(|&i| weight[i] > 0.0) {
                            let without = twin(&y, degree, i, Some(i)).unwrap_or((nearest(&x, &y, weight, i), 1.0));
                            let with = twin(&y, degree, i, None).unwrap();
                            let mut moved = y.clone();
                            moved[i] += 1.0;
                            trace += twin(&moved, degree, i, None).unwrap().0 - with.0;
                            left_out += weight[i] * (y[i] - without.0).powi(2);
                            residual += weight[i] * (y[i] - with.0).powi(2);
                            vague |= without.1.min(with.1) < 1e-3;
                        }
                        if vague {
                            continue;
                        }
                        planes += usize::from(degree == Degree::Linear);
                        let total: f64 = positive.iter().sum();
                        let rest = 1.0 - trace / positive.len() as f64;
                        let method = method(kernel, degree, &h);
                        for (criterion, want) in [
                            (Criterion::LeaveOneOut, left_out / total),
                            (Criterion::Generalized, residual / total / (rest * rest)),
                        ] {
                            let got = method.score(criterion, &slices(&x), &y, w.as_deref()).unwrap();
                            let what = format!("{name} {kernel:?} {degree:?} {criterion:?} h={h:?}: {got} {want}");
                            let determined = criterion == Criterion::LeaveOneOut || rest > 1e-3;
                            assert!(!determined || (got - want).abs() < 1e-8 * want, "{what}");
                        }
                    }
                }
            }
        }
    }
    assert!(planes >= 10, "{planes}");
}

fn noisy(seed: u64, n: usize, d: usize, m: impl Fn(&[f64]) -> f64) -> (Vec<Vec<f64>>, Vec<f64>) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let x: Vec<Vec<f64>> = (0..d)
        .map(|_| (0..n).map(|_| rng.random_range(-2.0..2.0)).collect())
        .collect();
    let y = (0..n)
        .map(|i| {
            let e: f64 = StandardNormal.sample(&mut rng);
            let q: Vec<f64> = x.iter().map(|c| c[i]).collect();
            m(&q) + 0.2 * e
        })
        .collect();
    (x, y)
}

fn choosing(degree: Degree, criterion: Criterion) -> KernelEstimator {
    KernelEstimator {
        degree,
        bandwidth: Bandwidth::FromData(criterion),
        ..Default::default()
    }
}

#[test]
fn a_column_that_does_not_matter_gets_a_wide_bandwidth() {
    for criterion in [Criterion::LeaveOneOut, Criterion::Generalized] {
        for degree in DEGREES {
            let (x, y) = noisy(3, 1500, 2, |q| (2.0 * q[0]).sin());
            let fit = fit(&choosing(degree, criterion), &x, &y, None);
            let h = fit.bandwidths();
            assert!(h[0] < 1.2 && h[1] > 2.5, "{degree:?} {criterion:?} {h:?}");
            // Nearly as good as if one had known.
            let alone = choosing(degree, criterion).fit(&[&x[0]], &y, None).unwrap();
            let error = |got: Vec<f64>| -> f64 {
                let each = got.iter().zip(&x[0]).map(|(g, x)| (g - (2.0 * x).sin()).powi(2));
                each.sum::<f64>() / 1500.0
            };
            let (two, one) = (
                error(fit.predict(&slices(&x)).unwrap()),
                error(alone.predict(&[&x[0]]).unwrap()),
            );
            assert!(two < 3.0 * one, "{degree:?} {criterion:?}: {two} {one}");
        }
    }
}

#[test]
fn a_linear_column_is_wide_for_the_local_plane_only() {
    let (x, y) = noisy(4, 1500, 2, |q| (2.0 * q[0]).sin() + 2.0 * q[1]);
    let chosen = |degree| {
        fit(&choosing(degree, Criterion::LeaveOneOut), &x, &y, None)
            .bandwidths()
            .to_vec()
    };
    let (plane, mean) = (chosen(Degree::Linear), chosen(Degree::Constant));
    assert!(plane[1] > 2.5 && plane[0] < 1.2 && mean[1] < 0.8, "{plane:?} {mean:?}");
}

#[test]
fn the_choice_is_near_the_best_in_hindsight() {
    let m = |q: &[f64]| (2.0 * q[0]).sin() * q[1];
    for degree in DEGREES {
        let (x, y) = noisy(5, 2000, 2, m);
        let error = |method: &KernelEstimator| -> f64 {
            let got = fit(method, &x, &y, None).predict(&slices(&x)).unwrap();
            (0..2000).map(|i| (got[i] - m(&[x[0][i], x[1][i]])).powi(2)).sum()
        };
        let steps: Vec<f64> = (0..7).map(|i| 0.25 * 1.5_f64.powi(i)).collect();
        let pairs = steps.iter().flat_map(|a| steps.iter().map(move |b| [*a, *b]));
        let best = pairs
            .map(|h| error(&method(Kernel::Epanechnikov, degree, &h)))
            .fold(f64::INFINITY, f64::min);
        let got = error(&choosing(degree, Criterion::LeaveOneOut));
        assert!(got < 1.2 * best, "{degree:?}: {got} {best}");
    }
}

#[test]
fn the_search_reports_what_it_did_and_depends_on_nothing_else() {
    let (x, y) = noisy(6, 6000, 2, |q| q[0] * q[1]);
    let method = choosing(Degree::Constant, Criterion::LeaveOneOut);
    let run = |threads, x: &[Vec<f64>], y: &[f64]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fit(&method, x, y, None).search().unwrap().clone())
    };
    let one = run(1, &x, &y);
    assert_eq!(one, run(3, &x, &y));
    let back: Vec<Vec<f64>> = x.iter().map(|c| c.iter().rev().copied().collect()).collect();
    assert_eq!(one, run(2, &back, &y.iter().rev().copied().collect::<Vec<_>>()));
    // More points than the grids score at.
    let most = one.curve.iter().map(|s| s.points).max().unwrap();
    assert_eq!((one.curve[0].points, most), (3333, 6000));
    let compared = one.curve.iter().filter(|s| s.points == most);
    let best = compared.clone().map(|s| s.score).fold(f64::INFINITY, f64::min);
    let chosen = compared.clone().find(|s| s.bandwidths == one.bandwidths).unwrap();
    assert!(chosen.score <= best * (1.0 + 1e-6) && !one.at_edge);
    // The scores are those of the estimates that they name.
    let fixed = KernelEstimator {
        bandwidth: Bandwidth::Fixed(one.bandwidths.clone()),
        ..method.clone()
    };
    let exact = fixed.score(Criterion::LeaveOneOut, &slices(&x), &y, None).unwrap();
    assert!((exact - chosen.score).abs() < 1e-12 * exact);
}

#[test]
fn one_column_takes_the_line_s_search_and_generalised_cross_validation() {
    let (x, y) = noisy(7, 800, 1, |q| (3.0 * q[0]).sin());
    for degree in DEGREES {
        let fit = |criterion| fit(&choosing(degree, criterion), &x, &y, None);
        let (left, general) = (fit(Criterion::LeaveOneOut), fit(Criterion::Generalized));
        let line = crate::selection::BandwidthSearch::search(Kernel::Epanechnikov, degree, &x[0], &y, None).unwrap();
        assert_eq!(left.bandwidths(), [line.bandwidth]);
        let ratio = general.bandwidths()[0] / line.bandwidth;
        assert!((0.5..2.0).contains(&ratio), "{degree:?} {ratio}");
        let curve = &general.search().unwrap().curve;
        assert!(curve.windows(2).all(|s| s[0].bandwidths[0] <= s[1].bandwidths[0]));
    }
}

#[test]
fn odd_columns_do_not_break_the_search() {
    for (name, x) in hard_columns(30, 150, 2) {
        let y = response(&x, 0.0);
        for degree in DEGREES {
            let fit = fit(&choosing(degree, Criterion::LeaveOneOut), &x, &y, None);
            assert!(
                fit.predict(&slices(&x)).unwrap().iter().all(|v| v.is_finite()),
                "{name}"
            );
        }
    }
    let constant = vec![vec![2.0; 50], (0..50).map(|i| f64::from(i) / 10.0).collect()];
    let y: Vec<f64> = constant[1].iter().map(|x: &f64| x.sin()).collect();
    for degree in DEGREES {
        let fit = fit(&choosing(degree, Criterion::LeaveOneOut), &constant, &y, None);
        assert_eq!(fit.bandwidths()[0], 1.0);
        assert!((fit.predict(&[&[2.0], &[2.5]]).unwrap()[0] - 2.5_f64.sin()).abs() < 0.02);
    }
}
