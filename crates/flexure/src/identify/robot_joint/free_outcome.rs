//! The results of the solution with free curves: factors with standard errors, and curves with bands.

use super::basis::Basis;
use super::candidates::without_unseen_rise;
use super::limits::{CURVE_POINTS, HARDLY_DETERMINED, LESS_DETERMINED};
use super::normal::{Covariance, Part};
use super::outcome::{Estimated, Fitted, IdentifiedCurve};
use super::system::{FreeCurves, Solved, System};
use crate::bands::{Band, BandKind};
use crate::distributions::normal_quantile;
use crate::sort::median;

/// A solution with free curves, from which results are read.
pub(super) struct FreeOutcome<'a> {
    pub system: &'a System<'a>,
    pub curves: &'a FreeCurves,
    pub solved: Solved<'a>,
    /// The torque of each curve at every sample.
    pub values: Vec<Vec<f64>>,
    covariance: Covariance,
    /// The decrease of the sum of squares by the unknowns due to chance.
    pub taken: f64,
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
        let values = system
            .curves
            .iter()
            .zip(&curves.splines)
            .enumerate()
            .map(|(i, (curve, splines))| {
                let value = |&x: &f64| curve.value(&splines.basis, solved.coefficients(i), x);
                curve.x.iter().map(value).collect()
            });
        Some(FreeOutcome {
            finer: system.solve(&curves.finer, &curves.noise)?,
            values: values.collect(),
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

    /// The root mean square of a form less the curve over the data, as a share of the curve's own. Where the data determine the curve far less
    /// well than elsewhere, and hardly, as near zero velocity on an axis that rests, nothing is compared.
    pub fn distance(&self, curve: usize, form: impl Fn(f64) -> f64) -> f64 {
        let (abscissa, values) = (&self.system.curves[curve], &self.values[curve]);
        let first = self.solved.layout.curves[curve].start;
        let basis = &self.curves.splines[curve].basis;
        let covariance = |i: usize, j: usize| self.covariance.at(first + i, first + j);
        let error = |x: &f64| abscissa.torque(*x, basis.variance(covariance, *x).sqrt()).abs();
        let errors: Vec<f64> = abscissa.x.iter().map(error).collect();
        let size = (values.iter().map(|y| y * y).sum::<f64>() / values.len().max(1) as f64).sqrt();
        let limit = (LESS_DETERMINED * median(errors.clone())).max(HARDLY_DETERMINED * size);
        let data = abscissa.x.iter().zip(values).zip(&errors);
        let determined = data.filter(|(_, error)| **error <= limit);
        let (off, size) = determined.fold((0.0, 0.0), |(off, size), ((&x, &y), _)| {
            (off + (form(x) - y).powi(2), size + y * y)
        });
        (off / size.max(f64::MIN_POSITIVE)).sqrt()
    }

    /// The splines' sum with its band: the stiffness for a stiffness curve, the torque for a friction curve.
    pub fn band(&self, curve: usize) -> Band {
        let first = self.solved.layout.curves[curve].start;
        let basis = &self.curves.splines[curve].basis;
        let covariance = |i: usize, j: usize| self.covariance.at(first + i, first + j);
        let band = band(basis, self.solved.coefficients(curve), self.level, covariance);
        let finer = &self.curves.finer[curve].basis;
        widened(band, &|x| finer.value(self.finer.coefficients(curve), x))
    }

    /// A curve with this band and these forms, and the torque that the other terms leave for it at every sample; `None` without a form.
    pub fn identified(
        &self,
        curve: usize,
        band: Band,
        forms: Vec<Fitted>,
        partial: Vec<f64>,
    ) -> Option<IdentifiedCurve> {
        let forms = without_unseen_rise(forms);
        Some(IdentifiedCurve {
            band,
            best: (0..forms.len()).min_by(|&a, &b| forms[a].bic.total_cmp(&forms[b].bic))?,
            forms,
            x: self.system.curves[curve].x.to_vec(),
            partial,
        })
    }

    /// The highest frequency of the equations, Hz.
    pub fn highest(&self) -> f64 {
        let omega = &self.system.modulation.omega;
        omega[omega.len() - 1] / (2.0 * std::f64::consts::PI)
    }
}

/// The band with larger standard errors: the change by a finer curve is added, as an allowance for bias.
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
    let x = basis.grid(CURVE_POINTS);
    let estimate: Vec<f64> = x.iter().map(|&x| basis.value(coefficients, x)).collect();
    let standard_error: Vec<f64> = x.iter().map(|&x| basis.variance(covariance, x).sqrt()).collect();
    let factor = normal_quantile(0.5 + 0.5 * level);
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
