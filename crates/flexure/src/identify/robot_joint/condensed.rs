//! Equations of motion condensed to inner products, in which physical forms are fitted without the data.
//!
//! Between close knots a curve is nearly linear, so a form's columns are sums of those of hat functions h,
//!
//! $$ g(\xi) \approx \sum_k g(\xi_k)\, h_k(\xi). $$
//!
//! With the inner products of the hats, of the fixed columns and of the right-hand side, a fit costs microseconds. That affords many
//! starts, and profile likelihoods.

use super::basis::{Spacing, mean_of, range};
use super::column_noise::Slopes;
use super::equations::{Column, Equations, RIDGE, Scaled};
use super::form_fit::{FormEquations, Shape};
use super::fourier::Modulation;
use super::layout::{FormLayout, FormParameter};
use crate::linear::levenberg_marquardt::{NormalEquations, minimise_squares};
use crate::parallel;

/// Knots on either side of zero.
const KNOTS: usize = 70;
/// How much denser they lie at zero than at the ends.
const DENSER: f64 = 100.0;
/// Iterations of a minimisation.
const ITERATIONS: usize = 60;
/// The largest logarithm of a shape parameter.
const LARGEST_LOG: f64 = 40.0;

/// A parameter that is held at a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Held {
    pub parameter: FormParameter,
    pub value: f64,
}

/// A minimum over everything that is not held.
#[derive(Debug, Clone)]
pub(super) struct Minimum {
    /// The objective there; see [`super::equations::Solution`].
    pub objective: f64,
    /// The logarithms of all shape parameters.
    pub logs: Vec<f64>,
    /// The factors of all terms.
    pub factors: Vec<f64>,
}

impl Minimum {
    /// The value of a parameter.
    pub fn value(&self, parameter: FormParameter) -> f64 {
        match parameter {
            FormParameter::Factor(i) => self.factors[i],
            FormParameter::Log(i) => self.logs[i],
        }
    }
}

/// The hat functions of a curve.
struct Hats {
    knots: Vec<f64>,
    /// The number of the first one's column.
    first: usize,
}

/// The inner products.
pub(super) struct Condensed {
    /// Of the hats of each curve and the right-hand side, without what the fixed columns take of them, row-major.
    gram: Vec<f64>,
    size: usize,
    /// Of each curve.
    hats: Vec<Hats>,
}

/// A column as a sum of neighbouring ones.
#[derive(Clone)]
struct ColumnSum {
    /// The first one's number.
    first: usize,
    factors: Vec<f64>,
}

/// The columns that stand in a fit for given logarithms, as sums of hats.
struct Sums {
    /// Of the terms whose factors are free.
    free: Vec<ColumnSum>,
    /// Of the term whose factor is held.
    held: Option<ColumnSum>,
    /// Of the derivatives of each term by each of its logarithms, with the term's number.
    slopes: Vec<(usize, ColumnSum)>,
}

/// The inner products of the free terms, their derivatives and the right-hand side, in this order.
struct Products {
    entries: Vec<f64>,
    size: usize,
    free: usize,
    slopes: usize,
}

impl Products {
    fn at(&self, i: usize, j: usize) -> f64 {
        self.entries[i * self.size + j]
    }

    /// The number of the right-hand side.
    fn right(&self) -> usize {
        self.free + self.slopes
    }
}

/// The best factors for given logarithms.
struct Projected {
    normal: NormalEquations,
    factors: Vec<f64>,
}

impl Condensed {
    /// The inner products of these equations, whatever the terms of their curves; `None` if the work was asked to stop.
    pub fn new(forms: &FormEquations) -> Option<Condensed> {
        let fixed = forms.fixed.len();
        let mut columns: Vec<Column> = forms.fixed.clone();
        let mut hats = Vec::new();
        let mut noisy = forms.noisy.clone();
        for Shape { curve, .. } in &forms.shapes {
            let knots = between(curve.x, curve.sign_width());
            let first = columns.len();
            noisy.extend(curve.noisy(|| slopes(forms.modulation, &knots, curve.x), |k| first + k, |i| i));
            let own: Vec<Column> = parallel::map(knots.len(), |k| {
                let values = mean_of(curve.x, |x| hat(&knots, k, x));
                curve.column(&forms.modulation.of(&values), 1.0)
            });
            columns.extend(own);
            hats.push(Hats {
                first: first - fixed,
                knots,
            });
        }
        columns.push(forms.right.iter().cloned().map(Some).collect());
        let size = columns.len();
        let equations = Equations {
            columns,
            right: Vec::new(),
            noise: forms.noise.clone(),
            noisy,
        };
        let mut gram = equations.gram(fixed)?.products;
        (0..fixed).for_each(|i| gram[i * size + i] *= 1.0 + RIDGE);
        Some(Condensed {
            gram: beside(gram, size, fixed),
            size: size - fixed,
            hats,
        })
    }

