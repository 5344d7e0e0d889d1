//! A static nonlinearity of several inputs as a block of a model.

use serde::{Deserialize, Serialize};

use super::spline::basis::LocalValues;
use crate::error::{Error, Result};
use crate::nonlinearity::estimator::MOST_COLUMNS;

/// B-splines that are not zero at a point, along one axis.
const OVERLAP: usize = 4;

/// One input's axis: equal pieces between two ends.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SurfaceAxis {
    /// The lower end, in the input's unit.
    pub low: f64,
    /// The upper end, larger.
    pub high: f64,
    /// The number of cubic pieces, at least one.
    pub pieces: usize,
}

impl SurfaceAxis {
    /// The number of B-splines along it.
    pub(crate) fn splines(&self) -> usize {
        self.pieces + OVERLAP - 1
    }

    /// The B-splines that are not zero at `x`, held within the ends.
    fn local(&self, x: f64) -> LocalValues<OVERLAP> {
        let place = ((x - self.low) / (self.high - self.low) * self.pieces as f64).clamp(0.0, self.pieces as f64);
        let first = (place as usize).min(self.pieces - 1);
        let t = place - first as f64;
        let (s, t2) = (1.0 - t, t * t);
        let values = [
            s * s * s / 6.0,
            (3.0 * t2 * t - 6.0 * t2 + 4.0) / 6.0,
            (-3.0 * t2 * t + 3.0 * t2 + 3.0 * t + 1.0) / 6.0,
            t2 * t / 6.0,
        ];
        LocalValues { first, values }
    }
}

/// A function of several variables: a tensor product of cubic B-splines over a box (de Boor 2001, chapter 17).
///
/// Outside the box it has the value of the box's nearest point.
///
/// ```
/// use flexure::nonlinearity::{Surface, SurfaceAxis};
///
/// let axis = SurfaceAxis { low: -1.0, high: 1.0, pieces: 2 };
/// // B-splines add up to one.
/// let flat = Surface::new(vec![axis, axis], vec![3.0; 25])?;
/// assert!((flat.value(&[0.3, -0.9]) - 3.0).abs() < 1e-12);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Table")]
pub struct Surface {
    axes: Vec<SurfaceAxis>,
    coefficients: Vec<f64>,
}

#[derive(Deserialize)]
struct Table {
    axes: Vec<SurfaceAxis>,
    coefficients: Vec<f64>,
}

impl TryFrom<Table> for Surface {
    type Error = Error;
    fn try_from(t: Table) -> Result<Self> {
        Self::new(t.axes, t.coefficients)
    }
}

impl Surface {
    /// A surface over the box of these axes, one to six; the coefficients are those of the products of B-splines, pieces + 3
    /// of them along every axis, the last axis's index running fastest.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an axis without pieces or with ends that are not finite or not in order,
    /// [`Error::Data`]: `TooShort` without axes, `LengthMismatch`, `NonFinite`.
    pub fn new(axes: Vec<SurfaceAxis>, coefficients: Vec<f64>) -> Result<Self> {
        if axes.is_empty() {
            return Err(Error::too_short("a surface", 1, 0));
        }
        let invalid = |name: String, value: f64, requirement: &'static str| Error::parameter(name, value, requirement);
        if axes.len() > MOST_COLUMNS {
            let name = "the number of a surface's axes".to_owned();
            return Err(invalid(name, axes.len() as f64, "at most 6"));
        }
        let mut expected = 1_usize;
        for (i, axis) in axes.iter().enumerate() {
            if axis.pieces == 0 {
                return Err(invalid(format!("the pieces of axis {i}"), 0.0, "at least 1"));
            }
            if !(axis.low.is_finite() && (axis.high - axis.low).is_finite() && axis.high > axis.low) {
                let name = format!("the upper end of axis {i}");
                return Err(invalid(name, axis.high, "finite and above the lower end"));
            }
            expected = expected.saturating_mul(axis.pieces.saturating_add(OVERLAP - 1));
        }
        if coefficients.len() != expected {
            return Err(Error::length("a surface's coefficients", coefficients.len(), expected));
        }
        if let Some(sample) = coefficients.iter().position(|v| !v.is_finite()) {
            return Err(Error::not_finite(
                "a surface's coefficients",
                sample,
                coefficients[sample],
            ));
        }
        Ok(Surface { axes, coefficients })
    }

    /// The axes, one an input.
    pub fn axes(&self) -> &[SurfaceAxis] {
        &self.axes
    }

    /// The number of inputs.
    pub fn inputs(&self) -> usize {
        self.axes.len()
    }

    /// The coefficients, the last axis's index running fastest.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Whether a point lies in the box.
    pub fn covers(&self, x: &[f64]) -> bool {
        (self.axes.iter().zip(x)).all(|(axis, x)| axis.low <= *x && *x <= axis.high)
    }

