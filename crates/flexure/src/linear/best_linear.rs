//! The best linear approximation of a system under periodic excitation, with the effects of noise and nonlinearity.
//!
//! The robust method (Pintelon & Schoukens 2012, section 4.3.1): of M realisations of a random-phase multisine (or of
//! other periodic signals with random phases and one amplitude spectrum), P periods each are measured in the steady state. Between periods
//! only noise differs. Between realisations the stochastic nonlinear distortion differs too: the part of a nonlinear system's output that
//! is not linear in the input. With $\hat G^{[m]} = \bar Y^{[m]} / \bar U^{[m]}$ of the spectra averaged over the periods,
//! $$ \hat G = \frac1M \sum_m \hat G^{[m]}, \qquad \hat\sigma^2_\text{total} = \frac{1}{M (M - 1)} \sum_m |\hat G^{[m]} - \hat G|^2, \qquad
//!    \hat\sigma^2_\text{noise} = \frac{1}{M^2} \sum_m \hat\sigma^2_{\text{noise}, m}, $$
//! $$ \hat\sigma^2_\text{distortion} = M (\hat\sigma^2_\text{total} - \hat\sigma^2_\text{noise}), $$
//! at every line that is excited.

use realfft::RealFftPlanner;

use super::Complex;
use super::correlation::variance;
use crate::error::{Error, Result};

/// Lines with less than this share of the strongest line's power are not excited.
const EXCITED: f64 = 1e-6;
/// A signal repeats itself if the mean square difference to itself a period later is at most this share of its variance.
const REPEATED: f64 = 2e-3;
/// The number of places for a first, rough test of a period.
const PLACES: usize = 200;

/// A frequency response with the levels of noise and nonlinear distortion, one entry for each excited line.
#[derive(Debug, Clone, PartialEq)]
pub struct BestLinearApproximation {
    /// Cycles a sample, increasing, above 0.
    pub frequency: Vec<f64>,
    /// The response.
    pub response: Vec<Complex<f64>>,
    /// Standard deviation of the response's estimate by noise alone; empty with a single period.
    pub noise: Vec<f64>,
    /// Standard deviation of the response's estimate by noise and distortion together; empty with a single realisation.
    pub total: Vec<f64>,
    /// Standard deviation of the distortion in a single realisation, as a response; zero where the noise hides it, empty if `noise` or
    /// `total` is empty.
    pub distortion: Vec<f64>,
    /// The number of realisations M.
    pub realisations: usize,
    /// The number of periods P of each.
    pub periods: usize,
}

/// The input and the output of one realisation, in whole periods.
#[derive(Debug, Clone, Copy)]
pub struct PeriodicSignals<'a> {
    /// The input.
    pub u: &'a [f64],
    /// The output.
    pub y: &'a [f64],
}

