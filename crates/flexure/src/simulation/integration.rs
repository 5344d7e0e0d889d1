//! The choice between the explicit and the implicit method.
//!
//! The explicit method, [`Dop853`], begins. Where stability and not accuracy has limited its step fifteen times (Hairer, Norsett & Wanner,
//! Solving Ordinary Differential Equations I, section II.10), the implicit one, Radau IIA of order 13, goes on. It stays if it gets further
//! for its work, and from time to time the explicit one is tried again. Work is counted, not timed: every run takes the same steps.

use std::ops::ControlFlow;

use super::control::STEPS_PER_CALL;
use super::dop853::{Dop853, StateVector, Statistics};
use super::radau::{Point, Radau};
use super::tolerances::Tolerances;
use crate::error::{Error, IntegrationFailure, Result};

/// Implicit steps after which the two methods are compared.
const TRIAL: u64 = 25;
/// The work between two trials of the explicit method, in evaluations of the right-hand side: some fifty times that of a trial.
const REVIEW: f64 = 1e4;
/// Implicit steps between two calls of the watch function.
const IMPLICIT_STEPS_PER_CALL: u64 = 16;

/// The method of an integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Integrator {
    /// [`Integrator::Dop853`] where the equations are not stiff, and otherwise that of the two that gets further for its work.
    #[default]
    Automatic,
    /// The explicit method of Dormand and Prince of order 8, [`Dop853`].
    Dop853,
    /// The implicit method Radau IIA of order 13.
    Radau,
}

/// What advances an initial-value problem.
pub trait Advance<X> {
    /// The time reached.
    fn t(&self) -> f64;

    /// The state at that time.
    fn x(&self) -> &X;

    /// Declares that the right-hand side jumps at the present time.
    fn restart(&mut self);

    /// Integrates `x' = rhs(t, x)` to exactly `t_end`, as [`Dop853::advance`].
    ///
    /// # Errors
    /// Those of [`Dop853::advance`].
    fn advance<F>(&mut self, rhs: &F, t_end: f64, watch: &mut dyn FnMut(f64) -> ControlFlow<()>) -> Result<()>
    where
        F: Fn(f64, &X) -> X;

    /// Refuses more instants than the permitted number of steps, as each takes at least one step.
    ///
    /// # Errors
    /// [`Error::Parameter`](crate::Error::Parameter).
    fn check_instants(&self, instants: usize) -> Result<()>;
}

impl<X: StateVector> Advance<X> for Dop853<X> {
    fn t(&self) -> f64 {
        self.t()
    }

    fn x(&self) -> &X {
        self.x()
    }

    fn restart(&mut self) {
        self.restart();
    }

    fn advance<F>(&mut self, rhs: &F, t_end: f64, watch: &mut dyn FnMut(f64) -> ControlFlow<()>) -> Result<()>
    where
        F: Fn(f64, &X) -> X,
    {
        self.advance(rhs, t_end, watch)
    }

    fn check_instants(&self, instants: usize) -> Result<()> {
        self.control.check_instants(instants)
    }
}

/// An initial-value problem under way, by the method that suits it.
///
/// ```
/// use flexure::simulation::{Advance, Integration, Integrator, Tolerances};
///
/// // A fast decay onto a slow cosine.
/// let rhs = |t: f64, x: &[f64; 1]| [-1e6 * (x[0] - t.cos())];
/// let mut run = Integration::new(0.0, [0.0], Tolerances::default(), Integrator::Automatic)?;
/// run.advance(&rhs, 1.0, &mut |_| std::ops::ControlFlow::Continue(()))?;
/// assert!((run.x()[0] - 1.0_f64.cos()).abs() < 2e-6 && run.statistics().evaluations < 5000);
/// # Ok::<(), flexure::Error>(())
/// ```
pub struct Integration<X> {
    run: Dop853<X>,
    radau: Radau,
    integrator: Integrator,
    implicit: bool,
    /// Where and at which cost the present comparison began.
    mark: Mark,
    /// Where the present turn of the implicit method began.
    turn: Mark,
    /// The progress of the explicit method where it was stiff, s per evaluation, and its step there.
    explicit: (f64, f64),
    /// How many steps are stiff before the implicit method is tried, as a multiple of the usual.
    patience: u32,
}

/// A time and the cost until then.
#[derive(Debug, Clone, Copy, Default)]
struct Mark {
    t: f64,
    work: f64,
    accepted: u64,
}

