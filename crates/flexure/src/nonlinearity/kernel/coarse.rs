//! The estimate at some points from data in bins: approximate, in one pass over data in any order.

use rayon::prelude::*;

use super::bin::nearest_whole;
use super::regression::{KernelRegression, check_weights};
use super::sorted::mean;
use super::{Degree, Kernel, Sorted};
use crate::error::Result;
use crate::nonlinearity::estimator::check_values;

/// Bins to a bandwidth, and to a Gaussian's standard deviation.
const BINS: f64 = 64.0;
const BINS_GAUSSIAN: f64 = 32.0;
/// How far a Gaussian reaches, in standard deviations.
const REACH_GAUSSIAN: f64 = 9.0;
/// With more bins than this share of the points there is nothing to gain.
const MOST: f64 = 0.1;
/// Data are taken in at most this many parts, each of at least so many points, whatever the number of threads.
const PARTS: usize = 4;
const PART: usize = 1 << 16;
/// Points of a part that are checked and put in their bins at a time.
const BLOCK: usize = 1 << 11;

/// Sums of weights, of weighted deviations of x from the bin's middle in units of its width, and of those of y.
type Sum = [f64; 4];

impl KernelRegression {
    /// About [`evaluate`](Self::evaluate): the data are brought together in bins of a 64th of the bandwidth (Gaussian: a 32nd), each at its
    /// data's mean. It takes one pass over unsorted data and errs in the second order of the bins' width, about 1e-4 of what the
    /// function bends within a bandwidth; at a window's edge a bin belongs to it as a whole or not at all.
    ///
    /// It is `evaluate` itself where the bins would be more than a tenth of the points. The result does not depend on the number of
    /// threads.
    ///
    /// # Errors
    /// Those of [`evaluate`](Self::evaluate).
    pub fn evaluate_binned(
        self,
        degree: Degree,
        x: &[f64],
        y: &[f64],
        weights: Option<&[f64]>,
        at: &[f64],
    ) -> Result<Vec<f64>> {
        match self.binned(x, y, weights, at) {
            Some(data) => Ok(self.fit_sorted(data)?.with_degree(degree).predict(at)),
            // What cannot be put in bins is so, or the checks tell what is wrong with it.
            None => self.evaluate(degree, x, y, weights, at),
        }
    }

