//! Samples that stand alone, far from their neighbours (Hampel 1974).

use crate::quantiles::NORMAL_MAD;
use crate::record::bridged;
use crate::{parallel, sort};

/// The number of samples in a block over which the usual distance is taken. Convention.
const BLOCK: usize = 100;

/// A sample is an outlier from this many usual distances on. A million normal samples contain none. Convention.
const OUTLIER: f64 = 8.0;
/// If more than this share of the samples stand alone, that is the nature of the noise. Convention: ten times as many other samples keep
/// least squares right.
const MOST_OUTLIERS: f64 = 0.1;

/// The samples of a signal that stand alone. Missing samples do not count.
///
/// ```
/// let mut errors: Vec<f64> = (0..500).map(|k| f64::from(k * 37 % 101)).collect();
/// errors[250] = 1e5;
/// assert_eq!(flexure::outliers::standing_alone(&errors), [250]);
/// ```
pub fn standing_alone(signal: &[f64]) -> Vec<usize> {
    let known = bridged(signal);
    // Smooth errors equal their running median.
    let spread = spread(&known).max(f64::MIN_POSITIVE);
    let found = far(&distances(&known), OUTLIER, spread).into_iter();
    let found: Vec<usize> = found.filter(|t| signal[*t].is_finite()).collect();
    match found.len() as f64 > MOST_OUTLIERS * signal.len() as f64 {
        true => Vec::new(),
        false => found,
    }
}

/// The distance of every sample from the running median of five. That median keeps steps as they are.
pub(crate) fn distances(samples: &[f64]) -> Vec<f64> {
    let n = samples.len();
    let distance = |t: usize| {
        let half = t.min(n - 1 - t).min(2);
        let mut near = [0.0; 5];
        let near = &mut near[..=2 * half];
        near.copy_from_slice(&samples[t - half..=t + half]);
        near.sort_unstable_by(f64::total_cmp);
        (samples[t] - near[half]).abs()
    };
    parallel::numbers(n, distance)
}

/// The standard deviation of normal samples with this median distance from their median.
pub(crate) fn spread(samples: &[f64]) -> f64 {
    if samples.is_empty() {
        return 0.0;
    }
    let middle = sort::median(samples.to_vec());
    sort::median(samples.iter().map(|v| (v - middle).abs()).collect()) / NORMAL_MAD
}

/// As [`far`], after sorting by `places`: neighbours are samples at nearly the same place. Distances that are not finite are skipped.
/// The indices are in increasing order.
pub fn far_along(places: &[f64], distances: &[f64], times: f64, least: f64) -> Vec<usize> {
    let mut order = sort::order(&[places]);
    order.retain(|&k| distances[k].is_finite());
    let sizes = parallel::numbers(order.len(), |k| distances[order[k]]);
    let mut found: Vec<usize> = far(&sizes, times, least).into_iter().map(|at| order[at]).collect();
    found.sort_unstable();
    found
}

/// The distances of more than `times` the usual standard deviation nearby. That deviation is taken as at least `least`.
pub fn far(distances: &[f64], times: f64, least: f64) -> Vec<usize> {
    let usual: Vec<f64> = distances
        .chunks(BLOCK)
        .map(|block| sort::median(block.to_vec()) / NORMAL_MAD)
        .collect();
    let is_far = |t: &usize| {
        let block = t / BLOCK;
        let nearby = &usual[block.saturating_sub(1)..(block + 2).min(usual.len())];
        let usual = nearby.iter().fold(least, |largest, u| largest.max(*u));
        distances[*t] > times * usual
    };
    (0..distances.len()).filter(is_far).collect()
}
