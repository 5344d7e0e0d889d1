//! A rational transfer function whose denominator is kept in sections of first and second order.
//!
//! Stability is then two inequalities per section. The derivative with respect to a section's coefficient is one more pass through that
//! section. Poles may meet on the real axis without a singularity.

use super::super::limits::LARGEST_RADIUS;
use super::limits::{AT_ORIGIN, REAL_ROOT, TINY_INPUT, WITHIN_RADIUS};
use super::signals::{convolved, delayed};
use crate::error::Result;
use crate::linalg::{self, Complex};
use crate::linear::TransferFunction;

/// $1/(1 + a_1 z^{-1} + a_2 z^{-2})$, or of first order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::identify) struct Section {
    pub a: [f64; 2],
    /// 1 or 2; a[1] is zero for 1.
    pub order: usize,
}

impl Section {
    /// The largest modulus of its poles.
    pub fn radius(&self) -> f64 {
        let [a1, a2] = self.a;
        let discriminant = a1 * a1 - 4.0 * a2;
        if discriminant < 0.0 {
            a2.sqrt()
        } else {
            0.5 * (a1.abs() + discriminant.sqrt())
        }
    }

    pub fn run(&self, input: &[f64]) -> Vec<f64> {
        in_series([self.a], input)
    }
}

/// All-pole sections in series, in one pass, so that the processor can overlap their recursions.
fn in_series<const K: usize>(a: [[f64; 2]; K], input: &[f64]) -> Vec<f64> {
    let mut state = [[0.0; 2]; K];
    input
        .iter()
        .map(|x| {
            let mut y = x + TINY_INPUT;
            for (a, s) in a.iter().zip(&mut state) {
                y -= a[0] * s[0] + a[1] * s[1];
                *s = [y, s[0]];
            }
            y
        })
        .collect()
}

/// $\sum_i b_i z^{-i} / \prod_k A_k(z)$.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct Rational {
    pub b: Vec<f64>,
    pub sections: Vec<Section>,
}

impl Rational {
    /// The system whose output is its input.
    pub fn pass() -> Rational {
        Rational {
            b: vec![1.0],
            sections: Vec::new(),
        }
    }

    /// The same poles with another numerator.
    pub fn with_numerator(&self, b: Vec<f64>) -> Rational {
        Rational {
            b,
            sections: self.sections.clone(),
        }
    }

    /// The system with these zeros and poles, both with their conjugates; the numerator's largest coefficient is 1.
    ///
    /// A zero at z0 outside the unit circle enters as $z^{-1} - 1/z_0$, so that zeros near infinity become a delay.
    pub fn from_roots(zeros: &[Complex<f64>], poles: &[Complex<f64>]) -> Rational {
        let mut b = vec![Complex::new(1.0, 0.0)];
        for z in zeros {
            let one = Complex::new(1.0, 0.0);
            let (first, second) = if z.norm() > 1.0 { (-z.inv(), one) } else { (one, -z) };
            b.push(Complex::new(0.0, 0.0));
            for i in (0..b.len()).rev() {
                let previous = if i > 0 { b[i - 1] } else { Complex::new(0.0, 0.0) };
                b[i] = b[i] * first + previous * second;
            }
        }
        let largest = b
            .iter()
            .map(|v| v.re)
            .fold(0.0_f64, |m, v| if v.abs() > m.abs() { v } else { m });
        Rational {
            b: b.iter().map(|v| v.re / largest).collect(),
            sections: sections(poles),
        }
    }

    /// The system of polynomials in $z^{-1}$, with poles outside the unit circle mirrored into it.
    pub fn from_polynomials(b: Vec<f64>, a: &[f64]) -> Option<Rational> {
        let poles: Vec<Complex<f64>> = linalg::roots(a)?.into_iter().map(inside).collect();
        (b.iter().all(|v| v.is_finite())).then(|| Rational {
            b,
            sections: sections(&poles),
        })
    }

    /// Lengthens the numerator to at least as many coefficients as the denominator has.
    pub fn fill_numerator(&mut self) {
        self.b.resize(self.b.len().max(self.order() + 1), 0.0);
    }

    /// The number of poles.
    pub fn order(&self) -> usize {
        self.sections.iter().map(|s| s.order).sum()
    }

    /// The poles, with conjugates.
    pub fn poles(&self) -> Vec<Complex<f64>> {
        self.sections.iter().flat_map(Section::poles).collect()
    }

    /// The zeros, with conjugates; leading and trailing zeros of the numerator count as delays.
    pub fn zeros(&self) -> Option<Vec<Complex<f64>>> {
        linalg::roots(&self.b)
    }

    /// Whether every pole lies well inside the unit circle.
    pub fn is_stable(&self) -> bool {
        self.sections.iter().all(|s| s.radius() <= LARGEST_RADIUS)
    }

