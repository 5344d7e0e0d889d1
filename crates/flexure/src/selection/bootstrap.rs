//! The bandwidth with the smallest mean squared error that a bootstrap predicts.
//!
//! The bootstrap takes an oversmoothed estimate m_g as the truth: Y* = m_g(X) + e*, with errors e* made from residuals. The smoother S_h is
//! linear, so that
//! $$ \mathrm{MISE}^*(h) = \frac1n \sum_i \bigl((S_h m_g - m_g)(X_i)^2 + \mathrm{Var}^*\, (S_h e^*)(X_i)\bigr) : $$
//! the squared bias needs no resampling at all. The wild bootstrap has independent errors of variance r_j^2. Its variance is
//! $\sum_j S_h(i, j)^2 r_j^2$, a kernel sum with K^2: exact, without random numbers. With moving blocks the variance is the mean
//! over resampled errors. References: Haerdle and Marron (1991); Haerdle and Bowman (1988), the pilot; Liu (1988), the wild bootstrap;
//! Kuensch (1989), moving blocks.

use rand::RngExt;
use rand_pcg::Pcg64;

use super::BandwidthSearch;
use super::grid::Grid;
use super::h_block::{InTime, gap_from_data};
use super::plug_in::canonical;
use crate::error::{Error, Result};
use crate::nonlinearity::kernel::{Degree, Kernel, Sorted, for_each_sum};
use crate::sort;

/// The pilot oversmooths by n to this power: from n^(-1/5), the best for m, to n^(-1/9), the best for its second derivative. That
/// derivative determines the bias.
const OVERSMOOTHING: f64 = 1.0 / 5.0 - 1.0 / 9.0;
/// If the fit leaves a residual at most this share of its variance, the residual says nothing about the noise.
const OWN: f64 = 1e-3;

/// The samples in the order of the abscissas, the pilot curve and the residuals.
struct Pilot {
    /// The sorted samples, with the centred pilot curve as ordinates.
    curve: Sorted,
    /// The samples' indices in that order.
    order: Vec<usize>,
    /// The residuals in that order, scaled to the noise's variance.
    residuals: Vec<f64>,
    /// The bandwidths of the residuals and of the pilot curve.
    bandwidths: [f64; 2],
    kernel: Kernel,
    degree: Degree,
}

impl Pilot {
    /// The residuals come from the bandwidth `h`, the curve from a larger one.
    fn new(kernel: Kernel, degree: Degree, [x, y]: [&[f64]; 2], weights: Option<&[f64]>, h: f64) -> Self {
        // The samples' indices serve as ordinates, so that each sample can be identified after the sort, even with ties.
        let index: Vec<f64> = (0..x.len()).map(|t| t as f64).collect();
        let places = Sorted::new(x, &index, weights);
        let order: Vec<usize> = places.y.iter().map(|t| (t + places.mean).round() as usize).collect();
        let total: f64 = (0..order.len()).map(|i| places.weight(i)).sum();
        let weighted = order.iter().enumerate().map(|(i, &t)| places.weight(i) * y[t]);
        let mean = weighted.sum::<f64>() / total;
        let mut data = places;
        data.y = order.iter().map(|&t| y[t] - mean).collect();
        data.mean = 0.0;
        let g = Grid::new(&data.x).clamp(h * (order.len() as f64).powf(OVERSMOOTHING));
        let mut smooth = vec![0.0; order.len()];
        for_each_sum(&data, kernel, degree, g, &data.x, |i, sums| {
            smooth[i] = sums.fit(degree).map_or(0.0, |fit| fit.value);
        });
        let mut residuals = vec![f64::NAN; order.len()];
        for_each_sum(&data, kernel, degree, h, &data.x, |i, sums| {
            if let Some(fit) = sums.fit(degree) {
                let rest = 1.0 - data.weight(i) * fit.leverage;
                if rest > OWN {
                    residuals[i] = (data.y[i] - fit.value) / rest.sqrt();
                }
            }
        });
        fill_unknown(&mut residuals);
        data.y = smooth;
        Pilot {
            curve: data,
            order,
            residuals,
            bandwidths: [h, g],
            kernel,
            degree,
        }
    }

