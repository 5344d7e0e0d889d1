//! The torque that an identified joint needs for a motion: that of its own log, or of another log of the same joint.
//!
//! A rigid axis needs $M \ddot q + f(\dot q)$, its position-dependent torques and its load. Of a flexible joint, the equations of motor and link are
//! added: the torque of the spring cancels, and with it the noise of the deflection.

use super::chain_load::JointLoad;
use super::checks;
use super::finding::Finding;
use super::limits::{ENDS, LONGEST_ENDS};
use super::outcome::{FlexibleAxis, IdentifiedCurve, RigidAxis};
use super::rates::Rates;
use super::smooth::Reflected;
use crate::error::Result;

/// A motion without its torque.
///
/// | field | unit | range |
/// |---|---|---|
/// | `position` | rad (or m) | of a rigid axis, or of the link; finite, not constant, not wrapped; at least 200 samples |
/// | `motor` | rad, on the link's side | of a flexible joint; as long |
/// | `velocity` | rad/s (or m/s) | of a rigid axis, if it was measured; as long |
/// | `load` | | of the other joints of a chain, for a joint that was identified with one; as long |
/// | `sample_time` | s | positive |
#[derive(Debug, Clone, Copy)]
pub struct JointMotion<'a> {
    /// The position of a rigid axis, or the angle of a flexible joint's link.
    pub position: &'a [f64],
    /// The angle of a flexible joint's motor.
    pub motor: Option<&'a [f64]>,
    /// The velocity of a rigid axis, if it was measured.
    pub velocity: Option<&'a [f64]>,
    /// What gravity and the other joints of a chain add.
    pub load: Option<&'a JointLoad>,
    /// The sample time, s.
    pub sample_time: f64,
}

/// The torque that a motion needs.
#[derive(Debug, Clone)]
pub struct NeededTorque {
    /// N m (or N), at every sample; as late as the logged torque.
    pub torque: Vec<f64>,
    /// The velocity that the friction acts on, rad/s (or m/s): that of a rigid axis, or of the link.
    pub velocity: Vec<f64>,
    /// The share of the samples at which a velocity is outside the range in which its friction was seen.
    pub unseen: f64,
    /// The highest frequency of the motion that stands out of its noise, with a margin, Hz: above it, nothing is known of the torque.
    pub cut_off: f64,
    /// The sample time, s.
    pub sample_time: f64,
}

impl NeededTorque {
    /// A torque of this motion without what is above the cut-off, and without both ends, at which accelerations are not known.
    pub fn in_band(&self, torque: &[f64]) -> Vec<f64> {
        let mut smooth = Reflected::new(torque, self.sample_time).smoothed(self.cut_off);
        let ends = (ENDS / (self.cut_off * self.sample_time)).ceil() as usize;
        let ends = ends.min(smooth.len() / LONGEST_ENDS);
        smooth.truncate(smooth.len() - ends);
        smooth.split_off(ends)
    }
}

impl IdentifiedCurve {
    /// The torque of the curve at a velocity or deflection: by its best form where that lies within the band of the free curve or where
    /// the log has no data, otherwise by the free curve.
    pub fn torque(&self, x: f64) -> f64 {
        let form = self.best().torque(x);
        let (band, at) = (&self.band, &self.band.x[0]);
        let right = at.partition_point(|point| *point < x);
        if right == 0 || right == at.len() {
            return form;
        }
        let share = (x - at[right - 1]) / (at[right] - at[right - 1]);
        let between = |values: &[f64]| values[right - 1] + share * (values[right] - values[right - 1]);
        match (between(&band.lower)..=between(&band.upper)).contains(&form) {
            true => form,
            false => between(&band.estimate),
        }
    }

    /// Whether a velocity or deflection is in the range of the log.
    fn saw(&self, x: f64) -> bool {
        let at = &self.band.x[0];
        (at[0]..=at[at.len() - 1]).contains(&x)
    }
}

