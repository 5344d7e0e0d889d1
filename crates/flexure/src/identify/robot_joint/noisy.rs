//! What the encoders' noise adds to the inner products of noisy columns.
//!
//! An angle off by e makes an acceleration off by $-\omega^2 e$, and a function f of the deflection off by $f'(d)\,e$, to first
//! order. Least squares take that for signal: inertias come out too small, and where the noise of two columns is from the same
//! encoder one comes out at the other's cost. Its mean is known, and is taken off again (errors in variables; Fuller 1987).

use super::equations::RIDGE;
use super::fourier::Modulation;
use crate::linalg;

/// No more than this share of the square of any sum of columns may be noise.
const MOSTLY_NOISE: f64 = 0.5;
/// Halvings at most of what is taken off where more would be.
const HALVINGS: usize = 12;

/// What noise adds to the product of two columns, or to the square of one, in one block of equations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noisy<'a> {
    /// The columns' numbers; the same one twice for its square.
    pub columns: [usize; 2],
    /// The block.
    pub block: usize,
    /// The mean of each line, but for the factor.
    pub lines: &'a [f64],
    /// The factor.
    pub factor: f64,
}

/// How the noise of a curve's abscissa meets itself and that of other columns. The curve has the sign +1 in all these blocks.
#[derive(Debug, Clone, Default)]
pub(super) struct Abscissa<'a> {
    /// The block, the spectrum and the variance of the abscissa's own noise.
    pub own: Vec<(usize, &'a [f64], f64)>,
    /// Columns that have some of the same noise: their number, the block, and the spectrum and the factor of the product.
    pub with: Vec<(usize, usize, &'a [f64], f64)>,
}

/// The slopes of functions of an abscissa: their means over the record, and those of their products.
#[derive(Debug, Clone)]
pub(super) struct Slopes {
    mean: Vec<f64>,
    /// The numbers of two functions, the first no larger, and the mean product of their slopes.
    products: Vec<(usize, usize, f64)>,
}

impl Slopes {
    /// Of so many functions: `at(i)` tells the first one with a slope at sample i, and the slopes from there on.
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
            row.map(move |(k, &v)| (i, i + k, v))
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
                .map(|(a, b)| (a, b, mean_of(&|i| slopes[a][i] * slopes[b][i])))
                .collect(),
        }
    }
}

impl<'a> Abscissa<'a> {
    /// Whether it has no noise that counts.
    pub fn is_exact(&self) -> bool {
        self.own.is_empty() && self.with.is_empty()
    }

    /// What it adds to the products of functions of it; `number` tells the columns' numbers.
    pub fn noisy(&self, slopes: &Slopes, number: impl Fn(usize) -> usize + Copy) -> Vec<Noisy<'a>> {
        let own = self.own.iter().flat_map(|&(block, lines, variance)| {
            slopes.products.iter().map(move |&(a, b, product)| Noisy {
                columns: [number(a), number(b)],
                block,
                lines,
                factor: variance * product,
            })
        });
        let with = self.with.iter().flat_map(|&(column, block, lines, factor)| {
            slopes.mean.iter().enumerate().map(move |(k, mean)| Noisy {
                columns: [column, number(k)],
                block,
                lines,
                factor: factor * mean,
            })
        });
        own.chain(with).collect()
    }
}

/// What noise adds to the inner products of columns: their numbers and the sum over all blocks and lines.
pub(super) struct Excess(Vec<([usize; 2], f64)>);

impl Excess {
    /// With these weights of each line of each block.
    pub fn new(noisy: &[Noisy], weights: &[Vec<f64>]) -> Excess {
        // Many entries share few spectra.
        let mut known: Vec<(usize, *const f64, f64)> = Vec::new();
        let entries = noisy.iter().map(|entry| {
            let of = (entry.block, entry.lines.as_ptr());
            let found = known.iter().find(|(block, lines, _)| (*block, *lines) == of);
            let sum = match found {
                Some((.., sum)) => *sum,
                None => {
                    let sum = weights[entry.block].iter().zip(entry.lines).map(|(w, e)| w * e).sum();
                    known.push((of.0, of.1, sum));
                    sum
                }
            };
            (entry.columns, entry.factor * sum)
        });
        Excess(entries.collect())
    }