impl<X: StateVector> Integration<X> {
    /// Starts at time `t` in the state `x`.
    ///
    /// # Errors
    /// [`Error::Parameter`](crate::Error::Parameter) for a tolerance outside its range or a state that is not finite.
    pub fn new(t: f64, x: X, tolerances: Tolerances, integrator: Integrator) -> Result<Self> {
        Ok(Integration {
            run: Dop853::new(t, x, tolerances)?,
            radau: Radau::new(),
            integrator,
            implicit: integrator == Integrator::Radau,
            mark: Mark { t, ..Mark::default() },
            turn: Mark::default(),
            explicit: (0.0, 0.0),
            patience: 1,
        })
    }

    /// As [`Dop853::with_speeds_from`].
    #[must_use]
    pub fn with_speeds_from(mut self, first: usize) -> Self {
        self.run.first_speed = first;
        self
    }

    /// The cost so far, of both methods.
    pub fn statistics(&self) -> Statistics {
        self.run.statistics()
    }

    /// The time and the cost so far.
    fn mark(&self) -> Mark {
        let statistics = self.run.statistics();
        Mark {
            t: self.run.t(),
            work: statistics.evaluations as f64 + self.radau.factorised,
            accepted: statistics.accepted,
        }
    }

    /// After an explicit step: whether the implicit method should go on.
    fn judge_explicit(&mut self) {
        let stiff = self.run.control.stiff_steps();
        if stiff == 0 {
            self.mark = self.mark();
        } else if self.run.control.is_stiff_for(self.patience) {
            let now = self.mark();
            let step = self.run.control.step.unwrap_or_default();
            self.explicit = ((now.t - self.mark.t) / (now.work - self.mark.work), step);
            (self.implicit, self.mark, self.turn) = (true, now, now);
            self.radau.resume();
        }
    }

    /// After an implicit step: whether the explicit method should go on.
    fn judge_implicit(&mut self) {
        let now = self.mark();
        if now.accepted - self.mark.accepted < TRIAL {
            return;
        }
        let slower = now.t - self.mark.t < self.explicit.0 * (now.work - self.mark.work);
        self.mark = now;
        if slower || now.work - self.turn.work > REVIEW {
            self.go_explicitly(slower);
        }
    }

    /// Lets the explicit method go on; for longer if the implicit one was of no use.
    fn go_explicitly(&mut self, useless: bool) {
        self.patience = if useless { self.patience.saturating_mul(4) } else { 1 };
        self.run.control.step = Some(self.explicit.1);
        self.run.control.forget_stiffness();
        self.implicit = false;
    }

    /// Tries an implicit step from where the derivative is `slope`.
    fn step_implicitly<F>(&mut self, rhs: &F, mut slope: X, preferred: f64, t_end: f64) -> Result<bool>
    where
        F: Fn(f64, &X) -> X,
    {
        let at = Point {
            x: &mut self.run.x,
            slope: &mut slope,
            first_speed: self.run.first_speed,
        };
        let tried = (self.radau).step(&mut self.run.control, at, preferred, t_end, rhs);
        self.run.slope = Some(slope);
        let reason = match &tried {
            Err(Error::Simulation(failed)) => Some(failed.reason),
            _ => None,
        };
        let too_small = matches!(reason, Some(IntegrationFailure::StepTooSmall { .. }));
        if too_small && self.integrator == Integrator::Automatic {
            self.go_explicitly(true);
            return Ok(false);
        }
        tried
    }
}

impl<X: StateVector> Advance<X> for Integration<X> {
    fn t(&self) -> f64 {
        self.run.t()
    }

    fn x(&self) -> &X {
        self.run.x()
    }

    fn restart(&mut self) {
        self.run.restart();
        self.radau.restart();
    }

    fn advance<F>(&mut self, rhs: &F, t_end: f64, watch: &mut dyn FnMut(f64) -> ControlFlow<()>) -> Result<()>
    where
        F: Fn(f64, &X) -> X,
    {
        while self.run.t() < t_end {
            let slope = self.run.slope(rhs)?;
            let preferred = self.run.preferred_step(rhs, &slope, t_end);
            if !self.implicit {
                if self.run.step(rhs, &slope, preferred, t_end)? {
                    self.run.control.show(STEPS_PER_CALL, watch)?;
                    if self.integrator == Integrator::Automatic {
                        self.judge_explicit();
                    }
                }
                continue;
            }
            if self.step_implicitly(rhs, slope, preferred, t_end)? {
                self.run.control.show(IMPLICIT_STEPS_PER_CALL, watch)?;
                if self.integrator == Integrator::Automatic {
                    self.judge_implicit();
                }
            }
        }
        Ok(())
    }

    fn check_instants(&self, instants: usize) -> Result<()> {
        self.run.control.check_instants(instants)
    }
}

#[cfg(test)]
#[path = "integration_tests.rs"]
mod tests;
