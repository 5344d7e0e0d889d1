//! A zero-phase Butterworth low-pass: forward and backward through second-order sections.
//!
//! The analogue filter of even order N has the gain (1 + (f/f_c)^(2N))^(-1/2) and the pole pairs of
//! $$ s^2 + 2 \sin\theta_k\, s + 1, \quad \theta_k = \frac{(2k - 1)\pi}{2N},\ k = 1, ..., N/2 $$
//! (Butterworth 1930). The bilinear transform with prewarping, K = tan(pi f_c h), turns each pair into a section
//! $$ H(z) = \frac{K^2 (1 + z^{-1})^2}{(1 + 2\sin\theta\,K + K^2) + 2(K^2 - 1) z^{-1} + (1 - 2\sin\theta\,K + K^2) z^{-2}} $$
//! (Oppenheim and Schafer 2010, section 7.2). Filtered twice, the gain is squared, 1/2 at f_c, and the delay is zero.
//!
//! The ends are continued by their reflection in the end point, and the sections start in the steady state of the first value, as in
//! SciPy's `sosfiltfilt`.

use std::f64::consts::PI;

use super::LONGEST_GAP;
use super::resampling::fill;
use crate::error::{Error, Result};

/// A zero-phase low-pass filter.
///
/// It is linear: a linear relation between two columns stays the same if both go through the same filter. A nonlinear relation does not. So
/// before the identification of a nonlinearity, filter only far above its frequencies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowPass {
    /// The frequency at which the gain is one half, in Hz if the sample time is in s. It is positive and below half the sampling rate.
    pub cutoff: f64,
    /// The order of the filter that is run forward and backward: even, from 2 to 20.
    pub order: usize,
}

/// A section of second order: numerator b (1 + z^-1)^2, denominator 1 + a1 z^-1 + a2 z^-2.
#[derive(Debug, Clone, Copy)]
struct Biquad {
    b: f64,
    a1: f64,
    a2: f64,
}

impl Biquad {
    /// Filters in place, from the steady state of the first value.
    ///
    /// Direct form II transposed: y = b x + s1, s1 = 2b x - a1 y + s2, s2 = b x - a2 y.
    fn run(self, x: &mut [f64]) {
        let Biquad { b, a1, a2 } = self;
        let Some(&first) = x.first() else { return };
        // The gain at frequency zero is 1: y = x = first.
        let mut s1 = (1.0 - b) * first;
        let mut s2 = (b - a2) * first;
        for x in x {
            let y = b * *x + s1;
            s1 = 2.0 * b * *x - a1 * y + s2;
            s2 = b * *x - a2 * y;
            *x = y;
        }
    }
}

impl LowPass {
    /// The filtered samples. Missing samples stay missing.
    ///
    /// Up to [`LONGEST_GAP`] missing samples in a row are interpolated for the filter only. A longer gap divides the record into parts,
    /// which are filtered one by one.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a sample time, a cutoff or an order out of range.
    pub fn filter(&self, x: &[f64], sample_time: f64) -> Result<Vec<f64>> {
        let sections = self.sections(sample_time)?;
        let mut filtered = fill(x, LONGEST_GAP);
        for part in filtered.chunk_by_mut(|a, b| a.is_finite() == b.is_finite()) {
            if part[0].is_finite() {
                both_ways(&sections, part);
            }
        }
        for (filtered, x) in filtered.iter_mut().zip(x) {
            if !x.is_finite() {
                *filtered = f64::NAN;
            }
        }
        Ok(filtered)
    }

    fn sections(&self, sample_time: f64) -> Result<Vec<Biquad>> {
        if !(sample_time > 0.0 && sample_time.is_finite()) {
            return Err(Error::parameter("the sample time", sample_time, "positive and finite"));
        }
        if !(self.cutoff > 0.0 && self.cutoff * sample_time < 0.5) {
            return Err(Error::parameter(
                "the cutoff frequency of the low-pass",
                self.cutoff,
                "positive and below half the sampling rate, 1/(2 x sample time)",
            ));
        }
        if !(2..=20).contains(&self.order) || !self.order.is_multiple_of(2) {
            return Err(Error::parameter(
                "the order of the low-pass",
                self.order as f64,
                "even, from 2 to 20",
            ));
        }
        let k = (PI * self.cutoff * sample_time).tan();
        let section = |pair: usize| {
            let theta = PI * (2 * pair - 1) as f64 / (2 * self.order) as f64;
            let damping = 2.0 * theta.sin() * k;
            let leading = 1.0 + damping + k * k;
            Biquad {
                b: k * k / leading,
                a1: 2.0 * (k * k - 1.0) / leading,
                a2: (1.0 - damping + k * k) / leading,
            }
        };
        Ok((1..=self.order / 2).map(section).collect())
    }
}

/// Filters a part without missing samples forward and backward, continued at both ends by its reflection in the end point.
fn both_ways(sections: &[Biquad], part: &mut [f64]) {
    let last = part.len() - 1;
    // As SciPy: three times the number of coefficients.
    let margin = (3 * (2 * sections.len() + 1)).min(last);
    let before = (1..=margin).rev().map(|i| 2.0 * part[0] - part[i]);
    let after = (1..=margin).map(|i| 2.0 * part[last] - part[last - i]);
    let mut x: Vec<f64> = before.chain(part.iter().copied()).chain(after).collect();
    for _ in 0..2 {
        for section in sections {
            section.run(&mut x);
        }
        x.reverse();
    }
    part.copy_from_slice(&x[margin..=margin + last]);
}
