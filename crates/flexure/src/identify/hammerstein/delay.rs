//! Step 1: the delay s of the linear system, and the lag at which the output is regressed on the input.
//!
//! The paper's (17) has $k_0 = d_1 \ne 0$. A measured system may respond later: $k_j = 0$ for j < s. The delay is the first lag j at
//! which $Y_{n+j}$ depends on $X_n$ at all.
//!
//! The covariance of $Y_{n+j}$ and $X_n$ vanishes for an even nonlinearity. The output is therefore correlated with the first four
//! orthonormal polynomials of the input, which is clipped first. For a white input and a lag without dependence, n times the sum of
//! the squared correlations is chi-squared with four degrees of freedom.
//!
//! The regression (16) holds at every lag $s + j$ with $k_j$ in place of $k_0$. The paper regresses at the delay
//! ([`RegressionLag::Delay`]). The default is the lag of the strongest dependence, which has the least noise.

use super::super::limits::CLIP;

use super::limits::{DEGREES, DEPENDENT, FALSE_ALARM, MOST_LAGS, SAMPLES_PER_LAG};
use super::options::{PlainHammerstein, RegressionLag};
use crate::distributions::chi_squared_quantile;
use crate::identify::warning::Warning;
use crate::linear::correlation::{cross_covariance, mean, variance};
use crate::vectors::{add, dot};

/// The lags for the following steps.
pub(super) struct Lags {
    /// The delay s.
    pub delay: usize,
    /// The lag of the regression.
    pub regression: usize,
    /// The lag of the strongest dependence.
    pub strongest: usize,
    /// The last lag of the impulse response.
    pub last: usize,
}

impl Lags {
    /// The given lags, or those that the data show.
    pub fn find(method: &PlainHammerstein, x: &[f64], y: &[f64], warnings: &mut Vec<Warning>) -> Lags {
        let given_delay = method.delay.unwrap_or(0);
        let given = match method.regression_lag {
            RegressionLag::At(j) => j.max(given_delay),
            _ => given_delay,
        };
        let last = MOST_LAGS.min(x.len() / SAMPLES_PER_LAG) + given;
        let dependence = Dependence::new(x, y, last);
        let first = dependence.first();
        if first.is_none() {
            warnings.push(Warning::NoDependence { lags: last });
        }
        let strongest = dependence.strongest();
        let delay = method.delay.unwrap_or(first.unwrap_or(strongest));
        Lags {
            delay,
            regression: method.regression_lag.resolve(strongest, delay),
            strongest,
            last,
        }
    }
}

/// How strongly the output depends on the input at each lag.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Dependence {
    /// n times the sum of squared correlations, at lags 0, 1, ...
    pub statistic: Vec<f64>,
    /// The limit of the statistic: by chance, only one record in a thousand exceeds it at any lag.
    pub limit: f64,
}

impl Dependence {
    /// Measures lags 0 to `lags`; both signals must vary and be longer than that.
    pub fn new(x: &[f64], y: &[f64], lags: usize) -> Self {
        let n = x.len() as f64;
        let power = variance(y);
        let mut statistic = vec![0.0; lags + 1];
        let basis = orthonormal_polynomials(x);
        let degrees = basis.len();
        for psi in basis {
            for (s, c) in statistic.iter_mut().zip(cross_covariance(&psi, y, lags)) {
                *s += n * c * c / power;
            }
        }
        let limit = chi_squared_quantile(1.0 - FALSE_ALARM / (lags + 1) as f64, degrees.max(1) as f64);
        Dependence { statistic, limit }
    }

    /// The first lag with a dependence that chance does not explain.
    pub fn first(&self) -> Option<usize> {
        self.statistic.iter().position(|&s| s > self.limit)
    }

    /// The lag with the strongest dependence.
    pub fn strongest(&self) -> usize {
        let mut best = 0;
        for (j, s) in self.statistic.iter().enumerate() {
            if *s > self.statistic[best] {
                best = j;
            }
        }
        best
    }
}

/// Polynomials of degree 1 to 4 in the clipped input, orthonormal over the samples and to a constant.
///
/// Fewer for an input of few levels.
fn orthonormal_polynomials(x: &[f64]) -> Vec<Vec<f64>> {
    let (centre, spread) = (mean(x), variance(x).sqrt());
    let z: Vec<f64> = x
        .iter()
        .map(|v| ((v - centre) / (CLIP * spread)).clamp(-1.0, 1.0))
        .collect();
    let n = x.len() as f64;
    let product = |a: &[f64], b: &[f64]| dot(a, b) / n;
    let mut basis: Vec<Vec<f64>> = vec![vec![1.0; x.len()]];
    for degree in 1..=DEGREES {
        let mut candidate: Vec<f64> = z.iter().zip(&basis[basis.len() - 1]).map(|(z, p)| z * p).collect();
        let size = product(&candidate, &candidate).sqrt();
        // Two passes make them orthogonal to within rounding.
        for _ in 0..2 {
            for other in &basis {
                let share = product(&candidate, other);
                add(&mut candidate, -share, other);
            }
        }
        let norm = product(&candidate, &candidate).sqrt();
        if !(norm > DEPENDENT * size) || basis.len() < degree {
            break;
        }
        candidate.iter_mut().for_each(|c| *c /= norm);
        basis.push(candidate);
    }
    basis.split_off(1)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn uniform(seed: u64, n: usize) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        (0..n).map(|_| rng.random_range(-1.0..1.0)).collect()
    }

    #[test]
    fn polynomials_are_orthonormal_also_for_few_levels() {
        let two_levels: Vec<f64> = uniform(1, 500).iter().map(|v| v.signum()).collect();
        assert_eq!(orthonormal_polynomials(&two_levels).len(), 1);
        let basis = orthonormal_polynomials(&uniform(1, 500));
        assert_eq!(basis.len(), DEGREES);
        for (i, p) in basis.iter().enumerate() {
            assert!(mean(p).abs() < 1e-12);
            for (j, q) in basis.iter().enumerate() {
                let product = p.iter().zip(q).map(|(a, b)| a * b).sum::<f64>() / 500.0;
                assert!((product - f64::from(i == j)).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn the_delay_of_an_even_nonlinearity_is_found() {
        let x = uniform(2, 3000);
        let e = uniform(3, 3000);
        let y: Vec<f64> = (0..3000)
            .map(|i| {
                if i < 7 {
                    0.0
                } else {
                    x[i - 7].powi(2) + 0.4 * x[i - 6].cos() + 0.1 * e[i]
                }
            })
            .collect();
        let dependence = Dependence::new(&x, &y, 50);
        assert_eq!((dependence.first(), dependence.strongest()), (Some(6), 7));
    }

    #[test]
    fn unrelated_signals_show_no_dependence() {
        let alarms = (0..300).filter(|&s| {
            Dependence::new(&uniform(2 * s, 800), &uniform(2 * s + 1, 800), 60)
                .first()
                .is_some()
        });
        assert!(alarms.count() <= 3);
    }
}
