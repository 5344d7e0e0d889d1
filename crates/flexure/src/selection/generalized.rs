//! The bandwidth by generalised cross-validation (Craven and Wahba 1979), for the kernel estimates.

use super::grid::Grid;
use super::{BandwidthSearch, ScoredParameter};
use crate::nonlinearity::kernel::{Degree, Kernel, Sorted, for_each_sum};

/// Minimises the mean squared residual divided by (1 - df/n)^2. df is the trace of the hat matrix: the sum of every point's share in its
/// own fit, K(0) w_i / S_0(X_i) or that of the local line.
pub(crate) fn generalized(kernel: Kernel, degree: Degree, data: &Sorted) -> BandwidthSearch {
    Grid::new(&data.x).search(|h| generalized_score(data, kernel, degree, h))
}

/// The score of one bandwidth.
pub(crate) fn generalized_score(data: &Sorted, kernel: Kernel, degree: Degree, h: f64) -> f64 {
    score(data, kernel, degree, h).generalized
}

/// The exact score of one bandwidth, in O(n).
fn score(data: &Sorted, kernel: Kernel, degree: Degree, h: f64) -> ScoredParameter<f64> {
    let (mut squares, mut trace, mut total) = (0.0, 0.0, 0.0);
    for_each_sum(data, kernel, degree, h, &data.x, |i, sums| {
        let w = data.weight(i);
        // A point is always within its own reach.
        if let Some(fit) = sums.fit(degree) {
            squares += w * (data.y[i] - fit.value).powi(2);
            trace += w * fit.leverage;
        }
        total += w;
    });
    ScoredParameter::new(h, trace, f64::INFINITY, squares, total, data.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nonlinearity::KernelRegression;
    use crate::selection::test_data::noisy;

    /// The hat matrix column by column, from fits to unit ordinates.
    fn by_fits(kernel: Kernel, degree: Degree, h: f64, x: &[f64], y: &[f64], w: &[f64]) -> (f64, f64) {
        let fitted = |y: &[f64]| {
            let fit = KernelRegression { kernel, bandwidth: h }.fit_weighted(x, y, w).unwrap();
            fit.with_degree(degree).predict(x)
        };
        let n = x.len();
        let unit = |i: usize| (0..n).map(|j| f64::from(u8::from(i == j))).collect::<Vec<_>>();
        let trace: f64 = (0..n).map(|i| fitted(&unit(i))[i]).sum();
        let squares: f64 = fitted(y)
            .iter()
            .zip(y)
            .zip(w)
            .map(|((f, y), w)| w * (y - f).powi(2))
            .sum();
        let mean = squares / w.iter().sum::<f64>();
        (trace, mean / (1.0 - trace / n as f64).powi(2))
    }

    #[test]
    fn trace_and_score_are_those_of_the_hat_matrix() {
        let (x, y) = noisy(3, 60, |x| (2.0 * x).sin());
        let w: Vec<f64> = (0..60).map(|i| [0.5, 1.0, 3.0][i % 3]).collect();
        let data = Sorted::new(&x, &y, Some(&w));
        for kernel in Kernel::ALL {
            for degree in [Degree::Constant, Degree::Linear] {
                for h in [0.3, 1.5] {
                    let got = score(&data, kernel, degree, h);
                    let (trace, want) = by_fits(kernel, degree, h, &x, &y, &w);
                    assert!(
                        (got.degrees_of_freedom - trace).abs() < 1e-10 * trace,
                        "{kernel:?} {degree:?} {h}"
                    );
                    assert!(
                        (got.generalized - want).abs() < 1e-10 * want,
                        "{kernel:?} {degree:?} {h}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_choice_is_close_to_that_of_leave_one_out() {
        let (x, y) = noisy(5, 3000, |x| (3.0 * x).sin());
        let general = generalized(Kernel::Epanechnikov, Degree::Linear, &Sorted::new(&x, &y, None));
        let exact = BandwidthSearch::search(Kernel::Epanechnikov, Degree::Linear, &x, &y, None).unwrap();
        assert!((general.bandwidth / exact.bandwidth).ln().abs() < 0.3);
        let lowest = |s: &BandwidthSearch| s.curve.iter().map(|c| c.error).fold(f64::INFINITY, f64::min);
        assert!((lowest(&general) / lowest(&exact) - 1.0).abs() < 1e-3);
    }
}
