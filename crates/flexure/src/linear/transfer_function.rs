//! A rational transfer function in z^-1:
//! $G(z) = \frac{b_0 + b_1 z^{-1} + \dots}{1 + a_1 z^{-1} + \dots}$.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::linalg::{self, Complex};
use crate::parallel;

/// A sum of coefficients is zero if it is at most this share of their sizes: only rounding is left.
const ROUNDING: f64 = 1e-14;
/// Longest impulse response that [`TransferFunction::settling`] looks at, in samples.
const LONGEST_SETTLING: usize = 100_000;
/// The share of the response to older samples that may remain at the start of a piece: less than rounding.
const SETTLED: f64 = 1e-18;
/// The share of the response to older samples that may be missing in a part of a record.
const LEFT_OF_PARTS: f64 = 1e-10;
/// The shortest piece, in samples and in settling times, so that the part simulated twice is comparatively short: convention.
const SHORTEST_PIECE: usize = 1 << 15;
const LEAST_OF_SETTLING: usize = 8;

/// A piece of a signal that is simulated by itself.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Piece {
    /// The sample where its simulation begins, from rest.
    pub begin: usize,
    /// The samples that are wanted.
    pub from: usize,
    pub end: usize,
}

/// A stable or unstable rational transfer function, `a[0] = 1`.
///
/// A delay of s samples is s leading zeros in `b`, so `y = filter(b, a, u)` in the usual sense.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Coefficients")]
pub struct TransferFunction {
    b: Vec<f64>,
    a: Vec<f64>,
}

#[derive(Deserialize)]
struct Coefficients {
    b: Vec<f64>,
    a: Vec<f64>,
}

impl TryFrom<Coefficients> for TransferFunction {
    type Error = Error;
    fn try_from(c: Coefficients) -> Result<Self> {
        Self::new(c.b, c.a)
    }
}

impl TransferFunction {
    /// Builds `G = b / a`; both are divided by `a[0]`.
    ///
    /// # Errors
    /// [`Error::Data`]: `TooShort` if `b` or `a` is empty, `NonFinite` before or after the division, and
    /// [`Error::Parameter`] if `a[0]` is zero.
    pub fn new(mut b: Vec<f64>, mut a: Vec<f64>) -> Result<Self> {
        for (column, c) in [("b", &b), ("a", &a)] {
            if c.is_empty() {
                return Err(Error::too_short("a transfer function's polynomial", 1, 0));
            }
            if let Some(sample) = c.iter().position(|v| !v.is_finite()) {
                return Err(Error::not_finite(column, sample, c[sample]));
            }
        }
        let first = a[0];
        if first == 0.0 {
            return Err(Error::parameter("a[0]", first, "non-zero"));
        }
        for (column, c) in [("b", &mut b), ("a", &mut a)] {
            c.iter_mut().for_each(|v| *v /= first);
            if let Some(sample) = c.iter().position(|v| !v.is_finite()) {
                return Err(Error::not_finite(column, sample, c[sample]));
            }
        }
        Ok(TransferFunction { b, a })
    }

    /// `b / (1 + a[0] z^-1 + a[1] z^-2 + ...)` from finite literals.
    pub(crate) fn monic(b: Vec<f64>, a: Vec<f64>) -> Self {
        TransferFunction {
            b,
            a: std::iter::once(1.0).chain(a).collect(),
        }
    }

    /// The numerator's coefficients of 1, z^-1, z^-2, ...
    pub fn b(&self) -> &[f64] {
        &self.b
    }

    /// The denominator's coefficients of 1, z^-1, z^-2, ...; the first is 1.
    pub fn a(&self) -> &[f64] {
        &self.a
    }

    /// The response to `input` from rest.
    pub fn simulate(&self, input: &[f64]) -> Vec<f64> {
        self.simulate_from(input, 0.0, &[])
    }

    /// The response to `input` from the steady state that belongs to the input's mean.
    ///
    /// A system without a steady state (a pole at 1) starts at rest.
    pub fn simulate_from_mean(&self, input: &[f64]) -> Vec<f64> {
        let gain = self.static_gain();
        if input.is_empty() || !gain.is_finite() {
            return self.simulate(input);
        }
        let mean = input.iter().sum::<f64>() / input.len() as f64;
        self.simulate_from(input, mean, &vec![0.0; self.states()])
    }