impl BestLinearApproximation {
    /// The approximation from the input and output of every realisation, in the steady state from their first sample on.
    ///
    /// Only whole periods count; all realisations have as many as the shortest.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a period below 2 samples; [`Error::Data`]: `LengthMismatch` where an output is not as long as its
    /// input; `TooShort` with no realisation, or less than a period; `NonFinite`; and `Constant`
    /// where no line is excited in all realisations.
    ///
    /// ```
    /// use flexure::linear::{BestLinearApproximation, PeriodicSignals, TransferFunction};
    ///
    /// let period: Vec<f64> = (0..64).map(|n| f64::from(n * n % 64) / 64.0).collect();
    /// let u: Vec<f64> = period.iter().cycle().take(8 * 64).copied().collect();
    /// let y = TransferFunction::new(vec![1.0], vec![1.0, -0.5])?.simulate(&u);
    /// // The first four periods only let the transient decay.
    /// let best = BestLinearApproximation::new(&[PeriodicSignals { u: &u[256..], y: &y[256..] }], 64)?;
    /// assert!(best.noise.iter().all(|s| *s < 1e-9) && best.total.is_empty());
    /// # Ok::<(), flexure::Error>(())
    /// ```
    pub fn new(realisations: &[PeriodicSignals<'_>], period: usize) -> Result<Self> {
        if period < 2 {
            return Err(Error::parameter("the period", period as f64, "at least 2 samples"));
        }
        for (m, PeriodicSignals { u, y }) in realisations.iter().enumerate() {
            check(m, u, y)?;
        }
        let shortest = realisations.iter().map(|r| r.u.len()).min().unwrap_or(0);
        let periods = shortest / period;
        if periods == 0 {
            return Err(Error::too_short(
                "a best linear approximation (whole periods)",
                period,
                shortest,
            ));
        }
        let averaged: Vec<Averaged> = (realisations.iter())
            .map(|PeriodicSignals { u, y }| Averaged::new(u, y, period, periods))
            .collect();
        let lines = excited(&averaged);
        if lines.is_empty() {
            let value = realisations[0].u[0];
            return Err(Error::constant("the input", value));
        }
        let count = realisations.len() as f64;
        let mut best = BestLinearApproximation {
            frequency: lines.iter().map(|&k| k as f64 / period as f64).collect(),
            response: Vec::new(),
            noise: Vec::new(),
            total: Vec::new(),
            distortion: Vec::new(),
            realisations: realisations.len(),
            periods,
        };
        for &k in &lines {
            let each: Vec<Complex<f64>> = averaged.iter().map(|a| a.output[k] / a.input[k]).collect();
            let response = each.iter().sum::<Complex<f64>>() / count;
            best.response.push(response);
            let noise = averaged.iter().map(|a| a.noise(k)).sum::<f64>() / (count * count);
            let total = each.iter().map(|g| (g - response).norm_sqr()).sum::<f64>() / (count * (count - 1.0));
            if periods > 1 {
                best.noise.push(noise.sqrt());
            }
            if realisations.len() > 1 {
                best.total.push(total.sqrt());
            }
            if periods > 1 && realisations.len() > 1 {
                best.distortion.push((count * (total - noise)).max(0.0).sqrt());
            }
        }
        Ok(best)
    }
}

/// The period in samples of a signal that repeats itself: the shortest period that fits at least twice into the signal. `None` if it
/// does not repeat itself, or is constant.
///
/// The repetition may be exact, or up to noise with a thousandth of its variance.
///
/// ```
/// let period: Vec<f64> = (0..50).map(|n| f64::from(n * n % 50)).collect();
/// let u: Vec<f64> = period.iter().cycle().take(170).copied().collect();
/// assert_eq!(flexure::linear::period_of(&u), Some(50));
/// ```
pub fn period_of(signal: &[f64]) -> Option<usize> {
    let n = signal.len();
    let power = variance(signal);
    if !(power > 0.0 && power.is_finite()) {
        return None;
    }
    // Over the whole record, or at a few places: this is enough to reject most periods.
    let difference = |period: usize, stride: usize| {
        let pairs = (0..n - period).step_by(stride).map(|k| signal[k + period] - signal[k]);
        let (sum, count) = pairs.fold((0.0, 0.0), |(sum, count), d| (sum + d * d, count + 1.0));
        sum / (count * power)
    };
    let coarse = (n / PLACES).max(1);
    let (mut apart, mut best) = (0.0_f64, None::<(usize, f64)>);
    for period in 2..=n / 2 {
        let rough = difference(period, coarse);
        apart = apart.max(rough);
        // A slow signal also differs little from itself a few samples later; but then it does not differ more in between.
        let repeats = rough <= 4.0 * REPEATED && apart > 0.5;
        let exact = if repeats { difference(period, 1) } else { f64::INFINITY };
        match best {
            None if exact <= REPEATED => best = Some((period, exact)),
            Some((_, least)) if exact < least => best = Some((period, exact)),
            Some(_) => break,
            None => {}
        }
    }
    best.map(|b| b.0)
}

fn check(m: usize, u: &[f64], y: &[f64]) -> Result<()> {
    if y.len() != u.len() {
        return Err(Error::length(
            format!("the output of realisation {m}"),
            y.len(),
            u.len(),
        ));
    }
    for (name, samples) in [("input", u), ("output", y)] {
        if let Some(sample) = samples.iter().position(|v| !v.is_finite()) {
            return Err(Error::not_finite(
                format!("the {name} of realisation {m}"),
                sample,
                samples[sample],
            ));
        }
    }
    Ok(())
}

/// The spectra of one realisation, averaged over its periods, with the variances over the periods.
struct Averaged {
    input: Vec<Complex<f64>>,
    output: Vec<Complex<f64>>,
    /// Variances of the averages of input and output, and the covariance of output and input.
    input_variance: Vec<f64>,
    output_variance: Vec<f64>,
    covariance: Vec<Complex<f64>>,
}

impl Averaged {
    fn new(u: &[f64], y: &[f64], period: usize, periods: usize) -> Averaged {
        let [inputs, outputs] = [u, y].map(|v| spectra(&v[..period * periods], period));
        let lines = period / 2 + 1;
        let mean = |all: &[Vec<Complex<f64>>]| -> Vec<Complex<f64>> {
            let sum = |k: usize| all.iter().map(|s| s[k]).sum::<Complex<f64>>();
            (0..lines).map(|k| sum(k) / periods as f64).collect()
        };
        let (input, output) = (mean(&inputs), mean(&outputs));
        let scale = 1.0 / (periods * (periods - 1).max(1)) as f64;
        let mut averaged = Averaged {
            input_variance: vec![0.0; lines],
            output_variance: vec![0.0; lines],
            covariance: vec![Complex::new(0.0, 0.0); lines],
            input,
            output,
        };
        for (u, y) in inputs.iter().zip(&outputs) {
            for k in 0..lines {
                let (u, y) = (u[k] - averaged.input[k], y[k] - averaged.output[k]);
                averaged.input_variance[k] += scale * u.norm_sqr();
                averaged.output_variance[k] += scale * y.norm_sqr();
                averaged.covariance[k] += y * u.conj() * scale;
            }
        }
        averaged
    }

