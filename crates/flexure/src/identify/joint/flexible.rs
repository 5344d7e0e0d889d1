//! A flexible joint: motor and link inertia, stiffness and friction from both angles and the torque.
//!
//! $$ \tau = J_m \ddot q_m + \kappa(d), \qquad 0 = \kappa(d) - M \ddot q - f(\dot q), \qquad \kappa(d) = k(d)\, d. $$
//!
//! The motor's equation alone tells kappa, their sum M and f; both together, each line with the weight of its
//! noise, tell all of them best: the second equation has no torque in it, and so none of its noise.

use super::alignment::{Alignment, align, stiffness_columns};
use super::basis::Basis;
use super::checks;
use super::equations::{Column, Equations, NoiseModel, Solution};
use super::fourier::Modulation;
use super::outcome::{Estimated, Finding, Fitted, FlexibleAxis, JointFound};
use super::rigid::{FEWEST_LINES, RESOLVED, ROUNDS, RigidJoint, band};
use super::smooth::{Noise, Reflected};
use crate::error::{Error, Result};
use crate::linalg::Complex;

/// The highest frequency of the equations as a share of the sampling rate, and in bands of the motion.
const HIGHEST: f64 = 0.1;
const BANDS: f64 = 3.0;
/// Intervals on either side of zero that are tried for the stiffness and for the friction curve.
const STIFFNESS_PIECES: [usize; 4] = [3, 5, 8, 12];
const FRICTION_PIECES: [usize; 4] = [9, 13, 18, 26];
/// The deflection is flexibility if it has this many times the encoders' noise power in the band of the motion.
const FLEXIBLE: f64 = 3.0;

/// The log of a flexible joint, and what is known of it.
///
/// | field | unit | range |
/// |---|---|---|
/// | `motor`, `link` | rad, both on the link's side of the gear | finite, not constant, not wrapped; at least 200 samples |
/// | `torque` | N m on the link's side | finite, not constant, as long |
/// | `sample_time` | s | positive |
/// | `motor_inertia` | kg m^2 on the link's side, if known | positive |
/// | `level` | of the bands | between 0 and 1 |
#[derive(Debug, Clone, Copy)]
pub struct FlexibleJoint<'a> {
    /// The motor's angle.
    pub motor: &'a [f64],
    /// The link's angle.
    pub link: &'a [f64],
    /// The motor's torque.
    pub torque: &'a [f64],
    /// The sample time, s.
    pub sample_time: f64,
    /// The motor's inertia, if it is known.
    pub motor_inertia: Option<f64>,
    /// The level of the bands.
    pub level: f64,
}

/// A log with what its spectra tell.
pub(super) struct Motion<'a> {
    pub motor: &'a [f64],
    pub link: &'a [f64],
    pub torque: &'a [f64],
    pub step: f64,
    pub motor_inertia: Option<f64>,
    pub motor_noise: Noise,
    pub link_noise: Noise,
}

/// The two equations of motion, transformed.
pub(super) struct Pair<'a> {
    pub modulation: &'a Modulation,
    /// The deflection and the link's velocity at every sample.
    pub d: Vec<f64>,
    pub v: Vec<f64>,
    /// The torque less the known part of the motor's.
    pub torque: Vec<Complex<f64>>,
    /// The motor's acceleration; `None` if its inertia is known.
    pub motor: Option<Vec<Complex<f64>>>,
    /// Minus the link's acceleration.
    pub link: Vec<Complex<f64>>,
    /// The encoders' noise in the accelerations of motor and link.
    encoder: [Vec<f64>; 2],
}

/// The free curves.
pub(super) struct Free {
    pub stiffness: (Basis, Vec<Vec<Complex<f64>>>),
    /// Minus the splines.
    pub friction: (Basis, Vec<Vec<Complex<f64>>>),
    pub noise: [Vec<f64>; 2],
}

