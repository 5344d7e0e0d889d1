//! The uncertainty of a linear block's frequency response and poles.
//!
//! It follows from the covariance P of the coefficients by the first derivatives. With $G = B/A$ at $z = e^{i\omega}$,
//! $$ \frac{\partial \ln G}{\partial b_k} = \frac{z^{-k}}{B}, \qquad \frac{\partial \ln G}{\partial a_k} = -\frac{z^{-k}}{A}, $$
//! where the real part is the derivative of the magnitude's logarithm, and the imaginary part that of the phase. A simple pole p of
//! $A(z) = z^n + a_1 z^{n-1} + \dots + a_n$ has
//! $$ \frac{\partial p}{\partial a_k} = -\frac{p^{n-k}}{A'(p)}. $$

use super::blocks::LinearBlock;
use crate::linear::Complex;

/// The standard errors of a frequency response at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponseError {
    /// The standard error of the magnitude's natural logarithm.
    pub log_magnitude: f64,
    /// The standard error of the phase, rad.
    pub phase: f64,
}

/// The covariance of a pole's real and imaginary part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoleCovariance {
    /// The variance of the real part.
    pub real: f64,
    /// The covariance of both parts.
    pub both: f64,
    /// The variance of the imaginary part.
    pub imaginary: f64,
}

impl LinearBlock {
    /// The standard errors of the frequency response at `omega`, rad per sample; `None` if the coefficients' covariance is not known.
    pub fn response_error(&self, omega: f64) -> Option<ResponseError> {
        let (covariance, first) = self.covariance()?;
        let power = |k: usize| Complex::from_polar(1.0, -omega * k as f64);
        let sum = |c: &[f64]| -> Complex<f64> { c.iter().enumerate().map(|(k, c)| power(k) * c).sum() };
        let (b, a) = (sum(self.system.b()), sum(self.system.a()));
        let of_b = (first..self.system.b().len()).map(|k| power(k) / b);
        let of_a = (1..self.system.a().len()).map(|k| -power(k) / a);
        let slopes: Vec<Complex<f64>> = of_b.chain(of_a).collect();
        let PoleCovariance { real, imaginary, .. } = spread(covariance, &slopes);
        let error = ResponseError {
            log_magnitude: real.max(0.0).sqrt(),
            phase: imaginary.max(0.0).sqrt(),
        };
        (error.log_magnitude.is_finite() && error.phase.is_finite()).then_some(error)
    }

    /// The covariance of a pole; `None` if that of the coefficients is not known, or if the pole is not simple.
    pub fn pole_covariance(&self, pole: Complex<f64>) -> Option<PoleCovariance> {
        let (covariance, first) = self.covariance()?;
        let a = self.system.a();
        let order = a.len() - 1;
        let power = |k: usize| pole.powu(k as u32);
        let slope: Complex<f64> = (0..order)
            .map(|k| power(order - 1 - k) * (a[k] * (order - k) as f64))
            .sum();
        let of_b = (first..self.system.b().len()).map(|_| Complex::new(0.0, 0.0));
        let of_a = (1..=order).map(|k| -power(order - k) / slope);
        let slopes: Vec<Complex<f64>> = of_b.chain(of_a).collect();
        let found = spread(covariance, &slopes);
        (found.real.is_finite() && found.imaginary.is_finite()).then_some(found)
    }

    /// The covariance of the coefficients, and the index of its first coefficient of b.
    fn covariance(&self) -> Option<(&[f64], usize)> {
        let covariance = &self.errors.as_ref()?.covariance;
        let count = covariance.len().isqrt();
        let of_b = count.checked_sub(self.order()).filter(|_| count > 0)?;
        Some((covariance, self.system.b().len().checked_sub(of_b)?))
    }
}

