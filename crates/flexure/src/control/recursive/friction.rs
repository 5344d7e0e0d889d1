//! Inertia and friction of a joint that learn: \\(\tau = J v' + f_c \tanh(v / v_0) + f_v v + \tau_0\\).
//!
//! The equation is integrated over a sample time, so that velocities are enough: the change of velocity replaces the acceleration, and the
//! other terms are means of both ends.

use super::checkpoint::Checkpoint;
use super::least_squares::{LeastSquares, Memory};
use crate::error::{Error, Result};

/// A joint's friction that learns.
#[derive(Debug, Clone, PartialEq)]
pub struct RecursiveFriction {
    sample_time: f64,
    reversal: f64,
    last: Option<f64>,
    fit: LeastSquares,
}

impl RecursiveFriction {
    /// A model for torques held over `sample_time` s; dry friction changes its sign within `reversal` rad/s.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless both are positive and finite, or for a memory outside its range.
    pub fn new(sample_time: f64, reversal: f64, memory: Memory) -> Result<Self> {
        for (name, value) in [("sample_time", sample_time), ("reversal", reversal)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::parameter(name, value, "positive and finite"));
            }
        }
        Ok(RecursiveFriction {
            sample_time,
            reversal,
            last: None,
            fit: LeastSquares::new(4, memory, 0.0)?,
        })
    }

    /// Takes the torque that was held until now, N m, and the velocity now, rad/s; returns the prediction error of the torque.
    pub fn push(&mut self, torque: f64, velocity: f64) -> Option<f64> {
        let last = self
            .last
            .replace(velocity)
            .filter(|v| v.is_finite() && velocity.is_finite());
        let before = last?;
        let dry = 0.5 * ((before / self.reversal).tanh() + (velocity / self.reversal).tanh());
        let row = [
            (velocity - before) / self.sample_time,
            dry,
            0.5 * (before + velocity),
            1.0,
        ];
        let foreseen = self
            .fit
            .estimate()
            .map(|x| x.iter().zip(row).map(|(x, r)| x * r).sum::<f64>());
        self.fit.push(&row, torque);
        foreseen.map(|f| torque - f)
    }

    /// `[J, fc, fv, tau0]`, kg m^2, N m, N m s/rad, N m; `None` as long as the samples do not determine them.
    pub fn estimate(&self) -> Option<[f64; 4]> {
        self.fit.estimate()?.try_into().ok()
    }

    /// A checkpoint.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for number in [self.sample_time, self.reversal, self.last.unwrap_or(f64::NAN)] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(self.fit.to_bytes());
        bytes
    }

    /// The state of a checkpoint.
    ///
    /// # Errors
    /// [`Error::Parameter`] for bytes that are no checkpoint.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let mut checkpoint = Checkpoint::new(bytes);
        let [sample_time, reversal, last] = [(); 3].map(|()| checkpoint.number());
        let mut state = RecursiveFriction::new(sample_time?, reversal?, Memory::All)?;
        state.last = Some(last?).filter(|v| v.is_finite());
        state.fit = LeastSquares::from_bytes(checkpoint.rest())?;
        checkpoint.check(state.fit.parameters() == 4)?;
        Ok(state)
    }
}