    /// Its delay in samples: the number of leading zeros of its numerator.
    pub fn delay(&self) -> usize {
        self.b.iter().take_while(|b| **b == 0.0).count()
    }

    /// The number of states of the transposed direct form II.
    pub fn states(&self) -> usize {
        self.a.len().max(self.b.len()) - 1
    }

    /// The response to `input` from the steady state that belongs to a constant input `level`, plus `state`: the states s of the
    /// transposed direct form II, y_n = b_0 u_n + s_1. Missing states are zero.
    ///
    /// A system without a steady state (a pole at 1) takes `level` for zero.
    pub fn simulate_from(&self, input: &[f64], level: f64, state: &[f64]) -> Vec<f64> {
        let gain = self.static_gain();
        let level = if gain.is_finite() { level } else { 0.0 };
        let centred: Cow<[f64]> = match level {
            0.0 => input.into(),
            level => input.iter().map(|u| u - level).collect(),
        };
        // The last one stays zero.
        let mut all: Vec<f64> = state.iter().copied().take(self.states()).collect();
        all.resize(self.states() + 1, 0.0);
        let pieces = self.pieces(input.len());
        let run = |piece: &Piece| match piece.begin {
            0 => self.run(&centred[..piece.end], &mut all.clone()),
            begin => self
                .run(&centred[begin..piece.end], &mut vec![0.0; all.len()])
                .split_off(piece.from - begin),
        };
        let mut output = match &pieces[..] {
            [whole] => run(whole),
            pieces => parallel::batch(pieces, run).concat(),
        };
        if level != 0.0 {
            output.iter_mut().for_each(|y| *y += gain * level);
        }
        output
    }

    /// Pieces of a signal of `n` samples that can be simulated in parallel. The simulation of a piece begins before its first wanted
    /// sample, early enough for the response to older samples to decay below rounding, even through two such systems in series. There is
    /// only one piece for a short signal, and for a system that settles slowly or not at all.
    pub(crate) fn pieces(&self, n: usize) -> Vec<Piece> {
        let whole = || {
            vec![Piece {
                begin: 0,
                from: 0,
                end: n,
            }]
        };
        if n < 2 * SHORTEST_PIECE {
            return whole();
        }
        let settling = self.forgotten();
        let length = SHORTEST_PIECE.max(LEAST_OF_SETTLING * settling);
        if settling >= 2 * LONGEST_SETTLING || n < 2 * length {
            return whole();
        }
        let from = (0..n / length).map(|i| i * length);
        let piece = |from: usize| Piece {
            begin: from.saturating_sub(settling),
            from,
            end: if n - from < 2 * length { n } else { from + length },
        };
        from.map(piece).collect()
    }

    /// The samples after which neither the response nor the response to the response is more than rounding: the slowest pole decides.
    pub(crate) fn forgotten(&self) -> usize {
        2 * self.settling(SETTLED)
    }

    /// Whether the response to samples that are older than [`forgotten`](Self::forgotten) is more than what sums over parts of a record may
    /// differ by.
    pub(crate) fn outlasts(&self) -> bool {
        let samples = self.forgotten() as f64;
        let is_left = |poles: Vec<Complex<f64>>| poles.iter().any(|pole| pole.norm().powf(samples) > LEFT_OF_PARTS);
        self.poles().is_none_or(is_left)
    }

    /// Transposed direct form II; `state` carries over between calls.
    fn run(&self, input: &[f64], state: &mut [f64]) -> Vec<f64> {
        let order = state.len() - 1;
        let padded = |c: &[f64]| -> Vec<f64> { (0..=order).map(|i| c.get(i).copied().unwrap_or(0.0)).collect() };
        let (b, a) = (padded(&self.b), padded(&self.a));
        input
            .iter()
            .map(|&u| {
                let y = b[0] * u + state[0];
                for i in 0..order {
                    state[i] = state[i + 1] + b[i + 1] * u - a[i + 1] * y;
                }
                y
            })
            .collect()
    }

    /// The first `n` values of the impulse response.
    pub fn impulse_response(&self, n: usize) -> Vec<f64> {
        let mut input = vec![0.0; n];
        if let Some(first) = input.first_mut() {
            *first = 1.0;
        }
        self.run(&input, &mut vec![0.0; self.states() + 1])
    }

