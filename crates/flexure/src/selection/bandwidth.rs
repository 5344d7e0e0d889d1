//! The bandwidth by leave-one-out cross-validation:
//! h minimises $\frac1n \sum_i (Y_i - m_{n,-i}(X_i))^2$, where m_{n,-i} is the estimate without point i.
//!
//! A logarithmic grid first, as the score may have several minima, then smaller steps around the best and the
//! lowest point of a parabola. Every bandwidth costs O(n) after the one sort. With many points the search is made
//! on data in bins, and then checked by exact scores around the best.

use crate::error::{Error, Result};
use crate::nonlinearity::kernel::{Degree, Kernel, Pyramid, Sorted, check_points, check_weights, leave_one_out};

/// Bandwidths of the logarithmic grid, for exact scores and for binned ones.
const GRID: usize = 20;
const BINNED_GRID: usize = 50;
/// Steps into which the grid's on either side of the best is divided.
const STEPS: usize = 3;
/// The smallest bandwidth tried, as a share of the data's extent, whatever the number of points.
const SMALLEST: f64 = 1e-4;

/// Relative difference of two scores that counts as none.
const FLAT: f64 = 1e-9;

/// So many points or more are put in bins by default: the exact sums of the Gaussian cost more.
const BINNED_FROM: usize = 200_000;
const BINNED_FROM_GAUSSIAN: usize = 20_000;
/// Bins to a bandwidth, at least; the Gaussian's bandwidth is not its reach.
const BINS: f64 = 30.0;
const BINS_GAUSSIAN: f64 = 12.0;
/// Where binned scores differ by more than this from the exact ones, relatively, the search is made exactly.
const MOST_ERROR: f64 = 1e-3;

/// A candidate and its score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// The bandwidth, in the unit of x.
    pub bandwidth: f64,
    /// The mean squared leave-one-out error, in the squared unit of y.
    pub error: f64,
}

/// How the scores of a search are summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scoring {
    /// Exactly below 200,000 points (Gaussian: 20,000) and with weights, otherwise as [`Binned`](Self::Binned).
    #[default]
    Automatic,
    /// Exactly, whatever the number of points.
    Exact,
    /// On data in bins of at most 1/30 of the bandwidth (Gaussian: 1/12); then exactly at the best bandwidth and its
    /// neighbours, of which the best is chosen. Where a binned score turns out to be off by more than 0.1 %,
    /// and with weights, the search is made exactly.
    Binned,
}

/// What was put in bins, and what it cost in accuracy.
#[derive(Debug, Clone, PartialEq)]
pub struct Binning {
    /// The width of the narrowest bins, in the unit of x.
    pub narrowest: f64,
    /// The exact scores at the chosen bandwidth and around it, in order of bandwidth.
    pub exact: Vec<Score>,
    /// The largest relative difference between these and the binned scores.
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
    /// Present where the scores of `curve` come from data in bins.
    pub binning: Option<Binning>,
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
        let method = LeaveOneOut {
            kernel,
            degree,
            scoring: Scoring::Automatic,
        };
        method.search(x, y, weights)
    }

    /// [`search`](Self::search) over data that are sorted already.
    pub(crate) fn with_degree(kernel: Kernel, degree: Degree, data: &Sorted) -> Self {
        let method = LeaveOneOut {
            kernel,
            degree,
            scoring: Scoring::Automatic,
        };
        method.search_sorted(data)
    }
}

/// Cross-validation of the bandwidth.
///
/// | parameter | purpose | default |
/// |---|---|---|
/// | `kernel` | the weight function | Epanechnikov |
/// | `degree` | of the local polynomial | constant |
/// | `scoring` | exactly or on data in bins | exactly up to 200,000 points |
///
/// ```
/// use flexure::selection::{LeaveOneOut, Scoring};
/// let x: Vec<f64> = (0..500).map(|i| f64::from(i * 37 % 500) / 100.0).collect();
/// let y: Vec<f64> = x.iter().enumerate().map(|(i, x)| x.sin() + 0.1 * (i as f64).cos()).collect();
/// let method = LeaveOneOut { scoring: Scoring::Exact, ..LeaveOneOut::default() };
/// let found = method.search(&x, &y, None)?;
/// let scores = method.exact_scores(&x, &y, None, &[0.5 * found.bandwidth, found.bandwidth])?;
/// assert!(scores[1].error < scores[0].error);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LeaveOneOut {
    /// The weight function.
    pub kernel: Kernel,
    /// The degree of the local polynomial.
    pub degree: Degree,
    /// How the scores are summed.
    pub scoring: Scoring,
}

impl LeaveOneOut {
    /// Searches for the bandwidth over the points `(x[i], y[i])`, which may have weights.
    ///
    /// The result does not depend on the number of threads nor on the order of the points.
    ///
    /// # Errors
    /// Those of [`BandwidthSearch::search`].
    pub fn search(&self, x: &[f64], y: &[f64], weights: Option<&[f64]>) -> Result<BandwidthSearch> {
        Ok(self.search_sorted(&sort(x, y, weights)?))
    }

