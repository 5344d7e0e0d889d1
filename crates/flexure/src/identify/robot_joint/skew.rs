//! The encoders' skew from both equations of a flexible joint.
//!
//! The motor's equation tells a skew as well as its torque is known (see [`alignment`](super::alignment)), the link's has no torque in
//! it and so none of its noise. With link samples that are late by sigma, and as the link's equation holds at every time,
//!
//! $$ \tau - J_m \ddot q_m - \kappa(d) = -\sigma\, \kappa'(d)\, \dot q, \qquad
//!    \kappa(d) - M \ddot q - f(\dot q) = -\sigma\, \kappa'(d)\, \dot q_m $$
//!
//! to first order. That is not a friction of the link's own velocity: beside the free curves the deflection's rate tells the skew.
//! A damping of the joint, of which the model has none, would be another torque of that rate: a skew that the motor's equation
//! excludes is not taken.

use super::alignment::{Alignment, SIGNIFICANT, is_more, tangent};
use super::equations::Equations;
use super::flexible::Motion;
use super::fourier::Modulation;
use super::pair::Pair;
use super::smooth::Reflected;

/// Passes at most, and the last change in standard errors.
const PASSES: usize = 6;
const SETTLED: f64 = 0.05;

/// The same clocks with the skew that both equations tell; as they were where they do not determine it, or contradict each other.
pub(super) fn refined(motion: &Motion, modulation: &Modulation, alignment: Alignment) -> Alignment {
    let (skew, error, _) = alignment.skew;
    // A motor's equation that excludes nothing has not told stiffness from skew either.
    if !(alignment.tells && error.is_finite()) {
        return alignment;
    }
    match by_both(motion, modulation, &alignment) {
        Some((refined, error_of_both)) if (refined - skew).abs() < SIGNIFICANT * error && error_of_both < error => {
            Alignment {
                skew: (refined, error_of_both, is_more(refined, error_of_both, motion.step)),
                ..alignment
            }
        }
        _ => alignment,
    }
}

/// The skew and its standard error, by Gauss-Newton steps from the motor's.
fn by_both(motion: &Motion, modulation: &Modulation, alignment: &Alignment) -> Option<(f64, f64)> {
    let link = Reflected::new(motion.link, motion.step);
    let motor_velocity = Reflected::new(motion.motor, motion.step).velocity(motion.motor_noise.cut_off());
    let mut skew = alignment.skew.0;
    let mut noise = None;
    for pass in 0..PASSES {
        let pair = Pair::new(motion, modulation, alignment, &link.shifted(skew));
        let weights = match noise.take() {
            Some(noise) => noise,
            None => pair.free(motion)?.noise,
        };
        let [stiffness, friction] = pair.tested();
        let curves = pair.both_with(&stiffness, &friction, &weights);
        let first = usize::from(pair.motor.is_some());
        let k = &curves.solve()?.x[first..first + stiffness.0.len()];
        let h = 1e-4 * pair.d.iter().fold(0.0_f64, |most, d| most.max(d.abs()));
        let slopes: Vec<f64> = pair.d.iter().map(|d| -tangent(&stiffness.0, k, *d, h)).collect();
        let times = |v: &[f64]| -> Vec<f64> { slopes.iter().zip(v).map(|(slope, v)| slope * v).collect() };
        let late = vec![
            Some(modulation.of(&times(&pair.v))),
            Some(modulation.of(&times(&motor_velocity))),
        ];
        let at = curves.columns.len();
        let equations = Equations {
            columns: curves.columns.into_iter().chain([late]).collect(),
            ..curves
        };
        let solution = equations.solve()?;
        let covariance = equations.robust(&solution).covariance;
        let (change, error) = (solution.x[at], covariance[at * (at + 1) + at].max(0.0).sqrt());
        if !(change.is_finite() && error > 0.0) {
            return None;
        }
        skew += change;
        if pass > 0 && change.abs() < SETTLED * error {
            return Some((skew, error));
        }
        noise = Some(pair.noise_of(&equations, &solution, stiffness.0.len()));
    }
    None
}