    /// The bins that are in reach of the points `at`, as weighted data; nothing where they would be too many, or where something does not
    /// pass the checks.
    fn binned(self, x: &[f64], y: &[f64], weights: Option<&[f64]>, at: &[f64]) -> Option<Sorted> {
        let h = self.bandwidth;
        if self.check().is_err()
            || x.is_empty()
            || x.len() != y.len()
            || weights.is_some_and(|w| check_weights(w, x.len(), 1).is_err())
        {
            return None;
        }
        let (per_bandwidth, reach) = match self.kernel {
            Kernel::Gaussian => (BINS_GAUSSIAN, REACH_GAUSSIAN * h),
            _ => (BINS, h),
        };
        let finite = || at.iter().copied().filter(|q| q.is_finite());
        let low = finite().fold(f64::INFINITY, f64::min) - reach;
        let high = finite().fold(f64::NEG_INFINITY, f64::max) + reach;
        let per_width = per_bandwidth / h;
        let places = (high - low) * per_width;
        if !(places < MOST * x.len() as f64) {
            return None;
        }
        // Any value among the ordinates will do.
        let (count, centre) = (places as usize + 2, mean(&y[..y.len().min(BLOCK)], None));
        let summed = |x: &[f64], y: &[f64], weights: Option<&[f64]>| {
            let mut sums = vec![Sum::default(); count];
            let mut add = |x: f64, y: f64, w: f64| {
                let (k, rest) = nearest_whole((x - low) * per_width);
                // Those beyond reach have none.
                if let Some(sum) = sums.get_mut(k) {
                    let add = [w, w * rest, w * (y - centre), 0.0];
                    sum.iter_mut().zip(add).for_each(|(sum, add)| *sum += add);
                }
            };
            // Checked while they are in the cache.
            for (k, (x, y)) in x.chunks(BLOCK).zip(y.chunks(BLOCK)).enumerate() {
                check_values("x", x).and_then(|()| check_values("y", y)).ok()?;
                let points = x.iter().zip(y);
                match weights {
                    None => points.for_each(|(x, y)| add(*x, *y, 1.0)),
                    Some(weights) => (points.zip(&weights[k * BLOCK..])).for_each(|((x, y), w)| add(*x, *y, *w)),
                }
            }
            Some(sums)
        };
        let part = PART.max(x.len().div_ceil(PARTS));
        let parts: Vec<Vec<Sum>> = (x.par_chunks(part).zip(y.par_chunks(part)).enumerate())
            .map(|(k, (x, y))| summed(x, y, weights.map(|w| &w[k * part..][..x.len()])))
            .collect::<Option<_>>()?;
        let (mut abscissas, mut ordinates, mut masses) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..count {
            let [w, dx, dy, _] = parts
                .iter()
                .fold(Sum::default(), |a, part| std::array::from_fn(|j| a[j] + part[k][j]));
            if w > 0.0 {
                abscissas.push(low + (k as f64 + dx / w) / per_width);
                ordinates.push(centre + dy / w);
                masses.push(w);
            }
        }
        // Without any in reach the exact way tells so.
        (!abscissas.is_empty()).then(|| Sorted::centred(abscissas, ordinates, Some(masses)))
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn data(n: usize) -> (Vec<f64>, Vec<f64>) {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        let x: Vec<f64> = (0..n).map(|_| rng.random_range(-2.0..2.0)).collect();
        let y = x
            .iter()
            .map(|x: &f64| (2.0 * x).sin() + rng.random_range(-0.2..0.2))
            .collect();
        (x, y)
    }

    /// Beside the exact sums: noise of 0.1 leaves 0.002 in the estimate, of which the bins change a small part, and more for the
    /// uniform kernel, whose edge is a step.
    #[test]
    fn bins_change_the_estimate_little() {
        let (x, y) = data(100_000);
        let at: Vec<f64> = (0..301).map(|i| f64::from(i) / 75.0 - 2.0).collect();
        for offset in [0.0, 1e6] {
            let x: Vec<f64> = x.iter().map(|x| x + offset).collect();
            let y: Vec<f64> = y.iter().map(|y| y + offset).collect();
            let at: Vec<f64> = at.iter().map(|q| q + offset).collect();
            let weights: Vec<f64> = (0..x.len()).map(|i| (i % 3) as f64).collect();
            for kernel in Kernel::ALL {
                let bandwidth = if kernel == Kernel::Gaussian { 0.05 } else { 0.1 };
                let method = KernelRegression { kernel, bandwidth };
                for (degree, weights) in [(Degree::Constant, None), (Degree::Linear, Some(weights.as_slice()))] {
                    let exact = method.evaluate(degree, &x, &y, weights, &at).unwrap();
                    let binned = method.evaluate_binned(degree, &x, &y, weights, &at).unwrap();
                    let worst = exact
                        .iter()
                        .zip(&binned)
                        .map(|(a, b)| (a - b).abs())
                        .fold(0.0, f64::max);
                    let most = if kernel == Kernel::Uniform { 2e-3 } else { 2e-4 };
                    assert!(
                        worst < most && exact != binned,
                        "{kernel:?} {degree:?} {offset}: {worst}"
                    );
                }
            }
        }
    }

    #[test]
    fn few_points_and_points_far_away_are_done_exactly() {
        let (x, y) = data(500);
        let method = KernelRegression {
            kernel: Kernel::default(),
            bandwidth: 0.1,
        };
        let of = |at: &[f64]| {
            let exact = method.evaluate(Degree::Constant, &x, &y, None, at).unwrap();
            let binned = method.evaluate_binned(Degree::Constant, &x, &y, None, at).unwrap();
            assert!(
                exact
                    .iter()
                    .zip(&binned)
                    .all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan())
            );
        };
        of(&[0.0, 0.5, f64::NAN]);
        of(&[1e9]);
        of(&[-1e300, 1e300]);
        of(&[]);
        let wrong = KernelRegression {
            bandwidth: 0.0,
            ..method
        };
        assert!(wrong.evaluate_binned(Degree::Constant, &x, &y, None, &[0.0]).is_err());
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let (x, y) = data(400_000);
        let method = KernelRegression {
            kernel: Kernel::default(),
            bandwidth: 0.1,
        };
        let at = [-1.0, 0.0, 1.0];
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| method.evaluate_binned(Degree::Linear, &x, &y, None, &at).unwrap())
        };
        assert_eq!(on(1), on(2));
    }
}
