//! Truncated Taylor series in time: a signal with its derivatives, and the arithmetic of such signals.
//!
//! $$ x(t_0 + s) = \sum_{i=0}^{6} c_i s^i, \qquad x^{(i)}(t_0) = i!\, c_i $$
//!
//! Sums and products are those of power series; a function of a series follows from its differential equation (Griewank & Walther,
//! Evaluating Derivatives, chapter 13). So all derivatives of a trajectory stay exact through inverse kinematics, the equations of motion
//! and the inverse of a spring.

use std::ops::{Add, Mul, Neg, Sub};

use crate::manipulator::{Friction, Stiffness};

/// The number of coefficients: the torque of an arm with coupled rotors needs the sixth derivative of its angles.
pub const COEFFICIENTS: usize = 7;

/// A signal and its first six derivatives at an instant, as Taylor coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Jet(
    /// The coefficients: the value, the first derivative, half of the second, and so on.
    pub [f64; COEFFICIENTS],
);

impl Jet {
    /// A constant.
    pub fn constant(value: f64) -> Self {
        let mut c = [0.0; COEFFICIENTS];
        c[0] = value;
        Jet(c)
    }

    /// The signal with this value and these derivatives; those that are not given are zero.
    ///
    /// ```
    /// use flexure::control::Jet;
    /// let x = Jet::of_derivatives(&[1.0, 2.0, 3.0]);
    /// assert_eq!((x.value(), x.derivative(1), x.derivative(2), x.derivative(3)), (1.0, 2.0, 3.0, 0.0));
    /// ```
    pub fn of_derivatives(derivatives: &[f64]) -> Self {
        let mut c = [0.0; COEFFICIENTS];
        let mut factorial = 1.0;
        for (i, (c, d)) in c.iter_mut().zip(derivatives).enumerate() {
            factorial *= if i > 0 { i as f64 } else { 1.0 };
            *c = d / factorial;
        }
        Jet(c)
    }

    /// The value.
    pub fn value(&self) -> f64 {
        self.0[0]
    }

    /// The derivative of this order, 0 to 6; higher ones are unknown and returned as zero.
    pub fn derivative(&self, order: usize) -> f64 {
        let factorial: f64 = (1..=order).map(|i| i as f64).product();
        self.0.get(order).map_or(0.0, |c| c * factorial)
    }

    /// The time derivative; its own derivatives are known to one order less.
    pub fn rate(&self) -> Jet {
        let mut c = [0.0; COEFFICIENTS];
        for i in 1..COEFFICIENTS {
            c[i - 1] = i as f64 * self.0[i];
        }
        Jet(c)
    }

    /// The second time derivative.
    pub fn acceleration(&self) -> Jet {
        self.rate().rate()
    }

    /// The series about an instant `s` seconds later.
    pub fn shifted(&self, s: f64) -> Jet {
        let mut c = self.0;
        // Repeated synthetic division.
        for i in 0..COEFFICIENTS {
            for j in (i..COEFFICIENTS - 1).rev() {
                c[j] += s * c[j + 1];
            }
        }
        Jet(c)
    }

    /// The series in another time: `u` is that time as a function of this one, and `self` the signal at `u`'s value.
    pub fn at(&self, u: Jet) -> Jet {
        let mut step = u;
        step.0[0] = 0.0;
        let horner = |sum: Jet, c: &f64| sum * step + Jet::constant(*c);
        self.0.iter().rev().fold(Jet::default(), horner)
    }

    /// The sine and the cosine.
    pub fn sin_cos(&self) -> [Jet; 2] {
        let (mut s, mut c) = ([0.0; COEFFICIENTS], [0.0; COEFFICIENTS]);
        (s[0], c[0]) = self.0[0].sin_cos();
        for n in 1..COEFFICIENTS {
            // s' = c x', c' = -s x'
            for i in 1..=n {
                let slope = i as f64 * self.0[i] / n as f64;
                s[n] += slope * c[n - i];
                c[n] -= slope * s[n - i];
            }
        }
        [Jet(s), Jet(c)]
    }

    /// The exponential.
    pub fn exp(&self) -> Jet {
        self.primitive(self.0[0].exp(), |y| y)
    }

    /// The hyperbolic tangent.
    pub fn tanh(&self) -> Jet {
        self.primitive(self.0[0].tanh(), |y| Jet::constant(1.0) - y * y)
    }

    /// The reciprocal.
    pub fn recip(&self) -> Jet {
        self.primitive(1.0 / self.0[0], |y| -(y * y))
    }

    /// The square root.
    pub fn sqrt(&self) -> Jet {
        let root = self.0[0].sqrt();
        let mut y = [0.0; COEFFICIENTS];
        y[0] = root;
        for n in 1..COEFFICIENTS {
            let cross: f64 = (1..n).map(|i| y[i] * y[n - i]).sum();
            y[n] = (self.0[n] - cross) / (2.0 * root);
        }
        Jet(y)
    }

    /// The angle of the point `(x, y)`, where `self` is `y`.
    pub fn atan2(&self, x: Jet) -> Jet {
        // a' = (x y' - y x') / (x^2 + y^2)
        let rate = (x * self.rate() - *self * x.rate()) * (x * x + *self * *self).recip();
        rate.integral(self.0[0].atan2(x.0[0]))
    }

    /// The signal of this value whose rate is `self`.
    fn integral(&self, value: f64) -> Jet {
        let mut c = [0.0; COEFFICIENTS];
        c[0] = value;
        for i in 1..COEFFICIENTS {
            c[i] = self.0[i - 1] / i as f64;
        }
        Jet(c)
    }

