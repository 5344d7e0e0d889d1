//! The explicit Runge-Kutta method of Dormand and Prince of order 8 with step-size control.
//!
//! One step from \\((t, x)\\) to \\((t + h, x_1)\\) evaluates
//! \\(k_i = f(t + c_i h,\ x + h \sum_{j<i} a_{ij} k_j)\\), \\(i = 1 \ldots 12\\), and
//! \\(x_1 = x + h \sum b_i k_i\\). Two embedded estimators, of orders 5 and 3, are combined into the
//! error of the step, \\(e = h\, e_5^2 / \sqrt{n (e_5^2 + 0.01\, e_3^2)}\\), each component measured
//! against `atol + rtol * max(|x|, |x_1|)`; a step is accepted when \\(e \le 1\\), and the next one
//! is \\(0.8\, e^{-1/8}\\) times as long, within factors of 1/3 and 6 (Hairer, Norsett & Wanner,
//! Solving Ordinary Differential Equations I, section II.10).
//!
//! A state is an array or a boxed slice. The dimension of an array is fixed at compile time, and it allocates nothing. Steps end exactly at
//! the instants at which a value is wanted or the input jumps. The step size is kept across them, so neither costs a new search for it.

use std::ops::ControlFlow;

use super::control::{Control, EVALUATIONS, STEPS_PER_CALL};
use super::step::{combine, step};
use super::tolerances::Tolerances;
use crate::error::Result;

/// The cost of an integration so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Statistics {
    /// Accepted steps.
    pub accepted: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Evaluations of the right-hand side.
    pub evaluations: u64,
}

/// A vector of the components of a state.
pub trait StateVector: Clone {
    /// The components.
    fn components(&self) -> &[f64];

    /// The components, to write to.
    fn components_mut(&mut self) -> &mut [f64];

    /// The zero vector of this dimension.
    #[must_use]
    fn zero(&self) -> Self;
}

impl<const N: usize> StateVector for [f64; N] {
    #[inline(always)]
    fn components(&self) -> &[f64] {
        self
    }

    #[inline(always)]
    fn components_mut(&mut self) -> &mut [f64] {
        self
    }

    #[inline(always)]
    fn zero(&self) -> Self {
        [0.0; N]
    }
}

impl StateVector for Box<[f64]> {
    fn components(&self) -> &[f64] {
        self
    }

    fn components_mut(&mut self) -> &mut [f64] {
        self
    }

    fn zero(&self) -> Self {
        vec![0.0; self.len()].into()
    }
}

/// An initial-value problem under way: the time, the state, and the step size found so far.
#[derive(Debug, Clone)]
pub struct Dop853<X> {
    pub(super) control: Control,
    pub(super) x: X,
    /// The derivative at the present time and state, if the right-hand side has not changed since.
    pub(super) slope: Option<X>,
    /// The first component that is a speed; the number of components if none is.
    pub(super) first_speed: usize,
}

impl<X: StateVector> Dop853<X> {
    /// Starts at time `t` in the state `x`.
    ///
    /// # Errors
    /// [`Error::Parameter`](crate::Error::Parameter) for a tolerance outside its range or a state that is not finite.
    pub fn new(t: f64, x: X, tolerances: Tolerances) -> Result<Self> {
        Ok(Dop853 {
            control: Control::new(t, x.components(), tolerances)?,
            first_speed: x.components().len(),
            x,
            slope: None,
        })
    }

    /// Declares the components from `first` on as speeds. A motion that runs away would take more and more steps. It ends at 1e5 rad/s or
    /// m/s.
    #[must_use]
    pub fn with_speeds_from(self, first: usize) -> Self {
        Dop853 {
            first_speed: first,
            ..self
        }
    }

    /// The time reached.
    pub fn t(&self) -> f64 {
        self.control.t
    }

    /// The state at that time.
    pub fn x(&self) -> &X {
        &self.x
    }

    /// The cost so far.
    pub fn statistics(&self) -> Statistics {
        self.control.statistics
    }

    /// Declares that the right-hand side jumps at the present time. The next step then evaluates it anew.
    pub fn restart(&mut self) {
        self.slope = None;
    }

    /// Integrates `x' = rhs(t, x)` to exactly `t_end`.
    ///
    /// `rhs` must be smooth in `(t_now, t_end)`; where it jumps, end one call and begin the next
    /// after [`Dop853::restart`]. `watch` is called with the time now and then; `Break` stops.
    ///
    /// # Errors
    /// [`Error::Simulation`](crate::Error::Simulation) with the time and the reason; [`Error::Stopped`](crate::Error::Stopped).
    pub fn advance<F>(&mut self, rhs: &F, t_end: f64, watch: &mut dyn FnMut(f64) -> ControlFlow<()>) -> Result<()>
    where
        F: Fn(f64, &X) -> X,
    {
        while self.control.t < t_end {
            let slope = self.slope(rhs)?;
            let preferred = self.preferred_step(rhs, &slope, t_end);
            if self.step(rhs, &slope, preferred, t_end)? {
                self.control.show(STEPS_PER_CALL, watch)?;
            }
        }
        Ok(())
    }

    /// Tries one step of about the size `preferred` towards `t_end` from where the derivative is `slope`, and goes to its end if it is
    /// accurate enough.
    pub(super) fn step<F>(&mut self, rhs: &F, slope: &X, preferred: f64, t_end: f64) -> Result<bool>
    where
        F: Fn(f64, &X) -> X,
    {
        let attempt = self.control.attempt(preferred, t_end, EVALUATIONS)?;
        let trial = step(rhs, self.control.t, &self.x, slope, attempt.h);
        let error = trial.error(&self.control.tolerances, &self.x, attempt.h);
        if !(error.value() <= 1.0) {
            self.control.reject(&attempt, &error, t_end)?;
            return Ok(false);
        }
        let slope_new = rhs(attempt.end, &trial.x);
        let arrival = trial.arrival(&slope_new, self.first_speed, 0.0);
        (self.x, self.slope) = (trial.x, Some(slope_new));
        self.control.accept(&attempt, &error, &arrival)?;
        Ok(true)
    }

    /// The derivative at the present time and state.
    pub(super) fn slope<F: Fn(f64, &X) -> X>(&mut self, rhs: &F) -> Result<X> {
        if let Some(slope) = &self.slope {
            return Ok(slope.clone());
        }
        let slope = rhs(self.control.t, &self.x);
        let finite = slope.components().iter().all(|v| v.is_finite());
        self.control.check_slope(finite)?;
        self.slope = Some(slope.clone());
        Ok(slope)
    }

    /// The size of the next step that accuracy asks for.
    pub(super) fn preferred_step<F: Fn(f64, &X) -> X>(&mut self, rhs: &F, slope: &X, t_end: f64) -> f64 {
        match self.control.step {
            Some(step) => step,
            None => self.first_step(rhs, slope, t_end - self.control.t),
        }
    }

    /// A first step size.
    fn first_step<F: Fn(f64, &X) -> X>(&mut self, rhs: &F, slope: &X, span: f64) -> f64 {
        let (x, components) = (self.x.components(), slope.components());
        let short = self.control.short_step(x, components, span);
        let mut change = rhs(
            self.control.t + short,
            &combine(&self.x, short, &[1.0], std::slice::from_ref(slope)),
        );
        for (c, s) in change.components_mut().iter_mut().zip(components) {
            *c -= s;
        }
        (self.control).first_step(x, components, change.components(), short)
    }
}

#[cfg(test)]
#[path = "dop853_tests.rs"]
mod tests;
