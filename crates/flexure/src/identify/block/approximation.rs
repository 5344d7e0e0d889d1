//! The best linear approximation as a rational transfer function, its order chosen from the data.
//!
//! The Steiglitz-McBride iteration gives the start, Levenberg-Marquardt then minimises the output error. For a Gaussian input its poles and
//! zeros are those of both linear blocks together (Bussgang's theorem).

use std::ops::RangeInclusive;

use super::changes::{changes, greedy};
use super::descent::{Minimum, Residuals, descend};
use super::equation_error::{EquationError, Judged};
use super::limits::{APPROXIMATION, EQUATION_ERROR_PASSES};
use super::monitor::Monitor;
use super::rational::Rational;
use super::signals::Signals;
use crate::linear::levenberg_marquardt::Linearisation;

/// A linear model and its sum of squared errors.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Approximation {
    pub system: Rational,
    pub squares: f64,
}

struct OutputError<'a> {
    data: &'a Signals,
    structure: Rational,
}

impl Residuals for OutputError<'_> {
    fn from(&self) -> usize {
        self.data.from
    }

    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let g = self.structure.with(parameters);
        let error = |p: Vec<f64>| p.iter().zip(&self.data.y).map(|(p, y)| p - y).collect();
        g.is_stable().then(|| error(g.run(self.data.input())))
    }

    fn linearise(&self, parameters: &[f64]) -> Linearisation {
        let g = self.structure.with(parameters);
        let all_pole = g.all_pole(self.data.input());
        let response = g.numerator(&all_pole);
        Linearisation {
            residuals: response.iter().zip(&self.data.y).map(|(p, y)| p - y).collect(),
            jacobian: g.derivatives(&all_pole, &response),
        }
    }
}

/// The approximation of the given order; `None` if none was found.
pub(in crate::identify) fn approximate(
    data: &Signals,
    order: usize,
    monitor: &mut Monitor<'_>,
) -> Option<Approximation> {
    refitted(data, start(data, order)?, monitor)
}

/// The approximations of several orders; `None` for an order where none was found.
pub(in crate::identify) fn approximate_all(
    data: &Signals,
    orders: RangeInclusive<usize>,
    monitor: &mut Monitor<'_>,
) -> Vec<Option<Approximation>> {
    // A numerator has a coefficient more than there are poles.
    let numbers = 2 * data.y.len() * (2 * orders.end() + 1);
    let orders: Vec<usize> = orders.collect();
    monitor.side_by_side(&orders, numbers, |order, monitor| approximate(data, *order, monitor))
}

/// The approximation after adding and removing poles and numerator coefficients while Schwarz's criterion falls.
pub(in crate::identify) fn restructured(data: &Signals, start: &Rational, monitor: &mut Monitor<'_>) -> Approximation {
    let mut data = data.clone();
    let mut best = Approximation {
        squares: data.squares(&start.run(data.input())),
        system: start.clone(),
    };
    best = refitted(&data, best.system.clone(), monitor).unwrap_or(best);
    data.set_dependence(&best.system.run(data.input()));
    let score = |a: &Approximation| data.bic(a.squares, a.system.count());
    greedy(best, score, |best| {
        let near = changes(&best.system);
        let numbers = 2 * data.y.len() * best.system.count();
        let refitted = monitor.side_by_side(&near, numbers, |g, monitor| refitted(&data, g.clone(), monitor));
        refitted.into_iter().flatten().collect()
    })
}

/// The minimum of the output error, started from this system.
fn refitted(data: &Signals, structure: Rational, monitor: &mut Monitor<'_>) -> Option<Approximation> {
    let start = structure.parameters();
    let problem = OutputError { data, structure };
    Some(Approximation::new(
        &problem.structure,
        &descend(&problem, start, APPROXIMATION, monitor)?,
    ))
}

impl Approximation {
    /// The approximation of this structure at a minimum.
    fn new(structure: &Rational, minimum: &Minimum) -> Approximation {
        Approximation {
            system: structure.with(&minimum.parameters),
            squares: minimum.squares,
        }
    }
}

/// The system of the best output error among the passes of the Steiglitz-McBride iteration.
fn start(data: &Signals, order: usize) -> Option<Rational> {
    let problem = EquationError {
        signals: std::slice::from_ref(&data.u[0]),
        y: &data.y,
        constant: false,
        order,
        from: data.from,
    };
    let best = problem.best(EQUATION_ERROR_PASSES, |b, denominator| {
        let system = denominator.with_numerator(b.to_vec());
        let score = data.squares(&system.run(data.input()));
        b.iter().all(|b| b.is_finite()).then_some(Judged { score, of: system })
    });
    best.map(|best| best.of)
}