    /// The function `y` of the signal with this value and the slope `y' = slope(y)`.
    fn primitive(&self, value: f64, slope: impl Fn(Jet) -> Jet) -> Jet {
        let mut y = Jet::constant(value);
        // Each pass determines one more coefficient.
        for _ in 1..COEFFICIENTS {
            y = (slope(y) * self.rate()).integral(value);
        }
        y
    }
}

impl Add for Jet {
    type Output = Jet;
    fn add(self, other: Jet) -> Jet {
        Jet(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl Sub for Jet {
    type Output = Jet;
    fn sub(self, other: Jet) -> Jet {
        Jet(std::array::from_fn(|i| self.0[i] - other.0[i]))
    }
}

impl Neg for Jet {
    type Output = Jet;
    fn neg(self) -> Jet {
        Jet(self.0.map(|c| -c))
    }
}

impl Mul for Jet {
    type Output = Jet;
    fn mul(self, other: Jet) -> Jet {
        let coefficient = |n| (0..=n).map(|i| self.0[i] * other.0[n - i]).sum();
        Jet(std::array::from_fn(coefficient))
    }
}

impl Mul<f64> for Jet {
    type Output = Jet;
    fn mul(self, factor: f64) -> Jet {
        Jet(self.0.map(|c| c * factor))
    }
}

/// The friction torque (12) along a velocity.
pub fn friction(law: &Friction, v: Jet) -> Jet {
    let [g1, g2, g3, g4, g5, g6] = law.0;
    let mut sum = v * g6;
    if g1 != 0.0 {
        sum = sum + ((v * g2).tanh() - (v * g3).tanh()) * g1;
    }
    if g4 != 0.0 {
        sum = sum + (v * g5).tanh() * g4;
    }
    sum
}

/// The elastic torque (10), (11) along a deflection.
pub fn elastic(law: &Stiffness, d: Jet) -> Jet {
    d * stiffness_factor(law, d)
}

/// The elastic torque over the deflection.
fn stiffness_factor(law: &Stiffness, d: Jet) -> Jet {
    let square = d * d;
    let mut factor = square * law.cubic + Jet::constant(law.linear);
    if law.windup != 0.0 {
        factor = factor - (square * -law.windup_sharpness).exp() * law.windup;
    }
    factor
}

/// The deflection at which the spring has this elastic torque; `None` if the spring does not harden throughout.
pub fn deflection(law: &Stiffness, torque: Jet) -> Option<Jet> {
    let d = law.deflection(torque.value())?;
    let mut series = Jet::constant(d);
    let tangent = Jet::constant(1.0 / law.tangent(d));
    // Each iteration with the slope at the value determines one more coefficient.
    for _ in 1..COEFFICIENTS {
        series = series - (elastic(law, series) - torque) * tangent;
    }
    Some(series)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `x(t) = 0.7 + 0.3 t - 0.2 t^2 + 0.05 t^3` about an instant.
    fn x(t: f64) -> Jet {
        Jet::of_derivatives(&[
            0.7 + 0.3 * t - 0.2 * t * t + 0.05 * t.powi(3),
            0.3 - 0.4 * t + 0.15 * t * t,
            -0.4 + 0.3 * t,
            0.3,
        ])
    }

    /// The series of a function of `x` extrapolates it.
    fn extrapolates(name: &str, series: impl Fn(Jet) -> Jet, plain: impl Fn(f64) -> f64) {
        for t in [-0.4, 0.0, 0.3] {
            let far = 0.004;
            let error = series(x(t)).shifted(far).value() - plain(x(t + far).value());
            assert!(error.abs() < 1e-14 * 10.0, "{name} at {t}: {error}");
        }
    }

    #[test]
    fn functions_of_a_series_extrapolate_what_they_stand_for() {
        extrapolates("sin", |x| x.sin_cos()[0], f64::sin);
        extrapolates("cos", |x| x.sin_cos()[1], f64::cos);
        extrapolates("exp", |x| x.exp(), f64::exp);
        extrapolates("tanh", |x| x.tanh(), f64::tanh);
        extrapolates("recip", |x| x.recip(), f64::recip);
        extrapolates("sqrt", |x| x.sqrt(), f64::sqrt);
        extrapolates("atan2", |x| x.atan2(Jet::constant(-0.4) * x), |x| x.atan2(-0.4 * x));
        let law = Stiffness {
            cubic: 500.0,
            linear: 500.0,
            windup: 10.0,
            windup_sharpness: 3000.0,
        };
        let back = |x: Jet| deflection(&law, elastic(&law, x * 0.2)).unwrap() * 5.0;
        extrapolates("a spring and its inverse", back, |x| x);
    }

    #[test]
    fn another_time_gives_the_composed_signal() {
        // u(t) = t + 0.1 t^2 about 0.2
        let t = 0.2;
        let u = Jet::of_derivatives(&[t + 0.1 * t * t, 1.0 + 0.2 * t, 0.2]);
        let composed = x(u.value()).at(u);
        let later = t + 0.02;
        let expected = x(later + 0.1 * later * later).value();
        assert!((composed.shifted(0.02).value() - expected).abs() < 1e-14);
    }

    #[test]
    fn a_spring_that_softens_to_nothing_has_no_inverse() {
        let law = Stiffness {
            linear: 1.0,
            windup: 1.0,
            windup_sharpness: 3.0,
            ..Stiffness::default()
        };
        assert!(deflection(&law, Jet::constant(1.0)).is_none());
    }
}
