//! What the solution with free curves says: factors with standard errors, and curves with bands.

use statrs::distribution::{ContinuousCDF, Normal};

use super::basis::Basis;
use super::joint_forms::Comparison;
use super::normal::{Covariance, Part};
use super::outcome::Estimated;
use super::parameters::FreeFit;
use super::system::{FreeCurves, Solved, System};
use crate::bands::{Band, BandKind};

/// Points of a curve.
const POINTS: usize = 201;

/// A solution with free curves, to be read off.
pub(super) struct FreeOutcome<'a> {
    system: &'a System<'a>,
    curves: &'a FreeCurves,
    pub solved: Solved<'a>,
    covariance: Covariance,
    /// What the unknowns take of the sum of squares by chance.
    taken: f64,
    /// The solution with finer curves.
    finer: Solved<'a>,
    /// The level of the bands.
    level: f64,
}

impl<'a> FreeOutcome<'a> {
    /// `None` if the equations do not determine their unknowns.
    pub fn new(system: &'a System<'a>, curves: &'a FreeCurves, level: f64) -> Option<Self> {
        let solved = system.solve(&curves.splines, &curves.noise)?;
        let robust = solved.equations.robust(&solved.solution);
        Some(FreeOutcome {
            finer: system.solve(&curves.finer, &curves.noise)?,
            covariance: robust.covariance,
            taken: robust.taken,
            solved,
            system,
            curves,
            level,
        })
    }

    /// A sum of factors of the equations, each times its own factor.
    pub fn sum(&self, parts: &[Part]) -> Estimated {
        let unknown = |part: &Part| Part {
            unknown: self.solved.layout.factors[part.unknown],
            ..*part
        };
        let parts: Vec<Part> = parts.iter().map(unknown).collect();
        Estimated {
            value: parts.iter().map(|p| p.factor * self.solved.solution.x[p.unknown]).sum(),
            standard_error: self.covariance.error_of_sum(&parts),
        }
    }

    /// A factor.
    pub fn factor(&self, factor: usize) -> Estimated {
        self.sum(&[Part {
            unknown: factor,
            factor: 1.0,
        }])
    }

    /// The splines' sum with its band: of a stiffness curve the stiffness, of a friction curve the torque.
    pub fn band(&self, curve: usize) -> Band {
        let first = self.solved.layout.curves[curve].start;
        let basis = &self.curves.splines[curve].basis;
        let covariance = |i: usize, j: usize| self.covariance.at(first + i, first + j);
        let band = band(basis, self.solved.coefficients(curve), self.level, covariance);
        let finer = &self.curves.finer[curve].basis;
        widened(band, &|x| finer.value(self.finer.coefficients(curve), x))
    }

    /// The torque of a curve at every sample.
    fn values(&self, curve: usize) -> Vec<f64> {
        let (own, basis) = (&self.system.curves[curve], &self.curves.splines[curve].basis);
        let coefficients = self.solved.coefficients(curve);
        own.x.iter().map(|&x| own.value(basis, coefficients, x)).collect()
    }

    /// What forms are fitted beside and compared with.
    pub fn comparison(&self) -> Comparison<'a> {
        Comparison {
            system: self.system,
            curves: self.curves,
            fit: FreeFit::new(&self.solved, self.taken),
            values: (0..self.system.curves.len()).map(|curve| self.values(curve)).collect(),
        }
    }
}

/// The band with what a finer curve would change added to its standard errors, an allowance for bias.
fn widened(mut band: Band, finer: &dyn Fn(f64) -> f64) -> Band {
    for i in 0..band.estimate.len() {
        let error = band.standard_error[i];
        let bias = finer(band.x[0][i]) - band.estimate[i];
        let grow = (1.0 + (bias / error.max(f64::MIN_POSITIVE)).powi(2)).sqrt();
        band.standard_error[i] *= grow;
        band.lower[i] = band.estimate[i] + grow * (band.lower[i] - band.estimate[i]);
        band.upper[i] = band.estimate[i] + grow * (band.upper[i] - band.estimate[i]);
    }
    band.method
        .push_str("; widened by what the next finer curve would change");
    band
}

/// A free curve with its pointwise band.
fn band(basis: &Basis, coefficients: &[f64], level: f64, covariance: impl Fn(usize, usize) -> f64 + Copy) -> Band {
    let x = basis.grid(POINTS);
    let estimate: Vec<f64> = x.iter().map(|&x| basis.value(coefficients, x)).collect();
    let standard_error: Vec<f64> = x.iter().map(|&x| basis.variance(covariance, x).sqrt()).collect();
    let factor = Normal::standard().inverse_cdf(0.5 + 0.5 * level);
    let edge = |sign: f64| -> Vec<f64> {
        let both = estimate.iter().zip(&standard_error);
        both.map(|(y, e)| y + sign * factor * e).collect()
    };
    Band {
        lower: edge(-1.0),
        upper: edge(1.0),
        centre: estimate.clone(),
        estimate,
        standard_error,
        level,
        kind: BandKind::Pointwise,
        method: "regression splines, errors of any spectrum".to_owned(),
        x: vec![x],
    }
}

/// The torque k(d) d with its band, from k(d).
pub(super) fn torque_band(secant: &Band) -> Band {
    let times = |values: &[f64]| -> Vec<f64> { values.iter().zip(&secant.x[0]).map(|(v, d)| v * d).collect() };
    let (lower, upper) = (times(&secant.lower), times(&secant.upper));
    let pick = |choose: fn(f64, f64) -> f64| lower.iter().zip(&upper).map(|(a, b)| choose(*a, *b)).collect();
    Band {
        estimate: times(&secant.estimate),
        centre: times(&secant.centre),
        standard_error: times(&secant.standard_error).iter().map(|e| e.abs()).collect(),
        lower: pick(f64::min),
        upper: pick(f64::max),
        ..secant.clone()
    }
}
