//! A linear system of several inputs with one denominator, and the columns of its derivatives.

use super::super::block::{Rational, Signals, delayed};
use super::integrators::{numerator_polynomial, terms, trend, with_integrators};
use crate::vectors::combined;

/// The numbers of poles, integrators and numerator coefficients of a system.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Orders {
    /// Poles that are estimated.
    pub poles: usize,
    /// Further poles, at 1.
    pub integrators: usize,
    pub inputs: Vec<Numerator>,
}

/// The numerator of one input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Numerator {
    pub delay: usize,
    /// Its coefficients after the delay.
    pub count: usize,
}

impl Orders {
    /// The number of poles, those at 1 included.
    pub fn order(&self) -> usize {
        self.poles + self.integrators
    }

    /// The number of coefficients with the offset and the powers of time, without the initial state, whose effect decays.
    pub fn parameters(&self) -> usize {
        self.poles + self.numerators() + 1 + self.integrators
    }

    /// The number of coefficients of all numerators.
    pub fn numerators(&self) -> usize {
        self.inputs.iter().map(|i| i.count).sum()
    }

    /// The first sample that counts: no later one depends on inputs before the record.
    pub fn first(&self) -> usize {
        let oldest = self.inputs.iter().map(|i| i.delay + i.count - 1).max();
        oldest.unwrap_or(0)
    }
}

/// $o + \sum_i z^{-s_i} B_i/A\, U^{(i)} + C/A\, \delta$.
#[derive(Debug, Clone)]
pub struct LinearSystem {
    pub orders: Orders,
    /// The denominator, without integrators; its numerator is not used.
    pub denominator: Rational,
    /// For every input: the coefficients of its [`terms`], without the delay.
    pub numerators: Vec<Vec<f64>>,
    /// The numerator of the initial state.
    start: Vec<f64>,
    pub offset: f64,
    /// The coefficients of the powers of time.
    pub trend: Vec<f64>,
}

impl LinearSystem {
    /// The system with these coefficients of [`columns`].
    pub fn new(orders: &Orders, denominator: Rational, coefficients: &[f64]) -> LinearSystem {
        let mut rest = coefficients;
        let mut next = |count: usize| {
            let (mine, others) = rest.split_at(count);
            rest = others;
            mine.to_vec()
        };
        LinearSystem {
            numerators: orders.inputs.iter().map(|i| next(i.count)).collect(),
            start: next(orders.poles),
            offset: next(1)[0],
            trend: next(orders.integrators),
            denominator,
            orders: orders.clone(),
        }
    }

    /// The coefficients of the [`columns`].
    pub fn coefficients(&self) -> Vec<f64> {
        let numerators = self.numerators.iter().flatten();
        let dynamic = numerators.chain(&self.start).copied();
        dynamic.chain([self.offset]).chain(self.trend.iter().copied()).collect()
    }

    /// The sum of the [`columns`] that pass through the denominator.
    pub fn dynamic(&self, columns: &[Vec<f64>]) -> Vec<f64> {
        let count = self.orders.numerators() + self.orders.poles;
        combined(columns, &self.coefficients()[..count])
    }

    /// The output under these inputs.
    pub fn run(&self, u: &[Vec<f64>]) -> Vec<f64> {
        let columns = columns(&self.orders, &self.denominator, u);
        combined(&columns, &self.coefficients())
    }

    /// All parameters: the coefficients, then those of the denominator's sections.
    pub fn parameters(&self) -> Vec<f64> {
        let mut all = self.coefficients();
        all.extend(&self.denominator.parameters()[self.denominator.b.len()..]);
        all
    }

    /// The same structure with other parameters.
    pub fn with(&self, parameters: &[f64]) -> LinearSystem {
        let (coefficients, sections) = parameters.split_at(parameters.len() - self.orders.poles);
        let denominator = self.denominator.with(&[&[1.0], sections].concat());
        LinearSystem::new(&self.orders, denominator, coefficients)
    }

    /// The denominator with the integrators as a polynomial in the delay, the leading 1 first.
    pub fn polynomial(&self) -> Vec<f64> {
        let system = self.denominator.transfer_function(0);
        let mut a = system.map_or(vec![1.0], |g| g.a().to_vec());
        a.resize(self.orders.poles + 1, 0.0);
        with_integrators(&a, self.orders.integrators)
    }

    /// The numerators as polynomials in the delay, without the delays of the inputs.
    pub fn numerator_polynomials(&self) -> Vec<Vec<f64>> {
        let each = self.numerators.iter();
        each.map(|b| numerator_polynomial(b, self.orders.integrators)).collect()
    }
}

/// The columns for the coefficients: the [`terms`] of every input through the denominator, the response to the initial state, one, and the
/// powers of time.
pub fn columns(orders: &Orders, denominator: &Rational, u: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = u.first().map_or(0, Vec::len);
    let mut columns = lagged(orders, u.iter().map(|u| denominator.all_pole(u)));
    let ringing = denominator.all_pole(&impulse(n));
    columns.extend((0..orders.poles).map(|k| delayed(&ringing, k, 1.0)));
    columns.push(vec![1.0; n]);
    columns.extend(trend(n, orders.integrators));
    columns
}

/// The [`terms`] of every signal for its input's numerator, after its delay.
pub fn lagged(orders: &Orders, signals: impl Iterator<Item = Vec<f64>>) -> Vec<Vec<f64>> {
    let each = orders.inputs.iter().zip(signals);
    each.flat_map(|(i, signal)| terms(&delayed(&signal, i.delay, 1.0), orders.integrators, i.count))
        .collect()
}

/// 1, then zeros.
pub fn impulse(n: usize) -> Vec<f64> {
    (0..n).map(|t| if t == 0 { 1.0 } else { 0.0 }).collect()
}

/// The first samples of inputs and output; all of them count.
pub fn head(data: &Signals, samples: usize) -> Signals {
    Signals {
        from: 0,
        ..data.clone()
    }
    .head(samples)
}
