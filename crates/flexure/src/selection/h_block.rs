//! The bandwidth by h-block cross-validation, for samples in the order of time whose errors depend on each other:
//! point i is predicted from all samples more than `gap` samples away.
//!
//! The errors of a point and of its neighbours in time have a common part. Leave-one-out takes it for structure and undersmooths.
//! References: Chu and Marron (1991); Burman, Chow and Nolan (1994); Racine (2000).
//!
//! The window sums cost O(1) per point. The 2 gap + 1 samples around the point in time are subtracted from them: O(n gap) per bandwidth,
//! and exact. If the subtraction would lose too many digits, the other samples are summed directly.

use super::BandwidthSearch;
use super::grid::{Grid, bulk};
use crate::error::{Error, Result};
use crate::linear::correlation::cross_covariance;
use crate::nonlinearity::KernelRegression;
use crate::nonlinearity::kernel::{Degree, Kernel, Sorted, Sums, for_each_sum};
use crate::quantiles::NORMAL_95;
use crate::sort;

/// The largest gap that the data choose.
const LARGEST_GAP: usize = 200;
/// The pilot's bandwidth for the gap's choice, as a share of the data's extent.
const PILOT: f64 = 0.1;

/// Samples in the order of time, and sorted.
pub(super) struct InTime<'a> {
    data: Sorted,
    /// The abscissas of positive weight, sorted, and their times.
    at: Vec<f64>,
    time: Vec<usize>,
    x: &'a [f64],
    /// The ordinates minus the mean of the sorted ones.
    y: Vec<f64>,
    w: Vec<f64>,
    gap: usize,
}

impl<'a> InTime<'a> {
    /// Takes checked samples, at least 3 of them of positive weight.
    ///
    /// # Errors
    /// [`Error::Data`]: `TooShort` for fewer than 4 samples, [`Error::Parameter`] if `gap` leaves fewer than 3 others for some sample.
    pub fn new(x: &'a [f64], y: &[f64], weights: Option<&[f64]>, gap: usize) -> Result<Self> {
        let n = x.len();
        if n < 4 {
            return Err(Error::too_short("cross-validation over blocks", 4, n));
        }
        if gap.saturating_mul(2).saturating_add(4) > n {
            return Err(Error::parameter(
                "the gap",
                gap as f64,
                "at most half the number of samples less 2, so that every sample keeps others",
            ));
        }
        let data = Sorted::new(x, y, weights);
        let w = weights.map_or_else(|| vec![1.0; n], <[f64]>::to_vec);
        let mut time = sort::order(&[x]);
        time.retain(|&t| w[t] > 0.0);
        Ok(InTime {
            at: time.iter().map(|&t| x[t]).collect(),
            time,
            x,
            y: y.iter().map(|y| y - data.mean).collect(),
            w,
            data,
            gap,
        })
    }

    /// The whole search.
    pub fn search(&self, kernel: Kernel, degree: Degree) -> BandwidthSearch {
        Grid::new(&self.at).search(|h| self.score(kernel, degree, h))
    }

    /// The score sum_i w_i (Y_i - m_{n,-i}(X_i))^2 / sum_i w_i of one bandwidth. If no other point is in reach, the nearest of the others
    /// predict the point.
    fn score(&self, kernel: Kernel, degree: Degree, h: f64) -> f64 {
        let (mut error, mut total) = (0.0, 0.0);
        for_each_sum(&self.data, kernel, degree, h, &self.at, |j, sums| {
            let t = self.time[j];
            let rest = self.without_neighbours(sums, kernel, h, t);
            let estimate = if rest.reliable(degree) {
                rest.fit(degree).map(|fit| fit.value)
            } else {
                None
            };
            let estimate = estimate.unwrap_or_else(|| self.afresh(kernel, degree, h, j));
            error += self.w[t] * (self.y[t] - estimate).powi(2);
            total += self.w[t];
        });
        error / total
    }

    /// Whether the samples `s` and `t` are too close in time.
    fn close(&self, s: usize, t: usize) -> bool {
        s.abs_diff(t) <= self.gap
    }

    fn without_neighbours(&self, sums: Sums, kernel: Kernel, h: f64, t: usize) -> Sums {
        match kernel {
            // Every kernel has its own loop, so that the kernel is chosen outside the loop.
            Kernel::Uniform => self.subtract(sums, |v| Kernel::Uniform.weight(v), h, t),
            Kernel::Triangular => self.subtract(sums, |v| Kernel::Triangular.weight(v), h, t),
            Kernel::Epanechnikov => self.subtract(sums, |v| Kernel::Epanechnikov.weight(v), h, t),
            Kernel::Biweight => self.subtract(sums, |v| Kernel::Biweight.weight(v), h, t),
            Kernel::Triweight => self.subtract(sums, |v| Kernel::Triweight.weight(v), h, t),
            Kernel::Gaussian => self.subtract(sums, |v| Kernel::Gaussian.weight(v), h, t),
        }
    }

