//! How the samples of a logged torque act on a joint.

use super::clock_offset::shifted;
use super::equations::Lines;
use super::fourier::Modulation;

/// How the samples of a torque act.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Acting {
    /// The time from a sample to the middle of its effect, in samples.
    pub delay: f64,
    /// Whether each sample acts for a whole sample time. Otherwise the torque changes evenly from sample to sample.
    pub held: bool,
}

impl Acting {
    /// A torque that acts when it is logged, and changes evenly from sample to sample.
    pub const AT_ONCE: Acting = Acting {
        delay: 0.0,
        held: false,
    };

    /// A torque that acts from this number of samples after its sample on, until the next one acts.
    pub const fn held_after(samples: f64) -> Acting {
        Acting {
            delay: samples + 0.5,
            held: true,
        }
    }

    /// Whether a torque acts from its sample on, or at it.
    pub fn is_usual(&self) -> bool {
        (0.0..1.0).contains(&self.delay)
    }

    /// The torque that acts at this time, which is counted in samples.
    pub fn at(&self, torque: &[f64], time: f64) -> f64 {
        let last = torque.len() - 1;
        let place = (time - self.delay).clamp(0.0, last as f64);
        if self.held {
            return torque[(place + 0.5).floor() as usize];
        }
        let before = (place.floor() as usize).min(last.saturating_sub(1));
        let part = place - before as f64;
        torque[before] + part * (torque[(before + 1).min(last)] - torque[before])
    }

    /// The lines of the torque at the time of its effect.
    pub fn lines(&self, modulation: &Modulation, torque: &[f64], step: f64) -> Lines {
        self.late(modulation, modulation.of(torque), step)
    }

    /// The lines of a signal that acts as the torque does.
    pub fn late(&self, modulation: &Modulation, lines: Lines, step: f64) -> Lines {
        let mut lines = match self.delay == 0.0 {
            true => lines,
            false => shifted(lines, modulation, self.delay * step),
        };
        if self.held {
            modulation.take_mean(&mut lines);
        }
        lines
    }
}
