//! The system, its parameters, and the signals that it is fitted to.

use super::super::super::criterion;
use super::super::{Rational, Shape, delayed, squares_through};

/// Static, linear, after a delay.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct Branch {
    /// Samples by which the input is delayed before anything else; numerators may delay it further.
    pub delay: usize,
    pub shape: Shape,
    pub linear: Rational,
}

impl Branch {
    /// The delayed input, 0 before the record.
    pub fn delayed(&self, u: &[f64]) -> Vec<f64> {
        delayed(u, self.delay, 1.0)
    }

    pub fn run(&self, u: &[f64]) -> Vec<f64> {
        let v: Vec<f64> = self.delayed(u).iter().map(|u| self.shape.value(*u)).collect();
        self.linear.run(&v)
    }

    /// The number of parameters.
    pub fn parameters(&self) -> usize {
        self.shape.count() + self.linear.b.len() + self.linear.order()
    }
}

/// Branches, an offset to their sum, and what that passes.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct System {
    pub branches: Vec<Branch>,
    pub offset: f64,
    /// The last nonlinearity, if there is one.
    pub output: Option<Shape>,
}

impl System {
    /// The offset and the sum of the branches: what enters the last nonlinearity.
    pub fn inner(&self, u: &[Vec<f64>]) -> Vec<f64> {
        let samples = u.first().map_or(0, Vec::len);
        let mut sum = vec![self.offset; samples];
        for (branch, u) in self.branches.iter().zip(u) {
            sum.iter_mut().zip(branch.run(u)).for_each(|(s, x)| *s += x);
        }
        sum
    }

    pub fn run(&self, u: &[Vec<f64>]) -> Vec<f64> {
        let mut x = self.inner(u);
        if let Some(output) = &self.output {
            x.iter_mut().for_each(|x| *x = output.value(*x));
        }
        x
    }

    pub fn is_stable(&self) -> bool {
        self.branches.iter().all(|b| b.linear.is_stable())
    }

    /// All parameters: those of every branch (nonlinearity, numerator, denominator), the offset, the last nonlinearity's.
    pub fn parameters(&self) -> Vec<f64> {
        let mut p = Vec::new();
        for branch in &self.branches {
            p.extend(branch.shape.parameters());
            p.extend(branch.linear.parameters());
        }
        p.push(self.offset);
        p.extend(self.output.iter().flat_map(Shape::parameters));
        p
    }

    /// The same structure with other parameters.
    pub fn with(&self, mut p: &[f64]) -> System {
        let mut take = |n: usize| {
            let (mine, others) = p.split_at(n);
            p = others;
            mine
        };
        let mut next = self.clone();
        for branch in &mut next.branches {
            branch.shape.set(take(branch.shape.count()));
            branch.linear = branch.linear.with(take(branch.linear.b.len() + branch.linear.order()));
        }
        next.offset = take(1)[0];
        if let Some(output) = &mut next.output {
            output.set(take(output.count()));
        }
        next
    }

    /// The parameters that the data can determine: a branch has one scale and one offset too many, and so has the last
    /// nonlinearity.
    pub fn degrees(&self) -> usize {
        let branches: usize = self.branches.iter().map(|b| b.parameters() - 2).sum();
        branches + 1 + self.output.as_ref().map_or(0, |o| o.count() - 2)
    }

    /// Samples after which the slowest branch has settled.
    pub fn settling(&self, share: f64) -> usize {
        let each = self.branches.iter().map(|b| b.delay + b.linear.settling(share));
        each.max().unwrap_or(0)
    }
}

/// Scaled inputs and output, the first samples of which only let the initial state decay.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Signals {
    pub u: Vec<Vec<f64>>,
    pub y: Vec<f64>,
    /// Samples from here on count.
    pub from: usize,
    /// So many of them carry as much information as one whose error is independent of the others'.
    pub dependence: f64,
    /// The polynomial that errors go through before they count: 1, or what whitens them.
    pub filter: Vec<f64>,
}

impl Signals {
    /// All errors as they are, and independent of one another.
    pub fn new(u: Vec<Vec<f64>>, y: Vec<f64>, from: usize) -> Signals {
        Signals {
            u,
            y,
            from,
            dependence: 1.0,
            filter: vec![1.0],
        }
    }

    /// The same samples, with errors that count as `filter` leaves them, independent of one another.
    pub fn through(&self, filter: Vec<f64>) -> Signals {
        Signals {
            from: self.from.max(filter.len() - 1),
            filter,
            dependence: 1.0,
            ..self.clone()
        }
    }

    pub fn counted(&self) -> usize {
        self.y.len() - self.from
    }

    pub fn squares(&self, output: &[f64]) -> f64 {
        squares_through(&self.filter, output, &self.y, self.from)
    }

    /// The first samples, so many of which count, or all.
    pub fn head(&self, counted: usize) -> Signals {
        let n = self.y.len().min(self.from.saturating_add(counted));
        Signals {
            u: self.u.iter().map(|u| u[..n].to_vec()).collect(),
            y: self.y[..n].to_vec(),
            filter: self.filter.clone(),
            ..*self
        }
    }

    /// Schwarz's criterion of a sum of squares, for as many independent errors as the samples are worth.
    pub fn bic(&self, squares: f64, parameters: usize) -> f64 {
        criterion::schwarz(squares, parameters, self.counted(), self.dependence)
    }

    /// What the errors' own autocorrelation makes of [`Signals::dependence`].
    pub fn dependence_of(&self, output: &[f64]) -> f64 {
        criterion::dependence(output, &self.y, self.from)
    }
}
