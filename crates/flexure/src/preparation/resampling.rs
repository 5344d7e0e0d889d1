//! Samples at a uniform grid of instants, from samples at instants that jitter or have gaps.
//!
//! 1. **Between the samples** a smooth signal is a cubic spline. A held signal is piecewise constant, and its new value is its mean over
//!    the new step.
//! 2. **Gaps** longer than a few steps are not bridged: there the new samples are missing.
//! 3. **Aliases**: if the new step is longer, a zero-phase low-pass first removes the frequencies that the new sampling cannot show.

use std::ops::Range;

use super::interpolation::Spline;
use super::{LONGEST_GAP, LowPass};
use crate::error::{DataError, Error, Result};
use crate::look::Clock;
use crate::record::rounded_step;
use crate::sort::median;

/// Order and cutoff, as a share of half the new sampling rate, of the filter against aliases: those of `decimate` in MATLAB and SciPy,
/// which use a Chebyshev filter. At 0.5 of half the rate 0.9995 of a sine remains, at 1.2 of it 0.0015.
const ALIAS_ORDER: usize = 8;
const ALIAS_CUTOFF: f64 = 0.8;
/// The share of a step by which two instants may differ and count as one: rounding of printed digits.
const ROUNDING: f64 = 1e-6;
/// A step is a gap from this many median steps on. If instants jitter by half a step, no step is more than twice as long.
const GAP: f64 = 2.5;
/// Aliases are removed if the new step is longer by more than this share. The usual step of jittering instants is not exact, and signals
/// that are resampled at their own rate must not be filtered. Convention.
const SAME_STEP: f64 = 0.1;
/// Most samples of a grid. Convention: 0.8 GB a column.
const MOST_SAMPLES: f64 = 1e8;

/// Uniform instants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// The first instant.
    pub start: f64,
    /// The step; positive and finite.
    pub step: f64,
    /// The number of instants.
    pub samples: usize,
}

impl Grid {
    /// The instants `first`, `first + step`, ... that do not exceed `last`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a step that is not positive and finite, or so short that there would be more than 100 million samples.
    pub fn over([first, last]: [f64; 2], step: f64) -> Result<Self> {
        if !(step > 0.0 && step.is_finite()) {
            return Err(Error::parameter("the new sample time", step, "positive and finite"));
        }
        let steps = ((last - first) / step + ROUNDING).floor();
        if !(steps < MOST_SAMPLES) {
            return Err(Error::parameter(
                "the new sample time",
                step,
                "long enough for at most 100 million samples",
            ));
        }
        Ok(Grid {
            start: first,
            step,
            samples: steps as usize + 1,
        })
    }

    /// Instant `i`. A step like 0.001 is applied as a division by 1000, so that instants print short: 0.003, not 0.003 + 4e-19.
    pub fn instant(&self, i: usize) -> f64 {
        let rate = (1.0 / self.step).round();
        let i = i as f64;
        match self.step < 1.0 && 1.0 / rate == self.step {
            true if (self.start * rate).fract() == 0.0 => (self.start * rate + i) / rate,
            true => self.start + i / rate,
            false => self.start + i * self.step,
        }
    }

    /// The instants for which the instants `t` stand, whose usual step is `step`: each is near one of its own. `None` where one is not.
    fn near(&self, t: &[f64], step: f64) -> Option<Vec<f64>> {
        if (self.step / step - 1.0).abs() > SAME_STEP {
            return None;
        }
        let mut last = f64::NEG_INFINITY;
        let near = t.iter().map(|t| {
            let i = ((t - self.start) / self.step).round();
            let instant = match i >= 0.0 {
                true => self.instant(i as usize),
                false => self.start + i * self.step,
            };
            let is_own = i > last && (t - instant).abs() <= Clock::UNIFORM * self.step;
            last = i;
            is_own.then_some(instant)
        });
        near.collect()
    }

