//! Equations of motion condensed to inner products, in which physical forms are fitted without the data.
//!
//! A curve between close knots is as good as linear, and so a form's columns are sums of those of hat functions. With the
//! inner products of these hats, of the fixed columns and of the right-hand side, a fit costs microseconds. That affords many
//! starts, and profile likelihoods.

use rayon::prelude::*;

use super::basis::mean_of;
use super::equations::{Column, Equations, RIDGE};
use super::forms::Shaped;
use super::fourier::Modulation;
use super::noisy::Slopes;
use super::shaping::{Shape, Shaping};
use crate::interrupt;
use crate::linalg;
use crate::linear::levenberg_marquardt::{NormalEquations, minimise_squares};

/// Knots on either side of zero.
const KNOTS: usize = 70;
/// How much denser they lie at zero than at the ends.
const DENSER: f64 = 100.0;
/// Iterations of a minimisation.
const ITERATIONS: usize = 60;
/// The largest logarithm of a shape parameter.
pub(super) const LARGEST_LOG: f64 = 40.0;

/// A parameter that is held at a value: a curve's factor, or the logarithm of a shape parameter, counted over all curves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Held {
    Factor(usize, f64),
    Log(usize, f64),
}

/// A minimum over everything that is not held.
#[derive(Debug, Clone)]
pub(super) struct Lowest {
    /// What it is the minimum of; see [`super::equations::Solution`].
    pub objective: f64,
    /// The logarithms of all shape parameters.
    pub logs: Vec<f64>,
    /// The factors of all terms.
    pub factors: Vec<f64>,
}

/// The inner products.
pub(super) struct Condensed {
    /// Of the hats of each curve and the right-hand side, less what the fixed columns take of them, row-major.
    gram: Vec<f64>,
    size: usize,
    /// The knots of each curve, and the number of its first hat.
    knots: Vec<(usize, Vec<f64>)>,
}

/// A column as a sum of neighbouring ones: the first one's number, and their factors.
type Sum = (usize, Vec<f64>);

/// The best factors for given logarithms.
struct Projected {
    normal: NormalEquations,
    factors: Vec<f64>,
}

impl Condensed {
    /// The inner products of these equations, whatever the terms of their curves.
    pub fn new(shaping: &Shaping) -> Condensed {
        let mut columns: Vec<Column> = shaping.fixed.clone();
        let mut knots = Vec::new();
        let mut noisy = shaping.noisy.clone();
        for shape in &shaping.shapes {
            let own = between(shape.x, shape.width);
            let first = columns.len() - shaping.fixed.len();
            if !shape.abscissa.is_exact() {
                let slopes = slopes(shaping.modulation, &own, shape.x);
                noisy.extend(shape.abscissa.noisy(&slopes, |k| columns.len() + k));
            }
            let hats: Vec<Column> = (0..own.len())
                .into_par_iter()
                .map(|k| {
                    let lines = shaping.modulation.of(&mean_of(shape.x, |x| hat(&own, k, x)));
                    let scaled = |sign: f64| lines.iter().map(|v| v * sign).collect();
                    shape.signs.iter().map(|&s| (s != 0.0).then(|| scaled(s))).collect()
                })
                .collect();
            columns.extend(hats);
            knots.push((first, own));
        }
        columns.push(shaping.right.iter().cloned().map(Some).collect());
        let size = columns.len();
        let equations = Equations {
            columns,
            right: Vec::new(),
            noise: shaping.noise.clone(),
            noisy,
        };
        let fixed = shaping.fixed.len();
        let mut gram = equations.gram(fixed).0;
        (0..fixed).for_each(|i| gram[i * size + i] *= 1.0 + RIDGE);
        let gram = beside(gram, size, fixed);
        Condensed {
            gram,
            size: size - fixed,
            knots,
        }
    }

    /// The inner products of sums of columns.
    fn products(&self, sums: &[Sum]) -> Vec<f64> {
        let n = sums.len();
        let mut products = vec![0.0; n * n];
        let mut column = vec![0.0; self.size];
        for (j, (first, factors)) in sums.iter().enumerate() {
            column.fill(0.0);
            for (k, factor) in factors.iter().enumerate() {
                let row = &self.gram[(first + k) * self.size..(first + k + 1) * self.size];
                column.iter_mut().zip(row).for_each(|(c, g)| *c += factor * g);
            }
            for (i, (from, weights)) in sums[..=j].iter().enumerate() {
                let product = weights.iter().zip(&column[*from..]).map(|(w, c)| w * c).sum();
                products[i * n + j] = product;
                products[j * n + i] = product;
            }
        }
        products
    }

