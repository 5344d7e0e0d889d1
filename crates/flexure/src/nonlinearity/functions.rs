//! The functions of the orthogonal series, by recurrences that are stable upwards.

use std::f64::consts::{PI, SQRT_2};

use crate::linalg::Complex;

/// A sequence of functions of one variable.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Functions {
    /// 1, sqrt 2 cos 2 pi k t, sqrt 2 sin 2 pi k t, ... with t = (x - low)/length.
    Fourier { low: f64, length: f64 },
    /// 1, sqrt 2 cos pi k t, ...
    Cosine { low: f64, length: f64 },
    /// sqrt(2k + 1) P_k(t) with t = (x - centre)/half in [-1, 1].
    Legendre { centre: f64, half: f64 },
    /// The Hermite functions of (x - centre)/scale.
    Hermite { centre: f64, scale: f64 },
    /// Polynomials of t by p_{k+1} = ((t - a_k) p_k - b_k p_{k-1}) / b_{k+1}, p_0 = `first`.
    Discrete {
        centre: f64,
        half: f64,
        first: f64,
        steps: Vec<RecurrenceStep>,
    },
}

/// The coefficients a_k and b_{k+1} of a step of a three-term recurrence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RecurrenceStep {
    pub a: f64,
    pub next_b: f64,
}

impl Functions {
    /// The first `out.len()` functions at `x`.
    pub fn values(&self, x: f64, out: &mut [f64]) {
        self.rows(&[x], out.as_chunks_mut().0);
    }

    /// The first `out.len()` functions at all of `x`.
    pub fn rows<const N: usize>(&self, x: &[f64; N], out: &mut [[f64; N]]) {
        match self {
            Functions::Fourier { low, length } => {
                let step = x.map(|x| turn(2.0 * PI * (x - low) / length));
                let mut wave = [Complex::new(1.0, 0.0); N];
                out[0] = [1.0; N];
                for pair in out[1..].chunks_mut(2) {
                    wave = std::array::from_fn(|i| wave[i] * step[i]);
                    pair[0] = wave.map(|w| SQRT_2 * w.re);
                    if let Some(second) = pair.get_mut(1) {
                        *second = wave.map(|w| SQRT_2 * w.im);
                    }
                }
            }
            Functions::Cosine { low, length } => {
                let step = x.map(|x| turn(PI * (x - low) / length));
                let mut wave = [Complex::new(1.0, 0.0); N];
                out[0] = [1.0; N];
                for v in &mut out[1..] {
                    wave = std::array::from_fn(|i| wave[i] * step[i]);
                    *v = wave.map(|w| SQRT_2 * w.re);
                }
            }
            Functions::Legendre { centre, half } => {
                let t = x.map(|x| (x - centre) / half);
                let mut last = Recurrence::starting([1.0; N]);
                for (k, v) in out.iter_mut().enumerate() {
                    let k = k as f64;
                    let norm = (2.0 * k + 1.0).sqrt();
                    *v = last.now.map(|now| norm * now);
                    last.advance(|p, before, now| ((2.0 * k + 1.0) * t[p] * now - k * before) / (k + 1.0));
                }
            }
            Functions::Hermite { centre, scale } => {
                let t = x.map(|x| (x - centre) / scale);
                let mut last = Recurrence::starting(t.map(|t| PI.powf(-0.25) * (-0.5 * t * t).exp()));
                for (k, v) in out.iter_mut().enumerate() {
                    let k = k as f64;
                    let (rise, fall) = ((2.0 / (k + 1.0)).sqrt(), (k / (k + 1.0)).sqrt());
                    *v = last.now;
                    last.advance(|p, before, now| rise * t[p] * now - fall * before);
                }
            }
            Functions::Discrete {
                centre,
                half,
                first,
                steps,
            } => {
                discrete_rows(&x.map(|x| (x - centre) / half), *first, steps, out);
            }
        }
    }

    /// The derivatives of the first `out.len()` functions at `x`.
    pub fn slopes(&self, x: f64, out: &mut [f64]) {
        match self {
            Functions::Fourier { low, length } => {
                out[0] = 0.0;
                for (k, pair) in out[1..].chunks_mut(2).enumerate() {
                    let rate = 2.0 * PI * (k + 1) as f64 / length;
                    let (sin, cos) = (rate * (x - low)).sin_cos();
                    pair[0] = -SQRT_2 * rate * sin;
                    if let Some(second) = pair.get_mut(1) {
                        *second = SQRT_2 * rate * cos;
                    }
                }
            }
            Functions::Cosine { low, length } => {
                for (k, v) in out.iter_mut().enumerate() {
                    let rate = PI * k as f64 / length;
                    *v = -SQRT_2 * rate * (rate * (x - low)).sin();
                }
            }
            Functions::Legendre { half, .. } => {
                // P'_{k+1} = P'_{k-1} + (2k + 1) P_k
                let mut values = vec![0.0; out.len()];
                self.values(x, &mut values);
                let (mut before, mut now) = (0.0, 0.0);
                for (k, v) in out.iter_mut().enumerate() {
                    let norm = (2.0 * k as f64 + 1.0).sqrt();
                    *v = norm * now / half;
                    (before, now) = (now, before + norm * values[k]);
                }
            }
            Functions::Hermite { scale, .. } => {
                // h_k' = sqrt(k/2) h_{k-1} - sqrt((k+1)/2) h_{k+1}
                let mut values = vec![0.0; out.len() + 1];
                self.values(x, &mut values);
                for (k, v) in out.iter_mut().enumerate() {
                    let below = if k > 0 { values[k - 1] } else { 0.0 };
                    let k = k as f64;
                    *v = ((0.5 * k).sqrt() * below - (0.5 * (k + 1.0)).sqrt() * values[k as usize + 1]) / scale;
                }
            }
            Functions::Discrete {
                centre, half, steps, ..
            } => {
                let mut values = vec![0.0; out.len()];
                self.values(x, &mut values);
                let t = (x - centre) / half;
                let (mut before, mut now, mut b) = (0.0, 0.0, 0.0);
                out[0] = 0.0;
                for (k, (v, RecurrenceStep { a, next_b })) in out[1..].iter_mut().zip(steps).enumerate() {
                    (before, now) = (now, ((t - a) * now + values[k] - b * before) / next_b);
                    b = *next_b;
                    *v = now / half;
                }
            }
        }
    }
}

