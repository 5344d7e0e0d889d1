//! Equations of motion with unknown factors and free curves.
//!
//! A rigid axis, a flexible joint and an arm differ only in the terms of
//!
//! $$ \sum_i x_i\, a_{bi}(t) + \sum_k s_{bk}\, f_k(\xi_k(t)) = r_b(t) \qquad\text{for every equation } b: $$
//!
//! the factors $x_i$ are inertias, constants of the links and gravity; the curves $f_k$ are stiffness over the deflection and
//! friction over the velocity, with the sign $s_{bk}$ in equation b. Each curve is a sum of splines ([`Basis`]). Their number
//! follows from all equations together, and so does the noise of each equation.

use std::borrow::Borrow;

use super::basis::{Basis, mean_of};
use super::column_noise::{AbscissaNoise, Noisy, Slopes};
use super::covariance::{fitted_noise, fitted_to_power};
use super::division::{Division, Divisions};
use super::equations::{Column, Equations, Lines, Solution};
use super::fourier::Modulation;
use super::layout::Layout;
use super::limits::{DIVISION_ROUNDS, JUMP_WIDTH};
use super::outcome::Estimated;
use super::passages::Passage;
use crate::linalg::Complex;

/// The abscissa of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CurveKind {
    /// The elastic torque k(d) d over the deflection d; the splines are those of the stiffness k.
    Stiffness,
    /// The friction torque over the velocity.
    Friction,
}

/// A curve of the equations of motion.
pub(super) struct Curve<'a> {
    pub kind: CurveKind,
    /// The deflection or velocity at every sample.
    pub x: &'a [f64],
    /// The sign of the curve in each equation; 0 if it does not occur there.
    pub signs: Vec<f64>,
    /// The noise of x, if it matters.
    pub noise: Vec<AbscissaNoise<'a>>,
    /// The smallest distance of x that the data resolve.
    pub resolution: f64,
    /// The numbers of splines to choose from.
    pub division: &'static Division,
    /// The number of factors before the curve's coefficients among the unknowns.
    pub after: usize,
    /// What is known of x within samples.
    pub passages: &'a [Passage],
}

/// A division of a curve's range, with the transformed splines.
#[derive(Debug, Clone)]
pub(super) struct Splines {
    pub basis: Basis,
    pub lines: Vec<Lines>,
}

impl<'a> Curve<'a> {
    /// The largest absolute deflection or velocity.
    pub fn largest(&self) -> f64 {
        self.x.iter().fold(0.0_f64, |m, x| m.max(x.abs()))
    }

    /// The width within which the sign of x is softened in physical forms.
    pub fn sign_width(&self) -> f64 {
        match self.kind {
            CurveKind::Stiffness => 0.0,
            CurveKind::Friction if self.passages.is_empty() => self.resolution,
            CurveKind::Friction => 0.0,
        }
    }

    /// The distance from zero of the nearest points at which forms are evaluated in condensed equations.
    pub fn nearest_knot(&self) -> f64 {
        match self.passages.is_empty() {
            true => self.sign_width(),
            false => JUMP_WIDTH * self.resolution,
        }
    }

    /// The splines with this number of intervals on either side of zero.
    pub fn splines(&self, modulation: &Modulation, pieces: usize) -> Splines {
        match self.kind {
            CurveKind::Stiffness => {
                let basis = Basis::stiffness(self.x, pieces);
                let lines = modulation.of_all(&basis.columns_times_x(self.x));
                Splines { basis, lines }
            }
            CurveKind::Friction => {
                let basis = match self.passages.is_empty() {
                    true => Basis::friction(self.x, pieces),
                    false => Basis::dry_friction(&self.moving(), pieces),
                };
                let lines = self.lines_of(modulation, &basis.mean_columns(self.x, self.passages));
                Splines { basis, lines }
            }
        }
    }

    /// The lines of functions of x with these means over the time of each sample. Where the motion is known within samples, they are corrected for the gain of a mean.
    pub fn lines_of(&self, modulation: &Modulation, means: &[Vec<f64>]) -> Vec<Lines> {
        let mut lines = modulation.of_all(means);
        if !self.passages.is_empty() {
            lines.iter_mut().for_each(|lines| modulation.undo_mean(lines));
        }
        lines
    }

    /// The mean of x in each sample for most of which it is not at rest.
    fn moving(&self) -> Vec<f64> {
        let mut x: Vec<Option<f64>> = self.x.iter().copied().map(Some).collect();
        for passage in self.passages {
            let share = passage.share();
            x[passage.sample] = (share > 0.5).then(|| passage.mean_of(|v| v) / share);
        }
        x.into_iter().flatten().collect()
    }

