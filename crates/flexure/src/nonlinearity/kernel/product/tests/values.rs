//! Estimates.

use super::*;

/// Queries near data, between them, and where there are none.
fn queries(x: &[Vec<f64>], h: &[f64]) -> Vec<Vec<f64>> {
    let n = x[0].len();
    x.iter()
        .zip(h)
        .enumerate()
        .map(|(j, (column, h))| {
            (0..40)
                .map(|i| column[(i * 7) % n] + 0.3 * h * (((i + j) % 4) as f64 - 1.0))
                .chain([1e9, f64::NAN])
                .collect()
        })
        .collect()
}

#[test]
fn estimates_agree_with_direct_summation() {
    let (mut compared, mut vague) = (0, 0);
    for d in [2, 3, 4] {
        for (name, x) in hard_columns(d as u64, 300, d) {
            for w in [None, Some(weights(300))] {
                let ones = vec![1.0; 300];
                for (kernel, scale) in Kernel::ALL.into_iter().flat_map(|k| [(k, 0.35), (k, 1.1)]) {
                    let h: Vec<f64> = (0..d).map(|j| scale * (1.0 + 0.2 * j as f64)).collect();
                    let y = response(&x, 1e3);
                    let at = queries(&x, &h);
                    let twin = Direct {
                        x: &x,
                        y: &y,
                        w: w.as_ref().unwrap_or(&ones),
                        kernel,
                        h: &h,
                    };
                    for degree in DEGREES {
                        let fit = fit(&method(kernel, degree, &h), &x, &y, w.as_deref());
                        let got = fit.predict(&slices(&at)).unwrap();
                        for (i, got) in got.into_iter().enumerate() {
                            let q: Vec<f64> = at.iter().map(|c| c[i]).collect();
                            let what = format!("{name} d={d} {kernel:?} {degree:?} h={h:?} q={q:?}: {got}");
                            let Some((want, determined)) = twin.estimate(degree, &q, None) else {
                                assert!(got.is_nan(), "{what}");
                                continue;
                            };
                            compared += 1;
                            if determined < 1e-3 {
                                vague += 1;
                                continue;
                            }
                            let error = (got - want).abs() / want.abs().max(1.0);
                            assert!(
                                error * (10.0 * determined).min(1.0) < 1e-11,
                                "{what} {want} ({error:e}, {determined:e})"
                            );
                        }
                    }
                }
            }
        }
    }
    assert!(5 * vague < compared, "{vague} of {compared} left out");
}

#[test]
fn five_and_six_columns_work_too() {
    for d in [5, 6] {
        for (name, x) in hard_columns(40 + d as u64, 200, d) {
            let (y, h) = (response(&x, 0.0), vec![1.5; d]);
            let twin = Direct {
                x: &x,
                y: &y,
                w: &vec![1.0; 200],
                kernel: Kernel::Epanechnikov,
                h: &h,
            };
            for degree in DEGREES {
                let fit = fit(&method(Kernel::Epanechnikov, degree, &[1.5]), &x, &y, None);
                let got = fit.predict(&slices(&x)).unwrap();
                for i in 0..200 {
                    let q: Vec<f64> = x.iter().map(|c| c[i]).collect();
                    let (want, determined) = twin.estimate(degree, &q, None).unwrap();
                    let near = (got[i] - want).abs() < 1e-11 * want.abs().max(1.0);
                    assert!(
                        near || determined < 1e-3,
                        "{name} d={d} {degree:?} {i}: {} {want}",
                        got[i]
                    );
                }
            }
        }
    }
}

#[test]
fn a_plane_is_reproduced_by_the_local_plane() {
    // Far outliers have no others in reach to make a plane of.
    for (name, x) in hard_columns(5, 400, 2)
        .into_iter()
        .filter(|(name, _)| *name != "cauchy")
    {
        let y: Vec<f64> = x[0].iter().zip(&x[1]).map(|(a, b)| 2.0 * (a - b) + 1.0).collect();
        let fit = fit(&method(Kernel::Biweight, Degree::Linear, &[1.0]), &x, &y, None);
        let got = fit.predict(&slices(&x)).unwrap();
        for (got, want) in got.iter().zip(&y) {
            // The sums of the abscissas' digits beyond the last are not known to y.
            assert!((got - want).abs() < 1e-8 * want.abs().max(1.0), "{name}: {got} {want}");
        }
    }
}

