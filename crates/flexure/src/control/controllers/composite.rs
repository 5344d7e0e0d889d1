//! Composite adaptive control (Slotine & Li 1989, Composite adaptive control of robot manipulators, Automatica 25), for comparison.
//!
//! With \\(s = q' - q_r'\\), \\(q_r' = q_d' - \lambda (q - q_d)\\) and the regressor Y of the rigid arm with friction,
//!
//! $$ \tau = Y(q, q', q_r', q_r'') \hat\theta - K_D s + K_v (q' - q_m'), \qquad
//!    \hat\theta' = -P \left(Y^T s + W^T (W \hat\theta - y)\right) $$
//!
//! where y and W are torque and regressor through the same low-pass filter, so that no accelerations need be measured: with
//! \\(\omega / (p + \omega)\\), \\(M q''\\) becomes \\(\omega (M q' - \text{filtered}(M q' + M' q'/\omega))\\). The parameters are the
//! three inertias of the links, and Coulomb and viscous friction of either joint; the rotors are known.

use super::super::{Controller, Measured};
use super::adaptive::{REVERSAL, Slow};
use crate::error::{Error, Result};
use crate::manipulator::Arm;

/// Parameters: shoulder, elbow, coupling (kg m^2), Coulomb (N m) and viscous friction (N m s/rad) of either joint.
const PARAMETERS: usize = 7;

type Regressor = [[f64; PARAMETERS]; 2];

/// The rates of a composite adaptive law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompositeGains {
    /// `lambda`, 1/s.
    pub surface: f64,
    /// `K_D` of both joints, N m s/rad.
    pub feedback: [f64; 2],
    /// The rates on the tracking error: of inertias, and of the friction of either joint.
    pub tracking: [f64; 3],
    /// The weight of the prediction error, relative to the tracking error.
    pub prediction: f64,
    /// The filter's cut-off, rad/s.
    pub cut_off: f64,
    /// The damping of the springs, N m s/rad.
    pub damping: f64,
}

impl CompositeGains {
    /// Gains that work for the space arm at 100 Hz, by the same search as those of
    /// [`AdaptiveGains::space_arm`](super::AdaptiveGains::space_arm).
    pub fn space_arm() -> Self {
        CompositeGains {
            surface: 3.0,
            feedback: [280.0, 96.0],
            tracking: [200.0, 200.0, 71.0],
            prediction: 0.07,
            cut_off: 1.25,
            damping: 40.0,
        }
    }
}

/// Composite adaptive control.
#[derive(Debug, Clone, PartialEq)]
pub struct Composite {
    slow: Slow,
    gains: CompositeGains,
    start: [f64; PARAMETERS],
    estimate: [f64; PARAMETERS],
    /// The filters' states: one for `M q'` and its companion terms, one for friction and torque.
    filtered: [[f64; PARAMETERS + 1]; 2],
    last: [f64; 2],
}

/// The regressor of `M(q) a + C(q, q') v + f`, with friction at `w`.
fn regressor(q2: f64, dq: [f64; 2], v: [f64; 2], a: [f64; 2], w: [f64; 2]) -> Regressor {
    let (sin, cos) = q2.sin_cos();
    let friction = w.map(|w| (w / REVERSAL).tanh());
    let swing = [
        cos * (2.0 * a[0] + a[1]) - sin * (dq[1] * v[0] + (dq[0] + dq[1]) * v[1]),
        cos * a[0] + sin * dq[0] * v[0],
    ];
    [
        [a[0], a[1], swing[0], friction[0], w[0], 0.0, 0.0],
        [0.0, a[0] + a[1], swing[1], 0.0, 0.0, friction[1], w[1]],
    ]
}

impl Composite {
    /// A law that starts from the inertias of this model, and without friction.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a rate that is negative or not finite.
    pub fn new(model: &Arm, gains: CompositeGains) -> Result<Self> {
        let all = [
            gains.surface,
            gains.feedback[0],
            gains.feedback[1],
            gains.tracking[0],
            gains.tracking[1],
            gains.tracking[2],
            gains.prediction,
            gains.cut_off,
        ];
        if let Some(&rate) = all.iter().find(|v| !(**v >= 0.0 && v.is_finite())) {
            return Err(Error::parameter(
                "a gain of the composite law",
                rate,
                "not negative and finite",
            ));
        }
        let slow = Slow::new(model, gains.damping)?;
        let links = model.link_dynamics();
        let start = [links.shoulder, links.elbow, links.coupling, 0.0, 0.0, 0.0, 0.0];
        Ok(Composite {
            slow,
            gains,
            start,
            estimate: start,
            filtered: [[0.0; PARAMETERS + 1]; 2],
            last: [0.0; 2],
        })
    }

