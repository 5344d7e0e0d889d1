//! The offset of the encoders' clocks from both equations of a flexible joint.
//!
//! The motor's equation determines the offset only as well as its torque is known (see [`clocks`](super::clocks)). The link's has no
//! torque in it and so none of its noise. With link samples that are late by sigma, and as the link's equation holds at every time,
//!
//! $$ \tau - J_m \ddot q_m - \kappa(d) = -\sigma\, \kappa'(d)\, \dot q, \qquad
//!    \kappa(d) - M \ddot q - f(\dot q) = -\sigma\, \kappa'(d)\, \dot q_m $$
//!
//! to first order. That is not a friction of the link's own velocity: beside the free curves the deflection's rate determines the
//! offset. A damping of the joint, which the model does not have, would be another torque of that rate: an offset that the
//! motor's equation excludes is not taken.

use super::clocks::{Clocks, Offset, SIGNIFICANT, SLOPE_STEP, tangent};
use super::fourier::Modulation;
use super::joint_signals::JointSignals;
use super::motion::Motion;
use super::smooth::Reflected;
use super::system::Splines;

/// Passes at most, and the last change in standard errors.
const PASSES: usize = 6;
const SETTLED: f64 = 0.05;

/// The same clocks with the link's offset from both equations; as they were where these do not determine it, or contradict each other.
pub(super) fn refined(motion: &Motion, modulation: &Modulation, clocks: Clocks) -> Clocks {
    let before = clocks.link_offset;
    // A motor's equation that excludes nothing has not distinguished stiffness from an offset either.
    if !(clocks.determined && before.standard_error.is_finite()) {
        return clocks;
    }
    let by_both = by_both(motion, modulation, &clocks).filter(|offset| {
        (offset.value - before.value).abs() < SIGNIFICANT * before.standard_error
            && offset.standard_error < before.standard_error
    });
    Clocks {
        link_offset: by_both.unwrap_or(before),
        ..clocks
    }
}

/// The offset by Gauss-Newton steps from the motor's.
fn by_both(motion: &Motion, modulation: &Modulation, clocks: &Clocks) -> Option<Offset> {
    let link = Reflected::new(motion.link, motion.step);
    let motor_velocity = Reflected::new(motion.motor, motion.step).velocity(motion.motor_noise.cut_off());
    let mut offset = clocks.link_offset.value;
    let mut noise = None;
    for pass in 0..PASSES {
        let joint = JointSignals::new(motion, modulation, clocks, &link.shifted(offset));
        let system = joint.system();
        let weights = match noise.take() {
            Some(noise) => noise,
            None => joint.free(motion)?.noise,
        };
        let tested = system.tested();
        let splines: Vec<&Splines> = tested.iter().collect();
        let solved = system.solve(&splines, &weights)?;
        let (d, basis) = (&joint.deflection.d, &tested[0].basis);
        let h = SLOPE_STEP * system.curves[0].largest();
        let slopes: Vec<f64> = d
            .iter()
            .map(|d| -tangent(basis, solved.coefficients(0), *d, h))
            .collect();
        let times = |v: &[f64]| -> Vec<f64> { slopes.iter().zip(v).map(|(slope, v)| slope * v).collect() };
        let late = [&joint.v, &motor_velocity].map(|v| Some(modulation.of(&times(v))));
        let at = solved.layout.len();
        let solved = solved.with_column(late.into())?;
        let covariance = solved.equations.robust(&solved.solution).covariance;
        let (change, error) = (solved.solution.x[at], covariance.error(at));
        if !(change.is_finite() && error > 0.0) {
            return None;
        }
        offset += change;
        if pass > 0 && change.abs() < SETTLED * error {
            return Some(Offset::new(offset, error, motion.step));
        }
        noise = Some(system.unbiased_noise_of(&solved));
    }
    None
}