    /// The inner products of sums of columns.
    fn products(&self, sums: &[ColumnSum]) -> Vec<f64> {
        let n = sums.len();
        let mut products = vec![0.0; n * n];
        let mut column = vec![0.0; self.size];
        for (j, sum) in sums.iter().enumerate() {
            column.fill(0.0);
            for (k, factor) in sum.factors.iter().enumerate() {
                let row = &self.gram[(sum.first + k) * self.size..(sum.first + k + 1) * self.size];
                column.iter_mut().zip(row).for_each(|(c, g)| *c += factor * g);
            }
            for (i, other) in sums[..=j].iter().enumerate() {
                let product = other
                    .factors
                    .iter()
                    .zip(&column[other.first..])
                    .map(|(w, c)| w * c)
                    .sum();
                products[i * n + j] = product;
                products[j * n + i] = product;
            }
        }
        products
    }

    /// The terms and their derivatives for these logarithms; `held` is the number of a factor.
    fn sums(&self, shapes: &[Shape], logs: &[f64], held: Option<usize>) -> Sums {
        let layout = FormLayout::new(0, shapes.iter().map(|s| &s.terms[..]));
        let mut sums = Sums {
            free: Vec::new(),
            held: None,
            slopes: Vec::new(),
        };
        let mut number = 0;
        for ((shape, hats), own) in shapes.iter().zip(&self.hats).zip(layout.logs) {
            let width = shape.curve.sign_width();
            for (term, t) in shape.split(&logs[own]) {
                let over = |f: &dyn Fn(f64) -> f64| ColumnSum {
                    first: hats.first,
                    factors: hats.knots.iter().map(|&x| f(x)).collect(),
                };
                let values = over(&|x| term.value(x, t, width));
                match held == Some(number) {
                    true => sums.held = Some(values),
                    false => sums.free.push(values),
                }
                let slopes = (0..t.len()).map(|k| (number, over(&|x| term.by_shape(x, t, k, width))));
                sums.slopes.extend(slopes);
                number += 1;
            }
        }
        sums
    }

    /// The inner products of a fit, with the term whose factor is held at a value taken to the right-hand side.
    fn products_of_fit(&self, sums: &Sums, held: Option<f64>) -> Products {
        let slopes = sums.slopes.iter().map(|(_, sum)| sum);
        let mut all: Vec<ColumnSum> = sums.free.iter().chain(slopes).cloned().collect();
        all.push(ColumnSum {
            first: self.size - 1,
            factors: vec![1.0],
        });
        let right = all.len() - 1;
        all.extend(sums.held.clone());
        let n = all.len();
        let mut entries = self.products(&all);
        if let Some(value) = held.filter(|_| n == right + 2) {
            for i in 0..n {
                entries[i * n + right] -= value * entries[i * n + n - 1];
            }
            for j in 0..n {
                entries[right * n + j] -= value * entries[(n - 1) * n + j];
            }
        }
        Products {
            entries,
            size: n,
            free: sums.free.len(),
            slopes: sums.slopes.len(),
        }
    }

    /// The best factors for these logarithms, and the objective as a function of the logarithms alone (variable projection).
    fn projected(&self, shapes: &[Shape], logs: &[f64], held: Option<(usize, f64)>) -> Option<Projected> {
        if logs.iter().any(|t| !(t.abs() < LARGEST_LOG)) {
            return None;
        }
        let sums = self.sums(shapes, logs, held.map(|(number, _)| number));
        let g = self.products_of_fit(&sums, held.map(|(_, value)| value));
        let (free, slopes, right) = (g.free, g.slopes, g.right());
        let normal = Scaled::new(&g.entries, g.size, free);
        // The factors of the free terms whose sum is nearest to a column.
        let nearest = |column: usize| {
            let moments: Vec<f64> = (0..free).map(|i| g.at(i, column)).collect();
            normal.solve(&moments)
        };
        let x = nearest(right)?;
        let mut objective = g.at(right, right);
        for i in 0..free {
            let with: f64 = (0..free).map(|j| g.at(i, j) * x[j]).sum();
            objective += x[i] * (with - 2.0 * g.at(i, right));
        }
        let mut factors = x.clone();
        if let Some((number, value)) = held {
            factors.insert(number, value);
        }
        // Kaufman's Jacobian: each derivative without what the free terms take of it, times its term's factor.
        let taken: Vec<Vec<f64>> = (0..slopes).map(|k| nearest(free + k)).collect::<Option<_>>()?;
        let factor = |k: usize| factors[sums.slopes[k].0];
        let mut normal = vec![0.0; slopes * slopes];
        for i in 0..slopes {
            for j in 0..slopes {
                let along: f64 = (0..free).map(|t| taken[i][t] * g.at(t, free + j)).sum();
                normal[i * slopes + j] = factor(i) * factor(j) * (g.at(free + i, free + j) - along);
            }
        }
        let descent = (0..slopes).map(|i| {
            let along: f64 = (0..free).map(|t| x[t] * g.at(t, free + i)).sum();
            factor(i) * (g.at(free + i, right) - along)
        });
        Some(Projected {
            normal: NormalEquations {
                cost: objective,
                descent: descent.collect(),
                normal,
            },
            factors,
        })
    }

