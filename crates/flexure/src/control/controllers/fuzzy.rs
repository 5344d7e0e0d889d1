//! Fuzzy controllers in place of the rigid dynamics (Green & Sasiadek; Lee, Vukovich & Sasiadek): the links' error of angle and its rate,
//! in units of their scales, give a torque in units of its scale.
//!
//! Either input has the triangular sets negative large, negative small, zero, positive small, positive large around -1, -1/2, 0, 1/2, 1.
//! The rules are the usual table of Mac Vicar-Whelan: the consequent's index is the sum of the inputs'.
//!
//! - **Mamdani**: minimum for "and", maximum for rules of the same consequent, centre of gravity of the clipped triangles.
//! - **Takagi-Sugeno**: product for "and", consequents that are linear in both inputs, weighted mean (Takagi & Sugeno 1985).

use super::super::{Controller, Measured};
use super::adaptive::Slow;
use crate::error::{Error, Result};
use crate::manipulator::Arm;

/// The kind of inference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Inference {
    /// Fuzzy consequents.
    Mamdani,
    /// Linear consequents.
    TakagiSugeno,
}

/// The scales of a fuzzy controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FuzzyScales {
    /// The largest error of an angle, rad; beyond it the sets saturate.
    pub angle: f64,
    /// The largest error of a velocity, rad/s.
    pub velocity: f64,
    /// The largest torque of either joint, N m.
    pub torque: [f64; 2],
    /// The damping of the springs, N m s/rad.
    pub damping: f64,
}

impl FuzzyScales {
    /// Scales that work for the space arm at 100 Hz.
    pub fn space_arm() -> Self {
        FuzzyScales {
            angle: 0.2,
            velocity: 0.4,
            torque: [120.0, 40.0],
            damping: 30.0,
        }
    }
}

/// The number of sets of an input.
const SETS: usize = 5;

/// The memberships of a value in units of its scale; they sum to 1.
pub fn memberships(value: f64) -> [f64; SETS] {
    let value = value.clamp(-1.0, 1.0);
    std::array::from_fn(|i| (1.0 - 2.0 * (value - (0.5 * i as f64 - 1.0)).abs()).max(0.0))
}

/// The inferred output, -1 to 1, of two inputs in units of their scales.
///
/// ```
/// use flexure::control::controllers::{Inference, infer};
/// for inference in [Inference::Mamdani, Inference::TakagiSugeno] {
///     assert!(infer(inference, [0.0, 0.0]).abs() < 1e-12 && infer(inference, [0.4, 0.1]) > 0.1);
/// }
/// ```
pub fn infer(inference: Inference, inputs: [f64; 2]) -> f64 {
    let [angle, velocity] = inputs.map(memberships);
    match inference {
        Inference::TakagiSugeno => {
            let x = inputs.map(|v| v.clamp(-1.0, 1.0));
            let (mut sum, mut weights) = (0.0, 0.0);
            for (i, a) in angle.iter().enumerate() {
                for (j, v) in velocity.iter().enumerate() {
                    // Steeper near zero than far from it: large errors saturate.
                    let far = i.abs_diff(2).max(j.abs_diff(2)) as f64;
                    let slope = 1.0 - 0.2 * far;
                    sum += a * v * (slope * (x[0] + x[1])).clamp(-1.0, 1.0);
                    weights += a * v;
                }
            }
            sum / weights
        }
        Inference::Mamdani => {
            let mut strength = [0.0_f64; SETS];
            for (i, a) in angle.iter().enumerate() {
                for (j, v) in velocity.iter().enumerate() {
                    let consequent = (i + j).saturating_sub(2).min(SETS - 1);
                    strength[consequent] = strength[consequent].max(a.min(*v));
                }
            }
            // A triangle of half width 1/2 clipped at h has the area h (1 - h / 2); all are symmetric about their peaks.
            let (mut moment, mut area) = (0.0, 0.0);
            for (i, h) in strength.iter().enumerate() {
                let clipped = h * (1.0 - 0.5 * h);
                moment += clipped * (0.5 * i as f64 - 1.0);
                area += clipped;
            }
            moment / area
        }
    }
}

/// A fuzzy controller of the links.
#[derive(Debug, Clone, PartialEq)]
pub struct Fuzzy {
    slow: Slow,
    inference: Inference,
    scales: FuzzyScales,
}

impl Fuzzy {
    /// A controller of this inference for an arm.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a scale that is not positive and finite.
    pub fn new(model: &Arm, inference: Inference, scales: FuzzyScales) -> Result<Self> {
        let all = [scales.angle, scales.velocity, scales.torque[0], scales.torque[1]];
        if let Some(&scale) = all.iter().find(|v| !(**v > 0.0 && v.is_finite())) {
            return Err(Error::parameter(
                "a scale of the fuzzy controller",
                scale,
                "positive and finite",
            ));
        }
        Ok(Fuzzy {
            slow: Slow::new(model, scales.damping)?,
            inference,
            scales,
        })
    }
}

impl Controller for Fuzzy {
    fn torque(&mut self, measured: &Measured) -> [f64; 2] {
        let state = &measured.state;
        let damping = self.slow.spring_damping(measured);
        [0, 1].map(|i| {
            let wanted = measured.reference[i];
            let e = (wanted.value() - state.q[i]) / self.scales.angle;
            let de = (wanted.derivative(1) - state.dq[i]) / self.scales.velocity;
            self.scales.torque[i] * infer(self.inference, [e, de]) + damping[i]
        })
    }

    fn reset(&mut self) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The centre of gravity of the clipped triangles' envelope by components, against a sum over a grid of each clipped triangle.
    #[test]
    fn mamdani_is_the_centre_of_gravity_of_clipped_triangles() {
        for [a, b] in [[0.3, -0.1], [0.8, 0.9], [-0.2, 0.05], [-1.5, 0.2]] {
            let [angle, velocity] = [a, b].map(memberships);
            let (mut moment, mut area) = (0.0, 0.0);
            for k in 0..SETS {
                let mut h = 0.0_f64;
                for i in 0..SETS {
                    for j in 0..SETS {
                        if (i + j).saturating_sub(2).min(SETS - 1) == k {
                            h = h.max(angle[i].min(velocity[j]));
                        }
                    }
                }
                let peak = 0.5 * k as f64 - 1.0;
                for n in 0..40_000 {
                    let x = -2.0 + 1e-4 * (n as f64 + 0.5);
                    let height = (1.0 - 2.0 * (x - peak).abs()).max(0.0).min(h);
                    moment += x * height;
                    area += height;
                }
            }
            assert!((infer(Inference::Mamdani, [a, b]) - moment / area).abs() < 1e-6);
        }
    }

    #[test]
    fn inference_is_odd_and_grows_with_the_errors() {
        for inference in [Inference::Mamdani, Inference::TakagiSugeno] {
            let mut before = f64::NEG_INFINITY;
            for k in -20..=20 {
                let x = 0.05 * f64::from(k);
                let y = infer(inference, [x, 0.0]);
                assert!(
                    y >= before - 1e-12 && (y + infer(inference, [-x, 0.0])).abs() < 1e-12,
                    "{inference:?} {x}"
                );
                before = y;
            }
            assert_eq!(memberships(0.3).iter().sum::<f64>(), 1.0);
        }
    }
}
