//! The contribution of the encoders' noise to the inner products of noisy columns.
//!
//! To first order an angle off by e makes an acceleration off by $-\omega^2 e$, and a function f of the deflection off by
//! $f'(d)\,e$. Least squares treat this as signal: estimated inertias are too small, and if two columns have the noise of the same encoder,
//! one factor is too large and the other too small. The mean of the noise's contribution is known, and is subtracted from the products
//! (errors in variables; Fuller 1987).

use super::fourier::Modulation;
use super::limits::{MOSTLY_NOISE, NOISE_HALVINGS};
use super::normal::{ridged, scaled, scales};
use crate::linalg::Matrix;
use crate::nonlinearity::spline::basis::LocalValues;

/// The contribution of noise to the product of two columns, or to the square of one, in one block of equations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noisy<'a> {
    /// The columns' numbers; the same number twice for a square.
    pub columns: [usize; 2],
    /// The block.
    pub block: usize,
    /// The mean of each line, without the factor.
    pub spectrum: &'a [f64],
    /// The factor.
    pub factor: f64,
}

impl<'a> Noisy<'a> {
    /// The square of a column in a block.
    pub fn square(column: usize, block: usize, spectrum: &'a [f64]) -> Self {
        Noisy {
            columns: [column; 2],
            block,
            spectrum,
            factor: 1.0,
        }
    }
}

/// The product of the noise of a curve's abscissa with itself, or with that of a column with an unknown factor, in one block of equations.
/// The curve has the sign +1 there.
#[derive(Debug, Clone, Copy)]
pub(super) struct AbscissaNoise<'a> {
    /// The number of the factor; `None` for the square of the abscissa's own noise.
    pub factor: Option<usize>,
    pub block: usize,
    pub spectrum: &'a [f64],
    /// The covariance of both noises, without the spectrum.
    pub covariance: f64,
}

/// The mean product of the slopes of two functions.
#[derive(Debug, Clone, Copy)]
struct SlopeProduct {
    /// The functions' numbers, the first no larger.
    functions: [usize; 2],
    mean: f64,
}

/// The slopes of functions of an abscissa: their means over the record, and those of their products.
#[derive(Debug, Clone)]
pub(super) struct Slopes {
    mean: Vec<f64>,
    products: Vec<SlopeProduct>,
}

impl Slopes {
    /// The slopes of functions. At a sample only few are not zero: `at(i)` has those at sample i.
    pub fn new<const N: usize>(
        modulation: &Modulation,
        functions: usize,
        at: impl Fn(usize) -> LocalValues<N>,
    ) -> Slopes {
        let mut mean = vec![0.0; functions];
        let mut products = vec![[0.0; N]; functions];
        for (i, weight) in modulation.shares().enumerate() {
            let LocalValues { first, values: slopes } = at(i);
            for (a, &slope) in slopes.iter().enumerate().filter(|(_, s)| **s != 0.0) {
                mean[first + a] += weight * slope;
                for (b, &other) in slopes[a..].iter().enumerate() {
                    products[first + a][b] += weight * slope * other;
                }
            }
        }
        let products = products.iter().enumerate().flat_map(|(i, row)| {
            let row = row.iter().enumerate().filter(|(_, v)| **v != 0.0);
            row.map(move |(k, &mean)| SlopeProduct {
                functions: [i, i + k],
                mean,
            })
        });
        Slopes {
            products: products.collect(),
            mean,
        }
    }

    /// The slopes of functions that all have a slope at every sample: `slopes[k][i]` is that of the k-th at sample i.
    pub fn of_all(modulation: &Modulation, slopes: &[Vec<f64>]) -> Slopes {
        let mean_of = |f: &dyn Fn(usize) -> f64| modulation.shares().enumerate().map(|(i, w)| w * f(i)).sum();
        let pairs = (0..slopes.len()).flat_map(|a| (a..slopes.len()).map(move |b| (a, b)));
        Slopes {
            mean: slopes.iter().map(|s| mean_of(&|i| s[i])).collect(),
            products: pairs
                .map(|(a, b)| SlopeProduct {
                    functions: [a, b],
                    mean: mean_of(&|i| slopes[a][i] * slopes[b][i]),
                })
                .collect(),
        }
    }
}

impl<'a> AbscissaNoise<'a> {
    /// The contributions of the noise to the products of functions of the abscissa with these slopes. `column` is the column of a function;
    /// the columns of the factors come first.
    pub fn noisy(&self, slopes: &Slopes, column: impl Fn(usize) -> usize) -> Vec<Noisy<'a>> {
        let noisy = |columns, slope| Noisy {
            columns,
            block: self.block,
            spectrum: self.spectrum,
            factor: self.covariance * slope,
        };
        match self.factor {
            None => {
                let products = slopes.products.iter();
                products.map(|p| noisy(p.functions.map(&column), p.mean)).collect()
            }
            Some(factor) => {
                let means = slopes.mean.iter().enumerate();
                means.map(|(k, mean)| noisy([factor, column(k)], *mean)).collect()
            }
        }
    }
}

/// The contribution of noise to the product of two columns, summed over the lines of a block.
#[derive(Debug, Clone, Copy)]
pub(super) struct Excess {
    pub columns: [usize; 2],
    pub sum: f64,
}

/// The contributions of noise to the inner products of columns, with these weights of each line of each block.
pub(super) fn excess(noisy: &[Noisy], weights: &[Vec<f64>]) -> Vec<Excess> {
    let sum = |entry: &Noisy| {
        let lines = weights[entry.block].iter().zip(entry.spectrum);
        Excess {
            columns: entry.columns,
            sum: entry.factor * lines.map(|(w, e)| w * e).sum::<f64>(),
        }
    };
    noisy.iter().map(sum).collect()
}

/// Subtracts the noise's part from the inner products of the columns.
pub(super) fn less(mut products: Matrix, excess: &[Excess]) -> Matrix {
    for &Excess { columns: [i, j], sum } in excess {
        products[(i, j)] -= sum;
        if i != j {
            products[(j, i)] -= sum;
        }
    }
    products
}

/// The noise's part in the square of the columns' sum with these factors.
pub(super) fn square(excess: &[Excess], x: &[f64]) -> f64 {
    let part = |Excess { columns: [i, j], sum }: &Excess| {
        let both = if i == j { 1.0 } else { 2.0 };
        both * sum * x[*i] * x[*j]
    };
    excess.iter().map(part).sum()
}

/// The share of the excess that can be subtracted from the products of columns: all of it, unless more than half of the square of a
/// sum of columns would then be subtracted.
pub(super) fn share_of(products: &Matrix, excess: &[Excess]) -> f64 {
    let scale = scales(products);
    let inside = excess.iter().filter(|e| e.columns.iter().all(|c| *c < scale.len()));
    let excess: Vec<Excess> = inside.copied().collect();
    let mut share = 1.0;
    for _ in 0..NOISE_HALVINGS {
        let of_scaled = excess.iter().map(|&Excess { columns: [i, j], sum }| Excess {
            columns: [i, j],
            sum: share / MOSTLY_NOISE * (sum / (scale[i] * scale[j])),
        });
        let remainder = less(scaled(products, &scale), &of_scaled.collect::<Vec<_>>());
        if ridged(remainder).cholesky().is_some() {
            break;
        }
        share *= 0.5;
    }
    share
}

#[cfg(test)]
#[path = "column_noise_tests.rs"]
mod tests;