    /// The weighted mean of the squared bias plus the variance at every point. `variance` gets the smoother's weights of every point: a + b
    /// v at the distance v in bandwidths.
    fn mean_square(&self, h: f64, variance: impl FnOnce(&[[f64; 2]]) -> Vec<f64>) -> f64 {
        let data = &self.curve;
        let mut bias = vec![0.0; data.len()];
        let mut shares = vec![[0.0; 2]; data.len()];
        for_each_sum(data, self.kernel, self.degree, h, &data.x, |i, sums| {
            bias[i] = sums.fit(self.degree).map_or(0.0, |fit| fit.value - data.y[i]);
            let a = sums.share(self.degree, 0.0);
            shares[i] = [a, sums.share(self.degree, 1.0) - a];
        });
        let (mut sum, mut total) = (0.0, 0.0);
        for (i, (bias, variance)) in bias.iter().zip(variance(&shares)).enumerate() {
            let w = data.weight(i);
            sum += w * (bias * bias + variance);
            total += w;
        }
        sum / total
    }

    fn description(&self, errors: &str) -> String {
        let [h, g] = self.bandwidths;
        format!(
            "smallest mean squared error when the truth is the estimate with the bandwidth {g:.4} and the errors are \
             {errors} from the estimate with {h:.4}"
        )
    }
}

/// Puts the root mean square of the other residuals where a point says nothing about the noise.
fn fill_unknown(residuals: &mut [f64]) {
    let known = || residuals.iter().filter(|r| r.is_finite());
    let typical = (known().map(|r| r * r).sum::<f64>() / known().count().max(1) as f64).sqrt();
    residuals
        .iter_mut()
        .filter(|r| !r.is_finite())
        .for_each(|r| *r = typical);
}

/// The square of a kernel.
struct Squared {
    kernel: Kernel,
    /// The square's bandwidth for a bandwidth of one.
    ratio: f64,
}

impl Squared {
    /// K^2, if it is one of the kernels.
    fn of(kernel: Kernel) -> Option<Squared> {
        let squared = |kernel, ratio| Some(Squared { kernel, ratio });
        match kernel {
            Kernel::Uniform => squared(Kernel::Uniform, 1.0),
            Kernel::Epanechnikov => squared(Kernel::Biweight, 1.0),
            Kernel::Gaussian => squared(Kernel::Gaussian, std::f64::consts::FRAC_1_SQRT_2),
            Kernel::Triangular | Kernel::Biweight | Kernel::Triweight => None,
        }
    }
}

/// A choice by a bootstrap, with its details.
#[derive(Debug, PartialEq)]
pub(super) struct Bootstrapped {
    pub search: BandwidthSearch,
    pub details: String,
}

/// The choice by the wild bootstrap, in closed form. If the kernel's square is not one of the kernels, the choice is made with
/// Epanechnikov's kernel and converted to the bandwidth that smooths equally (Marron and Nolan 1988).
///
/// The data must be checked, with at least 3 points of positive weight.
pub(super) fn wild(
    kernel: Kernel,
    degree: Degree,
    x: &[f64],
    y: &[f64],
    weights: Option<&[f64]>,
) -> Result<Bootstrapped> {
    let Some(Squared { kernel: square, ratio }) = Squared::of(kernel) else {
        let like = Kernel::Epanechnikov;
        let Bootstrapped { mut search, details } = wild(like, degree, x, y, weights)?;
        let factor = canonical(kernel) / canonical(like);
        search.bandwidth *= factor;
        search.curve.iter_mut().for_each(|score| score.bandwidth *= factor);
        let how = format!("; with Epanechnikov's kernel, and {factor:.4} times its bandwidth");
        let details = details + &how;
        return Ok(Bootstrapped { search, details });
    };
    let h = BandwidthSearch::search(kernel, degree, x, y, weights)?.bandwidth;
    let pilot = Pilot::new(kernel, degree, [x, y], weights, h);
    let variances: Vec<f64> = (pilot.residuals.iter().enumerate())
        .map(|(i, r)| (pilot.curve.weight(i) * r).powi(2))
        .collect();
    let noise = Sorted::new(&pilot.curve.x, &variances, Some(&variances));
    let search = Grid::new(&pilot.curve.x).search(|h| {
        pilot.mean_square(h, |shares| {
            let mut variance = vec![0.0; shares.len()];
            // Without residuals there is no noise.
            if noise.len() > 0 {
                for_each_sum(&noise, square, degree, ratio * h, &pilot.curve.x, |i, sums| {
                    let [a, b] = shares[i];
                    let [s0, s1, s2] = sums.s;
                    // Sums of (K r)^2 v^k, v in bandwidths of K from the point.
                    let first = ratio * (s1 - sums.at * s0);
                    let second = ratio * ratio * (s2 - sums.at * (2.0 * s1 - sums.at * s0));
                    variance[i] = a * a * s0
                        + if b == 0.0 {
                            0.0
                        } else {
                            b * (2.0 * a * first + b * second)
                        };
                });
            }
            variance
        })
    });
    let details = pilot.description("independent, each of the variance of the point's own residual");
    Ok(Bootstrapped { search, details })
}

