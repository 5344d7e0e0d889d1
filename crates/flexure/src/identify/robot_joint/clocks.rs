//! The clocks of torque, motor and link, from the motor's equation.
//!
//! With the torque late by delta and the link's angle by sigma, to first order
//!
//! $$ \tau - J_m \ddot q_m - \kappa(d) = \delta \dot\tau - \Delta\sigma\, \kappa'(d) \dot q, $$
//!
//! so both follow by least squares beside the free stiffness curve. An offset between the encoders' clocks is a deflection
//! proportional to the velocity, which here only the torque distinguishes from stiffness and friction. Both equations of a joint
//! determine it far better ([`clock_offset`](super::clock_offset)).

use super::basis::Basis;
use super::checks;
use super::column_noise::AbscissaNoise;
use super::compliance::Compliance;
use super::equations::Lines;
use super::fourier::Modulation;
use super::joint_signals::{JointSignals, of_inertia};
use super::motion::Motion;
use super::smooth::Reflected;
use super::system::System;
use crate::linalg::Complex;

/// Passes at most.
const PASSES: usize = 8;
/// The last change in standard errors.
const SETTLED: f64 = 0.05;
/// Intervals on either side of zero of the stiffness curve meanwhile.
const PIECES: usize = 8;
/// The longest step of the link's offset in samples: a longer one leaves the linear range.
const LONGEST_STEP: f64 = 20.0;
/// An offset of less than so many standard errors is taken as zero.
pub(super) const SIGNIFICANT: f64 = 4.0;
/// So is one below this share of a sample.
const NEGLIGIBLE: f64 = 0.03;
/// A torque held from sample to sample is late by half a sample, within this share of one.
const HELD_WITHIN: f64 = 0.15;
/// Half the distance of the points between which a slope of the stiffness curve is taken, as a share of the largest deflection.
pub(super) const SLOPE_STEP: f64 = 1e-4;

/// The time by which a signal's samples are late.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Offset {
    /// In s.
    pub value: f64,
    pub standard_error: f64,
    /// Whether it is more than chance and no tiny part of a sample.
    pub significant: bool,
}

impl Offset {
    const NONE: Offset = Offset {
        value: 0.0,
        standard_error: 0.0,
        significant: false,
    };

    /// With this sample time.
    pub fn new(value: f64, standard_error: f64, step: f64) -> Self {
        Offset {
            value,
            standard_error,
            significant: value.abs() > SIGNIFICANT * standard_error && value.abs() > NEGLIGIBLE * step,
        }
    }

    /// Whether it is the delay of a torque that is held from sample to sample.
    pub fn is_hold(&self, step: f64) -> bool {
        self.value.abs() > SIGNIFICANT * self.standard_error
            && (self.value - 0.5 * step).abs() < HELD_WITHIN * step
            && self.standard_error < HELD_WITHIN * step
    }
}

/// The clocks of a flexible joint's log, relative to the motor's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Clocks {
    /// The offset of the link's samples.
    pub link_offset: Offset,
    /// The time from a torque's sample to its effect.
    pub torque_delay: Offset,
    /// Whether that is the half sample of a held torque.
    pub torque_held: bool,
    /// Whether the motion reverses often enough to determine the clocks at all.
    pub determined: bool,
}

/// A stiffness curve.
struct Stiffness {
    basis: Basis,
    coefficients: Vec<f64>,
}

impl Stiffness {
    /// The transformed torque $\kappa'(d)\, \dot q$.
    fn slopes(&self, joint: &JointSignals) -> Lines {
        let d = &joint.deflection.d;
        let h = SLOPE_STEP * d.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
        let slope = |d: f64| tangent(&self.basis, &self.coefficients, d, h);
        let slopes: Vec<f64> = d.iter().zip(&joint.v).map(|(&d, v)| slope(d) * v).collect();
        joint.modulation.of(&slopes)
    }
}

/// The motor's equation with the torque's delay as a factor after its inertia, and then the link's offset where a curve is known.
fn delayed_system<'a>(
    motion: &'a Motion,
    joint: &'a JointSignals,
    rate: &Lines,
    curve: Option<&Stiffness>,
) -> System<'a> {
    let mut system = joint.motor_system();
    system.factors.push(vec![Some(rate.clone())]);
    system
        .factors
        .extend(curve.map(|curve| vec![Some(curve.slopes(joint))]));
    system.encoder_noise = Box::new(move |x| {
        let inertia = motion.motor_inertia.unwrap_or(x[0]);
        vec![of_inertia(&joint.encoder[0], inertia)]
    });
    system.curves[0].noise = AbscissaNoise::default();
    system.curves[0].after = system.factors.len();
    system
}

