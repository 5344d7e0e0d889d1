//! Physical forms of curves, fitted to equations of motion by weighted nonlinear least squares.
//!
//! A form is $\sum_i c_i\, g_i(\xi; \theta)$ with factors c and shape parameters theta. The factors are linear, so only the
//! logarithms of the shape parameters are searched for (variable projection, Golub & Pereyra 1973, with Kaufman's Jacobian), in
//! the [`Condensed`] equations. The best minimum is finished in the equations themselves.

use super::column_noise::Slopes;
use super::condensed::{Condensed, FormedCurve, Held, Minimum};
use super::covariance::Robust;
use super::equations::{Column, Equations, Solution};
use super::forms::{ParametricCurve, ShapedTerm, Term, is_possible_friction};
use super::fourier::Modulation;
use super::lack_of_fit::Departure;
use super::layout::{FormLayout, FormParameter, Numbers};
use super::limits::{AS_WELL, LONGEST_LOG_STEP, STRIBECK_SHARES, TERM_SLOPE_STEP};
use super::normal::Covariance;
use super::profile;
use super::system::Splines;
use crate::parallel;

/// Equations of motion in which some curves have physical forms.
pub(super) struct FormEquations<'a> {
    /// The equations with the columns of the other unknowns alone: factors, and the splines of curves that stay free.
    pub fixed: Equations<'a>,
    pub curves: Vec<FormedCurve<'a>>,
    pub modulation: &'a Modulation,
}

/// A fit of physical forms.
pub(super) struct FormFit {
    /// The unknowns, as [`FormLayout`] has them.
    pub solution: Solution,
    pub layout: FormLayout,
    /// The unknowns' covariance, whatever the noise's spectrum.
    pub covariance: Covariance,
    /// What the unknowns take of the sum of squares by chance; see [`Robust`].
    pub taken: f64,
    /// The test against splines beside the forms.
    pub departure: Departure,
    /// The intervals of 95 % of the parameters by the likelihood's profile, in the unknowns' order; infinite on a side on which no
    /// value fits worse. NaN for the fixed columns.
    pub intervals: Vec<[f64; 2]>,
    pub curves: Vec<ParametricCurve>,
}

/// A function of a curve's abscissa, and the factor with which it enters.
struct Function<'a> {
    value: Box<dyn Fn(f64) -> f64 + 'a>,
    factor: f64,
}

/// The terms of a curve for given logarithms.
fn terms<'a>(formed: &'a FormedCurve, logs: &'a [f64]) -> Vec<Function<'a>> {
    let function = |term: ShapedTerm<'a>| Function {
        value: Box::new(move |x| term.value(x)),
        factor: 1.0,
    };
    formed.shaped(logs).map(function).collect()
}

/// The derivatives of the terms by each of the logarithms, for these factors of the terms.
fn derivatives<'a>(formed: &'a FormedCurve, logs: &'a [f64], factors: &[f64]) -> Vec<Function<'a>> {
    let of_term = |(term, &factor): (ShapedTerm<'a>, &f64)| {
        (0..term.logs.len()).map(move |k| Function {
            value: Box::new(move |x| term.by_shape(x, k)),
            factor,
        })
    };
    formed.shaped(logs).zip(factors).flat_map(of_term).collect()
}

impl<'a> FormEquations<'a> {
    pub fn layout(&self) -> FormLayout {
        FormLayout::new(self.fixed.columns.len(), self.curves.iter().map(|c| &c.terms[..]))
    }

    /// The curves with the numbers of their parameters.
    fn numbered(&self) -> impl Iterator<Item = (&FormedCurve<'a>, Numbers)> {
        self.curves.iter().zip(self.layout().curves)
    }