    /// The response of the denominator alone, from rest.
    pub fn all_pole(&self, input: &[f64]) -> Vec<f64> {
        let mut signal = None;
        for part in self.sections.chunks(4) {
            let input = signal.as_deref().unwrap_or(input);
            signal = Some(match part {
                [a] => in_series([a.a], input),
                [a, b] => in_series([a.a, b.a], input),
                [a, b, c] => in_series([a.a, b.a, c.a], input),
                [a, b, c, d] => in_series([a.a, b.a, c.a, d.a], input),
                _ => input.to_vec(),
            });
        }
        signal.unwrap_or_else(|| input.to_vec())
    }

    /// The numerator applied to the response of the denominator.
    pub fn numerator(&self, all_pole: &[f64]) -> Vec<f64> {
        convolved(&self.b, all_pole)
    }

    /// The response to `input` from rest.
    pub fn run(&self, input: &[f64]) -> Vec<f64> {
        self.numerator(&self.all_pole(input))
    }

    /// The gain at zero frequency.
    pub fn static_gain(&self) -> f64 {
        let denominator: f64 = self.sections.iter().map(|s| 1.0 + s.a[0] + s.a[1]).product();
        self.b.iter().sum::<f64>() / denominator
    }

    /// As a transfer function, after a delay.
    ///
    /// # Errors
    /// Those of [`TransferFunction::new`].
    pub fn transfer_function(&self, delay: usize) -> Result<TransferFunction> {
        let mut a = vec![1.0];
        for s in &self.sections {
            let factor = [1.0, s.a[0], s.a[1]];
            let mut product = vec![0.0; a.len() + s.order];
            for (i, p) in a.iter().enumerate() {
                for (j, q) in factor.iter().enumerate().take(s.order + 1) {
                    product[i + j] += p * q;
                }
            }
            a = product;
        }
        TransferFunction::new(
            std::iter::repeat_n(0.0, delay).chain(self.b.iter().copied()).collect(),
            a,
        )
    }

    /// Samples after which the slowest pole's response has fallen to `share`.
    pub fn settling(&self, share: f64) -> usize {
        let radius = self.sections.iter().map(Section::radius).fold(0.0, f64::max);
        let poles = if radius < AT_ORIGIN {
            1.0
        } else {
            share.ln() / radius.ln()
        };
        self.b.len() + poles.ceil() as usize
    }

    /// The number of [`parameters`](Self::parameters).
    pub fn count(&self) -> usize {
        self.b.len() + self.order()
    }

    /// The free parameters: numerator, then every section's coefficients.
    pub fn parameters(&self) -> Vec<f64> {
        let denominator = self.sections.iter().flat_map(|s| s.a[..s.order].iter().copied());
        self.b.iter().copied().chain(denominator).collect()
    }

    /// The derivatives of the response by the [`parameters`](Self::parameters), from the response of the denominator and the whole
    /// one: $\partial G/\partial b_k = z^{-k} / A$ and $\partial G/\partial a_k = -z^{-k} G / A_i$ for a coefficient of section i.
    pub fn derivatives(&self, all_pole: &[f64], response: &[f64]) -> Vec<Vec<f64>> {
        let mut columns: Vec<Vec<f64>> = (0..self.b.len()).map(|k| delayed(all_pole, k, 1.0)).collect();
        for section in &self.sections {
            let by = section.run(response);
            columns.extend((1..=section.order).map(|k| delayed(&by, k, -1.0)));
        }
        columns
    }

    /// The same structure with other parameters.
    pub fn with(&self, parameters: &[f64]) -> Rational {
        let (b, mut rest) = parameters.split_at(self.b.len());
        let sections = self.sections.iter().map(|s| {
            let (mine, others) = rest.split_at(s.order);
            rest = others;
            Section {
                a: [mine[0], mine.get(1).copied().unwrap_or(0.0)],
                order: s.order,
            }
        });
        Rational {
            b: b.to_vec(),
            sections: sections.collect(),
        }
    }
}

impl Section {
    fn poles(&self) -> Vec<Complex<f64>> {
        let half = -0.5 * self.a[0];
        let discriminant = half * half - self.a[1];
        match self.order {
            1 => vec![Complex::new(-self.a[0], 0.0)],
            _ if discriminant < 0.0 => {
                let im = (-discriminant).sqrt();
                vec![Complex::new(half, im), Complex::new(half, -im)]
            }
            _ => {
                // The larger root first, without cancellation.
                let large = half + discriminant.sqrt().copysign(half);
                let small = if large == 0.0 { 0.0 } else { self.a[1] / large };
                vec![Complex::new(large, 0.0), Complex::new(small, 0.0)]
            }
        }
    }
}

