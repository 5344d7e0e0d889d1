//! Excitation signals. They are sampled and have seeds. For each there is a function that returns its samples.
//!
//! | function | signal | size |
//! |---|---|---|
//! | [`white_uniform`] | independent, uniform | largest absolute value |
//! | [`white_gaussian`] | independent, Gaussian | standard deviation |
//! | [`multisine`] | sum of harmonics of equal size in a band | largest absolute value |
//! | [`Chirp`] | sine of rising frequency | largest absolute value |
//! | [`prbs`] | maximum-length binary sequence | largest absolute value |
//! | [`multilevel`] | random equidistant levels, held | largest absolute value |
//! | [`step`] | zero, then constant | the constant |
//! | [`zero`] | nothing | |
//!
//! Frequencies are in Hz, sample times in s, holds and starts in samples. Every seed gives its own signal, which is the same on every
//! machine.

mod periodic;
mod random;

pub use periodic::{Chirp, Phases, Sweep, multisine};
#[cfg(test)]
pub(crate) use random::gaussian;
pub use random::{multilevel, prbs, white_gaussian, white_uniform};

use crate::error::{Error, Result};

/// `n` samples: 0 before sample `start`, `amplitude` from it on.
///
/// # Errors
/// [`Error::Parameter`] unless the amplitude is finite.
pub fn step(n: usize, amplitude: f64, start: usize) -> Result<Vec<f64>> {
    if !amplitude.is_finite() {
        return Err(invalid("amplitude", amplitude, "finite"));
    }
    Ok((0..n).map(|k| if k < start { 0.0 } else { amplitude }).collect())
}

/// `n` zeros.
pub fn zero(n: usize) -> Vec<f64> {
    vec![0.0; n]
}

fn invalid(name: &str, value: f64, requirement: &'static str) -> Error {
    Error::parameter(name, value, requirement)
}

/// Refuses a size that is negative or not finite.
fn check_amplitude(amplitude: f64) -> Result<()> {
    if amplitude >= 0.0 && amplitude.is_finite() {
        return Ok(());
    }
    Err(invalid("amplitude", amplitude, "finite and not negative"))
}

/// Refuses a band that does not lie between 0 and half the sampling frequency.
fn check_band(f_min: f64, f_max: f64, sample_time: f64) -> Result<()> {
    if !(sample_time > 0.0 && sample_time.is_finite()) {
        return Err(invalid("sample_time", sample_time, "positive and finite (in s)"));
    }
    if !(f_min >= 0.0 && f_min.is_finite()) {
        return Err(invalid("f_min", f_min, "finite and not negative (in Hz)"));
    }
    if !(f_max > f_min && f_max <= 0.5 / sample_time) {
        return Err(invalid(
            "f_max",
            f_max,
            "greater than f_min and at most half the sampling frequency (in Hz)",
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_starts_where_it_is_asked_to() {
        assert_eq!(step(4, -2.0, 2).unwrap(), [0.0, 0.0, -2.0, -2.0]);
        assert_eq!(step(2, 1.0, 9).unwrap(), zero(2));
        assert!(step(2, f64::NAN, 0).unwrap_err().to_string().contains("amplitude"));
    }
}
