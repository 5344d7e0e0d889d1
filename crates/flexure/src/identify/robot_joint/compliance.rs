//! Whether a joint's motor and link move relative to each other, beyond the noise and the clock offsets of their encoders.
//!
//! To first order, the deflection is that of a spring under the torque minus the motor's inertia torque, plus the effects of an offset
//! sigma of the encoders' clocks and of their noise:
//!
//! $$ d = c\,\tau - c J_m\, \ddot q_m + \sigma\, \dot q + e. $$
//!
//! A deflection that the torque does not explain is no flexibility. One that is small compared with the noise of a sample shows no curve:
//! the curve's abscissa would be that noise.

use super::clock_offset::ClockOffset;
use super::equations::{Equations, Lines, Solution};
use super::finding::Finding;
use super::fourier::Modulation;
use super::limits::{CHANCE_OF_SPRING, COMPLIANCE_PASSES, COMPLIANCE_SETTLED, FLEXIBLE, PLAIN};
use super::motion::Motion;
use super::smooth::{Noise, Reflected};
use crate::distributions::fisher_below;
use crate::linear::correlation::{about_mean, mean_square};

/// The deflection as that of a spring, with an offset of the link's clock.
pub(super) struct Compliance {
    /// The offset of the link's clock.
    pub link_offset: ClockOffset,
    /// The root mean square of the deflection that the torque explains, rad; 0 if that may be chance.
    pub elastic: f64,
    /// The root mean square of the encoders' noise in a sample, rad.
    pub noise: f64,
    /// The spring's stiffness, N m/rad; not finite or negative if there is none.
    pub stiffness: f64,
}

impl Compliance {
    /// Whether the deflection is not far above the encoders' noise.
    pub fn is_stiff(&self) -> bool {
        self.elastic < PLAIN * self.noise
    }
}

/// A deflection as a curve's abscissa.
pub(super) struct Deflection {
    /// The deflection at every sample, rad.
    pub d: Vec<f64>,
    /// The share of its mean square that is noise.
    pub attenuation: f64,
    /// The possible relative error of the motor's inertia after smoothing, since the motor's acceleration has the same noise. This is a
    /// bound that simulated joints kept; 0 without smoothing.
    pub confusion: f64,
    /// Whether it was smoothed.
    pub smoothed: bool,
}

impl Motion<'_> {
    /// The deflection, with this angle of the link. If the encoders' noise is not small compared with it, it is smoothed: otherwise the
    /// curve over the noisy abscissa would be too flat.
    pub fn deflection(&self, link: &[f64]) -> Deflection {
        let d: Vec<f64> = self.motor.iter().zip(link).map(|(m, q)| m - q).collect();
        let size = mean_square(&about_mean(&d));
        let share = self.encoders().powi(2) / size.max(f64::MIN_POSITIVE);
        if share * PLAIN * PLAIN < 1.0 {
            return Deflection {
                d,
                attenuation: share,
                confusion: 0.0,
                smoothed: false,
            };
        }
        let cut_off = Noise::of(&d, self.step).cut_off();
        // White noise is spread over all frequencies up to half the sampling rate.
        let passed = (2.0 * self.step * cut_off).min(1.0);
        Deflection {
            d: Reflected::new(&d, self.step).smoothed(cut_off),
            attenuation: share * passed,
            confusion: share.sqrt(),
            smoothed: true,
        }
    }

    /// The standard deviation of the noise of a sample of the deflection.
    fn encoders(&self) -> f64 {
        self.motor_noise.sd.hypot(self.link_noise.sd)
    }

    /// The deflection in the band of the motion as that of a spring; `None` if the motion has too few frequencies.
    pub fn compliance(&self, modulation: &Modulation) -> Option<Compliance> {
        let edge = 2.0 * std::f64::consts::PI * self.link_noise.band.max(self.motor_noise.band);
        let inside = modulation.omega.partition_point(|w| *w <= edge).max(1);
        let freedom = 2.0 * inside as f64 - 3.0;
        if !(freedom > 0.0) {
            return None;
        }
        let first = |mut lines: Lines| {
            lines.truncate(inside);
            lines
        };
        let springs = [
            first(modulation.of(&about_mean(self.torque))),
            first(self.rotor_acceleration(modulation)),
        ];
        let reflected = Reflected::new(self.link, self.step);
        let mut offset = 0.0;
        let mut last = None;
        for _ in 0..COMPLIANCE_PASSES {
            let link = match offset == 0.0 {
                true => self.link.to_vec(),
                false => reflected.shifted(offset),
            };
            let d: Vec<f64> = self.motor.iter().zip(&link).map(|(m, q)| m - q).collect();
            let velocity = first(modulation.of_rate(&link));
            let fit = SpringFit::new(&first(modulation.of(&about_mean(&d))), &velocity, &springs)?;
            let change = fit.with.x[0];
            offset += change;
            last = Some(fit);
            if change.abs() < COMPLIANCE_SETTLED * self.step {
                break;
            }
        }
        let SpringFit { with, without } = last?;
        // The weights are those of noise with a mean square of 1 per line.
        let spread = with.squares / freedom;
        let gain = (without.squares - with.squares).max(0.0);
        let chance = 1.0 - fisher_below(gain / 2.0 / spread, [2.0, freedom]);
        let own: f64 = (0..inside)
            .map(|k| (springs[0][k] * with.x[1] + springs[1][k] * with.x[2]).norm_sqr())
            .sum();
        // The lines of one side of the spectrum; white noise of variance s has the mean square s in each.
        let all = 0.5 * modulation.samples() as f64;
        Some(Compliance {
            link_offset: ClockOffset::new(offset, with.covariance.error(0) * spread.sqrt(), self.step),
            elastic: if chance < CHANCE_OF_SPRING {
                (own / all).sqrt()
            } else {
                0.0
            },
            noise: self.encoders(),
            stiffness: 1.0 / with.x[1],
        })
    }

    /// The findings if the deflection is too small to determine a stiffness.
    pub fn no_flexibility(&self, modulation: &Modulation) -> Option<Vec<Finding>> {
        let found = self.compliance(modulation)?;
        if found.elastic > FLEXIBLE * found.noise {
            return None;
        }
        let mut findings = vec![Finding::NoFlexibility {
            deflection: found.elastic,
            noise: found.noise,
            stiffness: match found.elastic > 0.0 && found.stiffness > 0.0 {
                true => found.stiffness,
                false => f64::NAN,
            },
        }];
        findings.extend(found.link_offset.finding());
        Some(findings)
    }
}

/// The least-squares fits of a deflection with and without a spring.
struct SpringFit {
    with: Solution,
    without: Solution,
}

impl SpringFit {
    fn new(deflection: &Lines, velocity: &Lines, springs: &[Lines; 2]) -> Option<Self> {
        let ones = vec![1.0; deflection.len()];
        let solve = |columns: &[&Lines]| {
            let equations = Equations {
                columns: columns.iter().map(|&c| vec![Some(c.clone())]).collect(),
                right: vec![deflection.clone()],
                noise: vec![&ones],
                noisy: Vec::new(),
                given: Vec::new(),
            };
            equations.solve()
        };
        Some(SpringFit {
            with: solve(&[velocity, &springs[0], &springs[1]])?,
            without: solve(&[velocity])?,
        })
    }
}
