//! Equations of motion condensed to inner products: physical forms are fitted in them without the data.
//!
//! Between close knots a curve is nearly linear, so a form's columns are sums of those of hat functions h,
//!
//! $$ g(\xi) \approx \sum_k g(\xi_k)\, h_k(\xi). $$
//!
//! With the inner products of the hats, of the fixed columns and of the right-hand side, a fit costs microseconds. So many starts and
//! profile likelihoods are affordable.

use std::ops::Range;

use super::basis::{Spacing, range};
use super::column_noise::Slopes;
use super::equations::{Column, Equations, dot};
use super::forms::{ShapedTerm, Term};
use super::fourier::Modulation;
use super::layout::{FormLayout, FormParameter};
use super::limits::{ITERATIONS, KNOTS, KNOTS_DENSER, LARGEST_LOG, RIDGE};
use super::normal::Normal;
use super::system::{Curve, Splines};
use crate::linalg::{Matrix, Vector};
use crate::linear::least_squares::NormalEquations;
use crate::linear::levenberg_marquardt::minimise_squares;
use crate::nonlinearity::spline::basis::LocalValues;
use crate::parallel;

/// A curve of the equations of motion that gets a physical form.
pub(super) struct FormedCurve<'a> {
    pub terms: Vec<Term>,
    pub curve: &'a Curve<'a>,
    /// The splines that are added to the form in the test; `None` for a form that is not tested.
    pub beside: Option<&'a Splines>,
}

impl FormedCurve<'_> {
    /// The terms with these logarithms.
    pub fn shaped<'b>(&'b self, logs: &'b [f64]) -> impl Iterator<Item = ShapedTerm<'b>> {
        ShapedTerm::all(&self.terms, logs, self.curve.sign_width())
    }
}

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
    /// Their rows in [`Condensed::gram`].
    columns: Range<usize>,
}

/// The inner products.
pub(super) struct Condensed {
    /// Inner products of the hats of each curve and, last, the right-hand side, with the fixed columns projected out.
    gram: Matrix,
    /// The hats of each curve.
    hats: Vec<Hats>,
}

/// A term's derivative by the logarithm of one of its shape parameters, without the term's factor.
struct LogDerivative {
    /// The number of the parameter's term; the term whose factor is held is counted too.
    term: usize,
    /// The derivative as a sum of hats.
    hats: Vector,
}

/// The columns of the forms for given logarithms, as sums of hats.
#[derive(Default)]
struct FormColumns {
    /// The terms.
    terms: Vec<Vector>,
    /// Their derivatives by each of their logarithms.
    derivatives: Vec<LogDerivative>,
}

/// The inner products of the columns of a fit: of the free terms, of the derivatives, and of the right-hand side, in this order.
struct FitProducts {
    g: Matrix,
    /// The number of free terms.
    free: usize,
    /// The number of the right-hand side.
    right: usize,
}

/// A factor that is held at a value.
#[derive(Clone, Copy)]
struct HeldFactor {
    term: usize,
    value: f64,
}

/// The best factors for given logarithms.
struct Projected {
    equations: NormalEquations,
    factors: Vec<f64>,
}

impl Condensed {
    /// The inner products of these equations, for any forms of these curves; `None` if the work was asked to stop.
    pub fn new(fixed: &Equations, curves: &[FormedCurve], modulation: &Modulation) -> Option<Condensed> {
        let mut equations = fixed.clone();
        let (fixed_columns, mut hats) = (fixed.columns.len(), Vec::new());
        for FormedCurve { curve, .. } in curves {
            let knots = knots_over(curve.x, curve.nearest_knot());
            let first = equations.columns.len();
            let noisy = curve.noisy(|| hat_slopes(modulation, &knots, curve.x), |k| first + k, None);
            equations.noisy.extend(noisy);
            let own = parallel::map(knots.len(), |k| {
                let lines = curve.lines_of(modulation, &[curve.means_of(|x| hat(&knots, k, x))]);
                curve.column(&lines[0], 1.0)
            });
            equations.columns.extend(own);
            hats.push(Hats {
                columns: first - fixed_columns..equations.columns.len() - fixed_columns,
                knots,
            });
        }
        let right: Column = std::mem::take(&mut equations.right).into_iter().map(Some).collect();
        equations.columns.push(right);
        // The noise's share of the sums is judged on the fixed columns alone: a single hat may be mostly noise.
        let mut gram = equations.gram(fixed_columns)?.products;
        // The ridge that `Normal` adds once its diagonal is one.
        (0..fixed_columns).for_each(|i| gram[(i, i)] *= 1.0 + RIDGE);
        Some(Condensed {
            // The matrix is symmetric except for rounding: the rows of the elimination become the columns.
            gram: without_first(gram, fixed_columns).transpose(),
            hats,
        })
    }

