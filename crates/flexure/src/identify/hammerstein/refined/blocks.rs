//! Both blocks with all their parameters, and the samples for their fit.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::experiments::Experiments;
use super::limits::{AFTER_SETTLING, SAMPLES_PER_UNCOUNTED};
use super::linear_part::LinearPart;
use super::piecewise::PiecewiseCubics;
use crate::linear::correlation::{mean, variance};
use crate::parallel;

/// The samples at the start of an experiment that do not count.
pub(super) fn uncounted(memory: usize, length: usize) -> usize {
    (memory + AFTER_SETTLING).min(length / SAMPLES_PER_UNCOUNTED)
}

/// The fitted samples of all experiments, one after the other.
pub(super) struct Observed<'a> {
    pub u: &'a [f64],
    /// The output minus its mean; the model's value where it is missing.
    pub y: Vec<f64>,
    pub output_mean: f64,
    /// The experiments' samples.
    pub experiments: Vec<Range<usize>>,
    /// Which samples count: not those at the start of an experiment nor the missing ones.
    pub counts: Vec<bool>,
    /// The samples without an output.
    pub missing: Vec<usize>,
    /// The lags after which the response counts as settled.
    pub memory: usize,
}

impl<'a> Observed<'a> {
    /// The samples of the fit, for a system whose response settles within `memory` samples.
    pub fn new(all: &'a Experiments, memory: usize) -> Observed<'a> {
        let y = &all.y[..all.fitted];
        let output_mean = mean(y);
        let experiments = all.fitted_parts();
        let mut counts: Vec<bool> = all.missing[..all.fitted].iter().map(|m| !m).collect();
        for part in &experiments {
            let uncounted = uncounted(memory, part.len());
            counts[part.start..part.start + uncounted].fill(false);
        }
        Observed {
            u: &all.u[..all.fitted],
            y: y.iter().map(|y| y - output_mean).collect(),
            output_mean,
            experiments,
            counts,
            missing: (0..all.fitted).filter(|&i| all.missing[i]).collect(),
            memory,
        }
    }

    /// A shard, of which the samples from `from` on count; their outputs are reckoned from `output_mean`.
    pub fn shard(u: &'a [f64], y: &[f64], output_mean: f64, from: usize) -> Observed<'a> {
        Observed {
            u,
            y: y.iter().map(|y| y - output_mean).collect(),
            output_mean,
            experiments: std::iter::once(0..u.len()).collect(),
            counts: (0..u.len()).map(|i| i >= from).collect(),
            missing: Vec::new(),
            memory: from,
        }
    }

    /// The first samples.
    pub fn head(&self, samples: usize) -> Observed<'a> {
        let n = samples.min(self.u.len());
        let within = self.experiments.iter().filter(|part| part.start < n);
        Observed {
            u: &self.u[..n],
            y: self.y[..n].to_vec(),
            output_mean: self.output_mean,
            experiments: within.map(|part| part.start..part.end.min(n)).collect(),
            counts: self.counts[..n].to_vec(),
            missing: self.missing.iter().copied().filter(|i| *i < n).collect(),
            memory: self.memory,
        }
    }

    /// The squared error of a prediction of y after subtraction of the best offset.
    pub fn squares(&self, simulated: &[f64]) -> f64 {
        let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for ((y, s), _) in self.y.iter().zip(simulated).zip(&self.counts).filter(|(_, c)| **c) {
            n += 1.0;
            sum += y - s;
            squares += (y - s) * (y - s);
        }
        squares - sum * sum / f64::max(n, 1.0)
    }

    /// y less offset and prediction, zero at samples that do not count.
    pub fn errors(&self, simulated: &[f64], offset: f64) -> Vec<f64> {
        let pairs = self.y.iter().zip(simulated).zip(&self.counts);
        pairs
            .map(|((y, s), counts)| if *counts { y - offset - s } else { 0.0 })
            .collect()
    }

    /// Replaces missing samples by the model's values.
    pub fn complete(&mut self, simulated: &[f64], offset: f64) {
        for &i in &self.missing {
            self.y[i] = simulated[i] + offset;
        }
    }
}

/// Both blocks.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Blocks {
    pub basis: PiecewiseCubics,
    /// The coefficients of the basis' functions from the second on; the first is constant.
    pub c: Vec<f64>,
    pub linear: LinearPart,
    pub offset: f64,
}

/// The place of each kind of parameter in a row of all parameters.
pub(super) struct Layout {
    pub c: Range<usize>,
    pub offset: usize,
    pub b: Range<usize>,
    /// a_1, a_2, ...
    pub a: Range<usize>,
}

impl Layout {
    /// The number of parameters.
    pub fn len(&self) -> usize {
        self.a.end
    }
}

impl Blocks {
    pub fn layout(&self) -> Layout {
        let offset = self.c.len();
        let b = offset + 1..offset + 1 + self.linear.b().len();
        Layout {
            c: 0..offset,
            offset,
            a: b.end..b.end + self.linear.a().len(),
            b,
        }
    }

    /// The parameters in one row.
    pub fn parameters(&self) -> Vec<f64> {
        [&self.c[..], &[self.offset], self.linear.b(), self.linear.a()].concat()
    }

    /// The same blocks with other parameters.
    pub fn with(&self, p: &[f64]) -> Blocks {
        let at = self.layout();
        Blocks {
            basis: self.basis.clone(),
            c: p[at.c].to_vec(),
            linear: LinearPart::new(&p[at.b], &p[at.a], self.linear.delay),
            offset: p[at.offset],
        }
    }

    /// The parameter that the scale convention fixes: the numerator's largest coefficient.
    pub fn fixed_parameter(&self) -> usize {
        let b = self.linear.b();
        let largest = (0..b.len()).max_by(|&i, &j| b[i].abs().total_cmp(&b[j].abs()));
        self.layout().b.start + largest.unwrap_or(0)
    }

    /// The coefficients of all functions of the basis.
    pub fn coefficients(&self) -> Vec<f64> {
        [&[0.0], &self.c[..]].concat()
    }

    /// phi minus its mean.
    pub fn nonlinearity(&self) -> PiecewiseCubics {
        self.basis.combined(&self.coefficients())
    }

    /// phi minus its mean, at the samples.
    pub fn signal(&self, u: &[f64]) -> Vec<f64> {
        let phi = self.nonlinearity();
        parallel::numbers(u.len(), |i| phi.value(u[i]))
    }

    /// The output without the offset.
    pub fn simulated(&self, observed: &Observed) -> Vec<f64> {
        self.linear.filter(&observed.experiments, &self.signal(observed.u))
    }

    /// The share of the output's variance that the free run does not explain.
    pub fn unexplained(&self, observed: &Observed) -> f64 {
        let counted = observed.counts.iter().filter(|c| **c).count() as f64;
        observed.squares(&self.simulated(observed)) / (counted * variance(&observed.y))
    }

    /// The output error, zero at samples that do not count.
    pub fn errors(&self, observed: &Observed) -> Vec<f64> {
        observed.errors(&self.simulated(observed), self.offset)
    }
}
