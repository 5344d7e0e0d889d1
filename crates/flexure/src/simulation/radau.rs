//! The implicit Runge-Kutta method Radau IIA of seven stages and order 13, for stiff equations.
//!
//! The increments \\(z_i\\) of the stages, \\(x_i = x + z_i\\), solve \\(z = h (A \otimes I) f(x + z)\\), and the last stage is the end of the
//! step. Simplified Newton iterations solve them, \\((h^{-1} A^{-1} \otimes I - I \otimes J)\, \Delta z = f - h^{-1} A^{-1} z\\), which the
//! eigenvectors of A split into one real and three complex systems of the size of the state. The error is that of an embedded method of order
//! 7, \\((\gamma h^{-1} I - J)^{-1} (f(t, x) + h^{-1} \sum e_i z_i)\\), so a step grows with the eighth root of the tolerance, as by
//! [`Dop853`](super::Dop853) (Hairer & Wanner, Solving Ordinary Differential Equations II, section IV.8; Hairer & Wanner 1999, Stiff
//! differential equations solved by Radau methods, J. Comput. Appl. Math. 111).
//!
//! The Jacobian is that of differences: it matters for the iteration, and not for the result.

use super::control::{Attempt, Control};
use super::dop853::StateVector;
use super::radau_systems::{Stages, StepFactors};
use super::radau_tableau::{ERROR, FROM_MODES, NODES, STAGES, TO_MODES};
use super::step::{Arrival, StepError, still};
use super::tolerances::Tolerances;
use crate::error::Result;
use crate::linalg::Matrix;

/// Newton iterations of a step, and the rate of convergence of the last step beyond which the Jacobian is computed anew.
const MOST_ITERATIONS: u32 = 10;
const SLOW: f64 = 0.02;
/// The error of the iteration in units of the tolerances.
const SOLVED: f64 = 0.02;
/// A step that would grow by less keeps its size, and so its factors.
const SMALL_GROWTH: f64 = 1.2;
/// The relative difference of step sizes that have the same factors: that of rounding.
const SAME: f64 = 1e-9;
/// The largest ratio of a step to the one before for which its stages are extrapolated.
const EXTRAPOLATED: f64 = 2.0;

/// The state and the derivative at the present time.
pub(super) struct Point<'a, X> {
    pub x: &'a mut X,
    pub slope: &'a mut X,
    /// The first component that is a speed.
    pub first_speed: usize,
}

/// What the steps of the method leave for the next.
pub(super) struct Radau {
    jacobian: Option<Jacobian>,
    factors: Option<StepFactors>,
    /// The size and the increments of the step before.
    before: Option<(f64, Stages)>,
    /// The quotient of the error and the last change in the last iteration.
    trust: f64,
    /// What all factors have cost, in evaluations.
    pub factorised: f64,
}

struct Jacobian {
    matrix: Matrix,
    /// Whether it is that of the present state.
    current: bool,
}

/// Why the iteration ended without a result.
enum Failure {
    NotFinite,
    Diverged,
}

/// The root mean square in units of the tolerances, over all vectors.
fn norm(tolerances: &Tolerances, sizes: &[f64], vectors: &[Vec<f64>]) -> f64 {
    let mut sum = 0.0;
    for vector in vectors {
        for (value, size) in vector.iter().zip(sizes) {
            let scaled = value / (tolerances.atol + tolerances.rtol * size.abs());
            sum += scaled * scaled;
        }
    }
    (sum / (sizes.len() * vectors.len()) as f64).sqrt()
}

/// `matrix` times the stages.
fn times(matrix: &[[f64; STAGES]; STAGES], stages: &Stages) -> Stages {
    std::array::from_fn(|row| sum(&matrix[row], stages))
}

/// The sum of the stages with these weights.
fn sum(weights: &[f64; STAGES], stages: &Stages) -> Vec<f64> {
    let mut sum = vec![0.0; stages[0].len()];
    for (weight, stage) in weights.iter().zip(stages) {
        sum.iter_mut()
            .zip(stage)
            .for_each(|(sum, value)| *sum += weight * value);
    }
    sum
}

/// The state moved by an increment.
fn moved<X: StateVector>(x: &X, by: &[f64]) -> X {
    let mut moved = x.clone();
    (moved.components_mut().iter_mut().zip(by)).for_each(|(x, by)| *x += by);
    moved
}

impl Radau {
    pub fn new() -> Self {
        Radau {
            jacobian: None,
            factors: None,
            before: None,
            trust: 1.0,
            factorised: 0.0,
        }
    }

