//! Prediction some samples ahead from the measured output's past (Ljung 1999, section 3.2).
//!
//! With $y = G u + v$ and $R(z) v = e$ white, the best prediction k samples ahead is
//! $$ \hat y_{t|t-k} = (G u)_t + \bigl[1 - F_k(z) R(z)\bigr] v_t, $$
//! where $F_k$ is the first k terms of $1/R$: the e since then cannot be known.

use crate::error::{Error, Result};

/// Predicts the output `horizon` samples ahead. The prediction is the free-run simulation plus the expected error of that simulation. The
/// autoregression `whitening` = 1, r_1, r_2, ... gives this expectation from the errors up to `horizon` samples ago.
///
/// Before the record the error counts as zero. If the error is white (`whitening` is only 1, or empty), its expectation is zero. Then the
/// prediction is the simulation at every horizon.
///
/// # Errors
/// [`Error::Data`]: `LengthMismatch`, `NonFinite` for a measured or simulated value, and [`Error::Parameter`] for a horizon of zero
/// or an autoregression that does not start with 1.
///
/// ```
/// use flexure::validation::predict_ahead;
///
/// // An error that halves from sample to sample: e_t = v_t - 0.5 v_{t-1}.
/// let ahead = predict_ahead(&[0.0; 3], &[8.0, 4.0, 2.0], &[1.0, -0.5], 1)?;
/// assert_eq!(ahead, [0.0, 4.0, 2.0]);
/// # Ok::<(), flexure::Error>(())
/// ```
pub fn predict_ahead(simulated: &[f64], measured: &[f64], whitening: &[f64], horizon: usize) -> Result<Vec<f64>> {
    if horizon == 0 {
        return Err(Error::parameter("the horizon", 0.0, "at least 1"));
    }
    if let Some(first) = whitening.first().filter(|first| **first != 1.0) {
        return Err(Error::parameter(
            "the first coefficient of the noise model",
            *first,
            "1",
        ));
    }
    if measured.len() != simulated.len() {
        return Err(Error::length("the measurement", measured.len(), simulated.len()));
    }
    for (column, values) in [("the measurement", measured), ("the simulation", simulated)] {
        if let Some(sample) = values.iter().position(|v| !v.is_finite()) {
            return Err(Error::not_finite(column, sample, values[sample]));
        }
    }
    let weights = weights(whitening, horizon.min(measured.len()));
    let v: Vec<f64> = measured.iter().zip(simulated).map(|(y, s)| y - s).collect();
    let expected = |t: usize| {
        let past = v[..(t + 1).saturating_sub(horizon)].iter().rev();
        past.zip(&weights).map(|(v, c)| v * c).sum::<f64>()
    };
    Ok(simulated.iter().enumerate().map(|(t, s)| s + expected(t)).collect())
}

/// The weights of v_{t-k}, v_{t-k-1}, ... in the expectation of v_t: -F_k R from z^-k on.
fn weights(whitening: &[f64], horizon: usize) -> Vec<f64> {
    let r = |i: usize| whitening.get(i).copied().unwrap_or(0.0);
    // F_k by long division of 1 by R.
    let mut f: Vec<f64> = Vec::with_capacity(horizon);
    for j in 0..horizon {
        let known: f64 = f.iter().enumerate().map(|(i, f)| f * r(j - i)).sum();
        f.push(if j == 0 { 1.0 } else { -known });
    }
    (horizon..horizon + whitening.len().saturating_sub(1))
        .map(|j| -f.iter().enumerate().map(|(i, f)| f * r(j - i)).sum::<f64>())
        .collect()
}

#[cfg(test)]
mod tests {
    use crate::error::DataError;
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// Continues the known values by the autoregression, one step after the other.
    fn forecast(v: &[f64], r: &[f64], steps: usize) -> f64 {
        let mut known = v.to_vec();
        for _ in 0..steps {
            let past = known.iter().rev().zip(&r[1..]);
            let next = -past.map(|(v, r)| v * r).sum::<f64>();
            known.push(next);
        }
        known[known.len() - 1]
    }

    #[test]
    fn every_horizon_is_the_recursion_run_on() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
        let mut noise = |n: usize| -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
        let (simulated, measured) = (noise(60), noise(60));
        let r = [1.0, -1.2, 0.6, -0.1];
        let v: Vec<f64> = measured.iter().zip(&simulated).map(|(y, s)| y - s).collect();
        for horizon in [1_usize, 2, 3, 4, 7, 59, 60, 1000] {
            let ahead = predict_ahead(&simulated, &measured, &r, horizon).unwrap();
            for t in 0..60_usize {
                let known = (t + 1).saturating_sub(horizon);
                let want = match known {
                    0 => simulated[t],
                    known => simulated[t] + forecast(&v[..known], &r, horizon),
                };
                assert!((ahead[t] - want).abs() < 1e-12, "{horizon} {t}: {} {want}", ahead[t]);
            }
        }
    }

    #[test]
    fn white_errors_are_not_expected() {
        let (simulated, measured) = ([1.0, 2.0, 3.0], [1.5, 1.0, 4.0]);
        for whitening in [&[][..], &[1.0]] {
            assert_eq!(predict_ahead(&simulated, &measured, whitening, 1).unwrap(), simulated);
        }
    }

    #[test]
    fn one_step_ahead_leaves_the_white_error() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(2);
        let e: Vec<f64> = (0..200).map(|_| rng.random_range(-1.0..1.0)).collect();
        let mut v: Vec<f64> = Vec::new();
        for t in 0..e.len() {
            let past = |i: usize| if t >= i { v[t - i] } else { 0.0 };
            v.push(e[t] + 0.9 * past(1) - 0.4 * past(2));
        }
        let ahead = predict_ahead(&vec![0.0; 200], &v, &[1.0, -0.9, 0.4], 1).unwrap();
        for t in 0..200 {
            assert!((v[t] - ahead[t] - e[t]).abs() < 1e-12);
        }
    }

    #[test]
    fn what_has_no_meaning_is_refused() {
        let message = |s: &[f64], y: &[f64], r: &[f64], k| predict_ahead(s, y, r, k).unwrap_err().to_string();
        assert!(message(&[1.0], &[1.0], &[1.0], 0).contains("the horizon"));
        assert!(message(&[1.0], &[1.0], &[2.0, 1.0], 1).contains("noise model"));
        assert!(matches!(
            predict_ahead(&[1.0], &[], &[1.0], 1),
            Err(Error::Data(DataError::LengthMismatch { .. }))
        ));
        assert!(message(&[1.0, 2.0], &[1.0, f64::NAN], &[1.0], 1).contains("sample 1"));
    }
}
