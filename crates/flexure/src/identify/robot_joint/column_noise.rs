//! What the encoders' noise adds to the inner products of noisy columns.
//!
//! To first order an angle off by e makes an acceleration off by $-\omega^2 e$, and a function f of the deflection off by
//! $f'(d)\,e$. Least squares take that for signal: inertias come out too small, and where two columns have the noise of the same
//! encoder, one comes out at the other's cost. The mean of it is known, and is taken off the products again (errors in variables;
//! Fuller 1987).

use super::equations::{RIDGE, scales};
use super::fourier::Modulation;
use crate::linalg;

/// The largest share of the square of any sum of columns that may be noise.
const MOSTLY_NOISE: f64 = 0.5;
/// How often the part that is taken off is halved at most, where it would be more.
const HALVINGS: usize = 12;

/// What noise adds to the product of two columns, or to the square of one, in one block of equations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noisy<'a> {
    /// The columns' numbers; the same one twice for its square.
    pub columns: [usize; 2],
    /// The block.
    pub block: usize,
    /// The mean of each line, but for the factor.
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

/// The noise of a curve's abscissa in one block of equations, in which the curve has the sign +1.
#[derive(Debug, Clone, Copy)]
pub(super) struct OwnNoise<'a> {
    pub block: usize,
    pub spectrum: &'a [f64],
    pub variance: f64,
}

/// The product of an abscissa's noise with that of a column with an unknown factor.
#[derive(Debug, Clone, Copy)]
pub(super) struct SharedNoise<'a> {
    /// The number of the factor among all factors.
    pub factor: usize,
    pub block: usize,
    pub spectrum: &'a [f64],
    /// The covariance of both noises, but for the spectrum.
    pub covariance: f64,
}

/// How the noise of a curve's abscissa meets itself and that of other columns; empty where it does not count.
#[derive(Debug, Clone, Default)]
pub(super) struct AbscissaNoise<'a> {
    pub own: Vec<OwnNoise<'a>>,
    pub shared: Vec<SharedNoise<'a>>,
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
    /// Of functions of which few have a slope at a sample: `at(i)` is the first that has one at sample i, and the slopes from
    /// there on.
    pub fn new<const N: usize>(
        modulation: &Modulation,
        functions: usize,
        at: impl Fn(usize) -> (usize, [f64; N]),
    ) -> Slopes {
        let mut mean = vec![0.0; functions];
        let mut products = vec![[0.0; N]; functions];
        for (i, weight) in modulation.shares().enumerate() {
            let (first, slopes) = at(i);
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

    /// Of functions that all have a slope at every sample: `slopes[k][i]` is that of the k-th at sample i.
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
    /// Whether the abscissa has no noise that counts.
    pub fn is_none(&self) -> bool {
        self.own.is_empty() && self.shared.is_empty()
    }

    /// What the noise adds to the products of functions of the abscissa. `column` is the column of a function, `factor` that of an
    /// unknown factor.
    pub fn noisy(
        &self,
        slopes: &Slopes,
        column: impl Fn(usize) -> usize + Copy,
        factor: impl Fn(usize) -> usize + Copy,
    ) -> Vec<Noisy<'a>> {
        let own = self.own.iter().flat_map(|own| {
            slopes.products.iter().map(move |product| Noisy {
                columns: product.functions.map(column),
                block: own.block,
                spectrum: own.spectrum,
                factor: own.variance * product.mean,
            })
        });
        let shared = self.shared.iter().flat_map(|shared| {
            slopes.mean.iter().enumerate().map(move |(k, mean)| Noisy {
                columns: [factor(shared.factor), column(k)],
                block: shared.block,
                spectrum: shared.spectrum,
                factor: shared.covariance * mean,
            })
        });
        own.chain(shared).collect()
    }
}

/// What noise adds to the product of two columns, summed over all blocks and lines.
#[derive(Debug, Clone, Copy)]
struct Entry {
    columns: [usize; 2],
    sum: f64,
}

/// What noise adds to the inner products of columns.
pub(super) struct Excess(Vec<Entry>);

impl Excess {
    /// With these weights of each line of each block.
    pub fn new(noisy: &[Noisy], weights: &[Vec<f64>]) -> Excess {
        // Many entries share few spectra: the weighted sum of each is kept.
        let mut known: Vec<(usize, *const f64, f64)> = Vec::new();
        let entries = noisy.iter().map(|entry| {
            let (block, spectrum) = (entry.block, entry.spectrum.as_ptr());
            let found = known.iter().find(|known| (known.0, known.1) == (block, spectrum));
            let sum = match found {
                Some((.., sum)) => *sum,
                None => {
                    let sum = weights[block].iter().zip(entry.spectrum).map(|(w, e)| w * e).sum();
                    known.push((block, spectrum, sum));
                    sum
                }
            };
            Entry {
                columns: entry.columns,
                sum: entry.factor * sum,
            }
        });
        Excess(entries.collect())
    }

    /// The products of n columns less a share of this.
    fn taken_off(&self, products: &[f64], n: usize, share: f64) -> Vec<f64> {
        let mut less = products.to_vec();
        for &Entry { columns: [i, j], sum } in &self.0 {
            less[i * n + j] -= share * sum;
            if i != j {
                less[j * n + i] -= share * sum;
            }
        }
        less
    }

    /// The products of n columns less this, row-major. Where a sum of the first `unknown` columns would be mostly noise, only a
    /// part is taken off, and this keeps that part alone.
    pub fn off(&mut self, products: &[f64], n: usize, unknown: usize) -> Vec<f64> {
        if self.0.is_empty() {
            return products.to_vec();
        }
        let scale = scales(products, n, unknown);
        let scaled: Vec<f64> = (0..unknown)
            .flat_map(|i| (0..unknown).map(move |j| (i, j)))
            .map(|(i, j)| products[i * n + j] / (scale[i] * scale[j]))
            .collect();
        let inside = self.0.iter().filter(|entry| entry.columns.iter().all(|c| *c < unknown));
        let of_scaled = Excess(
            inside
                .map(|&Entry { columns: [i, j], sum }| Entry {
                    columns: [i, j],
                    sum: sum / (scale[i] * scale[j]),
                })
                .collect(),
        );
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            let mut rest = of_scaled.taken_off(&scaled, unknown, share / MOSTLY_NOISE);
            (0..unknown).for_each(|i| rest[i * unknown + i] += RIDGE);
            if linalg::solve_positive_definite(&rest, &vec![0.0; unknown]).is_some() {
                break;
            }
            share *= 0.5;
        }
        self.0.iter_mut().for_each(|entry| entry.sum *= share);
        self.taken_off(products, n, 1.0)
    }

    /// What this adds to the square of the columns' sum with these factors.
    pub fn square(&self, x: &[f64]) -> f64 {
        let part = |entry: &Entry| {
            let [i, j] = entry.columns;
            match i == j {
                true => entry.sum * x[i] * x[i],
                false => 2.0 * entry.sum * x[i] * x[j],
            }
        };
        self.0.iter().map(part).sum()
    }
}

#[cfg(test)]
#[path = "column_noise_tests.rs"]
mod tests;
