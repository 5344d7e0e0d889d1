//! Zero-phase smoothing with a cut-off from the data, and shifts by a part of a sample.

use realfft::RealFftPlanner;

use super::limits::{CUT_OFF_MARGIN, FLAT_NOISE, NOISE_FROM, SEGMENT, STANDS_OUT, STEEPNESS};
use crate::linalg::Complex;

/// The noise of an encoder's angle, from its spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise {
    /// The standard deviation of the white part of a sample.
    pub sd: f64,
    /// The highest frequency at which the signal is above the noise, Hz.
    pub band: f64,
    /// Whether the signal reaches the frequencies where the noise is estimated: it was sampled too slowly to separate the two.
    pub unresolved: bool,
    /// The factor by which the spectrum falls from the lower to the upper half of the range where only noise is expected.
    pub fall: f64,
}

impl Noise {
    /// The white noise of a sampled position, and the band of the motion.
    pub fn of(q: &[f64], step: f64) -> Noise {
        // Second differences remove the slow motion's leakage; their gain is known.
        let bent: Vec<f64> = q.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]).collect();
        let length = super::fourier::friendly(SEGMENT.min(bent.len() / 8).max(16).min(bent.len()));
        let power = periodogram(&bent, length);
        let share = |k: usize| k as f64 / length as f64;
        let gain = |k: usize| (2.0 * (std::f64::consts::PI * share(k)).sin()).powi(4);
        let power: Vec<f64> = (0..power.len()).map(|k| power[k] / gain(k).max(1e-30)).collect();
        let median = |from: f64, to: f64| {
            let mut part: Vec<f64> = (0..power.len())
                .filter(|&k| (from..=to).contains(&share(k)))
                .map(|k| power[k])
                .collect();
            part.sort_unstable_by(f64::total_cmp);
            part.get(part.len() / 2).copied().unwrap_or(0.0)
        };
        let floor = median(NOISE_FROM, 0.5);
        // The smoothed velocity is best if it ends where a higher end would add more noise than motion. A line of an encoder's steps, which a
        // steady motion passes in time, does not outweigh the noise below it.
        let (mut sum, mut best, mut last) = (0.0, 0.0, 0);
        for k in (0..power.len()).take_while(|&k| share(k) < NOISE_FROM) {
            sum += share(k).powi(2) * (power[k] - STANDS_OUT * floor);
            if sum > best {
                (best, last) = (sum, k);
            }
        }
        let middle = 0.5 * (NOISE_FROM + 0.5);
        let fall = median(NOISE_FROM, middle) / median(middle, 0.5).max(f64::MIN_POSITIVE);
        Noise {
            sd: floor.sqrt(),
            band: share(last + 1) / step,
            unresolved: share(last + 1) > NOISE_FROM - 0.1 && fall > FLAT_NOISE,
            fall,
        }
    }

    /// The cut-off of the smoothing filter, Hz.
    pub fn cut_off(&self) -> f64 {
        CUT_OFF_MARGIN * self.band
    }

    /// The standard deviation of the smoothed velocity's noise.
    pub fn velocity_sd(&self, step: f64) -> f64 {
        let edge = 2.0 * std::f64::consts::PI * self.cut_off();
        self.sd * edge * (2.0 * step * self.cut_off() / 3.0).sqrt()
    }
}

/// The averaged periodogram with Hann windows that overlap by half: the variance a sample has at each frequency.
fn periodogram(x: &[f64], length: usize) -> Vec<f64> {
    let window: Vec<f64> = (0..length)
        .map(|i| (std::f64::consts::PI * (i as f64 + 0.5) / length as f64).sin().powi(2))
        .collect();
    let norm: f64 = window.iter().map(|w| w * w).sum();
    let fft = RealFftPlanner::new().plan_fft_forward(length);
    let mut total = vec![0.0; length / 2 + 1];
    let mut segments = 0;
    let mut start = 0;
    while start + length <= x.len() {
        let mut part: Vec<f64> = window.iter().zip(&x[start..]).map(|(w, x)| w * x).collect();
        let mut lines = fft.make_output_vec();
        let _ = fft.process(&mut part, &mut lines);
        total
            .iter_mut()
            .zip(&lines)
            .for_each(|(t, v)| *t += v.norm_sqr() / norm);
        segments += 1;
        start += (length / 2).max(1);
    }
    total.iter_mut().for_each(|t| *t /= f64::from(segments.max(1)));
    total
}

/// The gain of the smoothing filter with this cut-off in Hz at w rad/s.
pub(super) fn gain(w: f64, cut_off: f64) -> f64 {
    1.0 / (1.0 + (w / (2.0 * std::f64::consts::PI * cut_off)).powi(STEEPNESS))
}

/// A signal continued at both ends by its reflection in the end point, as a spectrum to filter in.
///
/// Forward-backward filters treat the ends in this way (Gustafsson 1996): the signal and its slope are continuous.
pub(super) struct Reflected {
    lines: Vec<Complex<f64>>,
    /// The number of samples, and the index of the first one in the continued signal.
    samples: usize,
    ahead: usize,
    length: usize,
    step: f64,
    /// The straight line that was subtracted: its value at the first sample and its slope a sample.
    offset: f64,
    slope: f64,
}

