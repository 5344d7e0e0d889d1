//! Estimates at any points, also beyond the data and in empty windows.

use std::ops::Range;

use super::sums::SumsOver;
use super::{Degree, Outside, Product};
use crate::nonlinearity::estimator::Points;
use crate::nonlinearity::neighbours::Tree;
use crate::parallel;

/// Queries of one piece. For fewer, another thread does not pay.
const PIECE: usize = 32;

/// `estimate` at 0, 1, ..., `count` - 1, NaN where there is none. The queries of a piece share the memory for their runs.
fn in_pieces(count: usize, estimate: impl Fn(usize, &mut Vec<Range<usize>>) -> Option<f64> + Sync) -> Vec<f64> {
    let pieces = parallel::map(count.div_ceil(PIECE), |piece| -> Vec<f64> {
        let mut runs = Vec::new();
        let queries = piece * PIECE..count.min((piece + 1) * PIECE);
        queries.map(|i| estimate(i, &mut runs).unwrap_or(f64::NAN)).collect()
    });
    pieces.concat()
}

/// A way to evaluate the fit and its slopes.
struct Fits<'a, const D: usize> {
    product: &'a Product,
    degree: Degree,
    sums: SumsOver<D>,
    planes: SumsOver<D>,
}

impl<const D: usize> Fits<'_, D> {
    /// The estimate at `to`. If `outside` asks for it, the plane at `from` continues the estimate. `None` if there is no estimate at
    /// `from`.
    fn carried(&self, from: [f64; D], to: &[f64; D], outside: Outside, runs: &mut Vec<Range<usize>>) -> Option<f64> {
        let here = self.product.fit_at(self.degree, self.sums, from, runs)?;
        let value = self.product.mean + here.value;
        if outside != Outside::Linear || from == *to {
            return Some(value);
        }
        let slope = match self.degree {
            Degree::Linear => here.slope,
            Degree::Constant => self.product.fit_at(Degree::Linear, self.planes, from, runs)?.slope,
        };
        let h = &self.product.h;
        Some(value + (0..D).map(|j| slope[j] * ((to[j] - from[j]) / h[j])).sum::<f64>())
    }
}

impl Product {
    pub(super) fn estimates<const D: usize>(&self, degree: Degree, x: &[&[f64]], outside: Outside) -> Vec<f64> {
        let fits = Fits::<D> {
            product: self,
            degree,
            sums: SumsOver::new(self.kernel, degree),
            planes: SumsOver::new(self.kernel, Degree::Linear),
        };
        let query = |i: usize| -> [f64; D] { std::array::from_fn(|j| x[j][i]) };
        let known = |q: &[f64; D]| q.iter().all(|q| !q.is_nan());
        let mut estimates = in_pieces(x[0].len(), |i, runs| {
            let q = query(i);
            if !known(&q) {
                return None;
            }
            let from = match outside {
                Outside::Nan => q,
                _ => std::array::from_fn(|j| q[j].clamp(self.ranges[j].0, self.ranges[j].1)),
            };
            fits.carried(from, &q, outside, runs)
        });
        if outside == Outside::Nan {
            return estimates;
        }
        let empty: Vec<usize> = (0..estimates.len())
            .filter(|&i| estimates[i].is_nan() && known(&query(i)))
            .collect();
        if empty.is_empty() {
            return estimates;
        }
        let tree = Tree::with_scales(&self.as_points(), self.h.clone());
        let nearest = in_pieces(empty.len(), |k, runs| {
            let q = query(empty[k]);
            let place = tree.nearest_place(&q);
            let from = std::array::from_fn(|j| place[j]);
            fits.carried(from, &q, outside, runs)
        });
        for (i, value) in empty.into_iter().zip(nearest) {
            estimates[i] = value;
        }
        estimates
    }

    fn as_points(&self) -> Points {
        let points = &self.points;
        Points {
            x: points.x.clone(),
            y: points.y.clone(),
            w: (0..points.y.len()).map(|i| points.weight(i)).collect(),
        }
    }
}
