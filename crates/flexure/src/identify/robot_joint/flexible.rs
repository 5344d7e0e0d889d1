//! A flexible joint: motor and link inertia, stiffness and friction from both angles and the torque.
//!
//! $$ \tau = J_m \ddot q_m + \kappa(d), \qquad 0 = \kappa(d) - M \ddot q - f(\dot q), \qquad \kappa(d) = k(d)\, d. $$
//!
//! The motor's equation alone tells kappa, their sum M and f; both together, each line with the weight of its
//! noise, tell all of them best: the second equation has no torque in it, and so none of its noise.

use super::alignment::{Alignment, align};
use super::checks;
use super::fourier::Modulation;
use super::judge::Left;
use super::outcome::{Estimated, Finding, Fitted, FlexibleAxis, JointFound};
use super::pair::{Free, Pair};
use super::rigid::{FEWEST_LINES, RESOLVED, RigidJoint, band, least_band, widened};
use super::skew;
use super::smooth::{Noise, Reflected};
use crate::error::{DataError, Error, Result};
use crate::linalg::Complex;

/// The highest frequency of the equations as a share of the sampling rate, and in bands of the motion.
pub(super) const HIGHEST: f64 = 0.1;
pub(super) const BANDS: f64 = 3.0;

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
    /// The angle of the link that the motor rides on, with its noise.
    pub rides_on: Option<(&'a [f64], Noise)>,
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
            return Err(Error::parameter(
                "the motor's inertia",
                value,
                "positive and finite, in kg m^2",
            ));
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
            rides_on: None,
        };
        checks::resolved(&[motion.motor_noise, motion.link_noise], self.link.len(), step)?;
        let widest = motion.motor_noise.band.max(motion.link_noise.band);
        let highest = (HIGHEST / step).min((BANDS * widest).max(least_band(self.link.len(), step)));
        let modulation = Modulation::new(self.link.len(), step, highest);
        if modulation.len() < FEWEST_LINES {
            return Err(Error::too_short(
                "the equations of motion at enough frequencies",
                (FEWEST_LINES as f64 / (highest * step)).ceil() as usize,
                self.link.len(),
            ));
        }
        if let Some(findings) = motion.no_flexibility(&modulation) {
            // The link's angle on the motor's clock, which is the torque's: the motor's own shakes against a stiff joint.
            let skew = findings.iter().find_map(|f| match f {
                Finding::EncoderSkew { skew, .. } => Some(*skew),
                _ => None,
            });
            let link = skew.map(|skew| Reflected::new(self.link, step).shifted(skew));
            let mut axis = RigidJoint {
                position: link.as_deref().unwrap_or(self.link),
                torque: self.torque,
                velocity: None,
                sample_time: step,
                extras: &[],
                level: self.level,
            }
            .identify()?;
            axis.findings.splice(0..0, findings);
            return Ok(JointFound::Rigid(Box::new(axis)));
        }
        let untold = || {
            Error::Data(DataError::TooLittleMotion {
                what: "inertias, stiffness and friction of the joint",
            })
        };
        let alignment = skew::refined(&motion, &modulation, align(&motion, &modulation).ok_or_else(untold)?);
        let shifted = match alignment.skew {
            (skew, _, true) => Reflected::new(self.link, step).shifted(skew),
            _ => self.link.to_vec(),
        };
        let pair = Pair::new(&motion, &modulation, &alignment, &shifted);
        let free = pair.free(&motion).ok_or_else(untold)?;
        let found = self.outcome(&motion, &pair, &free, &alignment, &shifted);
        found
            .map(|axis| JointFound::Flexible(Box::new(axis.distrusted())))
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
        let covariance = equations.robust(&solution).covariance;
        let left = Left::by(&equations, &solution);
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
        let [fine_stiffness, fine_friction] = &free.finer[..] else {
            return None;
        };
        let fine = pair.both_with(fine_stiffness, fine_friction, &free.noise).solve()?;
        let fine_at = first + fine_stiffness.0.len() + 1;
        let secant = widened(band(stiff, k, self.level, part(first)), &|d| {
            fine_stiffness.0.value(&fine.x[first..], d)
        });
        let rub = widened(band(&free.friction.0, f, self.level, part(link_at + 1)), &|v| {
            fine_friction.0.value(&fine.x[fine_at..], v)
        });
        let kappa: Vec<f64> = pair.d.iter().map(|&d| stiff.value(k, d) * d).collect();
        let curve: Vec<f64> = pair.v.iter().map(|&v| free.friction.0.value(f, v)).collect();
        let motor_inertia = match self.motor_inertia {
            Some(value) => Estimated {
                value,
                standard_error: 0.0,
            },
            None => estimated(0)
                .or_off_by(solution.x[link_at] * pair.attenuation)
                .or_off_by(solution.x[0] * pair.confusion),
        };
        let resolution = RESOLVED * motion.link_noise.velocity_sd(self.sample_time);
        let (stiffness_forms, friction_forms) = pair.forms(free, left, (&kappa, &curve), resolution);
        let best = |forms: &[Fitted]| (0..forms.len()).min_by(|&a, &b| forms[a].bic.total_cmp(&forms[b].bic));
        let model = pair.model(
            free,
            left,
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
            friction: rub,
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
            findings: motion.findings(alignment, &pair.v, resolution),
        })
    }
}

impl Motion<'_> {
    /// The modulated integrals of the rotor's acceleration in space.
    pub fn rotor_acceleration(&self, modulation: &Modulation) -> Vec<Complex<f64>> {
        match self.rides_on {
            None => modulation.of_acceleration(self.motor),
            Some((carrier, _)) => {
                let angle: Vec<f64> = self.motor.iter().zip(carrier).map(|(m, q)| m + q).collect();
                modulation.of_acceleration(&angle)
            }
        }
    }

    /// The standard deviation of the noise in the rotor's angle in space.
    pub fn rotor_sd(&self) -> f64 {
        self.rides_on
            .map_or(self.motor_noise.sd, |(_, noise)| self.motor_noise.sd.hypot(noise.sd))
    }

    /// What to know of the motion and its clocks before trusting what they tell.
    pub fn findings(&self, alignment: &Alignment, v: &[f64], resolution: f64) -> Vec<Finding> {
        let mut findings = Vec::new();
        findings.extend(checks::different_angles(self.motor, self.link));
        findings.extend(checks::clipped(self.torque));
        findings.extend(checks::motion(v, resolution));
        for noise in [self.motor_noise, self.link_noise] {
            if noise.unresolved && findings.iter().all(|f| !matches!(f, Finding::SampledTooSlowly { .. })) {
                findings.push(Finding::SampledTooSlowly {
                    step: self.step,
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
        findings.extend(checks::in_degrees(&[self.motor, self.link]));
        findings
    }
}
