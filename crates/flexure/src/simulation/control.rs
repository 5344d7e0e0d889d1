//! The control of the step size: which step to try, and what follows from its error.

use std::ops::ControlFlow;

use super::dop853::Statistics;
use super::step::{Arrival, StepError};
use super::tolerances::Tolerances;
use crate::error::{Error, IntegrationFailure, Result, SimulationError, Stopped};

/// Evaluations in a step of the explicit method before that at its end.
pub(super) const EVALUATIONS: u64 = 11;
/// Steps of the explicit method between two calls of the watch function.
pub(super) const STEPS_PER_CALL: u64 = 1024;
/// The safety factor, and the smallest and largest change of the step size from one step to the next. The factor costs an eighth more steps
/// than the usual 0.9 and more than halves the error.
const SAFETY: f64 = 0.8;
const SHRINK: f64 = 1.0 / 3.0;
const GROW: f64 = 6.0;
/// The boundary of the stability region on the negative real axis, and the number of steps near it after which the equations count as
/// stiff. Rounding and jumps of the input keep stiff components alive, so steps with tight tolerances stay below the boundary. Measured
/// products of step and eigenvalue at relative tolerances of 1e-3, 1e-6, 1e-9 and 1e-12: 6, 6, 3 to 6 and 1 to 3 where stability limits
/// the step, and 2.2, 0.8, 0.4 and 0.2 where accuracy does, of an oscillator.
const STABILITY: f64 = 6.1;
const NEAR: f64 = 12.0;
const STIFF_STEPS: u32 = 15;
/// The speed beyond which a joint runs away, rad/s or m/s: ten times the speed of the fastest spindles.
const FASTEST: f64 = 1e5;

/// One integration: the time, the step size found so far, and the cost.
#[derive(Debug, Clone)]
pub(super) struct Control {
    pub tolerances: Tolerances,
    pub t: f64,
    /// The step size to try next; `None` before the first step.
    pub step: Option<f64>,
    pub statistics: Statistics,
    /// Successive steps at the boundary of the stability region.
    stiff_steps: u32,
    /// Whether the step before was rejected.
    rejected: bool,
}

/// A step to try.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Attempt {
    /// Its size.
    pub h: f64,
    /// The size that accuracy alone would ask for.
    preferred: f64,
    /// Where it ends.
    pub end: f64,
}

impl Control {
    /// Starts at time `t` in the state of the components `x`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a tolerance outside its range or a state that is not finite.
    pub fn new(t: f64, x: &[f64], tolerances: Tolerances) -> Result<Self> {
        tolerances.check()?;
        if let Some(i) = x.iter().position(|v| !v.is_finite()) {
            return Err(Error::parameter(
                format!("component {i} of the initial state"),
                x[i],
                "finite",
            ));
        }
        Ok(Control {
            tolerances,
            t,
            step: None,
            statistics: Statistics::default(),
            stiff_steps: 0,
            rejected: false,
        })
    }

    pub fn failure(&self, reason: IntegrationFailure) -> Error {
        Error::Simulation(SimulationError { time: self.t, reason })
    }

    /// Refuses more instants than the permitted number of steps, as each takes at least one step.
    pub fn check_instants(&self, instants: usize) -> Result<()> {
        let limit = self.tolerances.max_steps;
        let needed = (instants as u64).saturating_sub(1);
        if needed <= limit.saturating_sub(self.statistics.accepted) {
            return Ok(());
        }
        let requirement = "at least the number of samples, as each takes a step; raise it, or lengthen the sample time";
        Err(Error::parameter("max_steps", limit as f64, requirement))
    }

    /// Refuses a derivative that is not finite.
    pub fn check_slope(&mut self, finite: bool) -> Result<()> {
        self.statistics.evaluations += 1;
        match finite {
            true => Ok(()),
            false => Err(self.failure(IntegrationFailure::NotFinite)),
        }
    }

    /// The next step of about the size `preferred` towards `t_end`, which takes so many evaluations.
    ///
    /// # Errors
    /// [`Error::Simulation`] if another step would exceed the permitted number.
    pub fn attempt(&mut self, preferred: f64, t_end: f64, evaluations: u64) -> Result<Attempt> {
        let limit = self.tolerances.max_steps;
        if self.statistics.accepted + self.statistics.rejected >= limit {
            let stiff = self.is_stiff();
            return Err(self.failure(IntegrationFailure::TooManySteps { limit, stiff }));
        }
        self.statistics.evaluations += evaluations;
        let remaining = t_end - self.t;
        let h = fit(preferred, remaining);
        let end = if h == remaining { t_end } else { self.t + h };
        Ok(Attempt { h, preferred, end })
    }

