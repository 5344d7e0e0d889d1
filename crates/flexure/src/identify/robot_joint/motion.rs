//! A flexible joint's log with what its spectra show, and the frequencies of the equations of motion.

use super::chain_load::JointLoad;
use super::checks;
use super::equations::Lines;
use super::fourier::Modulation;
use super::limits::{BAND_MARGIN, BANDS, FEWEST_LINES, HIGHEST_FLEXIBLE, RESOLVED};
use super::outcome::Estimated;
use super::smooth::{Noise, Reflected};
use crate::error::{Error, Result};

/// The frequencies of the equations of motion: up to `band` Hz, or higher if there would be too few, but not above a share of the sampling
/// rate.
///
/// # Errors
/// [`Error::Data`]: `TooShort`.
pub(super) fn modulation(samples: usize, step: f64, share: f64, band: f64) -> Result<Modulation> {
    let least = BAND_MARGIN * FEWEST_LINES as f64 / (samples as f64 * step);
    let highest = (share / step).min(band.max(least));
    let modulation = Modulation::new(samples, step, highest);
    if modulation.len() < FEWEST_LINES {
        let need = (FEWEST_LINES as f64 / (highest * step)).ceil() as usize;
        let what = "the equations of motion at enough frequencies";
        return Err(Error::too_short(what, need, samples));
    }
    Ok(modulation)
}

/// The same for flexible joints.
///
/// # Errors
/// Those of [`modulation`].
pub(super) fn modulation_of(motions: &[Motion], step: f64) -> Result<Modulation> {
    let widest = noises(motions).map(|noise| noise.band).fold(0.0, f64::max);
    modulation(motions[0].link.len(), step, HIGHEST_FLEXIBLE, BANDS * widest)
}

/// Refuses motions that are sampled too slowly for flexible joints.
///
/// # Errors
/// [`Error::Data`]: `SampledTooSlowly`.
pub(super) fn resolved(motions: &[Motion], step: f64) -> Result<()> {
    checks::resolved(&noises(motions).collect::<Vec<_>>(), motions[0].link.len(), step)
}

fn noises(motions: &[Motion]) -> impl Iterator<Item = Noise> {
    motions.iter().flat_map(|m| [m.motor_noise, m.link_noise])
}

/// A joint's log with the noise of its encoders.
pub(super) struct Motion<'a> {
    pub motor: &'a [f64],
    pub link: &'a [f64],
    pub torque: &'a [f64],
    pub step: f64,
    /// The motor's inertia, if it is known.
    pub motor_inertia: Option<Estimated>,
    pub motor_noise: Noise,
    pub link_noise: Noise,
    /// What the other joints of a chain add to the torque on the link.
    pub load: Option<&'a JointLoad>,
    /// The link that carries the motor, if that moves.
    pub carrier: Option<Carrier<'a>>,
}

/// A load from each sample to the next; zeros without one.
pub(super) fn between(load: Option<&JointLoad>, samples: usize) -> Vec<f64> {
    let Some(JointLoad { torque, .. }) = load else {
        return vec![0.0; samples];
    };
    let next = torque.iter().skip(1).chain(torque.last());
    torque
        .iter()
        .zip(next)
        .map(|(here, next)| 0.5 * (here + next))
        .collect()
}

/// The link that carries a motor.
#[derive(Clone, Copy)]
pub(super) struct Carrier<'a> {
    pub angle: &'a [f64],
    pub noise: Noise,
}

impl<'a> Motion<'a> {
    pub fn new(motor: &'a [f64], link: &'a [f64], torque: &'a [f64], step: f64) -> Self {
        Motion {
            motor,
            link,
            torque,
            step,
            motor_inertia: None,
            motor_noise: Noise::of(motor, step),
            link_noise: Noise::of(link, step),
            load: None,
            carrier: None,
        }
    }

    /// The transformed acceleration of the rotor in space.
    pub fn rotor_acceleration(&self, modulation: &Modulation) -> Lines {
        match self.carrier {
            None => modulation.of_acceleration(self.motor),
            Some(carrier) => {
                let angle: Vec<f64> = self.motor.iter().zip(carrier.angle).map(|(m, q)| m + q).collect();
                modulation.of_acceleration(&angle)
            }
        }
    }

    /// The standard deviation of the noise in the rotor's angle in space.
    pub fn rotor_sd(&self) -> f64 {
        self.carrier.map_or(self.motor_noise.sd, |carrier| {
            self.motor_noise.sd.hypot(carrier.noise.sd)
        })
    }

    /// The smallest velocity of the link that the data resolve.
    pub fn velocity_resolution(&self) -> f64 {
        RESOLVED * self.link_noise.velocity_sd(self.step)
    }

    /// The smoothed acceleration of the motor, and of the link for this angle.
    pub fn accelerations(&self, link: &[f64]) -> [Vec<f64>; 2] {
        [(self.motor, self.motor_noise), (link, self.link_noise)].map(|(angle, noise)| {
            let v = Reflected::new(angle, self.step).velocity(noise.cut_off());
            Reflected::new(&v, self.step).velocity(noise.cut_off())
        })
    }
}
