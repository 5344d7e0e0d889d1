//! A linear system of several inputs with one denominator, and the columns of its derivatives.

use super::super::block::{Rational, Signals, delayed};

/// How many coefficients a system has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Orders {
    pub poles: usize,
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
    /// The number of coefficients with the offset, without the state at the start, which is forgotten.
    pub fn parameters(&self) -> usize {
        self.poles + self.inputs.iter().map(|i| i.count).sum::<usize>() + 1
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
    /// Without a numerator of its own.
    pub denominator: Rational,
    /// Of every input, without its delay.
    pub numerators: Vec<Vec<f64>>,
    /// The numerator of the state at the start.
    start: Vec<f64>,
    pub offset: f64,
}

impl LinearSystem {
    /// With the coefficients of [`columns`].
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
            denominator,
            orders: orders.clone(),
        }
    }

    /// What multiplies the [`columns`].
    pub fn coefficients(&self) -> Vec<f64> {
        let numerators = self.numerators.iter().flatten();
        numerators.chain(&self.start).copied().chain([self.offset]).collect()
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

    /// The denominator as a polynomial in the delay, the leading 1 first.
    pub fn polynomial(&self) -> Vec<f64> {
        let system = self.denominator.transfer_function(0);
        system.map_or(vec![1.0], |g| {
            let mut a = g.a().to_vec();
            a.resize(self.orders.poles + 1, 0.0);
            a
        })
    }
}

/// What the coefficients multiply: every input through the denominator after each of its lags, the ringing from the start, and one.
pub fn columns(orders: &Orders, denominator: &Rational, u: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = u.first().map_or(0, Vec::len);
    let mut columns = lagged(orders, u.iter().map(|u| denominator.all_pole(u)));
    let ringing = denominator.all_pole(&impulse(n));
    columns.extend((0..orders.poles).map(|k| delayed(&ringing, k, 1.0)));
    columns.push(vec![1.0; n]);
    columns
}

/// Every signal after the lags of its input's numerator.
pub fn lagged(orders: &Orders, signals: impl Iterator<Item = Vec<f64>>) -> Vec<Vec<f64>> {
    let each = orders.inputs.iter().zip(signals);
    each.flat_map(|(i, signal)| (0..i.count).map(move |k| delayed(&signal, i.delay + k, 1.0)))
        .collect()
}

/// 1, then zeros.
pub fn impulse(n: usize) -> Vec<f64> {
    (0..n).map(|t| if t == 0 { 1.0 } else { 0.0 }).collect()
}

/// The sum of columns, each times its coefficient.
pub fn combined(columns: &[Vec<f64>], coefficients: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; columns.first().map_or(0, Vec::len)];
    for (column, c) in columns.iter().zip(coefficients) {
        sum.iter_mut().zip(column).for_each(|(s, x)| *s += c * x);
    }
    sum
}

/// The first samples of inputs and output, all of which count.
pub fn head(data: &Signals, samples: usize) -> Signals {
    Signals {
        from: 0,
        ..data.clone()
    }
    .head(samples)
}