impl Reflected {
    /// Continues the samples `x`, `step` s apart.
    pub fn new(x: &[f64], step: f64) -> Self {
        let n = x.len();
        let ahead = (n - 1).min(n / 4 + 64);
        let last = n - 1;
        let front = (1..=ahead).rev().map(|i| 2.0 * x[0] - x[i]);
        let back = (1..=ahead).map(|i| 2.0 * x[last] - x[last - i]);
        let long: Vec<f64> = front.chain(x.iter().copied()).chain(back).collect();
        // One period: without the line, the last point would repeat the first.
        let all = long.len();
        let slope = (long[all - 1] - long[0]) / (all - 1) as f64;
        // A length with a fast transform; the line goes from its first to its last point.
        let length = all - 1;
        let mut flat: Vec<f64> = (0..length).map(|i| long[i] - long[0] - slope * i as f64).collect();
        let fft = RealFftPlanner::new().plan_fft_forward(length);
        let mut lines = fft.make_output_vec();
        let _ = fft.process(&mut flat, &mut lines);
        Reflected {
            lines,
            samples: n,
            ahead,
            length,
            step,
            offset: long[0] + slope * ahead as f64,
            slope,
        }
    }

    fn back(&self, response: impl Fn(f64) -> Complex<f64>) -> Vec<f64> {
        let spacing = 2.0 * std::f64::consts::PI / (self.length as f64 * self.step);
        let mut lines: Vec<Complex<f64>> = self
            .lines
            .iter()
            .enumerate()
            .map(|(k, v)| v * response(spacing * k as f64) / self.length as f64)
            .collect();
        // A real signal's lines at both ends are real.
        let last = lines.len() - 1;
        lines[0].im = 0.0;
        if self.length.is_multiple_of(2) {
            lines[last].im = 0.0;
        }
        let inverse = RealFftPlanner::new().plan_fft_inverse(self.length);
        let mut long = inverse.make_output_vec();
        let _ = inverse.process(&mut lines, &mut long);
        long[self.ahead..self.ahead + self.samples].to_vec()
    }

    /// The smoothed first derivative with this cut-off in Hz.
    pub fn velocity(&self, cut_off: f64) -> Vec<f64> {
        let mut v = self.back(|w| Complex::new(0.0, w * gain(w, cut_off)));
        v.iter_mut().for_each(|v| *v += self.slope / self.step);
        v
    }

    /// The smoothed signal with this cut-off in Hz.
    pub fn smoothed(&self, cut_off: f64) -> Vec<f64> {
        let mut x = self.back(|w| Complex::new(gain(w, cut_off), 0.0));
        for (i, v) in x.iter_mut().enumerate() {
            *v += self.offset + self.slope * i as f64;
        }
        x
    }

    /// The integral of the part of the signal that the smoothing with this cut-off removes.
    pub fn integral_above(&self, cut_off: f64) -> Vec<f64> {
        self.back(|w| match w > 0.0 {
            true => Complex::new(0.0, -(1.0 - gain(w, cut_off)) / w),
            false => Complex::new(0.0, 0.0),
        })
    }

    /// The signal `ahead` s later: x(t + ahead).
    pub fn shifted(&self, ahead: f64) -> Vec<f64> {
        let mut x = self.back(|w| Complex::new(0.0, w * ahead).exp());
        let shift = ahead / self.step;
        for (i, v) in x.iter_mut().enumerate() {
            *v += self.offset + self.slope * (i as f64 + shift);
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64;
    use std::f64::consts::TAU;

    /// The band of sines of these frequencies in Hz and amplitudes in rad, sampled every ms in steps of 1e-4 rad.
    fn band(sines: &[[f64; 2]]) -> f64 {
        let mut rng = Pcg64::seed_from_u64(4);
        let phases: Vec<f64> = sines.iter().map(|_| rng.random_range(0.0..TAU)).collect();
        let angle = |i: usize| -> f64 {
            let line = |([f, a], phase): (&[f64; 2], &f64)| a * (TAU * f * 1e-3 * i as f64 + phase).sin();
            sines.iter().zip(&phases).map(line).sum()
        };
        let steps: Vec<f64> = (0..20_000).map(|i| (angle(i) / 1e-4).round() * 1e-4).collect();
        Noise::of(&steps, 1e-3).band
    }

    #[test]
    fn the_band_ends_with_the_motion_and_not_at_lines_of_the_encoders_steps() {
        let motion = [[0.7, 0.5], [3.1, 0.1], [9.7, 0.02], [18.3, 0.005]];
        let alone = band(&motion);
        assert!((18.3..25.0).contains(&alone), "{alone}");
        // A drive at constant speed passes the encoder's steps at one frequency. Seven lines of the spectrum then stand out of the noise.
        let lines = [330.0, 330.5, 331.0, 331.5, 332.0].map(|f| [f, 3e-6]);
        let with_lines = band(&[&motion[..], &lines].concat());
        assert!((18.3..25.0).contains(&with_lines), "{with_lines}");
        // A resonance that moves the axis belongs to the motion.
        let with_resonance = band(&[&motion[..], &[[140.0, 3e-3]]].concat());
        assert!((140.0..150.0).contains(&with_resonance), "{with_resonance}");
    }
}
