//! Physical forms of curves, fitted to equations of motion by weighted nonlinear least squares.
//!
//! A form is $\sum_i c_i\, g_i(\xi; \theta)$ with factors c and shape parameters theta. The factors are linear, so only the
//! logarithms of the shape parameters are searched for (variable projection, Golub & Pereyra 1973, with Kaufman's Jacobian), in
//! the [`Condensed`] equations. The best minimum is finished in the equations themselves.

use super::basis::mean_of;
use super::column_noise::{Noisy, Slopes};
use super::condensed::{Condensed, Held, Minimum};
use super::covariance::{Covariance, Robust};
use super::equations::{Column, Equations, Lines, Solution};
use super::forms::{Shaped, Term};
use super::fourier::Modulation;
use super::lack_of_fit::Departure;
use super::layout::{FormLayout, FormParameter};
use super::profile;
use super::system::{Curve, Splines};

/// The largest step of a logarithm that finishes a minimum of the condensed equations.
const LONGEST_STEP: f64 = 0.5;
/// The largest Stribeck factor g1 of friction as a multiple of the Coulomb friction g4.
pub(super) const LARGEST_STRIBECK: f64 = 5.0;
/// Stribeck factors g1, as shares of g4, that are tried where the lowest minimum has one that no arm has.
const STRIBECK_SHARES: [f64; 5] = [0.1, 0.25, 0.5, 1.0, 2.0];
/// The quantile of 95 % of chi squared with four degrees of freedom: what g1, g2, g3 and g5 take by chance.
const AS_WELL: f64 = 9.49;
/// Half the distance of the points between which a slope is taken, as a share of the largest abscissa.
const SLOPE_STEP: f64 = 1e-6;

/// A curve of the equations of motion that is to have a physical form.
pub(super) struct Shape<'a> {
    pub terms: Vec<Term>,
    pub curve: &'a Curve<'a>,
    /// The splines beside which the form is tested.
    pub beside: &'a Splines,
}

/// Equations of motion in which some curves have physical forms.
pub(super) struct FormEquations<'a> {
    /// The columns of the other unknowns: factors, and the splines of curves that stay free.
    pub fixed: Vec<Column>,
    pub right: Vec<Lines>,
    /// The noise of each block.
    pub noise: Vec<&'a [f64]>,
    /// The noise of the fixed columns.
    pub noisy: Vec<Noisy<'a>>,
    pub shapes: Vec<Shape<'a>>,
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
    pub curves: Vec<Shaped>,
}

impl Shape<'_> {
    /// Each term with the logarithms of its shape parameters.
    pub fn split<'b>(&'b self, logs: &'b [f64]) -> impl Iterator<Item = (Term, &'b [f64])> {
        Shaped::split(&self.terms, logs)
    }
}

impl<'a> FormEquations<'a> {
    pub fn layout(&self) -> FormLayout {
        FormLayout::new(self.fixed.len(), self.shapes.iter().map(|s| &s.terms[..]))
    }