impl RigidAxis {
    /// The torque that this motion needs; of a joint whose motor and link move as one, at its motor.
    ///
    /// # Errors
    /// [`Error::Data`](crate::Error::Data) and [`Error::Parameter`](crate::Error::Parameter) for samples that cannot be used.
    pub fn needed_torque(&self, motion: &JointMotion) -> Result<NeededTorque> {
        motion.check()?;
        let position = match motion.motor.filter(|_| self.stiff.is_some()) {
            Some(motor) => motor,
            None => motion.position,
        };
        let rates = Rates::new(position, motion.velocity, motion.sample_time);
        let position_dependent = self.position_torque(position);
        let torque = (0..position.len()).map(|i| {
            let friction = self.friction.torque(rates.velocity[i]);
            self.inertia.value * rates.acceleration[i] + friction + position_dependent[i] + motion.load_at(i)
        });
        Ok(NeededTorque {
            torque: late(torque.collect(), &self.findings, motion.sample_time),
            unseen: unseen(&[(&self.friction, &rates.velocity)]),
            velocity: rates.velocity,
            cut_off: rates.cut_off,
            sample_time: motion.sample_time,
        })
    }

    /// The position-dependent torques.
    fn position_torque(&self, position: &[f64]) -> Vec<f64> {
        let [cosine, sine, spring] = self.position_dependent();
        let torque = |q: &f64| cosine * q.cos() + sine * q.sin() + spring * q;
        position.iter().map(torque).collect()
    }
}

impl FlexibleAxis {
    /// The torque at the motor that this motion of motor and link needs.
    ///
    /// # Errors
    /// As [`RigidAxis::needed_torque`].
    pub fn needed_torque(&self, motion: &JointMotion) -> Result<NeededTorque> {
        motion.check()?;
        let step = motion.sample_time;
        let offset = self.link.findings.iter().find_map(|finding| match finding {
            Finding::EncoderClocks { offset, .. } => Some(*offset),
            _ => None,
        });
        let shifted = offset.map(|offset| Reflected::new(motion.position, step).shifted(offset));
        let link = shifted.as_deref().unwrap_or(motion.position);
        let [of_link, of_motor] = [link, motion.motor.unwrap_or(link)].map(|angle| Rates::new(angle, None, step));
        let position_dependent = self.link.position_torque(link);
        let torque = (0..link.len()).map(|i| {
            let inertias =
                self.motor_inertia.value * of_motor.acceleration[i] + self.link.inertia.value * of_link.acceleration[i];
            let at_motor = (self.motor_friction.as_ref()).map_or(0.0, |curve| curve.torque(of_motor.velocity[i]));
            let besides = position_dependent[i] + motion.load_at(i);
            inertias + at_motor + self.link.friction.torque(of_link.velocity[i]) + besides
        });
        let curves = [(&self.link.friction, &of_link.velocity)].into_iter();
        let curves = curves.chain(self.motor_friction.as_ref().map(|curve| (curve, &of_motor.velocity)));
        Ok(NeededTorque {
            torque: late(torque.collect(), &self.link.findings, step),
            unseen: unseen(&curves.collect::<Vec<_>>()),
            velocity: of_link.velocity,
            cut_off: of_motor.cut_off,
            sample_time: step,
        })
    }
}

impl JointMotion<'_> {
    /// The load at a sample; 0 without one.
    fn load_at(&self, sample: usize) -> f64 {
        self.load.map_or(0.0, |load| load.torque[sample])
    }

    fn check(&self) -> Result<()> {
        let angles = [("position", Some(self.position)), ("motor", self.motor)];
        let angles: Vec<_> = angles.into_iter().filter_map(|(name, x)| Some((name, x?))).collect();
        let others: Vec<_> = self.velocity.map(|v| ("velocity", v)).into_iter().collect();
        checks::usable(self.position.len(), &angles, &others, self.sample_time)?;
        checks::load(self.load, self.position.len())
    }
}

/// A torque that acted at these instants, as the log has it: its samples are earlier by the delay that the findings name.
fn late(torque: Vec<f64>, findings: &[Finding], step: f64) -> Vec<f64> {
    let delay = findings.iter().find_map(|finding| match finding {
        Finding::TorqueDelay { delay, .. } => Some(*delay),
        _ => None,
    });
    match delay {
        Some(delay) => Reflected::new(&torque, step).shifted(delay),
        None => torque,
    }
}

/// The share of samples at which at least one velocity is outside the range of its curve.
fn unseen(curves: &[(&IdentifiedCurve, &Vec<f64>)]) -> f64 {
    let samples = curves.first().map_or(0, |(_, velocity)| velocity.len());
    let outside = |i: &usize| curves.iter().any(|(curve, velocity)| !curve.saw(velocity[*i]));
    (0..samples).filter(outside).count() as f64 / samples.max(1) as f64
}
