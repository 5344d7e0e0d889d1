//! A physical form fitted to the nonlinearity, with a test whether it suffices.
//!
//! A form is fitted to the memory-removed output, cell by cell of the input, by weighted least squares. It is linear in some
//! parameters, which are solved for. The others are searched from a grid on, then all are refined together. Lack of fit is
//! tested by the residuals' sums over groups of neighbouring samples, whose squares over their variances add up to a
//! chi-squared variable when the form is true.
//!
//! Where no form is asked for, the usual ones are tried. Of those that suffice, Schwarz's criterion chooses one.

use super::forms::PhysicalForm;
use super::limits::{
    DEPENDENT_NOISE, DIFFERENCE_STEP, FINER_STEP, FINER_STEPS, FORM_GROUPS, FORM_LEVEL, FORM_STARTS, FORM_STEPS,
    MOST_DEGREE, PLACE_INSIDE, SMALLEST_PARAMETER,
};
use crate::distributions::{chi_squared_above, chi_squared_quantile};
use crate::error::{Error, Result};
use crate::linear::least_squares::{UnitDiagonal, least_squares, normal_equations};
use crate::linear::levenberg_marquardt::{Linearisation, minimise};
use crate::sort;

/// The memory-removed output: noisy values of the nonlinearity itself, as means over cells of the input.
#[derive(Default)]
pub(super) struct MemoryRemoved {
    /// The mean input of every cell, increasing.
    pub x: Vec<f64>,
    /// The mean value there, in the scale of the nonlinearity.
    pub value: Vec<f64>,
    /// The number of samples in every cell.
    pub samples: Vec<f64>,
    /// The standard deviation of a single sample's value.
    pub deviation: f64,
}

/// A parameter of a form.
pub(super) struct PhysicalFormParameter {
    /// Its name as in [`PhysicalForm`]'s formulas.
    pub name: String,
    /// Its value in the units of the calibrated nonlinearity and the input.
    pub value: f64,
    /// Its standard error, for a given linear part; infinite where the data do not determine it.
    pub error: f64,
}

/// A fitted form.
pub(super) struct PhysicalFormFit {
    /// The form.
    pub form: PhysicalForm,
    /// Its parameters, the offset last.
    pub parameters: Vec<PhysicalFormParameter>,
    /// The test's statistic, chi-squared if the form is true.
    pub statistic: f64,
    /// Its degrees of freedom.
    pub degrees: usize,
    /// The statistic above which the form is rejected at 1 %.
    pub limit: f64,
    /// The probability of a statistic at least as large if the form is true.
    pub p_value: f64,
    /// Schwarz's criterion.
    criterion: f64,
    /// The criterion's price of a parameter.
    price: f64,
    /// Whether a form with a single break has the usual name for it.
    natural: bool,
}

impl PhysicalFormFit {
    /// Whether the data do not refute the form.
    pub fn holds(&self) -> bool {
        self.statistic <= self.limit
    }

    /// The places where the form breaks, those that the data determine.
    pub fn places(&self) -> Vec<f64> {
        let searched = if self.form.has_places() {
            self.form.searched()
        } else {
            0
        };
        let seen = self.parameters[..searched].iter().filter(|p| p.error.is_finite());
        seen.map(|p| p.value).collect()
    }
}

/// The forms that are tried where none is asked for.
const USUAL_FORMS: [PhysicalForm; 9] = [
    PhysicalForm::Polynomial(1),
    PhysicalForm::Polynomial(2),
    PhysicalForm::Polynomial(3),
    PhysicalForm::DeadZone,
    PhysicalForm::Saturation,
    PhysicalForm::LimitedDeadZone,
    PhysicalForm::Quantizer,
    PhysicalForm::Stiffness,
    PhysicalForm::Friction,
];

/// A form and the values that it is fitted to.
struct Problem<'a> {
    form: PhysicalForm,
    points: &'a MemoryRemoved,
    /// The inverse of the standard deviation of every cell's value.
    weights: Vec<f64>,
}

/// Parameters and what they leave.
#[derive(Clone)]
struct FittedParameters {
    parameters: Vec<f64>,
    squares: f64,
}

impl FittedParameters {
    /// The parameters that leave the least.
    fn least(all: impl Iterator<Item = FittedParameters>) -> Option<Vec<f64>> {
        let best = all.min_by(|a, b| a.squares.total_cmp(&b.squares));
        best.map(|best| best.parameters)
    }
}