/// The complex number of size 1 with this angle.
fn turn(angle: f64) -> Complex<f64> {
    let (sin, cos) = angle.sin_cos();
    Complex::new(cos, sin)
}

/// Orthogonal polynomials of discrete data at `t`, by their recurrence.
fn discrete_rows<const N: usize>(t: &[f64; N], first: f64, steps: &[RecurrenceStep], out: &mut [[f64; N]]) {
    let mut last = Recurrence::starting([first; N]);
    let mut b = 0.0;
    out[0] = last.now;
    for (v, RecurrenceStep { a, next_b }) in out[1..].iter_mut().zip(steps) {
        last.advance(|p, before, now| ((t[p] - a) * now - b * before) / next_b);
        b = *next_b;
        *v = last.now;
    }
}

/// Two consecutive values of a three-term recurrence, at N points.
struct Recurrence<const N: usize> {
    before: [f64; N],
    now: [f64; N],
}

impl<const N: usize> Recurrence<N> {
    fn starting(now: [f64; N]) -> Self {
        Recurrence { before: [0.0; N], now }
    }

    /// One step; `next` takes the point's index and both values there.
    fn advance(&mut self, next: impl Fn(usize, f64, f64) -> f64) {
        let Recurrence { before, now } = *self;
        *self = Recurrence {
            before: now,
            now: std::array::from_fn(|p| next(p, before[p], now[p])),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> Vec<Functions> {
        vec![
            Functions::Fourier { low: -1.0, length: 3.0 },
            Functions::Cosine { low: -1.0, length: 3.0 },
            Functions::Legendre { centre: 0.5, half: 1.5 },
            Functions::Hermite {
                centre: 0.3,
                scale: 0.8,
            },
            Functions::Discrete {
                centre: 0.5,
                half: 1.5,
                first: 0.4,
                steps: [(0.1, 0.5), (-0.2, 0.6), (0.0, 0.4), (0.05, 0.55), (0.1, 0.5)]
                    .map(|(a, next_b)| RecurrenceStep { a, next_b })
                    .into(),
            },
        ]
    }

    #[test]
    fn slopes_are_the_derivatives() {
        for functions in all() {
            for x in [-0.9, 0.0, 0.77, 1.95] {
                let mut slopes = [0.0; 6];
                functions.slopes(x, &mut slopes);
                let (mut above, mut below) = ([0.0; 6], [0.0; 6]);
                let step = 1e-5;
                functions.values(x + step, &mut above);
                functions.values(x - step, &mut below);
                for k in 0..6 {
                    let difference = (above[k] - below[k]) / (2.0 * step);
                    let scale = difference.abs().max(1.0);
                    assert!((slopes[k] - difference).abs() < 1e-7 * scale, "{functions:?} {k} {x}");
                }
            }
        }
    }

    #[test]
    fn the_functions_are_orthonormal_under_their_measures() {
        // The midpoint rule: exact for the trigonometric functions, for Hermite to rounding.
        let cells = 20_000;
        let gram = |functions: &Functions, low: f64, high: f64, scale: f64| {
            let mut gram = [[0.0; 9]; 9];
            for i in 0..cells {
                let x = low + (high - low) * (i as f64 + 0.5) / cells as f64;
                let mut v = [0.0; 9];
                functions.values(x, &mut v);
                for j in 0..9 {
                    for k in 0..9 {
                        gram[j][k] += v[j] * v[k] * scale / cells as f64;
                    }
                }
            }
            gram
        };
        for (functions, low, high, scale, tolerance) in [
            (Functions::Fourier { low: 2.0, length: 3.0 }, 2.0, 5.0, 1.0, 1e-12),
            (Functions::Cosine { low: 2.0, length: 3.0 }, 2.0, 5.0, 1.0, 1e-12),
            (Functions::Legendre { centre: 0.0, half: 2.0 }, -2.0, 2.0, 1.0, 1e-6),
            (
                Functions::Hermite {
                    centre: 0.0,
                    scale: 1.0,
                },
                -12.0,
                12.0,
                24.0,
                1e-12,
            ),
        ] {
            let gram = gram(&functions, low, high, scale);
            for j in 0..9 {
                for k in 0..9 {
                    let want = f64::from(u8::from(j == k));
                    assert!(
                        (gram[j][k] - want).abs() < tolerance,
                        "{functions:?} {j} {k} {}",
                        gram[j][k]
                    );
                }
            }
        }
    }
}
