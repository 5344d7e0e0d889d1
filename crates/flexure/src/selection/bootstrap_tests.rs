use super::*;
use crate::nonlinearity::KernelRegression;
use crate::selection::test_data::{noisy, slow};

/// S_h as a matrix, row by row, from fits to unit ordinates.
fn smoother(kernel: Kernel, degree: Degree, h: f64, x: &[f64], w: &[f64]) -> Vec<Vec<f64>> {
    let n = x.len();
    let column = |j: usize| {
        let unit: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i == j))).collect();
        let fit = KernelRegression { kernel, bandwidth: h }
            .fit_weighted(x, &unit, w)
            .unwrap();
        fit.with_degree(degree).predict(x)
    };
    let columns: Vec<Vec<f64>> = (0..n).map(column).collect();
    (0..n).map(|i| (0..n).map(|j| columns[j][i]).collect()).collect()
}

fn product(s: &[Vec<f64>], v: &[f64]) -> Vec<f64> {
    s.iter()
        .map(|row| row.iter().zip(v).map(|(a, b)| a * b).sum())
        .collect()
}

#[test]
fn the_wild_score_is_that_of_the_smoothers_matrix() {
    let n = 80;
    let (x, y) = noisy(1, n, |x| (2.0 * x).sin());
    let w: Vec<f64> = (0..n).map(|i| [1.0, 0.5, 2.0][i % 3]).collect();
    let total: f64 = w.iter().sum();
    for kernel in [Kernel::Uniform, Kernel::Epanechnikov, Kernel::Gaussian] {
        for degree in [Degree::Constant, Degree::Linear] {
            let search = wild(kernel, degree, &x, &y, Some(&w)).unwrap().search;
            let h0 = BandwidthSearch::search(kernel, degree, &x, &y, Some(&w))
                .unwrap()
                .bandwidth;
            let mut sorted = x.clone();
            sorted.sort_by(f64::total_cmp);
            let g = Grid::new(&sorted).clamp(h0 * (n as f64).powf(4.0 / 45.0));
            let curve = product(&smoother(kernel, degree, g, &x, &w), &y);
            let first = smoother(kernel, degree, h0, &x, &w);
            let fitted = product(&first, &y);
            let mut r: Vec<f64> = (0..n)
                .map(|i| (y[i] - fitted[i]) / (1.0 - first[i][i]).sqrt())
                .collect();
            for i in 0..n {
                if 1.0 - first[i][i] < OWN {
                    r[i] = f64::NAN;
                }
            }
            fill_unknown(&mut r);
            for score in search.curve.iter().step_by(5) {
                let s = smoother(kernel, degree, score.bandwidth, &x, &w);
                let smoothed = product(&s, &curve);
                let mut want = 0.0;
                for i in 0..n {
                    let variance: f64 = (0..n).map(|j| (s[i][j] * r[j]).powi(2)).sum();
                    want += w[i] / total * ((smoothed[i] - curve[i]).powi(2) + variance);
                }
                let what = format!("{kernel:?} {degree:?} {score:?} {want}");
                assert!((score.error - want).abs() < 1e-8 * want, "{what}");
            }
        }
    }
}

#[test]
fn kernels_that_have_no_square_are_converted() {
    let (x, y) = noisy(2, 300, |x| x.sin());
    let of = |kernel| wild(kernel, Degree::Linear, &x, &y, None).unwrap();
    let (like, converted) = (of(Kernel::Epanechnikov), of(Kernel::Triweight));
    assert!((converted.search.bandwidth / like.search.bandwidth - 1.3453).abs() < 1e-3);
    assert!(converted.details.contains("Epanechnikov"));
    let search = converted.search;
    assert!(search.curve.iter().any(|s| s.bandwidth == search.bandwidth));
}

#[test]
fn blocks_of_one_residual_are_the_bootstrap_of_independent_errors() {
    // With errors of one variance the wild scores are nearly those of single residuals.
    let (x, y) = noisy(3, 400, |x| x.sin());
    let settings = BlockResampling {
        block: Some(1),
        replicates: Some(300),
        seed: 7,
    };
    let blocks = moving_block(settings, Kernel::Epanechnikov, Degree::Linear, [&x, &y], None).unwrap();
    let single = blocks.chosen.search;
    let wild = wild(Kernel::Epanechnikov, Degree::Linear, &x, &y, None).unwrap().search;
    assert_eq!([blocks.block, blocks.replicates], [1, 300]);
    let (a, b) = (single.curve.first().unwrap().error, wild.curve.first().unwrap().error);
    assert!((a / b - 1.0).abs() < 0.05, "{a} {b}");
    assert!((single.bandwidth / wild.bandwidth).ln().abs() < 0.35);
}

#[test]
fn resampled_errors_are_blocks_and_differ_from_one_replicate_to_the_next() {
    let residuals: Vec<f64> = (0..50).map(f64::from).collect();
    let one: Vec<f64> = resampled(&residuals, 8, 3, 0).collect();
    assert_eq!(one.len(), 50);
    for block in one.chunks(8) {
        assert!(block.windows(2).all(|w| w[1] == w[0] + 1.0));
    }
    assert_eq!(one, resampled(&residuals, 8, 3, 0).collect::<Vec<_>>());
    assert_ne!(one, resampled(&residuals, 8, 3, 1).collect::<Vec<_>>());
    assert_ne!(one, resampled(&residuals, 8, 4, 0).collect::<Vec<_>>());
}

#[test]
fn with_dependent_errors_blocks_smooth_more_than_the_wild_bootstrap() {
    let m = |x: f64| (2.0 * x).sin();
    let (mut wider, mut errors) = (0, [0.0; 2]);
    for seed in 0..6 {
        let (x, y) = slow(seed, 500, 0.8, m);
        let settings = BlockResampling {
            block: None,
            replicates: None,
            seed: 1,
        };
        let (kernel, degree) = (Kernel::Epanechnikov, Degree::Linear);
        let blocks = moving_block(settings, kernel, degree, [&x, &y], None)
            .unwrap()
            .chosen
            .search;
        let single = wild(kernel, degree, &x, &y, None).unwrap().search;
        wider += usize::from(blocks.bandwidth > single.bandwidth);
        for (error, h) in errors.iter_mut().zip([single.bandwidth, blocks.bandwidth]) {
            let fitted = KernelRegression { kernel, bandwidth: h }
                .fit(&x, &y)
                .unwrap()
                .with_degree(degree)
                .predict(&x);
            *error += fitted.iter().zip(&x).map(|(f, &x)| (f - m(x)).powi(2)).sum::<f64>() / 3000.0;
        }
    }
    eprintln!(
        "mean squared errors: wild {:.5}, moving blocks {:.5}",
        errors[0], errors[1]
    );
    assert!(wider >= 5 && errors[1] < 0.8 * errors[0], "{wider} {errors:?}");
}
