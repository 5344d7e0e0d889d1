//! Weighted nonlinear least squares for the physical parameters of the curves.
//!
//! Minima are looked for in the [`Condensed`] equations, and the best one is finished in the equations themselves.

use super::basis::mean_of;
use super::condensed::{Condensed, LARGEST_LOG, Lowest};
use super::equations::{Column, Equations, Solution};
use super::forms::{Shaped, Term};
use super::fourier::Modulation;
use super::profile;
use crate::linalg::Complex;
use crate::linear::levenberg_marquardt::{NormalEquations, minimise_squares};

/// Iterations that finish a minimum of the condensed equations.
const ITERATIONS: usize = 6;

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
    /// What the unknowns take of the sum of squares by chance; see [`Equations::taken`].
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

    /// The best factors for given logarithms, and the sum of squares as a function of the logarithms alone
    /// (variable projection, Golub & Pereyra 1973, with Kaufman's Jacobian).
    fn projected(&self, logs: &[f64]) -> Option<NormalEquations> {
        if logs.iter().any(|t| !(t.abs() < LARGEST_LOG)) {
            return None;
        }
        let columns = self.factors(logs);
        let solution = self.equations(columns.clone(), self.right.clone()).solve()?;
        let derivatives = self.derivatives(logs, &solution.x[self.fixed.len()..]);
        // The part of each derivative that the factors cannot take up.
        let mut left = Vec::with_capacity(derivatives.len());
        for derivative in derivatives {
            let right: Vec<Vec<Complex<f64>>> = derivative
                .iter()
                .zip(&self.right)
                .map(|(d, r)| d.clone().unwrap_or_else(|| vec![Complex::new(0.0, 0.0); r.len()]))
                .collect();
            let rest = self.equations(columns.clone(), right).solve()?;
            left.push(rest.residuals.into_iter().map(Some).collect::<Column>());
        }
        let n = left.len();
        let target: Column = solution.residuals.iter().cloned().map(Some).collect();
        let weights: Vec<Vec<f64>> = self.noise.iter().map(|s| s.iter().map(|s| 2.0 / s).collect()).collect();
        let mut normal = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..n {
                normal[i * n + j] = Equations::product(&weights, &left[i], &left[j]);
            }
        }
        Some(NormalEquations {
            cost: solution.squares,
            descent: left.iter().map(|l| Equations::product(&weights, l, &target)).collect(),
            normal,
        })
    }

    /// The best of the minima reached from several starts, with what else fits as well; `None` if there is none.
    ///
    /// `condensed` is that of the same equations with any terms.
    pub fn fit(&self, condensed: &Condensed, starts: &[Vec<f64>]) -> Option<Shapely> {
        let starts = starts.iter().filter(|s| s.len() == self.logs());
        let minima: Vec<Lowest> = starts.filter_map(|s| condensed.lowest(&self.shapes, s, None)).collect();
        let best = minima.iter().min_by(|a, b| a.squares.total_cmp(&b.squares))?.clone();
        let logs = match best.logs.is_empty() {
            true => Vec::new(),
            false => minimise_squares(best.logs.clone(), ITERATIONS, |t| self.projected(t))?.parameters,
        };
        let mut fit = self.at(&logs)?;
        fit.intervals = profile::intervals(condensed, &self.shapes, &fit, &best, &minima);
        Some(fit)
    }

    /// The fit with these logarithms.
    fn at(&self, logs: &[f64]) -> Option<Shapely> {
        let columns = self.factors(logs);
        let linear = self.equations(columns.clone(), self.right.clone()).solve()?;
        let factors = &linear.x[self.fixed.len()..];
        // Linearised about the minimum, where the logarithms' own steps vanish.
        let mut all = columns;
        all.extend(self.derivatives(logs, factors));
        let equations = self.equations(all, linear.residuals.clone());
        let mut solution = equations.solve()?;
        let covariance = equations.robust(&solution);
        let taken = equations.taken(&solution);
        solution.x = linear.x.iter().chain(logs).copied().collect();
        solution.residuals = linear.residuals.clone();
        solution.squares = linear.squares;
        let mut rest = factors;
        let curves = self
            .shapes
            .iter()
            .zip(self.parts(logs))
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
        Some(Shapely {
            intervals: Vec::new(),
            taken,
            solution,
            covariance,
            curves,
        })
    }
}