    /// The curves with their own logarithms.
    fn curves<'b>(
        &'b self,
        layout: &'b FormLayout,
        logs: &'b [f64],
    ) -> impl Iterator<Item = (&'b Shape<'a>, &'b [f64])> {
        let shapes = self.shapes.iter().zip(&layout.logs);
        shapes.map(|(shape, range)| (shape, &logs[range.clone()]))
    }

    /// The fixed columns, and those of the factors for given logarithms.
    fn columns(&self, logs: &[f64]) -> Vec<Column> {
        let mut columns = self.fixed.clone();
        for (shape, logs) in self.curves(&self.layout(), logs) {
            let (curve, width) = (shape.curve, shape.curve.sign_width());
            let values: Vec<Vec<f64>> = (shape.split(logs))
                .map(|(term, t)| mean_of(curve.x, |x| term.value(x, t, width)))
                .collect();
            let lines = self.modulation.of_all(&values);
            columns.extend(lines.iter().map(|lines| curve.column(lines, 1.0)));
        }
        columns
    }

    /// The columns of the derivatives by the logarithms, for the factors that belong to them.
    fn derivatives(&self, logs: &[f64], factors: &[f64]) -> Vec<Column> {
        let mut columns = Vec::new();
        let layout = self.layout();
        for ((shape, logs), own) in self.curves(&layout, logs).zip(&layout.factors) {
            let (curve, width) = (shape.curve, shape.curve.sign_width());
            let (mut values, mut scales) = (Vec::new(), Vec::new());
            for ((term, t), factor) in shape.split(logs).zip(&factors[own.clone()]) {
                for k in 0..term.shapes() {
                    values.push(mean_of(curve.x, |x| term.by_shape(x, t, k, width)));
                    scales.push(*factor);
                }
            }
            let lines = self.modulation.of_all(&values);
            columns.extend(
                lines
                    .iter()
                    .zip(scales)
                    .map(|(lines, scale)| curve.column(lines, scale)),
            );
        }
        columns
    }

    /// What noise adds to the products of the columns: of the factors, and for given factors of the derivatives by the logarithms too.
    fn noisy(&self, logs: &[f64], factors: Option<&[f64]>) -> Vec<Noisy<'a>> {
        let mut noisy = self.noisy.clone();
        let layout = self.layout();
        for (number, (shape, logs)) in self.curves(&layout, logs).enumerate() {
            let (curve, width) = (shape.curve, shape.curve.sign_width());
            let h = SLOPE_STEP * curve.largest();
            let slope_of = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
                let slope = |x: &f64| (f(x + h) - f(x - h)) / (2.0 * h);
                curve.x.iter().map(slope).collect()
            };
            let own = layout.factors[number].clone();
            let mut unknowns: Vec<usize> = own.clone().map(|i| layout.unknown(FormParameter::Factor(i))).collect();
            let with_logs = layout.logs[number]
                .clone()
                .map(|i| layout.unknown(FormParameter::Log(i)));
            unknowns.extend(with_logs);
            let slopes = || {
                let values = shape
                    .split(logs)
                    .map(|(term, t)| slope_of(&|x| term.value(x, t, width)));
                let mut slopes: Vec<Vec<f64>> = values.collect();
                for ((term, t), factor) in shape.split(logs).zip(factors.map_or(&[][..], |f| &f[own.clone()])) {
                    let by_shape = (0..term.shapes()).map(|k| slope_of(&|x| factor * term.by_shape(x, t, k, width)));
                    slopes.extend(by_shape);
                }
                Slopes::of_all(self.modulation, &slopes)
            };
            noisy.extend(curve.noisy(slopes, |k| unknowns[k], |i| i));
        }
        noisy
    }

    fn equations<'b>(&'b self, columns: Vec<Column>, noisy: Vec<Noisy<'b>>) -> Equations<'b> {
        Equations {
            columns,
            right: self.right.clone(),
            noise: self.noise.clone(),
            noisy,
        }
    }

    /// The best of the minima reached from several starts, with what else fits as well; `None` if there is none.
    ///
    /// `condensed` is that of the same equations with any terms.
    pub fn fit(&self, condensed: &Condensed, starts: &[Vec<f64>]) -> Option<FormFit> {
        let logs = self.layout().all_logs().len();
        let starts = starts.iter().filter(|s| s.len() == logs);
        let minima: Vec<Minimum> = starts
            .filter_map(|s| Some(self.in_order(condensed.minimum(&self.shapes, s, None)?)))
            .collect();
        let lowest = minima.iter().min_by(|a, b| a.objective.total_cmp(&b.objective))?;
        let best = self
            .possible_instead(condensed, lowest, &minima)
            .unwrap_or_else(|| lowest.clone());
        let mut fit = self.near(&best.logs)?;
        fit.intervals = profile::intervals(condensed, &self.shapes, &fit, &best, &minima);
        Some(fit)
    }

    /// The fit next to these logarithms, a Gauss-Newton step away: condensed equations are off by little.
    pub fn near(&self, logs: &[f64]) -> Option<FormFit> {
        let columns = self.columns(logs);
        let linear = self.equations(columns.clone(), self.noisy(logs, None)).solve()?;
        let factors = &linear.x[self.fixed.len()..];
        let mut all = columns;
        all.extend(self.derivatives(logs, factors));
        let equations = self.equations(all, self.noisy(logs, Some(factors)));
        let mut solution = equations.solve()?;
        let Robust { covariance, taken } = equations.robust(&solution);
        let departure = self.departure(&equations, &solution)?;
        let steps = &solution.x[linear.x.len()..];
        let (mut end, mut best) = (logs.to_vec(), linear);
        if !logs.is_empty() && steps.iter().all(|s| s.abs() < LONGEST_STEP) {
            let moved: Vec<f64> = logs.iter().zip(steps).map(|(t, s)| t + s).collect();
            let there = self.equations(self.columns(&moved), self.noisy(&moved, None)).solve();
            // Not from a friction that an arm can have to one that none has.
            let allowed = |there: &Solution| {
                let fixed = self.fixed.len();
                self.possible(&there.x[fixed..], &moved) || !self.possible(&best.x[fixed..], logs)
            };
            if let Some(there) = there.filter(|there| there.objective < best.objective && allowed(there)) {
                (end, best) = (moved, there);
            }
        }
        let curves = self.shaped(&best.x[self.fixed.len()..], &end);
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
    fn shaped(&self, factors: &[f64], logs: &[f64]) -> Vec<Shaped> {
        let layout = self.layout();
        let curves = self.curves(&layout, logs).zip(&layout.factors);
        curves
            .map(|((shape, logs), own)| Shaped {
                terms: shape.terms.clone(),
                factors: factors[own.clone()].to_vec(),
                logs: logs.to_vec(),
                width: shape.curve.sign_width(),
            })
            .collect()
    }

    /// What the splines of all curves explain beside their forms.
    fn departure(&self, equations: &Equations, solution: &Solution) -> Option<Departure> {
        let (mut beside, mut noisy) = (Vec::new(), Vec::new());
        for Shape {
            curve,
            beside: Splines { basis, lines },
            ..
        } in &self.shapes
        {
            let first = equations.columns.len() + beside.len();
            beside.extend(lines.iter().map(|lines| curve.column(lines, 1.0)));
            noisy.extend(curve.noisy(|| basis.slopes(self.modulation, curve.x), |k| first + k, |i| i));
        }
        Departure::new(equations, solution, beside, noisy)
    }
}

