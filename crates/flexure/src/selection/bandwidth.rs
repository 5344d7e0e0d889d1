//! The bandwidth by exact leave-one-out cross-validation:
//! h minimises $\frac1n \sum_i (Y_i - m_{n,-i}(X_i))^2$, where m_{n,-i} is the estimate without point i.
//!
//! A logarithmic grid first, as the score may have several minima, then a golden-section search
//! around the best. Every bandwidth costs O(n) after the one sort.

use rayon::prelude::*;

use crate::error::Result;
use crate::nonlinearity::kernel::{Degree, Kernel, Sorted, check_points, check_weights, leave_one_out};

/// Bandwidths of the logarithmic grid.
const GRID: usize = 20;
/// Golden-section steps around the best of the grid.
const REFINEMENTS: usize = 6;
/// The smallest bandwidth tried, as a share of the data's extent, whatever the number of points.
const SMALLEST: f64 = 1e-4;

/// Relative difference of two scores that counts as none.
const FLAT: f64 = 1e-9;

/// A candidate and its score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// The bandwidth, in the unit of x.
    pub bandwidth: f64,
    /// The mean squared leave-one-out error, in the squared unit of y.
    pub error: f64,
}

/// The whole search: its result is part of every identification that used it.
#[derive(Debug, Clone, PartialEq)]
pub struct BandwidthSearch {
    /// The bandwidth with the smallest score.
    pub bandwidth: f64,
    /// All candidates in order of bandwidth.
    pub curve: Vec<Score>,
    /// Whether the best candidate is the smallest or the largest one tried, so that the minimum may
    /// lie beyond.
    pub at_edge: bool,
}

impl BandwidthSearch {
    /// Searches for `kernel` over the points `(x[i], y[i])`.
    ///
    /// The result does not depend on the number of threads nor on the order of the points.
    ///
    /// # Errors
    /// [`crate::Error::TooShort`] with fewer than 3 points, [`crate::Error::LengthMismatch`],
    /// [`crate::Error::NonFinite`].
    pub fn leave_one_out(kernel: Kernel, x: &[f64], y: &[f64]) -> Result<Self> {
        Self::search(kernel, Degree::Constant, x, y, None)
    }

    /// Searches for `kernel` and the local polynomial of this degree over the points `(x[i], y[i])`, weighted
    /// as by [`KernelRegression::fit_weighted`](crate::nonlinearity::KernelRegression::fit_weighted): the
    /// score is then sum_i w_i (Y_i - m_{n,-i}(X_i))^2 / sum_i w_i.
    ///
    /// # Errors
    /// Those of [`leave_one_out`](Self::leave_one_out), [`crate::Error::InvalidParameter`] for a negative
    /// weight, and [`crate::Error::TooShort`] with fewer than 3 points of positive weight.
    pub fn search(kernel: Kernel, degree: Degree, x: &[f64], y: &[f64], weights: Option<&[f64]>) -> Result<Self> {
        check_points(x, y, 3)?;
        let data = match weights {
            None => Sorted::new(x, y),
            Some(weights) => {
                check_weights(weights, x.len(), 3)?;
                Sorted::weighted(x, y, weights)
            }
        };
        Ok(Self::with_degree(kernel, degree, &data))
    }

    pub(crate) fn over(kernel: Kernel, data: &Sorted) -> Self {
        Self::with_degree(kernel, Degree::Constant, data)
    }

    fn with_degree(kernel: Kernel, degree: Degree, data: &Sorted) -> Self {
        let (smallest, largest) = extent(&data.x);
        let ratio = (largest / smallest).ln() / (GRID - 1) as f64;
        // By the logarithm of the ratio to the smallest, so that the unit of x changes nothing.
        let score = |t: f64| {
            let bandwidth = smallest * t.exp();
            Score {
                bandwidth,
                error: leave_one_out(data, kernel, degree, &[bandwidth])[0],
            }
        };
        let mut curve: Vec<Score> = (0..GRID).into_par_iter().map(|i| score(ratio * i as f64)).collect();
        let best = lowest(&curve);
        let inside = 0 < best && best < GRID - 1;
        let next = &curve[best.clamp(1, GRID - 2)];
        // A score that does not depend on the bandwidth (an input of a few levels) has no edge.
        let at_edge = !inside && next.error - curve[best].error > FLAT * next.error;
        if inside {
            let (below, above) = (ratio * (best - 1) as f64, ratio * (best + 1) as f64);
            curve.extend(golden_section(below, above, score));
            curve.sort_by(|a, b| a.bandwidth.total_cmp(&b.bandwidth));
        }
        BandwidthSearch {
            bandwidth: curve[lowest(&curve)].bandwidth,
            curve,
            at_edge,
        }
    }
}

/// The index of the lowest score; of equal ones the last, the smoothest.
fn lowest(curve: &[Score]) -> usize {
    (0..curve.len())
        .rev()
        .min_by(|&i, &j| curve[i].error.total_cmp(&curve[j].error))
        .unwrap_or(0)
}

/// The smallest and the largest bandwidth worth trying.
///
/// The extent is that of the bulk of the data, so that a few far outliers do not coarsen the grid.
fn extent(sorted: &[f64]) -> (f64, f64) {
    let n = sorted.len();
    let range = sorted[n - 1] - sorted[0];
    let bulk = 2.0 * (sorted[n - 1 - n / 10] - sorted[n / 10]);
    let extent = if bulk > 0.0 { bulk.min(range) } else { range };
    // A constant x: any bandwidth gives the mean.
    let extent = if extent > 0.0 { extent } else { 1.0 };
    let smallest = extent * (3.0 / n as f64).clamp(SMALLEST, 0.2);
    (smallest, extent.max(2.0 * smallest))
}

/// Golden-section search for a minimum of `score` on [a, b]; all points that were tried.
fn golden_section(mut a: f64, mut b: f64, score: impl Fn(f64) -> Score) -> Vec<Score> {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut c, mut d) = (b - golden * (b - a), a + golden * (b - a));
    let (mut low, mut high) = (score(c), score(d));
    let mut tried = vec![low, high];
    for _ in 2..REFINEMENTS {
        if low.error < high.error {
            (b, d, high) = (d, c, low);
            c = b - golden * (b - a);
            low = score(c);
            tried.push(low);
        } else {
            (a, c, low) = (c, d, high);
            d = a + golden * (b - a);
            high = score(d);
            tried.push(high);
        }
    }
    tried
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    fn noisy(seed: u64, n: usize, m: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let x: Vec<f64> = (0..n).map(|_| rng.random_range(-2.0..2.0)).collect();
        let y = x
            .iter()
            .map(|&x| {
                let e: f64 = StandardNormal.sample(&mut rng);
                m(x) + 0.1 * e
            })
            .collect();
        (x, y)
    }

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
        let data = Sorted::new(&x, &y);
        let true_error = |h: f64| {
            let mut total = 0.0;
            crate::nonlinearity::kernel::for_each_sum(
                &data,
                Kernel::Epanechnikov,
                Degree::Constant,
                h,
                &data.x,
                |i, s| {
                    total += (data.mean + s.t[0] / s.s[0] - m(data.x[i])).powi(2);
                },
            );
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

    #[test]
    fn constant_abscissas_do_not_break_the_search() {
        let search = BandwidthSearch::leave_one_out(Kernel::Gaussian, &[1.0; 5], &[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        assert!(search.bandwidth > 0.0 && search.curve.iter().all(|s| s.error.is_finite()));
    }
}
