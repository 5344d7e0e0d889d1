//! The simulation error and its exact derivatives, all by filtering.
//!
//! With $x = o + \sum_i G_i f_i(u_i)$ and $y = g(x)$, every derivative of x is a filtered signal times $g'(x)$: for a
//! coefficient of $f_i$ the filtered B-spline, for one of a denominator's section A $-z^{-k} G_i f_i / A$.

use rayon::prelude::*;

use super::super::{Local, Residuals, Shape, delayed};
use super::system::{Branch, Signals, System};

/// One column of the Jacobian; the first index is the branch's.
#[derive(Clone, Copy)]
enum Column {
    Coefficient(usize, usize),
    Numerator(usize, usize),
    Section(usize, usize, usize),
    Offset,
    Output(usize),
}

/// The signals of a branch.
struct Parts {
    /// What enters the nonlinearity.
    input: Vec<f64>,
    local: Vec<Local>,
    /// The static output through the denominator.
    all_pole: Vec<f64>,
    /// The branch's output through every section once more.
    by_section: Vec<Vec<f64>>,
    output: Vec<f64>,
}

impl Parts {
    fn new(branch: &Branch, u: &[f64]) -> Parts {
        let (input, shape) = (branch.delayed(u), &branch.shape);
        let local: Vec<Local> = input.iter().map(|u| shape.local(*u)).collect();
        let at = input.iter().zip(&local);
        let v: Vec<f64> = at.map(|(u, l)| shape.value_and_slope(*u, l).0).collect();
        let all_pole = branch.linear.all_pole(&v);
        let output = branch.linear.numerator(&all_pole);
        Parts {
            by_section: branch.linear.sections.iter().map(|a| a.run(&output)).collect(),
            input,
            local,
            all_pole,
            output,
        }
    }
}

/// The simulation error over the parameters but for those that fix the branches' scales and offsets.
pub(super) struct Loss<'a> {
    data: &'a Signals,
    at: System,
    free: Vec<usize>,
    columns: Vec<Column>,
}

impl<'a> Loss<'a> {
    pub fn new(at: System, data: &'a Signals) -> Self {
        let (free, columns) = free_columns(&at);
        Loss {
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

    /// The system with these free parameters.
    pub fn system(&self, free: &[f64]) -> System {
        let mut all = self.at.parameters();
        self.free.iter().zip(free).for_each(|(&i, p)| all[i] = *p);
        self.at.with(&all)
    }
}

impl Residuals for Loss<'_> {
    fn from(&self) -> usize {
        self.data.from
    }

    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let s = self.system(parameters);
        if !s.is_stable() {
            return None;
        }
        let mut errors = s.run(&self.data.u);
        errors.iter_mut().zip(&self.data.y).for_each(|(e, y)| *e -= y);
        Some(errors)
    }

    fn linearise(&self, parameters: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let s = self.system(parameters);
        let Signals { u, y, .. } = self.data;
        let parts: Vec<Parts> = s.branches.iter().zip(u).map(|(b, u)| Parts::new(b, u)).collect();
        let mut x = vec![s.offset; y.len()];
        for part in &parts {
            x.iter_mut().zip(&part.output).for_each(|(x, more)| *x += more);
        }
        let last: Option<Vec<Local>> = s.output.as_ref().map(|g| x.iter().map(|x| g.local(*x)).collect());
        let (inner, mut slope) = (x.clone(), None);
        if let (Some(g), Some(local)) = (&s.output, &last) {
            let at = inner.iter().zip(local);
            let (z, d): (Vec<f64>, Vec<f64>) = at.map(|(x, l)| g.value_and_slope(*x, l)).unzip();
            (x, slope) = (z, Some(d));
        }
        let outward = |mut column: Vec<f64>| {
            if let Some(slope) = &slope {
                column.iter_mut().zip(slope).for_each(|(c, d)| *c *= d);
            }
            column
        };
        let jacobian = self.columns.par_iter().map(|column| match *column {
            Column::Coefficient(i, j) => {
                let (branch, Parts { input, local, .. }) = (&s.branches[i], &parts[i]);
                outward(branch.linear.run(&branch.shape.by_parameter(j, input, local)))
            }
            Column::Numerator(i, k) => outward(delayed(&parts[i].all_pole, k, 1.0)),
            Column::Section(i, a, k) => outward(delayed(&parts[i].by_section[a], k, -1.0)),
            Column::Offset => outward(vec![1.0; y.len()]),
            Column::Output(j) => match (&s.output, &last) {
                (Some(g), Some(local)) => g.by_parameter(j, &inner, local),
                _ => vec![0.0; y.len()],
            },
        });
        let jacobian = jacobian.collect();
        (x.iter().zip(y).map(|(p, y)| p - y).collect(), jacobian)
    }
}

/// The free parameters' indices and columns: a branch's largest numerator coefficient fixes its scale, the coefficient in
/// the middle its nonlinearity's offset; the last nonlinearity's breakpoints fix the rest.
fn free_columns(s: &System) -> (Vec<usize>, Vec<Column>) {
    let mut all: Vec<Option<Column>> = Vec::new();
    for (i, branch) in s.branches.iter().enumerate() {
        let b = &branch.linear.b;
        let largest = (0..b.len()).max_by(|j, k| b[*j].abs().total_cmp(&b[*k].abs()));
        let (coefficients, middle) = (branch.shape.count(), branch.shape.c.len() / 2);
        all.extend((0..coefficients).map(|j| (j != middle).then_some(Column::Coefficient(i, j))));
        all.extend((0..b.len()).map(|k| (Some(k) != largest).then_some(Column::Numerator(i, k))));
        for (a, section) in branch.linear.sections.iter().enumerate() {
            all.extend((1..=section.order).map(|k| Some(Column::Section(i, a, k))));
        }
    }
    all.push(Some(Column::Offset));
    let last = s.output.as_ref().map_or(0, Shape::count);
    all.extend((0..last).map(|j| Some(Column::Output(j))));
    all.into_iter().enumerate().filter_map(|(i, c)| Some((i, c?))).unzip()
}

#[cfg(test)]
#[path = "loss_tests.rs"]
mod tests;
