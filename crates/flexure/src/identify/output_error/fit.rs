//! The fit of a system with given orders.

use super::super::block::{
    Minimum, Monitor, Rational, Residuals, Signals, StopRule, delayed, descend_through, efficient,
};
use super::high_order::HighOrder;
use super::integrators::{differenced, trend};
use super::limits::{PASSES, PASSES_SETTLED};
use super::system::{LinearSystem, Orders, columns, head, impulse, lagged};
use crate::linear::least_squares::least_squares;
use crate::linear::levenberg_marquardt::Linearisation;
use crate::vectors::combined;

/// What a fit minimises.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Criterion {
    /// The error of the free run.
    FreeRun,
    /// The same after the autoregression that whitens it, if it is coloured noise (Box-Jenkins).
    Whitened,
    /// The error of the free run through the polynomial that whitens the noise of a [system of high order](HighOrder).
    Filtered,
    /// The error of the difference equation with measured past outputs.
    Equation,
}

/// What a fit starts from: the data, and more if there is more.
#[derive(Clone, Copy, Default)]
pub struct Start<'a> {
    /// A system with as many poles, which are taken.
    pub near: Option<&'a LinearSystem>,
    /// The colour of the noise.
    pub high_order: Option<&'a HighOrder>,
}

impl<'a> Start<'a> {
    pub fn near(self, system: &'a LinearSystem) -> Start<'a> {
        Start {
            near: Some(system),
            ..self
        }
    }
}

impl Criterion {
    /// The criteria for the choice of orders.
    pub const CHOOSING: [Criterion; 3] = [Criterion::FreeRun, Criterion::Equation, Criterion::Filtered];

    pub fn name(self) -> &'static str {
        match self {
            Criterion::FreeRun => "output error",
            Criterion::Whitened => "output error, whitened",
            Criterion::Filtered => "output error, filtered",
            Criterion::Equation => "equation error",
        }
    }

    /// The fit of a system with these orders; `None` if there is no solution.
    pub fn fitted(
        self,
        orders: &Orders,
        data: &Signals,
        start: Start<'_>,
        rule: StopRule,
        monitor: &mut Monitor<'_>,
    ) -> Option<LinearSystem> {
        match self {
            Criterion::Equation => equation_error(orders, data),
            Criterion::Whitened => {
                let least = Criterion::FreeRun.fitted(orders, data, start, rule, monitor)?;
                Some(whitened(&least, data, monitor).unwrap_or(least))
            }
            Criterion::Filtered => {
                let HighOrder { whitener, filtered } = start.high_order?;
                let filtered = head(filtered, data.y.len());
                let poles = || match orders.poles {
                    0 => Some(Rational::pass()),
                    _ => Some(iterated(orders, &filtered)?.denominator),
                };
                let of_filtered = || with_poles(orders, poles()?, data);
                let start = near(orders, data, start).or_else(of_filtered)?;
                refined(start, whitener, data, rule, monitor)
            }
            Criterion::FreeRun if orders.poles == 0 => with_poles(orders, Rational::pass(), data),
            Criterion::FreeRun => {
                let start = near(orders, data, start).or_else(|| iterated(orders, data))?;
                refined(start, &[1.0], data, rule, monitor)
            }
        }
    }
}

/// The error of the free run over all parameters.
struct OutputError<'a> {
    data: &'a Signals,
    structure: &'a LinearSystem,
}

impl Residuals for OutputError<'_> {
    fn from(&self) -> usize {
        self.structure.orders.first()
    }

    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let system = self.structure.with(parameters);
        let stable = system.denominator.is_stable();
        stable.then(|| errors(&system.run(&self.data.u), self.data))
    }

    fn linearise(&self, parameters: &[f64]) -> Linearisation {
        let system = self.structure.with(parameters);
        let mut jacobian = columns(&system.orders, &system.denominator, &self.data.u);
        let output = combined(&jacobian, &system.coefficients());
        let dynamic = system.dynamic(&jacobian);
        for section in &system.denominator.sections {
            let by = section.run(&dynamic);
            jacobian.extend((1..=section.order).map(|k| delayed(&by, k, -1.0)));
        }
        Linearisation {
            residuals: errors(&output, self.data),
            jacobian,
        }
    }
}

fn errors(output: &[f64], data: &Signals) -> Vec<f64> {
    output.iter().zip(&data.y).map(|(p, y)| p - y).collect()
}

/// The least squares of the free run's error through a polynomial.
fn refined(
    start: LinearSystem,
    filter: &[f64],
    data: &Signals,
    rule: StopRule,
    monitor: &mut Monitor<'_>,
) -> Option<LinearSystem> {
    let structure = &start;
    let problem = OutputError { data, structure };
    let Minimum { parameters, .. } = descend_through(filter, &problem, start.parameters(), rule, monitor)?;
    Some(start.with(&parameters))
}

