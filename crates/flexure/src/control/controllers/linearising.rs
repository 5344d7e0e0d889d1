//! Inverse dynamics of the arm with flexible joints: feedback linearisation (Spong 1987; De Luca & Lucibello 1998).
//!
//! Without coupled rotors and friction the links' angles obey \\(q'''' = v\\) under
//! $$ \tau = J_m q_m'' + \kappa(d), \qquad \kappa(d) = M q'' + C q', \qquad q_m = q + d $$
//! with q'' and q''' from the measured state, and \\(v = q_d'''' + \sum_i c_i (q_d^{(i)} - q^{(i)})\\) places all four poles of the
//! error at \\(-\lambda\\). The other parts of the model's torque on the reference are added: coupling of the rotors, and friction at the
//! reference's velocity. So the torque is exact on the reference. Friction is not inverted at measured velocities: near standstill its
//! slope is too steep for a sampled loop, and it only damps.

use super::super::{Controller, Jet, Measured, inverse_motion};
use super::feedforward::wanted;
use crate::error::{Error, Result};
use crate::manipulator::{Arm, ArmParameters, State};

/// Feedback linearisation with the feedforward of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearising {
    model: Arm,
    /// The model without coupling and friction.
    core: Arm,
    /// `c_0 .. c_3` of either joint.
    gains: [f64; 4],
}

impl Linearising {
    /// Error dynamics with four poles at `-rate`, 1/s.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless the rate is positive and finite.
    pub fn new(model: Arm, rate: f64) -> Result<Self> {
        if !(rate > 0.0 && rate.is_finite()) {
            return Err(Error::parameter("rate", rate, "positive and finite (in 1/s)"));
        }
        let mut core: ArmParameters = *model.parameters();
        core.parts.coupling = false;
        core.parts.friction = false;
        for joint in &mut core.joints {
            joint.damping = 0.0;
        }
        Ok(Linearising {
            model,
            core: Arm::new(core)?,
            gains: [rate.powi(4), 4.0 * rate.powi(3), 6.0 * rate * rate, 4.0 * rate],
        })
    }

    /// Link angles of the core with their derivatives up to the third at a state.
    fn angles(&self, state: &State) -> [Jet; 2] {
        let x = state.to_array();
        let rate = self.core.derivative(&x, [0.0; 2]);
        // The third derivative is the derivative of the second along the motion; the torque acts only on the motors.
        let h = 1e-5;
        let along = |s: f64| {
            self.core
                .derivative(&std::array::from_fn(|i| x[i] + s * rate[i]), [0.0; 2])
        };
        let (ahead, behind) = (along(h), along(-h));
        [0, 1].map(|i| {
            let third = (ahead[4 + i] - behind[4 + i]) / (2.0 * h);
            Jet::of_derivatives(&[state.q[i], state.dq[i], rate[4 + i], third])
        })
    }

    /// The torque of the core that gives the links of a state this fourth derivative beyond the reference's.
    fn law(&self, q: [Jet; 2], wanted: &[Jet; 2], model_torque: [f64; 2]) -> [f64; 2] {
        let of = |fourth: [f64; 2], q: [Jet; 2]| {
            let q = [0, 1].map(|i| {
                let mut q = q[i];
                q.0[4] = fourth[i] / 24.0;
                q.0[5..].fill(0.0);
                q
            });
            inverse_motion(&self.core, q).map(|motion| motion.torque)
        };
        let fourth = wanted.map(|q| q.derivative(4));
        let v = [0, 1].map(|i| {
            let error = |order: usize| wanted[i].derivative(order) - q[i].derivative(order);
            fourth[i] + (0..4).map(|order| self.gains[order] * error(order)).sum::<f64>()
        });
        match (of(v, q), of(fourth, *wanted)) {
            (Some(there), Some(on_reference)) => [0, 1].map(|i| model_torque[i] + there[i] - on_reference[i]),
            _ => model_torque,
        }
    }
}

impl Controller for Linearising {
    fn torque(&mut self, measured: &Measured) -> [f64; 2] {
        let [now, held] = wanted(&self.model, measured);
        // The reference's springs carry friction and coupling; the core's do not. So the core is evaluated at its own reference state plus
        // the deviation of the measured state from the model's.
        let state = &measured.state;
        let model = now.state();
        let Some(core) = inverse_motion(&self.core, measured.reference).map(|m| m.state()) else {
            return held.torque;
        };
        let moved =
            |own: [f64; 2], measured: [f64; 2], wanted: [f64; 2]| [0, 1].map(|i| own[i] + measured[i] - wanted[i]);
        let at = State {
            q: moved(core.q, state.q, model.q),
            qm: moved(core.qm, state.qm, model.qm),
            dq: moved(core.dq, state.dq, model.dq),
            dqm: moved(core.dqm, state.dqm, model.dqm),
        };
        self.law(self.angles(&at), &measured.reference, held.torque)
    }

    fn reset(&mut self) {}
}