    /// The best factors for these logarithms, and the objective as a function of the logarithms alone (variable projection); `held` is a factor's number and value.
    fn projected(&self, shapes: &[Shape], logs: &[f64], held: Option<(usize, f64)>) -> Option<Projected> {
        if logs.iter().any(|t| !(t.abs() < LARGEST_LOG)) {
            return None;
        }
        let mut free: Vec<Sum> = Vec::new();
        let (mut bound, mut slopes): (Option<Sum>, Vec<(usize, Sum)>) = (None, Vec::new());
        let (mut rest, mut at) = (logs, 0);
        for (shape, (first, knots)) in shapes.iter().zip(&self.knots) {
            let (own, after) = rest.split_at(shape.terms.iter().map(|t| t.shapes()).sum());
            rest = after;
            for (term, _, t) in Shaped::split(&shape.terms, own) {
                let over = |f: &dyn Fn(f64) -> f64| (*first, knots.iter().map(|&x| f(x)).collect());
                let values = over(&|x| term.value(x, t, shape.width));
                match held {
                    Some((number, _)) if number == at => bound = Some(values),
                    _ => free.push(values),
                }
                slopes.extend((0..t.len()).map(|k| (at, over(&|x| term.by_shape(x, t, k, shape.width)))));
                at += 1;
            }
        }
        let unknowns = free.len();
        let count = slopes.len();
        let mut sums = free;
        sums.extend(slopes.iter().map(|(_, s)| s.clone()));
        sums.push((self.size - 1, vec![1.0]));
        let last = sums.len() - 1;
        sums.extend(bound);
        let n = sums.len();
        let mut g = self.products(&sums);
        if let Some((_, value)) = held.filter(|_| n == last + 2) {
            // The right-hand side less the held term.
            for i in 0..n {
                g[i * n + last] -= value * g[i * n + n - 1];
            }
            for j in 0..n {
                g[last * n + j] -= value * g[(n - 1) * n + j];
            }
        }
        let scale: Vec<f64> = (0..unknowns)
            .map(|i| g[i * n + i].sqrt())
            .map(|s| if s > 0.0 && s.is_finite() { s } else { 1.0 })
            .collect();
        let mut matrix = vec![0.0; unknowns * unknowns];
        for i in 0..unknowns {
            for j in 0..unknowns {
                matrix[i * unknowns + j] = g[i * n + j] / (scale[i] * scale[j]);
            }
            matrix[i * unknowns + i] += RIDGE;
        }
        let solved = |column: usize| -> Option<Vec<f64>> {
            if unknowns == 0 {
                return Some(Vec::new());
            }
            let moment: Vec<f64> = (0..unknowns).map(|i| g[i * n + column] / scale[i]).collect();
            let x = linalg::solve_positive_definite(&matrix, &moment)?;
            Some(x.iter().zip(&scale).map(|(x, s)| x / s).collect())
        };
        let x = solved(last)?;
        let mut objective = g[last * n + last];
        for i in 0..unknowns {
            let with: f64 = (0..unknowns).map(|j| g[i * n + j] * x[j]).sum();
            objective += x[i] * (with - 2.0 * g[i * n + last]);
        }
        let mut factors = x.clone();
        if let Some((number, value)) = held {
            factors.insert(number, value);
        }
        let parts: Vec<Vec<f64>> = (0..count).map(|k| solved(unknowns + k)).collect::<Option<_>>()?;
        let along = |i: usize, k: usize| -> f64 {
            let parts = &parts[i];
            (0..unknowns).map(|j| parts[j] * g[j * n + unknowns + k]).sum()
        };
        let factor = |k: usize| factors[slopes[k].0];
        let mut normal = vec![0.0; count * count];
        for i in 0..count {
            for j in 0..count {
                let product = g[(unknowns + i) * n + unknowns + j] - along(i, j);
                normal[i * count + j] = factor(i) * factor(j) * product;
            }
        }
        let descent = (0..count)
            .map(|i| {
                let taken: f64 = (0..unknowns).map(|j| x[j] * g[j * n + unknowns + i]).sum();
                factor(i) * (g[(unknowns + i) * n + last] - taken)
            })
            .collect();
        Some(Projected {
            normal: NormalEquations {
                cost: objective,
                descent,
                normal,
            },
            factors,
        })
    }

    /// The minimum next to these logarithms; `None` if there is none in double precision, and where the work is asked to stop.
    pub fn lowest(&self, shapes: &[Shape], start: &[f64], held: Option<Held>) -> Option<Lowest> {
        if interrupt::requested() {
            return None;
        }
        let (factor, log) = match held {
            Some(Held::Factor(number, value)) => (Some((number, value)), None),
            Some(Held::Log(number, value)) => (None, Some((number, value))),
            None => (None, None),
        };
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
        let logs = if free.is_empty() {
            all(&free)
        } else {
            let minimum = minimise_squares(free, ITERATIONS, |free| {
                let equations = self.projected(shapes, &all(free), factor)?.normal;
                Some(match log {
                    None => equations,
                    Some((number, _)) => without(&equations, number),
                })
            })?;
            all(&minimum.parameters)
        };
        let end = self.projected(shapes, &logs, factor)?;
        Some(Lowest {
            objective: end.normal.cost,
            factors: end.factors,
            logs,
        })
    }
}

