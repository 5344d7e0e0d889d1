//! Beyond the data and in gaps.

use super::*;

fn with(outside: Outside, degree: Degree, h: &[f64]) -> KernelEstimator {
    KernelEstimator {
        outside,
        ..method(Kernel::Epanechnikov, degree, h)
    }
}

/// Two groups of points on a line, on the parabola.
fn two_groups() -> (Vec<f64>, Vec<f64>) {
    let x: Vec<f64> = (0..11)
        .map(|i| f64::from(i) / 10.0)
        .chain((0..11).map(|i| 3.0 + f64::from(i) / 10.0))
        .collect();
    let y = x.iter().map(|x| x * x).collect();
    (x, y)
}

#[test]
fn on_a_line_the_policy_holds_beyond_the_range_and_across_gaps() {
    let (x, y) = two_groups();
    let at = [-2.0, 1.4, 2.0, 2.6, 6.0, 0.52, f64::NAN];
    for degree in DEGREES {
        let run = |outside, at: &[f64]| {
            let fit = with(outside, degree, &[0.25]).fit(&[&x], &y, None).unwrap();
            fit.predict(&[at]).unwrap()
        };
        let nan = run(Outside::Nan, &at);
        assert!(nan[..5].iter().all(|v| v.is_nan()) && nan[5].is_finite());
        let ends = run(Outside::Nan, &[0.0, 1.0, 3.0, 4.0]);
        let nearest = run(Outside::Nearest, &at);
        assert_eq!(nearest[..2], [ends[0], ends[1]]);
        assert!((nearest[2] - 0.5 * (ends[1] + ends[2])).abs() < 1e-14);
        assert_eq!(nearest[3..6], [ends[2], ends[3], nan[5]]);
        let linear = run(Outside::Linear, &at);
        // The local line at an end of the parabola: its slope is that in the middle of the window, roughly.
        let slope = (linear[0] - ends[0]) / -2.0;
        assert!((0.05..0.3).contains(&slope), "{slope}");
        let slope = (linear[4] - ends[3]) / 2.0;
        assert!((7.7..7.95).contains(&slope), "{slope}");
        for (i, share) in [(1, 0.2), (2, 0.5), (3, 0.8)] {
            assert!((linear[i] - (ends[1] + share * (ends[2] - ends[1]))).abs() < 1e-12);
        }
        assert_eq!(linear[5], nan[5]);
        assert!(linear[6].is_nan() && nearest[6].is_nan());
    }
}

#[test]
fn on_a_line_the_continuations_are_continuous() {
    let (x, y) = two_groups();
    for outside in [Outside::Nearest, Outside::Linear] {
        let fit = with(outside, Degree::Linear, &[0.25]).fit(&[&x], &y, None).unwrap();
        for end in [0.0_f64, 1.0, 3.0, 4.0] {
            let values = fit.predict(&[&[end - 1e-9, end, end + 1e-9]]).unwrap();
            assert!(
                values.iter().all(|v| (v - values[1]).abs() < 1e-6),
                "{outside:?} {values:?}"
            );
        }
    }
}

#[test]
fn in_space_the_nearest_point_or_its_plane_goes_on() {
    let (_, x) = hard_columns(9, 2000, 2).swap_remove(0);
    // A hole in the middle.
    let kept: Vec<usize> = (0..2000).filter(|&i| x[0][i].hypot(x[1][i]) > 0.5).collect();
    let x: Vec<Vec<f64>> = x.iter().map(|c| kept.iter().map(|&i| c[i]).collect()).collect();
    let y: Vec<f64> = x[0].iter().zip(&x[1]).map(|(a, b)| 3.0 + 2.0 * a - b).collect();
    let at: [&[f64]; 2] = [&[0.05, 5.0, -3.0, 0.8, 0.0], &[0.0, 0.3, -4.0, 0.1, f64::NAN]];
    let run = |outside, degree| {
        let fit = with(outside, degree, &[0.2, 0.3]).fit(&slices(&x), &y, None).unwrap();
        fit.predict(&at).unwrap()
    };
    let nan = run(Outside::Nan, Degree::Linear);
    assert!(nan[..3].iter().all(|v| v.is_nan()) && (nan[3] - 4.5).abs() < 1e-12);
    // Planes are carried on exactly by planes.
    let linear = run(Outside::Linear, Degree::Linear);
    for (got, want) in linear.iter().zip([3.1, 12.7, 1.0, 4.5]) {
        assert!((got - want).abs() < 1e-10, "{linear:?}");
    }
    let nearest = run(Outside::Nearest, Degree::Linear);
    // (5, 0.3) goes to the edge, (-3, -4) to the corner of the ranges.
    let edge = |j: usize, f: fn(f64, f64) -> f64| x[j].iter().copied().reduce(f).unwrap();
    assert!((nearest[1] - (3.0 + 2.0 * edge(0, f64::max) - 0.3)).abs() < 1e-10);
    assert!((nearest[2] - (3.0 + 2.0 * edge(0, f64::min) - edge(1, f64::min))).abs() < 1e-10);
    // In the hole: the estimate at the nearest of the data, in bandwidths.
    let far = |i: usize| ((x[0][i] - 0.05) / 0.2).hypot(x[1][i] / 0.3);
    let next = (0..y.len()).min_by(|&i, &k| far(i).total_cmp(&far(k))).unwrap();
    assert!((nearest[0] - y[next]).abs() < 1e-10);
    // The mean is carried on by the local plane's slopes, too.
    let (flat, tilted) = (
        run(Outside::Nearest, Degree::Constant),
        run(Outside::Linear, Degree::Constant),
    );
    assert!((tilted[1] - flat[1] - 2.0 * (5.0 - edge(0, f64::max))).abs() < 1e-9);
    assert!([&nearest, &linear, &flat, &tilted].iter().all(|v| v[4].is_nan()));
}

#[test]
fn an_empty_corner_of_the_ranges_takes_the_nearest_point() {
    // An L of points: the corner at (1, 1) is empty.
    let t: Vec<f64> = (0..50).map(|i| f64::from(i) / 49.0).collect();
    let a: Vec<f64> = t.iter().copied().chain(t.iter().map(|_| 0.0)).collect();
    let b: Vec<f64> = t.iter().map(|_| 0.0).chain(t.iter().copied()).collect();
    let y: Vec<f64> = (0..100).map(|i| if i < 50 { 1.0 } else { 2.0 }).collect();
    let fit = with(Outside::Nearest, Degree::Constant, &[0.1, 0.2])
        .fit(&[&a, &b], &y, None)
        .unwrap();
    assert_eq!(fit.predict(&[&[2.0, 0.2], &[2.0, 0.9]]).unwrap(), [1.0, 2.0]);
}