    /// The minimum next to these logarithms; `None` if there is none in double precision.
    pub fn minimum(&self, shapes: &[Shape], start: &[f64], held: Option<Held>) -> Option<Minimum> {
        let (mut factor, mut log) = (None, None);
        if let Some(Held { parameter, value }) = held {
            match parameter {
                FormParameter::Factor(number) => factor = Some((number, value)),
                FormParameter::Log(number) => log = Some((number, value)),
            }
        }
        let all = |free: &[f64]| -> Vec<f64> {
            let mut logs = free.to_vec();
            if let Some((number, value)) = log {
                logs.insert(number, value);
            }
            logs
        };
        let mut free = start.to_vec();
        if let Some((number, _)) = log {
            free.remove(number);
        }
        if !free.is_empty() {
            let minimum = minimise_squares(free, ITERATIONS, |free| {
                let equations = self.projected(shapes, &all(free), factor)?.normal;
                Some(match log {
                    None => equations,
                    Some((number, _)) => without(&equations, number),
                })
            })?;
            free = minimum.parameters;
        }
        let logs = all(&free);
        let end = self.projected(shapes, &logs, factor)?;
        Some(Minimum {
            objective: end.normal.cost,
            factors: end.factors,
            logs,
        })
    }
}

/// The inner products of the other columns without what the first `fixed` columns take of them (a Schur complement).
fn beside(mut gram: Vec<f64>, size: usize, fixed: usize) -> Vec<f64> {
    for k in 0..fixed {
        let row: Vec<f64> = gram[k * size..(k + 1) * size].to_vec();
        // The diagonal entry has shrunk; a column that is a sum of the ones before takes nothing.
        let pivot = row[k];
        if !(pivot > 0.0) {
            continue;
        }
        for i in k + 1..size {
            let share = row[i] / pivot;
            let other = &mut gram[i * size + k + 1..(i + 1) * size];
            other.iter_mut().zip(&row[k + 1..]).for_each(|(g, r)| *g -= share * r);
        }
    }
    let kept = |i: usize| &gram[i * size + fixed..(i + 1) * size];
    (fixed..size).flat_map(kept).copied().collect()
}

/// The equations without one unknown.
fn without(equations: &NormalEquations, number: usize) -> NormalEquations {
    let n = equations.descent.len();
    let kept: Vec<usize> = (0..n).filter(|&i| i != number).collect();
    NormalEquations {
        cost: equations.cost,
        descent: kept.iter().map(|&i| equations.descent[i]).collect(),
        normal: kept
            .iter()
            .flat_map(|&i| kept.iter().map(move |&j| (i, j)))
            .map(|(i, j)| equations.normal[i * n + j])
            .collect(),
    }
}

/// Knots over the range of x, closer to each other near zero, with those at which a sign that is softened within `width` bends.
fn between(x: &[f64], width: f64) -> Vec<f64> {
    let [low, high] = range(x);
    let spacing = Spacing::new([low, high], DENSER);
    let mut knots: Vec<f64> = (1..2 * KNOTS)
        .map(|i| spacing.point(i, 2 * KNOTS))
        .chain([-width, 0.0, width])
        .filter(|k| *k > low && *k < high)
        .chain([low, high])
        .collect();
    knots.sort_unstable_by(f64::total_cmp);
    knots.dedup();
    knots
}

/// The hat function that is 1 at a knot and 0 at all others.
fn hat(knots: &[f64], k: usize, x: f64) -> f64 {
    if k > 0 && x < knots[k] {
        ((x - knots[k - 1]) / (knots[k] - knots[k - 1])).max(0.0)
    } else if k + 1 < knots.len() && x > knots[k] {
        ((knots[k + 1] - x) / (knots[k + 1] - knots[k])).max(0.0)
    } else {
        1.0
    }
}

/// The slopes of the hat functions at the points x.
fn slopes(modulation: &Modulation, knots: &[f64], x: &[f64]) -> Slopes {
    Slopes::new(modulation, knots.len(), |i| {
        let k = knots.partition_point(|knot| *knot <= x[i]).clamp(1, knots.len() - 1);
        let rise = 1.0 / (knots[k] - knots[k - 1]);
        (k - 1, [-rise, rise])
    })
}

#[cfg(test)]
#[path = "condensed_tests.rs"]
mod tests;