    /// G at the normalised frequency `omega` in rad per sample.
    pub fn frequency_response(&self, omega: f64) -> Complex<f64> {
        let step = Complex::from_polar(1.0, -omega);
        let evaluate = |c: &[f64]| c.iter().rev().fold(Complex::new(0.0, 0.0), |sum, &v| sum * step + v);
        evaluate(&self.b) / evaluate(&self.a)
    }

    /// The static gain G(1); infinite or NaN if there is a pole at 1, to rounding.
    pub fn static_gain(&self) -> f64 {
        let sum = if is_zero_at_one(&self.a) {
            0.0
        } else {
            self.a.iter().sum()
        };
        self.b.iter().sum::<f64>() / sum
    }

    /// The poles in the z-plane; `None` if they cannot be computed. Those of integrators are 1 exactly.
    pub fn poles(&self) -> Option<Vec<Complex<f64>>> {
        let mut a = self.a.clone();
        while is_zero_at_one(&a) {
            // Division by 1 - z^-1.
            let mut sum = 0.0;
            for c in &mut a {
                sum += *c;
                *c = sum;
            }
            a.pop();
        }
        let integrators = self.a.len() - a.len();
        let ones = std::iter::repeat_n(Complex::new(1.0, 0.0), integrators);
        Some(ones.chain(linalg::roots(&a)?).collect())
    }

    /// The zeros in the z-plane; `None` if they cannot be computed.
    pub fn zeros(&self) -> Option<Vec<Complex<f64>>> {
        linalg::roots(&self.b)
    }

    /// Whether all poles lie strictly inside the unit circle.
    pub fn is_stable(&self) -> bool {
        self.poles().is_some_and(|p| p.iter().all(|z| z.norm() < 1.0))
    }

    /// Whether all poles lie strictly inside the unit circle, or are those of integrators.
    pub fn is_stable_or_integrates(&self) -> bool {
        let one = Complex::new(1.0, 0.0);
        self.poles()
            .is_some_and(|p| p.iter().all(|&z| z == one || z.norm() < 1.0))
    }

    /// The number of samples after which the impulse response's remaining absolute sum is below
    /// `share` of the whole; at most 100,000.
    pub fn settling(&self, share: f64) -> usize {
        let mut length = 64.max(4 * (self.a.len() + self.b.len()));
        loop {
            let k = self.impulse_response(length);
            let total: f64 = k.iter().map(|v| v.abs()).sum();
            let mut tail = 0.0;
            let cut = k.iter().rposition(|v| {
                tail += v.abs();
                tail > share * total
            });
            match cut {
                // It has settled well within the computed part.
                Some(i) if 2 * i < length => return i + 1,
                None => return 0,
                _ if length >= LONGEST_SETTLING || !total.is_finite() => return LONGEST_SETTLING,
                _ => length = (4 * length).min(LONGEST_SETTLING),
            }
        }
    }
}

/// Whether a polynomial in the delay is zero at z = 1, to rounding.
fn is_zero_at_one(c: &[f64]) -> bool {
    let (sum, size) = (c.iter().sum::<f64>(), c.iter().map(|c| c.abs()).sum::<f64>());
    c.len() > 1 && sum.abs() <= ROUNDING * size
}

#[cfg(test)]
mod tests {
    use super::*;

    fn second_order() -> TransferFunction {
        TransferFunction::new(vec![1.0, 0.4, 0.1], vec![1.0, -1.2, 0.52]).unwrap()
    }

    #[test]
    fn impulse_response_obeys_the_difference_equation() {
        let k = second_order().impulse_response(40);
        for n in 0..40 {
            let past = |j: usize| if n >= j { k[n - j] } else { 0.0 };
            let b = [1.0, 0.4, 0.1].get(n).copied().unwrap_or(0.0);
            assert!((k[n] - 1.2 * past(1) + 0.52 * past(2) - b).abs() < 1e-14);
        }
    }

    #[test]
    fn static_gain_is_the_sum_of_the_impulse_response_and_the_response_at_zero() {
        let g = second_order();
        let sum: f64 = g.impulse_response(400).iter().sum();
        assert!((g.static_gain() - sum).abs() < 1e-12);
        assert!((g.frequency_response(0.0).re - sum).abs() < 1e-12);
    }