/// Which minima are frictions that an arm can have.
impl FormEquations<'_> {
    /// The same curves with no negative factor of a difference of two alike: with the two exchanged instead.
    fn in_order(&self, mut minimum: Minimum) -> Minimum {
        let layout = self.layout();
        for (shape, (factors, logs)) in self.shapes.iter().zip(layout.factors.iter().zip(&layout.logs)) {
            let factor = factors.start;
            if shape.terms.first() == Some(&Term::TanhDifference) && minimum.factors[factor] < 0.0 {
                minimum.factors[factor] *= -1.0;
                minimum.logs.swap(logs.start, logs.start + 1);
            }
        }
        minimum
    }

    /// Whether all frictions (12) are such as an arm can have.
    fn possible(&self, factors: &[f64], logs: &[f64]) -> bool {
        self.impossible(factors, logs).is_none()
    }

    /// The number of the factor g1 of the first friction (12) that no arm has: one with a negative term, or with a Stribeck part that
    /// is the small difference of large terms.
    fn impossible(&self, factors: &[f64], logs: &[f64]) -> Option<usize> {
        let layout = self.layout();
        let impossible = |curve: &usize| {
            let own = &factors[layout.factors[*curve].clone()];
            let ([Term::TanhDifference, ..], [g1, g4, g6, ..]) = (&self.shapes[*curve].terms[..], own) else {
                return false;
            };
            let [g2, g3] = [0, 1].map(|k| logs[layout.logs[*curve].start + k]);
            let positive = [g1, g4, g6].into_iter().all(|g| *g >= 0.0);
            !(positive && *g1 <= LARGEST_STRIBECK * g4 && g2 >= g3)
        };
        let first = (0..self.shapes.len()).find(impossible)?;
        Some(layout.factors[first].start)
    }

    /// Instead of a minimum that no arm has, one that an arm can have and that fits as well but for chance: the terms of (12) make up
    /// for each other, and the lowest of their sums may be of terms that no friction has.
    fn possible_instead(&self, condensed: &Condensed, lowest: &Minimum, minima: &[Minimum]) -> Option<Minimum> {
        let g1 = self.impossible(&lowest.factors, &lowest.logs)?;
        let lines: usize = self.right.iter().map(Vec::len).sum();
        let scale = lowest.objective / (2 * lines) as f64;
        let held = |start: &Minimum| {
            let g4 = lowest.factors[g1 + 1].abs();
            let logs = start.logs.clone();
            STRIBECK_SHARES.iter().filter_map(move |share| {
                let held = Held {
                    parameter: FormParameter::Factor(g1),
                    value: share * g4,
                };
                Some(self.in_order(condensed.minimum(&self.shapes, &logs, Some(held))?))
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