/// The pole, or its mirror image inside the unit circle.
fn inside(pole: Complex<f64>) -> Complex<f64> {
    let radius = pole.norm();
    let mirrored = if radius > 1.0 { 1.0 / radius } else { radius };
    pole * (mirrored.min(LARGEST_RADIUS * WITHIN_RADIUS) / radius.max(f64::MIN_POSITIVE))
}

/// A real root, or the root with positive imaginary part of a conjugate pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::identify) struct Root {
    pub at: Complex<f64>,
    pub pair: bool,
}

/// Roots, with conjugates, as real ones and pairs.
pub(in crate::identify) fn groups(roots: &[Complex<f64>]) -> Vec<Root> {
    let real = |z: &Complex<f64>| z.im.abs() <= REAL_ROOT * z.norm().max(REAL_ROOT);
    let pairs = roots.iter().filter(|z| !real(z) && z.im > 0.0);
    let mut single: Vec<f64> = roots.iter().filter(|z| real(z)).map(|z| z.re).collect();
    single.sort_unstable_by(f64::total_cmp);
    pairs
        .map(|z| Root { at: *z, pair: true })
        .chain(single.into_iter().map(|x| Root {
            at: Complex::new(x, 0.0),
            pair: false,
        }))
        .collect()
}

/// The roots with the conjugates of pairs.
pub(in crate::identify) fn with_conjugates<'r>(roots: impl Iterator<Item = &'r Root>) -> Vec<Complex<f64>> {
    roots
        .flat_map(|root| std::iter::once(root.at).chain(root.pair.then(|| root.at.conj())))
        .collect()
}

/// Sections with these poles: conjugate pairs, real poles two by two, and one of first order if their number is odd.
fn sections(poles: &[Complex<f64>]) -> Vec<Section> {
    let all = groups(poles);
    let pair = |a1: f64, a2: f64| Section { a: [a1, a2], order: 2 };
    let mut sections: Vec<Section> = all
        .iter()
        .filter(|g| g.pair)
        .map(|g| pair(-2.0 * g.at.re, g.at.norm_sqr()))
        .collect();
    let single: Vec<f64> = all.iter().filter(|g| !g.pair).map(|g| g.at.re).collect();
    for two in single.chunks(2) {
        sections.push(match two {
            [p, q] => pair(-p - q, p * q),
            _ => Section {
                a: [-two[0], 0.0],
                order: 1,
            },
        });
    }
    sections
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: &[Complex<f64>], b: &[Complex<f64>]) -> bool {
        a.len() == b.len() && a.iter().all(|p| b.iter().any(|q| (p - q).norm() < 1e-9))
    }

    #[test]
    fn poles_and_zeros_come_back() {
        let c = |re, im| Complex::new(re, im);
        let poles = [c(0.5, 0.3), c(0.5, -0.3), c(-0.2, 0.0), c(0.7, 0.0), c(0.1, 0.0)];
        let zeros = [c(1.5, 0.7), c(1.5, -0.7), c(-0.4, 0.0)];
        let g = Rational::from_roots(&zeros, &poles);
        assert_eq!(g.order(), 5);
        assert!(close(&g.poles(), &poles), "{:?}", g.poles());
        assert!(close(&g.zeros().unwrap(), &zeros), "{:?}", g.zeros());
        assert!(g.is_stable());
    }

    #[test]
    fn sections_respond_as_the_transfer_function() {
        let c = |re, im| Complex::new(re, im);
        let poles = [c(0.5, 0.3), c(0.5, -0.3), c(0.2, 0.6), c(0.2, -0.6), c(0.7, 0.0)];
        let many: Vec<Complex<f64>> = poles.iter().chain(&poles).copied().collect();
        let input: Vec<f64> = (0..60).map(|i| (0.7 * f64::from(i)).sin()).collect();
        for poles in [&[][..], &poles[..1], &poles[..2], &poles, &many] {
            let g = Rational::from_roots(&[c(0.4, 0.0)], poles);
            let want = g.transfer_function(0).unwrap().simulate(&input);
            for (got, want) in g.run(&input).iter().zip(want) {
                assert!((got - want).abs() < 1e-9, "{got} {want}");
            }
        }
    }

    #[test]
    fn poles_outside_are_mirrored() {
        let g = Rational::from_polynomials(vec![1.0], &[1.0, -2.5, 1.0]).unwrap();
        assert!(
            g.is_stable() && g.poles().iter().all(|p| (p - 0.5).norm() < 1e-9),
            "{:?}",
            g.poles()
        );
        let edge = Rational::from_polynomials(vec![1.0], &[1.0, -1.0]).unwrap();
        assert!(edge.is_stable());
    }
}
