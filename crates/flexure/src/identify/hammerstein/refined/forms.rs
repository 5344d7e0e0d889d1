//! Physical forms of the nonlinearity, fitted on request, with a test whether they suffice.
//!
//! A form is fitted to the memory-removed output, cell by cell of the input, by weighted least squares: linear in some
//! parameters, which are solved for, and searched from a grid on, then refined together, in the others. Lack of fit is
//! tested by the residuals' sums over groups of neighbouring samples, whose squares over their variances add up to a
//! chi-squared variable when the form is true.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::limits::{FORM_GROUPS, FORM_LEVEL, FORM_STARTS, FORM_STEPS, MOST_DEGREE};
use super::outcome::{MemoryRemoved, RefinedIdentification};
use crate::error::{Error, Result};
use crate::linalg;
use crate::linear::levenberg_marquardt::{Linearisation, minimise};

/// A physical form of a nonlinearity; every one has an offset besides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// slope (x - high) above high, slope (x - low) below low, 0 between.
    DeadZone,
    /// slope x, held at its values at low and at high beyond them.
    Saturation,
    /// height times the nearest whole number to x / step.
    Quantizer,
    /// The polynomial of this degree, at most 15.
    Polynomial(usize),
    /// A joint's friction, equation (12): g1 (tanh g2 x - tanh g3 x) + g4 tanh g5 x + g6 x.
    Friction,
    /// A joint's stiffness, (10) and (11): a1 x^3 + a2 x - ksw x exp(-asw x^2).
    Stiffness,
}

/// A parameter of a form.
#[derive(Debug, Clone, PartialEq)]
pub struct FormParameter {
    /// Its name as in [`Form`]'s formulas.
    pub name: String,
    /// Its value in the units of the calibrated nonlinearity and the input.
    pub value: f64,
    /// Its standard error, for a given linear part; infinite where the data do not determine it.
    pub error: f64,
}

/// A fitted form.
#[derive(Debug, Clone, PartialEq)]
pub struct FormFit {
    /// The form.
    pub form: Form,
    /// Its parameters, the offset last.
    pub parameters: Vec<FormParameter>,
    /// The test's statistic, chi-squared if the form is true.
    pub statistic: f64,
    /// Its degrees of freedom.
    pub degrees: usize,
    /// The statistic above which the form is rejected at 1 %.
    pub limit: f64,
    /// The probability of a statistic at least as large if the form is true.
    pub p_value: f64,
}

impl FormFit {
    /// Whether the data do not refute the form.
    pub fn holds(&self) -> bool {
        self.statistic <= self.limit
    }

    /// The form's value at x.
    pub fn value(&self, x: f64) -> f64 {
        let p: Vec<f64> = self.parameters.iter().map(|p| p.value).collect();
        self.form.value(&p, x)
    }
}

impl Form {
    /// The names, those searched for first.
    fn names(self) -> Vec<String> {
        let fixed: &[&str] = match self {
            Form::DeadZone | Form::Saturation => &["low", "high", "slope", "offset"],
            Form::Quantizer => &["step", "height", "offset"],
            Form::Friction => &["g2", "g3", "g5", "g1", "g4", "g6", "offset"],
            Form::Stiffness => &["asw", "a1", "a2", "ksw", "offset"],
            Form::Polynomial(degree) => {
                let powers = (1..=degree).map(|k| format!("x^{k}"));
                return powers.chain(["offset".to_owned()]).collect();
            }
        };
        fixed.iter().map(|n| (*n).to_owned()).collect()
    }

    /// The number of parameters that are searched for.
    fn searched(self) -> usize {
        match self {
            Form::DeadZone | Form::Saturation => 2,
            Form::Quantizer | Form::Stiffness => 1,
            Form::Friction => 3,
            Form::Polynomial(_) => 0,
        }
    }

    /// The functions that the rest are the coefficients of, at x.
    fn functions(self, searched: &[f64], x: f64) -> Vec<f64> {
        match (self, searched) {
            (Form::DeadZone, &[low, high]) => vec![(x - high).max(0.0) + (x - low).min(0.0), 1.0],
            (Form::Saturation, &[low, high]) => vec![x.max(low).min(high), 1.0],
            (Form::Quantizer, &[step]) => vec![(x / step).round(), 1.0],
            (Form::Friction, &[g2, g3, g5]) => {
                vec![(g2 * x).tanh() - (g3 * x).tanh(), (g5 * x).tanh(), x, 1.0]
            }
            (Form::Stiffness, &[sharpness]) => vec![x * x * x, x, -x * (-sharpness * x * x).exp(), 1.0],
            (Form::Polynomial(degree), _) => {
                let powers = (1..=degree as i32).map(|k| x.powi(k));
                powers.chain([1.0]).collect()
            }
            _ => Vec::new(),
        }
    }

    fn value(self, p: &[f64], x: f64) -> f64 {
        let (searched, coefficients) = p.split_at(self.searched());
        let functions = self.functions(searched, x);
        functions.iter().zip(coefficients).map(|(f, c)| f * c).sum()
    }

