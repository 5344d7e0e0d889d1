//! Direct adaptive control: simple adaptive control in the form for flexible joints (Ulrich, Sasiadek & Barkana 2012, Modeling and direct
//! adaptive control of a flexible-joint manipulator, AIAA J. Guidance 35; Kaufman, Barkana & Sobel 1998).
//!
//! For every joint, with the links' error \\(e = q_d - q\\) and \\(\epsilon = e' + \lambda e\\),
//!
//! $$ \tau = \tau_r + K_p e + K_d e' + K_x x_m + K_v (q' - q_m'), \qquad
//!    K_p = \bar K_p + k_p + \Gamma_P e^2, \quad k_p' = \Gamma_I e^2 - \sigma k_p $$
//! $$ K_x = k_x + T \Gamma_x \epsilon\, x_m, \qquad k_x' = \Gamma_x \epsilon\, x_m - \sigma k_x $$
//!
//! and \\(K_d\\) as \\(K_p\\), driven by e'. The reference model's state is that of the smooth reference,
//! \\(x_m = (q_d'', q_d', \tanh(q_d'/v_0))\\). \\(\tau_r\\) is the torque of the rigid arm on the reference, from the same model that the
//! other controllers have. The term with \\(K_v\\) damps the springs, as in a singular perturbation (Spong 1987). It makes a spring wind up
//! late by about \\(K_v / k\\), so \\(\tau_r\\) and friction are taken from the reference at a later time. Neither stiffness nor friction
//! is in the law.
//!
//! Without leakage the adaptation of \\(k_x\\) is lossless: \\(\int \epsilon k_x x_m\, dt = |k_x|^2 / (2 \Gamma_x)\\), which the tests
//! check along a run, and the part with T only dissipates. With an almost strictly passive plant, this makes the loop stable.

use super::super::{Controller, Jet, Measured, inverse_motion};
use crate::error::{Error, Result};
use crate::manipulator::{Arm, JointKind};

/// The velocity, rad/s, at which the sign of the reference's friction has changed.
pub(super) const REVERSAL: f64 = 0.01;

/// The common parts of the adaptive laws of links: the rigid model, and the damping of the springs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Slow {
    /// The arm with rigid joints and geared rotors, without friction.
    pub rigid: Arm,
    /// `Kv`, N m s/rad.
    pub damping: f64,
}

impl Slow {
    pub fn new(model: &Arm, damping: f64) -> Result<Self> {
        if !(damping >= 0.0 && damping.is_finite()) {
            return Err(Error::parameter(
                "the damping of the springs",
                damping,
                "not negative and finite (in N m s/rad)",
            ));
        }
        let mut rigid = *model.parameters();
        rigid.model = JointKind::Rigid;
        rigid.parts.friction = false;
        rigid.parts.rotors = true;
        Ok(Slow {
            rigid: Arm::new(rigid)?,
            damping,
        })
    }

    /// The torque of the rigid arm in this motion.
    pub fn torque(&self, q: [Jet; 2]) -> [f64; 2] {
        inverse_motion(&self.rigid, q).map_or([0.0; 2], |motion| motion.torque)
    }

    /// The torque that damps the springs.
    pub fn spring_damping(&self, measured: &Measured) -> [f64; 2] {
        let state = &measured.state;
        [0, 1].map(|i| self.damping * (state.dq[i] - state.dqm[i]))
    }
}

/// The rates of a direct adaptive law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveGains {
    /// The gains that it starts from, N m/rad and N m s/rad, of both joints.
    pub start: [[f64; 2]; 2],
    /// The rates at which the error's gains grow by its square: proportional, and integrated (per s).
    pub error_rates: [f64; 2],
    /// The rates at which the reference's gains of either joint follow the error.
    pub reference_rates: [f64; 2],
    /// The part of these gains that is proportional to the error, in units of the rates, s.
    pub proportional: f64,
    /// The slope of the error's surface, 1/s.
    pub surface: f64,
    /// The leakage of all gains, 1/s.
    pub leakage: f64,
    /// The damping of the springs, N m s/rad.
    pub damping: f64,
    /// The time by which the reference is ahead for torque and friction, s.
    pub lead: f64,
}

