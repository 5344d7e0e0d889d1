//! A joint's torque laws: stiffness with soft wind-up (10)-(11), and friction (12).

use serde::{Deserialize, Serialize};

/// Steps of Newton's method; starting from the linear solution, a hardening spring needs at most a dozen.
const NEWTON_STEPS: usize = 60;

/// The elastic torque of a joint against its deflection `d = qm - q`, equations (10)-(11):
///
/// \\[\kappa(d) = a_1 d^3 + a_2 d - k_{sw} e^{-a_{sw} d^2} d\\]
///
/// A linear joint has `linear = k` and nothing else.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stiffness {
    /// `a1`, N m/rad^3.
    pub cubic: f64,
    /// `a2`, N m/rad.
    pub linear: f64,
    /// `ksw`, the depth of the soft wind-up, N m/rad.
    pub windup: f64,
    /// `asw`, its sharpness, 1/rad^2.
    pub windup_sharpness: f64,
}

impl Stiffness {
    /// The elastic torque, N m.
    pub fn torque(&self, d: f64) -> f64 {
        let softening = self.windup * (-self.windup_sharpness * d * d).exp();
        d * (self.cubic * d * d + self.linear - softening)
    }

    /// The slope of the elastic torque, N m/rad.
    pub fn tangent(&self, d: f64) -> f64 {
        let z = self.windup_sharpness * d * d;
        3.0 * self.cubic * d * d + self.linear - self.windup * (-z).exp() * (1.0 - 2.0 * z)
    }

    /// The deflection at which the spring has this elastic torque; `None` if the spring does not harden throughout.
    pub(crate) fn deflection(&self, torque: f64) -> Option<f64> {
        // The slope of the torque is at least that of the weakest tangent; bisection safeguards Newton's steps.
        let softest = self.linear - self.windup;
        if !(softest > 0.0 && torque.is_finite()) {
            return None;
        }
        let (mut low, mut high) = (-torque.abs() / softest, torque.abs() / softest);
        let mut d = torque / self.linear;
        for _ in 0..NEWTON_STEPS {
            let excess = self.torque(d) - torque;
            match excess > 0.0 {
                true => high = d,
                false => low = d,
            }
            let next = d - excess / self.tangent(d);
            let next = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
            if (next - d).abs() <= 1e-16 * d.abs() {
                break;
            }
            d = next;
        }
        Some(d)
    }

    /// The elastic energy, J, zero at `d = 0`: the integral of the torque,
    /// \\(a_1 d^4/4 + a_2 d^2/2 - k_{sw} (1 - e^{-a_{sw} d^2}) / (2 a_{sw})\\).
    pub fn potential(&self, d: f64) -> f64 {
        let d2 = d * d;
        let z = self.windup_sharpness * d2;
        // (1 - exp(-z)) / (2 asw), which tends to d^2/2 as asw tends to 0.
        let softened = if z < 1e-300 {
            0.5 * d2
        } else {
            -(-z).exp_m1() / (2.0 * self.windup_sharpness)
        };
        0.25 * self.cubic * d2 * d2 + 0.5 * self.linear * d2 - self.windup * softened
    }
}

/// The friction torque of a joint against its velocity, equation (12):
///
/// \\[f(v) = g_1 [\tanh(g_2 v) - \tanh(g_3 v)] + g_4 \tanh(g_5 v) + g_6 v\\]
///
/// `g1` (N m), `g2` and `g3` (s/rad) give the static and Stribeck friction, `g4` (N m) and `g5` (s/rad) the Coulomb friction, `g6` (N m
/// s/rad) the viscous friction. It never drives the joint when `g2 >= g3`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Friction(
    /// `g1 .. g6`.
    pub [f64; 6],
);

impl Friction {
    /// The friction torque, N m; it has the sign of the velocity.
    pub fn torque(&self, v: f64) -> f64 {
        let [g1, g2, g3, g4, g5, g6] = self.0;
        g1 * ((g2 * v).tanh() - (g3 * v).tanh()) + g4 * (g5 * v).tanh() + g6 * v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STIFFNESS: Stiffness = Stiffness {
        cubic: 500.0,
        linear: 500.0,
        windup: 10.0,
        windup_sharpness: 3000.0,
    };

    #[test]
    fn torque_is_the_slope_of_the_potential_and_tangent_that_of_the_torque() {
        for i in -40..=40 {
            let (d, h) = (0.005 * i as f64, 1e-5);
            let slope = (STIFFNESS.potential(d + h) - STIFFNESS.potential(d - h)) / (2.0 * h);
            assert!((slope - STIFFNESS.torque(d)).abs() < 1e-5, "{d}");
            let slope = (STIFFNESS.torque(d + h) - STIFFNESS.torque(d - h)) / (2.0 * h);
            assert!((slope - STIFFNESS.tangent(d)).abs() < 1e-4, "{d}");
        }
        assert_eq!(STIFFNESS.tangent(0.0), 490.0);
        assert_eq!(STIFFNESS.potential(0.0), 0.0);
    }

    #[test]
    fn friction_has_its_breakaway_and_its_viscous_end() {
        let f = Friction([0.5, 150.0, 50.0, 2.0, 100.0, 0.5]);
        assert_eq!(f.torque(0.0), 0.0);
        assert_eq!(f.torque(-0.3), -f.torque(0.3));
        assert!((f.torque(10.0) - 7.0).abs() < 1e-12); // g4 + 10 g6
        let stribeck = Friction([0.5, 150.0, 50.0, 0.0, 0.0, 0.0]);
        assert!(stribeck.torque(0.01) > 0.2 && stribeck.torque(0.2) < 1e-6);
    }
}