    /// The means of a function of x over the time of each sample.
    pub fn means_of(&self, f: impl Fn(f64) -> f64) -> Vec<f64> {
        mean_of(self.x, self.passages, f)
    }

    /// The splines that are added to forms of the curve in their test: with a division that does not depend on the torques.
    pub fn tested(&self, modulation: &Modulation) -> Splines {
        self.splines(modulation, self.division.tested)
    }

    /// Lines of a function of x as a column, times a factor.
    pub fn column(&self, lines: &[Complex<f64>], factor: f64) -> Column {
        let scaled = |sign: f64| lines.iter().map(|v| v * (sign * factor)).collect();
        self.signs.iter().map(|&s| (s != 0.0).then(|| scaled(s))).collect()
    }

    /// The contributions of the noise of x to the products of functions of x with these slopes; `column` gives their columns. The factors
    /// have the columns `factors`, or come first by default.
    pub fn noisy(
        &self,
        slopes: impl FnOnce() -> Slopes,
        column: impl Fn(usize) -> usize,
        factors: Option<&[usize]>,
    ) -> Vec<Noisy<'a>> {
        if self.noise.is_empty() {
            return Vec::new();
        }
        let slopes = slopes();
        let of_noise = self.noise.iter().flat_map(|noise| {
            let factor = noise.factor.map(|i| factors.map_or(i, |factors| factors[i]));
            AbscissaNoise { factor, ..*noise }.noisy(&slopes, &column)
        });
        of_noise.collect()
    }

    /// The value of the curve at x from its splines' coefficients.
    pub fn value(&self, basis: &Basis, coefficients: &[f64], x: f64) -> f64 {
        self.torque(x, basis.value(coefficients, x))
    }

    /// The torque at x from the value of the splines.
    pub fn torque(&self, x: f64, splines: f64) -> f64 {
        match self.kind {
            CurveKind::Stiffness => splines * x,
            CurveKind::Friction => splines,
        }
    }
}

/// The encoders' part of each equation's noise, for given factors.
pub(super) type EncoderNoise<'a> = Box<dyn Fn(&[f64]) -> Vec<Vec<f64>> + Sync + 'a>;

/// Equations of motion.
pub(super) struct System<'a> {
    pub modulation: &'a Modulation,
    /// The columns of the unknown factors.
    pub factors: Vec<Column>,
    pub right: Vec<Lines>,
    /// The noise of the factors' columns.
    pub noisy: Vec<Noisy<'a>>,
    /// What each known value adds to the right-hand side if it is off by its standard error.
    pub given: Vec<Column>,
    pub encoder_noise: EncoderNoise<'a>,
    pub curves: Vec<Curve<'a>>,
}

/// Free curves, and the noise of each equation.
pub(super) struct FreeCurves {
    pub splines: Vec<Splines>,
    pub noise: Vec<Vec<f64>>,
    /// The next finer splines, which show the details that those in use smooth away.
    pub finer: Vec<Splines>,
    /// The splines that are added to forms in their test.
    pub tested: Vec<Splines>,
}

/// A solution with free curves.
pub(super) struct Solved<'a> {
    pub equations: Equations<'a>,
    pub layout: Layout,
    pub solution: Solution,
}

impl<'a> Solved<'a> {
    /// The factors.
    pub fn factors(&self) -> Vec<f64> {
        self.layout.factors.iter().map(|&i| self.solution.x[i]).collect()
    }

    /// The coefficients of a curve's splines.
    pub fn coefficients(&self, curve: usize) -> &[f64] {
        &self.solution.x[self.layout.curves[curve].clone()]
    }

    /// Akaike's criterion.
    pub fn akaike(&self) -> f64 {
        let observations = 2.0 * self.solution.lines() as f64;
        observations * (self.solution.squares / observations).ln() + 2.0 * self.solution.x.len() as f64
    }
}

impl<'a> System<'a> {
    /// The order of the unknowns for these splines of the curves.
    pub fn layout(&self, splines: &[impl Borrow<Splines>]) -> Layout {
        let mut layout = Layout::default();
        for (curve, splines) in self.curves.iter().zip(splines) {
            layout.add_factors(curve.after);
            layout.add_curve(splines.borrow().basis.len());
        }
        layout.add_factors(self.factors.len());
        layout
    }