impl AdaptiveGains {
    /// Gains that work for the space arm at 100 Hz, with springs of at least half of their stiffness. The example `control_gains` found
    /// them.
    pub fn space_arm() -> Self {
        AdaptiveGains {
            start: [[560.0, 350.0], [200.0, 150.0]],
            error_rates: [330.0, 950.0],
            reference_rates: [100.0, 50.0],
            proportional: 0.22,
            surface: 4.8,
            leakage: 0.004,
            damping: 40.0,
            lead: 0.08,
        }
    }
}

/// Direct adaptive control.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectAdaptive {
    slow: Slow,
    gains: AdaptiveGains,
    /// `k_p`, `k_d` of either joint.
    error: [[f64; 2]; 2],
    /// `K_x` of either joint.
    reference: [[f64; 3]; 2],
}

impl DirectAdaptive {
    /// A law with the rigid part of this model.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a rate that is negative or not finite.
    pub fn new(model: &Arm, gains: AdaptiveGains) -> Result<Self> {
        let all = [
            gains.error_rates[0],
            gains.error_rates[1],
            gains.reference_rates[0],
            gains.reference_rates[1],
            gains.proportional,
            gains.surface,
            gains.leakage,
            gains.lead,
            gains.start[0][0],
            gains.start[0][1],
            gains.start[1][0],
            gains.start[1][1],
        ];
        if let Some(&rate) = all.iter().find(|v| !(**v >= 0.0 && v.is_finite())) {
            return Err(Error::parameter(
                "a gain of the adaptive law",
                rate,
                "not negative and finite",
            ));
        }
        Ok(DirectAdaptive {
            slow: Slow::new(model, gains.damping)?,
            gains,
            error: [[0.0; 2]; 2],
            reference: [[0.0; 3]; 2],
        })
    }

    /// The adapted gains `k_p, k_d` and `K_x` of either joint.
    pub fn adapted(&self) -> [([f64; 2], [f64; 3]); 2] {
        [0, 1].map(|i| (self.error[i], self.reference[i]))
    }
}

impl Controller for DirectAdaptive {
    fn torque(&mut self, measured: &Measured) -> [f64; 2] {
        let g = &self.gains;
        let (state, step) = (&measured.state, measured.sample_time);
        let held = measured.reference.map(|q| q.shifted(g.lead + 0.5 * step));
        let model = self.slow.torque(held);
        let damping = self.slow.spring_damping(measured);
        [0, 1].map(|i| {
            let wanted = measured.reference[i];
            let e = wanted.value() - state.q[i];
            let de = wanted.derivative(1) - state.dq[i];
            let ahead = wanted.shifted(g.lead);
            let xm = [
                wanted.derivative(2),
                wanted.derivative(1),
                (ahead.derivative(1) / REVERSAL).tanh(),
            ];
            let [kp, kd] = self.error[i];
            let gains = [
                g.start[i][0] + kp + g.error_rates[0] * e * e,
                g.start[i][1] + kd + g.error_rates[0] * de * de,
            ];
            let surface = de + g.surface * e;
            let rate = g.reference_rates[i] * surface;
            let along: f64 = (self.reference[i].iter().zip(xm))
                .map(|(k, x)| (k + g.proportional * rate * x) * x)
                .sum();
            // The gains' rates over the sample time.
            let keep = (-g.leakage * step).exp();
            self.error[i] = [
                keep * kp + step * g.error_rates[1] * e * e,
                keep * kd + step * g.error_rates[1] * de * de,
            ];
            self.reference[i] = [0, 1, 2].map(|j| keep * self.reference[i][j] + step * rate * xm[j]);
            model[i] + gains[0] * e + gains[1] * de + along + damping[i]
        })
    }

    fn reset(&mut self) {
        self.error = [[0.0; 2]; 2];
        self.reference = [[0.0; 3]; 2];
    }
}
