//! The clocks of a joint's log: the delays of the samples of its signals.

use super::acting::Acting;
use super::equations::Lines;
use super::finding::Finding;
use super::fourier::Modulation;
use super::limits::{HELD_WITHIN, NEGLIGIBLE_OFFSET, SIGNIFICANT};
use super::motion::Motion;
use super::smooth::Reflected;
use crate::linalg::Complex;

/// The time by which a signal's samples are late.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ClockOffset {
    /// The time in s.
    pub value: f64,
    pub standard_error: f64,
    /// Whether it is more than chance, and more than a tiny part of a sample.
    pub significant: bool,
}

impl ClockOffset {
    /// An offset in a log with this sample time.
    pub fn new(value: f64, standard_error: f64, step: f64) -> Self {
        ClockOffset {
            value,
            standard_error,
            significant: value.abs() > SIGNIFICANT * standard_error && value.abs() > NEGLIGIBLE_OFFSET * step,
        }
    }

    /// Whether it is the delay of a torque that is held from sample to sample.
    pub fn is_hold(&self, step: f64) -> bool {
        self.is_near(0.5 * step, step)
    }

    /// Whether it is more than chance, and that of a torque held from sample to sample with this delay.
    pub fn is_near(&self, delay: f64, step: f64) -> bool {
        self.value.abs() > SIGNIFICANT * self.standard_error
            && (self.value - delay).abs() < HELD_WITHIN * step
            && self.standard_error < HELD_WITHIN * step
    }

    /// The finding about an offset between the encoders.
    pub fn finding(&self) -> Option<Finding> {
        self.significant.then_some(Finding::EncoderClocks {
            offset: self.value,
            standard_error: self.standard_error,
        })
    }
}

/// The clocks of a flexible joint's log, relative to the motor's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Clocks {
    /// The offset of the link's samples.
    pub link_offset: ClockOffset,
    /// The time from a torque's sample to its effect.
    pub torque_delay: ClockOffset,
    /// Whether this is the half sample of a held torque.
    pub torque_held: bool,
    /// Whether the motion reverses often enough to determine the clocks at all.
    pub determined: bool,
}

impl Clocks {
    /// The link's angle on the motor's clock.
    pub fn link(&self, motion: &Motion) -> Vec<f64> {
        match self.link_offset.significant {
            true => Reflected::new(motion.link, motion.step).shifted(self.link_offset.value),
            false => motion.link.to_vec(),
        }
    }

    /// The shift of the torque, s.
    pub fn delay(&self, step: f64) -> f64 {
        match (self.torque_held, self.torque_delay.significant) {
            (true, _) => 0.5 * step,
            (false, true) => self.torque_delay.value,
            (false, false) => 0.0,
        }
    }

    /// The torque that acts from each sample to the next: as logged if it is held, otherwise that in the middle between both.
    pub fn held_torque(&self, motion: &Motion) -> Vec<f64> {
        match self.torque_held {
            true => motion.torque.to_vec(),
            false => Reflected::new(motion.torque, motion.step).shifted(0.5 * motion.step - self.delay(motion.step)),
        }
    }

    /// The transformed torque at the time of its effect.
    pub fn torque(&self, modulation: &Modulation, motion: &Motion) -> Lines {
        if self.torque_held {
            held(modulation, motion.torque, motion.step)
        } else if self.torque_delay.significant {
            shifted(modulation.of(motion.torque), modulation, self.torque_delay.value)
        } else {
            modulation.of(motion.torque)
        }
    }

    /// The findings about the clocks.
    pub fn findings(&self) -> impl Iterator<Item = Finding> {
        let torque = self.torque_delay.significant.then_some(Finding::TorqueDelay {
            delay: self.torque_delay.value,
            held: self.torque_held,
        });
        self.link_offset.finding().into_iter().chain(torque)
    }
}

/// The lines of a signal that acts `delay` s after its samples.
pub(super) fn shifted(lines: Lines, modulation: &Modulation, delay: f64) -> Lines {
    let lines = lines.into_iter().zip(&modulation.omega);
    lines.map(|(v, w)| v * Complex::new(0.0, -w * delay).exp()).collect()
}

/// A transformed torque that is held from sample to sample: it is late by half a sample, and has the gain of a hold.
pub(super) fn held(modulation: &Modulation, torque: &[f64], step: f64) -> Lines {
    Acting::held_after(0.0).lines(modulation, torque, step)
}