    /// The exact scores of given bandwidths, in their order.
    ///
    /// # Errors
    /// Those of [`BandwidthSearch::search`], and [`crate::Error::InvalidParameter`] for a bandwidth that is not
    /// positive and finite.
    pub fn exact_scores(
        &self,
        x: &[f64],
        y: &[f64],
        weights: Option<&[f64]>,
        bandwidths: &[f64],
    ) -> Result<Vec<Score>> {
        check_bandwidths(bandwidths)?;
        Ok(scored(bandwidths, self.exact(&sort(x, y, weights)?, bandwidths)))
    }

    /// The scores of given bandwidths, in their order, on data in bins as of [`Scoring::Binned`]: the points are
    /// read once, in the order they have, and the rest takes no longer the more they are. Nothing is checked by
    /// exact scores; near the best bandwidth they differ by less than 1e-3.
    ///
    /// # Errors
    /// Those of [`exact_scores`](Self::exact_scores).
    pub fn binned_scores(&self, x: &[f64], y: &[f64], bandwidths: &[f64]) -> Result<Vec<Score>> {
        check_bandwidths(bandwidths)?;
        check_points(x, y, 3)?;
        let smallest = bandwidths.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = bandwidths.iter().copied().fold(0.0, f64::max);
        if !(smallest <= largest) {
            return Ok(Vec::new());
        }
        let pyramid = Pyramid::scattered(x, y, smallest, largest, self.bins());
        Ok(scored(bandwidths, pyramid.scores(self.kernel, self.degree, bandwidths)))
    }

    /// Bins to a bandwidth, at least.
    fn bins(&self) -> f64 {
        if self.kernel == Kernel::Gaussian {
            BINS_GAUSSIAN
        } else {
            BINS
        }
    }

    fn exact(&self, data: &Sorted, bandwidths: &[f64]) -> Vec<f64> {
        leave_one_out(data, self.kernel, self.degree, bandwidths)
    }

    fn search_sorted(&self, data: &Sorted) -> BandwidthSearch {
        let gaussian = self.kernel == Kernel::Gaussian;
        let many = if gaussian { BINNED_FROM_GAUSSIAN } else { BINNED_FROM };
        let bins = match self.scoring {
            Scoring::Automatic => data.len() >= many,
            Scoring::Exact => false,
            Scoring::Binned => true,
        };
        let binned = (bins && !data.is_weighted())
            .then(|| self.binned_search(data, self.bins()))
            .filter(|search| search.binning.as_ref().is_some_and(|b| b.error <= MOST_ERROR));
        binned.unwrap_or_else(|| {
            let (curve, at_edge) = minimise(extent(&data.x), GRID, |bandwidths| self.exact(data, bandwidths));
            BandwidthSearch {
                bandwidth: curve[lowest(&curve)].bandwidth,
                curve,
                at_edge,
                binning: None,
            }
        })
    }

    /// The search on data in bins, and the exact scores around its result.
    fn binned_search(&self, data: &Sorted, bins: f64) -> BandwidthSearch {
        let (smallest, largest) = extent(&data.x);
        let pyramid = Pyramid::new(data, smallest, largest, bins);
        let binned = |bandwidths: &[f64]| pyramid.scores(self.kernel, self.degree, bandwidths);
        let (curve, at_edge) = minimise((smallest, largest), BINNED_GRID, binned);
        let best = lowest(&curve);
        let (mut first, mut end) = (best.saturating_sub(1), curve.len().min(best + 2));
        let exact_at = |range: std::ops::Range<usize>| {
            let bandwidths: Vec<f64> = curve[range].iter().map(|c| c.bandwidth).collect();
            scored(&bandwidths, self.exact(data, &bandwidths))
        };
        let mut exact = exact_at(first..end);
        // On as long as the exact scores fall.
        loop {
            let best = lowest(&exact);
            if best == 0 && first > 0 {
                first -= 1;
                exact.splice(0..0, exact_at(first..first + 1));
            } else if best + 1 == exact.len() && end < curve.len() {
                end += 1;
                exact.extend(exact_at(end - 1..end));
            } else {
                break;
            }
        }
        // Scores that cannot be compared fail the test of accuracy.
        let error = |(binned, exact): (&Score, &Score)| {
            let error = (binned.error / exact.error - 1.0).abs();
            if error.is_nan() { f64::INFINITY } else { error }
        };
        let errors = curve[first..end].iter().zip(&exact).map(error);
        BandwidthSearch {
            bandwidth: exact[lowest(&exact)].bandwidth,
            at_edge,
            binning: Some(Binning {
                narrowest: pyramid.narrowest(),
                error: errors.fold(0.0, f64::max),
                exact,
            }),
            curve,
        }
    }
}