impl FlexibleJoint<'_> {
    fn check(&self) -> Result<()> {
        let n = self.link.len();
        for (name, column) in [("motor", self.motor), ("link", self.link), ("torque", self.torque)] {
            checks::column(name, column, n)?;
        }
        checks::settings(self.sample_time, self.level)?;
        if let Some(value) = self.motor_inertia
            && !(value > 0.0 && value.is_finite())
        {
            return Err(Error::InvalidParameter {
                name: "the motor's inertia".to_owned(),
                value,
                requirement: "positive and finite, in kg m^2",
            });
        }
        checks::unwrapped("motor", self.motor)?;
        checks::unwrapped("link", self.link)
    }

    /// Identifies the joint, as a rigid one if its motor and link do not move against each other.
    ///
    /// # Errors
    /// As [`RigidJoint::identify`].
    pub fn identify(&self) -> Result<JointFound> {
        self.check()?;
        let step = self.sample_time;
        let motion = Motion {
            motor: self.motor,
            link: self.link,
            torque: self.torque,
            step,
            motor_inertia: self.motor_inertia,
            motor_noise: Noise::of(self.motor, step),
            link_noise: Noise::of(self.link, step),
        };
        let widest = motion.motor_noise.band.max(motion.link_noise.band);
        let highest = (HIGHEST / step).min(BANDS * widest);
        let modulation = Modulation::new(self.link.len(), step, highest);
        if modulation.len() < FEWEST_LINES {
            return Err(Error::TooShort {
                what: "the equations of motion at enough frequencies",
                need: (FEWEST_LINES as f64 / (highest * step)).ceil() as usize,
                got: self.link.len(),
            });
        }
        if let Some(finding) = motion.no_flexibility(&modulation) {
            let mut axis = RigidJoint {
                position: self.link,
                torque: self.torque,
                velocity: None,
                sample_time: step,
                extras: &[],
                level: self.level,
            }
            .identify()?;
            axis.findings.insert(0, finding);
            return Ok(JointFound::Rigid(axis));
        }
        let untold = || Error::TooLittleMotion {
            what: "inertias, stiffness and friction of the joint",
        };
        let alignment = align(&motion, &modulation).ok_or_else(untold)?;
        let shifted = match alignment.skew {
            (skew, _, true) => Reflected::new(self.link, step).shifted(skew),
            _ => self.link.to_vec(),
        };
        let pair = Pair::new(&motion, &modulation, &alignment, &shifted);
        let free = pair.free(&motion).ok_or_else(untold)?;
        let found = self.outcome(&motion, &pair, &free, &alignment, &shifted);
        found
            .map(|axis| JointFound::Flexible(Box::new(axis)))
            .ok_or_else(untold)
    }

    fn outcome(
        &self,
        motion: &Motion,
        pair: &Pair,
        free: &Free,
        alignment: &Alignment,
        link: &[f64],
    ) -> Option<FlexibleAxis> {
        let equations = pair.both(free);
        let solution = equations.solve()?;
        let covariance = equations.robust(&solution);
        let n = solution.x.len();
        let error = |i: usize| covariance[i * n + i].max(0.0).sqrt();
        let estimated = |i: usize| Estimated {
            value: solution.x[i],
            standard_error: error(i),
        };
        // Unknowns: the motor's inertia if it is not known, k, M, f.
        let first = usize::from(pair.motor.is_some());
        let (stiff, link_at) = (&free.stiffness.0, first + free.stiffness.0.len());
        let k = &solution.x[first..link_at];
        let f = &solution.x[link_at + 1..];
        let part = |from: usize| {
            let covariance = &covariance;
            move |i: usize, j: usize| covariance[(from + i) * n + from + j]
        };
        let secant = band(stiff, k, self.level, part(first));
        let kappa: Vec<f64> = pair.d.iter().map(|&d| stiff.value(k, d) * d).collect();
        let curve: Vec<f64> = pair.v.iter().map(|&v| free.friction.0.value(f, v)).collect();
        let motor_inertia = match self.motor_inertia {
            Some(value) => Estimated {
                value,
                standard_error: 0.0,
            },
            None => estimated(0),
        };
        let resolution = RESOLVED * motion.link_noise.velocity_sd(self.sample_time);
        let (stiffness_forms, friction_forms) = pair.forms(free, &solution, (&kappa, &curve), resolution)?;
        let best = |forms: &[Fitted]| (0..forms.len()).min_by(|&a, &b| forms[a].bic.total_cmp(&forms[b].bic));
        let model = pair.model(
            free,
            &solution,
            [&stiffness_forms, &friction_forms],
            [&kappa, &curve],
            resolution,
        )?;
        let acceleration = |q: &[f64], cut_off: f64| {
            let v = Reflected::new(q, self.sample_time).velocity(cut_off);
            Reflected::new(&v, self.sample_time).velocity(cut_off)
        };
        let motor = acceleration(self.motor, motion.motor_noise.cut_off());
        let link = acceleration(link, motion.link_noise.cut_off());
        let inertia = solution.x[link_at];
        Some(FlexibleAxis {
            motor_inertia,
            link_inertia: estimated(link_at),
            best_stiffness: best(&stiffness_forms)?,
            best_friction: best(&friction_forms)?,
            stiffness: super::outcome::torque_band(&secant),
            secant,
            friction: band(&free.friction.0, f, self.level, part(link_at + 1)),
            stiffness_forms,
            friction_forms,
            model,
            skew: Estimated {
                value: alignment.skew.0,
                standard_error: alignment.skew.1,
            },
            cut_off: motion.link_noise.cut_off(),
            highest: pair.modulation.omega[pair.modulation.len() - 1] / (2.0 * std::f64::consts::PI),
            sample_time: self.sample_time,
            partial_stiffness: (0..kappa.len())
                .map(|i| self.torque[i] - motor_inertia.value * motor[i])
                .collect(),
            partial_friction: (0..kappa.len()).map(|i| kappa[i] - inertia * link[i]).collect(),
            reconstructed: (0..kappa.len())
                .map(|i| kappa[i] + motor_inertia.value * motor[i])
                .collect(),
            deflection: pair.d.clone(),
            velocity: pair.v.clone(),
            findings: self.findings(motion, alignment, &pair.v, resolution),
        })
    }

    fn findings(&self, motion: &Motion, alignment: &Alignment, v: &[f64], resolution: f64) -> Vec<Finding> {
        let mut findings = Vec::new();
        findings.extend(checks::clipped(self.torque));
        findings.extend(checks::one_way(v, resolution));
        for noise in [motion.motor_noise, motion.link_noise] {
            if noise.unresolved && findings.iter().all(|f| !matches!(f, Finding::SampledTooSlowly { .. })) {
                findings.push(Finding::SampledTooSlowly {
                    step: self.sample_time,
                    band: noise.band,
                });
            }
        }
        if let (skew, standard_error, true) = alignment.skew {
            findings.push(Finding::EncoderSkew { skew, standard_error });
        }
        if let (delay, true) = alignment.delay {
            findings.push(Finding::TorqueDelay {
                delay,
                held: alignment.held,
            });
        }
        findings
    }
}

