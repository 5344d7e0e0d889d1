//! Cubic B-splines on given knots and the integral of their squared second derivatives.

use super::banded::Banded;
use crate::vectors::dot;

/// The values of the basis functions that do not vanish at a point. Their indices are consecutive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LocalValues<const N: usize> {
    /// The index of the first.
    pub first: usize,
    pub values: [f64; N],
}

impl<const N: usize> LocalValues<N> {
    /// The sum of all functions with these coefficients.
    pub fn combined(&self, coefficients: &[f64]) -> f64 {
        dot(&self.values, &coefficients[self.first..])
    }
}

/// The cubic B-splines at a point, and their slopes there.
pub(crate) struct LocalCubics {
    pub at: LocalValues<4>,
    pub slopes: [f64; 4],
}

impl LocalCubics {
    /// At `x` between the ends of the knots. The first and the last knot are each repeated four times (de Boor 2001, chapter 10).
    #[inline]
    pub fn new(knots: &[f64], x: f64) -> LocalCubics {
        let t = knots;
        let span = t[4..t.len() - 4].partition_point(|&k| k <= x) + 3;
        let mut v = [1.0, 0.0, 0.0, 0.0];
        let mut shares = [0.0; 3];
        for degree in 1..4 {
            let mut saved = 0.0;
            for r in 0..degree {
                let (right, left) = (t[span + r + 1], t[span + r + 1 - degree]);
                let share = v[r] / (right - left);
                v[r] = saved + (right - x) * share;
                saved = (x - left) * share;
                shares[r] = share;
            }
            v[degree] = saved;
        }
        let [p, q, s] = shares;
        LocalCubics {
            at: LocalValues {
                first: span - 3,
                values: v,
            },
            slopes: [-3.0 * p, 3.0 * (p - q), 3.0 * (q - s), 3.0 * s],
        }
    }
}

/// The cubic splines with these breakpoints, increasing, at least two.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CubicSplines {
    /// The breakpoints, with each end repeated four times.
    pub knots: Vec<f64>,
}

impl CubicSplines {
    pub fn new(breakpoints: &[f64]) -> CubicSplines {
        let (first, last) = (breakpoints[0], breakpoints[breakpoints.len() - 1]);
        let ends = |x| std::iter::repeat_n(x, 3);
        CubicSplines {
            knots: ends(first)
                .chain(breakpoints.iter().copied())
                .chain(ends(last))
                .collect(),
        }
    }

    /// The number of B-splines.
    pub fn len(&self) -> usize {
        self.knots.len() - 4
    }

    /// The four B-splines that do not vanish at `x` between the ends.
    pub fn at(&self, x: f64) -> LocalValues<4> {
        LocalCubics::new(&self.knots, x).at
    }

    /// The slopes at both ends of the spline with these coefficients.
    pub fn end_slopes(&self, c: &[f64]) -> [f64; 2] {
        let (n, t) = (self.len(), &self.knots);
        [
            3.0 * (c[1] - c[0]) / (t[4] - t[3]),
            3.0 * (c[n - 1] - c[n - 2]) / (t[n] - t[n - 1]),
        ]
    }

    /// The matrix P for which c'P c is the integral of the squared second derivative.
    pub fn roughness(&self) -> Banded {
        let t = &self.knots;
        // Second derivatives are linear between breakpoints: the i-th breakpoint's is d[i] . c[i..i + 3].
        let second: Vec<[f64; 3]> = (0..self.len() - 2)
            .map(|i| {
                let both = 6.0 / (t[i + 4] - t[i + 2]);
                let (left, right) = (both / (t[i + 4] - t[i + 1]), both / (t[i + 5] - t[i + 2]));
                [left, -left - right, right]
            })
            .collect();
        let mut penalty = Banded::zeros(self.len());
        for (i, pair) in second.windows(2).enumerate() {
            let third = (t[i + 4] - t[i + 3]) / 3.0;
            // The integral of the square of a linear function with ends a and b: (a^2 + a b + b^2)/3
            // = ((a + b/2)^2 + 3 b^2/4)/3.
            let [a, b] = [
                [pair[0][0], pair[0][1], pair[0][2], 0.0],
                [0.0, pair[1][0], pair[1][1], pair[1][2]],
            ];
            let mixed: [f64; 4] = std::array::from_fn(|k| a[k] + 0.5 * b[k]);
            penalty.add_products(i, &mixed, third);
            penalty.add_products(i, &b, 0.75 * third);
        }
        penalty
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn b_splines_are_positive_and_sum_to_one() {
        let splines = CubicSplines::new(&[0.0, 0.1, 0.4, 0.45, 1.0]);
        assert_eq!(splines.len(), 7);
        for u in [0.0, 0.05, 0.1, 0.3, 0.45, 0.9, 1.0] {
            let LocalValues { first, values: v } = splines.at(u);
            assert!(first + 4 <= splines.len());
            assert!(
                (v.iter().sum::<f64>() - 1.0).abs() < 1e-15 && v.iter().all(|v| *v >= 0.0),
                "{u} {v:?}"
            );
        }
    }

    #[test]
    fn roughness_is_the_integral_of_the_squared_second_derivative() {
        let breakpoints = [0.0, 0.2, 0.5, 0.55, 1.0];
        let splines = CubicSplines::new(&breakpoints);
        let c = [0.3, -1.0, 2.0, 0.5, 0.1, -0.7, 1.5];
        let value = |u: f64| splines.at(u).combined(&c);
        // A cubic on each piece: its second derivative is linear, from second differences inside the piece.
        let mut want = 0.0;
        for w in breakpoints.windows(2) {
            let h = (w[1] - w[0]) / 3.0;
            let f: Vec<f64> = (0..4).map(|k| value(w[0] + (w[1] - w[0]) * k as f64 / 3.0)).collect();
            let (p, q) = (
                (f[0] - 2.0 * f[1] + f[2]) / (h * h),
                (f[1] - 2.0 * f[2] + f[3]) / (h * h),
            );
            let (a, b) = (2.0 * p - q, 2.0 * q - p);
            want += (w[1] - w[0]) * (a * a + a * b + b * b) / 3.0;
        }
        let penalty = splines.roughness();
        let mut got = 0.0;
        for i in 0..7 {
            for k in 0..4.min(7 - i) {
                got += if k == 0 { 1.0 } else { 2.0 } * penalty.rows[i][k] * c[i] * c[i + k];
            }
        }
        assert!((got - want).abs() < 1e-10 * want, "{got} {want}");
    }

    #[test]
    fn end_slopes_are_the_derivatives() {
        let splines = CubicSplines::new(&[0.0, 0.3, 1.0]);
        let c = [0.3, -1.0, 2.0, 0.5, 0.1];
        let value = |u: f64| splines.at(u).combined(&c);
        let [left, right] = splines.end_slopes(&c);
        assert!((left - (value(1e-6) - value(0.0)) / 1e-6).abs() < 1e-4);
        assert!((right - (value(1.0) - value(1.0 - 1e-6)) / 1e-6).abs() < 1e-4);
    }
}