fn check_bandwidths(bandwidths: &[f64]) -> Result<()> {
    let bad = bandwidths.iter().find(|h| !(**h > 0.0 && h.is_finite()));
    bad.map_or(Ok(()), |bandwidth| {
        Err(Error::InvalidParameter {
            name: "the bandwidth".to_owned(),
            value: *bandwidth,
            requirement: "positive and finite",
        })
    })
}

/// The points in order, checked.
fn sort(x: &[f64], y: &[f64], weights: Option<&[f64]>) -> Result<Sorted> {
    check_points(x, y, 3)?;
    let Some(weights) = weights else {
        return Ok(Sorted::new(x, y));
    };
    check_weights(weights, x.len(), 3)?;
    Ok(Sorted::weighted(x, y, weights))
}

fn scored(bandwidths: &[f64], errors: Vec<f64>) -> Vec<Score> {
    let score = |(&bandwidth, error)| Score { bandwidth, error };
    bandwidths.iter().zip(errors).map(score).collect()
}

/// All candidates of a search, and whether the best is at the edge.
fn minimise((smallest, largest): (f64, f64), grid: usize, score: impl Fn(&[f64]) -> Vec<f64>) -> (Vec<Score>, bool) {
    let ratio = (largest / smallest).ln() / (grid - 1) as f64;
    // By the logarithm of the ratio to the smallest, so that the unit of x changes nothing.
    let at = |t: f64| smallest * (ratio * t).exp();
    let score = |t: &[f64]| {
        let bandwidths: Vec<f64> = t.iter().map(|&t| at(t)).collect();
        scored(&bandwidths, score(&bandwidths))
    };
    let places: Vec<f64> = (0..grid).map(|i| i as f64).collect();
    let mut curve = score(&places);
    let best = lowest(&curve);
    let inside = 0 < best && best < grid - 1;
    let next = &curve[best.clamp(1, grid - 2)];
    // A score that does not depend on the bandwidth (an input of a few levels) has no edge.
    let at_edge = !inside && next.error - curve[best].error > FLAT * next.error;
    if inside {
        let step = 1.0 / STEPS as f64;
        let near: Vec<f64> = (1..2 * STEPS)
            .filter(|&k| k != STEPS)
            .map(|k| best as f64 - 1.0 + step * k as f64)
            .collect();
        insert(&mut curve, score(&near));
        // The neighbours of the best are now one step away from it.
        let best = lowest(&curve);
        let [below, here, above] = [best - 1, best, best + 1].map(|i| curve[i].error);
        let bend = below - 2.0 * here + above;
        let shift = 0.5 * (below - above) / bend;
        // Outside, where the best is next to the grid's neighbour, the steps differ, and it is near enough.
        if shift.abs() <= 1.0 && shift != 0.0 {
            let place = (curve[best].bandwidth / smallest).ln() / ratio;
            insert(&mut curve, score(&[place + step * shift]));
        }
    }
    (curve, at_edge)
}

fn insert(curve: &mut Vec<Score>, scores: Vec<Score>) {
    curve.extend(scores);
    curve.sort_by(|a, b| a.bandwidth.total_cmp(&b.bandwidth));
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

    #[test]
    fn binned_scores_of_points_in_any_order_are_near_the_exact_ones() {
        let (x, y) = noisy(43, 150_000, |x| (4.0 * x).sin());
        let shifted = |x: &[f64], f: &dyn Fn(f64) -> f64| -> Vec<f64> { x.iter().map(|x| f(*x)).collect() };
        let bandwidths = [0.5, 0.02, 0.1];
        for kernel in [Kernel::Epanechnikov, Kernel::Triangular, Kernel::Gaussian] {
            for degree in [Degree::Constant, Degree::Linear] {
                let method = method(kernel, degree, Scoring::Exact);
                let exact = method
                    .exact_scores(&x[..20_000], &y[..20_000], None, &bandwidths)
                    .unwrap();
                let binned = method.binned_scores(&x[..20_000], &y[..20_000], &bandwidths).unwrap();
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
        for (binned, exact) in method.binned_scores(&far, &y, &bandwidths).unwrap().iter().zip(&exact) {
            assert!((binned.error / exact.error - 1.0).abs() < 1e-3, "{binned:?} {exact:?}");
        }
        // Several parts, whatever the number of threads.
        let scores = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| method.binned_scores(&x, &y, &bandwidths).unwrap())
        };
        assert_eq!(scores(1), scores(3));
        assert!(method.binned_scores(&x, &y, &[]).unwrap().is_empty());
        let message = method.binned_scores(&x, &y, &[0.0]).unwrap_err().to_string();
        assert!(message.contains("the bandwidth is"), "{message}");
    }

    #[test]
    fn constant_abscissas_do_not_break_the_search() {
        let search = BandwidthSearch::leave_one_out(Kernel::Gaussian, &[1.0; 5], &[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        assert!(search.bandwidth > 0.0 && search.curve.iter().all(|s| s.error.is_finite()));
    }
}