    /// The value at a point, one coordinate an input; NaN where one is NaN or missing.
    pub fn value(&self, x: &[f64]) -> f64 {
        if x.len() < self.axes.len() || x.iter().any(|x| x.is_nan()) {
            return f64::NAN;
        }
        let mut sum = 0.0;
        products(&self.axes, x, &mut |j, value| sum += value * self.coefficients[j]);
        sum
    }

    /// The values at all samples of signals, one an input.
    pub fn values(&self, signals: &[&[f64]]) -> Vec<f64> {
        let samples = signals.first().map_or(0, |s| s.len());
        let mut at = vec![0.0; signals.len()];
        (0..samples)
            .map(|n| {
                at.iter_mut().zip(signals).for_each(|(x, s)| *x = s[n]);
                self.value(&at)
            })
            .collect()
    }

    /// A surface of one value.
    pub(crate) fn constant(axes: Vec<SurfaceAxis>, value: f64) -> Surface {
        let coefficients = vec![value; axes.iter().map(SurfaceAxis::splines).product()];
        Surface { axes, coefficients }
    }

    /// The surface over the same box with other coefficients; `None` unless there are as many, all finite.
    pub(crate) fn with_coefficients(&self, coefficients: Vec<f64>) -> Option<Surface> {
        Surface::new(self.axes.clone(), coefficients).ok()
    }

    /// The same surface with every value mapped through `gain * y + offset`.
    pub(crate) fn affine(&self, gain: f64, offset: f64) -> Surface {
        Surface {
            axes: self.axes.clone(),
            // B-splines add up to one.
            coefficients: self.coefficients.iter().map(|c| gain * c + offset).collect(),
        }
    }
}

/// Tells the index and the value of every product of B-splines that is not zero at a point.
pub(crate) fn products(axes: &[SurfaceAxis], x: &[f64], visit: &mut impl FnMut(usize, f64)) {
    fn along(axes: &[SurfaceAxis], x: &[f64], index: usize, value: f64, visit: &mut impl FnMut(usize, f64)) {
        let (Some((axis, axes)), Some((x, rest))) = (axes.split_first(), x.split_first()) else {
            return visit(index, value);
        };
        let LocalValues { first, values } = axis.local(*x);
        for (k, v) in values.iter().enumerate() {
            along(axes, rest, index * axis.splines() + first + k, value * v, visit);
        }
    }
    along(axes, x, 0, 1.0, visit);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(low: f64, high: f64, pieces: usize) -> SurfaceAxis {
        SurfaceAxis { low, high, pieces }
    }

    /// Marsden's identity: x is the spline whose coefficients are the Greville abscissas.
    #[test]
    fn products_of_lines_are_reproduced_and_held_outside() {
        let axes = vec![axis(-1.0, 2.0, 3), axis(0.0, 5.0, 4)];
        let greville = |a: &SurfaceAxis, j: usize| a.low + (j as f64 - 1.0) * (a.high - a.low) / a.pieces as f64;
        let c = (0..6).flat_map(|i| (0..7).map(move |j| (i, j)));
        let c = c.map(|(i, j)| greville(&axes[0], i) * greville(&axes[1], j)).collect();
        let surface = Surface::new(axes, c).unwrap();
        for (x, y) in [(-1.0, 0.0), (0.3, 4.9), (2.0, 5.0), (1.999, 0.001)] {
            assert!((surface.value(&[x, y]) - x * y).abs() < 1e-12, "{x} {y}");
        }
        assert!((surface.value(&[7.0, 1.0]) - 2.0).abs() < 1e-12 && !surface.covers(&[7.0, 1.0]));
        assert!(surface.value(&[f64::NAN, 1.0]).is_nan() && surface.value(&[1.0]).is_nan());
        let moved = surface.affine(2.0, -1.0);
        assert!((moved.value(&[0.5, 2.0]) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_surface_is_refused() {
        let text = |axes, c| Surface::new(axes, c).unwrap_err().to_string();
        assert!(text(vec![], vec![]).contains("at least 1"));
        assert!(text(vec![axis(0.0, 1.0, 0)], vec![]).contains("the pieces of axis 0"));
        assert!(text(vec![axis(1.0, 1.0, 2)], vec![0.0; 5]).contains("the upper end of axis 0"));
        assert!(text(vec![axis(0.0, 1.0, 2)], vec![0.0; 4]).contains('5'));
        assert!(text(vec![axis(0.0, 1.0, 1)], vec![f64::NAN; 4]).contains("NaN"));
        assert!(text(vec![axis(0.0, 1.0, usize::MAX); 3], vec![]).contains("coefficients"));
    }
}
