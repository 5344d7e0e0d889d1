//! Weighted least squares over complex equations with real unknowns.

use rayon::prelude::*;

use super::bursts::over_time;
use super::noisy::{Excess, Noisy};
use crate::interrupt;
use crate::linalg::{self, Complex};

/// Added to the scaled normal equations' diagonal: what the data do not tell stays finite.
pub(super) const RIDGE: f64 = 1e-10;

/// A column of unknown factor: its entries in each of the stacked blocks of equations, or none.
pub(super) type Column = Vec<Option<Vec<Complex<f64>>>>;

/// Stacked blocks of complex equations `sum_j columns[j] x_j = right`, one line a frequency.
pub(super) struct Equations<'a> {
    /// The columns.
    pub columns: Vec<Column>,
    /// The right-hand side of each block.
    pub right: Vec<Vec<Complex<f64>>>,
    /// The mean square of the noise in each line of each block.
    pub noise: Vec<&'a [f64]>,
    /// What columns that are themselves noisy have of it in their products, which is taken off again.
    pub noisy: Vec<Noisy<'a>>,
}

/// The least share of a line that the unknowns are taken to leave.
const LEAST_LEFT: f64 = 0.05;

/// A solution.
#[derive(Clone)]
pub(super) struct Solution {
    /// The unknowns.
    pub x: Vec<f64>,
    /// Their covariance for the noise as it was given, row-major.
    pub covariance: Vec<f64>,
    /// What the right-hand sides have left, block by block.
    pub residuals: Vec<Vec<Complex<f64>>>,
    /// The weighted sum of squares of the residuals, one real and one imaginary part a line.
    pub squares: f64,
    /// That less what the noise of the columns has in it: what the solution minimises.
    pub objective: f64,
}

/// The errors of a solution, whatever the noise's spectrum.
pub(super) struct Robust {
    /// The covariance of the unknowns, row-major.
    pub covariance: Vec<f64>,
    /// What the unknowns take of the weighted sum of squares by chance, on average: their number where the weights are right.
    pub taken: f64,
}

impl Solution {
    /// The standard error of an unknown.
    pub fn error(&self, i: usize) -> f64 {
        self.covariance[i * self.x.len() + i].max(0.0).sqrt()
    }
}