    /// Declares that the right-hand side jumps at the present time: the last step says nothing about the next.
    pub fn restart(&mut self) {
        self.before = None;
    }

    /// Declares that another method has moved the state.
    pub fn resume(&mut self) {
        self.before = None;
        self.jacobian = None;
    }

    /// Tries one step of about the size `preferred` towards `t_end`, and goes to its end if it is accurate enough.
    ///
    /// # Errors
    /// [`Error::Simulation`](crate::Error::Simulation).
    pub fn step<X, F>(
        &mut self,
        control: &mut Control,
        at: Point<X>,
        preferred: f64,
        t_end: f64,
        rhs: &F,
    ) -> Result<bool>
    where
        X: StateVector,
        F: Fn(f64, &X) -> X,
    {
        let attempt = control.attempt(preferred, t_end, 0)?;
        let tolerances = control.tolerances;
        let (increments, rate) = match self.solve(control, &at, &attempt, &tolerances, rhs) {
            Ok(solved) => solved,
            Err(failure) => {
                let factor = if matches!(failure, Failure::NotFinite) {
                    0.1
                } else {
                    0.5
                };
                control.shrink(&attempt, factor, t_end)?;
                return Ok(false);
            }
        };
        let error = StepError::of(self.error(control, &at, &attempt, &increments, &tolerances, rhs));
        if !(error.value() <= 1.0) {
            control.reject(&attempt, &error, t_end)?;
            return Ok(false);
        }
        *at.x = moved(at.x, &increments[STAGES - 1]);
        *at.slope = rhs(attempt.end, at.x);
        let speeds = at.x.components()[at.first_speed..].iter();
        let arrival = Arrival {
            rise: 0.0,
            run: 0.0,
            still: still(0.0, at.slope.components()),
            speed: speeds.fold(0.0, |most: f64, v| most.max(v.abs())),
        };
        control.accept(&attempt, &error, &arrival)?;
        self.leave(control, attempt.h, increments, rate);
        Ok(true)
    }

    /// What an accepted step leaves.
    fn leave(&mut self, control: &mut Control, h: f64, increments: Stages, rate: f64) {
        self.before = Some((h, increments));
        if rate > SLOW {
            self.jacobian = None;
        } else if let Some(jacobian) = &mut self.jacobian {
            jacobian.current = false;
        }
        let growth = control.step.map_or(1.0, |next| next / h);
        if self.jacobian.is_some() && (1.0..SMALL_GROWTH).contains(&growth) {
            control.step = Some(h);
        }
    }

    /// The increments of the stages and the rate of convergence, with an old Jacobian if that suffices.
    fn solve<X, F>(
        &mut self,
        control: &mut Control,
        at: &Point<X>,
        attempt: &Attempt,
        tolerances: &Tolerances,
        rhs: &F,
    ) -> std::result::Result<(Stages, f64), Failure>
    where
        X: StateVector,
        F: Fn(f64, &X) -> X,
    {
        loop {
            let jacobian = match self.jacobian.take() {
                Some(jacobian) => jacobian,
                None => {
                    self.factors = None;
                    let matrix = differences(control, at, rhs);
                    Jacobian { matrix, current: true }
                }
            };
            let factors = match self.factors.take().filter(|f| (f.h / attempt.h - 1.0).abs() <= SAME) {
                Some(factors) => factors,
                None => {
                    let factors = StepFactors::new(attempt.h, &jacobian.matrix);
                    self.factorised += factors.cost();
                    factors
                }
            };
            let found = self.iterate(control, &factors, at.x, attempt, tolerances, rhs);
            let current = jacobian.current;
            (self.factors, self.jacobian) = (Some(factors), Some(jacobian));
            match found {
                Err(_) if !current => self.jacobian = None,
                found => return found,
            }
        }
    }

