//! The equations of motion, solved for the accelerations, and the energy.
//!
//! The flexible arm's (7)-(8) are one symmetric system for \\((q'', q_m'')\\):
//!
//! \\[\begin{bmatrix} M & S \\\\ S^T & J_m \end{bmatrix}
//!    \begin{bmatrix} q'' \\\\ q_m'' \end{bmatrix} =
//!    \begin{bmatrix} \kappa(d) - C q' - f(q') \\\\ \tau - \kappa(d) - f_m(q_m') \end{bmatrix}\\]
//!
//! with f_m the motors' friction, and a damping of the joints in kappa, which the paper does not have.
//!
//! It is factorised as \\(L D L^T\\) in the order qm1, qm2, q2, q1: the motors' block is diagonal
//! and `S` has one element, so only `M11` and the first right-hand side change when the motors are eliminated.

use super::State;
use super::arm::Arm;
use super::coefficients::Coefficients;
use super::elementary;
use super::parameters::JointKind;
use crate::number::Number;

/// The elastic and the friction torques of both joints.
struct JointTorques<T> {
    elastic: [T; 2],
    friction: [T; 2],
}

/// Solves `m a = r` by elimination of the second unknown.
#[inline(always)]
fn solve<T: Number>(m: [[T; 2]; 2], r: [T; 2]) -> [T; 2] {
    let factor = m[0][1] / m[1][1];
    let first = (r[0] - factor * r[1]) / (m[0][0] - factor * m[1][0]);
    [first, (r[1] - m[1][0] * first) / m[1][1]]
}

impl Arm {
    /// The time derivative of the state `[q1, q2, qm1, qm2, q1', q2', qm1', qm2']` of a flexible arm
    /// under the motor torques `tau`: (7) and (8) with the motors eliminated, whose matrix form is above. (A rigid arm's motors are locked
    /// to its links, and have their friction.)
    #[inline]
    pub fn derivative(&self, x: &[f64; 8], tau: [f64; 2]) -> [f64; 8] {
        if self.model() == JointKind::Rigid {
            let [v1, v2, a1, a2] = self.rigid_derivative(&[x[0], x[1], x[4], x[5]], tau);
            return [v1, v2, v1, v2, a1, a2, a1, a2];
        }
        self.coefficients.derivative(x, &tau)
    }

    /// The time derivative of the state `[q1, q2, q1', q2']` of a rigid arm, (4), under `tau`.
    #[inline]
    pub fn rigid_derivative(&self, x: &[f64; 4], tau: [f64; 2]) -> [f64; 4] {
        self.coefficients.rigid_derivative(x, &tau)
    }

    /// The time derivative of `[q1, q2, q1', q2']` while ideal servos hold the deflections `d`:
    /// `M q'' + S q'' + C q' + f(q') = kappa(d)`, which is (7) with `qm'' = q''`.
    #[inline]
    pub fn deflected_derivative(&self, x: &[f64; 4], d: [f64; 2]) -> [f64; 4] {
        self.coefficients.deflected_derivative(x, &d)
    }

    /// The motor torques `S^T q'' + Jm q'' + fm(q') + kappa(d)`, (8), that hold the deflections `d` while
    /// the links move with the velocities `v` and the accelerations `a`.
    pub fn holding_torque(&self, a: [f64; 2], v: [f64; 2], d: [f64; 2]) -> [f64; 2] {
        let [first, second] = self.stiffness();
        let Coefficients { motor, coupling, .. } = &self.coefficients;
        let motor_friction = self.coefficients.motor_friction_torques(v);
        [
            motor[0] * a[0] + motor_friction[0] + first.torque(d[0]),
            coupling * a[0] + motor[1] * a[1] + motor_friction[1] + second.torque(d[1]),
        ]
    }

