//! The simulation error of a sandwich and its exact derivatives, all by filtering.
//!
//! With $w = G_1 u$, $z = f(w)$, $y = G_2 z + o$ and a front parameter p,
//! $\partial y/\partial p = G_2\,[f'(w)\,\partial w/\partial p]$; for a coefficient $a_i$ of a section A of either block,
//! $\partial G/\partial a_i = -z^{-i} G / A$.

use rayon::prelude::*;

use super::descent::Residuals;
use super::rational::Rational;
use super::shape::{Local, Shape};

/// Linear, static, linear.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct Sandwich {
    pub front: Rational,
    pub shape: Shape,
    pub back: Rational,
    /// Added to the output; free only where the back's static gain vanishes.
    pub offset: f64,
}

impl Sandwich {
    pub fn run(&self, u: &[f64]) -> Vec<f64> {
        let z: Vec<f64> = self.front.run(u).iter().map(|w| self.shape.value(*w)).collect();
        let mut y = self.back.run(&z);
        y.iter_mut().for_each(|y| *y += self.offset);
        y
    }

    pub fn parameters(&self) -> Vec<f64> {
        let mut p = self.front.parameters();
        p.extend(&self.shape.c);
        p.extend(self.back.parameters());
        p.push(self.offset);
        p
    }

    pub fn with(&self, p: &[f64]) -> Sandwich {
        let first = self.front.b.len() + self.front.order();
        let second = first + self.shape.c.len();
        let mut shape = self.shape.clone();
        shape.c.copy_from_slice(&p[first..second]);
        Sandwich {
            front: self.front.with(&p[..first]),
            shape,
            back: self.back.with(&p[second..p.len() - 1]),
            offset: p[p.len() - 1],
        }
    }
}

/// A record, the first samples of which only let the initial state decay.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Data {
    pub u: Vec<f64>,
    pub y: Vec<f64>,
    /// Samples from here on count.
    pub from: usize,
    /// So many of them carry as much information as one whose error is independent of the others'.
    pub dependence: f64,
}

impl Data {
    pub fn counted(&self) -> usize {
        self.y.len() - self.from
    }

    pub fn squares(&self, output: &[f64]) -> f64 {
        let errors = output[self.from..].iter().zip(&self.y[self.from..]);
        errors.map(|(p, y)| (p - y) * (p - y)).sum()
    }

    /// The first samples, so many of which count, or all.
    pub fn head(&self, counted: usize) -> Data {
        let n = self.y.len().min(self.from + counted);
        Data {
            u: self.u[..n].to_vec(),
            y: self.y[..n].to_vec(),
            from: self.from,
            dependence: self.dependence,
        }
    }
}

/// One column of the Jacobian.
#[derive(Clone, Copy)]
enum Column {
    FrontNumerator(usize),
    FrontSection(usize, usize),
    Coefficient(usize),
    BackNumerator(usize),
    BackSection(usize, usize),
    Offset,
}

/// The simulation error of a sandwich on a record, over its parameters but for those that fix the scales.
pub(super) struct SandwichLoss<'a> {
    data: &'a Data,
    at: Sandwich,
    free: Vec<usize>,
    columns: Vec<Column>,
}

impl<'a> SandwichLoss<'a> {
    pub fn new(at: Sandwich, data: &'a Data) -> Self {
        let (free, columns) = free_columns(&at);
        SandwichLoss {
            data,
            at,
            free,
            columns,
        }
    }

    /// The free parameters at the start.
    pub fn start(&self) -> Vec<f64> {
        let all = self.at.parameters();
        self.free.iter().map(|&i| all[i]).collect()
    }

    /// The sandwich with these free parameters.
    pub fn sandwich(&self, free: &[f64]) -> Sandwich {
        let mut all = self.at.parameters();
        self.free.iter().zip(free).for_each(|(&i, p)| all[i] = *p);
        self.at.with(&all)
    }

