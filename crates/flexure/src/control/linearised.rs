//! The arm linearised about rest.
//!
//! About the configuration q with the motors' deflections d (7)-(8) become
//! $$ x' = A x + B \tau, \qquad x = (\delta q, \delta q_m, \delta q', \delta q_m') $$
//! where A and B are computed here as differences of the equations of motion. With the motors held by springs of stiffness kp (a PD
//! servo), the links vibrate at the roots of \\(\det(K - \omega^2 M(q)) = 0\\) with \\(K_i = \kappa_i' k_{p,i} / (\kappa_i' + k_{p,i})\\).

use super::Jet;
use crate::linalg::Matrix;
use crate::manipulator::{Arm, State};

/// Steps of the differences: about the cube root of the rounding error, in units of angles and velocities.
const STEP: f64 = 1e-6;

/// An arm linearised about a state, in continuous time and sampled.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearisedArm {
    /// `A`, 8 rows of 8.
    pub a: [[f64; 8]; 8],
    /// `B`, 8 rows of 2.
    pub b: [[f64; 2]; 8],
}

impl LinearisedArm {
    /// The derivatives of the equations of motion at a state under a torque, by central differences.
    pub fn new(arm: &Arm, state: &State, torque: [f64; 2]) -> Self {
        let x = state.to_array();
        let (mut a, mut b) = ([[0.0; 8]; 8], [[0.0; 2]; 8]);
        for j in 0..8 {
            let at = |h: f64| {
                let mut x = x;
                x[j] += h;
                arm.derivative(&x, torque)
            };
            let (ahead, behind) = (at(STEP), at(-STEP));
            for i in 0..8 {
                a[i][j] = (ahead[i] - behind[i]) / (2.0 * STEP);
            }
        }
        for j in 0..2 {
            let at = |h: f64| {
                let mut torque = torque;
                torque[j] += h;
                arm.derivative(&x, torque)
            };
            // The torques enter linearly.
            let (ahead, behind) = (at(1.0), at(-1.0));
            for i in 0..8 {
                b[i][j] = 0.5 * (ahead[i] - behind[i]);
            }
        }
        LinearisedArm { a, b }
    }

    /// `(Ad, Bd)` for torques that are held over `step` seconds.
    pub(crate) fn sampled(&self, step: f64) -> (Matrix, Matrix) {
        sampled(
            &Matrix::from_fn(8, 8, |i, j| self.a[i][j]),
            &Matrix::from_fn(8, 2, |i, j| self.b[i][j]),
            step,
        )
    }
}

/// `(Ad, Bd)` of a system in continuous time whose inputs are held over `step` seconds: the exponential of `[A B; 0 0] step`.
pub(crate) fn sampled(a: &Matrix, b: &Matrix, step: f64) -> (Matrix, Matrix) {
    let (n, m) = b.shape();
    let mut generator = Matrix::zeros(n + m, n + m);
    generator.view_mut((0, 0), (n, n)).copy_from(&(a * step));
    generator.view_mut((0, n), (n, m)).copy_from(&(b * step));
    let flow = generator.exp();
    (
        flow.view((0, 0), (n, n)).into_owned(),
        flow.view((0, n), (n, m)).into_owned(),
    )
}

/// The circular frequencies, rad/s, the lower first, at which the links vibrate at the elbow angle `q2` while servos of the
/// stiffness `servo` (N m/rad; infinite for locked motors) hold the motors.
///
/// The result is a series, so that the frequencies can be followed along a motion.
pub fn held_frequencies(arm: &Arm, q2: Jet, servo: [f64; 2]) -> [Jet; 2] {
    let links = arm.link_dynamics();
    let laws = arm.stiffness();
    let k = [0, 1].map(|i| {
        let spring = laws[i].tangent(0.0);
        match servo[i].is_finite() {
            true => spring * servo[i] / (spring + servo[i]),
            false => spring,
        }
    });
    let [_, cos] = q2.sin_cos();
    let swing = cos * links.coupling;
    let m11 = swing * 2.0 + Jet::constant(links.shoulder);
    let m12 = swing + Jet::constant(links.elbow);
    let m22 = Jet::constant(links.elbow);
    // det M w^2 - (k1 M22 + k2 M11) w + k1 k2 = 0, both roots without cancellation.
    let determinant = m11 * m22 - m12 * m12;
    let middle = m22 * k[0] + m11 * k[1];
    let root = (middle * middle - determinant * (4.0 * k[0] * k[1])).sqrt();
    let larger = (middle + root) * 0.5;
    let lower = larger.recip() * (k[0] * k[1]);
    let upper = larger * determinant.recip();
    [lower.sqrt(), upper.sqrt()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manipulator::{JointKind, space_arm};

    #[test]
    fn held_frequencies_are_those_of_the_equations_of_motion_with_heavy_motors() {
        let mut parameters = space_arm(JointKind::Linear);
        for joint in &mut parameters.joints {
            joint.motor_inertia = 1e9;
        }
        let arm = Arm::new(parameters).unwrap();
        for q2 in [0.2, 1.3, 2.9] {
            let modes = held_frequencies(&arm, Jet::constant(q2), [f64::INFINITY; 2]).map(|w| w.value());
            let expected = arm.modal_frequencies(q2, [0.0; 2]);
            for (got, expected) in modes.iter().zip(expected) {
                assert!((got / expected - 1.0).abs() < 1e-6, "{q2}: {modes:?}");
            }
        }
    }

    #[test]
    fn the_linearised_arm_moves_as_the_arm_does_near_the_state() {
        let arm = Arm::new(space_arm(JointKind::Nonlinear)).unwrap();
        let state = State {
            q: [0.2, 1.0],
            qm: [0.25, 0.98],
            dq: [0.1, -0.2],
            dqm: [0.1, -0.2],
        };
        let linear = LinearisedArm::new(&arm, &state, [1.0, 2.0]);
        let (x, d) = (state.to_array(), 1e-4);
        let base = arm.derivative(&x, [1.0, 2.0]);
        let moved = arm.derivative(
            &std::array::from_fn(|i| x[i] + d * (i as f64 - 3.0)),
            [1.0 + d, 2.0 - d],
        );
        for i in 0..8 {
            let along: f64 = (0..8).map(|j| linear.a[i][j] * d * (j as f64 - 3.0)).sum();
            let expected = along + d * (linear.b[i][0] - linear.b[i][1]);
            assert!(
                (moved[i] - base[i] - expected).abs() < 2e-3 * (1e-3 + expected.abs()),
                "{i}"
            );
        }
    }
}
