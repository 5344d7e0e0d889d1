//! The simulation error of a sandwich and its exact derivatives, all by filtering.
//!
//! With $w = G_1 u$, $z = f(w)$, $y = G_2 z + o$ and a front parameter p,
//! $\partial y/\partial p = G_2\,[f'(w)\,\partial w/\partial p]$; for a coefficient $a_i$ of a section A of either block,
//! $\partial G/\partial a_i = -z^{-i} G / A$.

use rayon::prelude::*;

use super::descent::SumOfSquares;
use super::rational::Rational;
use super::shape::{Local, Shape};
use crate::linear::levenberg_marquardt::NormalEquations;

/// Samples a thread takes at a time; fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 4096;
/// Samples of all columns that are multiplied at a time, small enough for the cache.
const BLOCK: usize = 256;

/// Linear, static, linear.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sandwich {
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
pub(super) struct Data {
    pub u: Vec<f64>,
    pub y: Vec<f64>,
    /// Samples from here on count.
    pub from: usize,
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
    fn linearise(&self, s: &Sandwich) -> (Vec<f64>, Vec<Vec<f64>>) {
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
                        .map(|l| if (l.first..l.first + 4).contains(&j) { l.values[j - l.first] } else { 0.0 })
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

impl SumOfSquares for SandwichLoss<'_> {
    fn cost(&self, parameters: &[f64]) -> Option<f64> {
        let s = self.sandwich(parameters);
        (s.front.is_stable() && s.back.is_stable()).then(|| self.data.squares(&s.run(&self.data.u)))
    }

    fn normal_equations(&self, parameters: &[f64]) -> Option<NormalEquations> {
        let (residuals, jacobian) = self.linearise(&self.sandwich(parameters));
        Some(normal_equations(&residuals, &jacobian, self.data.from))
    }
}

/// The free parameters' indices and columns: the largest coefficient of either numerator fixes a scale, and the offset
/// is the nonlinearity's business unless the back suppresses it.
fn free_columns(s: &Sandwich) -> (Vec<usize>, Vec<Column>) {
    let largest = |b: &[f64]| (0..b.len()).max_by(|i, j| b[*i].abs().total_cmp(&b[*j].abs()));
    let sections = |r: &Rational| -> Vec<(usize, usize)> {
        let each = r.sections.iter().enumerate();
        each.flat_map(|(k, s)| (1..=s.order).map(move |i| (k, i))).collect()
    };
    let fixed = (largest(&s.front.b), largest(&s.back.b));
    let mut all: Vec<Option<Column>> = Vec::new();
    all.extend((0..s.front.b.len()).map(|i| Some(Column::FrontNumerator(i))));
    all.extend(sections(&s.front).iter().map(|&(k, i)| Some(Column::FrontSection(k, i))));
    all.extend((0..s.shape.c.len()).map(|j| Some(Column::Coefficient(j))));
    all.extend((0..s.back.b.len()).map(|i| (Some(i) != fixed.1).then_some(Column::BackNumerator(i))));
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

fn delayed(of: &[f64], lag: usize, sign: f64) -> Vec<f64> {
    let rest = of.len() - lag.min(of.len());
    let zeros = std::iter::repeat_n(0.0, of.len() - rest);
    zeros.chain(of[..rest].iter().map(|v| sign * v)).collect()
}

/// J'J, -J'r and r'r over the samples from `from` on.
pub(super) fn normal_equations(residuals: &[f64], jacobian: &[Vec<f64>], from: usize) -> NormalEquations {
    let n = jacobian.len();
    let all: Vec<&[f64]> = jacobian.iter().map(|c| &c[from..]).chain([&residuals[from..]]).collect();
    let samples = residuals.len() - from;
    let partial: Vec<Vec<f64>> = (0..samples.div_ceil(CHUNK))
        .into_par_iter()
        .map(|k| products(&all, k * CHUNK..samples.min((k + 1) * CHUNK)))
        .collect();
    let size = n + 1;
    let mut sum = vec![0.0; size * size];
    for part in &partial {
        sum.iter_mut().zip(part).for_each(|(s, p)| *s += p);
    }
    let mut normal = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..n {
            normal[i * n + j] = sum[i.max(j) * size + i.min(j)];
        }
    }
    NormalEquations {
        cost: sum[n * size + n],
        descent: (0..n).map(|j| -sum[n * size + j]).collect(),
        normal,
    }
}

/// The lower triangle of the columns' inner products over a range of samples, two by two columns at a time.
fn products(columns: &[&[f64]], range: std::ops::Range<usize>) -> Vec<f64> {
    let size = columns.len();
    let mut sum = vec![0.0; size * size];
    for start in range.clone().step_by(BLOCK) {
        let block = start..range.end.min(start + BLOCK);
        let of = |i: usize| &columns[i.min(size - 1)][block.clone()];
        for i in (0..size).step_by(2) {
            let (a, b) = (of(i), of(i + 1));
            for j in (0..=i).step_by(2) {
                let four = dot4(a, b, of(j), of(j + 1));
                sum[i * size + j] += four[0];
                if j + 1 < size {
                    sum[i * size + j + 1] += four[1];
                }
                if i + 1 < size {
                    sum[(i + 1) * size + j] += four[2];
                    sum[(i + 1) * size + j + 1] += four[3];
                }
            }
        }
    }
    sum
}

/// a.c, a.d, b.c, b.d
fn dot4(a: &[f64], b: &[f64], c: &[f64], d: &[f64]) -> [f64; 4] {
    const LANES: usize = 2;
    let mut lanes = [[0.0; LANES]; 4];
    let whole = a.len() / LANES * LANES;
    for t in (0..whole).step_by(LANES) {
        for l in 0..LANES {
            let (p, q, r, s) = (a[t + l], b[t + l], c[t + l], d[t + l]);
            lanes[0][l] += p * r;
            lanes[1][l] += p * s;
            lanes[2][l] += q * r;
            lanes[3][l] += q * s;
        }
    }
    for t in whole..a.len() {
        lanes[0][0] += a[t] * c[t];
        lanes[1][0] += a[t] * d[t];
        lanes[2][0] += b[t] * c[t];
        lanes[3][0] += b[t] * d[t];
    }
    lanes.map(|l| l.iter().sum())
}