impl Problem<'_> {
    /// The cells' weights: none where the form may jump inside a cell, whose mean is then neither value's.
    fn counted(&self, searched: &[f64]) -> Vec<f64> {
        if self.form != PhysicalForm::Quantizer {
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

    /// All parameters for given searched ones, and their sum of squares in proportion to the cells that count; `None` where fewer
    /// than half of the cells do.
    fn solved(&self, searched: &[f64]) -> Option<FittedParameters> {
        let weights = self.counted(searched);
        let counted = weights.iter().filter(|w| **w > 0.0).count();
        if 2 * counted < weights.len() {
            return None;
        }
        let mut columns = vec![Vec::with_capacity(weights.len()); self.form.names().len() - self.form.searched()];
        for (x, w) in self.points.x.iter().zip(&weights) {
            let functions = self.form.functions(searched, *x);
            columns.iter_mut().zip(functions).for_each(|(c, f)| c.push(w * f));
        }
        let values: Vec<f64> = weights.iter().zip(&self.points.value).map(|(w, z)| w * z).collect();
        let linear = least_squares(&values, &columns, 0)?.coefficients;
        let p = [searched, &linear].concat();
        let squares: f64 = self.residuals(&p).iter().map(|r| r * r).sum();
        let share = counted as f64 / weights.len() as f64;
        squares.is_finite().then_some(FittedParameters {
            parameters: p,
            squares: squares / share,
        })
    }

    /// The residuals and their derivatives, by central differences.
    fn linearised(&self, p: &[f64]) -> Option<Linearisation> {
        let derivative = |i: usize| {
            let step = DIFFERENCE_STEP * p[i].abs().max(SMALLEST_PARAMETER);
            let shifted = |h: f64| {
                let mut q = p.to_vec();
                q[i] += h;
                self.residuals(&q)
            };
            let (up, down) = (shifted(step), shifted(-step));
            up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * step)).collect()
        };
        let residuals = self.residuals(p);
        let finite = residuals.iter().all(|r| r.is_finite());
        finite.then(|| Linearisation {
            residuals,
            jacobian: (0..p.len()).map(derivative).collect(),
        })
    }

    /// The best parameters.
    fn minimum(&self) -> Option<Vec<f64>> {
        let grid = self.form.grid(&self.points.x);
        let mut starts: Vec<FittedParameters> = grid.iter().filter_map(|s| self.solved(s)).collect();
        sort::by_key(&mut starts, |s| s.squares);
        if self.form == PhysicalForm::Quantizer {
            // The sum of squares is piecewise constant in the step: a finer grid in place of derivatives.
            let step = starts.first()?.parameters[0];
            let finer = FINER_STEPS.filter_map(|i| self.solved(&[step * (1.0 + FINER_STEP * f64::from(i))]));
            return FittedParameters::least(finer.chain(starts.iter().cloned()));
        }
        let refined = starts.iter().take(FORM_STARTS).filter_map(|start| {
            let minimum = minimise(start.parameters.clone(), FORM_STEPS, |p| self.linearised(p))?;
            Some(FittedParameters {
                parameters: minimum.parameters,
                squares: minimum.equations.cost,
            })
        });
        FittedParameters::least(refined.chain(starts.iter().take(1).cloned()))
    }

    /// Standard errors; infinite where a parameter is not determined. A quantizer's step has none.
    fn errors(&self, p: &[f64]) -> Vec<f64> {
        let without = usize::from(self.form == PhysicalForm::Quantizer);
        let Some(at) = self.linearised(p) else {
            let mut errors = vec![f64::INFINITY; p.len()];
            errors[..without].fill(0.0);
            return errors;
        };
        let acts = |i: &usize| self.is_seen(p, *i) && at.jacobian[*i].iter().any(|v| *v != 0.0);
        let of = |free: &[usize]| {
            let mut errors = vec![f64::INFINITY; p.len()];
            errors[..without].fill(0.0);
            let columns: Vec<Vec<f64>> = free.iter().map(|i| at.jacobian[*i].clone()).collect();
            let system = UnitDiagonal::new(&normal_equations(&at.residuals, &columns, 0));
            if let Some(inverse) = system.scaled_inverse(0.0) {
                for (k, i) in free.iter().enumerate() {
                    errors[*i] = inverse[k * free.len() + k].max(0.0).sqrt() / system.scale[k];
                }
            }
            errors
        };
        let free: Vec<usize> = (without..p.len()).filter(acts).collect();
        let errors = of(&free);
        // A place that may as well be at the end of the data is none that they show.
        let is_inside = |i: &usize| {
            let (first, last) = (self.points.x[0], self.points.x[self.points.x.len() - 1]);
            let is_place = self.form.has_places() && *i < self.form.searched();
            !is_place || (p[*i] - first).min(last - p[*i]) > PLACE_INSIDE * errors[*i]
        };
        let inside: Vec<usize> = free.iter().copied().filter(is_inside).collect();
        if inside.len() == free.len() {
            errors
        } else {
            of(&inside)
        }
    }

    /// Whether two values of the input lie beyond a place where the form breaks; a single one does not show it.
    fn is_seen(&self, p: &[f64], i: usize) -> bool {
        let x = &self.points.x;
        !self.form.has_places() || i >= self.form.searched() || (p[i] > x[1] && p[i] < x[x.len() - 2])
    }

    /// Whether a form that breaks at a low and a high place has the input 0 between them, or both are seen: a curve with a single break is a
    /// limit where it is flat away from 0, and a dead zone where it is flat around 0.
    fn is_natural(&self, p: &[f64]) -> bool {
        if !self.form.has_places() {
            return true;
        }
        let last = self.form.searched() - 1;
        let all = (0..=last).all(|i| self.is_seen(p, i));
        all || ((!self.is_seen(p, 0) || p[0] <= 0.0) && (!self.is_seen(p, last) || p[last] >= 0.0))
    }
}

