//! A rigid axis: inertia and friction from position and torque.
//!
//! $$ \tau = M \ddot q + f(\dot q) + g_c \cos q + g_s \sin q + k q $$
//!
//! where the last three terms, gravity and a spring, are optional and f contains any offset.

use super::alignment::{held as held_torque, is_held};
use super::basis::Basis;
use super::checks;
use super::equations::{Column, Equations, NoiseModel, Solution};
use super::fourier::Modulation;
use super::judge::{Against, Left};
use super::noisy::Noisy;
use super::outcome::{Estimated, Finding, Fitted, Parameter, RigidAxis};
use super::parametric::{forms_of, friction_starts, shape};
use super::pieces::lowest;
use super::shaping::Shaping;
use super::smooth::{Noise, Reflected};
use crate::bands::{Band, BandKind};
use crate::error::{DataError, Error, Result};
use crate::linalg::Complex;

/// Points of a curve.
pub(super) const POINTS: usize = 201;
/// Intervals on either side of zero that are tried for a free curve.
const PIECES: [usize; 6] = [4, 6, 9, 13, 18, 25];
/// The highest frequency of the equations as a share of the sampling rate.
const HIGHEST: f64 = 0.2;
/// The fewest frequencies that make equations.
pub(super) const FEWEST_LINES: usize = 60;
/// Velocities within so many standard deviations of their noise are not told apart.
pub(super) const RESOLVED: f64 = 3.0;
/// Samples within a mechanical time constant.
const SAMPLES_A_CONSTANT: f64 = 5.0;
/// Rounds of estimating the noise and solving again.
pub(super) const ROUNDS: usize = 4;

/// A position-dependent term of a rigid axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extra {
    /// Gravity: cos q and sin q.
    Gravity,
    /// A spring: q.
    Spring,
}

/// The log of a rigid axis, and what is known of it.
///
/// | field | unit | range |
/// |---|---|---|
/// | `position` | rad (or m) | finite, not constant, not wrapped; at least 200 samples |
/// | `torque` | N m (or N), on the side of the position | finite, not constant, as long |
/// | `velocity` | rad/s; derived by zero-phase smoothing if `None` | as long |
/// | `sample_time` | s | positive |
/// | `extras` | terms beyond inertia and friction | |
/// | `level` | of the bands | between 0 and 1 |
#[derive(Debug, Clone, Copy)]
pub struct RigidJoint<'a> {
    /// The position.
    pub position: &'a [f64],
    /// The torque or force.
    pub torque: &'a [f64],
    /// The velocity, if it was measured.
    pub velocity: Option<&'a [f64]>,
    /// The sample time, s.
    pub sample_time: f64,
    /// Position-dependent terms.
    pub extras: &'a [Extra],
    /// The level of the bands.
    pub level: f64,
}

/// The equations of a rigid axis, ready to be solved.
struct Lines {
    modulation: Modulation,
    velocity: Vec<f64>,
    resolution: f64,
    torque: Vec<Complex<f64>>,
    acceleration: Vec<Complex<f64>>,
    /// The encoder's noise in an acceleration, mean square a line.
    encoder: Vec<f64>,
    extras: Vec<(&'static str, [i32; 2], Vec<f64>)>,
}

/// The band, Hz, that just has enough lines for equations.
pub(super) fn least_band(samples: usize, step: f64) -> f64 {
    1.2 * FEWEST_LINES as f64 / (samples as f64 * step)
}

impl RigidJoint<'_> {
    fn check(&self) -> Result<()> {
        checks::settings(self.sample_time, self.level)?;
        let n = self.position.len();
        checks::column("position", self.position, n)?;
        checks::column("torque", self.torque, n)?;
        if let Some(v) = self.velocity {
            checks::column("velocity", v, n)?;
        }
        checks::unwrapped("position", self.position)
    }

