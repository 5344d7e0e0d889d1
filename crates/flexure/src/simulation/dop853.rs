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

use super::tableau::*;
use super::tolerances::Tolerances;
use crate::error::{Error, IntegrationFailure, Result, SimulationError, Stopped};

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

/// Steps between two calls of the watch function.
const STEPS_PER_CALL: u64 = 1024;
/// The safety factor, and the smallest and largest change of the step size from one step to the next. The factor costs an eighth more steps
/// than the usual 0.9 and more than halves the error.
const SAFETY: f64 = 0.8;
const SHRINK: f64 = 1.0 / 3.0;
const GROW: f64 = 6.0;
/// The boundary of the stability region on the negative real axis, and the number of steps on it
/// after which the equations count as stiff.
const STABILITY: f64 = 6.1;
const STIFF_STEPS: u32 = 15;

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

/// The speed beyond which a joint runs away, rad/s or m/s: ten times the speed of the fastest spindles.
const FASTEST: f64 = 1e5;

/// An initial-value problem under way: the time, the state, and the step size found so far.
#[derive(Debug, Clone)]
pub struct Dop853<X> {
    tolerances: Tolerances,
    t: f64,
    x: X,
    /// The derivative at `(t, x)`, if the right-hand side has not changed since.
    slope: Option<X>,
    /// The step size to try next; `None` before the first step.
    step: Option<f64>,
    statistics: Statistics,
    /// Successive steps at the boundary of the stability region.
    stiff_steps: u32,
    /// The first component that is a speed; the number of components if none is.
    first_speed: usize,
}

