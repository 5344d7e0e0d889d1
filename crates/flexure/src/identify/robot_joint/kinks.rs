//! Kinks of velocities, where friction jumps.
//!
//! Smoothing rounds them off. What it removes follows from the equation of motion: the acceleration, integrated above the cut-off.

use super::joint_signals::JointSignals;
use super::motion::Motion;
use super::outcome::Effect;
use super::rests::{rests, silence};
use super::smooth::{Noise, Reflected};
use super::system::{Solved, Splines};

/// What smoothing with this cut-off removes from a velocity, according to an acceleration.
pub(super) fn kinks(
    velocity: &[f64],
    mut acceleration: Vec<f64>,
    resolution: f64,
    cut_off: f64,
    step: f64,
) -> Vec<f64> {
    // A body at rest does not accelerate, whatever the torque that its friction holds.
    silence(&mut acceleration, &rests(velocity, resolution, cut_off, step));
    Reflected::new(&acceleration, step).integral_above(cut_off)
}

/// What smoothing removes from the velocities of a flexible joint; empty where this is not known.
#[derive(Debug, Clone, Default)]
pub(super) struct Kinks {
    pub motor: Vec<f64>,
    pub link: Vec<f64>,
}

impl Kinks {
    /// The kinks that a solution of a joint's equations implies.
    pub fn new(joint: &JointSignals, motion: &Motion, solved: &Solved, splines: &[Splines]) -> Self {
        let system = joint.system();
        let factors = solved.factors();
        let n = joint.v.len();
        let value = |curve: usize, i: usize| {
            let (kind, splines) = (&system.curves[curve], &splines[curve]);
            kind.value(&splines.basis, solved.coefficients(curve), kind.x[i])
        };
        let beside_spring = joint.torque_of(&factors, [Effect::Damping, Effect::HystereticSpring], n);
        let on_link = joint.torque_of(&factors, [Effect::Gravity, Effect::Presliding], n);
        let elastic = |i: usize| value(0, i) + beside_spring[i];
        let inertia = factors[joint.link_factor()];
        let of_link = (0..n).map(|i| {
            (elastic(i) - value(1, i) - on_link[i] - motion.load.map_or(0.0, |load| load.torque[i])) / inertia
        });
        let kinks_of = |velocity: &[f64], acceleration: Vec<f64>, resolution: f64, noise: Noise| {
            kinks(velocity, acceleration, resolution, noise.cut_off(), motion.step)
        };
        let of_motor = joint.motor_velocity.as_ref().map(|velocity| {
            let inertia = motion.motor_inertia.map_or(factors[0], |known| known.value);
            let acceleration = (0..n).map(|i| (motion.torque[i] - elastic(i) - value(2, i)) / inertia);
            kinks_of(
                &velocity.v,
                acceleration.collect(),
                velocity.resolution,
                motion.motor_noise,
            )
        });
        Kinks {
            link: kinks_of(&joint.v, of_link.collect(), joint.resolution, motion.link_noise),
            motor: of_motor.unwrap_or_default(),
        }
    }
}

/// A velocity with kinks, if there are any.
pub(super) fn with_kinks(mut velocity: Vec<f64>, kinks: &[f64]) -> Vec<f64> {
    velocity.iter_mut().zip(kinks).for_each(|(v, kink)| *v += kink);
    velocity
}