/// The settings of the moving block bootstrap.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockResampling {
    pub block: Option<usize>,
    pub replicates: Option<usize>,
    pub seed: u64,
}

/// The numbers of replicates if none is given. With more samples, fewer are needed.
const REPLICATES: std::ops::RangeInclusive<usize> = 5..=40;
const RESAMPLED: usize = 1_000_000;

/// A choice by the moving block bootstrap, with the settings that were used.
#[derive(Debug, PartialEq)]
pub(super) struct InBlocks {
    pub block: usize,
    pub replicates: usize,
    pub chosen: Bootstrapped,
}

/// The choice by the moving block bootstrap. The data are checked, and at least 3 of positive
/// weight.
pub(super) fn moving_block(
    settings: BlockResampling,
    kernel: Kernel,
    degree: Degree,
    [x, y]: [&[f64]; 2],
    weights: Option<&[f64]>,
) -> Result<InBlocks> {
    let n = x.len();
    let gap = gap_from_data(x, y).min((n / 2).saturating_sub(2));
    let block = settings
        .block
        .unwrap_or_else(|| ((n as f64).cbrt().ceil() as usize).max(2 * gap).min(n));
    let replicates = settings
        .replicates
        .unwrap_or((RESAMPLED / n).clamp(*REPLICATES.start(), *REPLICATES.end()));
    if !(1..=n).contains(&block) {
        return Err(Error::parameter(
            "the number of residuals in a block",
            block as f64,
            "at least 1 and at most the number of samples",
        ));
    }
    if replicates == 0 {
        return Err(Error::parameter("the number of replicates", 0.0, "at least 1"));
    }
    let h = InTime::new(x, y, weights, gap)?.search(kernel, degree).bandwidth;
    let pilot = Pilot::new(kernel, degree, [x, y], weights, h);
    // The residuals in the order of time, with mean zero. Samples of weight zero have no residual and are left out.
    let mut places: Vec<usize> = (0..pilot.order.len()).collect();
    sort::by_key(&mut places, |&i| pilot.order[i] as f64);
    let mean = pilot.residuals.iter().sum::<f64>() / places.len() as f64;
    let residuals: Vec<f64> = places.iter().map(|&i| pilot.residuals[i] - mean).collect();
    let length = block.min(residuals.len());
    let search = Grid::new(&pilot.curve.x).search(|h| {
        pilot.mean_square(h, |shares| {
            let mut variance = vec![0.0; shares.len()];
            let mut data = pilot.curve.clone();
            for replicate in 0..replicates {
                let errors = resampled(&residuals, length, settings.seed, replicate);
                for (place, error) in places.iter().zip(errors) {
                    data.y[*place] = error;
                }
                for_each_sum(&data, kernel, degree, h, &pilot.curve.x, |i, sums| {
                    let value = sums.fit(degree).map_or(0.0, |fit| fit.value);
                    variance[i] += value * value / replicates as f64;
                });
            }
            variance
        })
    });
    let errors = format!("blocks of {block} residuals, {replicates} times resampled,");
    let details = pilot.description(&errors);
    Ok(InBlocks {
        block,
        replicates,
        chosen: Bootstrapped { search, details },
    })
}

/// Residuals in blocks of `length` from random places.
fn resampled(residuals: &[f64], length: usize, seed: u64, replicate: usize) -> impl Iterator<Item = f64> {
    let mut rng = Pcg64::new(seed.into(), replicate as u128);
    let n = residuals.len();
    (0..n.div_ceil(length))
        .flat_map(move |_| {
            let start = rng.random_range(0..=n - length);
            residuals[start..start + length].iter().copied()
        })
        .take(n)
}

#[cfg(test)]
#[path = "bootstrap_tests.rs"]
mod tests;