impl<X: StateVector> Dop853<X> {
    /// Starts at time `t` in the state `x`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a tolerance outside its range or a state that is not finite.
    pub fn new(t: f64, x: X, tolerances: Tolerances) -> Result<Self> {
        tolerances.check()?;
        if let Some(i) = x.components().iter().position(|v| !v.is_finite()) {
            return Err(Error::parameter(
                format!("component {i} of the initial state"),
                x.components()[i],
                "finite",
            ));
        }
        Ok(Dop853 {
            tolerances,
            t,
            first_speed: x.components().len(),
            x,
            slope: None,
            step: None,
            statistics: Statistics::default(),
            stiff_steps: 0,
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
        self.t
    }

    /// The state at that time.
    pub fn x(&self) -> &X {
        &self.x
    }

    /// The cost so far.
    pub fn statistics(&self) -> Statistics {
        self.statistics
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
    /// [`Error::Simulation`] with the time and the reason; [`Error::Stopped`].
    pub fn advance<F>(&mut self, rhs: &F, t_end: f64, watch: &mut dyn FnMut(f64) -> ControlFlow<()>) -> Result<()>
    where
        F: Fn(f64, &X) -> X,
    {
        let mut rejected = false;
        while self.t < t_end {
            let slope = match &self.slope {
                Some(slope) => slope.clone(),
                None => self.evaluate_slope(rhs)?,
            };
            let preferred = match self.step {
                Some(step) => step,
                None => self.first_step(rhs, &slope, t_end - self.t),
            };
            let remaining = t_end - self.t;
            let h = fit(preferred, remaining);
            self.count_step()?;
            let trial = step(rhs, self.t, &self.x, &slope, h);
            self.statistics.evaluations += 11;
            let error = self.error(&trial, h);
            if error <= 1.0 {
                let t_new = if h == remaining { t_end } else { self.t + h };
                let slope_new = rhs(t_new, &trial.x);
                self.statistics.evaluations += 1;
                self.statistics.accepted += 1;
                self.judge_stiffness(&trial, &slope_new, h);
                let finite = slope_new.components().iter().all(|v| v.is_finite());
                (self.t, self.x, self.slope) = (t_new, trial.x, Some(slope_new));
                if !finite {
                    return Err(self.failure(IntegrationFailure::NotFinite));
                }
                let mut speeds = self.x.components().iter().skip(self.first_speed);
                if speeds.any(|speed| speed.abs() > FASTEST) {
                    return Err(self.failure(IntegrationFailure::TooFast { limit: FASTEST }));
                }
                let limit = if rejected { 1.0 } else { GROW };
                let next = h * (SAFETY * error.powf(-0.125)).clamp(SHRINK, limit);
                // A step that was made much shorter to end at `t_end` says little about the best step size.
                self.step = Some(if h < 0.5 * preferred { preferred } else { next });
                rejected = false;
                if self.statistics.accepted.is_multiple_of(STEPS_PER_CALL) && watch(self.t).is_break() {
                    return Err(Error::Stopped(Stopped::Simulating { time: self.t }));
                }
            } else {
                self.statistics.rejected += 1;
                rejected = true;
                let factor = if error.is_finite() {
                    (SAFETY * error.powf(-0.125)).max(SHRINK)
                } else {
                    0.1
                };
                let smaller = h * factor;
                if smaller < 16.0 * f64::EPSILON * self.t.abs().max(t_end.abs()) {
                    return Err(self.failure(IntegrationFailure::StepTooSmall { step: smaller }));
                }
                self.step = Some(smaller);
            }
        }
        Ok(())
    }

    fn failure(&self, reason: IntegrationFailure) -> Error {
        Error::Simulation(SimulationError { time: self.t, reason })
    }

    /// Returns an error if another step would exceed the permitted number.
    fn count_step(&self) -> Result<()> {
        let limit = self.tolerances.max_steps;
        if self.statistics.accepted + self.statistics.rejected < limit {
            return Ok(());
        }
        let stiff = self.stiff_steps >= STIFF_STEPS;
        Err(self.failure(IntegrationFailure::TooManySteps { limit, stiff }))
    }

    /// Refuses more instants than the permitted number of steps, as each takes at least one step.
    pub(super) fn check_instants(&self, instants: usize) -> Result<()> {
        let limit = self.tolerances.max_steps;
        let needed = (instants as u64).saturating_sub(1);
        if needed <= limit.saturating_sub(self.statistics.accepted) {
            return Ok(());
        }
        let requirement = "at least the number of samples, as each takes a step; raise it, or lengthen the sample time";
        Err(Error::parameter("max_steps", limit as f64, requirement))
    }

    /// The derivative at the present time and state.
    fn evaluate_slope<F: Fn(f64, &X) -> X>(&mut self, rhs: &F) -> Result<X> {
        let slope = rhs(self.t, &self.x);
        self.statistics.evaluations += 1;
        if slope.components().iter().any(|v| !v.is_finite()) {
            return Err(self.failure(IntegrationFailure::NotFinite));
        }
        self.slope = Some(slope.clone());
        Ok(slope)
    }

    /// The root mean square of `v` in units of the tolerances at the present state.
    fn norm(&self, v: &X) -> f64 {
        let (mut sum, v) = (0.0, v.components());
        for (v, x) in v.iter().zip(self.x.components()) {
            let scaled = v / (self.tolerances.atol + self.tolerances.rtol * x.abs());
            sum += scaled * scaled;
        }
        (sum / v.len() as f64).sqrt()
    }

    /// A first step size from the sizes of the first two derivatives (section II.4 of the book).
    fn first_step<F: Fn(f64, &X) -> X>(&mut self, rhs: &F, slope: &X, span: f64) -> f64 {
        let (d0, d1) = (self.norm(&self.x), self.norm(slope));
        let euler = if d0 < 1e-5 || d1 < 1e-5 { 1e-6 } else { 0.01 * d0 / d1 }.min(span);
        let ahead = rhs(self.t + euler, &combine(&self.x, euler, [(1.0, slope)]));
        self.statistics.evaluations += 1;
        let mut change = ahead;
        for (c, s) in change.components_mut().iter_mut().zip(slope.components()) {
            *c -= s;
        }
        let d2 = self.norm(&change) / euler;
        let largest = d1.max(d2);
        let second = if largest <= 1e-15 {
            (1e-3 * euler).max(1e-6)
        } else {
            (0.01 / largest).powf(0.125)
        };
        // `ahead` may have overflowed; then `second` is not a number and `min` drops it.
        (100.0 * euler).min(second)
    }

    /// The error of a step in units of the tolerances. NaN if the step left the finite numbers.
    fn error(&self, trial: &Trial<X>, h: f64) -> f64 {
        let (mut fifth, mut third) = (0.0, 0.0);
        let (x, x_new) = (self.x.components(), trial.x.components());
        let (error5, error3) = (trial.error5.components(), trial.error3.components());
        for i in 0..x.len() {
            let scale = self.tolerances.atol + self.tolerances.rtol * x[i].abs().max(x_new[i].abs());
            let (e5, e3) = (error5[i] / scale, error3[i] / scale);
            fifth += e5 * e5;
            third += e3 * e3;
        }
        let denominator = fifth + 0.01 * third;
        if denominator == 0.0 {
            return 0.0;
        }
        h * fifth / (x.len() as f64 * denominator).sqrt()
    }

    /// Counts steps whose size is limited by stability and not by accuracy.
    fn judge_stiffness(&mut self, trial: &Trial<X>, slope_new: &X, h: f64) {
        let (mut rise, mut run) = (0.0, 0.0);
        let (last_slope, last_x) = (trial.last_slope.components(), trial.last_x.components());
        for (slope, last) in slope_new.components().iter().zip(last_slope) {
            rise += (slope - last).powi(2);
        }
        for (x, last) in trial.x.components().iter().zip(last_x) {
            run += (x - last).powi(2);
        }
        if run > 0.0 && h * (rise / run).sqrt() > STABILITY {
            self.stiff_steps = self.stiff_steps.saturating_add(1);
        } else {
            self.stiff_steps = self.stiff_steps.saturating_sub(1).min(STIFF_STEPS);
        }
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

/// The result of one step.
struct Trial<X> {
    x: X,
    error5: X,
    error3: X,
    /// The last stage's argument and slope, for the test of stiffness.
    last_x: X,
    last_slope: X,
}

/// `sum of w k` over the pairs `(w, k)`.
#[inline(always)]
fn sum<X: StateVector, const K: usize>(terms: [(f64, &X); K]) -> X {
    let mut total = terms[0].1.zero();
    for (w, k) in terms {
        for (total, k) in total.components_mut().iter_mut().zip(k.components()) {
            *total += w * k;
        }
    }
    total
}

/// `x + h * sum of w k` over the pairs `(w, k)`.
#[inline(always)]
fn combine<X: StateVector, const K: usize>(x: &X, h: f64, terms: [(f64, &X); K]) -> X {
    let mut result = sum(terms);
    for (result, x) in result.components_mut().iter_mut().zip(x.components()) {
        *result = x + h * *result;
    }
    result
}

/// One step of size `h` from `(t, x)`, where the derivative is `k1`.
#[inline]
#[rustfmt::skip]
fn step<X: StateVector, F>(rhs: &F, t: f64, x: &X, k1: &X, h: f64) -> Trial<X>
where
    F: Fn(f64, &X) -> X,
{
    let k2 = &rhs(t + C2 * h, &combine(x, h, [(A2_1, k1)]));
    let k3 = &rhs(t + C3 * h, &combine(x, h, [(A3_1, k1), (A3_2, k2)]));
    let k4 = &rhs(t + C4 * h, &combine(x, h, [(A4_1, k1), (A4_3, k3)]));
    let k5 = &rhs(t + C5 * h, &combine(x, h, [(A5_1, k1), (A5_3, k3), (A5_4, k4)]));
    let k6 = &rhs(t + C6 * h, &combine(x, h, [(A6_1, k1), (A6_4, k4), (A6_5, k5)]));
    let k7 = &rhs(t + C7 * h, &combine(x, h, [(A7_1, k1), (A7_4, k4), (A7_5, k5), (A7_6, k6)]));
    let k8 = &rhs(t + C8 * h, &combine(x, h, [(A8_1, k1), (A8_4, k4), (A8_5, k5), (A8_6, k6), (A8_7, k7)]));
    let k9 = &rhs(t + C9 * h, &combine(x, h, [(A9_1, k1), (A9_4, k4), (A9_5, k5), (A9_6, k6), (A9_7, k7), (A9_8, k8)]));
    let k10 = &rhs(t + C10 * h, &combine(x, h, [(A10_1, k1), (A10_4, k4), (A10_5, k5), (A10_6, k6), (A10_7, k7), (A10_8, k8), (A10_9, k9)]));
    let k11 = &rhs(t + C11 * h, &combine(x, h, [(A11_1, k1), (A11_4, k4), (A11_5, k5), (A11_6, k6), (A11_7, k7), (A11_8, k8), (A11_9, k9), (A11_10, k10)]));
    let last_x = combine(x, h, [
        (A12_1, k1), (A12_4, k4), (A12_5, k5), (A12_6, k6), (A12_7, k7), (A12_8, k8), (A12_9, k9), (A12_10, k10), (A12_11, k11),
    ]);
    let k12 = &rhs(t + C12 * h, &last_x);
    Trial {
        x: combine(x, h, [(B1, k1), (B6, k6), (B7, k7), (B8, k8), (B9, k9), (B10, k10), (B11, k11), (B12, k12)]),
        error5: sum([
            (E5_1, k1), (E5_6, k6), (E5_7, k7), (E5_8, k8), (E5_9, k9), (E5_10, k10), (E5_11, k11), (E5_12, k12),
        ]),
        error3: sum([
            (E3_1, k1), (E3_6, k6), (E3_7, k7), (E3_8, k8), (E3_9, k9), (E3_10, k10), (E3_11, k11), (E3_12, k12),
        ]),
        last_x,
        last_slope: k12.clone(),
    }
}

#[cfg(test)]
#[path = "dop853_tests.rs"]
mod tests;