    #[test]
    fn a_constant_input_is_in_steady_state_from_the_start() {
        let g = second_order();
        for y in g.simulate_from_mean(&[2.0; 20]) {
            assert!((y - 2.0 * g.static_gain()).abs() < 1e-12);
        }
    }

    #[test]
    fn settling_of_one_pole() {
        let g = TransferFunction::new(vec![1.0], vec![1.0, -0.9]).unwrap();
        // The tail from n on is 0.9^n of the whole.
        let n = g.settling(0.01);
        assert!(
            0.9_f64.powi(n as i32) <= 0.01 && 0.9_f64.powi(n as i32 - 1) > 0.01,
            "{n}"
        );
    }

    #[test]
    fn a_slow_response_outlasts_what_parts_are_given() {
        let one_pole = |pole: f64| TransferFunction::new(vec![1.0], vec![1.0, -pole]).unwrap();
        // Of 200,000 samples, 1e-87, 1e-10.9, 1e-9.7 and all is left.
        let outlasts = [0.999, 0.999_875, 0.999_888, 1.0].map(|pole| one_pole(pole).outlasts());
        assert_eq!(outlasts, [false, false, true, true]);
    }

    #[test]
    fn poles_decide_stability() {
        assert!(second_order().is_stable());
        assert!(!TransferFunction::new(vec![1.0], vec![1.0, -2.0]).unwrap().is_stable());
    }

    #[test]
    fn poles_of_integrators_are_exact() {
        let one = Complex::new(1.0, 0.0);
        // The poles in addition to the integrators, and these integrators.
        for (others, integrators, may_run) in [
            (vec![], 1, true),
            (vec![0.7, -0.4, 0.99], 2, true),
            (vec![0.7, 0.3, 0.1, -0.9], 3, true),
            (vec![1.001], 2, false),
            (vec![-1.0], 1, false),
        ] {
            let mut a = vec![1.0];
            for pole in others.iter().copied().chain(vec![1.0; integrators]) {
                let behind: Vec<f64> = a.iter().map(|a| -pole * a).collect();
                a.push(0.0);
                a.iter_mut().skip(1).zip(behind).for_each(|(a, behind)| *a += behind);
            }
            let system = TransferFunction::new(vec![1.0], a).unwrap();
            let poles = system.poles().unwrap();
            assert_eq!(poles.len(), others.len() + integrators);
            assert_eq!(poles.iter().filter(|&&z| z == one).count(), integrators, "{poles:?}");
            for other in others {
                assert!(
                    poles.iter().any(|z| (z - other).norm() < 1e-12),
                    "{poles:?} have no {other}"
                );
            }
            assert!(!system.is_stable() && !system.static_gain().is_finite());
            assert_eq!(system.is_stable_or_integrates(), may_run, "{poles:?}");
        }
    }

    #[test]
    fn a_division_that_leaves_no_number_is_refused() {
        assert!(TransferFunction::new(vec![1e308], vec![0.1, 0.0]).is_err());
        assert!(TransferFunction::new(vec![1.0], vec![1e-300, 1e300]).is_err());
        assert!(TransferFunction::new(vec![1.0], vec![0.1, 0.0]).is_ok());
    }

    #[test]
    fn a_long_signal_in_pieces_is_that_in_one() {
        let n = 300_000;
        let input: Vec<f64> = (0..n)
            .map(|i| f64::from(i % 1009) * 0.01 - 5.0 + (0.37 * f64::from(i)).sin())
            .collect();
        // A pole of 0.99 settles in some thousands of samples; one of 0.9999 does not, and is one piece.
        for (pole, pieces) in [(0.5, 9), (0.99, 4), (0.9999, 1)] {
            let g = TransferFunction::new(vec![0.3, 0.1], vec![1.0, -pole - 0.2, 0.2 * pole]).unwrap();
            let found = g.pieces(input.len());
            assert_eq!(found.len(), pieces, "{pole}");
            assert_eq!((found[0].from, found[pieces - 1].end), (0, input.len()));
            assert!(found.windows(2).all(|two| two[0].end == two[1].from));
            let whole = g.run(&input, &mut vec![0.0; g.states() + 1]);
            let size = whole.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
            for (y, w) in g.simulate(&input).iter().zip(&whole) {
                assert!((y - w).abs() <= 1e-15 * size, "{pole}: {y} {w}");
            }
        }
    }
}