impl Motion<'_> {
    /// Whether the deflection is no more than the encoders' noise, and a skew between them.
    fn no_flexibility(&self, modulation: &Modulation) -> Option<Finding> {
        let v = Reflected::new(self.link, self.step).velocity(self.link_noise.cut_off());
        let n = v.len() as f64;
        let d: Vec<f64> = self.motor.iter().zip(self.link).map(|(m, q)| m - q).collect();
        let mean = |x: &[f64]| x.iter().sum::<f64>() / n;
        let (centre, speed) = (mean(&d), mean(&v));
        let both = d.iter().zip(&v);
        let (product, square) = both.fold((0.0, 0.0), |(p, s), (d, v)| {
            (p + (d - centre) * (v - speed), s + (v - speed).powi(2))
        });
        let skew = product / square.max(f64::MIN_POSITIVE);
        let rest: Vec<f64> = d.iter().zip(&v).map(|(d, v)| d - centre - skew * (v - speed)).collect();
        let band = 2.0 * std::f64::consts::PI * self.link_noise.band;
        let lines = modulation.of(&rest);
        let inside: Vec<f64> = lines
            .iter()
            .zip(&modulation.omega)
            .filter(|(_, w)| **w <= band)
            .map(|(v, _)| v.norm_sqr())
            .collect();
        let power = inside.iter().sum::<f64>() / inside.len().max(1) as f64;
        let noise = self.motor_noise.sd.powi(2) + self.link_noise.sd.powi(2);
        // White noise spreads over all frequencies up to half the sampling rate.
        let share = (2.0 * self.step * self.link_noise.band).min(1.0);
        (power < FLEXIBLE * noise).then(|| Finding::NoFlexibility {
            deflection: (power * share).sqrt(),
            noise: (noise * share).sqrt(),
        })
    }
}