    /// Where to look for what is searched.
    fn grid(self, x: &[f64]) -> Vec<Vec<f64>> {
        let (low, high) = (x[0], x[x.len() - 1]);
        let size = low.abs().max(high.abs());
        let rates = |counts: &[f64]| -> Vec<f64> { counts.iter().map(|c| c / size).collect() };
        match self {
            Form::DeadZone | Form::Saturation => {
                let at = |i: usize| x[(2 * i + 1) * (x.len() - 1) / 24];
                let pairs = (0..12).flat_map(|i| (i + 1..12).map(move |j| (i, j)));
                pairs.map(|(i, j)| vec![at(i), at(j)]).collect()
            }
            Form::Quantizer => (0..600).map(|i| vec![(high - low) * 0.99_f64.powi(i)]).collect(),
            Form::Friction => {
                let mut grid = Vec::new();
                for g3 in rates(&[1.0, 3.0, 10.0, 30.0]) {
                    for ratio in [1.5, 3.0, 10.0] {
                        for g5 in rates(&[1.0, 3.0, 10.0, 20.0, 40.0, 100.0]) {
                            grid.push(vec![ratio * g3, g3, g5]);
                        }
                    }
                }
                grid
            }
            Form::Stiffness => (0..12).map(|i| vec![2.0_f64.powi(i) / (size * size)]).collect(),
            Form::Polynomial(_) => vec![Vec::new()],
        }
    }
}

/// The weighted problem: every cell's weight is the inverse of its value's standard deviation.
struct Problem<'a> {
    form: Form,
    points: &'a MemoryRemoved,
    weights: Vec<f64>,
}

impl Problem<'_> {
    /// The cells' weights: none where the form may jump inside a cell, whose mean is then neither value's.
    fn counted(&self, searched: &[f64]) -> Vec<f64> {
        if self.form != Form::Quantizer {
            return self.weights.clone();
        }
        let x = &self.points.x;
        let level = |i: usize| (x[i] / searched[0]).round();
        (0..x.len())
            .map(|i| {
                let same = level(i.saturating_sub(1)) == level((i + 1).min(x.len() - 1));
                if same { self.weights[i] } else { 0.0 }
            })
            .collect()
    }

    fn residuals(&self, p: &[f64]) -> Vec<f64> {
        let weights = self.counted(&p[..self.form.searched()]);
        let values = self.points.x.iter().zip(&self.points.value).zip(&weights);
        values.map(|((x, z), w)| w * (self.form.value(p, *x) - z)).collect()
    }

    /// All parameters for what is searched, and their sum of squares in proportion to the cells that count.
    fn solved(&self, searched: &[f64]) -> Option<(Vec<f64>, f64)> {
        let weights = self.counted(searched);
        let counted = weights.iter().filter(|w| **w > 0.0).count();
        if 2 * counted < weights.len() {
            return None;
        }
        let n = self.form.names().len() - self.form.searched();
        let rows: Vec<Vec<f64>> = (self.points.x.iter().zip(&weights))
            .map(|(x, w)| self.form.functions(searched, *x).iter().map(|f| w * f).collect())
            .collect();
        let mut scale = vec![0.0; n];
        for row in &rows {
            scale.iter_mut().zip(row).for_each(|(s, f)| *s += f * f);
        }
        scale
            .iter_mut()
            .for_each(|s| *s = if *s > 0.0 { s.sqrt() } else { 1.0 });
        let mut normal = vec![0.0; n * n];
        let mut rhs = vec![0.0; n];
        for ((row, z), w) in rows.iter().zip(&self.points.value).zip(&weights) {
            for i in 0..n {
                rhs[i] += row[i] / scale[i] * w * z;
                for j in 0..n {
                    normal[i * n + j] += row[i] * row[j] / (scale[i] * scale[j]);
                }
            }
        }
        (0..n).for_each(|i| normal[i * n + i] += 1e-12);
        let c = linalg::solve_positive_definite(&normal, &rhs)?;
        let linear = c.iter().zip(&scale).map(|(c, s)| c / s);
        let p: Vec<f64> = searched.iter().copied().chain(linear).collect();
        let squares: f64 = self.residuals(&p).iter().map(|r| r * r).sum();
        let share = counted as f64 / weights.len() as f64;
        squares.is_finite().then_some((p, squares / share))
    }

    fn linearised(&self, p: &[f64]) -> Option<Linearisation> {
        let jacobian = (0..p.len())
            .map(|i| {
                let step = 1e-6 * p[i].abs().max(1e-12);
                let shifted = |h: f64| {
                    let mut q = p.to_vec();
                    q[i] += h;
                    self.residuals(&q)
                };
                let (up, down) = (shifted(step), shifted(-step));
                up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * step)).collect()
            })
            .collect();
        let residuals = self.residuals(p);
        residuals
            .iter()
            .all(|r| r.is_finite())
            .then_some(Linearisation { residuals, jacobian })
    }

    /// The best parameters.
    fn minimum(&self) -> Option<Vec<f64>> {
        let grid = self.form.grid(&self.points.x);
        let mut starts: Vec<(Vec<f64>, f64)> = grid.iter().filter_map(|s| self.solved(s)).collect();
        starts.sort_by(|a, b| a.1.total_cmp(&b.1));
        if self.form == Form::Quantizer {
            // Piecewise constant in the step: a finer grid in place of derivatives.
            let step = starts.first()?.0[0];
            let finer = (-400..=400).filter_map(|i| self.solved(&[step * (1.0 + 3e-5 * f64::from(i))]));
            return finer
                .chain(starts.iter().cloned())
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .map(|b| b.0);
        }
        let refined = starts
            .iter()
            .take(FORM_STARTS)
            .filter_map(|s| minimise(s.0.clone(), FORM_STEPS, |p| self.linearised(p)));
        let all = refined.chain(starts.iter().take(1).cloned());
        all.min_by(|a, b| a.1.total_cmp(&b.1)).map(|best| best.0)
    }

    /// Standard errors; infinite where a parameter is not determined. A quantizer's step has none.
    fn errors(&self, p: &[f64]) -> Vec<f64> {
        let skip = usize::from(self.form == Form::Quantizer);
        let n = p.len();
        let Some(l) = self.linearised(p) else {
            return vec![f64::INFINITY; n];
        };
        let columns = &l.jacobian[skip..];
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let scale: Vec<f64> = columns
            .iter()
            .map(|c| dot(c, c).sqrt().max(f64::MIN_POSITIVE))
            .collect();
        let m = columns.len();
        let normal: Vec<f64> = (0..m * m)
            .map(|k| dot(&columns[k / m], &columns[k % m]) / (scale[k / m] * scale[k % m]))
            .collect();
        let inverse = linalg::inverse_positive_definite(&normal, m);
        let mut errors = vec![0.0; skip];
        errors.extend((0..m).map(|i| match &inverse {
            Some(v) => v[i * m + i].max(0.0).sqrt() / scale[i],
            None => f64::INFINITY,
        }));
        errors
    }
}