    /// All instants.
    pub fn instants(&self) -> impl Iterator<Item = f64> {
        (0..self.samples).map(|i| self.instant(i))
    }
}

/// What a signal does between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Between {
    /// It is smooth.
    Smooth,
    /// It keeps its value until the next sample, as a command or a control output does.
    Held,
}

/// How a signal is brought to other instants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Resampling {
    /// What the signal does between its samples.
    pub between: Between,
    /// Most samples in a row that may be missing and are bridged.
    pub longest_gap: usize,
}

impl Default for Resampling {
    fn default() -> Self {
        Resampling {
            between: Between::Smooth,
            longest_gap: LONGEST_GAP,
        }
    }
}

/// The usual step of instants: the mean of the steps that are not gaps, with as many digits as the instants support.
///
/// # Errors
/// [`Error::Data`]: `NonFinite`, `TimeNotIncreasing` where time goes back, and `TooShort` for fewer than two different instants.
pub fn nominal_step(t: &[f64]) -> Result<f64> {
    if let Some(sample) = t.iter().position(|t| !t.is_finite()) {
        return Err(Error::not_finite("t", sample, t[sample]));
    }
    let steps: Vec<f64> = t.windows(2).map(|t| t[1] - t[0]).collect();
    if let Some(before) = steps.iter().position(|&step| step < 0.0) {
        let (sample, step) = (before + 1, steps[before]);
        return Err(Error::Data(DataError::TimeNotIncreasing { sample, step }));
    }
    let moving: Vec<f64> = steps.into_iter().filter(|&step| step > 0.0).collect();
    if moving.is_empty() {
        return Err(Error::too_short("a sample time", 2, t.len().min(1)));
    }
    let longest = GAP * median(moving.clone());
    let steps: Vec<f64> = moving.into_iter().filter(|&step| step < longest).collect();
    let mean = steps.iter().sum::<f64>() / steps.len() as f64;
    let deviation = steps
        .iter()
        .fold(0.0_f64, |largest, step| largest.max((step - mean).abs()));
    Ok(rounded_step(mean, t, deviation))
}

/// Interpolates up to `longest_gap` missing samples in a row of a signal at even instants, by the cubic spline through the samples around
/// them. Longer gaps stay missing, and so do missing samples at the ends.
pub fn fill(x: &[f64], longest_gap: usize) -> Vec<f64> {
    let t: Vec<f64> = (0..x.len()).map(|i| i as f64).collect();
    let points = Points::of(&t, x, longest_gap as f64 + 1.5);
    let mut filled = x.to_vec();
    points.interpolate(&t, |i, value| filled[i] = value);
    filled
}

impl Resampling {
    /// Whether samples of this step would show aliases on a grid, so that they are filtered first.
    pub fn slows(step: f64, grid: &Grid) -> bool {
        grid.step > step * (1.0 + SAME_STEP)
    }

    /// The cutoff of the filter against aliases for a grid, in cycles per unit of time.
    pub fn cutoff(grid: &Grid) -> f64 {
        ALIAS_CUTOFF * 0.5 / grid.step
    }

    /// The samples `x`, at the non-decreasing instants `t`, brought to a grid. NaN where there are none.
    ///
    /// Samples at the same instant are averaged.
    ///
    /// # Errors
    /// As [`nominal_step`]; [`Error::Data`]: `LengthMismatch`.
    pub fn resample(&self, t: &[f64], x: &[f64], grid: &Grid) -> Result<Vec<f64>> {
        if t.len() != x.len() {
            return Err(Error::length("x", x.len(), t.len()));
        }
        let step = nominal_step(t)?;
        let near = grid.near(t, step);
        let points = Points::of(near.as_deref().unwrap_or(t), x, (self.longest_gap as f64 + 1.5) * step);
        if self.between == Between::Held {
            return Ok(points.means(grid, step));
        }
        if !Self::slows(step, grid) {
            return Ok(points.smooth(grid));
        }
        // The signal is resampled on a grid as fine as the samples and filtered there. The new instants are every `every`-th instant of it.
        let every = (grid.step / step * (1.0 - ROUNDING)).ceil() as usize;
        let fine = Grid {
            start: grid.start,
            step: grid.step / every as f64,
            samples: (grid.samples.max(1) - 1) * every + 1,
        };
        let against_aliases = LowPass {
            cutoff: Self::cutoff(grid),
            order: ALIAS_ORDER,
        };
        let smooth = against_aliases.filter(&points.smooth(&fine), fine.step)?;
        Ok(smooth.into_iter().step_by(every).take(grid.samples).collect())
    }
}

