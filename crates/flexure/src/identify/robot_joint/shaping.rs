//! Weighted nonlinear least squares for the physical parameters of the curves.
//!
//! The factors are linear: only the shape parameters' logarithms are searched for (variable projection, Golub & Pereyra 1973, with
//! Kaufman's Jacobian), in the [`Condensed`] equations; the best minimum is finished in the equations themselves.

use super::basis::mean_of;
use super::condensed::{Condensed, Held, Lowest};
use super::departure::Departure;
use super::equations::{Column, Equations, Robust, Solution};
use super::forms::{FormName, Shaped, Term};
use super::fourier::Modulation;
use super::noisy::{Abscissa, Noisy, Slopes};
use super::pair::Splines;
use super::parametric::LARGEST_STRIBECK;
use super::profile;
use crate::linalg::Complex;

/// The longest step of a logarithm that finishes a minimum of the condensed equations.
const LONGEST: f64 = 0.5;
/// Stribeck factors g1, as shares of g4, that are tried where the lowest minimum has one that no arm has.
const STRIBECK_SHARES: [f64; 5] = [0.1, 0.25, 0.5, 1.0, 2.0];
/// The quantile of 95 % of chi squared with four degrees of freedom: what g1, g2, g3 and g5 take by chance.
const AS_WELL: f64 = 9.49;
/// Half the distance of the points between which a slope is taken, as a share of the largest abscissa.
const SLOPE_STEP: f64 = 1e-6;

/// A curve of the equations of motion that is to have a physical form.
pub(super) struct Shape<'a> {
    /// Its terms.
    pub terms: Vec<Term>,
    /// The velocity or deflection at every sample.
    pub x: &'a [f64],
    /// The sign with which the curve enters each block of equations; 0 where it does not.
    pub signs: Vec<f64>,
    /// The width within which signs are softened.
    pub width: f64,
    /// The splines that are put beside the form to test it; in the equations with the same signs, or all with the others.
    pub beside: &'a Splines,
    /// The noise of x, where it counts.
    pub abscissa: Abscissa<'a>,
}

impl Shape<'_> {
    /// The same with the terms of a form.
    pub fn with(self, form: FormName) -> Self {
        Shape {
            terms: form.terms(false),
            ..self
        }
    }
}

/// Equations of motion whose curves have physical forms.
pub(super) struct Shaping<'a> {
    /// The columns of the other unknowns.
    pub fixed: Vec<Column>,
    /// The right-hand side of each block.
    pub right: Vec<Vec<Complex<f64>>>,
    /// The noise of each block.
    pub noise: Vec<&'a [f64]>,
    /// The noise of the fixed columns, as in [`Equations::noisy`].
    pub noisy: Vec<Noisy<'a>>,
    /// The curves.
    pub shapes: Vec<Shape<'a>>,
    /// The integrals' window.
    pub modulation: &'a Modulation,
}

/// Where a fit of physical forms ended.
pub(super) struct Shapely {
    /// The unknowns: those of the fixed columns, then for each curve its factors, then for each its logarithms.
    pub solution: Solution,
    /// Their covariance, whatever the noise's spectrum.
    pub covariance: Vec<f64>,
    /// What the unknowns take of the sum of squares by chance; see [`Robust`].
    pub taken: f64,
    /// The test against splines beside the forms.
    pub departure: Departure,
    /// The intervals of 95 % of the factors and of the logarithms by the likelihood's profile, in the unknowns' order; infinite on
    /// the side on which no value fits worse. Those of the fixed columns' unknowns are not looked for.
    pub intervals: Vec<[f64; 2]>,
    /// The curves.
    pub curves: Vec<Shaped>,
}