    /// The equations with the terms for given logarithms, and for given factors also with the derivatives by the logarithms.
    fn with_forms(&self, logs: &[f64], factors: Option<&[f64]>) -> Equations<'a> {
        let layout = self.layout();
        let mut equations = self.fixed.clone();
        let mut later = Vec::new();
        for (formed, own) in self.numbered() {
            let curve = formed.curve;
            let columns = |functions: &[Function]| {
                let values: Vec<Vec<f64>> = functions.iter().map(|f| curve.means_of(&f.value)).collect();
                let lines = curve.lines_of(self.modulation, &values);
                let columns = lines
                    .iter()
                    .zip(functions)
                    .map(|(lines, f)| curve.column(lines, f.factor));
                columns.collect::<Vec<Column>>()
            };
            let mut functions = terms(formed, &logs[own.logs.clone()]);
            let mut unknowns: Vec<usize> = own
                .factors
                .clone()
                .map(|i| layout.unknown(FormParameter::Factor(i)))
                .collect();
            equations.columns.extend(columns(&functions));
            if let Some(factors) = factors {
                let by_logs = derivatives(formed, &logs[own.logs.clone()], &factors[own.factors]);
                later.extend(columns(&by_logs));
                functions.extend(by_logs);
                unknowns.extend(own.logs.map(|i| layout.unknown(FormParameter::Log(i))));
            }
            let h = TERM_SLOPE_STEP * curve.largest();
            let slope_of = |f: &Function| {
                let at = |x: f64| f.factor * (f.value)(x);
                let slope = |x: &f64| (at(x + h) - at(x - h)) / (2.0 * h);
                curve.x.iter().map(slope).collect::<Vec<f64>>()
            };
            let slopes = || Slopes::of_all(self.modulation, &functions.iter().map(slope_of).collect::<Vec<_>>());
            equations.noisy.extend(curve.noisy(slopes, |k| unknowns[k], None));
        }
        equations.columns.extend(later);
        equations
    }

    /// The same condensed to inner products, whatever the forms of these curves.
    pub fn condensed(&self) -> Option<Condensed> {
        Condensed::new(&self.fixed, &self.curves, self.modulation)
    }

    /// The best of the minima reached from several starts, with what else fits as well; `None` if there is none.
    ///
    /// `condensed` is that of the same equations with any terms.
    pub fn fit(&self, condensed: &Condensed, starts: &[Vec<f64>]) -> Option<FormFit> {
        let logs = self.layout().logs();
        let starts: Vec<&Vec<f64>> = starts.iter().filter(|s| s.len() == logs).collect();
        let minima = parallel::batch(&starts, |s| condensed.minimum(&self.curves, s, None));
        let minima: Vec<Minimum> = minima.into_iter().flatten().map(|m| self.in_order(m)).collect();
        let lowest = minima.iter().min_by(|a, b| a.objective.total_cmp(&b.objective))?;
        let best = self
            .possible_instead(condensed, lowest, &minima)
            .unwrap_or_else(|| lowest.clone());
        let mut fit = self.near(&best.logs)?;
        fit.intervals = profile::intervals(condensed, &self.curves, &fit, &best, &minima);
        Some(fit)
    }

    /// The fit one Gauss-Newton step from these logarithms, which come from the condensed equations and are off by little.
    pub fn near(&self, logs: &[f64]) -> Option<FormFit> {
        let linear = self.with_forms(logs, None).solve()?;
        let fixed = self.fixed.columns.len();
        let equations = self.with_forms(logs, Some(&linear.x[fixed..]));
        let mut solution = equations.solve()?;
        let Robust { covariance, taken } = equations.robust(&solution);
        let departure = self.departure(&equations, &solution)?;
        let steps = &solution.x[linear.x.len()..];
        let (mut end, mut best) = (logs.to_vec(), linear);
        if !logs.is_empty() && steps.iter().all(|s| s.abs() < LONGEST_LOG_STEP) {
            let moved: Vec<f64> = logs.iter().zip(steps).map(|(t, s)| t + s).collect();
            let there = self.with_forms(&moved, None).solve();
            // Not from a friction that an arm can have to one that none has.
            let allowed =
                |there: &Solution| self.possible(&there.x[fixed..], &moved) || !self.possible(&best.x[fixed..], logs);
            if let Some(there) = there.filter(|there| there.objective < best.objective && allowed(there)) {
                (end, best) = (moved, there);
            }
        }
        let curves = self.fitted(&best.x[fixed..], &end);
        solution.x = best.x.iter().chain(&end).copied().collect();
        (solution.residuals, solution.squares, solution.objective) = (best.residuals, best.squares, best.objective);
        Some(FormFit {
            intervals: Vec::new(),
            layout: self.layout(),
            taken,
            departure,
            solution,
            covariance,
            curves,
        })
    }

    /// The curves with these parameters.
    fn fitted(&self, factors: &[f64], logs: &[f64]) -> Vec<ParametricCurve> {
        let fitted = self.numbered().map(|(formed, own)| ParametricCurve {
            terms: formed.terms.clone(),
            factors: factors[own.factors].to_vec(),
            logs: logs[own.logs].to_vec(),
            width: formed.curve.sign_width(),
        });
        fitted.collect()
    }

    /// What the splines of the tested curves explain beside their forms.
    fn departure(&self, equations: &Equations, solution: &Solution) -> Option<Departure> {
        let (mut beside, mut noisy) = (Vec::new(), Vec::new());
        for formed in &self.curves {
            let (curve, Some(Splines { basis, lines })) = (formed.curve, formed.beside) else {
                continue;
            };
            let first = equations.columns.len() + beside.len();
            beside.extend(lines.iter().map(|lines| curve.column(lines, 1.0)));
            noisy.extend(curve.noisy(|| basis.slopes(self.modulation, curve.x), |k| first + k, None));
        }
        Departure::new(equations, solution, beside, noisy)
    }
}

