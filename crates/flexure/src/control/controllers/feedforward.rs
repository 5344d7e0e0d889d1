//! PD at the motors with the feedforward of a model:
//!
//! $$ \tau = \tau_d + K_p (q_{m,d} - q_m) + K_d (q_{m,d}' - q_m') $$
//!
//! with torque and motor angles of the reference motion from [`inverse_motion`] (De Luca 2000, Feedforward/feedback laws for the
//! control of flexible robots, IEEE ICRA). Without a model the motors follow the links' reference.

use super::super::{Controller, InverseMotion, Jet, Measured, inverse_motion};
use crate::error::{Error, Result};
use crate::manipulator::Arm;

/// Gains of a PD servo of either motor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gains {
    /// N m/rad.
    pub proportional: [f64; 2],
    /// N m s/rad.
    pub derivative: [f64; 2],
}

impl Gains {
    /// Checks them.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless they are finite and not negative.
    pub fn new(proportional: [f64; 2], derivative: [f64; 2]) -> Result<Self> {
        for (name, unit, values) in [
            ("kp", "(in N m/rad)", proportional),
            ("kd", "(in N m s/rad)", derivative),
        ] {
            if let Some(&value) = values.iter().find(|v| !(**v >= 0.0 && v.is_finite())) {
                let requirement = match unit {
                    "(in N m/rad)" => "not negative and finite (in N m/rad)",
                    _ => "not negative and finite (in N m s/rad)",
                };
                return Err(Error::parameter(name, value, requirement));
            }
        }
        Ok(Gains {
            proportional,
            derivative,
        })
    }

    /// The torque on these errors of angle and velocity.
    pub fn torque(&self, angle: [f64; 2], velocity: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|i| self.proportional[i] * angle[i] + self.derivative[i] * velocity[i])
    }
}

/// The motion of the model at the middle of the hold, which gives the torque to hold, and at the instant itself.
pub(super) fn wanted(model: &Arm, measured: &Measured) -> [InverseMotion; 2] {
    let resting = |q: [Jet; 2]| InverseMotion {
        q,
        qm: q,
        torque: [0.0; 2],
    };
    let at = |s: f64| {
        let q = measured.reference.map(|q| q.shifted(s));
        inverse_motion(model, q).unwrap_or_else(|| resting(q))
    };
    [at(0.0), at(0.5 * measured.sample_time)]
}

/// PD at the motors, with feedforward or without.
#[derive(Debug, Clone, PartialEq)]
pub struct Feedforward {
    model: Option<Arm>,
    gains: Gains,
}

impl Feedforward {
    /// With the feedforward of this model.
    pub fn new(model: Arm, gains: Gains) -> Self {
        Feedforward {
            model: Some(model),
            gains,
        }
    }

    /// PD alone: the motors follow the links' reference.
    pub fn none(gains: Gains) -> Self {
        Feedforward { model: None, gains }
    }
}

impl Controller for Feedforward {
    fn torque(&mut self, measured: &Measured) -> [f64; 2] {
        let (qm, held) = match &self.model {
            Some(model) => {
                let [now, held] = wanted(model, measured);
                (now.qm, held.torque)
            }
            None => (measured.reference, [0.0; 2]),
        };
        let state = &measured.state;
        let angle = [0, 1].map(|i| qm[i].value() - state.qm[i]);
        let velocity = [0, 1].map(|i| qm[i].derivative(1) - state.dqm[i]);
        let servo = self.gains.torque(angle, velocity);
        [0, 1].map(|i| held[i] + servo[i])
    }

    fn reset(&mut self) {}
}
