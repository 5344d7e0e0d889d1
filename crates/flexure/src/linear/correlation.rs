//! Sample cross-covariances by FFT, block by block.

use realfft::RealFftPlanner;

use crate::vectors::dot;

/// The covariances $c_j = \frac1n \sum_n (x_n - \bar x)(y_{n+j} - \bar y)$ for j = 0, ..., `lags`.
///
/// The record is cut into blocks whose spectra are multiplied and added up, so that a million samples
/// need neither a huge transform nor its memory. `x` and `y` have the same length, above `lags`.
pub(crate) fn cross_covariance(x: &[f64], y: &[f64], lags: usize) -> Vec<f64> {
    let n = x.len().min(y.len());
    if n == 0 {
        return vec![0.0; lags + 1];
    }
    let (mean_x, mean_y) = (mean(x), mean(y));
    let block = (4 * (lags + 1)).max(1024).min(n + lags).next_power_of_two();
    let step = block - lags;
    let mut planner = RealFftPlanner::<f64>::new();
    let forward = planner.plan_fft_forward(block);
    let inverse = planner.plan_fft_inverse(block);
    let (mut a, mut b) = (forward.make_input_vec(), forward.make_input_vec());
    let (mut fa, mut fb) = (forward.make_output_vec(), forward.make_output_vec());
    let mut sum = forward.make_output_vec();
    let mut scratch = forward.make_scratch_vec();
    for start in (0..n).step_by(step) {
        fill(&mut a, &x[start..n.min(start + step)], mean_x);
        fill(&mut b, &y[start..n.min(start + block)], mean_y);
        // The buffers come from the plan, so the lengths fit and the transforms cannot fail.
        let _ = forward.process_with_scratch(&mut a, &mut fa, &mut scratch);
        let _ = forward.process_with_scratch(&mut b, &mut fb, &mut scratch);
        for ((s, p), q) in sum.iter_mut().zip(&fa).zip(&fb) {
            *s += p.conj() * q;
        }
    }
    // Round-off leaves tiny imaginary parts at the ends, where a real signal has none.
    let last = sum.len() - 1;
    sum[0].im = 0.0;
    sum[last].im = 0.0;
    let mut covariance = inverse.make_output_vec();
    let _ = inverse.process(&mut sum, &mut covariance);
    covariance.truncate(lags + 1);
    let scale = 1.0 / (block as f64 * n as f64);
    covariance.iter_mut().for_each(|c| *c *= scale);
    covariance
}

/// Copies `values - mean` and pads with zeros.
fn fill(buffer: &mut [f64], values: &[f64], mean: f64) {
    let (head, tail) = buffer.split_at_mut(values.len());
    for (to, from) in head.iter_mut().zip(values) {
        *to = from - mean;
    }
    tail.fill(0.0);
}

/// The arithmetic mean; 0 without values.
pub(crate) fn mean(values: &[f64]) -> f64 {
    if values.is_empty() {
        0.0
    } else {
        values.iter().sum::<f64>() / values.len() as f64
    }
}

/// The mean of values that may have weights; NaN without values.
pub(crate) fn weighted_mean(values: &[f64], weights: Option<&[f64]>) -> f64 {
    let about = |c: f64| match weights {
        None => values.iter().map(|y| y - c).sum::<f64>() / values.len() as f64,
        Some(w) => values.iter().zip(w).map(|(y, w)| w * (y - c)).sum::<f64>() / w.iter().sum::<f64>(),
    };
    // For a large offset, the second pass removes the rounding error of the first.
    let start = values.first().copied().unwrap_or(f64::NAN);
    let first = about(start) + start;
    first + about(first)
}

/// The values minus their mean.
pub(crate) fn about_mean(values: &[f64]) -> Vec<f64> {
    let centre = mean(values);
    values.iter().map(|v| v - centre).collect()
}

/// The mean of the squares; 0 without values.
pub(crate) fn mean_square(values: &[f64]) -> f64 {
    if values.is_empty() {
        0.0
    } else {
        dot(values, values) / values.len() as f64
    }
}

/// The mean squared deviation from the mean.
pub(crate) fn variance(values: &[f64]) -> f64 {
    let centre = mean(values);
    if values.is_empty() {
        0.0
    } else {
        values.iter().map(|v| (v - centre) * (v - centre)).sum::<f64>() / values.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn agrees_with_the_sum_at_every_length() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        for (n, lags) in [(5, 4), (50, 20), (1000, 31), (5000, 300), (4096, 1), (1500, 1499)] {
            let x: Vec<f64> = (0..n).map(|_| 5.0 + rng.random_range(-1.0..1.0)).collect();
            let y: Vec<f64> = (0..n)
                .map(|i| x[(i + n - 2) % n] - 100.0 + rng.random_range(-1.0..1.0))
                .collect();
            let (mx, my) = (mean(&x), mean(&y));
            for (j, got) in cross_covariance(&x, &y, lags).iter().enumerate() {
                let want: f64 = (0..n - j).map(|i| (x[i] - mx) * (y[i + j] - my)).sum::<f64>() / n as f64;
                assert!((got - want).abs() < 1e-12, "n={n} j={j}: {got} {want}");
            }
        }
    }
}
