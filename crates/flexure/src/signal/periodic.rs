//! Multisines and chirps.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use realfft::RealFftPlanner;

use super::{check_amplitude, check_band, invalid};
use crate::error::Result;
use crate::linalg::Complex;

/// How the phases of a multisine are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phases {
    /// Independent and uniform: close to Gaussian in amplitude.
    Random {
        /// The seed.
        seed: u64,
    },
    /// Schroeder's quadratic phases: a low crest factor.
    Schroeder,
    /// Random phases, improved towards a low crest factor: the signal is clipped and the lines' sizes are restored, in turn (van der
    /// Ouderaa, Schoukens & Renneboog 1988). This gives the most power for a given largest value.
    LowCrest {
        /// The seed.
        seed: u64,
    },
}

/// Rounds of clipping and restoring.
const ROUNDS: usize = 150;
/// The clipping level as a share of the largest value, in the first round and in the last.
const CLIP: [f64; 2] = [0.7, 0.97];

/// `n` samples of a sum of sines of equal size: all the harmonics of `1 / (n sample_time)` from
/// `f_min` to `f_max` (without 0), scaled so that the largest absolute value is `amplitude`.
///
/// The `n` samples are exactly one period.
///
/// # Errors
/// [`Error::Parameter`](crate::Error::Parameter) unless the amplitude is finite and
/// not negative and `0 <= f_min < f_max <= 1 / (2 sample_time)` with a harmonic in between.
pub fn multisine(
    n: usize,
    sample_time: f64,
    amplitude: f64,
    f_min: f64,
    f_max: f64,
    phases: Phases,
) -> Result<Vec<f64>> {
    check_amplitude(amplitude)?;
    check_band(f_min, f_max, sample_time)?;
    let span = n as f64 * sample_time;
    // The bounds may be harmonics themselves, except for rounding.
    let first = (f_min * span * (1.0 - 1e-12)).ceil().max(1.0) as usize;
    // The harmonic at half the sampling frequency cannot have an arbitrary phase.
    let last = ((f_max * span * (1.0 + 1e-12)).floor() as usize).min(n.saturating_sub(1) / 2);
    if first > last {
        return Err(invalid(
            "f_max",
            f_max,
            "wide enough of f_min that a harmonic of 1 / (samples * sample_time) lies between (in Hz)",
        ));
    }
    let lines = (last - first + 1) as f64;
    let mut spectrum = vec![Complex::new(0.0, 0.0); n / 2 + 1];
    let mut rng = match phases {
        Phases::Random { seed } | Phases::LowCrest { seed } => Some(Pcg64::seed_from_u64(seed)),
        Phases::Schroeder => None,
    };
    for (i, line) in spectrum[first..=last].iter_mut().enumerate() {
        let phase = match &mut rng {
            Some(rng) => TAU * rng.random::<f64>(),
            None => -0.5 * TAU * i as f64 * (i as f64 + 1.0) / lines,
        };
        *line = Complex::from_polar(1.0, phase);
    }
    if matches!(phases, Phases::LowCrest { .. }) {
        lower_crest(&mut spectrum, first, last, n)?;
    }
    let mut signal = in_time(&mut spectrum, n)?;
    let peak = largest(&signal);
    if peak > 0.0 {
        signal.iter_mut().for_each(|v| *v *= amplitude / peak);
    }
    Ok(signal)
}

/// The signal of a spectrum. The spectrum is overwritten.
fn in_time(spectrum: &mut [Complex<f64>], n: usize) -> Result<Vec<f64>> {
    let mut signal = vec![0.0; n];
    // The lengths fit by construction, and the lines at 0 and half the sampling frequency are zero.
    RealFftPlanner::new()
        .plan_fft_inverse(n)
        .process(spectrum, &mut signal)
        .map_err(|_| invalid("samples", n as f64, "a length that can be transformed"))?;
    Ok(signal)
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0_f64, |m, v| m.max(v.abs()))
}

