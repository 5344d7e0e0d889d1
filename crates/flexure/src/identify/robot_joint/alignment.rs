//! The clocks of torque, motor and link, from the motor's equation.
//!
//! With the torque late by delta and the link's angle by sigma, to first order
//!
//! $$ \tau - J_m \ddot q_m - \kappa(d) = \delta \dot\tau - \Delta\sigma\, \kappa'(d) \dot q, $$
//!
//! so both follow by least squares beside the free stiffness curve. A skew of the encoders is a deflection
//! proportional to the velocity, which here the torque alone tells from stiffness and friction; of one joint both equations tell it
//! far better ([`skew`](super::skew)).

use super::basis::Basis;
use super::checks;
use super::compliance::Compliance;
use super::equations::{Column, Equations, NoiseModel, Solution};
use super::flexible::Motion;
use super::fourier::Modulation;
use super::noisy::Noisy;
use super::smooth::Reflected;
use crate::linalg::Complex;

/// Passes at most.
const PASSES: usize = 8;
/// Intervals on either side of zero of the stiffness curve meanwhile.
const PIECES: usize = 8;
/// Offsets below so many standard errors are none.
pub(super) const SIGNIFICANT: f64 = 4.0;
/// Offsets below this share of a sample are none.
pub(super) const NEGLIGIBLE: f64 = 0.03;
/// A torque held from sample to sample is late by half a sample, within this share of one.
const HELD_WITHIN: f64 = 0.15;

/// The clocks of a flexible joint's log, relative to the motor's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Alignment {
    /// The time by which the link's samples are late, s, its standard error, and whether it is more than chance.
    pub skew: (f64, f64, bool),
    /// The time from a torque's sample to its effect, s, and whether it is more than chance.
    pub delay: (f64, bool),
    /// Whether that is the half sample of a held torque.
    pub held: bool,
    /// Whether the motion reverses often enough to tell clocks at all.
    pub tells: bool,
}

/// The free stiffness curve's columns `B_j(d) d`, transformed.
pub(super) fn stiffness_columns(modulation: &Modulation, basis: &Basis, d: &[f64]) -> Vec<Vec<Complex<f64>>> {
    modulation.of_all(&basis.columns(d, |d| d))
}

/// kappa'(d) by central differences within the range of the basis.
pub(super) fn tangent(basis: &Basis, coefficients: &[f64], d: f64, h: f64) -> f64 {
    let kappa = |d: f64| basis.value(coefficients, d) * d;
    (kappa(d + h) - kappa(d - h)) / (2.0 * h)
}