/// The system by generalised least squares, if the error is coloured noise; `None` if it is white or no noise.
pub fn whitened(system: &LinearSystem, data: &Signals, monitor: &mut Monitor<'_>) -> Option<LinearSystem> {
    let structure = system;
    let minimum = efficient(&OutputError { data, structure }, &system.parameters(), monitor)?;
    Some(system.with(&minimum.parameters))
}

/// The system with the poles of the start's, if it has one.
fn near(orders: &Orders, data: &Signals, start: Start<'_>) -> Option<LinearSystem> {
    with_poles(orders, start.near?.denominator.clone(), data)
}

/// The system with these poles and the least output error.
fn with_poles(orders: &Orders, denominator: Rational, data: &Signals) -> Option<LinearSystem> {
    let columns = columns(orders, &denominator, &data.u);
    let coefficients = least_squares(&data.y, &columns, orders.first())?.coefficients;
    let finite = coefficients.iter().all(|c| c.is_finite());
    finite.then(|| LinearSystem::new(orders, denominator, &coefficients))
}

/// Least squares of the difference equation with all signals filtered by a denominator: the numerators, and the new denominator. With
/// integrators, the output is differenced.
struct Equation {
    numerators: Vec<f64>,
    denominator: Rational,
}

impl Equation {
    fn new(orders: &Orders, data: &Signals, filter: &Rational) -> Option<Equation> {
        let d = orders.integrators;
        let mut columns = columns(orders, filter, &data.u);
        // Differencing turns the powers of time into a constant.
        columns.truncate(columns.len() - d);
        let ones = columns.last_mut()?;
        *ones = filter.all_pole(ones);
        let driven = orders.numerators();
        columns[..driven].iter_mut().for_each(|c| *c = differenced(c, d));
        // The first d differences have no earlier samples; the initial state acts after them.
        columns[driven..driven + orders.poles]
            .iter_mut()
            .for_each(|c| *c = delayed(c, d, 1.0));
        let mut y = differenced(&data.y, d);
        y.iter_mut().take(d).for_each(|y| *y = 0.0);
        let y = filter.all_pole(&y);
        columns.extend((1..=orders.poles).map(|k| delayed(&y, k, -1.0)));
        let coefficients = least_squares(&y, &columns, orders.first().max(d))?.coefficients;
        let (others, a) = coefficients.split_at(columns.len() - orders.poles);
        let a: Vec<f64> = std::iter::once(1.0).chain(a.iter().copied()).collect();
        Some(Equation {
            numerators: others[..driven].to_vec(),
            denominator: Rational::from_polynomials(vec![1.0], &a)?,
        })
    }
}

/// The fit by the equation error; the offset and the initial state by the output error.
pub fn equation_error(orders: &Orders, data: &Signals) -> Option<LinearSystem> {
    let Equation {
        numerators,
        denominator,
    } = Equation::new(orders, data, &Rational::pass())?;
    let driven = lagged(orders, data.u.iter().map(|u| denominator.all_pole(u)));
    let driven = combined(&driven, &numerators);
    let left: Vec<f64> = match driven.is_empty() {
        true => data.y.clone(),
        false => data.y.iter().zip(&driven).map(|(y, d)| y - d).collect(),
    };
    let ringing = denominator.all_pole(&impulse(data.y.len()));
    let mut columns: Vec<Vec<f64>> = (0..orders.poles).map(|k| delayed(&ringing, k, 1.0)).collect();
    columns.push(vec![1.0; data.y.len()]);
    columns.extend(trend(data.y.len(), orders.integrators));
    let others = least_squares(&left, &columns, orders.first())?.coefficients;
    let coefficients = [numerators, others].concat();
    let finite = coefficients.iter().all(|c| c.is_finite());
    finite.then(|| LinearSystem::new(orders, denominator, &coefficients))
}

/// The best output error among the passes of the Steiglitz-McBride iteration.
fn iterated(orders: &Orders, data: &Signals) -> Option<LinearSystem> {
    let mut best: Option<(LinearSystem, f64)> = None;
    let mut filter = Rational::pass();
    for _ in 0..PASSES {
        let Some(Equation { denominator, .. }) = Equation::new(orders, data, &filter) else {
            break;
        };
        let Some(system) = with_poles(orders, denominator, data) else {
            break;
        };
        filter = system.denominator.clone();
        let errors = errors(&system.run(&data.u), data);
        let squares: f64 = errors.iter().skip(orders.first()).map(|e| e * e).sum();
        let fall = best.as_ref().map_or(f64::INFINITY, |(_, least)| least - squares);
        if fall > 0.0 && squares.is_finite() {
            let settled = fall < PASSES_SETTLED * squares;
            best = Some((system, squares));
            if settled {
                break;
            }
        }
    }
    best.map(|(system, _)| system)
}