impl Equations<'_> {
    /// sum over all lines of Re(conj(a) b) times the weights.
    fn product(weights: &[Vec<f64>], a: &Column, b: &Column) -> f64 {
        let blocks = weights.iter().zip(a.iter().zip(b));
        blocks
            .map(|(w, pair)| match pair {
                (Some(a), Some(b)) => {
                    let lines = w.iter().zip(a.iter().zip(b));
                    lines.map(|(w, (a, b))| w * (a.re * b.re + a.im * b.im)).sum()
                }
                _ => 0.0,
            })
            .sum()
    }

    /// The normal matrix for the weights, row-major.
    fn normal(&self, weights: &[Vec<f64>]) -> Vec<f64> {
        let n = self.columns.len();
        let scaled: Vec<Vec<Option<Vec<f64>>>> = self.columns.par_iter().map(|c| weighted(weights, c)).collect();
        let rows: Vec<Vec<f64>> = (0..n)
            .into_par_iter()
            .map(|i| {
                let row = &scaled[i];
                let with = |column: &Vec<Option<Vec<f64>>>| -> f64 {
                    let blocks = row.iter().zip(column);
                    blocks.filter_map(|(a, b)| Some(dot(a.as_ref()?, b.as_ref()?))).sum()
                };
                scaled[..=i].iter().map(with).collect()
            })
            .collect();
        let mut normal = vec![0.0; n * n];
        for (i, row) in rows.iter().enumerate() {
            for (j, v) in row.iter().enumerate() {
                normal[i * n + j] = *v;
                normal[j * n + i] = *v;
            }
        }
        normal
    }

    /// The weights of each line of each block: the real and the imaginary part each have half the noise's mean square.
    fn weights(&self) -> Vec<Vec<f64>> {
        self.noise.iter().map(|s| s.iter().map(|s| 2.0 / s).collect()).collect()
    }

    /// The weighted inner products of the columns, row-major, less what the columns' own noise has added; and that. No sum of the
    /// first `unknown` columns loses more than half of its square.
    pub fn gram(&self, unknown: usize) -> (Vec<f64>, Excess) {
        let weights = self.weights();
        let normal = self.normal(&weights);
        let mut excess = Excess::new(&self.noisy, &weights);
        let less = excess.off(&normal, self.columns.len(), unknown);
        (less, excess)
    }

    /// The weighted products of the columns with the right-hand side.
    pub fn moments(&self) -> Vec<f64> {
        let weights = self.weights();
        let right: Column = self.right.iter().map(|r| Some(r.clone())).collect();
        let columns = self.columns.par_iter();
        columns.map(|c| Self::product(&weights, c, &right)).collect()
    }

    /// The weighted least-squares solution; `None` if the equations do not determine it in double precision, and where the work
    /// is asked to stop.
    pub fn solve(&self) -> Option<Solution> {
        if interrupt::requested() {
            return None;
        }
        let n = self.columns.len();
        let weights = self.weights();
        let (normal, excess) = self.gram(n);
        let moment = self.moments();
        let scale: Vec<f64> = (0..n)
            .map(|i| normal[i * n + i].sqrt())
            .map(|s| if s > 0.0 && s.is_finite() { s } else { 1.0 })
            .collect();
        let mut scaled = normal.clone();
        for i in 0..n {
            for j in 0..n {
                scaled[i * n + j] /= scale[i] * scale[j];
            }
            scaled[i * n + i] += RIDGE;
        }
        let moment: Vec<f64> = moment.iter().zip(&scale).map(|(m, s)| m / s).collect();
        let solution = linalg::solve_positive_definite(&scaled, &moment)?;
        let mut covariance = linalg::inverse_positive_definite(&scaled, n)?;
        for i in 0..n {
            for j in 0..n {
                covariance[i * n + j] /= scale[i] * scale[j];
            }
        }
        let x: Vec<f64> = solution.iter().zip(&scale).map(|(x, s)| x / s).collect();
        let residuals = self.residuals(&x);
        let squares: f64 = weights
            .iter()
            .zip(&residuals)
            .map(|(w, r)| w.iter().zip(r).map(|(w, r)| w * r.norm_sqr()).sum::<f64>())
            .sum();
        Some(Solution {
            objective: squares - excess.square(&x),
            x,
            covariance,
            residuals,
            squares,
        })
    }

    fn residuals(&self, x: &[f64]) -> Vec<Vec<Complex<f64>>> {
        let mut residuals = self.right.clone();
        for (column, x) in self.columns.iter().zip(x) {
            for (block, residual) in column.iter().zip(&mut residuals) {
                if let Some(lines) = block {
                    residual.iter_mut().zip(lines).for_each(|(r, v)| *r -= v * *x);
                }
            }
        }
        residuals
    }

    /// The mean square of the noise in each line of each block, from the residuals: what the unknowns took of them is given back
    /// (the lines' leverage; MacKinnon & White 1985, HC2).
    ///
    /// Fine curves follow the few lines of low frequencies, which weigh most; without that they would seem free of noise.
    pub fn powers(&self, solution: &Solution) -> Vec<Vec<f64>> {
        let n = self.columns.len();
        let covariance = &solution.covariance;
        let blocks = self.noise.iter().zip(&solution.residuals).enumerate();
        blocks
            .map(|(block, (noise, residuals))| {
                let own: Vec<(usize, &[Complex<f64>])> = (0..n)
                    .filter_map(|i| Some((i, self.columns[i][block].as_deref()?)))
                    .collect();
                let lines = noise.par_iter().zip(residuals).enumerate();
                lines
                    .map(|(k, (s, r))| {
                        let mut taken = 0.0;
                        for &(i, a) in &own {
                            let row = &covariance[i * n..(i + 1) * n];
                            let (re, im) = own.iter().fold((0.0, 0.0), |(re, im), &(j, b)| {
                                (re + row[j] * b[k].re, im + row[j] * b[k].im)
                            });
                            taken += a[k].re * re + a[k].im * im;
                        }
                        // Of the line's two real equations, each with half the noise.
                        r.norm_sqr() / (1.0 - taken / s).max(LEAST_LEFT)
                    })
                    .collect()
            })
            .collect()
    }

    /// The covariance for the noise as it was given, times the spread of the moments that the residuals show, row-major: the unit matrix
    /// where the weights are right, but for chance.
    fn spread(&self, solution: &Solution) -> Vec<f64> {
        let meat = self.spread_of(&self.powers(solution));
        times(&solution.covariance, &meat, self.columns.len())
    }

    /// The covariance of the columns' weighted products with errors of these mean squares of each line, row-major.
    pub fn spread_of(&self, powers: &[Vec<f64>]) -> Vec<f64> {
        let meat: Vec<Vec<f64>> = self
            .noise
            .iter()
            .zip(powers)
            .map(|(s, power)| {
                let power = smoothed(power);
                s.iter().zip(&power).map(|(s, p)| 2.0 * p / (s * s)).collect()
            })
            .collect();
        self.normal(&meat)
    }

    /// The errors whatever the noise's spectrum is, from that of the residuals (White 1980, in frequency).
    ///
    /// Where the weights are right the covariance is the solution's own but for chance. That, the one by frequencies and the one by
    /// the scatter [`over_time`]: the largest variance counts.
    pub fn robust(&self, solution: &Solution) -> Robust {
        let n = self.columns.len();
        let c = &solution.covariance;
        let spread = self.spread(solution);
        let trace = |a: &[f64]| -> f64 { (0..n).map(|i| a[i * n + i]).sum() };
        let mut robust = times(&spread, c, n);
        let scatter = times(c, &over_time(self, &solution.residuals), n);
        let taken = trace(&scatter).max(trace(&spread));
        let bursts = times(&scatter, c, n);
        let own: Vec<f64> = (0..n).map(|i| robust[i * n + i].max(f64::MIN_POSITIVE)).collect();
        for i in 0..n {
            // Never less than the weights say, nor than the scatter over time.
            let grow = (c[i * n + i].max(bursts[i * n + i]) / own[i]).sqrt().max(1.0);
            for j in 0..n {
                robust[i * n + j] *= grow;
                robust[j * n + i] *= grow;
            }
        }
        Robust {
            covariance: robust,
            taken,
        }
    }
}