/// Turns the phases of the lines from `first` to `last`, all of size 1, towards a low crest factor.
fn lower_crest(spectrum: &mut [Complex<f64>], first: usize, last: usize, n: usize) -> Result<()> {
    let forward = RealFftPlanner::new().plan_fft_forward(n);
    let mut best = (f64::INFINITY, spectrum.to_vec());
    for round in 0..=ROUNDS {
        let mut signal = in_time(&mut spectrum.to_vec(), n)?;
        let peak = largest(&signal);
        if peak < best.0 {
            best = (peak, spectrum.to_vec());
        }
        let limit = peak * (CLIP[0] + (CLIP[1] - CLIP[0]) * round as f64 / ROUNDS as f64);
        signal.iter_mut().for_each(|v| *v = v.clamp(-limit, limit));
        let mut clipped = forward.make_output_vec();
        forward
            .process(&mut signal, &mut clipped)
            .map_err(|_| invalid("samples", n as f64, "a length that can be transformed"))?;
        for (line, found) in spectrum[first..=last].iter_mut().zip(&clipped[first..=last]) {
            let size = found.norm();
            if size > 0.0 {
                *line = found / size;
            }
        }
    }
    spectrum.copy_from_slice(&best.1);
    Ok(())
}

/// How a chirp's frequency rises.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sweep {
    /// By the same number of Hz per second.
    #[default]
    Linear,
    /// By the same factor per second; `f_min` must be positive.
    Logarithmic,
}

/// A sine whose frequency rises from `f_min` to `f_max` over `duration`, and afterwards goes on at the same rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chirp {
    amplitude: f64,
    f_min: f64,
    f_max: f64,
    duration: f64,
    sweep: Sweep,
}

impl Chirp {
    /// A chirp of the given largest absolute value, frequencies in Hz and duration in s.
    ///
    /// # Errors
    /// [`Error::Parameter`](crate::Error::Parameter) unless the amplitude is finite and
    /// not negative, `0 <= f_min < f_max` (`f_min` positive for a logarithmic sweep), and the
    /// duration is positive and finite.
    pub fn new(amplitude: f64, f_min: f64, f_max: f64, duration: f64, sweep: Sweep) -> Result<Self> {
        check_amplitude(amplitude)?;
        if !(duration > 0.0 && duration.is_finite()) {
            return Err(invalid("duration", duration, "positive and finite (in s)"));
        }
        if !(f_min >= 0.0 && f_min.is_finite()) {
            return Err(invalid("f_min", f_min, "finite and not negative (in Hz)"));
        }
        if sweep == Sweep::Logarithmic && f_min == 0.0 {
            return Err(invalid("f_min", f_min, "positive for a logarithmic sweep (in Hz)"));
        }
        if !(f_max > f_min && f_max.is_finite()) {
            return Err(invalid("f_max", f_max, "greater than f_min and finite (in Hz)"));
        }
        Ok(Chirp {
            amplitude,
            f_min,
            f_max,
            duration,
            sweep,
        })
    }

    /// The value at time `t`, s; 0 at time 0.
    pub fn value(&self, t: f64) -> f64 {
        let cycles = match self.sweep {
            Sweep::Linear => t * (self.f_min + 0.5 * (self.f_max - self.f_min) * t / self.duration),
            Sweep::Logarithmic => {
                let rate = (self.f_max / self.f_min).ln() / self.duration;
                self.f_min * (rate * t).exp_m1() / rate
            }
        };
        self.amplitude * (TAU * cycles).sin()
    }

