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

    /// The B-splines that are not zero at `x`. An `x` beyond an end counts as that end.
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
    /// A surface over the box of these axes, one to six. The coefficients are those of the products of B-splines: pieces + 3 along every
    /// axis, and the last axis's index runs fastest.
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

    /// The surface through values on a grid, where the last axis's index runs fastest. It consists of cubic splines. Their second
    /// derivatives at the ends come from the four values there, so that cubics are reproduced. An axis has a point at either end of every
    /// piece.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an axis of fewer than three pieces; those of [`Surface::new`].
    pub fn through(axes: Vec<SurfaceAxis>, values: &[f64]) -> Result<Self> {
        for (i, axis) in axes.iter().enumerate() {
            if axis.pieces < 3 {
                let name = format!("the pieces of axis {i}");
                return Err(Error::parameter(name, axis.pieces as f64, "at least 3"));
            }
        }
        let points = |axis: &SurfaceAxis| axis.pieces.saturating_add(1);
        let expected = axes.iter().map(points).fold(1, usize::saturating_mul);
        if values.len() != expected {
            return Err(Error::length("a surface's values", values.len(), expected));
        }
        let mut all = values.to_vec();
        let mut within = expected;
        for axis in &axes {
            let (points, splines) = (points(axis), axis.splines());
            within /= points;
            let mut next = vec![0.0; all.len() / points * splines];
            for line in 0..all.len() / points {
                let (outer, inner) = (line / within, line % within);
                let along: Vec<f64> = (0..points)
                    .map(|i| all[(outer * points + i) * within + inner])
                    .collect();
                for (i, c) in interpolating(&along).into_iter().enumerate() {
                    next[(outer * splines + i) * within + inner] = c;
                }
            }
            all = next;
        }
        Surface::new(axes, all)
    }

    /// The axes, one per input.
    pub fn axes(&self) -> &[SurfaceAxis] {
        &self.axes
    }

    /// The number of inputs.
    pub fn inputs(&self) -> usize {
        self.axes.len()
    }

    /// The coefficients; the last axis's index runs fastest.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Whether a point lies in the box.
    pub fn covers(&self, x: &[f64]) -> bool {
        (self.axes.iter().zip(x)).all(|(axis, x)| axis.low <= *x && *x <= axis.high)
    }

    /// The value at a point with one coordinate for each input. NaN if one is NaN or missing.
    pub fn value(&self, x: &[f64]) -> f64 {
        if x.len() < self.axes.len() || x.iter().any(|x| x.is_nan()) {
            return f64::NAN;
        }
        let mut sum = 0.0;
        products(&self.axes, x, &mut |j, value| sum += value * self.coefficients[j]);
        sum
    }

    /// The values at all samples of the signals, one signal for each input.
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

    /// The surface over the same box with other coefficients. `None` if their number differs or one is not finite.
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

/// The coefficients of the cubic spline through four values or more at equal distances.
fn interpolating(f: &[f64]) -> Vec<f64> {
    let n = f.len();
    // The second derivatives at the ends, times the squared distance.
    let bend = |i: [usize; 4]| 2.0 * f[i[0]] - 5.0 * f[i[1]] + 4.0 * f[i[2]] - f[i[3]];
    let ends = [bend([0, 1, 2, 3]), bend([n - 1, n - 2, n - 3, n - 4])];
    let mut c = vec![0.0; n + 2];
    // c[i] + 4 c[i + 1] + c[i + 2] = 6 f[i], eliminated from the first to the last.
    let mut ratio = vec![0.0; n];
    c[1] = f[0] - ends[0] / 6.0;
    c[n] = f[n - 1] - ends[1] / 6.0;
    for i in 1..n - 1 {
        ratio[i] = 1.0 / (4.0 - ratio[i - 1]);
        c[i + 1] = ratio[i] * (6.0 * f[i] - c[i]);
    }
    for i in (1..n - 1).rev() {
        c[i + 1] -= ratio[i] * c[i + 2];
    }
    c[0] = ends[0] + 2.0 * c[1] - c[2];
    c[n + 1] = ends[1] + 2.0 * c[n] - c[n - 1];
    c
}

/// Passes to `visit` the index and the value of every product of B-splines that is not zero at a point.
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
    fn a_surface_through_a_grid_is_exact_for_cubics_and_of_order_four_for_others() {
        let largest = |axes: &[SurfaceAxis; 2], f: &dyn Fn(f64, f64) -> f64| {
            let at = |a: &SurfaceAxis, i: usize| a.low + (a.high - a.low) * i as f64 / a.pieces as f64;
            let points = (0..=axes[0].pieces).flat_map(|i| (0..=axes[1].pieces).map(move |j| (i, j)));
            let values: Vec<f64> = points.map(|(i, j)| f(at(&axes[0], i), at(&axes[1], j))).collect();
            let surface = Surface::through(axes.to_vec(), &values).unwrap();
            let places = (0..1000)
                .map(|k| (f64::from(k) * 0.618).fract())
                .zip((0..1000).map(|k| (f64::from(k) * 0.755).fract()));
            let apart = places.map(|(s, t)| {
                let x = axes[0].low + s * (axes[0].high - axes[0].low);
                let y = axes[1].low + t * (axes[1].high - axes[1].low);
                (surface.value(&[x, y]) - f(x, y)).abs()
            });
            apart.fold(0.0, f64::max)
        };
        let cubic = |x: f64, y: f64| (1.0 + x - 2.0 * x.powi(3)) * (y.powi(2) - 0.5 * y.powi(3));
        assert!(largest(&[axis(-1.0, 2.0, 3), axis(0.0, 1.0, 7)], &cubic) < 1e-12);
        let wave = |x: f64, y: f64| (2.0 * x).sin() * (1.0 + 3.0 * y).cos();
        let [coarse, fine] = [20, 40].map(|n| largest(&[axis(-1.0, 1.0, n), axis(0.0, 1.0, n)], &wave));
        assert!(coarse < 1e-4 && coarse / fine > 12.0, "{coarse:e} {fine:e}");
        let text = Surface::through(vec![axis(0.0, 1.0, 2)], &[0.0; 3])
            .unwrap_err()
            .to_string();
        assert!(text.contains("at least 3"), "{text}");
        assert!(Surface::through(vec![axis(0.0, 1.0, 3)], &[0.0; 3]).is_err());
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
