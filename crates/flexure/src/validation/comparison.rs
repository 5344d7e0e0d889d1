//! A paired test on the same fresh samples: which of two models predicts better?
//!
//! With $d_n = e_{1,n}^2 - e_{2,n}^2$, the statistic $\bar d / \sqrt{V/n}$ is asymptotically standard normal when both models
//! predict equally well (Diebold & Mariano 1995). Their V is the long-run variance of $d_n$, because successive errors are similar. Here
//! it is the larger of two: with Newey & West's (1987) triangular window, and from the means of 16 stretches of equal length (batch means;
//! Schmeiser 1982), which see a drift that is longer than the window. Where the errors are large for short times, that variance is large too.
//! So there is a second test, of signs: if the mean square of one model is more than twice that of the other in every stretch, the probability is
//! at most $2^{-16}$. The models may be nested: they are fixed here, as in Giacomini & White (2006), and not
//! estimated from these samples.

use crate::distributions::normal_above;
use crate::error::{Error, Result};
use crate::linear::correlation::{cross_covariance, mean};

/// The fewest samples for which the asymptotic distribution is used.
const FEWEST: usize = 40;

/// The stretches whose means show how far slow errors move the mean of all.
const STRETCHES: usize = 16;

/// The outcome of a paired comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairedComparison {
    /// Mean squared error of the first minus that of the second.
    pub difference: f64,
    /// Its standard error, which allows for dependent errors.
    pub standard_error: f64,
    /// The ratio of the two; zero if both vanish.
    pub statistic: f64,
    /// The probability of a statistic at least as large if both predict equally well, or that of the test of signs. It is small if the first
    /// is worse.
    pub p_value: f64,
}

impl PairedComparison {
    /// Compares two models' errors at the same samples.
    ///
    /// # Errors
    /// [`Error::Data`]: `LengthMismatch`; `TooShort` with fewer than 40 samples; `NonFinite`.
    pub fn new(first: &[f64], second: &[f64]) -> Result<Self> {
        let n = first.len();
        if second.len() != n {
            return Err(Error::length("the second model's error", second.len(), n));
        }
        if n < FEWEST {
            return Err(Error::too_short("a comparison of two models", FEWEST, n));
        }
        for (name, errors) in [("the first model's error", first), ("the second model's error", second)] {
            if let Some(sample) = errors.iter().position(|v| !v.is_finite()) {
                return Err(Error::not_finite(name, sample, errors[sample]));
            }
        }
        // Fourth powers would overflow or vanish in extreme units.
        let largest = first.iter().chain(second).fold(0.0_f64, |m, v| m.max(v.abs()));
        let unit = if largest > 0.0 { largest } else { 1.0 };
        let square = |v: &f64| (v / unit) * (v / unit);
        let d: Vec<f64> = first.iter().zip(second).map(|(a, b)| square(a) - square(b)).collect();
        let reach = (n as f64).cbrt().ceil() as usize;
        let c = cross_covariance(&d, &d, reach);
        let taper = |k: usize| 1.0 - k as f64 / (reach + 1) as f64;
        let within_reach = c[0] + 2.0 * (1..=reach).map(|k| taper(k) * c[k]).sum::<f64>();
        let difference = mean(&d);
        let standard_error = (within_reach.max(0.0) / n as f64).max(of_stretches(&d)).sqrt();
        let statistic = match (difference, standard_error) {
            (d, s) if s > 0.0 => d / s,
            (0.0, _) => 0.0,
            (d, _) => f64::INFINITY.copysign(d),
        };
        let p_value = normal_above(statistic);
        let in_all = 0.5_f64.powi(STRETCHES as i32);
        let p_value = match [[first, second], [second, first]].map(|[a, b]| is_twice_everywhere(a, b, unit)) {
            [true, _] => p_value.min(in_all),
            [_, true] => p_value.max(1.0 - in_all),
            _ => p_value,
        };
        Ok(PairedComparison {
            difference: unit * unit * difference,
            standard_error: unit * unit * standard_error,
            statistic,
            p_value,
        })
    }
}

/// The means of stretches of equal length.
fn means(d: &[f64]) -> Vec<f64> {
    let start = |i: usize| i * d.len() / STRETCHES;
    (0..STRETCHES).map(|i| mean(&d[start(i)..start(i + 1)])).collect()
}

/// Whether the mean squared error of the first is more than twice that of the second in every stretch.
fn is_twice_everywhere(first: &[f64], second: &[f64], unit: f64) -> bool {
    let squares = |errors: &[f64]| means(&errors.iter().map(|e| (e / unit).powi(2)).collect::<Vec<_>>());
    squares(first).iter().zip(squares(second)).all(|(a, b)| *a > 2.0 * b)
}

