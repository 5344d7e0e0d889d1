//! A joint so stiff that its encoders' clocks, not its spring, explain most of the difference between motor and link.
//!
//! To first order the deflection is the sum of the effect of an offset sigma of the link's clock and of the bending by the motor's torque:
//!
//! $$ d = \sigma\, \dot q + c\,\tau + p(q) + e. $$
//!
//! If motor and link move as one, the torque for the motor's inertia cannot be distinguished from that on the spring: c is the compliance
//! to the motor's torque, that of the spring or less.
//!
//! The polynomial p contains the effects that depend on the angle alone: gravity, and eccentric encoders. The remainder, mostly errors of
//! the gear, is not white but mostly slow: lines are weighted by the spectrum of the remainder itself, smoothed over neighbours, as in
//! feasible generalised least squares.

use super::basis::range;
use super::equations::{Column, Equations, Lines, Solution};
use super::fourier::Modulation;
use super::limits::{
    ANGLE_DEGREE, COMPLIANCE_PASSES, COMPLIANCE_SETTLED, LEAST_POWER, MOSTLY_CLOCKS, NEIGHBOURS_AROUND,
    NEIGHBOURS_SHARE, NOISE_ROUNDS,
};
use super::motion::Motion;
use super::normal::Covariance;
use super::outcome::{Estimated, StiffJoint};
use super::smooth::Reflected;

/// The numbers of the columns.
const OFFSET: usize = 0;
const COMPLIANCE: usize = 1;

impl Motion<'_> {
    /// The joint as a stiff one, if an offset of the clocks explains nearly all of its deflection.
    pub fn stiff(&self, modulation: &Modulation) -> Option<StiffJoint> {
        let reflected = Reflected::new(self.link, self.step);
        let velocity = Reflected::new(self.motor, self.step).velocity(self.motor_noise.cut_off());
        let of = |value: &dyn Fn(usize) -> f64| modulation.of(&(0..velocity.len()).map(value).collect::<Vec<_>>());
        let [low, high] = range(self.motor);
        let angle: Vec<f64> = self
            .motor
            .iter()
            .map(|q| (2.0 * q - low - high) / (high - low))
            .collect();
        let by_angle = (0..=ANGLE_DEGREE).map(|degree| of(&|i| legendre(degree, angle[i])));
        let columns: Vec<Column> = [modulation.of_rate(self.motor), modulation.of(self.torque)]
            .into_iter()
            .chain(by_angle)
            .map(|lines| vec![Some(lines)])
            .collect();
        let mut offset = 0.0;
        let mut last = None;
        for _ in 0..COMPLIANCE_PASSES {
            let link = reflected.shifted(offset);
            let deflection: Vec<f64> = self.motor.iter().zip(&link).map(|(m, q)| m - q).collect();
            let found = weighted_by_remainder(&columns, modulation.of(&deflection))?;
            let change = found.0.x[OFFSET];
            offset += change;
            last = Some(found);
            if change.abs() < COMPLIANCE_SETTLED * self.step {
                break;
            }
        }
        let (solution, covariance) = last?;
        let estimated = |value, column| Estimated {
            value,
            standard_error: covariance.error(column),
        };
        let share_of_clocks = self.share_of_clocks(offset, &velocity);
        (share_of_clocks > MOSTLY_CLOCKS).then(|| StiffJoint {
            clock_offset: estimated(offset, OFFSET),
            compliance: estimated(solution.x[COMPLIANCE], COMPLIANCE),
            share_of_clocks,
        })
    }

    /// The share of the deflection's mean square, about its mean, that an offset of the clocks explains.
    fn share_of_clocks(&self, offset: f64, velocity: &[f64]) -> f64 {
        let n = velocity.len() as f64;
        let deflection = || self.motor.iter().zip(self.link).map(|(m, q)| m - q);
        let left = || deflection().zip(velocity).map(|(d, v)| d - offset * v);
        let variance = |mean: f64, squares: f64| squares / n - mean * mean;
        let moments = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, squares) = values.fold((0.0, 0.0), |(s, q), d| (s + d, q + d * d));
            variance(sum / n, squares)
        };
        1.0 - moments(&mut left()) / moments(&mut deflection())
    }
}

/// The Legendre polynomial of this degree.
fn legendre(degree: usize, x: f64) -> f64 {
    let recursion = |(before, last): (f64, f64), n: usize| {
        let n = n as f64;
        (last, ((2.0 * n + 1.0) * x * last - n * before) / (n + 1.0))
    };
    (0..degree).fold((0.0, 1.0), recursion).1
}

/// The least-squares solution with weights from its own remainder.
fn weighted_by_remainder(columns: &[Column], right: Lines) -> Option<(Solution, Covariance)> {
    let solve = |noise: &[f64]| {
        let equations = Equations {
            columns: columns.to_vec(),
            right: vec![right.clone()],
            noise: vec![noise],
            noisy: Vec::new(),
            given: Vec::new(),
        };
        let solution = equations.solve()?;
        let covariance = equations.robust(&solution).covariance;
        Some((solution, covariance))
    };
    let first = solve(&vec![1.0; right.len()])?;
    (0..NOISE_ROUNDS).try_fold(first, |(last, _), _| solve(&smoothed(&last.residuals[0])))
}

/// The mean squares of lines, each averaged over its neighbours. Their number grows with frequency, since spectra of mechanical signals are
/// smooth over its logarithm.
fn smoothed(lines: &Lines) -> Vec<f64> {
    let power: Vec<f64> = lines.iter().map(|line| line.norm_sqr()).collect();
    let least = f64::MIN_POSITIVE + LEAST_POWER * power.iter().sum::<f64>() / power.len() as f64;
    let around = |k: usize| {
        let half = NEIGHBOURS_AROUND.max((NEIGHBOURS_SHARE * k as f64) as usize);
        let near = &power[k.saturating_sub(half)..(k + half + 1).min(power.len())];
        (near.iter().sum::<f64>() / near.len() as f64).max(least)
    };
    (0..power.len()).map(around).collect()
}