/// The inner products of what the first `fixed` columns leave of the others (their Schur complement).
fn beside(mut gram: Vec<f64>, size: usize, fixed: usize) -> Vec<f64> {
    for k in 0..fixed {
        let row: Vec<f64> = gram[k * size..(k + 1) * size].to_vec();
        // The diagonal entry has shrunk; a column that is nothing beside the ones before takes nothing.
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
    let (low, high) = x
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
    let unit = low.abs().max(high.abs()) / DENSER;
    let (from, to) = ((low / unit).asinh(), (high / unit).asinh());
    let last = 2 * KNOTS;
    let mut knots: Vec<f64> = (1..last)
        .map(|i| unit * (from + (to - from) * i as f64 / last as f64).sinh())
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
mod tests {
    use super::*;
    use crate::identify::robot_joint::basis::Basis;
    use crate::identify::robot_joint::forms::{FormName, Term};
    use crate::identify::robot_joint::noisy::Abscissa;
    use crate::linalg::Complex;

    /// A curve of velocity beside an inertia, with a known answer: the condensed minimum is that of the equations themselves.
    #[test]
    fn the_minimum_is_that_of_the_equations() {
        let n = 6000;
        let step = 0.01;
        let at = |i: usize| step * i as f64;
        let v: Vec<f64> = (0..n)
            .map(|i| (0.7 * at(i)).sin() + 0.5 * (1.9 * at(i)).cos())
            .collect();
        let a: Vec<f64> = (0..n)
            .map(|i| 0.7 * (0.7 * at(i)).cos() - 0.95 * (1.9 * at(i)).sin())
            .collect();
        let tau: Vec<f64> = v
            .iter()
            .zip(&a)
            .map(|(v, a)| 3.0 * a + 2.0 * (8.0 * v).tanh() + 0.5 * v)
            .collect();
        let modulation = Modulation::new(n, step, 10.0);
        let lines = |x: &[f64]| -> Vec<Complex<f64>> { modulation.of(x) };
        let noise = vec![1e-4; modulation.len()];
        let basis = Basis::friction(&v, 5);
        let beside = (basis.clone(), modulation.of_all(&basis.mean_columns(&v, 1.0)));
        let shaping = Shaping {
            fixed: vec![vec![Some(lines(&a))]],
            right: vec![lines(&tau)],
            noise: vec![&noise],
            noisy: Vec::new(),
            shapes: vec![
                Shape {
                    terms: Vec::new(),
                    x: &v,
                    signs: vec![1.0],
                    width: 0.0,
                    beside: &beside,
                    abscissa: Abscissa::default(),
                }
                .with(FormName::SmoothCoulomb),
            ],
            modulation: &modulation,
        };
        assert_eq!(shaping.shapes[0].terms, vec![Term::Tanh, Term::Linear]);
        let condensed = Condensed::new(&shaping);
        let near = |got: f64, want: f64, share: f64| assert!((got - want).abs() < share * want, "{got}, not {want}");
        for start in [1.0_f64, 40.0] {
            let lowest = condensed.lowest(&shaping.shapes, &[start.ln()], None).unwrap();
            near(lowest.logs[0].exp(), 8.0, 0.01);
            near(lowest.factors[0], 2.0, 0.01);
            near(lowest.factors[1], 0.5, 0.05);
        }
        // A step in the equations themselves ends at the truth but for the sums' own errors at the velocity's sign changes.
        let fit = shaping.fit(&condensed, &[vec![20.0_f64.ln()]]).unwrap();
        near(fit.curves[0].logs[0].exp(), 8.0, 1e-3);
        near(fit.solution.x[0], 3.0, 1e-3);
        for interval in &fit.intervals[1..] {
            assert!(interval[0] < interval[1], "{interval:?}");
        }
        // What is held stays, and everything else makes up for it: no lower than the minimum.
        let free = condensed.lowest(&shaping.shapes, &[2.0], None).unwrap();
        for (held, at) in [
            (Held::Factor(0, 1.5), 1.5),
            (Held::Factor(1, 0.0), 0.0),
            (Held::Log(0, 2.5), 2.5),
        ] {
            let found = condensed.lowest(&shaping.shapes, &[2.0], Some(held)).unwrap();
            let value = match held {
                Held::Factor(i, _) => found.factors[i],
                Held::Log(i, _) => found.logs[i],
            };
            assert_eq!(value, at);
            assert!(found.objective > free.objective);
        }
    }
}