/// Finds the clocks; `None` if the motor's equation does not determine them.
pub(super) fn align(motion: &Motion, modulation: &Modulation) -> Option<Alignment> {
    let step = motion.step;
    let link = Reflected::new(motion.link, step);
    let torque = modulation.of(motion.torque);
    let rate = modulation.of_rate(motion.torque);
    let motor = motion.rotor_acceleration(modulation);
    let encoder: Vec<f64> = modulation
        .omega
        .iter()
        .map(|w| (motion.rotor_sd() * w * w).powi(2))
        .collect();
    let mut noise = vec![1.0; modulation.len()];
    // A motion of few reversals takes a curved friction for a late clock.
    let mut tells = true;
    // Beside a skew the deflection of a stiff joint is too small for the first passes to find their way.
    let stiff = motion.compliance(modulation).filter(Compliance::is_stiff);
    let mut skew = stiff.map_or(0.0, |found| found.skew.0);
    let (mut skew_error, mut delay) = (f64::INFINITY, (0.0, f64::INFINITY));
    let mut curve: Option<(Basis, Vec<f64>)> = None;
    for pass in 0..PASSES {
        let q = if skew == 0.0 {
            motion.link.to_vec()
        } else {
            link.shifted(skew)
        };
        let d = motion.deflection(&q).d;
        let v = Reflected::new(&q, step).velocity(motion.link_noise.cut_off());
        tells &= checks::motion(&v, 0.0).is_none();
        let mut columns: Vec<Column> = vec![vec![Some(motor.clone())], vec![Some(rate.clone())]];
        let mut right = torque.clone();
        if let Some(known) = motion.motor_inertia {
            columns.remove(0);
            right.iter_mut().zip(&motor).for_each(|(r, m)| *r -= m * known);
        }
        let delay_at = columns.len() - 1;
        if let Some((basis, c)) = &curve {
            let h = 1e-4 * (d.iter().fold(0.0_f64, |m, d| m.max(d.abs())));
            let slope: Vec<f64> = d.iter().zip(&v).map(|(&d, v)| tangent(basis, c, d, h) * v).collect();
            columns.push(vec![Some(modulation.of(&slope))]);
        }
        let first = columns.len();
        let basis = Basis::stiffness(&d, PIECES);
        columns.extend(
            stiffness_columns(modulation, &basis, &d)
                .into_iter()
                .map(|c| vec![Some(c)]),
        );
        let equations = Equations {
            columns,
            right: vec![right],
            noise: vec![&noise],
            noisy: motion
                .motor_inertia
                .is_none()
                .then_some(Noisy {
                    columns: [0, 0],
                    block: 0,
                    lines: &encoder,
                    factor: 1.0,
                })
                .into_iter()
                .collect(),
        };
        let solution: Solution = equations.solve()?;
        let covariance = equations.robust(&solution).covariance;
        let inertia = motion.motor_inertia.unwrap_or(solution.x[0]);
        let known: Vec<f64> = encoder.iter().map(|e| inertia * inertia * e).collect();
        noise = NoiseModel::fit(&solution.residuals[0], &known).lines;
        let error = |i: usize| covariance[i * solution.x.len() + i].max(0.0).sqrt();
        delay = (solution.x[delay_at], error(delay_at));
        let settled = match curve {
            None => false,
            Some(_) => {
                let change = solution.x[delay_at + 1];
                // A step of more than a few samples leaves the linear range.
                skew -= change.clamp(-20.0 * step, 20.0 * step);
                skew_error = error(delay_at + 1);
                pass > 1 && change.abs() < 0.05 * skew_error
            }
        };
        curve = Some((basis, solution.x[first..].to_vec()));
        if settled {
            break;
        }
    }
    let matters = |value: f64, error: f64| tells && is_more(value, error, step);
    Some(Alignment {
        skew: (skew, skew_error, matters(skew, skew_error)),
        delay: (delay.0, matters(delay.0, delay.1)),
        tells,
        held: tells && is_held(delay.0, delay.1, step),
    })
}

impl Alignment {
    /// The torque's integrals at the time of its effect.
    pub fn torque(&self, modulation: &Modulation, torque: &[f64], step: f64) -> Vec<Complex<f64>> {
        match (self.held, self.delay) {
            (true, _) => held(modulation, torque, step),
            (false, (delay, true)) => shifted(modulation, torque, delay),
            (false, _) => modulation.of(torque),
        }
    }
}

/// Whether an offset with this standard error, s, is more than chance and no tiny part of a sample.
pub(super) fn is_more(value: f64, error: f64, step: f64) -> bool {
    value.abs() > SIGNIFICANT * error && value.abs() > NEGLIGIBLE * step
}

/// Whether a delay is that of a torque held from sample to sample.
pub(super) fn is_held(delay: f64, error: f64, step: f64) -> bool {
    delay.abs() > SIGNIFICANT * error && (delay - 0.5 * step).abs() < HELD_WITHIN * step && error < HELD_WITHIN * step
}

/// The integrals of a torque that acts `delay` after its sample.
fn shifted(modulation: &Modulation, torque: &[f64], delay: f64) -> Vec<Complex<f64>> {
    let lines = modulation.of(torque).into_iter().zip(&modulation.omega);
    lines.map(|(v, w)| v * Complex::new(0.0, -w * delay).exp()).collect()
}

/// The integrals of a torque that is held from sample to sample: late by half a sample, with a hold's gain.
pub(super) fn held(modulation: &Modulation, torque: &[f64], step: f64) -> Vec<Complex<f64>> {
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