    /// Identifies the axis.
    ///
    /// # Errors
    /// [`Error::Data`]: `TooShort`, `NonFinite`, `Constant`, `LengthMismatch`, `Unit`,
    /// `WrappedAngle` and [`Error::Parameter`] for what cannot be used, `TooLittleMotion`
    /// where the motion has too few frequencies, or does not tell inertia and friction apart.
    pub fn identify(&self) -> Result<RigidAxis> {
        self.check()?;
        let noise = Noise::of(self.position, self.sample_time);
        checks::resolved(&[noise], self.position.len(), self.sample_time)?;
        let mut lines = self.lines(&noise)?;
        let untold = || {
            Error::Data(DataError::TooLittleMotion {
                what: "inertia and friction of the axis",
            })
        };
        let mut weights = lines.weights(noise.band).ok_or_else(untold)?;
        let delay = lines.delay(self.torque, &weights);
        let held = delay.filter(|&(delay, error)| is_held(delay, error, self.sample_time));
        if held.is_some() {
            lines.torque = held_torque(&lines.modulation, self.torque, self.sample_time);
            weights = lines.weights(noise.band).ok_or_else(untold)?;
        }
        // The free curve that pays best for its unknowns, and the next finer one, which tells what it smooths away.
        let observations = 2.0 * lines.modulation.len() as f64;
        let scores: Vec<Option<f64>> = PIECES
            .iter()
            .map(|&pieces| {
                let solution = lines
                    .free(&Basis::friction(&lines.velocity, pieces), &weights)
                    .solve()?;
                let schwarz = solution.x.len() as f64 * observations.ln();
                Some(observations * (solution.squares / observations).ln() + schwarz)
            })
            .collect();
        let best = lowest(scores.iter().copied()).ok_or_else(untold)?;
        let basis = Basis::friction(&lines.velocity, PIECES[best]);
        let solution = lines.free(&basis, &weights).solve().ok_or_else(untold)?;
        let finer = Basis::friction(&lines.velocity, PIECES[(best + 1).min(PIECES.len() - 1)]);
        let finer_solution = lines.free(&finer, &weights).solve().ok_or_else(untold)?;
        let finer_curve = |v: f64| finer.value(&finer_solution.x[1 + lines.extras.len()..], v);
        let covariance = lines.free(&basis, &weights).robust(&solution).covariance;
        let free = (&basis, &solution, &covariance[..]);
        let mut axis = self
            .outcome(&lines, &weights, free, &finer_curve, &noise)
            .ok_or_else(untold)?;
        axis.findings
            .extend(held.map(|(delay, _)| Finding::TorqueDelay { delay, held: true }));
        Ok(axis.distrusted())
    }