impl Shaping<'_> {
    fn logs(&self) -> usize {
        self.shapes.iter().flat_map(|s| &s.terms).map(|t| t.shapes()).sum()
    }

    fn place(&self, signs: &[f64], lines: &[Complex<f64>], factor: f64) -> Column {
        let scaled = |sign: f64| lines.iter().map(|v| v * (sign * factor)).collect();
        signs.iter().map(|&s| (s != 0.0).then(|| scaled(s))).collect()
    }

    /// The logarithms of each curve.
    fn parts<'b>(&self, logs: &'b [f64]) -> Vec<&'b [f64]> {
        let mut rest = logs;
        self.shapes
            .iter()
            .map(|s| {
                let (own, after) = rest.split_at(s.terms.iter().map(|t| t.shapes()).sum());
                rest = after;
                own
            })
            .collect()
    }

    /// The columns of the factors for given logarithms.
    fn factors(&self, logs: &[f64]) -> Vec<Column> {
        let mut columns = self.fixed.clone();
        for (shape, logs) in self.shapes.iter().zip(self.parts(logs)) {
            let values: Vec<Vec<f64>> = Shaped::split(&shape.terms, logs)
                .map(|(term, _, t)| mean_of(shape.x, |x| term.value(x, t, shape.width)))
                .collect();
            for lines in self.modulation.of_all(&values) {
                columns.push(self.place(&shape.signs, &lines, 1.0));
            }
        }
        columns
    }

    /// The columns of the derivatives by the logarithms, for the factors that belong to them.
    fn derivatives(&self, logs: &[f64], factors: &[f64]) -> Vec<Column> {
        let mut columns = Vec::new();
        let mut at = 0;
        for (shape, logs) in self.shapes.iter().zip(self.parts(logs)) {
            let mut values = Vec::new();
            let mut scales = Vec::new();
            for (i, (term, _, t)) in Shaped::split(&shape.terms, logs).enumerate() {
                for k in 0..term.shapes() {
                    values.push(mean_of(shape.x, |x| term.by_shape(x, t, k, shape.width)));
                    scales.push(factors[at + i]);
                }
            }
            at += shape.terms.len();
            for (lines, scale) in self.modulation.of_all(&values).iter().zip(scales) {
                columns.push(self.place(&shape.signs, lines, scale));
            }
        }
        columns
    }

    /// What noise adds to the products of the columns: of the factors, and for given factors of the derivatives by the logarithms too.
    fn noisy(&self, logs: &[f64], factors: Option<&[f64]>) -> Vec<Noisy<'_>> {
        let mut noisy = self.noisy.clone();
        let (mut term_at, mut log_at) = (0, self.shapes.iter().map(|s| s.terms.len()).sum::<usize>());
        for (shape, logs) in self.shapes.iter().zip(self.parts(logs)) {
            let from = term_at;
            term_at += shape.terms.len();
            if shape.abscissa.is_exact() {
                log_at += logs.len();
                continue;
            }
            let h = SLOPE_STEP * shape.x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let slope_of = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
                let slope = |x: &f64| (f(x + h) - f(x - h)) / (2.0 * h);
                shape.x.iter().map(slope).collect()
            };
            let (mut slopes, mut numbers) = (Vec::new(), Vec::new());
            for (i, (term, _, t)) in Shaped::split(&shape.terms, logs).enumerate() {
                slopes.push(slope_of(&|x| term.value(x, t, shape.width)));
                numbers.push(self.fixed.len() + from + i);
            }
            if let Some(factors) = factors {
                for (i, (term, _, t)) in Shaped::split(&shape.terms, logs).enumerate() {
                    for k in 0..term.shapes() {
                        slopes.push(slope_of(&|x| factors[from + i] * term.by_shape(x, t, k, shape.width)));
                        numbers.push(self.fixed.len() + log_at);
                        log_at += 1;
                    }
                }
            }
            let slopes = Slopes::of_all(self.modulation, &slopes);
            noisy.extend(shape.abscissa.noisy(&slopes, |k| numbers[k]));
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
    pub fn fit(&self, condensed: &Condensed, starts: &[Vec<f64>]) -> Option<Shapely> {
        let starts = starts.iter().filter(|s| s.len() == self.logs());
        let minima: Vec<Lowest> = starts
            .filter_map(|s| Some(self.in_order(condensed.lowest(&self.shapes, s, None)?)))
            .collect();
        let lowest = minima.iter().min_by(|a, b| a.objective.total_cmp(&b.objective))?;
        let best = self
            .possible_instead(condensed, lowest, &minima)
            .unwrap_or_else(|| lowest.clone());
        let mut fit = self.near(&best.logs)?;
        fit.intervals = profile::intervals(condensed, &self.shapes, &fit, &best, &minima);
        Some(fit)
    }

    /// The same curves with no negative factor of a difference of two alike: with the two exchanged instead.
    fn in_order(&self, mut lowest: Lowest) -> Lowest {
        let (mut factor, mut log) = (0, 0);
        for term in self.shapes.iter().flat_map(|s| &s.terms) {
            if *term == Term::TanhDifference && lowest.factors[factor] < 0.0 {
                lowest.factors[factor] *= -1.0;
                lowest.logs.swap(log, log + 1);
            }
            factor += 1;
            log += term.shapes();
        }
        lowest
    }

    /// Whether all frictions (12) are such as an arm can have.
    fn possible(&self, factors: &[f64], logs: &[f64]) -> bool {
        self.impossible(factors, logs).is_none()
    }

    /// The number of the first factor of the first friction (12) that no arm has: one with a negative term, or with a Stribeck part that
    /// is the small difference of large terms.
    fn impossible(&self, factors: &[f64], logs: &[f64]) -> Option<usize> {
        let (mut factor, mut log) = (0, 0);
        for shape in &self.shapes {
            let own = &factors[factor..factor + shape.terms.len()];
            if let ([Term::TanhDifference, ..], [g1, g4, g6, ..]) = (&shape.terms[..], own) {
                let positive = [g1, g4, g6].into_iter().all(|g| *g >= 0.0);
                if !(positive && *g1 <= LARGEST_STRIBECK * g4 && logs[log] >= logs[log + 1]) {
                    return Some(factor);
                }
            }
            factor += shape.terms.len();
            log += shape.terms.iter().map(|t| t.shapes()).sum::<usize>();
        }
        None
    }

    /// Instead of a minimum that no arm has, one that an arm can have and that fits as well but for chance: the terms of (12) make up
    /// for each other, and the lowest of their sums may be of terms that no friction has.
    fn possible_instead(&self, condensed: &Condensed, lowest: &Lowest, minima: &[Lowest]) -> Option<Lowest> {
        let g1 = self.impossible(&lowest.factors, &lowest.logs)?;
        let lines: usize = self.right.iter().map(Vec::len).sum();
        let scale = lowest.objective / (2 * lines) as f64;
        let held = |start: &Lowest| {
            let size = lowest.factors[g1 + 1].abs();
            let logs = start.logs.clone();
            STRIBECK_SHARES.iter().filter_map(move |share| {
                let held = Held::Factor(g1, share * size);
                Some(self.in_order(condensed.lowest(&self.shapes, &logs, Some(held))?))
            })
        };
        let others = minima.iter().flat_map(held);
        (minima.iter().cloned().chain(others))
            .filter(|found| self.possible(&found.factors, &found.logs))
            .filter(|found| found.objective - lowest.objective < AS_WELL * scale)
            .min_by(|a, b| a.objective.total_cmp(&b.objective))
    }

    /// What the splines of all curves explain beside their forms.
    fn departure(&self, equations: &Equations, solution: &Solution) -> Option<Departure> {
        let (mut beside, mut noisy) = (Vec::new(), Vec::new());
        for shape in &self.shapes {
            let first = equations.columns.len() + beside.len();
            let (basis, lines) = shape.beside;
            beside.extend(lines.iter().map(|lines| self.place(&shape.signs, lines, 1.0)));
            if !shape.abscissa.is_exact() {
                let slopes = basis.slopes(self.modulation, shape.x);
                noisy.extend(shape.abscissa.noisy(&slopes, |k| first + k));
            }
        }
        Departure::new(equations, solution, beside, noisy)
    }

    /// The fit next to these logarithms, a step of Gauss and Newton away: condensed equations are off by little.
    pub fn near(&self, logs: &[f64]) -> Option<Shapely> {
        let columns = self.factors(logs);
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
        if !logs.is_empty() && steps.iter().all(|s| s.abs() < LONGEST) {
            let moved: Vec<f64> = logs.iter().zip(steps).map(|(t, s)| t + s).collect();
            let there = self.equations(self.factors(&moved), self.noisy(&moved, None)).solve();
            // Not from a friction that an arm can have to one that none has.
            let allowed = |there: &Solution| {
                let fixed = self.fixed.len();
                self.possible(&there.x[fixed..], &moved) || !self.possible(&best.x[fixed..], logs)
            };
            if let Some(there) = there.filter(|there| there.objective < best.objective && allowed(there)) {
                (end, best) = (moved, there);
            }
        }
        let mut rest = &best.x[self.fixed.len()..];
        let curves = self
            .shapes
            .iter()
            .zip(self.parts(&end))
            .map(|(shape, logs)| {
                let (own, after) = rest.split_at(shape.terms.len());
                rest = after;
                Shaped {
                    terms: shape.terms.clone(),
                    factors: own.to_vec(),
                    logs: logs.to_vec(),
                    width: shape.width,
                }
            })
            .collect();
        solution.x = best.x.iter().chain(&end).copied().collect();
        (solution.residuals, solution.squares, solution.objective) = (best.residuals, best.squares, best.objective);
        Some(Shapely {
            intervals: Vec::new(),
            taken,
            departure,
            solution,
            covariance,
            curves,
        })
    }
}

#[cfg(test)]
#[path = "shaping_tests.rs"]
mod tests;
