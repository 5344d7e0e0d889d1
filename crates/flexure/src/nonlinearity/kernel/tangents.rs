//! How far the data in bins are from the tangents of an estimate at the bins.

use super::Sorted;

/// Bins, and what of their tangents is the same for all estimates.
pub struct Tangents<'a> {
    /// The bins' means, weighted by their counts.
    data: &'a Sorted,
    /// Sums of products of the deviations from these, xx, xy, yy.
    products: &'a [[f64; 3]],
    /// The largest distance between neighbours.
    widest: f64,
    /// For each bin but the first and the last 1 over the distance between its neighbours; zero where these are at one
    /// place.
    per_run: Vec<f64>,
}

impl<'a> Tangents<'a> {
    pub fn new(data: &'a Sorted, products: &'a [[f64; 3]]) -> Self {
        let per_run = |(below, above): (&f64, &f64)| if above > below { 1.0 / (above - below) } else { 0.0 };
        Tangents {
            data,
            products,
            widest: data.x.windows(2).fold(0.0, |widest: f64, x| widest.max(x[1] - x[0])),
            per_run: data.x.iter().zip(data.x.iter().skip(2)).map(per_run).collect(),
        }
    }

    /// The sum of the data's squared distances from an estimate's tangents at their bins. `fits` holds the estimate
    /// and a factor on the distances for each bin. A slope is that between the neighbours within `reach`.
    pub fn squares(&self, fits: &[[f64; 2]], reach: f64) -> f64 {
        let last = fits.len() - 1;
        let counts = match self.data.weights() {
            Some(counts) if last > 1 && self.widest <= reach => &counts[1..last],
            _ => return (0..=last).map(|b| self.square(fits, b, reach)).sum(),
        };
        // Most often all are within reach: without a division, nor a look for each whether it is in the list.
        let (y, products) = (&self.data.y[1..last], &self.products[1..last]);
        let fitted = fits.iter().zip(&fits[1..]).zip(&fits[2..]).zip(&self.per_run);
        let inner: f64 = (fitted.zip(y.iter().zip(counts).zip(products)))
            .map(|((((below, fit), above), per_run), ((y, count), products))| {
                square((*y, *count), *products, *fit, (above[0] - below[0]) * per_run)
            })
            .sum();
        inner + self.square(fits, 0, reach) + self.square(fits, last, reach)
    }

    /// The squared distance of one bin's data.
    fn square(&self, fits: &[[f64; 2]], b: usize, reach: f64) -> f64 {
        let (x, count) = (&self.data.x, fits.len());
        let below = b - usize::from(b > 0 && x[b] - x[b - 1] <= reach);
        let above = b + usize::from(b + 1 < count && x[b + 1] - x[b] <= reach);
        let run = x[above] - x[below];
        let slope = if run > 0.0 {
            (fits[above][0] - fits[below][0]) / run
        } else {
            0.0
        };
        square((self.data.y[b], self.data.weight(b)), self.products[b], fits[b], slope)
    }
}

/// The squared distance of a bin's data, of the mean y, from the line of this slope through the estimate.
#[inline(always)]
fn square((y, count): (f64, f64), [xx, xy, yy]: [f64; 3], [fit, factor]: [f64; 2], slope: f64) -> f64 {
    let residual = y - fit;
    factor * factor * (yy + count * residual * residual + slope * (slope * xx - 2.0 * xy))
}