    /// The total energy, J: `1/2 q'^T M q' + q'^T S qm' + 1/2 qm'^T Jm qm' + U(d)`; for a rigid arm
    /// the kinetic energy of its links (and rotors, where they are switched on).
    ///
    /// Constant without friction and torque; friction never lets it grow.
    pub fn energy(&self, state: &State) -> f64 {
        let State { q, qm, dq, dqm } = *state;
        let form = |m: [[f64; 2]; 2], v: [f64; 2]| {
            m[0][0] * v[0] * v[0] + (m[0][1] + m[1][0]) * v[0] * v[1] + m[1][1] * v[1] * v[1]
        };
        let Coefficients { motor, coupling, .. } = &self.coefficients;
        if self.model() == JointKind::Rigid {
            return 0.5 * form(self.coefficients.mass_terms(q[1].cos()), dq);
        }
        let rotors = motor[0] * dqm[0] * dqm[0] + motor[1] * dqm[1] * dqm[1];
        let [first, second] = self.stiffness();
        0.5 * form(self.link_dynamics().inertia(q[1]), dq)
            + coupling * dq[0] * dqm[1]
            + 0.5 * rotors
            + first.potential(qm[0] - q[0])
            + second.potential(qm[1] - q[1])
    }
}

impl<T: Number> Coefficients<T> {
    /// [`Arm::derivative`] of a flexible arm.
    #[inline(always)]
    pub(super) fn derivative(&self, x: &[T; 8], tau: &[T; 2]) -> [T; 8] {
        let dq = [x[4], x[5]];
        let JointTorques { mut elastic, friction } = self.joint_torques([x[2] - x[0], x[3] - x[1]], dq);
        elastic[0] = elastic[0] + self.damping[0] * (x[6] - x[4]);
        elastic[1] = elastic[1] + self.damping[1] * (x[7] - x[5]);
        let (sin, cos) = elementary::sin_cos(x[1]);
        let inertial = self.coriolis_torque(sin, dq);
        let mut r = [
            elastic[0] - inertial[0] - friction[0],
            elastic[1] - inertial[1] - friction[1],
        ];
        let motor_friction = self.motor_friction_torques([x[6], x[7]]);
        let drive = [
            tau[0] - elastic[0] - motor_friction[0],
            tau[1] - elastic[1] - motor_friction[1],
        ];
        if self.form.coupled {
            r[0] = r[0] - drive[1];
        }
        let a = self.solve_free(self.mass_terms(cos), r);
        let mut am = [tau[0].filled(0.0); 2];
        if self.form.free[0] {
            am[0] = drive[0] / self.motor[0];
        }
        if self.form.free[1] {
            am[1] = (drive[1] - self.coupling * a[0]) / self.motor[1];
        }
        [x[4], x[5], x[6], x[7], a[0], a[1], am[0], am[1]]
    }

    /// [`Arm::rigid_derivative`].
    #[inline(always)]
    pub(super) fn rigid_derivative(&self, x: &[T; 4], tau: &[T; 2]) -> [T; 4] {
        let dq = [x[2], x[3]];
        let friction = self.joint_torques([tau[0].filled(0.0); 2], dq).friction;
        let motor_friction = self.motor_friction_torques(dq);
        let (sin, cos) = elementary::sin_cos(x[1]);
        let inertial = self.coriolis_torque(sin, dq);
        let r = [
            tau[0] - inertial[0] - friction[0] - motor_friction[0],
            tau[1] - inertial[1] - friction[1] - motor_friction[1],
        ];
        let a = self.solve_free(self.mass_terms(cos), r);
        [x[2], x[3], a[0], a[1]]
    }

    /// [`Arm::deflected_derivative`].
    #[inline(always)]
    pub(super) fn deflected_derivative(&self, x: &[T; 4], d: &[T; 2]) -> [T; 4] {
        let dq = [x[2], x[3]];
        let JointTorques { elastic, friction } = self.joint_torques(*d, dq);
        let (sin, cos) = elementary::sin_cos(x[1]);
        let inertial = self.coriolis_torque(sin, dq);
        let r = [
            elastic[0] - inertial[0] - friction[0],
            elastic[1] - inertial[1] - friction[1],
        ];
        let a = self.solve_free(self.deflection_mass(cos), r);
        [x[2], x[3], a[0], a[1]]
    }

