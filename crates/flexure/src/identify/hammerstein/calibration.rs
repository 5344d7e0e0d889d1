//! Step 5: the scale d1 and the offset alpha between the blocks (section VII, before (21)).
//!
//! The data determine phi up to scale and offset only: by (16), $m(x) = d_1 \varphi(x) + \alpha$. If phi is known at two points,
//! $$ d_{1,n} = \frac{m_n(x_1) - m_n(x_2)}{\varphi(x_1) - \varphi(x_2)}, \qquad \alpha_n = m_n(x_1) - \varphi(x_1)\, d_{1,n}, \qquad
//!    \varphi_n(x) = \frac{m_n(x) - \alpha_n}{d_{1,n}}. $$
//! Otherwise a convention about the linear part fixes them.

use super::limits::{CLEAR_GAIN, GAIN_TAIL, SMALLEST_GAIN};
use crate::error::{Error, Result};
use crate::identify::warning::Warning;
use crate::linear::TransferFunction;

/// How to fix scale and offset; the data do not determine them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Calibration {
    /// The linear part has static gain 1, so that the nonlinearity is the static characteristic of the
    /// system; no offset after the linear part.
    #[default]
    UnitStaticGain,
    /// The first coefficient of the linear part after the delay is 1 (the paper's k_0, set to 1); no offset
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

/// phi = gain (m_n - mean of m_n) + mean; the linear part is divided by the gain. So gain is 1 / d1.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Calibrated {
    pub gain: f64,
    pub mean: f64,
    pub output_offset: f64,
    pub warning: Option<Warning>,
}

/// The estimated blocks before calibration.
pub(super) struct Uncalibrated<'a> {
    /// m_n; NaN where it has no value.
    pub nonlinearity: &'a dyn Fn(f64) -> f64,
    /// The mean of m_n over the samples.
    pub mean: f64,
    /// The linear part that goes with m_n, without the delay.
    pub linear: &'a TransferFunction,
    /// A standard error of its static gain.
    pub gain_error: f64,
    pub output_mean: f64,
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

    /// The calibrated blocks: applies scale and offset to the estimated ones.
    pub(super) fn apply(&self, estimated: &Uncalibrated) -> Result<Calibrated> {
        let linear = estimated.linear;
        let static_gain = linear.static_gain();
        let impulse = linear.impulse_response(linear.settling(GAIN_TAIL));
        let total: f64 = impulse.iter().map(|k| k.abs()).sum();
        let least = (SMALLEST_GAIN * total).max(CLEAR_GAIN * estimated.gain_error);
        let has_gain = static_gain.is_finite() && static_gain.abs() > least;
        let first = linear.b()[0];
        let gain = match self {
            Calibration::TwoPoints { x, phi } => return two_points(estimated, *x, *phi),
            Calibration::UnitStaticGain if has_gain => static_gain,
            _ if first != 0.0 => first,
            _ => 1.0,
        };
        let output_mean = estimated.output_mean;
        Ok(if has_gain {
            // All of the output's mean comes through the linear part.
            Calibrated {
                gain,
                mean: output_mean * gain / static_gain,
                output_offset: 0.0,
                warning: None,
            }
        } else {
            Calibrated {
                gain,
                mean: 0.0,
                output_offset: output_mean,
                warning: Some(Warning::NoStaticGain),
            }
        })
    }
}

/// phi_n(x) = (m_n(x) - alpha_n) / d1_n with phi known at two points.
fn two_points(estimated: &Uncalibrated, x: [f64; 2], phi: [f64; 2]) -> Result<Calibrated> {
    let m = x.map(estimated.nonlinearity);
    if let Some(i) = (0..2).find(|&i| m[i].is_nan()) {
        return Err(Error::parameter(
            format!("x{} of the calibration", i + 1),
            x[i],
            "a point with data within a bandwidth",
        ));
    }
    let d1 = (m[0] - m[1]) / (phi[0] - phi[1]);
    if !(d1 != 0.0 && d1.is_finite()) {
        return Err(Error::parameter(
            "the estimate's difference at the calibration points",
            m[0] - m[1],
            "non-zero; choose points at which the nonlinearity differs",
        ));
    }
    let alpha = m[0] - phi[0] * d1;
    let mean = (estimated.mean - alpha) / d1;
    Ok(Calibrated {
        gain: 1.0 / d1,
        mean,
        output_offset: estimated.output_mean - estimated.linear.static_gain() * d1 * mean,
        warning: None,
    })
}