    /// The terms and their derivatives for these logarithms.
    fn form_columns(&self, curves: &[FormedCurve], logs: &[f64]) -> FormColumns {
        let layout = FormLayout::new(0, curves.iter().map(|c| &c.terms[..]));
        let mut columns = FormColumns::default();
        for ((formed, hats), own) in curves.iter().zip(&self.hats).zip(layout.curves) {
            // A function as a sum of hats: its values at the knots are the factors.
            let in_hats = |f: &dyn Fn(f64) -> f64| {
                let mut sum = Vector::zeros(self.gram.nrows());
                for (column, knot) in hats.columns.clone().zip(&hats.knots) {
                    sum[column] = f(*knot);
                }
                sum
            };
            for term in formed.shaped(&logs[own.logs]) {
                let derivatives = (0..term.logs.len()).map(|k| LogDerivative {
                    term: columns.terms.len(),
                    hats: in_hats(&|x| term.by_shape(x, k)),
                });
                columns.derivatives.extend(derivatives);
                columns.terms.push(in_hats(&|x| term.value(x)));
            }
        }
        columns
    }

    /// The inner products of sums of hats.
    fn products(&self, columns: &[Vector]) -> Matrix {
        let mut products = Matrix::zeros(columns.len(), columns.len());
        let supports: Vec<Range<usize>> = columns.iter().map(|column| support(column.as_slice())).collect();
        for (j, column) in columns.iter().enumerate() {
            let (own, column) = (&supports[j], column.as_slice());
            // The matrix is symmetric: its columns, which are contiguous in memory, replace its rows.
            let rows = self.gram.column_iter();
            let image: Vec<f64> = rows
                .map(|row| dot(&row.as_slice()[own.clone()], &column[own.clone()]))
                .collect();
            for (i, other) in columns[..=j].iter().enumerate() {
                let theirs = supports[i].clone();
                let product = dot(&other.as_slice()[theirs.clone()], &image[theirs]);
                products[(i, j)] = product;
                products[(j, i)] = product;
            }
        }
        products
    }

    /// The inner products of the columns of a fit; a term whose factor is held is subtracted from the right-hand side.
    fn fit_products(&self, columns: FormColumns, held: Option<HeldFactor>) -> FitProducts {
        let FormColumns { mut terms, derivatives } = columns;
        let of_held = held.map(|held| terms.remove(held.term));
        let (free, right) = (terms.len(), terms.len() + derivatives.len());
        let mut columns = terms;
        columns.extend(derivatives.into_iter().map(|derivative| derivative.hats));
        columns.push(Vector::from_fn(self.gram.nrows(), |i, _| {
            f64::from(i + 1 == self.gram.nrows())
        }));
        columns.extend(of_held);
        let mut g = self.products(&columns);
        if let Some(HeldFactor { value, .. }) = held {
            for i in 0..columns.len() {
                g[(i, right)] -= value * g[(i, right + 1)];
            }
            for i in 0..columns.len() {
                g[(right, i)] -= value * g[(right + 1, i)];
            }
        }
        FitProducts { g, free, right }
    }

    /// The best factors for these logarithms, and the objective as a function of the logarithms alone (variable projection).
    fn projected(&self, curves: &[FormedCurve], logs: &[f64], held: Option<HeldFactor>) -> Option<Projected> {
        if logs.iter().any(|t| !(t.abs() < LARGEST_LOG)) {
            return None;
        }
        let columns = self.form_columns(curves, logs);
        let terms: Vec<usize> = columns.derivatives.iter().map(|derivative| derivative.term).collect();
        let products = self.fit_products(columns, held);
        let nearest = products.nearest()?;
        let mut factors: Vec<f64> = nearest.column(terms.len()).iter().copied().collect();
        let cost = products.cost(&factors);
        if let Some(HeldFactor { term, value }) = held {
            factors.insert(term, value);
        }
        // Kaufman's Jacobian: each derivative with the free terms projected out, times its term's factor.
        let factor = |i: usize| factors[terms[i]];
        let all = || 0..terms.len();
        let pairs = all().flat_map(|i| all().map(move |j| (i, j)));
        Some(Projected {
            equations: NormalEquations {
                cost,
                descent: all()
                    .map(|i| factor(i) * products.beside_terms(&nearest, terms.len(), i))
                    .collect(),
                normal: pairs
                    .map(|(i, j)| factor(i) * factor(j) * products.beside_terms(&nearest, i, j))
                    .collect(),
            },
            factors,
        })
    }