    /// Newton's iteration.
    fn iterate<X, F>(
        &mut self,
        control: &mut Control,
        factors: &StepFactors,
        x: &X,
        attempt: &Attempt,
        tolerances: &Tolerances,
        rhs: &F,
    ) -> std::result::Result<(Stages, f64), Failure>
    where
        X: StateVector,
        F: Fn(f64, &X) -> X,
    {
        let (t, h) = (control.t, attempt.h);
        let mut z = self.start(h, x.components().len());
        let mut w = times(&TO_MODES, &z);
        let (mut last, mut rate) = (f64::INFINITY, 0.0_f64);
        self.trust = self.trust.max(f64::EPSILON).powf(0.8);
        for iteration in 0..MOST_ITERATIONS {
            let f: Stages = std::array::from_fn(|i| rhs(t + NODES[i] * h, &moved(x, &z[i])).components().to_vec());
            control.statistics.evaluations += STAGES as u64;
            let change = factors.change(h, &times(&TO_MODES, &f), &w).ok_or(Failure::Diverged)?;
            let size = norm(tolerances, x.components(), &change);
            if !size.is_finite() {
                return Err(Failure::NotFinite);
            }
            if iteration > 0 {
                rate = size / last;
                self.trust = if rate < 1.0 { rate / (1.0 - rate) } else { 1.0 };
                let left = (MOST_ITERATIONS - 1 - iteration) as i32;
                let hopeless = rate >= 1.0 || self.trust * rate.powi(left) * size > SOLVED;
                if hopeless && size > SOLVED {
                    return Err(Failure::Diverged);
                }
            }
            for (w, change) in w.iter_mut().zip(&change) {
                w.iter_mut().zip(change).for_each(|(w, change)| *w += change);
            }
            z = times(&FROM_MODES, &w);
            if self.trust * size <= SOLVED || rate >= 1.0 {
                return Ok((z, rate));
            }
            last = size;
        }
        Err(Failure::Diverged)
    }

    /// The increments to start from: those of the polynomial of the step before, or none.
    fn start(&self, h: f64, dimension: usize) -> Stages {
        let Some((before, increments)) = self.before.as_ref().filter(|(size, _)| h <= EXTRAPOLATED * size) else {
            return std::array::from_fn(|_| vec![0.0; dimension]);
        };
        std::array::from_fn(|i| {
            let place = 1.0 + NODES[i] * h / before;
            // Lagrange's polynomial, zero at the start of that step.
            let mut weights: [f64; STAGES] = std::array::from_fn(|j| {
                let others = (0..STAGES).filter(|&k| k != j);
                let product: f64 = others.map(|k| (place - NODES[k]) / (NODES[j] - NODES[k])).product();
                product * place / NODES[j]
            });
            weights[STAGES - 1] -= 1.0;
            sum(&weights, increments)
        })
    }

    /// The error of a step in units of the tolerances.
    fn error<X, F>(
        &self,
        control: &mut Control,
        at: &Point<X>,
        attempt: &Attempt,
        increments: &Stages,
        tolerances: &Tolerances,
        rhs: &F,
    ) -> f64
    where
        X: StateVector,
        F: Fn(f64, &X) -> X,
    {
        let Some(factors) = &self.factors else { return f64::NAN };
        let x = at.x.components();
        let ends = x.iter().zip(&increments[STAGES - 1]);
        let sizes: Vec<f64> = ends.map(|(x, z)| x.abs().max((x + z).abs())).collect();
        let stages = sum(&ERROR, increments);
        let of = |slope: &[f64]| factors.filtered(slope.iter().zip(&stages).map(|(f, z)| f + z / attempt.h).collect());
        let Some(error) = of(at.slope.components()) else {
            return f64::NAN;
        };
        let size = norm(tolerances, &sizes, std::slice::from_ref(&error));
        if !(size > 1.0 && control.is_uncertain()) {
            return size;
        }
        // After a jump the estimate of fast components is that of a method that is not damped: once more from there.
        control.statistics.evaluations += 1;
        let again = rhs(control.t, &moved(at.x, &error));
        of(again.components()).map_or(f64::NAN, |error| norm(tolerances, &sizes, &[error]))
    }
}

/// The Jacobian by differences.
fn differences<X, F>(control: &mut Control, at: &Point<X>, rhs: &F) -> Matrix
where
    X: StateVector,
    F: Fn(f64, &X) -> X,
{
    let (x, slope) = (at.x.components(), at.slope.components());
    let mut matrix = Matrix::zeros(x.len(), x.len());
    for (k, mut column) in matrix.column_iter_mut().enumerate() {
        let mut beside = at.x.clone();
        beside.components_mut()[k] += (1e-16 * x[k].abs().max(1e-5)).sqrt();
        let step = beside.components()[k] - x[k];
        let there = rhs(control.t, &beside);
        for ((entry, there), here) in column.iter_mut().zip(there.components()).zip(slope) {
            *entry = (there - here) / step;
        }
    }
    control.statistics.evaluations += x.len() as u64;
    matrix
}
