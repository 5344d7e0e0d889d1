//! Making long data small without hiding anything: min/max decimation and rounding.

use crate::limits::DIGITS;

/// A signal on an evenly spaced grid, decimated where it was longer than allowed.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Decimated {
    /// Distance between values, in samples of the original: 1, or half a bucket.
    pub stride: f64,
    /// The values; NaN where a bucket holds no finite sample.
    pub values: Vec<f64>,
}

/// The samples per bucket for which two points per bucket make at most `limit` points of `n` samples; 1 keeps every sample.
pub(crate) fn bucket(n: usize, limit: usize) -> usize {
    if n <= limit { 1 } else { n.div_ceil((limit / 2).max(1)) }
}

/// Minimum and maximum of each bucket of `bucket` samples, in their order of occurrence; the samples themselves if
/// `bucket` is 1. Samples that are not finite are passed over.
pub(crate) fn min_max(samples: &[f64], bucket: usize) -> Decimated {
    if bucket <= 1 {
        return Decimated {
            stride: 1.0,
            values: samples.iter().map(|&v| round(v)).collect(),
        };
    }
    let mut values = Vec::with_capacity(2 * samples.len().div_ceil(bucket));
    for chunk in samples.chunks(bucket) {
        let (mut low, mut high) = (None::<(usize, f64)>, None::<(usize, f64)>);
        for (i, &v) in chunk.iter().enumerate().filter(|(_, v)| v.is_finite()) {
            if low.is_none_or(|(_, least)| v < least) {
                low = Some((i, v));
            }
            if high.is_none_or(|(_, most)| v > most) {
                high = Some((i, v));
            }
        }
        let (low, high) = (low.unwrap_or((0, f64::NAN)), high.unwrap_or((0, f64::NAN)));
        let (first, second) = if low.0 <= high.0 {
            (low.1, high.1)
        } else {
            (high.1, low.1)
        };
        values.extend([round(first), round(second)]);
    }
    Decimated {
        stride: bucket as f64 / 2.0,
        values,
    }
}

/// Every k-th value with the smallest k that leaves at most `limit`, rounded.
pub(crate) fn thin(values: &[f64], limit: usize) -> Vec<f64> {
    let k = values.len().div_ceil(limit.max(1)).max(1);
    values.iter().step_by(k).map(|&v| round(v)).collect()
}

/// The first `limit` values, rounded.
pub(crate) fn head(values: &[f64], limit: usize) -> Vec<f64> {
    values.iter().take(limit).map(|&v| round(v)).collect()
}

/// `v` to [`DIGITS`] significant digits, so that it prints in few characters. A value that is not finite stays unchanged.
pub(crate) fn round(v: f64) -> f64 {
    // The value passes through its decimal form: only this yields the double with that short decimal form.
    format!("{v:.*e}", DIGITS - 1).parse().unwrap_or(v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_signals_are_kept_sample_by_sample() {
        let samples: Vec<f64> = (0..100).map(f64::from).collect();
        let kept = min_max(&samples, bucket(100, 100));
        assert_eq!(
            kept,
            Decimated {
                stride: 1.0,
                values: samples
            }
        );
    }

    #[test]
    fn every_extreme_survives_in_its_bucket_and_order() {
        let mut samples = vec![0.0; 100_000];
        samples[31_415] = 7.0;
        samples[31_416] = -5.0;
        samples[99_999] = 9.0;
        let size = bucket(samples.len(), 1_000);
        let kept = min_max(&samples, size);
        assert!(kept.values.len() <= 1_000);
        let at = |v: f64| kept.values.iter().position(|&k| k == v).expect("the spike is kept");
        assert_eq!(at(7.0) + 1, at(-5.0), "the spike up came first");
        for (spike, sample) in [(7.0, 31_415.0), (-5.0, 31_416.0), (9.0, 99_999.0)] {
            let time = at(spike) as f64 * kept.stride;
            assert!(
                (time - sample).abs() < size as f64,
                "{spike} at {time}, was at {sample}"
            );
        }
    }

    #[test]
    fn decimation_agrees_with_brute_force_over_random_lengths() {
        for n in [1usize, 2, 3, 10, 997, 1_000, 1_001, 5_003] {
            let samples: Vec<f64> = (0..n).map(|i| ((i * 7919) % 1013) as f64).collect();
            for limit in [2, 10, 100, 1_000] {
                let size = bucket(n, limit);
                let kept = min_max(&samples, size);
                assert!(
                    kept.values.len() <= limit,
                    "{n} samples, limit {limit}: {} points",
                    kept.values.len()
                );
                if size == 1 {
                    continue;
                }
                for (pair, chunk) in kept.values.chunks(2).zip(samples.chunks(size)) {
                    let low = chunk.iter().copied().fold(f64::INFINITY, f64::min);
                    let high = chunk.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                    assert_eq!((pair[0].min(pair[1]), pair[0].max(pair[1])), (low, high));
                }
            }
        }
    }

    #[test]
    fn missing_samples_do_not_hide_the_others() {
        let samples = [
            f64::NAN,
            1.0,
            f64::INFINITY,
            -2.0,
            f64::NAN,
            f64::NAN,
            f64::NAN,
            f64::NEG_INFINITY,
        ];
        let kept = min_max(&samples, 4);
        assert_eq!(kept.values[..2], [1.0, -2.0]);
        assert!(kept.values[2].is_nan() && kept.values[3].is_nan());
    }

    #[test]
    fn rounding_is_short_and_close() {
        assert_eq!(round(0.1 + 0.2).to_string(), "0.3");
        assert_eq!(round(2.0 / 3.0), 0.6666667);
        assert_eq!(round(-1.234_567_89e-12), -1.234568e-12);
        assert_eq!(round(f64::MAX), 1.797693e308);
        assert_eq!(round(0.0), 0.0);
        assert!(round(f64::NAN).is_nan());
        assert_eq!(round(f64::INFINITY), f64::INFINITY);
        for k in 1..1_000 {
            let v = 1.0 / f64::from(k);
            assert!((round(v) - v).abs() <= 0.5e-6 * v * 1.000_001, "{v}");
            assert!(round(v).to_string().len() <= 13);
        }
    }
}
