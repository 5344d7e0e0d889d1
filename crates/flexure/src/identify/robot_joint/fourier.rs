//! Derivatives without differentiating: modulated Fourier integrals.
//!
//! An equation of motion that holds at every instant also holds for its product with a window w that vanishes
//! with its first derivative at both ends of the record. The Fourier integral of that product moves every derivative
//! from the noisy signal to the window by parts (Shinbrot 1957; Pearson & Lee 1985):
//!
//! $$ \int w\,\ddot q\, e^{-i\omega t} dt
//!    = \int \left(\ddot w - 2 i\omega \dot w - \omega^2 w\right) q\, e^{-i\omega t} dt. $$
//!
//! The equation becomes one complex equation for each frequency. The noise is independent from one frequency to the next, so weights allow
//! for noise of any colour.

use std::sync::Arc;

use realfft::{RealFftPlanner, RealToComplex};

use super::limits::RAMP;
use crate::linalg::Complex;
use crate::linear::correlation::mean;
use crate::parallel;

/// The window, its derivatives and the frequencies of a record's modulated Fourier integrals.
pub(super) struct Modulation {
    /// The window and its first and second derivative.
    window: [Vec<f64>; 3],
    /// One over the window's norm: white noise of variance s has spectral lines of mean square s.
    scale: f64,
    /// The frequencies in use, rad/s.
    pub omega: Vec<f64>,
    /// The gain of a mean over the time of a sample, at each frequency.
    mean_gain: Vec<f64>,
    fft: Arc<dyn RealToComplex<f64>>,
}

impl Modulation {
    /// The frequencies from 0 to `highest` Hz for `n` samples `step` s apart; a few samples at the end stay unused.
    pub fn new(n: usize, step: f64, highest: f64) -> Self {
        let n = friendly(n);
        let ramp = ((n as f64 * RAMP) as usize).max(8).min(n / 2);
        let mut window = [vec![1.0; n], vec![0.0; n], vec![0.0; n]];
        let length = ramp as f64 * step;
        for i in 0..=ramp.min(n - 1) {
            let x = i as f64 / ramp as f64;
            let rise = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
            let slope = 30.0 * x * x * (1.0 - x) * (1.0 - x) / length;
            let bend = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / (length * length);
            for (at, sign) in [(i, 1.0), (n - 1 - i, -1.0)] {
                window[0][at] = rise;
                window[1][at] = sign * slope;
                window[2][at] = bend;
            }
        }
        let norm = window[0].iter().map(|w| w * w).sum::<f64>().sqrt();
        let spacing = 1.0 / (n as f64 * step);
        let lines = ((highest / spacing) as usize + 1).min(n / 2);
        let omega: Vec<f64> = (0..lines)
            .map(|k| 2.0 * std::f64::consts::PI * spacing * k as f64)
            .collect();
        let gain = |w: &f64| match 0.5 * w * step {
            half if half > 0.0 => half.sin() / half,
            _ => 1.0,
        };
        Modulation {
            window,
            scale: 1.0 / norm,
            mean_gain: omega.iter().map(gain).collect(),
            omega,
            fft: RealFftPlanner::new().plan_fft_forward(n),
        }
    }

    /// The number of frequencies.
    pub fn len(&self) -> usize {
        self.omega.len()
    }

    /// The number of samples under the window.
    pub fn samples(&self) -> usize {
        self.window[0].len()
    }

