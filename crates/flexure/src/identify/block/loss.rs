//! The simulation error of a cascade and its exact derivatives, all by filtering.
//!
//! With $w = G_1 u$, $z = f(w)$, $y = G_2 z + o$ and a front parameter p,
//! $\partial y/\partial p = G_2\,[f'(w)\,\partial w/\partial p]$; for a coefficient $a_i$ of a section A of either block,
//! $\partial G/\partial a_i = -z^{-i} G / A$. With an instant between the samples, z is a sum of two such signals, each through
//! numerators of its own.

use rayon::prelude::*;

use super::descent::Residuals;
use super::rational::{Rational, convolved};
use super::shape::{Local, Shape};

/// Linear, static, linear.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct Cascade {
    pub front: Rational,
    pub shape: Shape,
    pub back: Rational,
    /// The instant between the samples, if the nonlinearity acts there too.
    pub between: Option<Between>,
    /// Added to the output; free only where the back's static gain vanishes.
    pub offset: f64,
}

/// Numerators, over the denominators of front and back, of the signal's way through an instant between the samples.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct Between {
    pub front: Vec<f64>,
    pub back: Vec<f64>,
}

impl Cascade {
    /// The nonlinearity alone.
    pub fn of(shape: Shape) -> Cascade {
        Cascade {
            front: Rational::pass(),
            shape,
            back: Rational::pass(),
            between: None,
            offset: 0.0,
        }
    }

    pub fn run(&self, u: &[f64]) -> Vec<f64> {
        let all_pole = self.front.all_pole(u);
        let mut sum = vec![self.offset; u.len()];
        for (front, back) in self.instants() {
            let w = convolved(front, &all_pole);
            let z: Vec<f64> = w.iter().map(|w| self.shape.value(*w)).collect();
            add(&mut sum, &convolved(back, &self.back.all_pole(&z)));
        }
        sum
    }

    /// The intermediate signal at every instant in a sampling interval.
    pub fn intermediate(&self, u: &[f64]) -> impl Iterator<Item = Vec<f64>> {
        let all_pole = self.front.all_pole(u);
        self.instants().map(move |(front, _)| convolved(front, &all_pole))
    }

    /// The numerators of front and back for every instant in a sampling interval.
    pub fn instants(&self) -> impl Iterator<Item = (&[f64], &[f64])> {
        let between = self.between.iter().map(|b| (&*b.front, &*b.back));
        std::iter::once((&*self.front.b, &*self.back.b)).chain(between)
    }

    /// The back for a signal that is the same at all instants.
    pub fn whole_back(&self) -> Rational {
        let mut whole = self.back.clone();
        if let Some(between) = &self.between {
            whole.b.resize(whole.b.len().max(between.back.len()), 0.0);
            whole.b.iter_mut().zip(&between.back).for_each(|(b, more)| *b += more);
        }
        whole
    }

    pub fn parameters(&self) -> Vec<f64> {
        let mut p = self.front.parameters();
        p.extend(self.shape.parameters());
        p.extend(self.back.parameters());
        p.extend(self.between.iter().flat_map(|b| b.front.iter().chain(&b.back)));
        p.push(self.offset);
        p
    }

