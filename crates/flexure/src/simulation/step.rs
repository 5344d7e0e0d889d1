//! One step of the method, of one state or of several in lanes.

use super::dop853::StateVector;
use super::tableau::{ERROR3, ERROR5, NODES, SOLUTION, STAGES};
use super::tolerances::Tolerances;
use crate::number::{Lanes, Number};
use fearless_simd::Simd;

/// A state that steps are made of.
pub(super) trait Stepped: Clone {
    /// A component of it: one number, or one of several states in lanes.
    type Number: Number;

    /// The components.
    fn numbers(&self) -> &[Self::Number];

    /// The components, to write to.
    fn numbers_mut(&mut self) -> &mut [Self::Number];

    /// The zero vector of this dimension.
    #[must_use]
    fn nought(&self) -> Self;
}

impl<X: StateVector> Stepped for X {
    type Number = f64;

    #[inline(always)]
    fn numbers(&self) -> &[f64] {
        self.components()
    }

    #[inline(always)]
    fn numbers_mut(&mut self) -> &mut [f64] {
        self.components_mut()
    }

    #[inline(always)]
    fn nought(&self) -> Self {
        self.zero()
    }
}

impl<S: Simd, const N: usize> Stepped for [Lanes<S>; N] {
    type Number = Lanes<S>;

    #[inline(always)]
    fn numbers(&self) -> &[Lanes<S>] {
        self
    }

    #[inline(always)]
    fn numbers_mut(&mut self) -> &mut [Lanes<S>] {
        self
    }

    #[inline(always)]
    fn nought(&self) -> Self {
        [self[0].filled(0.0); N]
    }
}

/// The result of one step.
pub(super) struct Trial<X> {
    pub x: X,
    error5: X,
    error3: X,
    /// The last stage's argument and slope, for the test of stiffness.
    last_x: X,
    last_slope: X,
}

/// The error of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepError<T> {
    /// In units of the tolerances, where the square that it was divided by a root of is not zero.
    ratio: T,
    square: T,
}

impl StepError<f64> {
    /// An error in units of the tolerances.
    pub fn of(ratio: f64) -> Self {
        StepError { ratio, square: 1.0 }
    }

    /// In units of the tolerances. NaN if the step left the finite numbers.
    #[inline(always)]
    pub fn value(&self) -> f64 {
        if self.square == 0.0 { 0.0 } else { self.ratio }
    }
}

/// What is found at the end of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrival<T> {
    /// The squares of the changes of slope and state since the last stage.
    pub rise: T,
    pub run: T,
    /// Zero where the slope is finite, or NaN.
    pub still: T,
    /// The largest speed.
    pub speed: T,
}

impl<S: Simd> StepError<Lanes<S>> {
    /// That of one lane.
    #[inline(always)]
    pub fn of_lane(&self, lane: usize) -> StepError<f64> {
        StepError {
            ratio: self.ratio[lane],
            square: self.square[lane],
        }
    }
}

impl<S: Simd> Arrival<Lanes<S>> {
    /// That of one lane.
    #[inline(always)]
    pub fn of_lane(&self, lane: usize) -> Arrival<f64> {
        Arrival {
            rise: self.rise[lane],
            run: self.run[lane],
            still: self.still[lane],
            speed: self.speed[lane],
        }
    }
}

/// `zero`, or NaN where a number is not finite.
#[inline(always)]
pub(super) fn still<T: Number>(zero: T, numbers: &[T]) -> T {
    let mut sum = zero;
    for &number in numbers {
        sum = sum + number * 0.0;
    }
    sum
}

impl<X: Stepped> Trial<X> {
    /// The error of the step of size `h` from `x`.
    #[inline(always)]
    pub fn error(&self, tolerances: &Tolerances, x: &X, h: X::Number) -> StepError<X::Number> {
        let (mut fifth, mut third) = (h.filled(0.0), h.filled(0.0));
        let (x, x_new) = (x.numbers(), self.x.numbers());
        let (error5, error3) = (self.error5.numbers(), self.error3.numbers());
        for i in 0..x.len() {
            let scale = x[i].abs().max(x_new[i].abs()) * tolerances.rtol + tolerances.atol;
            let (e5, e3) = (error5[i] / scale, error3[i] / scale);
            fifth = fifth + e5 * e5;
            third = third + e3 * e3;
        }
        let square = fifth + third * 0.01;
        StepError {
            ratio: h * fifth / (square * x.len() as f64).sqrt(),
            square,
        }
    }

    /// What is found at the end, where the slope is `slope_new`; the components from `first_speed` on are speeds. `zero` is one.
    #[inline(always)]
    pub fn arrival(&self, slope_new: &X, first_speed: usize, zero: X::Number) -> Arrival<X::Number> {
        let (x_new, slope_new) = (self.x.numbers(), slope_new.numbers());
        let (last_slope, last_x) = (self.last_slope.numbers(), self.last_x.numbers());
        let (mut rise, mut run) = (zero, zero);
        for i in 0..x_new.len() {
            let (up, along) = (slope_new[i] - last_slope[i], x_new[i] - last_x[i]);
            rise = rise + up * up;
            run = run + along * along;
        }
        let mut speed = zero;
        for i in first_speed..x_new.len() {
            speed = speed.max(x_new[i].abs());
        }
        Arrival {
            rise,
            run,
            still: still(zero, slope_new),
            speed,
        }
    }
}

/// `sum of w k` over the weights and the slopes; most weights of zero are left out.
#[inline(always)]
fn sum<X: Stepped>(zero: X, weights: &[f64], slopes: &[X]) -> X {
    let mut total = zero;
    for (&w, k) in weights.iter().zip(slopes) {
        if w != 0.0 {
            for (total, &k) in total.numbers_mut().iter_mut().zip(k.numbers()) {
                *total = *total + k * w;
            }
        }
    }
    total
}

/// `x + h * sum of w k` over the weights and the slopes.
#[inline(always)]
pub(super) fn combine<X: Stepped>(x: &X, h: X::Number, weights: &[f64], slopes: &[X]) -> X {
    let mut result = sum(x.nought(), weights, slopes);
    for (result, &x) in result.numbers_mut().iter_mut().zip(x.numbers()) {
        *result = x + h * *result;
    }
    result
}

/// One step of size `h` from `(t, x)`, where the derivative is `slope`.
#[inline(always)]
pub(super) fn step<X: Stepped, F>(rhs: F, t: X::Number, x: &X, slope: &X, h: X::Number) -> Trial<X>
where
    F: Fn(X::Number, &X) -> X,
{
    let mut slopes: [X; 12] = std::array::from_fn(|_| slope.clone());
    let mut last_x = x.nought();
    // A loop, so that the right-hand side is compiled once.
    for stage in 1..12 {
        last_x = combine(x, h, &STAGES[stage], &slopes[..stage]);
        slopes[stage] = rhs(t + h * NODES[stage], &last_x);
    }
    let [.., last_slope] = &slopes;
    Trial {
        x: combine(x, h, &SOLUTION, &slopes),
        error5: sum(x.nought(), &ERROR5, &slopes),
        error3: sum(x.nought(), &ERROR3, &slopes),
        last_x,
        last_slope: last_slope.clone(),
    }
}