impl RefinedIdentification {
    /// Fits a physical form to the nonlinearity, in the calibration's scale, and tests it.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a degree above 15; [`Error::Data`]: `TooShort` where the input has too few distinct
    /// values for the form and a test, or the estimate is not refined.
    pub fn fit_form(&self, form: Form) -> Result<FormFit> {
        if let Form::Polynomial(degree) = form
            && degree > MOST_DEGREE
        {
            return Err(Error::parameter("the degree", degree as f64, "at most 15"));
        }
        let names = form.names();
        let points = &self.memory_removed;
        let too_short = |got| {
            Error::too_short(
                "a form of the nonlinearity with a test (distinct inputs of a refined estimate)",
                names.len() + 2,
                got,
            )
        };
        if points.x.len() < names.len() + 2 || !(points.deviation > 0.0) {
            return Err(too_short(points.x.len()));
        }
        let weights = points.samples.iter().map(|n| n.sqrt() / points.deviation).collect();
        let problem = Problem { form, points, weights };
        let p = problem.minimum().ok_or_else(|| too_short(0))?;
        let weights = problem.counted(&p[..form.searched()]);
        let (statistic, groups) = lack_of_fit(&problem.residuals(&p), &weights);
        let degrees = groups.saturating_sub(p.len()).max(1);
        // At least one degree of freedom: the distribution exists.
        let (limit, p_value) = match ChiSquared::new(degrees as f64) {
            Ok(chi) => (chi.inverse_cdf(1.0 - FORM_LEVEL), chi.sf(statistic)),
            Err(_) => (f64::NAN, f64::NAN),
        };
        let errors = problem.errors(&p);
        let parameters = names.into_iter().zip(p.iter().zip(errors));
        Ok(FormFit {
            form,
            parameters: parameters
                .map(|(name, (value, error))| FormParameter {
                    name,
                    value: *value,
                    error,
                })
                .collect(),
            statistic,
            degrees,
            limit,
            p_value,
        })
    }
}

/// The sum over groups of neighbours of the squared sum of residuals over its variance, and the number of groups.
fn lack_of_fit(weighted: &[f64], weights: &[f64]) -> (f64, usize) {
    let groups = FORM_GROUPS.min(weighted.len());
    let (mut statistic, mut counted) = (0.0, 0);
    for g in 0..groups {
        let part = g * weighted.len() / groups..(g + 1) * weighted.len() / groups;
        // r_i w_i has variance 1; the sum over samples of the residuals is sum_i w_i (w_i r_i) in units of the noise.
        let sum: f64 = part.clone().map(|i| weighted[i] * weights[i]).sum();
        let variance: f64 = part.map(|i| weights[i] * weights[i]).sum();
        if variance > 0.0 {
            statistic += sum * sum / variance;
            counted += 1;
        }
    }
    (statistic, counted)
}