/// The product of two square matrices, row-major.
fn times(a: &[f64], b: &[f64], n: usize) -> Vec<f64> {
    let mut product = vec![0.0; n * n];
    for i in 0..n {
        for k in 0..n {
            let v = a[i * n + k];
            for j in 0..n {
                product[i * n + j] += v * b[k * n + j];
            }
        }
    }
    product
}

/// The real and imaginary parts of a column's lines, each times the square root of its weight.
fn weighted(weights: &[Vec<f64>], column: &Column) -> Vec<Option<Vec<f64>>> {
    let blocks = weights.iter().zip(column);
    blocks
        .map(|(w, lines)| {
            let lines = w.iter().zip(lines.as_ref()?);
            Some(lines.flat_map(|(w, v)| [w.sqrt() * v.re, w.sqrt() * v.im]).collect())
        })
        .collect()
}

/// The sum of products, in eight sums at once.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    const SUMS: usize = 8;
    let (a, b) = (a.chunks_exact(SUMS), b.chunks_exact(SUMS));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; SUMS];
    for (a, b) in a.zip(b) {
        for k in 0..SUMS {
            sums[k] += a[k] * b[k];
        }
    }
    rest + sums.iter().sum::<f64>()
}

/// The running mean of the residuals' squared size over a fiftieth of the lines.
fn smoothed(powers: &[f64]) -> Vec<f64> {
    let n = powers.len();
    let half = (n / 100).max(6).min(n / 2);
    let mut sums = vec![0.0];
    for p in powers {
        sums.push(sums[sums.len() - 1] + p);
    }
    (0..n)
        .map(|k| {
            let (from, to) = (k.saturating_sub(half), (k + half + 1).min(n));
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}

/// The noise of one equation: white, beside a part whose spectrum is known.
pub(super) struct NoiseModel {
    /// The mean square of each line.
    pub lines: Vec<f64>,
}

impl NoiseModel {
    /// Fits the white part to residuals by Whittle's likelihood.
    pub fn fit(residuals: &[Complex<f64>], known: &[f64]) -> NoiseModel {
        let power: Vec<f64> = residuals.iter().map(|r| r.norm_sqr()).collect();
        Self::of_power(&power, known)
    }

    /// Fits it to the lines' mean squares.
    pub fn of_power(power: &[f64], known: &[f64]) -> NoiseModel {
        let n = power.len() as f64;
        let mean = power.iter().sum::<f64>() / n;
        let floor = 1e-9 * mean + f64::MIN_POSITIVE;
        let mut white = mean.max(floor);
        for _ in 0..100 {
            let (mut above, mut below) = (0.0, 0.0);
            for (p, k) in power.iter().zip(known) {
                let s = white + k;
                above += p / (s * s);
                below += 1.0 / s;
            }
            let next = (white * (above / below).sqrt()).max(floor);
            let settled = (next - white).abs() < 1e-6 * white;
            white = next;
            if settled {
                break;
            }
        }
        NoiseModel {
            lines: known.iter().map(|k| white + k).collect(),
        }
    }
}