/// Which minima are frictions that an arm can have.
impl FormEquations<'_> {
    /// The same curves with g1 positive: where it is negative, its sign changes and g2 and g3 are exchanged.
    fn in_order(&self, mut minimum: Minimum) -> Minimum {
        for (formed, own) in self.numbered() {
            let (factor, log) = (own.factors.start, own.logs.start);
            if formed.terms.first() == Some(&Term::TanhDifference) && minimum.factors[factor] < 0.0 {
                minimum.factors[factor] *= -1.0;
                minimum.logs.swap(log, log + 1);
            }
        }
        minimum
    }

    /// Whether all frictions (12) are such as an arm can have.
    fn possible(&self, factors: &[f64], logs: &[f64]) -> bool {
        self.impossible(factors, logs).is_none()
    }

    /// The number of the factor g1 of the first friction (12) that no arm has; see [`is_possible_friction`].
    fn impossible(&self, factors: &[f64], logs: &[f64]) -> Option<usize> {
        let mut curves = self.numbered();
        let impossible = curves.find(|(formed, own)| {
            let factors = &factors[own.factors.clone()];
            let ([Term::TanhDifference, ..], &[g1, g4, g6, ..]) = (&formed.terms[..], factors) else {
                return false;
            };
            !is_possible_friction([g1, g4, g6], [0, 1].map(|k| logs[own.logs.start + k]))
        });
        impossible.map(|(_, own)| own.factors.start)
    }

    /// A minimum that an arm can have and that fits as well but for chance, in place of one that no arm can have. The terms of (12) can
    /// replace each other, so that the lowest sum of squares may belong to terms that no friction has.
    fn possible_instead(&self, condensed: &Condensed, lowest: &Minimum, minima: &[Minimum]) -> Option<Minimum> {
        let g1 = self.impossible(&lowest.factors, &lowest.logs)?;
        let lines: usize = self.fixed.right.iter().map(Vec::len).sum();
        let scale = lowest.objective / (2 * lines) as f64;
        let held = |start: &Minimum| {
            let g4 = lowest.factors[g1 + 1].abs();
            let logs = start.logs.clone();
            STRIBECK_SHARES.iter().filter_map(move |share| {
                let held = Held {
                    parameter: FormParameter::Factor(g1),
                    value: share * g4,
                };
                Some(self.in_order(condensed.minimum(&self.curves, &logs, Some(held))?))
            })
        };
        let others = minima.iter().flat_map(held);
        (minima.iter().cloned().chain(others))
            .filter(|found| self.possible(&found.factors, &found.logs))
            .filter(|found| found.objective - lowest.objective < AS_WELL * scale)
            .min_by(|a, b| a.objective.total_cmp(&b.objective))
    }
}

#[cfg(test)]
#[path = "form_fit_tests.rs"]
mod tests;