    /// The variance of the response at a line by noise on input and output (first order).
    fn noise(&self, k: usize) -> f64 {
        let g = self.output[k] / self.input[k];
        let crossed = 2.0 * (g.conj() * self.covariance[k]).re;
        let variance = self.output_variance[k] + g.norm_sqr() * self.input_variance[k] - crossed;
        (variance / self.input[k].norm_sqr()).max(0.0)
    }
}

/// The spectrum of every period.
fn spectra(signal: &[f64], period: usize) -> Vec<Vec<Complex<f64>>> {
    let forward = RealFftPlanner::<f64>::new().plan_fft_forward(period);
    let transform = |part: &[f64]| {
        let (mut input, mut output) = (part.to_vec(), forward.make_output_vec());
        // The output comes from the plan, so the lengths fit and the transform cannot fail.
        let _ = forward.process(&mut input, &mut output);
        output
    };
    signal.chunks_exact(period).map(transform).collect()
}

/// The lines above zero frequency, and below half the sampling rate, that every realisation excites.
fn excited(all: &[Averaged]) -> Vec<usize> {
    let lines = all.first().map_or(0, |a| a.input.len());
    let strong = |a: &Averaged| -> Vec<bool> {
        let strongest = a.input.iter().skip(1).map(|u| u.norm_sqr()).fold(0.0, f64::max);
        let power = a.input.iter().map(|u| u.norm_sqr());
        power.map(|p| p > EXCITED * strongest).collect()
    };
    let by_realisation: Vec<Vec<bool>> = all.iter().map(strong).collect();
    let constant = |a: &Averaged| {
        let strongest = a.input.iter().skip(1).map(|u| u.norm()).fold(0.0, f64::max);
        !(strongest > 1e-12 * a.input[0].norm())
    };
    if all.iter().any(constant) {
        return Vec::new();
    }
    (1..lines).filter(|&k| by_realisation.iter().all(|s| s[k])).collect()
}

#[cfg(test)]
#[path = "best_linear_tests.rs"]
mod tests;
