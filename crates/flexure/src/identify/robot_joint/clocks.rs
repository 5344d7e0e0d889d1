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
use super::column_noise::{AbscissaNoise, Noisy};
use super::compliance::Compliance;
use super::division::STIFFNESS;
use super::equations::{Column, Lines};
use super::fourier::Modulation;
use super::joint_signals::of_inertia;
use super::motion::Motion;
use super::smooth::Reflected;
use super::system::{Curve, CurveKind, Splines, System};
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
pub(super) const NEGLIGIBLE: f64 = 0.03;
/// A torque held from sample to sample is late by half a sample, within this share of one.
const HELD_WITHIN: f64 = 0.15;
/// Half the distance of the points between which a slope of the stiffness curve is taken, as a share of the largest deflection.
const SLOPE_STEP: f64 = 1e-4;

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

/// The equation of a pass.
struct Pass<'a> {
    motion: &'a Motion<'a>,
    modulation: &'a Modulation,
    torque: Lines,
    rate: Lines,
    motor: Lines,
    encoder: Vec<f64>,
}

/// A stiffness curve.
struct Stiffness {
    basis: Basis,
    coefficients: Vec<f64>,
}

impl Pass<'_> {
    /// The number of the torque's delay among the factors; that of the link's offset is the next one.
    fn delay_factor(&self) -> usize {
        usize::from(self.motion.motor_inertia.is_none())
    }

    /// The motor's equation with the delay, and the offset where a curve is known.
    fn system<'b>(&'b self, d: &'b [f64], v: &[f64], curve: Option<&Stiffness>) -> System<'b> {
        let mut right = self.torque.clone();
        if let Some(known) = self.motion.motor_inertia {
            right.iter_mut().zip(&self.motor).for_each(|(r, m)| *r -= m * known);
        }
        let unknown = self.motion.motor_inertia.is_none();
        let mut factors: Vec<Column> = Vec::new();
        factors.extend(unknown.then(|| vec![Some(self.motor.clone())]));
        factors.push(vec![Some(self.rate.clone())]);
        factors.extend(curve.map(|curve| {
            let h = SLOPE_STEP * d.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
            let slopes = d
                .iter()
                .zip(v)
                .map(|(&d, v)| tangent(&curve.basis, &curve.coefficients, d, h) * v);
            vec![Some(self.modulation.of(&slopes.collect::<Vec<_>>()))]
        }));
        System {
            modulation: self.modulation,
            right: vec![right],
            noisy: unknown
                .then(|| Noisy::square(0, 0, &self.encoder))
                .into_iter()
                .collect(),
            encoder_noise: Box::new(|x| vec![of_inertia(&self.encoder, self.motion.motor_inertia.unwrap_or(x[0]))]),
            curves: vec![Curve {
                kind: CurveKind::Stiffness,
                x: d,
                signs: vec![1.0],
                noise: AbscissaNoise::default(),
                resolution: 0.0,
                division: &STIFFNESS,
                after: factors.len(),
            }],
            factors,
        }
    }
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
    let squared = |w: &f64| (motion.rotor_sd() * w * w).powi(2);
    let equation = Pass {
        torque: modulation.of(motion.torque),
        rate: modulation.of_rate(motion.torque),
        motor: motion.rotor_acceleration(modulation),
        encoder: modulation.omega.iter().map(squared).collect(),
        motion,
        modulation,
    };
    let mut noise = vec![vec![1.0; modulation.len()]];
    // A motion of few reversals takes a curved friction for a late clock.
    let mut determined = true;
    // Beside an offset the deflection of a stiff joint is too small for the first passes to find their way.
    let stiff = motion.compliance(modulation).filter(Compliance::is_stiff);
    let mut offset = stiff.map_or(0.0, |found| found.link_offset.value);
    let (mut error, mut delay) = (f64::INFINITY, (0.0, f64::INFINITY));
    let mut curve: Option<Stiffness> = None;
    for pass in 0..PASSES {
        let q = if offset == 0.0 {
            motion.link.to_vec()
        } else {
            link.shifted(offset)
        };
        let d = motion.deflection(&q).d;
        let v = Reflected::new(&q, step).velocity(motion.link_noise.cut_off());
        determined &= checks::motion(&v, 0.0).is_none();
        let system = equation.system(&d, &v, curve.as_ref());
        let splines: Splines = system.curves[0].splines(modulation, PIECES);
        let solved = system.solve(&[&splines], &noise)?;
        let covariance = solved.equations.robust(&solved.solution).covariance;
        let (x, at) = (&solved.solution.x, equation.delay_factor());
        delay = (x[at], covariance.error(at));
        let settled = curve.is_some() && {
            let change = x[at + 1];
            offset -= change.clamp(-LONGEST_STEP * step, LONGEST_STEP * step);
            error = covariance.error(at + 1);
            pass > 1 && change.abs() < SETTLED * error
        };
        curve = Some(Stiffness {
            coefficients: solved.coefficients(0).to_vec(),
            basis: splines.basis.clone(),
        });
        let next = system.noise_of(&solved);
        noise = next;
        if settled {
            break;
        }
    }
    let offset_of = |value: f64, error: f64| {
        let offset = Offset::new(value, error, step);
        Offset {
            significant: determined && offset.significant,
            ..offset
        }
    };
    let torque_delay = offset_of(delay.0, delay.1);
    Some(Clocks {
        link_offset: offset_of(offset, error),
        torque_held: determined && torque_delay.is_hold(step),
        torque_delay,
        determined,
    })
}

impl Clocks {
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
