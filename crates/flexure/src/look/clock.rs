//! The instants of a record: the usual step, its jitter, gaps, and steps back.

use super::limits::GAP;
use crate::record::sample_clock;
use crate::sort;

/// The properties of a record's instants.
#[derive(Debug, Clone, PartialEq)]
pub struct Clock {
    /// The median step.
    pub step: f64,
    /// The largest deviation of a step from the median, in steps, without gaps and steps back.
    pub jitter: f64,
    /// Whether the instants are evenly spaced except for jitter, by the criterion of an identification:
    /// [`Record::sample_clock`](crate::Record::sample_clock).
    pub is_uniform: bool,
    /// Steps that are longer than one and a half of the median.
    pub gaps: Vec<Gap>,
    /// Samples that are not later than the one before.
    pub backwards: Vec<usize>,
    /// Instants that are missing or infinite.
    pub missing: usize,
    /// The last instant minus the first.
    pub duration: f64,
}

/// A step that is too long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// The sample after it.
    pub sample: usize,
    /// Its length in steps.
    pub steps: f64,
}

impl Clock {
    /// Looks at instants; `None` for fewer than two.
    pub fn new(instants: &[f64]) -> Option<Self> {
        let known: Vec<(usize, f64)> = instants
            .iter()
            .copied()
            .enumerate()
            .filter(|(_, t)| t.is_finite())
            .collect();
        let [(_, first), .., (_, last)] = known[..] else {
            return None;
        };
        let steps: Vec<(usize, f64)> = known.windows(2).map(|w| (w[1].0, w[1].1 - w[0].1)).collect();
        let forward: Vec<f64> = steps.iter().map(|s| s.1).filter(|s| *s > 0.0).collect();
        let step = match forward.is_empty() {
            true => return None,
            false => sort::median(forward),
        };
        let mut clock = Clock {
            step,
            jitter: 0.0,
            is_uniform: sample_clock(instants).is_ok(),
            gaps: Vec::new(),
            backwards: Vec::new(),
            missing: instants.len() - known.len(),
            duration: last - first,
        };
        for (sample, length) in steps {
            let steps = length / step;
            if !(length > 0.0) {
                clock.backwards.push(sample);
            } else if steps > 1.0 + GAP {
                clock.gaps.push(Gap { sample, steps });
            } else {
                clock.jitter = clock.jitter.max((steps - 1.0).abs());
            }
        }
        Some(clock)
    }

    /// Instants without gaps are always evenly spaced if their jitter, in steps, is at most this.
    pub const UNIFORM: f64 = 0.1;

    /// The sample time: the mean step for instants without gaps, since printed instants are rounded, and for those that jitter, with the
    /// samples that fit into the gaps; otherwise the median.
    pub fn usual_step(&self, samples: usize) -> f64 {
        let is_mean = self.gaps.is_empty() || self.jitter > Self::UNIFORM;
        match is_mean && self.backwards.is_empty() && self.missing == 0 && samples > 1 {
            true => self.duration / ((samples - 1) as f64 + self.lost()),
            false => self.step,
        }
    }

    /// Samples that fit into the gaps.
    pub fn lost(&self) -> f64 {
        self.gaps.iter().map(|gap| gap.steps.round() - 1.0).sum()
    }
}