    fn lines(&self, noise: &Noise) -> Result<Lines> {
        let (n, step) = (self.position.len(), self.sample_time);
        let highest = (HIGHEST / step).min(noise.band.max(least_band(n, step)));
        let modulation = Modulation::new(n, step, highest);
        if modulation.len() < FEWEST_LINES {
            return Err(Error::too_short(
                "the equations of motion at enough frequencies",
                (FEWEST_LINES as f64 / (highest * step)).ceil() as usize,
                n,
            ));
        }
        let velocity = match self.velocity {
            Some(v) => v.to_vec(),
            None => Reflected::new(self.position, step).velocity(noise.cut_off()),
        };
        let resolution = RESOLVED * noise.velocity_sd(step);
        let q = self.position;
        let mut extras: Vec<(&'static str, [i32; 2], Vec<f64>)> = Vec::new();
        for extra in self.extras {
            match extra {
                Extra::Gravity => {
                    extras.push(("gravity cos", [1, 0], q.iter().map(|q| q.cos()).collect()));
                    extras.push(("gravity sin", [1, 0], q.iter().map(|q| q.sin()).collect()));
                }
                Extra::Spring => extras.push(("spring", [1, -1], q.to_vec())),
            }
        }
        Ok(Lines {
            torque: modulation.of(self.torque),
            acceleration: modulation.of_acceleration(q),
            encoder: modulation.omega.iter().map(|w| (noise.sd * w * w).powi(2)).collect(),
            velocity,
            resolution,
            extras,
            modulation,
        })
    }

    /// Everything that is told of a solution; `None` if not even the simplest form can be fitted.
    fn outcome(
        &self,
        lines: &Lines,
        weights: &[f64],
        (basis, solution, covariance): (&Basis, &Solution, &[f64]),
        finer: &dyn Fn(f64) -> f64,
        noise: &Noise,
    ) -> Option<RigidAxis> {
        let unknowns = solution.x.len();
        let error = |i: usize| covariance[i * unknowns + i].max(0.0).sqrt();
        let first = 1 + lines.extras.len();
        let coefficients = &solution.x[first..];
        let curve: Vec<f64> = lines.velocity.iter().map(|&v| basis.value(coefficients, v)).collect();
        let friction = widened(
            band(basis, coefficients, self.level, |i, j| {
                covariance[(first + i) * unknowns + first + j]
            }),
            finer,
        );
        let against = Against {
            free: Left::by(&lines.free(basis, weights), solution),
            curve: &curve,
            x: &lines.velocity,
            resolution: lines.resolution,
        };
        let forms: Vec<Fitted> = lines.forms(weights, &against);
        let best = (0..forms.len()).min_by(|&a, &b| forms[a].bic.total_cmp(&forms[b].bic))?;
        let extras = (0..lines.extras.len()).map(|i| {
            let (symbol, unit, _) = &lines.extras[i];
            let (value, standard_error) = (solution.x[1 + i], error(1 + i));
            Parameter {
                symbol: (*symbol).to_owned(),
                unit: *unit,
                value,
                standard_error,
                identifiable: true,
                range: [value - 1.96 * standard_error, value + 1.96 * standard_error],
                remark: String::new(),
            }
        });
        let acceleration = Reflected::new(&lines.velocity, self.sample_time).velocity(noise.cut_off());
        let position_dependent = |i: usize| -> f64 {
            let terms = lines.extras.iter().zip(&solution.x[1..]);
            terms.map(|((_, _, values), c)| c * values[i]).sum()
        };
        let rest = |i: usize| solution.x[0] * acceleration[i] + position_dependent(i);
        let partial = (0..curve.len()).map(|i| self.torque[i] - rest(i)).collect();
        let reconstructed = (0..curve.len()).map(|i| curve[i] + rest(i)).collect();
        let mut findings = Vec::new();
        findings.extend(checks::clipped(self.torque));
        findings.extend(checks::motion(&lines.velocity, lines.resolution));
        if noise.unresolved {
            findings.push(Finding::SampledTooSlowly {
                step: self.sample_time,
                band: noise.band,
            });
        }
        let viscous = forms[0].parameter("Fv").filter(|p| p.identifiable).map(|p| p.value);
        if let Some(time_constant) = viscous.map(|v| solution.x[0] / v)
            && time_constant > 0.0
            && time_constant < SAMPLES_A_CONSTANT * self.sample_time
        {
            findings.push(Finding::FastTimeConstant {
                time_constant,
                step: self.sample_time,
            });
        }
        findings.extend(checks::in_degrees(&[self.position]));
        Some(RigidAxis {
            inertia: Estimated {
                value: solution.x[0],
                standard_error: error(0),
            },
            friction,
            extras: extras.collect(),
            forms,
            best,
            cut_off: self.velocity.is_none().then(|| noise.cut_off()),
            highest: lines.modulation.omega[lines.modulation.len() - 1] / (2.0 * std::f64::consts::PI),
            sample_time: self.sample_time,
            velocity: lines.velocity.clone(),
            partial,
            reconstructed,
            findings,
        })
    }
}

impl Lines {
    /// The noise of the acceleration.
    fn noisy(&self) -> Vec<Noisy<'_>> {
        vec![Noisy {
            columns: [0, 0],
            block: 0,
            lines: &self.encoder,
            factor: 1.0,
        }]
    }

    /// The columns of inertia and position-dependent terms.
    fn fixed(&self) -> Vec<Column> {
        let extras = self
            .extras
            .iter()
            .map(|(_, _, values)| vec![Some(self.modulation.of(values))]);
        std::iter::once(vec![Some(self.acceleration.clone())])
            .chain(extras)
            .collect()
    }

    fn free<'b>(&'b self, basis: &Basis, noise: &'b [f64]) -> Equations<'b> {
        let splines = self.modulation.of_all(&basis.mean_columns(&self.velocity, 1.0));
        let mut columns = self.fixed();
        columns.extend(splines.into_iter().map(|c| vec![Some(c)]));
        Equations {
            columns,
            right: vec![self.torque.clone()],
            noise: vec![noise],
            noisy: self.noisy(),
        }
    }

