//! Measures of how near a prediction is to the measurement.

use crate::error::{Error, Result};
use crate::linear::correlation::mean;
use crate::record::check_values;

/// Fit, RMS error and R^2 of a prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitMeasures {
    /// 100 (1 - |y - yh| / |y - mean y|), in percent: 100 is perfect, 0 no better than the mean,
    /// negative worse (MATLAB `compare`, NRMSE).
    pub fit_percent: f64,
    /// Root mean square of y - yh, in the unit of y.
    pub rms: f64,
    /// 1 - |y - yh|^2 / |y - mean y|^2.
    pub r_squared: f64,
    /// The number of samples compared.
    pub samples: usize,
}

impl FitMeasures {
    /// Compares a measured and a predicted signal.
    ///
    /// # Errors
    /// [`Error::Data`]: `LengthMismatch`, `TooShort` (nothing to compare), `NonFinite`, `Unit`, and
    /// `Constant` for a constant measurement, for which no fit is defined.
    pub fn new(measured: &[f64], predicted: &[f64]) -> Result<Self> {
        if measured.len() != predicted.len() {
            return Err(Error::length("the prediction", predicted.len(), measured.len()));
        }
        if measured.is_empty() {
            return Err(Error::too_short("a comparison", 1, 0));
        }
        check_values("the measurement", measured)?;
        check_values("the prediction", predicted)?;
        let centre = mean(measured);
        let spread: f64 = measured.iter().map(|y| (y - centre).powi(2)).sum();
        if !(spread > 0.0) {
            return Err(Error::constant("the measurement", centre));
        }
        let error: f64 = measured.iter().zip(predicted).map(|(y, p)| (y - p).powi(2)).sum();
        Ok(FitMeasures {
            fit_percent: 100.0 * (1.0 - (error / spread).sqrt()),
            rms: (error / measured.len() as f64).sqrt(),
            r_squared: 1.0 - error / spread,
            samples: measured.len(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::DataError;

    #[test]
    fn the_mean_scores_zero_and_the_truth_a_hundred() {
        let y = [1.0, 2.0, 3.0, 6.0];
        let perfect = FitMeasures::new(&y, &y).unwrap();
        assert_eq!((perfect.fit_percent, perfect.rms, perfect.r_squared), (100.0, 0.0, 1.0));
        let flat = FitMeasures::new(&y, &[3.0; 4]).unwrap();
        assert!(flat.fit_percent.abs() < 1e-12 && flat.r_squared.abs() < 1e-15);
        assert!((flat.rms - 3.5_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        assert!(matches!(
            FitMeasures::new(&[1.0], &[]),
            Err(Error::Data(DataError::LengthMismatch { .. }))
        ));
        assert!(matches!(
            FitMeasures::new(&[], &[]),
            Err(Error::Data(DataError::TooShort { .. }))
        ));
        assert!(matches!(
            FitMeasures::new(&[2.0, 2.0], &[1.0, 1.0]),
            Err(Error::Data(DataError::Constant { .. }))
        ));
        assert!(matches!(
            FitMeasures::new(&[2.0, 1.0], &[1.0, f64::NAN]),
            Err(Error::Data(DataError::NonFinite { sample: 1, .. }))
        ));
    }
}
