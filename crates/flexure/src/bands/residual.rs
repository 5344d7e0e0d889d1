//! Squared residuals that are unbiased for the noise variance if it is constant around a point.
//!
//! Local quadratic fits at knots a fraction of a bandwidth apart, blended linearly in between, are a separate linear smoother with known
//! weights: O(1) windows per bandwidth for any n. With its weights l_ij,
//! $$ E\,(Y_i - \hat m(X_i))^2 = \sigma^2 (1 - 2 l_{ii} + \textstyle\sum_j l_{ij}^2) , $$
//! and every squared residual is divided by the factor of sigma^2 (the correction HC2 if l is a projection).

use super::local::{LocalPolynomial, Window, dot};
use crate::nonlinearity::Kernel;
use crate::parallel;

/// Knots in a bandwidth.
const KNOTS: f64 = 4.0;
/// The same for the Gaussian kernel, whose bandwidth is its standard deviation.
const GAUSSIAN_KNOTS: f64 = 2.0;
/// A residual with less than this share of the noise shows nothing about the noise.
const NOTHING_LEFT: f64 = 1e-3;

/// A local fit and the sums of its squared weights.
struct Knot {
    fit: LocalPolynomial,
    squares: [[f64; 3]; 3],
}

/// The part of the fit at a knot in the value at some point.
struct Share {
    value: f64,
    /// The weight of an ordinate at that point.
    leverage: f64,
    /// The root of the sum of all squared weights.
    norm: f64,
}

impl Knot {
    fn new(window: Window<'_>, q: f64) -> Option<Knot> {
        let mut weights = Vec::new();
        let fit = LocalPolynomial::new(window, 2, q, &mut weights)?;
        let squares = fit.squared_weights(window.data, &weights);
        Some(Knot { fit, squares })
    }

    fn share(&self, window: Window<'_>, q: f64, i: usize) -> Share {
        let x = window.data.x[i];
        let (basis, dual) = (self.fit.basis(x), self.fit.dual(x));
        Share {
            value: self.fit.value(x),
            leverage: window.weight(i, q) * dot(basis, dual),
            norm: dot(dual, self.squares.map(|row| dot(row, dual))).max(0.0).sqrt(),
        }
    }
}

/// An estimate of the noise variance at every point; only averages of these are meaningful. NaN for all if no residual shows anything about
/// the noise.
pub(super) fn noise_variances(window: Window<'_>) -> Vec<f64> {
    let data = window.data;
    let places = knots(&data.x, window);
    let knots: Vec<Option<Knot>> = parallel::batch(&places, |&q| Knot::new(window, q));
    let mut right = 0;
    let squares: Vec<Option<f64>> = (0..data.len())
        .map(|i| {
            // The knots on either side: places[left] <= x, and the next knot is beyond x.
            while right < places.len() && places[right] <= data.x[i] {
                right += 1;
            }
            let left = right.checked_sub(1)?;
            let share = |k: usize| Some(knots.get(k)?.as_ref()?.share(window, places[k], i));
            let mut here = share(left)?;
            if data.x[i] > places[left] {
                let next = share(right)?;
                let t = (data.x[i] - places[left]) / (places[right] - places[left]);
                let blend = |a: f64, b: f64| a + t * (b - a);
                here = Share {
                    value: blend(here.value, next.value),
                    leverage: blend(here.leverage, next.leverage),
                    norm: blend(here.norm, next.norm),
                };
            }
            let rest = 1.0 - 2.0 * here.leverage + here.norm * here.norm;
            let residual = data.y[i] - here.value;
            (rest > NOTHING_LEFT).then(|| residual * residual / rest)
        })
        .collect();
    // A lone point shows nothing about the noise: its variance is the mean of the others.
    let known: Vec<f64> = squares.iter().copied().flatten().collect();
    let typical = known.iter().sum::<f64>() / known.len() as f64;
    squares.into_iter().map(|s| s.unwrap_or(typical)).collect()
}

/// Abscissas of the data, from the first to the last, as far apart as possible but at most the spacing, unless there are no data in
/// between.
fn knots(x: &[f64], window: Window<'_>) -> Vec<f64> {
    let per_bandwidth = if window.kernel == Kernel::Gaussian {
        GAUSSIAN_KNOTS
    } else {
        KNOTS
    };
    let spacing = window.h / per_bandwidth;
    let mut places = vec![x[0]];
    let (mut last, mut i) = (x[0], 0);
    loop {
        let within = i + x[i..].partition_point(|&x| x - last <= spacing);
        let beyond = i + x[i..].partition_point(|&x| x <= last);
        i = if within > beyond { within - 1 } else { beyond };
        let Some(&next) = x.get(i) else { return places };
        places.push(next);
        last = next;
    }
}