impl Pair<'_> {
    fn new<'a>(motion: &Motion, modulation: &'a Modulation, alignment: &Alignment, link: &[f64]) -> Pair<'a> {
        let mut torque = alignment.torque(modulation, motion.torque, motion.step);
        let motor = modulation.of_acceleration(motion.motor);
        if let Some(known) = motion.motor_inertia {
            torque.iter_mut().zip(&motor).for_each(|(t, m)| *t -= m * known);
        }
        let encoder = |noise: &Noise| modulation.omega.iter().map(|w| (noise.sd * w * w).powi(2)).collect();
        Pair {
            d: motion.motor.iter().zip(link).map(|(m, q)| m - q).collect(),
            v: Reflected::new(link, motion.step).velocity(motion.link_noise.cut_off()),
            link: modulation.of_acceleration(link).into_iter().map(|v| -v).collect(),
            encoder: [encoder(&motion.motor_noise), encoder(&motion.link_noise)],
            motor: motion.motor_inertia.is_none().then_some(motor),
            torque,
            modulation,
        }
    }

    /// The noise of an equation with this inertia, from what it leaves.
    fn noise(&self, residuals: &[Complex<f64>], which: usize, inertia: f64) -> Vec<f64> {
        let known: Vec<f64> = self.encoder[which].iter().map(|e| inertia * inertia * e).collect();
        NoiseModel::fit(residuals, &known).lines
    }

    pub(super) fn one(columns: impl Iterator<Item = Vec<Complex<f64>>>) -> Vec<Column> {
        columns.map(|c| vec![Some(c)]).collect()
    }

    /// The motor's equation with a free stiffness curve, and the noise that it turns out to have.
    pub(super) fn motor_side(&self, stiffness: &[Vec<Complex<f64>>], noise: &[f64]) -> Option<(Solution, Vec<f64>)> {
        let columns = self.motor.iter().cloned().chain(stiffness.iter().cloned());
        let solution = Equations {
            columns: Self::one(columns),
            right: vec![self.torque.clone()],
            noise: vec![noise],
            noisy: self.noisy_motor(),
        }
        .solve()?;
        let inertia = if self.motor.is_some() { solution.x[0] } else { 0.0 };
        let noise = self.noise(&solution.residuals[0], 0, inertia);
        Some((solution, noise))
    }

    /// The sum of both equations, `tau = Jm qm'' + M q'' + f(q')`: the link's inertia and friction for a start.
    fn sum(&self, friction: &[Vec<Complex<f64>>], band: f64) -> Option<Solution> {
        let columns = self.motor.iter().chain([&self.link]).chain(friction).cloned();
        let columns = Self::one(columns);
        // Low frequencies, where the encoders' noise does no harm, begin.
        let edge = std::f64::consts::PI * band;
        let mut noise: Vec<f64> = self.modulation.omega.iter().map(|w| 1.0 + (w / edge).powi(8)).collect();
        let at = usize::from(self.motor.is_some());
        let mut solution = None;
        for _ in 0..ROUNDS {
            let mut found = Equations {
                columns: columns.clone(),
                right: vec![self.torque.clone()],
                noise: vec![&noise],
                noisy: self.noisy_motor().into_iter().chain([self.noisy_link(at, 0)]).collect(),
            }
            .solve()?;
            // The columns of the link have the link equation's sign.
            noise = self.noise(&found.residuals[0], 1, found.x[at]);
            found.x[at..].iter_mut().for_each(|x| *x = -*x);
            solution = Some(found);
        }
        solution
    }

    /// The residuals of the link's equation `kappa - M q'' - f = 0`.
    fn link_residuals(&self, kappa: &[Complex<f64>], rest: &[(&[Complex<f64>], f64)]) -> Vec<Complex<f64>> {
        let mut left = kappa.to_vec();
        for (column, x) in rest {
            left.iter_mut().zip(*column).for_each(|(l, c)| *l += c * *x);
        }
        left
    }

    /// The free curves with as many splines as pay for themselves, and the noise of both equations.
    fn free(&self, motion: &Motion) -> Option<Free> {
        let start = vec![1.0; self.modulation.len()];
        let akaike = |s: &Solution, lines: usize| {
            let observations = 2.0 * lines as f64;
            observations * (s.squares / observations).ln() + 2.0 * s.x.len() as f64
        };
        let lines = self.modulation.len();
        let coarse = Basis::new(&self.d, STIFFNESS_PIECES[1]);
        let columns = stiffness_columns(self.modulation, &coarse, &self.d);
        let mut motor_noise = start;
        for _ in 0..2 {
            motor_noise = self.motor_side(&columns, &motor_noise)?.1;
        }
        let curves = STIFFNESS_PIECES.iter().filter_map(|&pieces| {
            let basis = Basis::new(&self.d, pieces);
            let columns = stiffness_columns(self.modulation, &basis, &self.d);
            let (solution, noise) = self.motor_side(&columns, &motor_noise)?;
            Some((akaike(&solution, lines), (basis, columns), solution, noise))
        });
        let (_, stiffness, solution, motor_noise) = curves.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let from = usize::from(self.motor.is_some());
        let kappa = combine(&stiffness.1, &solution.x[from..]);
        let splines = |pieces: usize| {
            let basis = Basis::new(&self.v, pieces);
            let columns = self.modulation.of_all(&basis.columns(&self.v, |_| -1.0));
            (basis, columns)
        };
        let (_, columns) = splines(FRICTION_PIECES[1]);
        let sum = self.sum(&columns, motion.link_noise.band)?;
        let at = usize::from(self.motor.is_some());
        let mut rest: Vec<(&[Complex<f64>], f64)> = vec![(&self.link, sum.x[at])];
        rest.extend(columns.iter().map(Vec::as_slice).zip(sum.x[at + 1..].iter().copied()));
        let mut link_noise = self.noise(&self.link_residuals(&kappa, &rest), 1, sum.x[at]);
        let right: Vec<Complex<f64>> = kappa.iter().map(|v| -v).collect();
        let mut chosen = None;
        // First the noise, then the number of splines.
        for pieces in [&FRICTION_PIECES[1..2], &FRICTION_PIECES[..]] {
            let curves = pieces.iter().filter_map(|&pieces| {
                let friction = splines(pieces);
                let columns = std::iter::once(self.link.clone()).chain(friction.1.iter().cloned());
                let solution = Equations {
                    columns: Self::one(columns),
                    right: vec![right.clone()],
                    noise: vec![&link_noise],
                    noisy: vec![self.noisy_link(0, 0)],
                }
                .solve()?;
                Some((akaike(&solution, lines), friction, solution))
            });
            let (_, friction, solution) = curves.min_by(|a, b| a.0.total_cmp(&b.0))?;
            link_noise = self.noise(&solution.residuals[0], 1, solution.x[0]);
            chosen = Some(friction);
        }
        Some(Free {
            stiffness,
            friction: chosen?,
            noise: [motor_noise, link_noise],
        })
    }

    /// The columns of the inertias in both equations: of the motor, if it is not known, and of the link.
    pub(super) fn inertias(&self) -> (Option<Column>, Column) {
        let motor = self.motor.clone().map(|m| vec![Some(m), None]);
        (motor, vec![None, Some(self.link.clone())])
    }

    /// The noise of the motor's acceleration, where its inertia is the first unknown.
    pub(super) fn noisy_motor(&self) -> Vec<(usize, usize, &[f64])> {
        let noisy = self.motor.is_some().then_some((0, 0, &self.encoder[0][..]));
        noisy.into_iter().collect()
    }

    /// That of the link's acceleration, the unknown `at` of the equations of `block`.
    pub(super) fn noisy_link(&self, at: usize, block: usize) -> (usize, usize, &[f64]) {
        (at, block, &self.encoder[1])
    }

    pub(super) fn right(&self) -> Vec<Vec<Complex<f64>>> {
        vec![self.torque.clone(), vec![Complex::new(0.0, 0.0); self.torque.len()]]
    }

    /// Both equations with free curves.
    fn both<'b>(&'b self, free: &'b Free) -> Equations<'b> {
        let (motor, link) = self.inertias();
        let stiffness = free.stiffness.1.iter().map(|c| vec![Some(c.clone()), Some(c.clone())]);
        let friction = free.friction.1.iter().map(|c| vec![None, Some(c.clone())]);
        let link_at = usize::from(motor.is_some()) + free.stiffness.1.len();
        Equations {
            columns: motor
                .into_iter()
                .chain(stiffness)
                .chain([link])
                .chain(friction)
                .collect(),
            right: self.right(),
            noise: free.noise.iter().map(Vec::as_slice).collect(),
            noisy: self
                .noisy_motor()
                .into_iter()
                .chain([self.noisy_link(link_at, 1)])
                .collect(),
        }
    }
}

/// The sum of the columns, each times its factor.
pub(super) fn combine(columns: &[Vec<Complex<f64>>], factors: &[f64]) -> Vec<Complex<f64>> {
    let mut sum = vec![Complex::new(0.0, 0.0); columns.first().map_or(0, Vec::len)];
    for (column, factor) in columns.iter().zip(factors) {
        sum.iter_mut().zip(column).for_each(|(s, v)| *s += v * *factor);
    }
    sum
}