/// The covariance of the real and imaginary parts of a quantity with these derivatives.
fn spread(covariance: &[f64], slopes: &[Complex<f64>]) -> PoleCovariance {
    let mut found = PoleCovariance {
        real: 0.0,
        both: 0.0,
        imaginary: 0.0,
    };
    for (row, p) in covariance.chunks_exact(slopes.len().max(1)).zip(slopes) {
        for (v, q) in row.iter().zip(slopes) {
            found.real += v * p.re * q.re;
            found.both += v * p.re * q.im;
            found.imaginary += v * p.im * q.im;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::result::CoefficientErrors;
    use crate::linear::TransferFunction;

    const B: [f64; 4] = [0.0, 0.0, 0.32, 0.21];
    const A: [f64; 3] = [1.0, -1.32, 0.72];

    fn block(b: &[f64], a: &[f64], covariance: Vec<f64>) -> LinearBlock {
        LinearBlock {
            system: TransferFunction::new(b.to_vec(), a.to_vec()).unwrap(),
            errors: Some(CoefficientErrors {
                b: Vec::new(),
                a: Vec::new(),
                covariance,
            }),
            impulse: None,
        }
    }

    /// A covariance of two coefficients of b and two of a: L L' of a lower triangle.
    fn covariance() -> Vec<f64> {
        let l = [
            [3.0, 0.0, 0.0, 0.0],
            [1.0, 2.0, 0.0, 0.0],
            [-1.0, 0.5, 1.5, 0.0],
            [0.4, -0.7, 0.2, 1.0],
        ];
        let of = |i: usize, j: usize| (0..4).map(|k| 1e-6 * l[i][k] * l[j][k]).sum();
        (0..16).map(|n| of(n / 4, n % 4)).collect()
    }

    /// The covariance of `value` by central differences in the four coefficients.
    fn by_differences(value: impl Fn(&LinearBlock) -> [f64; 2]) -> [f64; 3] {
        let slope = |k: usize| {
            let at = |step: f64| {
                let (mut b, mut a) = (B, A);
                match k {
                    0 | 1 => b[2 + k] += step,
                    _ => a[k - 1] += step,
                }
                value(&block(&b, &a, Vec::new()))
            };
            let (up, down) = (at(1e-6), at(-1e-6));
            [0, 1].map(|part| (up[part] - down[part]) / 2e-6)
        };
        let slopes: Vec<[f64; 2]> = (0..4).map(slope).collect();
        let p = covariance();
        let of = |x: usize, y: usize| {
            let pairs = (0..16).map(|n| p[n] * slopes[n / 4][x] * slopes[n % 4][y]);
            pairs.sum::<f64>()
        };
        [of(0, 0), of(0, 1), of(1, 1)]
    }

    fn near(found: f64, expected: f64) {
        assert!(
            (found - expected).abs() <= 1e-6 * expected.abs().max(1e-9),
            "{found} is not {expected}"
        );
    }

    #[test]
    fn response_errors_are_those_of_differences() {
        let known = block(&B, &A, covariance());
        for omega in [0.01, 0.3, 0.67, 2.0, 3.1] {
            let found = known.response_error(omega).unwrap();
            let response = |block: &LinearBlock| {
                let g = block.system.frequency_response(omega);
                [g.norm().ln(), g.arg()]
            };
            let [magnitude, _, phase] = by_differences(response);
            near(found.log_magnitude, magnitude.sqrt());
            near(found.phase, phase.sqrt());
        }
    }

    #[test]
    fn pole_covariances_are_those_of_differences() {
        let known = block(&B, &A, covariance());
        for sign in [1.0, -1.0] {
            let of = |block: &LinearBlock| {
                let poles = block.system.poles().unwrap();
                *poles.iter().find(|p| p.im * sign > 0.0).unwrap()
            };
            let found = known.pole_covariance(of(&known)).unwrap();
            let [real, both, imaginary] = by_differences(|block| [of(block).re, of(block).im]);
            near(found.real, real);
            near(found.both, both);
            near(found.imaginary, imaginary);
        }
    }

    #[test]
    fn nothing_is_said_without_a_covariance_and_of_double_poles() {
        assert_eq!(block(&B, &A, Vec::new()).response_error(0.5), None);
        assert_eq!(block(&B, &A, Vec::new()).pole_covariance(Complex::new(0.5, 0.0)), None);
        let double = block(&B, &[1.0, -1.0, 0.25], covariance());
        assert_eq!(double.pole_covariance(Complex::new(0.5, 0.0)), None);
    }

    #[test]
    fn a_real_pole_moves_along_the_real_axis_alone() {
        let real = block(
            &[0.5, 0.1],
            &[1.0, -0.8],
            vec![1e-4, 0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 4e-4],
        );
        let found = real.pole_covariance(Complex::new(0.8, 0.0)).unwrap();
        near(found.real, 4e-4);
        assert_eq!((found.both, found.imaginary), (0.0, 0.0));
    }
}