/// The variance of the mean, from the means of stretches.
fn of_stretches(d: &[f64]) -> f64 {
    let means = means(d);
    let center = mean(&means);
    let squares: f64 = means.iter().map(|m| (m - center).powi(2)).sum();
    squares / ((STRETCHES - 1) * STRETCHES) as f64
}

#[cfg(test)]
mod tests {
    use crate::error::DataError;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;

    fn coloured(rng: &mut Pcg64, n: usize, pole: f64) -> Vec<f64> {
        let mut last = 0.0;
        let next = |_| {
            let e: f64 = StandardNormal.sample(rng);
            last = pole * last + e;
            last
        };
        (0..n).map(next).collect()
    }

    #[test]
    fn equal_models_are_rejected_as_often_as_the_level_says_even_with_dependent_errors() {
        let mut rng = Pcg64::seed_from_u64(1);
        // With the window alone, 294 are rejected at the last pole.
        for (pole, most) in [(0.0, 85), (0.8, 85), (0.99, 120)] {
            let rejected = (0..1000).filter(|_| {
                let (a, b) = (coloured(&mut rng, 2000, pole), coloured(&mut rng, 2000, pole));
                PairedComparison::new(&a, &b).unwrap().p_value < 0.05
            });
            let rejected = rejected.count();
            assert!((25..=most).contains(&rejected), "{pole}: {rejected}");
        }
    }

    #[test]
    fn the_worse_model_is_found_and_the_statistic_is_the_one_of_the_formula() {
        let mut rng = Pcg64::seed_from_u64(2);
        let a = coloured(&mut rng, 500, 0.3);
        let b: Vec<f64> = a.iter().map(|v| 0.8 * v).collect();
        let test = PairedComparison::new(&a, &b).unwrap();
        assert!(test.p_value < 1e-6 && test.difference > 0.0);
        let back = PairedComparison::new(&b, &a).unwrap();
        assert!((back.p_value + test.p_value - 1.0).abs() < 1e-12 && back.statistic == -test.statistic);
        // Calculated by hand, with eight lags and with 16 stretches of 31 and 32 samples.
        let d: Vec<f64> = a.iter().map(|v| v * v * (1.0 - 0.64)).collect();
        let m = d.iter().sum::<f64>() / 500.0;
        let c = |k: usize| (k..500).map(|t| (d[t] - m) * (d[t - k] - m)).sum::<f64>() / 500.0;
        let v = c(0) + 2.0 * (1..=8).map(|k| (1.0 - k as f64 / 9.0) * c(k)).sum::<f64>();
        let mut batches = Vec::new();
        for (first, last) in (0..16).map(|i| (i * 125 / 4, (i + 1) * 125 / 4)) {
            batches.push(d[first..last].iter().sum::<f64>() / (last - first) as f64);
        }
        let middle = batches.iter().sum::<f64>() / 16.0;
        let of_batches = batches.iter().map(|b| (b - middle).powi(2)).sum::<f64>() / 240.0;
        let wanted = m / (v / 500.0).max(of_batches).sqrt();
        assert!((test.statistic - wanted).abs() < 1e-9, "{}", test.statistic);
        let same = PairedComparison::new(&a, &a).unwrap();
        assert_eq!((same.statistic, same.p_value), (0.0, 0.5));
    }

    /// Errors in bursts, as of a model that fails at large amplitudes. Nearly all squares are in one stretch, so that the mean says nothing.
    #[test]
    fn a_model_that_is_worse_in_every_stretch_is_worse() {
        let mut rng = Pcg64::seed_from_u64(3);
        let burst = |k: usize| if (300..330).contains(&k) { 40.0 } else { 1.0 };
        let wild = |by: f64| -> Vec<f64> { (0..1600).map(|k| by * burst(k)).collect() };
        let times = |a: &[f64], b: Vec<f64>| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
        let noise = coloured(&mut rng, 1600, 0.0);
        let [worse, better, slightly] = [1.0, 0.5, 0.8].map(|by| times(&noise, wild(by)));
        let p = |a: &[f64], b: &[f64]| PairedComparison::new(a, b).unwrap().p_value;
        assert_eq!(p(&worse, &better), 0.5_f64.powi(16));
        assert!((p(&worse, &better) + p(&better, &worse) - 1.0).abs() < 1e-12);
        assert!(p(&worse, &slightly) > 0.01);
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        assert!(matches!(
            PairedComparison::new(&[1.0; 50], &[1.0; 49]),
            Err(Error::Data(DataError::LengthMismatch { .. }))
        ));
        assert!(matches!(
            PairedComparison::new(&[1.0; 9], &[1.0; 9]),
            Err(Error::Data(DataError::TooShort { need: 40, got: 9, .. }))
        ));
        assert!(matches!(
            PairedComparison::new(&[f64::NAN; 50], &[1.0; 50]),
            Err(Error::Data(DataError::NonFinite { sample: 0, .. }))
        ));
    }
}