#[test]
fn points_that_determine_no_plane_make_a_mean_or_leave_a_column_out() {
    let h = [1.0, 1.0];
    let at: [&[f64]; 2] = [&[0.3], &[0.1]];
    let t: Vec<f64> = (0..9).map(|i| f64::from(i) / 8.0 - 0.5).collect();
    let y: Vec<f64> = t.iter().map(|t| t * t).collect();
    let value = |x: &[Vec<f64>], degree| {
        fit(&method(Kernel::Triangular, degree, &h), x, &y, None)
            .predict(&at)
            .unwrap()[0]
    };
    // On a slanted line in the plane: the local mean.
    let line = [t.clone(), t.iter().map(|t| 0.7 * t).collect()];
    let (plane, mean) = (value(&line, Degree::Linear), value(&line, Degree::Constant));
    assert!((plane - mean).abs() < 1e-15, "{plane} {mean}");
    // One value of the second column: the local line in the first.
    let level = [t.clone(), vec![0.0; 9]];
    let alone = method(Kernel::Triangular, Degree::Linear, &[1.0])
        .fit(&[&t], &y, None)
        .unwrap();
    let want = alone.predict(&[&[0.3]]).unwrap()[0];
    assert!((value(&level, Degree::Linear) - want).abs() < 1e-14);
    assert!((value(&level, Degree::Constant) - want).abs() > 1e-3);
}

#[test]
fn a_far_gaussian_window_sees_the_nearest_points() {
    let x = vec![vec![0.0, 0.0, 30.0], vec![0.0, 1.0, 0.0]];
    let fit = fit(
        &method(Kernel::Gaussian, Degree::Constant, &[1.0]),
        &x,
        &[1.0, 2.0, 5.0],
        None,
    );
    let got = fit
        .predict(&[&[14.0, 16.0, -30.0, -40.0], &[0.0, 0.0, 0.5, 0.0]])
        .unwrap();
    // The weights are tiny and still count: 1 and 2 share by exp(-1/2).
    let near = (1.0 + 2.0 * (-0.5_f64).exp()) / (1.0 + (-0.5_f64).exp());
    assert!((got[0] - near).abs() < 1e-12, "{got:?}");
    assert!((got[1] - 5.0).abs() < 1e-11 && (got[2] - 1.5).abs() < 1e-14, "{got:?}");
    assert!(got[3].is_nan());
}

#[test]
fn columns_can_be_scaled_and_change_places() {
    let (_, x) = hard_columns(7, 500, 3).swap_remove(0);
    let (y, h) = (response(&x, 0.0), [0.3, 0.5, 0.7]);
    for (kernel, degree) in Kernel::ALL.into_iter().flat_map(|k| DEGREES.map(|d| (k, d))) {
        let plain = fit(&method(kernel, degree, &h), &x, &y, None)
            .predict(&slices(&x))
            .unwrap();
        // Powers of two: every bit stays.
        let scale = [4.0, 0.125, 1024.0];
        let scaled: Vec<Vec<f64>> = x
            .iter()
            .zip(scale)
            .map(|(c, s)| c.iter().map(|x| s * x).collect())
            .collect();
        let wide: Vec<f64> = h.iter().zip(scale).map(|(h, s)| h * s).collect();
        let same = fit(&method(kernel, degree, &wide), &scaled, &y, None)
            .predict(&slices(&scaled))
            .unwrap();
        assert_eq!(plain, same, "{kernel:?} {degree:?}");
        let turned = vec![x[2].clone(), x[0].clone(), x[1].clone()];
        let turned_h = [h[2], h[0], h[1]];
        let other = fit(&method(kernel, degree, &turned_h), &turned, &y, None)
            .predict(&slices(&turned))
            .unwrap();
        for (a, b) in plain.iter().zip(other) {
            assert!(
                (a - b).abs() < 1e-11 * a.abs().max(1.0),
                "{kernel:?} {degree:?}: {a} {b}"
            );
        }
    }
}

#[test]
fn neither_the_order_nor_the_threads_nor_points_without_weight_matter() {
    let (_, x) = hard_columns(8, 3000, 2).swap_remove(0);
    let y = response(&x, 0.0);
    let reversed = |v: &[f64]| v.iter().rev().copied().collect::<Vec<_>>();
    let back: Vec<Vec<f64>> = x.iter().map(|c| reversed(c)).collect();
    let mut more = x.clone();
    more.iter_mut().for_each(|c| c.push(0.0));
    let more_y: Vec<f64> = y.iter().copied().chain([1e9]).collect();
    let more_w: Vec<f64> = (0..3001).map(|i| if i < 3000 { 1.0 } else { 0.0 }).collect();
    for degree in DEGREES {
        let method = method(Kernel::Epanechnikov, degree, &[0.2, 0.1]);
        let run = |threads, x: &[Vec<f64>], y: &[f64], w: Option<&[f64]>| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let value = fit(&method, x, y, w).predict(&slices(&more)).unwrap();
                let score = method.score(Criterion::LeaveOneOut, &slices(x), y, w).unwrap();
                (value, score)
            })
        };
        let one = run(1, &x, &y, None);
        assert_eq!(one, run(3, &x, &y, None));
        for other in [
            run(2, &back, &reversed(&y), None),
            run(2, &more, &more_y, Some(&more_w)),
        ] {
            assert!((one.1 - other.1).abs() < 1e-12 * one.1);
            for (a, b) in one.0.iter().zip(other.0) {
                assert!((a - b).abs() < 1e-12 * a.abs().max(1.0), "{a} {b}");
            }
        }
    }
}