    #[inline(always)]
    fn subtract(&self, mut sums: Sums, weight: impl Fn(f64) -> f64, h: f64, t: usize) -> Sums {
        let near = t.saturating_sub(self.gap)..(t + self.gap + 1).min(self.x.len());
        let points = self.x[near.clone()]
            .iter()
            .zip(&self.y[near.clone()])
            .zip(&self.w[near]);
        let (q, at) = (self.x[t], sums.at);
        let mut near = [0.0; 5];
        for ((x, y), w) in points {
            let v = (x - q) / h;
            let u = at + v;
            let k = w * weight(v);
            near[0] += k;
            near[1] += k * u;
            near[2] += k * u * u;
            near[3] += k * y;
            near[4] += k * u * y;
        }
        for k in 0..3 {
            sums.s[k] -= near[k];
        }
        for k in 0..2 {
            sums.t[k] -= near[3 + k];
        }
        sums
    }

    /// The centred estimate at the sorted point `j` by direct summation.
    #[cold]
    #[inline(never)]
    fn afresh(&self, kernel: Kernel, degree: Degree, h: f64, j: usize) -> f64 {
        let (q, t, reach) = (self.at[j], self.time[j], kernel.reach() * h);
        let from = self.at.partition_point(|&x| q - x > reach);
        let to = self.at.partition_point(|&x| x - q <= reach);
        let kept: Vec<usize> = self.time[from..to]
            .iter()
            .copied()
            .filter(|&s| !self.close(s, t))
            .collect();
        if kept.is_empty() {
            return self.nearest(j);
        }
        let of = |v: &[f64]| kept.iter().map(|&s| v[s]).collect::<Vec<_>>();
        let rest = Sorted::new(&of(self.x), &of(&self.y), Some(&of(&self.w)));
        let sums = rest.direct_sums(kernel, degree, h, q, None);
        sums.fit(degree)
            .map_or_else(|| self.nearest(j), |fit| rest.mean + fit.value)
    }

    /// The mean of the centred ordinates of the points nearest to the sorted point `j` that are far in time.
    fn nearest(&self, j: usize) -> f64 {
        let (q, t) = (self.at[j], self.time[j]);
        let first_far = |mut range: Box<dyn Iterator<Item = usize>>| range.find(|&i| !self.close(self.time[i], t));
        let below = first_far(Box::new((0..j).rev())).map_or(f64::INFINITY, |i| q - self.at[i]);
        let above = first_far(Box::new(j + 1..self.at.len())).map_or(f64::INFINITY, |i| self.at[i] - q);
        let distance = below.min(above);
        // If only zero weights are far in time, only the centred mean is known.
        if distance == f64::INFINITY {
            return 0.0;
        }
        let from = self.at.partition_point(|&x| q - x > distance);
        let to = self.at.partition_point(|&x| x - q <= distance);
        let (mut sum, mut total) = (0.0, 0.0);
        for &s in self.time[from..to].iter().filter(|&&s| !self.close(s, t)) {
            if (self.x[s] - q).abs() == distance {
                sum += self.w[s] * self.y[s];
                total += self.w[s];
            }
        }
        sum / total
    }
}

/// The gap from the data. It is one less than the first lag at which the autocorrelation of the ordinates about an oversmoothed local line
/// is within its 95 % limits for independent errors, $\pm 1.96/\sqrt n$. It is at most a tenth of the samples, and at most 200.
///
/// `x` and `y` are finite, in the order of time, and of one length.
pub(crate) fn gap_from_data(x: &[f64], y: &[f64]) -> usize {
    let n = x.len();
    let most = (n / 10).min(LARGEST_GAP);
    if most == 0 {
        return 0;
    }
    let pilot = KernelRegression {
        kernel: Kernel::Epanechnikov,
        bandwidth: PILOT * bulk(&sort::sorted(x)),
    };
    let Ok(trend) = pilot.fit(x, y) else {
        return 0;
    };
    let trend = trend.with_degree(Degree::Linear).predict(x);
    let residuals: Vec<f64> = y.iter().zip(&trend).map(|(y, m)| y - m).collect();
    let covariance = cross_covariance(&residuals, &residuals, most + 1);
    let limit = NORMAL_95 / (n as f64).sqrt() * covariance[0];
    (1..=most + 1)
        .find(|&lag| covariance[lag].abs() <= limit)
        .map_or(most, |lag| lag - 1)
}

#[cfg(test)]
#[path = "h_block_tests.rs"]
mod tests;
