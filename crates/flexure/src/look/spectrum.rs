//! The power spectrum of a column (Welch 1967), and the band that has most of its power.

use realfft::RealFftPlanner;

use super::limits::{LONGEST_SEGMENT, SEGMENTS};
use crate::linalg::Complex;
use crate::linear::correlation::mean;

/// A power spectrum.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Frequencies, cycles a sample: from the first above 0 to a half.
    pub frequency: Vec<f64>,
    /// The density at each, the column's unit squared for each cycle a sample; the densities times the frequencies' distance add up to the
    /// variance, except for parts slower than a segment.
    pub density: Vec<f64>,
    /// Samples of a segment.
    pub segment: usize,
}

impl Spectrum {
    /// The spectrum of a signal by means over segments that overlap by half, under Hann windows; `None` for fewer than 16 samples.
    pub(super) fn new(signal: &[f64]) -> Option<Self> {
        let segment = segment(signal.len(), LONGEST_SEGMENT)?;
        let mut segments = Segments::new(segment);
        let mut power = vec![0.0; segment / 2 + 1];
        let mut count = 0;
        for start in starts(signal.len(), segment) {
            let spectrum = segments.transform(&signal[start..start + segment]);
            power.iter_mut().zip(spectrum).for_each(|(p, x)| *p += x.norm_sqr());
            count += 1;
        }
        // The window's mean square is 3/8; every frequency except the last stands for two.
        let scale = 2.0 / (0.375 * (count * segment) as f64);
        power.iter_mut().for_each(|p| *p *= scale);
        power[segment / 2] *= 0.5;
        Some(Spectrum {
            frequency: (1..=segment / 2).map(|k| k as f64 / segment as f64).collect(),
            density: power[1..].to_vec(),
            segment,
        })
    }

    /// The frequency, cycles a sample, below which this share of the power lies.
    pub fn below(&self, share: f64) -> f64 {
        let all: f64 = self.density.iter().sum();
        let mut sum = 0.0;
        let reached = self.density.iter().position(|d| {
            sum += d;
            sum >= share * all
        });
        self.frequency[reached.unwrap_or(self.frequency.len() - 1)]
    }
}

/// A power of two that has [`SEGMENTS`] segments in the signal, at most `longest`.
pub(super) fn segment(samples: usize, longest: usize) -> Option<usize> {
    let segment = (samples / SEGMENTS).clamp(8, longest);
    let power = 1 << segment.ilog2();
    (samples >= 2 * power).then_some(power)
}

/// The starts of segments that overlap by half.
pub(super) fn starts(samples: usize, segment: usize) -> impl Iterator<Item = usize> {
    (0..=samples - segment).step_by(segment / 2)
}

/// Fourier transforms of segments without their means, under a Hann window.
pub(super) struct Segments {
    window: Vec<f64>,
    transform: std::sync::Arc<dyn realfft::RealToComplex<f64>>,
    input: Vec<f64>,
    output: Vec<Complex<f64>>,
}

impl Segments {
    pub(super) fn new(segment: usize) -> Self {
        let transform = RealFftPlanner::<f64>::new().plan_fft_forward(segment);
        let angle = |i: usize| 2.0 * std::f64::consts::PI * i as f64 / segment as f64;
        Segments {
            window: (0..segment).map(|i| 0.5 - 0.5 * angle(i).cos()).collect(),
            input: transform.make_input_vec(),
            output: transform.make_output_vec(),
            transform,
        }
    }

    pub(super) fn transform(&mut self, samples: &[f64]) -> &[Complex<f64>] {
        let centre = mean(samples);
        for ((to, from), w) in self.input.iter_mut().zip(samples).zip(&self.window) {
            *to = (from - centre) * w;
        }
        // The buffers come from the plan, so the lengths fit and the transform cannot fail.
        let _ = self.transform.process(&mut self.input, &mut self.output);
        &self.output
    }
}