    /// `n` samples from time 0 on.
    ///
    /// # Errors
    /// [`Error::Parameter`](crate::Error::Parameter) unless the sample time is positive
    /// and `f_max` is at most half the sampling frequency.
    pub fn samples(&self, n: usize, sample_time: f64) -> Result<Vec<f64>> {
        check_band(self.f_min, self.f_max, sample_time)?;
        Ok((0..n).map(|k| self.value(k as f64 * sample_time)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_low_crest_factor_is_lower_with_the_same_lines() {
        let crest = |phases| {
            let u = multisine(2000, 0.01, 1.0, 0.1, 8.0, phases).unwrap();
            assert!((largest(&u) - 1.0).abs() < 1e-12);
            1.0 / (u.iter().map(|v| v * v).sum::<f64>() / u.len() as f64).sqrt()
        };
        let (random, schroeder) = (crest(Phases::Random { seed: 3 }), crest(Phases::Schroeder));
        let low = crest(Phases::LowCrest { seed: 3 });
        println!("random {random:.2}, Schroeder {schroeder:.2}, low {low:.2}");
        assert!(low < 1.6 && low < 0.9 * schroeder && low < 0.6 * random);
        let u = multisine(2000, 0.01, 1.0, 0.1, 8.0, Phases::LowCrest { seed: 3 }).unwrap();
        let sizes: Vec<f64> = (2..=160).map(|k| line(&u, k)).collect();
        assert!(sizes.iter().all(|s| (s / sizes[0] - 1.0).abs() < 1e-9));
        assert!(line(&u, 1).abs() + line(&u, 161).abs() < 1e-9 * sizes[0]);
    }

    /// The size of harmonic `k` by direct summation.
    fn line(u: &[f64], k: usize) -> f64 {
        let n = u.len();
        let (mut re, mut im) = (0.0, 0.0);
        for (i, v) in u.iter().enumerate() {
            let angle = TAU * (i * k % n) as f64 / n as f64;
            re += v * angle.cos();
            im += v * angle.sin();
        }
        2.0 * re.hypot(im) / n as f64
    }

    #[test]
    fn a_multisine_has_equal_lines_in_its_band_and_none_outside() {
        for (n, phases) in [
            (500, Phases::Random { seed: 3 }),
            (500, Phases::Schroeder),
            (501, Phases::Schroeder),
        ] {
            let u = multisine(n, 0.01, 2.0, 1.0, 10.0, phases).unwrap();
            let span = n as f64 * 0.01;
            let size = line(&u, 20);
            for k in 0..=n / 2 {
                let f = k as f64 / span;
                let expected = if (1.0..=10.0).contains(&f) { size } else { 0.0 };
                assert!((line(&u, k) - expected).abs() < 1e-12, "line {k}");
            }
            let peak = u.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            assert!((peak - 2.0).abs() < 1e-12);
        }
    }

    #[test]
    fn schroeder_phases_lower_the_crest_factor() {
        let crest = |phases| {
            let u = multisine(2000, 0.01, 1.0, 0.0, 20.0, phases).unwrap();
            1.0 / (u.iter().map(|v| v * v).sum::<f64>() / 2000.0).sqrt()
        };
        assert!(crest(Phases::Schroeder) < 1.8);
        assert!(crest(Phases::Random { seed: 1 }) > 2.2);
    }

    #[test]
    fn a_chirp_has_its_frequencies_at_its_ends() {
        for sweep in [Sweep::Linear, Sweep::Logarithmic] {
            let chirp = Chirp::new(1.5, 1.0, 9.0, 4.0, sweep).unwrap();
            // Instantaneous frequency from the phase of value / amplitude near zero crossings.
            let frequency = |t: f64| {
                let h = 1e-5;
                let (a, b, c) = (chirp.value(t - h), chirp.value(t), chirp.value(t + h));
                let slope = (c - a) / (2.0 * h);
                slope.hypot(0.0) / (TAU * (1.5_f64 * 1.5 - b * b).sqrt())
            };
            assert!((frequency(0.001) - 1.0).abs() < 0.02);
            assert!((frequency(3.999) - 9.0).abs() < 0.05, "{}", frequency(3.999));
        }
    }

    #[test]
    fn bad_parameters_are_named() {
        let many = Phases::Schroeder;
        for (error, word) in [
            (multisine(100, 0.01, 1.0, 5.0, 60.0, many), "f_max is 60"),
            (multisine(100, 0.01, 1.0, 5.1, 5.9, many), "harmonic"),
            (multisine(0, 0.01, 1.0, 5.0, 6.0, many), "harmonic"),
            (multisine(100, 0.0, 1.0, 5.0, 6.0, many), "sample_time"),
            (multisine(100, 0.01, f64::INFINITY, 5.0, 6.0, many), "amplitude"),
            (
                Chirp::new(1.0, 1.0, 60.0, 1.0, Sweep::Linear).unwrap().samples(9, 0.01),
                "f_max is 60",
            ),
        ] {
            let message = error.unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
        assert!(Chirp::new(1.0, 0.0, 2.0, 1.0, Sweep::Logarithmic).is_err());
        assert!(Chirp::new(1.0, 2.0, 2.0, 1.0, Sweep::Linear).is_err());
        assert!(Chirp::new(1.0, 1.0, 2.0, 0.0, Sweep::Linear).is_err());
    }
}