    /// The equations with these splines of the curves, for noise of this spectrum.
    pub fn equations<'b>(&'b self, splines: &[impl Borrow<Splines>], noise: &'b [Vec<f64>]) -> Equations<'b> {
        let layout = self.layout(splines);
        let mut columns: Vec<Column> = vec![Column::new(); layout.len()];
        for (&at, column) in layout.factors.iter().zip(&self.factors) {
            columns[at] = column.clone();
        }
        let of_factors = self.noisy.iter().map(|noisy| Noisy {
            columns: noisy.columns.map(|i| layout.factors[i]),
            ..*noisy
        });
        let mut noisy: Vec<Noisy> = of_factors.collect();
        for ((curve, splines), range) in self.curves.iter().zip(splines).zip(&layout.curves) {
            let Splines { basis, lines } = splines.borrow();
            for (column, lines) in columns[range.clone()].iter_mut().zip(lines) {
                *column = curve.column(lines, 1.0);
            }
            let slopes = || basis.slopes(self.modulation, curve.x);
            noisy.extend(curve.noisy(slopes, |k| range.start + k, Some(&layout.factors)));
        }
        Equations {
            columns,
            right: self.right.clone(),
            noise: noise.iter().map(Vec::as_slice).collect(),
            noisy,
            given: self.given.clone(),
        }
    }

    /// The solution with these splines of the curves; `None` if the equations do not determine it.
    pub fn solve<'b>(&'b self, splines: &[impl Borrow<Splines>], noise: &'b [Vec<f64>]) -> Option<Solved<'b>> {
        let equations = self.equations(splines, noise);
        Some(Solved {
            solution: equations.solve()?,
            layout: self.layout(splines),
            equations,
        })
    }

    /// The factor of one more column beside these free curves; `None` if the equations do not determine it.
    pub fn factor_of(&self, free: &FreeCurves, column: Column) -> Option<Estimated> {
        let equations = self.equations(&free.splines, &free.noise);
        let last = equations.columns.len();
        let solution = equations.with_column(column).solve()?;
        Some(Estimated {
            value: solution.x[last],
            standard_error: solution.covariance.error(last),
        })
    }

    /// The noise of each equation after some rounds of solving with it and estimating it again.
    pub fn reweighted(&self, splines: &[Splines], start: Vec<Vec<f64>>, rounds: usize) -> Option<Vec<Vec<f64>>> {
        (0..rounds).try_fold(start, |noise, _| Some(self.noise_of(&self.solve(splines, &noise)?)))
    }

    /// The noise of each equation, from the residuals.
    pub fn noise_of(&self, solved: &Solved) -> Vec<Vec<f64>> {
        let known = (self.encoder_noise)(&solved.factors());
        let residuals = solved.solution.residuals.iter().zip(&known);
        residuals.map(|(r, known)| fitted_noise(r, known)).collect()
    }

    /// The noise of each equation, from the residuals, corrected for the unknowns that follow the noise.
    pub fn unbiased_noise_of(&self, solved: &Solved) -> Vec<Vec<f64>> {
        let known = (self.encoder_noise)(&solved.factors());
        let powers = solved.equations.powers(&solved.solution);
        powers
            .iter()
            .zip(&known)
            .map(|(p, known)| fitted_to_power(p, known))
            .collect()
    }

    /// The splines that are added to forms in their test.
    pub fn tested(&self) -> Vec<Splines> {
        self.curves.iter().map(|c| c.tested(self.modulation)).collect()
    }

    /// The curves with the divisions that all equations together determine, and the noise of the equations with these.
    ///
    /// The motor's equation has the noise of its torque; the link's has none, and shows far finer detail of the stiffness.
    pub fn refined(&self, mut splines: Vec<Splines>, mut noise: Vec<Vec<f64>>) -> Option<FreeCurves> {
        let mut finer = Vec::new();
        for _ in 0..DIVISION_ROUNDS {
            noise = self.unbiased_noise_of(&self.solve(&splines, &noise)?);
            let divisions = Divisions::new(self);
            let best = divisions.best(&|splines| Some(self.solve(splines, &noise)?.akaike()))?;
            (splines, finer) = (divisions.finer(&best, 1), divisions.finer(&best, 2));
        }
        noise = self.unbiased_noise_of(&self.solve(&splines, &noise)?);
        Some(FreeCurves {
            splines,
            noise,
            finer,
            tested: self.tested(),
        })
    }
}

/// The first spectrum of the search for the noise: low frequencies have the largest weights, since the encoders' noise is small there.
pub(super) fn low_frequencies(modulation: &Modulation, band: f64) -> Vec<f64> {
    let edge = std::f64::consts::PI * band;
    modulation.omega.iter().map(|w| 1.0 + (w / edge).powi(8)).collect()
}
