//! The clocks of torque, motor and link, from the equations of motion.
//!
//! With the torque late by delta and the link's angle by sigma, the motor's equation is to first order
//!
//! $$ \tau - J_m \ddot q_m - \kappa(d) = \delta \dot\tau - \sigma\, \kappa'(d)\, \dot q, $$
//!
//! so for an arm's joints both follow by least squares, together with the free stiffness curve ([`of_motor`]). For a single joint they
//! follow from both equations, together with other effects ([`explanations`](super::explanations)).

use super::basis::Basis;
use super::checks;
use super::clock_offset::{ClockOffset, Clocks};
use super::compliance::Compliance;
use super::equations::Lines;
use super::fourier::Modulation;
use super::joint_signals::{JointSignals, of_inertia};
use super::kinks::Kinks;
use super::limits::{CLOCK_PASSES_BY_MOTOR, CLOCK_PIECES, CLOCKS_SETTLED, LONGEST_CLOCK_STEP, STIFFNESS_SLOPE_STEP};
use super::motion::Motion;
use super::smooth::Reflected;
use super::system::System;

/// A stiffness curve.
#[derive(Clone)]
pub(super) struct Stiffness {
    pub basis: Basis,
    pub coefficients: Vec<f64>,
}

impl Stiffness {
    /// The slopes $\kappa'(d)$ at every sample, by central differences within the range of the basis.
    pub fn slopes(&self, d: &[f64]) -> Vec<f64> {
        let h = STIFFNESS_SLOPE_STEP * d.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
        let kappa = |d: f64| self.basis.value(&self.coefficients, d) * d;
        d.iter().map(|d| (kappa(d + h) - kappa(d - h)) / (2.0 * h)).collect()
    }
}

/// The transformed product of two signals.
fn product(modulation: &Modulation, a: &[f64], b: &[f64]) -> Lines {
    modulation.of(&a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<f64>>())
}

/// The motor's equation with the torque's delay as a factor after its inertia, and then the link's offset, if a curve is known.
fn delayed_system<'a>(
    motion: &'a Motion,
    joint: &'a JointSignals,
    rate: &Lines,
    curve: Option<&Stiffness>,
) -> System<'a> {
    let mut system = joint.motor_system();
    let offset = curve.map(|curve| product(joint.modulation, &curve.slopes(&joint.deflection.d), &joint.v));
    let unknown = [rate.clone()].into_iter().chain(offset);
    system.factors.extend(unknown.map(|lines| vec![Some(lines)]));
    system.encoder_noise = Box::new(move |x| {
        let inertia = motion.motor_inertia.map_or(x[0], |known| known.value);
        vec![of_inertia(&joint.encoder[0], inertia)]
    });
    system.curves[0].noise = Vec::new();
    system.curves[0].after = system.factors.len();
    system
}

/// The clocks by the motor's equation; `None` if it does not determine them.
pub(super) fn of_motor(motion: &Motion, modulation: &Modulation) -> Option<Clocks> {
    let step = motion.step;
    let link = Reflected::new(motion.link, step);
    let rate = modulation.of_rate(motion.torque);
    // The number of the torque's delay among the unknowns; the link's offset is the next one.
    let delay_at = usize::from(motion.motor_inertia.is_none());
    let mut noise = vec![vec![1.0; modulation.len()]];
    // With few reversals, a curved friction looks like a late clock.
    let mut determined = true;
    // The deflection of a stiff joint is small compared with an offset, so the first passes would not converge.
    let stiff = motion.compliance(modulation).filter(Compliance::is_stiff);
    let mut offset = stiff.map_or(0.0, |found| found.link_offset.value);
    let (mut offset_error, mut delay, mut delay_error) = (f64::INFINITY, 0.0, f64::INFINITY);
    let mut curve: Option<Stiffness> = None;
    for pass in 0..CLOCK_PASSES_BY_MOTOR {
        let q = match offset == 0.0 {
            true => motion.link.to_vec(),
            false => link.shifted(offset),
        };
        let joint = JointSignals::new(motion, modulation, modulation.of(motion.torque), &q, &Kinks::default());
        determined &= checks::motion(&joint.v, 0.0).is_none();
        let system = delayed_system(motion, &joint, &rate, curve.as_ref());
        let splines = system.curves[0].splines(modulation, CLOCK_PIECES);
        let solved = system.solve(&[&splines], &noise)?;
        let covariance = solved.equations.robust(&solved.solution).covariance;
        let x = &solved.solution.x;
        (delay, delay_error) = (x[delay_at], covariance.error(delay_at));
        let settled = curve.is_some() && {
            let change = x[delay_at + 1];
            offset -= change.clamp(-LONGEST_CLOCK_STEP * step, LONGEST_CLOCK_STEP * step);
            offset_error = covariance.error(delay_at + 1);
            pass > 1 && change.abs() < CLOCKS_SETTLED * offset_error
        };
        let coefficients = solved.coefficients(0).to_vec();
        noise = system.noise_of(&solved);
        curve = Some(Stiffness {
            basis: splines.basis,
            coefficients,
        });
        if settled {
            break;
        }
    }
    let offset_of = |value: f64, error: f64| {
        let offset = ClockOffset::new(value, error, step);
        let significant = determined && offset.significant;
        ClockOffset { significant, ..offset }
    };
    let torque_delay = offset_of(delay, delay_error);
    Some(Clocks {
        link_offset: offset_of(offset, offset_error),
        torque_held: determined && torque_delay.is_hold(step),
        torque_delay,
        determined,
    })
}
