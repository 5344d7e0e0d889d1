//! The mean of a signal, and the straight line through it by least squares.

use crate::error::{Error, Result};

/// The mean of the samples that are not missing; `None` if all are missing.
pub fn mean(x: &[f64]) -> Option<f64> {
    let present = || x.iter().filter(|x| x.is_finite());
    let count = present().count() as f64;
    (count > 0.0).then(|| {
        // The mean is taken twice. The second sum is small, so a large offset costs no digits.
        let first = present().sum::<f64>() / count;
        first + present().map(|x| x - first).sum::<f64>() / count
    })
}

/// The straight line `level + slope (t - centre)` through a signal, by least squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trend {
    /// The mean instant of the samples that are not missing.
    pub centre: f64,
    /// The line's value at the centre, which is the signal's mean.
    pub level: f64,
    /// Its slope, in units of x over units of t.
    pub slope: f64,
}

impl Trend {
    /// The line through the samples `x` at the instants `t`. Missing samples are left out.
    ///
    /// # Errors
    /// [`Error::Data`]: `LengthMismatch`, and `TooShort` for fewer than two samples at different instants.
    pub fn of(t: &[f64], x: &[f64]) -> Result<Self> {
        if t.len() != x.len() {
            return Err(Error::length("x", x.len(), t.len()));
        }
        let (t, x): (Vec<f64>, Vec<f64>) = t.iter().zip(x).filter(|(t, x)| t.is_finite() && x.is_finite()).unzip();
        let short = || Error::too_short("a trend", 2, t.len());
        let (centre, level) = (mean(&t).ok_or_else(short)?, mean(&x).ok_or_else(short)?);
        let (mut spread, mut product) = (0.0, 0.0);
        for (t, x) in t.iter().zip(&x) {
            spread += (t - centre) * (t - centre);
            product += (t - centre) * (x - level);
        }
        if !(spread > 0.0) {
            return Err(short());
        }
        Ok(Trend {
            centre,
            level,
            slope: product / spread,
        })
    }

    /// The line's value at an instant.
    pub fn value(&self, t: f64) -> f64 {
        self.level + self.slope * (t - self.centre)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_whatever_is_missing() {
        let t: Vec<f64> = (0..100).map(|i| 1e6 + 0.01 * f64::from(i)).collect();
        let mut x: Vec<f64> = t.iter().map(|t| 1e4 + 3.0 * (t - 1e6)).collect();
        for i in [0, 17, 18, 99] {
            x[i] = f64::NAN;
        }
        let trend = Trend::of(&t, &x).unwrap();
        assert!((trend.slope - 3.0).abs() < 1e-6, "{trend:?}");
        assert!((trend.value(1e6 + 0.5) - 1e4 - 1.5).abs() < 1e-7);
    }

    #[test]
    fn the_mean_leaves_out_what_is_missing() {
        assert_eq!(mean(&[1.0, f64::NAN, 3.0, f64::INFINITY]), Some(2.0));
        assert_eq!(mean(&[f64::NAN]), None);
        let far: Vec<f64> = (0..1001).map(|i| 1e12 + f64::from(i)).collect();
        assert_eq!(mean(&far), Some(1e12 + 500.0));
    }

    #[test]
    fn a_trend_needs_two_samples() {
        for (t, x) in [
            (vec![], vec![]),
            (vec![1.0], vec![2.0]),
            (vec![0.0, 1.0], vec![f64::NAN, 2.0]),
        ] {
            assert!(Trend::of(&t, &x).is_err());
        }
        assert!(Trend::of(&[0.0], &[0.0, 1.0]).is_err());
    }
}
