//! The links' geometry and the rigid arm's equations (4)-(6).
//!
//! \\[\tau = M(q)\, q'' + C(q, q')\, q'\\]

use serde::{Deserialize, Serialize};

/// A link: a rigid body turning about the joint before it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Link {
    /// Mass `m`, kg; positive.
    pub mass: f64,
    /// Length `l`, m; positive.
    pub length: f64,
    /// Distance `lc` from the preceding joint to the centre of mass, m; not negative.
    pub com: f64,
    /// Moment of inertia `I` about the axis through the centre of mass perpendicular to the plane,
    /// kg m^2; not negative.
    pub inertia: f64,
}

/// The constants of the links in the equations of motion.
///
/// With `c = cos q2`: `M11 = shoulder + 2 coupling c`, `M12 = elbow + coupling c`, `M22 = elbow`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkDynamics {
    /// `m1 lc1^2 + m2 (l1^2 + lc2^2) + I1 + I2`, kg m^2.
    pub shoulder: f64,
    /// `m2 lc2^2 + I2`, kg m^2.
    pub elbow: f64,
    /// `m2 l1 lc2`, kg m^2.
    pub coupling: f64,
}

impl LinkDynamics {
    /// The constants of two links.
    pub fn new(links: &[Link; 2]) -> Self {
        let [first, second] = links;
        let elbow = second.mass * second.com * second.com + second.inertia;
        LinkDynamics {
            shoulder: first.mass * first.com * first.com
                + first.inertia
                + second.mass * first.length * first.length
                + elbow,
            elbow,
            coupling: second.mass * first.length * second.com,
        }
    }

    /// The inertia matrix `M(q)` of (5), symmetric, kg m^2. A simulation takes its elements from `Arm::link_inertia`.
    pub fn inertia(&self, q2: f64) -> [[f64; 2]; 2] {
        let off = self.elbow + self.coupling * q2.cos();
        [[self.shoulder + 2.0 * self.coupling * q2.cos(), off], [off, self.elbow]]
    }

    /// The matrix `C(q, q')` of (6), for which `M' - 2C` is skew-symmetric, kg m^2/s. A simulation takes
    /// `C q'` from `Arm::coriolis_torque`.
    pub fn coriolis(&self, q2: f64, dq: [f64; 2]) -> [[f64; 2]; 2] {
        let factor = -self.coupling * q2.sin();
        [[factor * dq[1], factor * (dq[0] + dq[1])], [-factor * dq[0], 0.0]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINKS: [Link; 2] = [
        Link {
            mass: 1.5,
            length: 1.2,
            com: 0.5,
            inertia: 0.2,
        },
        Link {
            mass: 0.8,
            length: 0.9,
            com: 0.4,
            inertia: 0.1,
        },
    ];

    /// Kinetic energy from the two centres of mass in Cartesian coordinates.
    fn cartesian_energy(q: [f64; 2], dq: [f64; 2]) -> f64 {
        let [a, b] = LINKS;
        let w = dq[0] + dq[1];
        let v1 = a.com * dq[0];
        let (s1, c1) = q[0].sin_cos();
        let (s12, c12) = (q[0] + q[1]).sin_cos();
        let vx = -a.length * s1 * dq[0] - b.com * s12 * w;
        let vy = a.length * c1 * dq[0] + b.com * c12 * w;
        0.5 * (a.mass * v1 * v1 + a.inertia * dq[0] * dq[0] + b.mass * (vx * vx + vy * vy) + b.inertia * w * w)
    }

    #[test]
    fn the_quadratic_form_of_m_is_the_kinetic_energy_of_the_bodies() {
        let dynamics = LinkDynamics::new(&LINKS);
        for i in 0..50 {
            let q = [0.3 * i as f64, -0.7 * i as f64];
            let dq = [(i as f64).sin(), (1.7 * i as f64).cos()];
            let m = dynamics.inertia(q[1]);
            let form = 0.5 * (m[0][0] * dq[0] * dq[0] + 2.0 * m[0][1] * dq[0] * dq[1] + m[1][1] * dq[1] * dq[1]);
            assert!((form - cartesian_energy(q, dq)).abs() < 1e-14);
            assert!(m[0][0] > 0.0 && m[0][0] * m[1][1] - m[0][1] * m[1][0] > 0.0);
        }
    }

    #[test]
    fn m_dot_minus_two_c_is_skew_symmetric() {
        let dynamics = LinkDynamics::new(&LINKS);
        for i in 0..50 {
            let (q2, dq) = (0.37 * i as f64, [(i as f64).sin(), (0.6 * i as f64).cos()]);
            let h = 1e-5;
            let (ahead, behind) = (dynamics.inertia(q2 + h * dq[1]), dynamics.inertia(q2 - h * dq[1]));
            let c = dynamics.coriolis(q2, dq);
            let n = |i: usize, j: usize| (ahead[i][j] - behind[i][j]) / (2.0 * h) - 2.0 * c[i][j];
            assert!(n(0, 0).abs() < 1e-9 && n(1, 1).abs() < 1e-9);
            assert!((n(0, 1) + n(1, 0)).abs() < 1e-9);
        }
    }
}