/// The samples that are not missing, and their runs without a gap.
struct Points {
    t: Vec<f64>,
    x: Vec<f64>,
    runs: Vec<Range<usize>>,
}

impl Points {
    /// `t` must be non-decreasing and finite. A distance beyond `longest` is a gap.
    fn of(t: &[f64], x: &[f64], longest: f64) -> Self {
        let mut points = Points {
            t: Vec::with_capacity(t.len()),
            x: Vec::with_capacity(t.len()),
            runs: Vec::new(),
        };
        let present = t.iter().zip(x).filter(|(_, x)| x.is_finite());
        let present: Vec<(f64, f64)> = present.map(|(t, x)| (*t, *x)).collect();
        for together in present.chunk_by(|a, b| a.0 == b.0) {
            points.t.push(together[0].0);
            points
                .x
                .push(together.iter().map(|p| p.1).sum::<f64>() / together.len() as f64);
        }
        let mut start = 0;
        for run in points.t.chunk_by(|a, b| b - a <= longest) {
            points.runs.push(start..start + run.len());
            start += run.len();
        }
        points
    }

    /// Passes the spline's value to `put` for each of the increasing instants `at` that lies in a run, with a tolerance for rounding.
    fn interpolate(&self, at: &[f64], mut put: impl FnMut(usize, f64)) {
        let near = match at {
            [first, second, ..] => ROUNDING * (second - first),
            _ => 0.0,
        };
        let mut next = 0;
        for run in &self.runs {
            let (t, x) = (&self.t[run.clone()], &self.x[run.clone()]);
            let spline = Spline::new(t, x);
            while next < at.len() && at[next] <= t[t.len() - 1] + near {
                if at[next] >= t[0] - near {
                    put(next, spline.value(at[next]));
                }
                next += 1;
            }
        }
    }

    fn smooth(&self, grid: &Grid) -> Vec<f64> {
        let at: Vec<f64> = grid.instants().collect();
        let mut smooth = vec![f64::NAN; at.len()];
        self.interpolate(&at, |i, value| smooth[i] = value);
        smooth
    }

    /// The means of the held signal over the steps of a grid. Only steps count that begin where the signal has a value. Before a gap, and
    /// at the end, a value holds for one `step`.
    fn means(&self, grid: &Grid, step: f64) -> Vec<f64> {
        let near = ROUNDING * step.min(grid.step);
        let mut until: Vec<f64> = self.t.iter().skip(1).copied().chain([f64::INFINITY]).collect();
        for last in self.runs.iter().map(|run| run.end - 1) {
            until[last] = self.t[last] + step;
        }
        let mut first = 0;
        let mean = |from: f64| {
            while first < until.len() && until[first] <= from + near {
                first += 1;
            }
            if first == until.len() || self.t[first] > from + near {
                return f64::NAN;
            }
            let (value, end) = (self.x[first], from + grid.step);
            let (mut sum, mut length) = (0.0, 0.0);
            for i in (first..until.len()).take_while(|&i| self.t[i] < end - near) {
                let held = until[i].min(end) - self.t[i].max(from);
                sum += held * (self.x[i] - value);
                length += held;
            }
            value + sum / length
        };
        grid.instants().map(mean).collect()
    }
}
