//! Columns that are another one's derivative, or another one times a factor.

use super::limits::{DERIVATIVE_FACTOR, DERIVATIVE_LEFT, ROUNDING, SAME};
use crate::linear::correlation::{about_mean, mean, variance};
use crate::vectors::dot;

/// A column that is computed from another one, or measures the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColumnRelation {
    /// The column, as an index of the record's columns.
    pub column: usize,
    /// The other one.
    pub of: usize,
    /// The relation to the other one.
    pub relation: Relation,
}

/// The relation of a column to another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Relation {
    /// Its derivative, times a factor; the factor is 1 if the units agree.
    Derivative {
        /// The factor.
        factor: f64,
    },
    /// The other one times a factor, with an offset.
    Multiple {
        /// The factor.
        factor: f64,
        /// The standard deviation of the remainder, relative to the column's.
        left: f64,
    },
}

/// The relations among signals without missing samples, named by their indexes.
///
/// A derivative is recognised by its integral: apart from a straight line, it differs from the other column by at most a hundredth of that
/// one's variance. (Differences would be noise.) Without a sample time the factor is unknown, and the integral must leave at most a
/// hundredth of the limit.
pub(super) fn relations(signals: &[(usize, &[f64])], sample_time: Option<f64>) -> Vec<ColumnRelation> {
    let straight: Vec<Vec<f64>> = signals.iter().map(|s| without_line(s.1)).collect();
    let integrals: Vec<Vec<f64>> = signals
        .iter()
        .map(|s| without_line(&integral(s.1, sample_time)))
        .collect();
    let centred: Vec<Vec<f64>> = signals.iter().map(|s| about_mean(s.1)).collect();
    let mut found = Vec::new();
    for (i, &(column, _)) in signals.iter().enumerate() {
        // If several columns are similar, a derivative belongs to the one that is nearest to its integral.
        let mut nearest: Option<(f64, ColumnRelation)> = None;
        for (j, &(of, _)) in signals.iter().enumerate().filter(|(j, _)| *j != i) {
            if let Some(Proportion { factor, left }) = proportion(&centred[j], &centred[i])
                && left < SAME
                && j < i
            {
                let left = left.max(0.0).sqrt();
                let relation = Relation::Multiple { factor, left };
                found.push(ColumnRelation { column, of, relation });
            }
            // The integral of the column, times the inverse of the factor, is the other one.
            let Some(Proportion { factor: inverse, left }) = proportion(&integrals[i], &straight[j]) else {
                continue;
            };
            let derives = match sample_time {
                Some(_) => left < DERIVATIVE_LEFT && (inverse - 1.0).abs() < DERIVATIVE_FACTOR,
                None => left < DERIVATIVE_LEFT * DERIVATIVE_LEFT && inverse > 0.0,
            };
            if derives && nearest.is_none_or(|(least, _)| left < least) {
                let relation = Relation::Derivative { factor: 1.0 / inverse };
                nearest = Some((left, ColumnRelation { column, of, relation }));
            }
        }
        found.extend(nearest.map(|(_, relations)| relations));
    }
    found
}

/// A column in terms of another one, by least squares.
struct Proportion {
    factor: f64,
    /// The share of the variance that remains.
    left: f64,
}

/// `y` in terms of `x`; `None` if either does not vary.
fn proportion(x: &[f64], y: &[f64]) -> Option<Proportion> {
    let (xx, xy, yy) = (dot(x, x), dot(x, y), dot(y, y));
    (xx > 0.0 && yy > 0.0).then(|| Proportion {
        factor: xy / xx,
        left: 1.0 - xy * xy / (xx * yy),
    })
}

/// The integral by the trapezoidal rule; in samples if there is no sample time.
fn integral(samples: &[f64], sample_time: Option<f64>) -> Vec<f64> {
    let step = sample_time.unwrap_or(1.0);
    let centre = mean(samples);
    let mut sum = 0.0;
    let mut before = samples.first().map_or(0.0, |v| v - centre);
    let add = |v: &f64| {
        sum += 0.5 * step * (before + v - centre);
        before = v - centre;
        sum
    };
    samples.iter().map(add).collect()
}

/// The samples minus the straight line through them (least squares); zeros if only rounding is left.
fn without_line(samples: &[f64]) -> Vec<f64> {
    let centred = about_mean(samples);
    let middle = (samples.len() as f64 - 1.0) / 2.0;
    let time: Vec<f64> = (0..samples.len()).map(|i| i as f64 - middle).collect();
    let slope = proportion(&time, &centred).map_or(0.0, |p| p.factor);
    let left: Vec<f64> = centred.iter().zip(&time).map(|(v, t)| v - slope * t).collect();
    match variance(&left) > ROUNDING * variance(&centred) {
        true => left,
        false => vec![0.0; left.len()],
    }
}