    /// The minimum next to these logarithms; `None` if there is none in double precision.
    pub fn minimum(&self, curves: &[FormedCurve], start: &[f64], held: Option<Held>) -> Option<Minimum> {
        let (mut factor, mut log) = (None, None);
        let mut logs = start.to_vec();
        if let Some(Held { parameter, value }) = held {
            match parameter {
                FormParameter::Factor(term) => factor = Some(HeldFactor { term, value }),
                FormParameter::Log(number) => {
                    logs[number] = value;
                    log = Some(number);
                }
            }
        }
        let any_free = logs.len() > usize::from(log.is_some());
        if any_free {
            let minimum = minimise_squares(logs, ITERATIONS, |logs| {
                let mut equations = self.projected(curves, logs, factor)?.equations;
                log.into_iter().for_each(|number| hold(&mut equations, number));
                Some(equations)
            })?;
            logs = minimum.parameters;
        }
        let end = self.projected(curves, &logs, factor)?;
        Some(Minimum {
            objective: end.equations.cost,
            factors: end.factors,
            logs,
        })
    }
}

impl FitProducts {
    /// For each derivative and, last, the right-hand side: a column with the factors of the free terms whose sum is nearest to it.
    fn nearest(&self) -> Option<Matrix> {
        let free = self.free;
        let part = |first, columns| self.g.view((0, first), (free, columns)).into_owned();
        match free {
            0 => Some(part(free, self.right + 1)),
            _ => Normal::new(&part(0, free))?.solve(&part(free, self.right + 1 - free)),
        }
    }

    /// The square of the difference between the right-hand side and the sum of the terms with these factors. The ridge moves the factors a
    /// little off the minimum, so the formula "square minus the part along the terms" would be wrong.
    fn cost(&self, factors: &[f64]) -> f64 {
        let (g, right) = (&self.g, self.right);
        let along = (0..self.free).map(|i| {
            let with: f64 = (0..self.free).map(|j| g[(i, j)] * factors[j]).sum();
            factors[i] * (with - 2.0 * g[(i, right)])
        });
        along.fold(g[(right, right)], |cost, along| cost + along)
    }

    /// The inner product of columns i and j without their parts along the free terms.
    fn beside_terms(&self, nearest: &Matrix, i: usize, j: usize) -> f64 {
        let j = self.free + j;
        let along: f64 = (0..self.free).map(|t| nearest[(t, i)] * self.g[(t, j)]).sum();
        self.g[(self.free + i, j)] - along
    }
}

/// The range from the first to the last nonzero value: a function of one curve has values only at the knots of that curve.
fn support(values: &[f64]) -> Range<usize> {
    let used = |v: &f64| *v != 0.0;
    let first = values.iter().position(used).unwrap_or(0);
    first..values.iter().rposition(used).map_or(first, |last| last + 1)
}

/// The inner products of the other columns with the first `fixed` columns projected out (a Schur complement).
fn without_first(mut gram: Matrix, fixed: usize) -> Matrix {
    let size = gram.nrows();
    for k in 0..fixed {
        let after = size - k - 1;
        let row = gram.row(k).columns(k + 1, after).transpose();
        // The remaining square of this column after the earlier ones. It is not positive if the column is a sum of them, except for
        // rounding.
        let pivot = gram[(k, k)];
        if pivot > 0.0 {
            let mut others = gram.view_mut((k + 1, k + 1), (after, after));
            others.ger(-1.0, &(&row / pivot), &row, 1.0);
        }
    }
    gram.view((fixed, fixed), (size - fixed, size - fixed)).into_owned()
}

/// Makes the step of one unknown zero; the steps of the others are those of the problem without it.
fn hold(equations: &mut NormalEquations, number: usize) {
    let n = equations.descent.len();
    equations.descent[number] = 0.0;
    for i in 0..n {
        equations.normal[number * n + i] = 0.0;
        equations.normal[i * n + number] = 0.0;
    }
    equations.normal[number * n + number] = 1.0;
}

/// Knots over the range of x, closer to each other near zero; including zero, where a sign jumps, and -width and width, where a softened
/// sign bends.
fn knots_over(x: &[f64], width: f64) -> Vec<f64> {
    let [low, high] = range(x);
    let spacing = Spacing::new([low, high], KNOTS_DENSER);
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

/// The hat function that is 1 at a knot and 0 at all others; the outermost stay 1 beyond the range.
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
fn hat_slopes(modulation: &Modulation, knots: &[f64], x: &[f64]) -> Slopes {
    Slopes::new(modulation, knots.len(), |i| {
        let k = knots.partition_point(|knot| *knot <= x[i]).clamp(1, knots.len() - 1);
        let rise = 1.0 / (knots[k] - knots[k - 1]);
        LocalValues {
            first: k - 1,
            values: [-rise, rise],
        }
    })
}

#[cfg(test)]
#[path = "condensed_tests.rs"]
mod tests;