    pub fn with(&self, p: &[f64]) -> Cascade {
        let first = self.front.b.len() + self.front.order();
        let second = first + self.shape.count();
        let third = second + self.back.b.len() + self.back.order();
        let mut shape = self.shape.clone();
        shape.set(&p[first..second]);
        Cascade {
            front: self.front.with(&p[..first]),
            shape,
            back: self.back.with(&p[second..third]),
            between: self.between.as_ref().map(|b| {
                let (front, back) = p[third..p.len() - 1].split_at(b.front.len());
                Between {
                    front: front.to_vec(),
                    back: back.to_vec(),
                }
            }),
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
    /// The polynomial that errors go through before they count: 1, or what whitens them.
    pub filter: Vec<f64>,
}

impl Data {
    /// All errors as they are, and independent of one another.
    pub fn new(u: Vec<f64>, y: Vec<f64>, from: usize) -> Data {
        Data {
            u,
            y,
            from,
            dependence: 1.0,
            filter: vec![1.0],
        }
    }

    /// The same samples, with errors that count as `filter` leaves them, independent of one another.
    pub fn through(&self, filter: Vec<f64>) -> Data {
        Data {
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
    pub fn head(&self, counted: usize) -> Data {
        let n = self.y.len().min(self.from.saturating_add(counted));
        Data {
            u: self.u[..n].to_vec(),
            y: self.y[..n].to_vec(),
            from: self.from,
            dependence: self.dependence,
            filter: self.filter.clone(),
        }
    }
}

/// The sum of squared errors from sample `from` on, through a monic polynomial in the delay.
pub(in crate::identify) fn squares_through(filter: &[f64], output: &[f64], y: &[f64], from: usize) -> f64 {
    let errors = output.iter().zip(y).map(|(p, y)| p - y);
    if filter.len() == 1 {
        return errors.skip(from).map(|e| e * e).sum();
    }
    let errors: Vec<f64> = errors.collect();
    convolved(filter, &errors)[from..].iter().map(|e| e * e).sum()
}

/// One column of the Jacobian; numerators are those of an instant.
#[derive(Clone, Copy)]
enum Column {
    FrontNumerator(usize, usize),
    FrontSection(usize, usize),
    Coefficient(usize),
    BackNumerator(usize, usize),
    BackSection(usize, usize),
    Offset,
}

/// The signals of one instant in every sampling interval.
struct Instant<'a> {
    w: Vec<f64>,
    local: Vec<Local>,
    /// f'(w).
    slope: Vec<f64>,
    /// f(w) through the back's denominator.
    back_pole: Vec<f64>,
    /// The back's numerator.
    back: &'a [f64],
}

impl<'a> Instant<'a> {
    fn new(s: &Cascade, w: Vec<f64>, back: &'a [f64]) -> Self {
        let local: Vec<Local> = w.iter().map(|w| s.shape.local(*w)).collect();
        let at = w.iter().zip(&local);
        let (z, slope): (Vec<f64>, Vec<f64>) = at.map(|(w, l)| s.shape.value_and_slope(*w, l)).unzip();
        Instant {
            back_pole: s.back.all_pole(&z),
            w,
            local,
            slope,
            back,
        }
    }
}

fn add(sum: &mut [f64], more: &[f64]) {
    sum.iter_mut().zip(more).for_each(|(s, m)| *s += m);
}

/// The simulation error of a cascade on a record, over its parameters but for those that fix the scales.
pub(in crate::identify) struct CascadeLoss<'a> {
    data: &'a Data,
    at: Cascade,
    free: Vec<usize>,
    columns: Vec<Column>,
}

impl<'a> CascadeLoss<'a> {
    pub fn new(at: Cascade, data: &'a Data) -> Self {
        let (free, columns) = free_columns(&at);
        CascadeLoss {
            data,
            at,
            free,
            columns,
        }
    }

    /// With the nonlinearity's level fixed, for a sum in which another branch has it.
    pub fn without_level(mut self) -> Self {
        let middle = self.at.shape.c.len() / 2;
        let fixed = (self.columns.iter()).position(|c| matches!(c, Column::Coefficient(j) if *j == middle));
        if let Some(fixed) = fixed {
            self.free.remove(fixed);
            self.columns.remove(fixed);
        }
        self
    }

    /// The number of free parameters.
    pub fn free(&self) -> usize {
        self.free.len()
    }

    /// The free parameters at the start.
    pub fn start(&self) -> Vec<f64> {
        let all = self.at.parameters();
        self.free.iter().map(|&i| all[i]).collect()
    }

    /// The cascade with these free parameters.
    pub fn cascade(&self, free: &[f64]) -> Cascade {
        let mut all = self.at.parameters();
        self.free.iter().zip(free).for_each(|(&i, p)| all[i] = *p);
        self.at.with(&all)
    }

    /// Residuals and the Jacobian's columns.
    fn derivatives(&self, s: &Cascade) -> (Vec<f64>, Vec<Vec<f64>>) {
        let Data { u, y, .. } = self.data;
        let all_pole = s.front.all_pole(u);
        let instants: Vec<Instant> = (s.instants())
            .map(|(front, back)| Instant::new(s, convolved(front, &all_pole), back))
            .collect();
        let mut output = vec![s.offset; u.len()];
        instants
            .iter()
            .for_each(|i| add(&mut output, &convolved(i.back, &i.back_pole)));
        let residuals = output.iter().zip(y).map(|(p, y)| p - y).collect();
        output.iter_mut().for_each(|y| *y -= s.offset);
        let by_section: Vec<Vec<Vec<f64>>> = (s.front.sections.par_iter())
            .map(|a| instants.iter().map(|i| a.run(&i.w)).collect())
            .collect();
        let back_section: Vec<Vec<f64>> = s.back.sections.par_iter().map(|a| a.run(&output)).collect();
        // What changes of the intermediate signal do to the output.
        let through = |parts: &mut dyn Iterator<Item = (&Instant, &Vec<f64>)>, lag: usize, sign: f64| {
            let mut sum = vec![0.0; u.len()];
            for (instant, of) in parts {
                let mut inner = vec![0.0; u.len()];
                let from = lag.min(u.len());
                for ((i, v), d) in inner[from..].iter_mut().zip(of).zip(&instant.slope[from..]) {
                    *i = sign * v * d;
                }
                add(&mut sum, &convolved(instant.back, &inner));
            }
            s.back.all_pole(&sum)
        };
        let jacobian = self
            .columns
            .par_iter()
            .map(|column| match *column {
                Column::FrontNumerator(m, i) => through(&mut std::iter::once((&instants[m], &all_pole)), i, 1.0),
                Column::FrontSection(k, i) => through(&mut instants.iter().zip(&by_section[k]), i, -1.0),
                Column::Coefficient(j) => {
                    let mut sum = vec![0.0; u.len()];
                    for Instant { w, local, back, .. } in &instants {
                        add(&mut sum, &convolved(back, &s.shape.by_parameter(j, w, local)));
                    }
                    s.back.all_pole(&sum)
                }
                Column::BackNumerator(m, i) => delayed(&instants[m].back_pole, i, 1.0),
                Column::BackSection(k, i) => delayed(&back_section[k], i, -1.0),
                Column::Offset => vec![1.0; u.len()],
            })
            .collect();
        (residuals, jacobian)
    }
}

impl Residuals for CascadeLoss<'_> {
    fn from(&self) -> usize {
        self.data.from
    }

    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let s = self.cascade(parameters);
        if !(s.front.is_stable() && s.back.is_stable()) {
            return None;
        }
        let mut errors = s.run(&self.data.u);
        errors.iter_mut().zip(&self.data.y).for_each(|(e, y)| *e -= y);
        Some(errors)
    }