    /// The matrix that multiplies `q''` after the motors are eliminated: `M - S Jm^-1 S^T`, or `M` with the
    /// rotors geared to it for a rigid arm.
    #[inline(always)]
    pub(super) fn mass_terms(&self, cos: T) -> [[T; 2]; 2] {
        let m = self.link_inertia(cos);
        let [[m11, m12], [_, m22]] = m;
        if self.form.rigid {
            if !self.form.rotors {
                return m;
            }
            let off = m12 + self.coupling;
            return [[m11 + self.motor[0], off], [off, m22 + self.motor[1]]];
        }
        // S Jm^-1 S^T has the one element S12^2 / Jm2 = S12; a locked rotor 2 is held by its reaction.
        let m11 = if self.form.free[1] { m11 - self.coupling } else { m11 };
        [[m11, m12], [m12, m22]]
    }

    /// `M + S`, not symmetric.
    #[inline(always)]
    pub(super) fn deflection_mass(&self, cos: T) -> [[T; 2]; 2] {
        let [[m11, m12], second] = self.link_inertia(cos);
        [[m11, m12 + self.coupling], second]
    }

    /// The inertia matrix (5); this form is for the integrator; other callers use the one in `manipulator/links.rs`.
    #[inline(always)]
    fn link_inertia(&self, cos: T) -> [[T; 2]; 2] {
        let swing = self.swing * cos;
        let off = self.elbow + swing;
        [[self.shoulder + swing * 2.0, off], [off, self.elbow]]
    }

    /// `C(q, q') q'`, with the matrix of (6), as in `manipulator/links.rs`.
    #[inline(always)]
    fn coriolis_torque(&self, sin: T, dq: [T; 2]) -> [T; 2] {
        let factor = self.swing * sin;
        [-factor * (dq[0] * 2.0 + dq[1]) * dq[1], factor * dq[0] * dq[0]]
    }

    /// The accelerations of the joints that are free; those of locked ones are zero.
    #[inline(always)]
    fn solve_free(&self, m: [[T; 2]; 2], r: [T; 2]) -> [T; 2] {
        let zero = r[0].filled(0.0);
        match self.form.free {
            [true, true] => solve(m, r),
            [true, false] => [r[0] / m[0][0], zero],
            [false, true] => [zero, r[1] / m[1][1]],
            [false, false] => [zero; 2],
        }
    }

    /// The elastic torques (10), (11) at the deflections `d` and the friction torques (12) at the velocities `v`, for both joints at once;
    /// the plain formulas are in `joint.rs`.
    #[inline(always)]
    fn joint_torques(&self, d: [T; 2], v: [T; 2]) -> JointTorques<T> {
        let [s1, s2] = &self.springs;
        let d2 = [d[0] * d[0], d[1] * d[1]];
        let mut factor = [s1.cubic * d2[0] + s1.linear, s2.cubic * d2[1] + s2.linear];
        let mut friction = [d[0].filled(0.0); 2];
        if self.form.smooth_terms {
            friction = friction_torques(&self.friction, v);
            let e = elementary::exp_nonpositive([-s1.windup_sharpness * d2[0], -s2.windup_sharpness * d2[1]]);
            factor[0] = factor[0] - s1.windup * e[0];
            factor[1] = factor[1] - s2.windup * e[1];
        }
        JointTorques {
            elastic: [factor[0] * d[0], factor[1] * d[1]],
            friction,
        }
    }

    /// The friction torques of both motors at their velocities.
    #[inline(always)]
    fn motor_friction_torques(&self, v: [T; 2]) -> [T; 2] {
        match self.form.motor_friction {
            true => friction_torques(&self.motor_friction, v),
            false => [v[0].filled(0.0); 2],
        }
    }
}

/// Two friction torques (12) at once; `joint.rs` has the plain formula.
#[inline(always)]
fn friction_torques<T: Number>([f, g]: &[[T; 6]; 2], v: [T; 2]) -> [T; 2] {
    let t = elementary::tanh([
        f[1] * v[0],
        g[1] * v[1],
        f[2] * v[0],
        g[2] * v[1],
        f[4] * v[0],
        g[4] * v[1],
    ]);
    [
        f[0] * (t[0] - t[2]) + f[3] * t[4] + f[5] * v[0],
        g[0] * (t[1] - t[3]) + g[3] * t[5] + g[5] * v[1],
    ]
}