    fn taken_off(&self, normal: &[f64], n: usize, share: f64) -> Vec<f64> {
        let mut less = normal.to_vec();
        for &([i, j], value) in &self.0 {
            less[i * n + j] -= share * value;
            if i != j {
                less[j * n + i] -= share * value;
            }
        }
        less
    }

    /// The products of n columns without it, row-major; without a part of it, which is then all that this keeps, where a sum of the first
    /// `unknown` columns is mostly noise.
    pub fn off(&mut self, normal: &[f64], n: usize, unknown: usize) -> Vec<f64> {
        if self.0.is_empty() {
            return normal.to_vec();
        }
        let scale: Vec<f64> = (0..unknown)
            .map(|i| normal[i * n + i].sqrt())
            .map(|s| if s > 0.0 && s.is_finite() { s } else { 1.0 })
            .collect();
        let both = |i: usize, j: usize| scale[i] * scale[j];
        let scaled: Vec<f64> = (0..unknown)
            .flat_map(|i| (0..unknown).map(move |j| (i, j)))
            .map(|(i, j)| normal[i * n + j] / both(i, j))
            .collect();
        let inside = self.0.iter().filter(|([i, j], _)| *i.max(j) < unknown);
        let of_scaled = Excess(inside.map(|&([i, j], v)| ([i, j], v / both(i, j))).collect());
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            let mut rest = of_scaled.taken_off(&scaled, unknown, share / MOSTLY_NOISE);
            (0..unknown).for_each(|i| rest[i * unknown + i] += RIDGE);
            if linalg::solve_positive_definite(&rest, &vec![0.0; unknown]).is_some() {
                break;
            }
            share *= 0.5;
        }
        self.0.iter_mut().for_each(|(_, v)| *v *= share);
        self.taken_off(normal, n, 1.0)
    }

    /// What it adds to the square of the columns' sum with these factors.
    pub fn square(&self, x: &[f64]) -> f64 {
        let part = |&([i, j], v): &([usize; 2], f64)| if i == j { v * x[i] * x[i] } else { 2.0 * v * x[i] * x[j] };
        self.0.iter().map(part).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::basis::Basis;
    use super::super::equations::Equations;
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    const SAMPLES: usize = 8000;
    const STEP: f64 = 0.01;

    /// A sum of sines, and its second derivative.
    fn sines(lines: &[[f64; 3]]) -> [Vec<f64>; 2] {
        let at = |f: &dyn Fn(f64, &[f64; 3]) -> f64| -> Vec<f64> {
            let sum = |i: usize| lines.iter().map(|line| f(i as f64 * STEP, line)).sum();
            (0..SAMPLES).map(sum).collect()
        };
        [
            at(&|t, [size, w, phase]| size * (w * t + phase).sin()),
            at(&|t, [size, w, phase]| -size * w * w * (w * t + phase).sin()),
        ]
    }

    /// A motor on a spring that hardly moves against it: what the encoders' noise does to inertia and stiffness is known and taken off.
    #[test]
    fn noise_that_two_columns_share_is_taken_off() {
        const NOISE: f64 = 2e-3;
        const RUNS: usize = 60;
        let (inertia, stiffness) = (1.0, 40.0);
        let [motor, acceleration] = sines(&[[0.3, 1.1, 0.0], [0.1, 3.7, 1.0], [0.04, 7.9, 2.0]]);
        let [d, _] = sines(&[[0.03, 1.1, 0.1], [0.02, 3.7, 1.2], [0.02, 7.9, 2.1]]);
        let modulation = Modulation::new(SAMPLES, STEP, 3.0);
        let tau: Vec<f64> = acceleration
            .iter()
            .zip(&d)
            .map(|(a, d)| inertia * a + stiffness * d)
            .collect();
        let noise = vec![1.0; modulation.len()];
        let spectrum = |power: i32| -> Vec<f64> { modulation.omega.iter().map(|w| w.powi(power)).collect() };
        let (flat, shared, own) = (spectrum(0), spectrum(2), spectrum(4));
        let variance = NOISE * NOISE;
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        let mut noisy = |x: &[f64]| -> Vec<f64> {
            let mut error = || -> f64 { StandardNormal.sample(&mut rng) };
            x.iter().map(|x| x + NOISE * error()).collect()
        };
        let link: Vec<f64> = motor.iter().zip(&d).map(|(m, d)| m - d).collect();
        let mut found = [Vec::new(), Vec::new(), Vec::new()];
        for _ in 0..RUNS {
            let (motor, link) = (noisy(&motor), noisy(&link));
            let d: Vec<f64> = motor.iter().zip(&link).map(|(m, q)| m - q).collect();
            let slopes = Slopes::of_all(&modulation, &[vec![1.0; SAMPLES]]);
            let abscissa = Abscissa {
                own: vec![(0, &flat, 2.0 * variance)],
                with: vec![(0, 0, &shared, -variance)],
            };
            let square = Noisy {
                columns: [0, 0],
                block: 0,
                lines: &own,
                factor: variance,
            };
            let all: Vec<Noisy> = abscissa.noisy(&slopes, |k| 1 + k).into_iter().chain([square]).collect();
            for (found, noisy) in found.iter_mut().zip([Vec::new(), vec![square], all]) {
                let equations = Equations {
                    columns: vec![
                        vec![Some(modulation.of_acceleration(&motor))],
                        vec![Some(modulation.of(&d))],
                    ],
                    right: vec![modulation.of(&tau)],
                    noise: vec![&noise],
                    noisy,
                };
                found.push(equations.solve().unwrap().x[0] - inertia);
            }
        }
        let told = found.map(|errors| {
            let mean = errors.iter().sum::<f64>() / RUNS as f64;
            let spread = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (RUNS - 1) as f64;
            (mean, mean / (spread / RUNS as f64).sqrt())
        });
        println!(
            "off, and in standard errors: nothing taken off {:?}, squares {:?}, all {:?}",
            told[0], told[1], told[2]
        );
        assert!(told[0].1.abs() > 5.0 && told[1].1.abs() > 5.0, "{told:?}");
        assert!(told[2].1.abs() < 3.0, "{told:?}");
    }

    /// Slopes of splines, whose sum is d itself where all coefficients are alike, and of functions.
    #[test]
    fn slopes_are_those_of_the_functions() {
        let [d, _] = sines(&[[0.3, 1.1, 0.0], [0.1, 3.7, 1.0]]);
        let modulation = Modulation::new(SAMPLES, STEP, 3.0);
        let basis = Basis::stiffness(&d, 5);
        let slopes = basis.slopes(&modulation, &d);
        assert!(
            (slopes.mean.iter().sum::<f64>() - 1.0).abs() < 1e-6,
            "{:?}",
            slopes.mean
        );
        let twice = |(a, b): (usize, usize)| if a == b { 1.0 } else { 2.0 };
        let all: f64 = slopes.products.iter().map(|&(a, b, v)| twice((a, b)) * v).sum();
        assert!((all - 1.0).abs() < 1e-6, "{all}");
        let functions = Slopes::of_all(&modulation, &[vec![2.0; SAMPLES], d.clone()]);
        let mean: f64 = modulation.shares().zip(&d).map(|(w, d)| w * d).sum();
        assert!((functions.mean[0] - 2.0).abs() < 1e-12 && (functions.mean[1] - mean).abs() < 1e-15);
        assert_eq!(functions.products.len(), 3);
        assert!(
            (functions.products[1].2 - 2.0 * mean).abs() < 1e-12,
            "{:?}",
            functions.products
        );
    }

    /// Columns that are mostly noise keep half of their square.
    #[test]
    fn no_more_than_half_is_taken_off() {
        let lines = [1.0];
        let entry = |columns, factor| Noisy {
            columns,
            block: 0,
            lines: &lines,
            factor,
        };
        let normal = [4.0, 1.0, 1.0, 1.0];
        let mut excess = Excess::new(&[entry([0, 0], 8.0), entry([0, 1], 0.5)], &[vec![1.0]]);
        let less = excess.off(&normal, 2, 2);
        // 2 ([4, 1; 1, 1] - share [8, 0.5; 0.5, 0]) is positive definite with a share of an eighth.
        assert_eq!(less, [3.0, 0.9375, 0.9375, 1.0]);
        assert_eq!(excess.square(&[1.0, 2.0]), 1.0 + 2.0 * 0.0625 * 2.0);
        // What has noise within bounds loses all of it.
        let mut excess = Excess::new(&[entry([0, 0], 0.5), entry([0, 1], 0.5)], &[vec![2.0]]);
        assert_eq!(excess.off(&normal, 2, 2), [3.0, 0.0, 0.0, 1.0]);
    }
}
