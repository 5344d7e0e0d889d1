//! Measurement noise on a simulated record.

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

use crate::error::{Error, Result};
use crate::record::Record;

/// A copy of `record` with Gaussian noise of zero mean added to the named columns.
///
/// `std` gives names and standard deviations, in the columns' units; not negative. Every column
/// draws from its own stream of the seed, given by its position in the record, so noise on one column does not change the noise on another.
///
/// # Errors
/// [`Error::Data`]: `MissingColumn`; [`Error::Parameter`] for a standard deviation that is negative
/// or not finite, or for noise on the time.
pub fn add_noise(record: &Record, seed: u64, std: &[(&str, f64)]) -> Result<Record> {
    for &(name, value) in std {
        record.column(name)?;
        let distribution = |requirement| Error::parameter(format!("the noise of column '{name}'"), value, requirement);
        if name == "t" {
            return Err(distribution("left out: the sample instants are exact"));
        }
        if !(value >= 0.0 && value.is_finite()) {
            return Err(distribution("a standard deviation, finite and not negative"));
        }
    }
    Record::new(record.columns().enumerate().map(|(index, (name, samples))| {
        let mut samples = samples.to_vec();
        for &(_, deviation) in std.iter().filter(|(noisy, _)| *noisy == name) {
            let mut rng = Pcg64::seed_from_u64(seed ^ (index as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15));
            if let Ok(normal) = Normal::new(0.0, deviation) {
                samples.iter_mut().for_each(|v| *v += normal.sample(&mut rng));
            }
        }
        (name, samples)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> Record {
        Record::new([
            ("t", vec![0.0; 20_000]),
            ("q1", vec![1.0; 20_000]),
            ("q2", vec![2.0; 20_000]),
        ])
        .unwrap()
    }

    #[test]
    fn noise_has_its_size_its_seed_and_its_own_stream() {
        let one = add_noise(&record(), 7, &[("q1", 0.5)]).unwrap();
        let both = add_noise(&record(), 7, &[("q2", 0.1), ("q1", 0.5)]).unwrap();
        let other = add_noise(&record(), 8, &[("q1", 0.5)]).unwrap();
        assert_eq!(one.column("q1"), both.column("q1"));
        assert_ne!(one.column("q1"), other.column("q1"));
        assert_eq!(one.column("q2").unwrap(), record().column("q2").unwrap());
        let e: Vec<f64> = both.column("q1").unwrap().iter().map(|v| v - 1.0).collect();
        let f: Vec<f64> = both.column("q2").unwrap().iter().map(|v| v - 2.0).collect();
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let std = mean(&e.iter().map(|v| v * v).collect::<Vec<_>>()).sqrt();
        assert!((std - 0.5).abs() < 0.01 && mean(&e).abs() < 0.02);
        let cross = mean(&e.iter().zip(&f).map(|(a, b)| a * b).collect::<Vec<_>>());
        assert!(cross.abs() < 4.0 * 0.5 * 0.1 / (20_000.0_f64).sqrt());
    }

    #[test]
    fn bad_noise_is_named() {
        let message = |std: &[(&str, f64)]| add_noise(&record(), 1, std).unwrap_err().to_string();
        assert!(message(&[("q1", -1.0)]).contains("column 'q1' is -1"));
        assert!(message(&[("t", 1.0)]).contains("exact"));
        assert!(message(&[("tau1", 1.0)]).contains("no column 'tau1'"));
    }
}