    /// Goes to the end of a step that is accurate enough.
    ///
    /// # Errors
    /// [`Error::Simulation`] if the motion is not finite or too fast there.
    pub fn accept(&mut self, attempt: &Attempt, error: &StepError<f64>, arrival: &Arrival<f64>) -> Result<()> {
        self.statistics.evaluations += 1;
        self.statistics.accepted += 1;
        self.judge_stiffness(arrival, attempt.h);
        self.t = attempt.end;
        if arrival.still != 0.0 {
            return Err(self.failure(IntegrationFailure::NotFinite));
        }
        if arrival.speed > FASTEST {
            return Err(self.failure(IntegrationFailure::TooFast { limit: FASTEST }));
        }
        let limit = if self.rejected { 1.0 } else { GROW };
        let next = attempt.h * (SAFETY * error.value().powf(-0.125)).clamp(SHRINK, limit);
        // A step that was made much shorter to end at a given time says little about the best step size.
        let shortened = attempt.h < 0.5 * attempt.preferred;
        self.step = Some(if shortened { attempt.preferred } else { next });
        self.rejected = false;
        Ok(())
    }

    /// Chooses a smaller step after one with too large an error.
    ///
    /// # Errors
    /// [`Error::Simulation`] if it would be too small.
    pub fn reject(&mut self, attempt: &Attempt, error: &StepError<f64>, t_end: f64) -> Result<()> {
        let error = error.value();
        let factor = if error.is_finite() {
            (SAFETY * error.powf(-0.125)).max(SHRINK)
        } else {
            0.1
        };
        self.shrink(attempt, factor, t_end)
    }

    /// Chooses a smaller step after one that failed.
    ///
    /// # Errors
    /// [`Error::Simulation`] if it would be too small.
    pub fn shrink(&mut self, attempt: &Attempt, factor: f64, t_end: f64) -> Result<()> {
        self.statistics.rejected += 1;
        self.rejected = true;
        let smaller = attempt.h * factor;
        if smaller < 16.0 * f64::EPSILON * self.t.abs().max(t_end.abs()) {
            return Err(self.failure(IntegrationFailure::StepTooSmall { step: smaller }));
        }
        self.step = Some(smaller);
        Ok(())
    }

    /// Calls `watch` every so many steps.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn show(&self, every: u64, watch: &mut dyn FnMut(f64) -> ControlFlow<()>) -> Result<()> {
        if self.statistics.accepted.is_multiple_of(every) && watch(self.t).is_break() {
            return Err(Error::Stopped(Stopped::Simulating { time: self.t }));
        }
        Ok(())
    }

    /// Whether the last step was rejected, or there was none.
    pub fn is_uncertain(&self) -> bool {
        self.rejected || self.statistics.accepted == 0
    }

    /// How many of the last steps had a size that was limited by stability and not by accuracy.
    pub fn stiff_steps(&self) -> u32 {
        self.stiff_steps
    }

    /// Whether the equations count as stiff.
    pub fn is_stiff(&self) -> bool {
        self.is_stiff_for(1)
    }

    /// Whether they were stiff for a multiple of the usual steps.
    pub fn is_stiff_for(&self, multiple: u32) -> bool {
        self.stiff_steps >= STIFF_STEPS.saturating_mul(multiple)
    }

    /// Forgets the steps that were limited by stability.
    pub fn forget_stiffness(&mut self) {
        self.stiff_steps = 0;
    }

    /// Counts steps whose size is limited by stability and not by accuracy.
    fn judge_stiffness(&mut self, arrival: &Arrival<f64>, h: f64) {
        let limit = STABILITY.min(NEAR * self.tolerances.rtol.powf(0.1));
        if arrival.run > 0.0 && h * (arrival.rise / arrival.run).sqrt() > limit {
            self.stiff_steps = self.stiff_steps.saturating_add(1);
        } else {
            self.stiff_steps = self.stiff_steps.saturating_sub(1).min(STIFF_STEPS);
        }
    }

    /// The root mean square of `v` in units of the tolerances at the state `x`.
    fn norm(&self, x: &[f64], v: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (v, x) in v.iter().zip(x) {
            let scaled = v / (self.tolerances.atol + self.tolerances.rtol * x.abs());
            sum += scaled * scaled;
        }
        (sum / v.len() as f64).sqrt()
    }

    /// The beginning of a search for the first step size from the sizes of the first two derivatives (section II.4 of the book): a short
    /// step by Euler's method.
    pub fn short_step(&self, x: &[f64], slope: &[f64], span: f64) -> f64 {
        let (d0, d1) = (self.norm(x, x), self.norm(x, slope));
        if d0 < 1e-5 || d1 < 1e-5 { 1e-6 } else { 0.01 * d0 / d1 }.min(span)
    }

    /// The end of that search, where the slope changes by `change` over the short step.
    pub fn first_step(&mut self, x: &[f64], slope: &[f64], change: &[f64], short: f64) -> f64 {
        self.statistics.evaluations += 1;
        let largest = self.norm(x, slope).max(self.norm(x, change) / short);
        let second = if largest <= 1e-15 {
            (1e-3 * short).max(1e-6)
        } else {
            (0.01 / largest).powf(0.125)
        };
        // The slope after the short step may have overflowed; then `second` is not a number and `min` drops it.
        (100.0 * short).min(second)
    }
}

/// The step to take if `preferred` is wanted and `remaining` is left.
///
/// The last two steps are equal, so that none is tiny.
fn fit(preferred: f64, remaining: f64) -> f64 {
    if 1.01 * preferred >= remaining {
        remaining
    } else if 2.0 * preferred > remaining {
        0.5 * remaining
    } else {
        preferred
    }
}