    /// The share of each sample in a mean over the window's square, the power of the modulated signal.
    pub fn shares(&self) -> impl Iterator<Item = f64> + '_ {
        self.window[0].iter().map(|w| (w * self.scale).powi(2))
    }

    /// The spectrum of the `derivative`-th derivative of the window times x.
    fn lines(&self, x: &[f64], derivative: usize, about: f64) -> Vec<Complex<f64>> {
        let window = &self.window[derivative];
        let mut product: Vec<f64> = window.iter().zip(x).map(|(w, x)| w * (x - about)).collect();
        let mut spectrum = self.fft.make_output_vec();
        // Cannot fail: the lengths are the plan's own.
        let _ = self.fft.process(&mut product, &mut spectrum);
        spectrum.truncate(self.len());
        spectrum.iter_mut().for_each(|v| *v *= self.scale);
        spectrum
    }

    /// The modulated integrals of x.
    pub fn of(&self, x: &[f64]) -> Vec<Complex<f64>> {
        self.lines(x, 0, 0.0)
    }

    /// The modulated integrals of the first derivative of x.
    pub fn of_rate(&self, x: &[f64]) -> Vec<Complex<f64>> {
        let about = mean(x);
        let [plain, rate] = [0, 1].map(|k| self.lines(x, k, about));
        let lines = self.omega.iter().zip(plain.iter().zip(&rate));
        lines.map(|(&w, (p, r))| Complex::new(0.0, w) * p - r).collect()
    }

    /// The modulated integrals of the second derivative of x.
    pub fn of_acceleration(&self, x: &[f64]) -> Vec<Complex<f64>> {
        let about = mean(x);
        let [plain, rate, bend] = [0, 1, 2].map(|k| self.lines(x, k, about));
        (0..self.len())
            .map(|k| {
                let w = self.omega[k];
                bend[k] - rate[k] * Complex::new(0.0, 2.0 * w) - plain[k] * (w * w)
            })
            .collect()
    }

    /// Turns the lines of a signal into those of its means over the time of each sample.
    pub fn take_mean(&self, lines: &mut [Complex<f64>]) {
        lines.iter_mut().zip(&self.mean_gain).for_each(|(v, gain)| *v *= *gain);
    }

    /// Turns the lines of means over the time of each sample into those of the signal.
    pub fn undo_mean(&self, lines: &mut [Complex<f64>]) {
        lines.iter_mut().zip(&self.mean_gain).for_each(|(v, gain)| *v /= *gain);
    }

    /// The modulated integrals of many signals.
    pub fn of_all(&self, columns: &[Vec<f64>]) -> Vec<Vec<Complex<f64>>> {
        parallel::batch(columns, |x| self.of(x))
    }
}

/// Whether a number has no prime factors above 7.
fn smooth(mut n: usize) -> bool {
    for p in [2, 3, 5, 7] {
        while n > 0 && n.is_multiple_of(p) {
            n /= p;
        }
    }
    n == 1
}

/// The largest number up to n without prime factors above 7.
pub(super) fn friendly(n: usize) -> usize {
    (1..=n).rev().find(|&m| smooth(m)).unwrap_or(n)
}

/// The smallest even number from n on without prime factors above 7.
pub(super) fn smooth_from(n: usize) -> usize {
    (n..).find(|&m| m.is_multiple_of(2) && smooth(m)).unwrap_or(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_signal() {
        // Sums replace integrals: the acceleration's error is the square of a sample's share of the window's ramp.
        for (n, step, rate_error, acceleration_error) in [(5000, 0.002, 1e-7, 2e-4), (50_000, 0.0002, 1e-10, 2e-6)] {
            differentiate(n, step, [rate_error, acceleration_error]);
        }
    }

    fn differentiate(n: usize, step: f64, tolerances: [f64; 2]) {
        let at = |i: usize| i as f64 * step;
        let q: Vec<f64> = (0..n).map(|i| 3.0 + at(i) + (7.0 * at(i)).sin()).collect();
        let rate: Vec<f64> = (0..n).map(|i| 1.0 + 7.0 * (7.0 * at(i)).cos()).collect();
        let bend: Vec<f64> = (0..n).map(|i| -49.0 * (7.0 * at(i)).sin()).collect();
        let modulation = Modulation::new(n, step, 20.0);
        let both = [
            (modulation.of_rate(&q), modulation.of(&rate)),
            (modulation.of_acceleration(&q), modulation.of(&bend)),
        ];
        for ((got, want), tolerance) in both.into_iter().zip(tolerances) {
            let size = want.iter().map(|v| v.norm()).fold(0.0, f64::max);
            let error = got.iter().zip(&want).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(error < tolerance * size, "{error} of {size}");
        }
    }

    #[test]
    fn friendly_lengths_are_near() {
        assert_eq!(friendly(60_001), 60_000);
        assert_eq!(friendly(7), 7);
        assert_eq!(friendly(1), 1);
        assert_eq!(friendly(11), 10);
    }
}