impl MemoryRemoved {
    /// With a larger deviation if the input is coloured or held. The noise of values at neighbouring inputs is then correlated, and the test's
    /// sums are larger than for independent noise. How much larger is seen in the distances from the estimated `curve`, which has this many
    /// parameters.
    pub fn allowing_for(mut self, dependence: f64, curve: impl Fn(f64) -> f64, parameters: usize) -> Self {
        if dependence > DEPENDENT_NOISE && self.deviation > 0.0 {
            let weights: Vec<f64> = self.samples.iter().map(|n| n.sqrt() / self.deviation).collect();
            let points = self.x.iter().zip(&self.value).zip(&weights);
            let weighted: Vec<f64> = points.map(|((x, z), w)| w * (curve(*x) - z)).collect();
            let GroupedSquares { statistic, groups } = GroupedSquares::new(&weighted, &weights);
            let free = groups.saturating_sub(parameters).max(1) as f64;
            self.deviation *= (statistic / free).max(1.0).sqrt();
        }
        self
    }

    /// Fits a physical form and tests it.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a degree above 15; [`Error::Data`]: `TooShort` where the input has too few distinct
    /// values for the form and a test, or there are none.
    pub fn fit_form(&self, form: PhysicalForm) -> Result<PhysicalFormFit> {
        if let PhysicalForm::Polynomial(degree) = form
            && degree > MOST_DEGREE
        {
            return Err(Error::parameter("the degree", degree as f64, "at most 15"));
        }
        let names = form.names();
        let too_short = |got| {
            Error::too_short(
                "a form of the nonlinearity with a test (distinct inputs of a refined estimate)",
                names.len() + 2,
                got,
            )
        };
        if self.x.len() < names.len() + 2 || !(self.deviation > 0.0) {
            return Err(too_short(self.x.len()));
        }
        let weights = self.samples.iter().map(|n| n.sqrt() / self.deviation).collect();
        let problem = Problem {
            form,
            points: self,
            weights,
        };
        let p = problem.minimum().ok_or_else(|| too_short(0))?;
        let weights = problem.counted(&p[..form.searched()]);
        let residuals = problem.residuals(&p);
        let GroupedSquares { statistic, groups } = GroupedSquares::new(&residuals, &weights);
        let degrees = groups.saturating_sub(p.len()).max(1);
        // At least one degree of freedom: the distribution exists.
        let limit = chi_squared_quantile(1.0 - FORM_LEVEL, degrees as f64);
        let p_value = chi_squared_above(statistic, degrees as f64);
        let counted = weights.iter().filter(|w| **w > 0.0).count() as f64;
        let squares = residuals.iter().map(|r| r * r).sum::<f64>() * weights.len() as f64 / counted;
        let price = self.samples.iter().sum::<f64>().ln();
        let named = names.into_iter().zip(p.iter().zip(problem.errors(&p)));
        let parameter = |(name, (&value, error))| PhysicalFormParameter { name, value, error };
        Ok(PhysicalFormFit {
            form,
            parameters: named.map(parameter).collect(),
            statistic,
            degrees,
            limit,
            p_value,
            criterion: squares + p.len() as f64 * price,
            price,
            natural: problem.is_natural(&p),
        })
    }

    /// Of the usual forms that the data do not refute, the one that Schwarz's criterion prefers; among forms that differ by less than a
    /// parameter's price, one with the usual name. The steps of a quantizer may be so many that they suit any curve: it counts only where the
    /// estimate has a jump.
    pub fn sufficient_form(&self, has_jump: bool) -> Option<PhysicalFormFit> {
        let forms = USUAL_FORMS
            .iter()
            .filter(|form| has_jump || **form != PhysicalForm::Quantizer);
        let fits = forms.filter_map(|form| self.fit_form(*form).ok());
        let rank = |fit: &PhysicalFormFit| fit.criterion + if fit.natural { 0.0 } else { fit.price };
        fits.filter(PhysicalFormFit::holds)
            .min_by(|a, b| rank(a).total_cmp(&rank(b)))
    }
}

/// The sum over groups of neighbours of the squared sum of residuals over its variance.
#[derive(Default)]
struct GroupedSquares {
    statistic: f64,
    /// The number of groups that count.
    groups: usize,
}

impl GroupedSquares {
    fn new(weighted: &[f64], weights: &[f64]) -> GroupedSquares {
        let groups = FORM_GROUPS.min(weighted.len());
        let mut lack = GroupedSquares::default();
        for g in 0..groups {
            let part = g * weighted.len() / groups..(g + 1) * weighted.len() / groups;
            // r_i w_i has variance 1; the sum over samples of the residuals is sum_i w_i (w_i r_i) in units of the noise.
            let sum: f64 = part.clone().map(|i| weighted[i] * weights[i]).sum();
            let variance: f64 = part.map(|i| weights[i] * weights[i]).sum();
            if variance > 0.0 {
                lack.statistic += sum * sum / variance;
                lack.groups += 1;
            }
        }
        lack
    }
}
