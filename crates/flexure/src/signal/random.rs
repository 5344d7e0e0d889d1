//! White noise, binary and multilevel sequences.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

use super::{check_amplitude, invalid};
use crate::error::Result;

/// `n` independent samples, uniform on `-amplitude .. amplitude`.
///
/// # Errors
/// [`Error::Parameter`](crate::Error::Parameter) unless the amplitude is finite and
/// not negative.
pub fn white_uniform(n: usize, amplitude: f64, seed: u64) -> Result<Vec<f64>> {
    check_amplitude(amplitude)?;
    let mut rng = Pcg64::seed_from_u64(seed);
    Ok((0..n).map(|_| amplitude * (2.0 * rng.random::<f64>() - 1.0)).collect())
}

/// `n` independent Gaussian samples of zero mean and the standard deviation `std`.
///
/// # Errors
/// [`Error::Parameter`](crate::Error::Parameter) unless `std` is finite and not
/// negative.
pub fn white_gaussian(n: usize, std: f64, seed: u64) -> Result<Vec<f64>> {
    const RANGE: &str = "a standard deviation, finite and not negative";
    if !(std >= 0.0 && std.is_finite()) {
        return Err(invalid("amplitude", std, RANGE));
    }
    let normal = Normal::new(0.0, std).map_err(|_| invalid("amplitude", std, RANGE))?;
    Ok(normal.sample_iter(Pcg64::seed_from_u64(seed)).take(n).collect())
}

/// Gaussian samples of unit variance, for tests.
#[cfg(test)]
pub(crate) fn gaussian(n: usize, seed: u64) -> Vec<f64> {
    white_gaussian(n, 1.0, seed).unwrap()
}

/// `n` samples on `levels` equidistant levels from `-amplitude` to `amplitude`, each drawn
/// independently and held for `hold` samples.
///
/// # Errors
/// [`Error::Parameter`](crate::Error::Parameter) unless the amplitude is finite and
/// not negative, there are at least two levels, and `hold` is at least 1.
pub fn multilevel(n: usize, amplitude: f64, levels: usize, hold: usize, seed: u64) -> Result<Vec<f64>> {
    check_amplitude(amplitude)?;
    if levels < 2 {
        return Err(invalid("levels", levels as f64, "at least 2"));
    }
    check_hold(hold)?;
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut level = 0.0;
    Ok((0..n)
        .map(|k| {
            if k % hold == 0 {
                let drawn = rng.random_range(0..levels) as f64;
                level = amplitude * (2.0 * drawn / (levels - 1) as f64 - 1.0);
            }
            level
        })
        .collect())
}

fn check_hold(hold: usize) -> Result<()> {
    if hold == 0 {
        return Err(invalid("hold", 0.0, "at least 1 (in samples)"));
    }
    Ok(())
}

/// The taps, counted from 1, of a shift register of maximum period, for the register lengths 2 to 24.
const TAPS: [&[u32]; 23] = [
    &[2, 1],
    &[3, 2],
    &[4, 3],
    &[5, 3],
    &[6, 5],
    &[7, 6],
    &[8, 6, 5, 4],
    &[9, 5],
    &[10, 7],
    &[11, 9],
    &[12, 6, 4, 1],
    &[13, 4, 3, 1],
    &[14, 5, 3, 1],
    &[15, 14],
    &[16, 15, 13, 4],
    &[17, 14],
    &[18, 11],
    &[19, 6, 2, 1],
    &[20, 17],
    &[21, 19],
    &[22, 21],
    &[23, 18],
    &[24, 23, 22, 17],
];