    /// Residuals and the Jacobian's columns.
    fn derivatives(&self, s: &Sandwich) -> (Vec<f64>, Vec<Vec<f64>>) {
        let Data { u, y, .. } = self.data;
        let all_pole = s.front.all_pole(u);
        let w = s.front.numerator(&all_pole);
        let local: Vec<Local> = w.iter().map(|w| s.shape.local(*w)).collect();
        let (z, slope): (Vec<f64>, Vec<f64>) = local.iter().map(|l| s.shape.combine(l)).unzip();
        let back_pole = s.back.all_pole(&z);
        let response = s.back.numerator(&back_pole);
        let residuals = response.iter().zip(y).map(|(p, y)| p + s.offset - y).collect();
        let by_section: Vec<Vec<f64>> = s.front.sections.par_iter().map(|a| a.run(&w)).collect();
        let back_section: Vec<Vec<f64>> = s.back.sections.par_iter().map(|a| a.run(&response)).collect();
        let through = |of: &[f64], lag: usize, sign: f64| {
            let mut inner = vec![0.0; w.len()];
            let from = lag.min(w.len());
            for ((i, v), d) in inner[from..].iter_mut().zip(of).zip(&slope[from..]) {
                *i = sign * v * d;
            }
            s.back.run(&inner)
        };
        let jacobian = self
            .columns
            .par_iter()
            .map(|column| match *column {
                Column::FrontNumerator(i) => through(&all_pole, i, 1.0),
                Column::FrontSection(k, i) => through(&by_section[k], i, -1.0),
                Column::Coefficient(j) => {
                    let inner: Vec<f64> = local
                        .iter()
                        .map(|l| {
                            if (l.first..l.first + 4).contains(&j) {
                                l.values[j - l.first]
                            } else {
                                0.0
                            }
                        })
                        .collect();
                    s.back.run(&inner)
                }
                Column::BackNumerator(i) => delayed(&back_pole, i, 1.0),
                Column::BackSection(k, i) => delayed(&back_section[k], i, -1.0),
                Column::Offset => vec![1.0; w.len()],
            })
            .collect();
        (residuals, jacobian)
    }
}

impl Residuals for SandwichLoss<'_> {
    fn from(&self) -> usize {
        self.data.from
    }

    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let s = self.sandwich(parameters);
        if !(s.front.is_stable() && s.back.is_stable()) {
            return None;
        }
        let mut errors = s.run(&self.data.u);
        errors.iter_mut().zip(&self.data.y).for_each(|(e, y)| *e -= y);
        Some(errors)
    }

    fn linearise(&self, parameters: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        self.derivatives(&self.sandwich(parameters))
    }
}

/// The free parameters' indices and columns: the back's largest coefficient fixes the nonlinearity's scale (the
/// front's is fixed by the breakpoints), and the offset
/// is the nonlinearity's business unless the back suppresses it.
fn free_columns(s: &Sandwich) -> (Vec<usize>, Vec<Column>) {
    let largest = |b: &[f64]| (0..b.len()).max_by(|i, j| b[*i].abs().total_cmp(&b[*j].abs()));
    let sections = |r: &Rational| -> Vec<(usize, usize)> {
        let each = r.sections.iter().enumerate();
        each.flat_map(|(k, s)| (1..=s.order).map(move |i| (k, i))).collect()
    };
    let fixed = largest(&s.back.b);
    let mut all: Vec<Option<Column>> = Vec::new();
    all.extend((0..s.front.b.len()).map(|i| Some(Column::FrontNumerator(i))));
    all.extend(
        sections(&s.front)
            .iter()
            .map(|&(k, i)| Some(Column::FrontSection(k, i))),
    );
    all.extend((0..s.shape.c.len()).map(|j| Some(Column::Coefficient(j))));
    all.extend((0..s.back.b.len()).map(|i| (Some(i) != fixed).then_some(Column::BackNumerator(i))));
    all.extend(sections(&s.back).iter().map(|&(k, i)| Some(Column::BackSection(k, i))));
    all.push(blocks_constants(&s.back).then_some(Column::Offset));
    all.into_iter().enumerate().filter_map(|(i, c)| Some((i, c?))).unzip()
}

/// Whether hardly anything of a constant passes.
fn blocks_constants(g: &Rational) -> bool {
    let denominator: f64 = g.sections.iter().map(|s| 1.0 + s.a[0] + s.a[1]).product();
    let size: f64 = g.b.iter().map(|b| b.abs()).sum();
    g.static_gain().abs() < 1e-3 * size / denominator.abs()
}

pub(super) fn delayed(of: &[f64], lag: usize, sign: f64) -> Vec<f64> {
    let rest = of.len() - lag.min(of.len());
    let zeros = std::iter::repeat_n(0.0, of.len() - rest);
    zeros.chain(of[..rest].iter().map(|v| sign * v)).collect()
}

#[cfg(test)]
#[path = "loss_tests.rs"]
mod tests;
