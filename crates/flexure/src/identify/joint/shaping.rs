//! Weighted nonlinear least squares for the physical parameters of the curves.
//!
//! The factors are linear: only the shape parameters' logarithms are searched for (variable projection, Golub & Pereyra 1973, with
//! Kaufman's Jacobian), in the [`Condensed`] equations; the best minimum is finished in the equations themselves.

use super::basis::mean_of;
use super::condensed::{Condensed, Lowest};
use super::equations::{Column, Equations, Robust, Solution};
use super::forms::{FormName, Shaped, Term};
use super::fourier::Modulation;
use super::profile;
use crate::linalg::Complex;

/// The longest step of a logarithm that finishes a minimum of the condensed equations.
const LONGEST: f64 = 0.5;

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
    /// The noisy ones of the fixed columns, as in [`Equations::noisy`].
    pub noisy: Vec<(usize, usize, &'a [f64])>,
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
    pub taken: [f64; 2],
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

    fn equations(&self, columns: Vec<Column>, right: Vec<Vec<Complex<f64>>>) -> Equations<'_> {
        Equations {
            columns,
            right,
            noise: self.noise.clone(),
            noisy: self.noisy.clone(),
        }
    }

    /// The best of the minima reached from several starts, with what else fits as well; `None` if there is none.
    ///
    /// `condensed` is that of the same equations with any terms.
    pub fn fit(&self, condensed: &Condensed, starts: &[Vec<f64>]) -> Option<Shapely> {
        let starts = starts.iter().filter(|s| s.len() == self.logs());
        let minima: Vec<Lowest> = starts.filter_map(|s| condensed.lowest(&self.shapes, s, None)).collect();
        let best = minima
            .iter()
            .min_by(|a, b| a.objective.total_cmp(&b.objective))?
            .clone();
        let mut fit = self.near(&best.logs)?;
        fit.intervals = profile::intervals(condensed, &self.shapes, &fit, &best, &minima);
        Some(fit)
    }

    /// The fit next to these logarithms, a step of Gauss and Newton away: condensed equations are off by little.
    pub fn near(&self, logs: &[f64]) -> Option<Shapely> {
        let columns = self.factors(logs);
        let linear = self.equations(columns.clone(), self.right.clone()).solve()?;
        let mut all = columns;
        all.extend(self.derivatives(logs, &linear.x[self.fixed.len()..]));
        let equations = self.equations(all, self.right.clone());
        let mut solution = equations.solve()?;
        let Robust { covariance, taken } = equations.robust(&solution);
        let steps = &solution.x[linear.x.len()..];
        let (mut end, mut best) = (logs.to_vec(), linear);
        if !logs.is_empty() && steps.iter().all(|s| s.abs() < LONGEST) {
            let moved: Vec<f64> = logs.iter().zip(steps).map(|(t, s)| t + s).collect();
            let there = self.equations(self.factors(&moved), self.right.clone()).solve();
            if let Some(there) = there.filter(|there| there.objective < best.objective) {
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
            solution,
            covariance,
            curves,
        })
    }
}