/// `n` samples of a pseudo-random binary sequence of the values `amplitude` and `-amplitude`, each
/// held for `hold` samples.
///
/// The sequence is of maximum length, with the period `(2^order - 1) * hold`; `order` is 2 to 24. Without it, the smallest order whose
/// period covers `n` is taken. The seed chooses the place in the period at which the sequence starts.
///
/// # Errors
/// [`Error::Parameter`](crate::Error::Parameter) unless the amplitude is finite and
/// not negative, `hold` is at least 1, and the order is 2 to 24.
pub fn prbs(n: usize, amplitude: f64, hold: usize, order: Option<u32>, seed: u64) -> Result<Vec<f64>> {
    check_amplitude(amplitude)?;
    check_hold(hold)?;
    let order = order.unwrap_or_else(|| (2..24).find(|o| ((1 << o) - 1) >= n.div_ceil(hold)).unwrap_or(24));
    let Some(taps) = order.checked_sub(2).and_then(|i| TAPS.get(i as usize)) else {
        return Err(invalid("order", f64::from(order), "from 2 to 24"));
    };
    let mut register = Pcg64::seed_from_u64(seed).random_range(1..1_u32 << order);
    let mut value = 0.0;
    Ok((0..n)
        .map(|k| {
            if k % hold == 0 {
                value = if register & 1 == 1 { amplitude } else { -amplitude };
                let feedback = taps.iter().fold(0, |bit, tap| bit ^ (register >> (order - tap))) & 1;
                register = (register >> 1) | (feedback << (order - 1));
            }
            value
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(v: &[f64]) -> f64 {
        v.iter().sum::<f64>() / v.len() as f64
    }

    #[test]
    fn white_signals_have_their_moments_and_are_uncorrelated() {
        let n = 100_000;
        let bound = 4.0 / (n as f64).sqrt();
        for (u, variance) in [
            (white_uniform(n, 3.0, 1).unwrap(), 3.0_f64),
            (white_gaussian(n, 2.0, 1).unwrap(), 4.0),
        ] {
            assert!(mean(&u).abs() < bound * variance.sqrt());
            let square: Vec<f64> = u.iter().map(|v| v * v).collect();
            assert!((mean(&square) / variance - 1.0).abs() < 2.0 * bound);
            let lagged: Vec<f64> = u.windows(2).map(|w| w[0] * w[1]).collect();
            assert!(mean(&lagged).abs() < bound * variance);
        }
        assert!(white_uniform(n, 3.0, 1).unwrap().iter().all(|v| v.abs() <= 3.0));
    }

    #[test]
    fn a_seed_repeats_its_signal_and_another_gives_another() {
        assert_eq!(white_uniform(9, 1.0, 5), white_uniform(9, 1.0, 5));
        assert_ne!(white_uniform(9, 1.0, 5), white_uniform(9, 1.0, 6));
        assert_ne!(prbs(99, 1.0, 1, None, 5), prbs(99, 1.0, 1, None, 6));
    }

    #[test]
    fn every_prbs_order_has_its_maximum_period() {
        for order in 2..=24 {
            let period = (1_usize << order) - 1;
            let u = prbs(period + order as usize, 1.0, 1, Some(order), 3).unwrap();
            // Over one period there is one +1 more than there are -1 (or an odd sign balance)
            // and the register, that is any `order` successive values, returns for the first time.
            assert_eq!(u[..period].iter().sum::<f64>(), 1.0, "order {order}");
            let window = &u[..order as usize];
            let returns = (1..=period).find(|&k| &u[k..k + order as usize] == window);
            assert_eq!(returns, Some(period), "order {order}");
        }
    }

    #[test]
    fn multilevel_holds_each_level() {
        let u = multilevel(30_000, 2.0, 5, 3, 1).unwrap();
        assert!(u.chunks(3).all(|c| c.iter().all(|v| *v == c[0])));
        for level in [-2.0, -1.0, 0.0, 1.0, 2.0] {
            let share = u.iter().filter(|v| **v == level).count() as f64 / 30_000.0;
            assert!((share - 0.2).abs() < 0.02, "{level}: {share}");
        }
    }

    #[test]
    fn bad_parameters_are_named() {
        for (error, word) in [
            (white_uniform(1, -1.0, 0), "amplitude is -1"),
            (white_gaussian(1, f64::NAN, 0), "amplitude is NaN"),
            (multilevel(1, 1.0, 1, 1, 0), "levels is 1, but must be at least 2"),
            (multilevel(1, 1.0, 2, 0, 0), "hold is 0"),
            (prbs(1, 1.0, 1, Some(40), 0), "order is 40, but must be from 2 to 24"),
            (prbs(1, 1.0, 1, Some(1), 0), "order is 1"),
        ] {
            let message = error.unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
    }
}