    /// The time from a torque's sample to its effect, and its standard error.
    fn delay(&self, torque: &[f64], noise: &[f64]) -> Option<(f64, f64)> {
        let mut equations = self.free(&Basis::friction(&self.velocity, PIECES[2]), noise);
        equations.columns.push(vec![Some(self.modulation.of_rate(torque))]);
        let solution = equations.solve()?;
        let last = solution.x.len() - 1;
        Some((solution.x[last], solution.error(last)))
    }

    /// The noise of each line.
    ///
    /// Low frequencies, where the encoder's noise does no harm, begin; then the weights are the noise's own.
    fn weights(&self, band: f64) -> Option<Vec<f64>> {
        let basis = Basis::friction(&self.velocity, PIECES[1]);
        let edge = std::f64::consts::PI * band;
        let mut noise: Vec<f64> = self.modulation.omega.iter().map(|w| 1.0 + (w / edge).powi(8)).collect();
        for _ in 0..ROUNDS {
            let solution = self.free(&basis, &noise).solve()?;
            let inertia = solution.x[0];
            let known: Vec<f64> = self.encoder.iter().map(|e| inertia * inertia * e).collect();
            noise = NoiseModel::fit(&solution.residuals[0], &known).lines;
        }
        Some(noise)
    }

    /// The physical forms, each against the free curve.
    fn forms(&self, noise: &[f64], against: &Against) -> Vec<Fitted> {
        let fastest = self.velocity.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        // A division that does not depend on the torque.
        let basis = Basis::friction(&self.velocity, PIECES[2]);
        let lines = self.modulation.of_all(&basis.mean_columns(&self.velocity, 1.0));
        let beside = (basis, lines);
        let shaping = Shaping {
            fixed: self.fixed(),
            right: vec![self.torque.clone()],
            noise: vec![noise],
            noisy: self.noisy(),
            shapes: vec![shape(&self.velocity, vec![1.0], self.resolution, &beside)],
            modulation: &self.modulation,
        };
        forms_of(shaping, friction_starts(fastest), (true, Some(0)), against)
    }
}

/// The band with what a finer curve would change added to its standard errors, an allowance for bias.
pub(super) fn widened(mut band: Band, finer: &dyn Fn(f64) -> f64) -> Band {
    for i in 0..band.estimate.len() {
        let error = band.standard_error[i];
        let bias = finer(band.x[0][i]) - band.estimate[i];
        let grow = (1.0 + (bias / error.max(f64::MIN_POSITIVE)).powi(2)).sqrt();
        band.standard_error[i] *= grow;
        band.lower[i] = band.estimate[i] + grow * (band.lower[i] - band.estimate[i]);
        band.upper[i] = band.estimate[i] + grow * (band.upper[i] - band.estimate[i]);
    }
    band.method
        .push_str("; widened by what the next finer curve would change");
    band
}

/// A free curve with its pointwise band.
pub(super) fn band(
    basis: &Basis,
    coefficients: &[f64],
    level: f64,
    covariance: impl Fn(usize, usize) -> f64 + Copy,
) -> Band {
    use statrs::distribution::{ContinuousCDF, Normal};
    let x = basis.grid(POINTS);
    let estimate: Vec<f64> = x.iter().map(|&x| basis.value(coefficients, x)).collect();
    let standard_error: Vec<f64> = x.iter().map(|&x| basis.variance(covariance, x).sqrt()).collect();
    let factor = Normal::standard().inverse_cdf(0.5 + 0.5 * level);
    let edge = |sign: f64| -> Vec<f64> {
        let both = estimate.iter().zip(&standard_error);
        both.map(|(y, e)| y + sign * factor * e).collect()
    };
    Band {
        lower: edge(-1.0),
        upper: edge(1.0),
        centre: estimate.clone(),
        estimate,
        standard_error,
        level,
        kind: BandKind::Pointwise,
        method: "regression splines, errors of any spectrum".to_owned(),
        x: vec![x],
    }
}