    fn linearise(&self, parameters: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        self.derivatives(&self.cascade(parameters))
    }
}

/// The free parameters' indices and columns: the back's largest coefficient fixes the nonlinearity's scale (the
/// front's is fixed by the breakpoints; one that is only a gain has nothing else), and the offset is the nonlinearity's
/// business unless the back suppresses it.
fn free_columns(s: &Cascade) -> (Vec<usize>, Vec<Column>) {
    let largest = |b: &[f64]| (0..b.len()).max_by(|i, j| b[*i].abs().total_cmp(&b[*j].abs()));
    let sections = |r: &Rational| -> Vec<(usize, usize)> {
        let each = r.sections.iter().enumerate();
        each.flat_map(|(k, s)| (1..=s.order).map(move |i| (k, i))).collect()
    };
    let fixed = largest(&s.back.b);
    let only_gain = s.front.b.len() == 1 && s.front.order() == 0 && s.between.is_none();
    let mut all: Vec<Option<Column>> = Vec::new();
    all.extend((0..s.front.b.len()).map(|i| (!only_gain).then_some(Column::FrontNumerator(0, i))));
    all.extend(
        sections(&s.front)
            .iter()
            .map(|&(k, i)| Some(Column::FrontSection(k, i))),
    );
    all.extend((0..s.shape.count()).map(|j| Some(Column::Coefficient(j))));
    all.extend((0..s.back.b.len()).map(|i| (Some(i) != fixed).then_some(Column::BackNumerator(0, i))));
    all.extend(sections(&s.back).iter().map(|&(k, i)| Some(Column::BackSection(k, i))));
    if let Some(between) = &s.between {
        all.extend((0..between.front.len()).map(|i| Some(Column::FrontNumerator(1, i))));
        all.extend((0..between.back.len()).map(|i| Some(Column::BackNumerator(1, i))));
    }
    all.push(blocks_constants(&s.whole_back()).then_some(Column::Offset));
    all.into_iter().enumerate().filter_map(|(i, c)| Some((i, c?))).unzip()
}

/// Whether hardly anything of a constant passes.
fn blocks_constants(g: &Rational) -> bool {
    let denominator: f64 = g.sections.iter().map(|s| 1.0 + s.a[0] + s.a[1]).product();
    let size: f64 = g.b.iter().map(|b| b.abs()).sum();
    g.static_gain().abs() < 1e-3 * size / denominator.abs()
}

pub(in crate::identify) fn delayed(of: &[f64], lag: usize, sign: f64) -> Vec<f64> {
    let rest = of.len() - lag.min(of.len());
    let zeros = std::iter::repeat_n(0.0, of.len() - rest);
    zeros.chain(of[..rest].iter().map(|v| sign * v)).collect()
}

#[cfg(test)]
#[path = "loss_tests.rs"]
mod tests;
