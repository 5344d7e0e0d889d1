//! Fixing the scale and the offset between the blocks, which the data cannot tell (paper, section VII).

use super::Regression;
use crate::error::{Error, Result};
use crate::identify::outcome::Warning;
use crate::linear::TransferFunction;

/// A static gain below this share of the impulse response's absolute sum counts as none.
const SMALLEST_GAIN: f64 = 0.02;

/// How scale and offset, which the data cannot tell, are fixed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Calibration {
    /// The linear part has static gain 1, so that the nonlinearity is the static characteristic of the
    /// system; no offset after the linear part.
    #[default]
    UnitStaticGain,
    /// The first coefficient of the linear part after the delay is 1 (the paper's k_0 = 1); no offset
    /// after the linear part.
    UnitFirstCoefficient,
    /// The nonlinearity is known at two points (paper, section VII): phi(x1) and phi(x2).
    TwoPoints {
        /// The abscissas x1, x2.
        x: [f64; 2],
        /// phi(x1), phi(x2).
        phi: [f64; 2],
    },
}

/// A static gain of no more than this many standard errors counts as none, too.
const CLEAR: f64 = 3.0;

/// phi = gain (m_n - mean m_n) + mean; the linear part is divided by the gain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Calibrated {
    pub gain: f64,
    pub mean: f64,
    pub output_offset: f64,
}

impl Calibration {
    pub(super) fn check(&self) -> Result<()> {
        let Calibration::TwoPoints { x, phi } = self else {
            return Ok(());
        };
        for (name, pair) in [("x2 of the calibration", x), ("phi(x2) of the calibration", phi)] {
            if !(pair[0] != pair[1] && pair.iter().all(|v| v.is_finite())) {
                return Err(Error::parameter(
                    name,
                    pair[1],
                    "finite and different from the first point's",
                ));
            }
        }
        Ok(())
    }

    /// Scale and offset for the linear part (without delay) that goes with m_n as it was estimated;
    /// `gain_error` is a standard error of its static gain.
    pub(super) fn apply(
        &self,
        regression: &Regression,
        linear: &TransferFunction,
        gain_error: f64,
        output_mean: f64,
        warnings: &mut Vec<Warning>,
    ) -> Result<Calibrated> {
        let estimate = |x: f64| {
            let m = regression.fit.predict(&[&[x]]);
            m.ok().and_then(|m| m.first().copied()).unwrap_or(f64::NAN)
        };
        self.apply_to(estimate, regression.mean, linear, gain_error, output_mean, warnings)
    }

    /// The same for any estimate of the nonlinearity, NaN where it has none, and its mean over the samples.
    pub(super) fn apply_to(
        &self,
        estimate: impl Fn(f64) -> f64,
        mean: f64,
        linear: &TransferFunction,
        gain_error: f64,
        output_mean: f64,
        warnings: &mut Vec<Warning>,
    ) -> Result<Calibrated> {
        let static_gain = linear.static_gain();
        let impulse = linear.impulse_response(linear.settling(1e-3));
        let total: f64 = impulse.iter().map(|k| k.abs()).sum();
        let has_gain = static_gain.is_finite() && static_gain.abs() > (SMALLEST_GAIN * total).max(CLEAR * gain_error);
        let first = linear.b()[0];
        let gain = match self {
            Calibration::TwoPoints { x, phi } => {
                return two_points(x.map(estimate), mean, static_gain, output_mean, x, phi);
            }
            Calibration::UnitStaticGain if has_gain => static_gain,
            _ if first != 0.0 => first,
            _ => 1.0,
        };
        if has_gain {
            // All of the output's mean comes through the linear part.
            return Ok(Calibrated {
                gain,
                mean: output_mean * gain / static_gain,
                output_offset: 0.0,
            });
        }
        warnings.push(Warning::NoStaticGain);
        Ok(Calibrated {
            gain,
            mean: 0.0,
            output_offset: output_mean,
        })
    }
}

/// phi_n(x) = (m_n(x) - alpha_n) / d1_n with phi known at two points.
fn two_points(
    m: [f64; 2],
    mean_of_m: f64,
    static_gain: f64,
    output_mean: f64,
    x: &[f64; 2],
    phi: &[f64; 2],
) -> Result<Calibrated> {
    if let Some(i) = (0..2).find(|&i| m[i].is_nan()) {
        return Err(Error::parameter(
            format!("x{} of the calibration", i + 1),
            x[i],
            "a point with data within a bandwidth",
        ));
    }
    let d = (m[0] - m[1]) / (phi[0] - phi[1]);
    if !(d != 0.0 && d.is_finite()) {
        return Err(Error::parameter(
            "the estimate's difference at the calibration points",
            m[0] - m[1],
            "non-zero; choose points at which the nonlinearity differs",
        ));
    }
    let alpha = m[0] - phi[0] * d;
    let mean = (mean_of_m - alpha) / d;
    Ok(Calibrated {
        gain: 1.0 / d,
        mean,
        output_offset: output_mean - static_gain * d * mean,
    })
}
