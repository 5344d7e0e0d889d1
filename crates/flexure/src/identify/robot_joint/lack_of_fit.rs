//! Whether a curve departs from its form: the test for lack of fit.
//!
//! Splines with a fixed division are added to the form and all other unknowns (a score test; Rao 1948). The part that they explain is
//! compared with the part that they would explain by chance; its mean and variance follow from the remaining residuals (Satterthwaite 1946;
//! Rao & Scott 1984). The splines are few, so they do not absorb errors in bursts, such as those of a velocity where friction is steep. A
//! division chosen from the same data would be the one that explains most by chance.

use super::bursts::over_time;
use super::column_noise::Noisy;
use super::equations::{Column, Equations, Lines, Solution};
use super::limits::{OF_THE_FORM, STRETCHES};
use super::normal::{ridged, scaled, scales};
use crate::distributions::fisher_below;
use crate::linalg::{self, Complex, Eigen, Matrix, product};

/// The part that splines explain in addition to a form.
#[derive(Debug, Clone, Copy)]
pub(super) struct Departure {
    /// The F statistic.
    pub statistic: f64,
    /// Its degrees of freedom.
    pub freedom: [f64; 2],
    /// The probability of a larger one by chance.
    pub p_value: f64,
}

/// The splines without their parts along the columns of the form.
struct Beside {
    /// Columns of unit length that are orthogonal to the form's and to each other, as sums of all columns.
    factors: Vec<Vec<f64>>,
    /// Their products with the residuals.
    moments: Vec<f64>,
}

impl Departure {
    /// The test of the form whose linearised `equations` have this solution, with the further columns `beside`; `noisy` is the noise of
    /// these, which are numbered after the form's columns. `None` if the equations do not determine it.
    pub fn new(
        equations: &Equations,
        solution: &Solution,
        beside: Vec<Column>,
        noisy: Vec<Noisy>,
    ) -> Option<Departure> {
        let known = equations.columns.len();
        let all = Equations {
            columns: equations.columns.iter().cloned().chain(beside).collect(),
            right: equations.right.clone(),
            noise: equations.noise.clone(),
            noisy: equations.noisy.iter().copied().chain(noisy).collect(),
            given: equations.given.clone(),
        };
        let beside = Beside::new(&all, known)?;
        let mut explained = 0.0;
        let mut after = solution.clone();
        let mut columns = Vec::new();
        for (factors, moment) in beside.factors.iter().zip(&beside.moments) {
            explained += moment * moment;
            let column = sum(&all.columns, factors);
            for (residuals, lines) in after.residuals.iter_mut().zip(&column) {
                let lines = lines.iter().flatten();
                residuals.iter_mut().zip(lines).for_each(|(r, v)| *r -= v * *moment);
            }
            columns.push(column);
        }
        after.squares = (solution.squares - explained).max(0.0);
        let powers = equations.powers(&after);
        let own = Equations {
            columns,
            right: Vec::new(),
            noise: equations.noise.clone(),
            noisy: Vec::new(),
            given: Vec::new(),
        };
        let observations = 2.0 * solution.lines() as f64;
        let remaining = (observations - all.columns.len() as f64).max(1.0);
        Some(Departure::by_chance(&own, &powers, &after, explained, remaining))
    }

    /// The probability that columns of unit length explain as much by chance. `after` is the solution with them, with `remaining` degrees
    /// of freedom and these mean squares of each line.
    fn by_chance(
        columns: &Equations,
        powers: &[Vec<f64>],
        after: &Solution,
        explained: f64,
        remaining: f64,
    ) -> Departure {
        let unknowns = columns.columns.len() as f64;
        let by_lines = columns.moment_covariance(powers);
        let by_time = over_time(columns, &after.residuals);
        // The square of a covariance from few stretches is too large, by the square of its trace over their number.
        let few = STRETCHES as f64 - 1.0;
        let of_stretches = by_time.norm_squared() - by_time.trace().powi(2) / few;
        // If the weights are right, the covariance of these columns' moments is the unit matrix.
        let least = unknowns * after.squares / remaining;
        let [mean, half] = [
            [least, least * least / unknowns.max(1.0)],
            [by_lines.trace(), by_lines.norm_squared()],
            [by_time.trace(), of_stretches],
        ]
        .into_iter()
        .fold([0.0, 0.0], |best, next| if next[0] > best[0] { next } else { best });
        let freedom = (mean * mean / half.max(f64::MIN_POSITIVE)).clamp(1.0, unknowns.max(1.0));
        let statistic = explained / mean.max(f64::MIN_POSITIVE);
        Departure {
            statistic,
            freedom: [freedom, remaining],
            p_value: 1.0 - fisher_below(statistic, [freedom, remaining]),
        }
    }
}

impl Beside {
    /// The splines of equations whose first `known` columns are the form's.
    fn new(all: &Equations, known: usize) -> Option<Beside> {
        let (n, m) = (known, all.columns.len() - known);
        let gram = all.gram(n)?.products;
        let scale = scales(&gram);
        let gram = scaled(&gram, &scale);
        let moments = all.moments();
        // The splines' parts along the form's columns: for spline j, the sum of these columns with the factors in column j of `share`.
        let [form, cross, own] = [((0, 0), (n, n)), ((0, n), (n, m)), ((n, n), (m, m))]
            .map(|(start, shape)| gram.view(start, shape).into_owned());
        let share = product(&ridged(form).cholesky()?.inverse().transpose(), &cross);
        let remainder = own - product(&cross.transpose(), &share);
        let moment = (0..m).map(|j| {
            let taken: f64 = (0..n).map(|k| share[(k, j)] * moments[k] / scale[k]).sum();
            moments[n + j] / scale[n + j] - taken
        });
        let moment: Vec<f64> = moment.collect();
        let mut beside = Beside {
            factors: Vec::new(),
            moments: Vec::new(),
        };
        let Eigen { values, vectors } = linalg::symmetric_eigen(remainder.transpose().as_slice(), m)?;
        let vectors = Matrix::from_vec(m, m, vectors);
        for (value, vector) in values.iter().zip(vectors.column_iter()) {
            if !(*value > OF_THE_FORM) {
                continue;
            }
            let root = value.sqrt();
            let of_form = -(&share * vector);
            let factors = of_form.iter().chain(vector.iter()).zip(&scale);
            beside.factors.push(factors.map(|(f, s)| f / (root * s)).collect());
            let own: f64 = vector.iter().zip(&moment).map(|(v, g)| v * g).sum();
            beside.moments.push(own / root);
        }
        Some(beside)
    }
}

/// The sum of columns with these factors.
fn sum(columns: &[Column], factors: &[f64]) -> Column {
    let blocks = columns.first().map_or(0, Vec::len);
    (0..blocks)
        .map(|block| {
            let mut total: Option<Lines> = None;
            for (column, factor) in columns.iter().zip(factors) {
                let Some(lines) = &column[block] else { continue };
                let total = total.get_or_insert_with(|| vec![Complex::new(0.0, 0.0); lines.len()]);
                total.iter_mut().zip(lines).for_each(|(t, v)| *t += v * *factor);
            }
            total
        })
        .collect()
}
