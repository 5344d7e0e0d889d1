//! A change of the mean of white Gaussian noise, found by cumulated sums on both sides (Page 1954, Continuous inspection schemes,
//! Biometrika 41):
//!
//! $$ g^\pm_k = \max(0, g^\pm_{k-1} \pm x_k / \sigma - \delta / 2), \qquad \text{alarm where } g^\pm > h $$
//!
//! for a change of \\(\delta\\) standard deviations. By Siegmund's approximation (1985, Sequential Analysis, section II.6) an alarm of one
//! side comes after \\(L(\mu) = (e^{-2 \mu b} + 2 \mu b - 1) / (2 \mu^2)\\) samples on average, with \\(b = h + 1.166\\) and \\(\mu\\) the
//! mean of the summed steps: \\(-\delta/2\\) without a change, \\(\delta/2\\) with it.

use super::checkpoint::Checkpoint;
use crate::error::{Error, Result};

/// The mean overshoot on both sides of Siegmund's approximation.
const OVERSHOOT: f64 = 1.166;

/// A detector of changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cusum {
    deviation: f64,
    change: f64,
    threshold: f64,
    sums: [f64; 2],
}

/// The mean number of samples until a sum with steps of this mean passes the threshold.
fn mean_run(mean: f64, threshold: f64) -> f64 {
    let b = threshold + OVERSHOOT;
    ((-2.0 * mean * b).exp() + 2.0 * mean * b - 1.0) / (2.0 * mean * mean)
}

impl Cusum {
    /// A detector for changes of `change` standard deviations, in white noise with the standard deviation `deviation`, with one false alarm
    /// in `quiet` samples on average.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless the deviation is positive, the change from 0.01 to 10, and the samples from 100 to 1e15.
    ///
    /// ```
    /// use flexure::control::recursive::Cusum;
    /// let detector = Cusum::new(1.0, 1.0, 1e6)?;
    /// assert!(detector.mean_delay() < 30.0);
    /// # Ok::<(), flexure::Error>(())
    /// ```
    pub fn new(deviation: f64, change: f64, quiet: f64) -> Result<Self> {
        if !(deviation > 0.0 && deviation.is_finite()) {
            return Err(Error::parameter(
                "the noise's standard deviation",
                deviation,
                "positive and finite",
            ));
        }
        if !(0.01..=10.0).contains(&change) {
            return Err(Error::parameter(
                "the change",
                change,
                "from 0.01 to 10 standard deviations",
            ));
        }
        if !(1e2..=1e15).contains(&quiet) {
            return Err(Error::parameter(
                "the samples without a false alarm",
                quiet,
                "from 100 to 1e15",
            ));
        }
        // Each side may cause half of the alarms.
        let (mut low, mut high) = (0.0, 1e6);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            match mean_run(-0.5 * change, middle) < 2.0 * quiet {
                true => low = middle,
                false => high = middle,
            }
        }
        Ok(Cusum {
            deviation,
            change,
            threshold: high,
            sums: [0.0; 2],
        })
    }

    /// Takes a value. Returns 1 for the alarm of a change upwards, -1 for one downwards; after an alarm the sums begin again.
    pub fn push(&mut self, x: f64) -> Option<i8> {
        if !x.is_finite() {
            return None;
        }
        let scaled = x / self.deviation;
        let half = 0.5 * self.change;
        self.sums = [
            (self.sums[0] + scaled - half).max(0.0),
            (self.sums[1] - scaled - half).max(0.0),
        ];
        let side = self.sums.iter().position(|g| *g > self.threshold)?;
        self.sums = [0.0; 2];
        Some(if side == 0 { 1 } else { -1 })
    }

    /// A checkpoint.
    pub fn to_bytes(&self) -> Vec<u8> {
        let numbers = [self.deviation, self.change, self.threshold, self.sums[0], self.sums[1]];
        numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
    }

    /// The state of a checkpoint.
    ///
    /// # Errors
    /// [`Error::Parameter`] for bytes that are no checkpoint.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let mut checkpoint = Checkpoint::new(bytes);
        let [deviation, change, threshold, up, down] = [(); 5].map(|()| checkpoint.finite());
        let (deviation, change, threshold, sums) = (deviation?, change?, threshold?, [up?, down?]);
        checkpoint.end()?;
        checkpoint.check(
            deviation > 0.0
                && threshold > 0.0
                && (0.01..=10.0).contains(&change)
                && sums.iter().all(|sum| (0.0..=threshold).contains(sum)),
        )?;
        Ok(Cusum {
            deviation,
            change,
            threshold,
            sums,
        })
    }

    /// The threshold `h`, in standard deviations.
    pub fn threshold(&self) -> f64 {
        self.threshold
    }

    /// The mean number of samples from a change of the size `change` to its alarm.
    pub fn mean_delay(&self) -> f64 {
        mean_run(0.5 * self.change, self.threshold)
    }
}
