//! Uniform beams, the links that bend.

use super::problem::ChainProblem;

/// `beta L` of the first mode of a clamped-free beam: the first root of `cos b cosh b = -1`.
const CLAMPED: f64 = 1.875_104_068_711_961;

/// A uniform slender beam (Euler and Bernoulli). It neither shears nor twists.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// The length, m; positive.
    pub length: f64,
    /// The bending stiffness EI, N m^2; positive.
    pub stiffness: f64,
    /// The mass per length, kg/m; positive.
    pub density: f64,
    /// The damping ratio of the first mode of the beam clamped at its root, without a load; not negative. The bending moment is
    /// \\(EI (w'' + T \dot w'')\\) (Kelvin and Voigt), so that the damping ratio of a mode is proportional to its frequency.
    pub damping: f64,
}

impl Beam {
    /// The circular frequency of the first mode of the beam clamped at its root, rad/s.
    pub fn clamped_frequency(&self) -> f64 {
        CLAMPED.powi(2) * (self.stiffness / self.density).sqrt() / self.length.powi(2)
    }

    /// The time T of Kelvin and Voigt's damping, s: moments grow by T times the rate of the curvature's share.
    pub fn damping_time(&self) -> f64 {
        2.0 * self.damping / self.clamped_frequency()
    }

    /// Checks every value against its range.
    pub(in crate::manipulator) fn check(&self) -> std::result::Result<(), ChainProblem> {
        let wrong = |quantity, value, requirement| ChainProblem::Number {
            quantity,
            value,
            requirement,
        };
        for (quantity, value) in [
            ("the length of its beam, m,", self.length),
            ("the stiffness of its beam, N m^2,", self.stiffness),
            ("the density of its beam, kg/m,", self.density),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(wrong(quantity, value, "positive and finite"));
            }
        }
        if !(self.damping >= 0.0 && self.damping.is_finite()) {
            return Err(wrong(
                "the damping of its beam",
                self.damping,
                "finite and not negative",
            ));
        }
        Ok(())
    }
}