    /// The estimated parameters: shoulder, elbow, coupling, Coulomb and viscous friction of joint 1, of joint 2.
    pub fn estimate(&self) -> [f64; PARAMETERS] {
        self.estimate
    }

    /// Filters and returns regressor and torque: the prediction and the measurement.
    fn filter(&mut self, measured: &Measured) -> [[f64; PARAMETERS + 1]; 2] {
        let (state, w, step) = (&measured.state, self.gains.cut_off, measured.sample_time);
        let rotor = self.slow.rigid.parameters().joints.map(|j| j.motor_inertia);
        let dq = state.dq;
        // M q' and, for M q'' = (M q')' - M' q', the rest of the equations of motion: C q' - M' q' + f.
        let momentum = regressor(state.q[1], [0.0; 2], [0.0; 2], dq, [0.0; 2]);
        let plain = regressor(state.q[1], dq, dq, [0.0; 2], dq);
        let (sin, _) = state.q[1].sin_cos();
        let mut rest = plain;
        // M' q' = -sin q2 q2' [2 q1' + q2', q1'] coupling.
        rest[0][2] += sin * dq[1] * (2.0 * dq[0] + dq[1]);
        rest[1][2] += sin * dq[1] * dq[0];
        let keep = (-w * step).exp();
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                // w (p m + r) / (p + w) = w m + w / (p + w) (r - w m)
                let (m, r) = match j < PARAMETERS {
                    true => (momentum[i][j], rest[i][j]),
                    false => (0.0, self.last[i]),
                };
                let known = if j == PARAMETERS { -rotor[i] * dq[i] } else { 0.0 };
                let m = m + known;
                self.filtered[i][j] = keep * self.filtered[i][j] + (1.0 - keep) * (r - w * m);
                w * m + self.filtered[i][j]
            })
        })
    }
}

impl Controller for Composite {
    fn torque(&mut self, measured: &Measured) -> [f64; 2] {
        let (g, state, step) = (self.gains, &measured.state, measured.sample_time);
        let wanted = &measured.reference;
        let e = [0, 1].map(|i| state.q[i] - wanted[i].value());
        let de = [0, 1].map(|i| state.dq[i] - wanted[i].derivative(1));
        let vr = [0, 1].map(|i| wanted[i].derivative(1) - g.surface * e[i]);
        let ar = [0, 1].map(|i| wanted[i].derivative(2) - g.surface * de[i]);
        let s = [0, 1].map(|i| state.dq[i] - vr[i]);
        // Friction at the reference's velocity, as in the direct law.
        let y = regressor(state.q[1], state.dq, vr, ar, wanted.map(|q| q.derivative(1)));
        let rotor = self.slow.rigid.parameters().joints.map(|j| j.motor_inertia);
        let damping = self.slow.spring_damping(measured);
        let torque = [0, 1].map(|i| {
            let model: f64 = y[i].iter().zip(self.estimate).map(|(y, p)| y * p).sum();
            model + rotor[i] * ar[i] - g.feedback[i] * s[i] + damping[i]
        });
        let seen = self.filter(measured);
        for j in 0..PARAMETERS {
            let tracking: f64 = (0..2).map(|i| y[i][j] * s[i]).sum();
            let miss =
                |i: usize| (0..PARAMETERS).map(|k| seen[i][k] * self.estimate[k]).sum::<f64>() - seen[i][PARAMETERS];
            let prediction: f64 = (0..2).map(|i| seen[i][j] * miss(i)).sum();
            // Three inertias, then two parameters of the friction of either joint.
            let rate = g.tracking[(j.max(1) - 1) / 2];
            self.estimate[j] -= step * rate * (tracking + g.prediction * prediction);
        }
        self.last = torque;
        torque
    }

    fn reset(&mut self) {
        self.estimate = self.start;
        self.filtered = [[0.0; PARAMETERS + 1]; 2];
        self.last = [0.0; 2];
    }
}