/// kappa'(d) by central differences within the range of the basis.
pub(super) fn tangent(basis: &Basis, coefficients: &[f64], d: f64, h: f64) -> f64 {
    let kappa = |d: f64| basis.value(coefficients, d) * d;
    (kappa(d + h) - kappa(d - h)) / (2.0 * h)
}

/// Finds the clocks; `None` if the motor's equation does not determine them.
pub(super) fn clocks(motion: &Motion, modulation: &Modulation) -> Option<Clocks> {
    let step = motion.step;
    let link = Reflected::new(motion.link, step);
    let rate = modulation.of_rate(motion.torque);
    // The number of the torque's delay among the unknowns; that of the link's offset is the next one.
    let delay_at = usize::from(motion.motor_inertia.is_none());
    let mut noise = vec![vec![1.0; modulation.len()]];
    // A motion of few reversals takes a curved friction for a late clock.
    let mut determined = true;
    // Beside an offset the deflection of a stiff joint is too small for the first passes to find their way.
    let stiff = motion.compliance(modulation).filter(Compliance::is_stiff);
    let mut offset = stiff.map_or(0.0, |found| found.link_offset.value);
    let (mut offset_error, mut delay, mut delay_error) = (f64::INFINITY, 0.0, f64::INFINITY);
    let mut curve: Option<Stiffness> = None;
    for pass in 0..PASSES {
        let q = match offset == 0.0 {
            true => motion.link.to_vec(),
            false => link.shifted(offset),
        };
        let joint = JointSignals::new(motion, modulation, &Clocks::ALIKE, &q);
        determined &= checks::motion(&joint.v, 0.0).is_none();
        let system = delayed_system(motion, &joint, &rate, curve.as_ref());
        let splines = system.curves[0].splines(modulation, PIECES);
        let solved = system.solve(&[&splines], &noise)?;
        let covariance = solved.equations.robust(&solved.solution).covariance;
        let x = &solved.solution.x;
        (delay, delay_error) = (x[delay_at], covariance.error(delay_at));
        let settled = curve.is_some() && {
            let change = x[delay_at + 1];
            offset -= change.clamp(-LONGEST_STEP * step, LONGEST_STEP * step);
            offset_error = covariance.error(delay_at + 1);
            pass > 1 && change.abs() < SETTLED * offset_error
        };
        curve = Some(Stiffness {
            coefficients: solved.coefficients(0).to_vec(),
            basis: splines.basis.clone(),
        });
        noise = system.noise_of(&solved);
        if settled {
            break;
        }
    }
    let offset_of = |value: f64, error: f64| {
        let offset = Offset::new(value, error, step);
        let significant = determined && offset.significant;
        Offset { significant, ..offset }
    };
    let torque_delay = offset_of(delay, delay_error);
    Some(Clocks {
        link_offset: offset_of(offset, offset_error),
        torque_held: determined && torque_delay.is_hold(step),
        torque_delay,
        determined,
    })
}

impl Clocks {
    /// All samples of the same instants.
    const ALIKE: Clocks = Clocks {
        link_offset: Offset::NONE,
        torque_delay: Offset::NONE,
        torque_held: false,
        determined: false,
    };

    /// The link's angle on the motor's clock.
    pub fn link(&self, motion: &Motion) -> Vec<f64> {
        match self.link_offset.significant {
            true => Reflected::new(motion.link, motion.step).shifted(self.link_offset.value),
            false => motion.link.to_vec(),
        }
    }

    /// The transformed torque at the time of its effect.
    pub fn torque(&self, modulation: &Modulation, torque: &[f64], step: f64) -> Lines {
        if self.torque_held {
            held(modulation, torque, step)
        } else if self.torque_delay.significant {
            shifted(modulation, torque, self.torque_delay.value)
        } else {
            modulation.of(torque)
        }
    }
}

/// A transformed torque that acts `delay` after its sample.
fn shifted(modulation: &Modulation, torque: &[f64], delay: f64) -> Lines {
    let lines = modulation.of(torque).into_iter().zip(&modulation.omega);
    lines.map(|(v, w)| v * Complex::new(0.0, -w * delay).exp()).collect()
}

/// A transformed torque that is held from sample to sample: late by half a sample, with a hold's gain.
pub(super) fn held(modulation: &Modulation, torque: &[f64], step: f64) -> Lines {
    let lines = shifted(modulation, torque, 0.5 * step)
        .into_iter()
        .zip(&modulation.omega);
    lines
        .map(|(v, w)| {
            let half = 0.5 * w * step;
            if half > 0.0 { v * (half.sin() / half) } else { v }
        })
        .collect()
}
