//! The function b + sum_k c_k tanh(d_k + v_k . z), its gradient, and its derivatives by the parameters.

use super::super::blocks::{BLOCK, Row};
use crate::vectors::dot;

/// The size of a network. Its parameters are b, then c_k, d_k, v_k of every unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layer {
    pub inputs: usize,
    pub units: usize,
}

/// The parameters of a unit.
struct UnitParameters<'a> {
    c: f64,
    d: f64,
    v: &'a [f64],
}

impl UnitParameters<'_> {
    /// tanh(d + v . z)
    fn tanh(&self, z: &[f64]) -> f64 {
        tanh(self.d + dot(self.v, z))
    }
}

impl Layer {
    pub fn parameters(self) -> usize {
        1 + self.units * self.stride()
    }

    fn stride(self) -> usize {
        self.inputs + 2
    }

    fn units_of(self, theta: &[f64]) -> impl Iterator<Item = UnitParameters<'_>> {
        theta[1..].chunks_exact(self.stride()).map(|u| UnitParameters {
            c: u[0],
            d: u[1],
            v: &u[2..],
        })
    }

    /// Whether the parameter `p` belongs to the output layer, in which the network is linear.
    pub fn is_output(self, p: usize) -> bool {
        p == 0 || (p - 1).is_multiple_of(self.stride())
    }

    pub fn value(self, theta: &[f64], z: &[f64]) -> f64 {
        let units = self.units_of(theta);
        theta[0] + units.map(|unit| unit.c * unit.tanh(z)).sum::<f64>()
    }

    /// The derivatives of the value by z.
    pub fn gradient(self, theta: &[f64], z: &[f64]) -> Vec<f64> {
        let mut gradient = vec![0.0; self.inputs];
        for unit in self.units_of(theta) {
            let h = unit.tanh(z);
            for (g, v) in gradient.iter_mut().zip(unit.v) {
                *g += unit.c * (1.0 - h * h) * v;
            }
        }
        gradient
    }

    /// The derivatives of the values at a block of points by each parameter fill the first `parameters()` rows. The next row gets the
    /// residuals u - value.
    pub fn linearise(self, theta: &[f64], z: &[Row], u: &Row, rows: &mut [Row]) {
        rows[0] = [1.0; BLOCK];
        let mut residual: Row = u.map(|u| u - theta[0]);
        for (k, UnitParameters { c, d, v }) in self.units_of(theta).enumerate() {
            let first = 1 + k * self.stride();
            let mut inner = [d; BLOCK];
            for (v, z) in v.iter().zip(z) {
                for (a, z) in inner.iter_mut().zip(z) {
                    *a += v * z;
                }
            }
            let h = inner.map(tanh);
            let slope = h.map(|h| c * (1.0 - h * h));
            for (r, h) in residual.iter_mut().zip(&h) {
                *r -= c * h;
            }
            rows[first] = h;
            for (row, z) in rows[first + 2..].iter_mut().zip(z) {
                *row = std::array::from_fn(|p| slope[p] * z[p]);
            }
            rows[first + 1] = slope;
        }
        rows[self.parameters()] = residual;
    }
}

/// The hyperbolic tangent to an absolute error of one rounding; faster than the standard library's.
fn tanh(a: f64) -> f64 {
    1.0 - 2.0 / (1.0 + (2.0 * a).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nonlinearity::blocks::rows;

    #[test]
    fn the_tangent_is_the_standard_library_s_for_any_argument() {
        for a in [
            0.0,
            1e-9,
            -0.3,
            2.0,
            -19.0,
            400.0,
            -400.0,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ] {
            assert!((tanh(a) - a.tanh()).abs() <= f64::EPSILON, "{a}");
        }
    }

    #[test]
    fn derivatives_are_finite_differences() {
        let layer = Layer { inputs: 2, units: 3 };
        assert_eq!(layer.parameters(), 13);
        let theta: Vec<f64> = (0..13).map(|i| (1.7 * f64::from(i) + 0.4).sin()).collect();
        let z = [[0.3; BLOCK], std::array::from_fn(|p| 0.05 * p as f64 - 1.0)];
        let u = [0.25; BLOCK];
        let mut out = rows(14);
        layer.linearise(&theta, &z, &u, &mut out);
        for p in [0, 17, 63] {
            let at = [z[0][p], z[1][p]];
            assert!((out[13][p] - (u[p] - layer.value(&theta, &at))).abs() < 1e-14);
            let step = 1e-6;
            for k in 0..13 {
                let moved = |s: f64| {
                    let mut theta = theta.clone();
                    theta[k] += s;
                    layer.value(&theta, &at)
                };
                let difference = (moved(step) - moved(-step)) / (2.0 * step);
                assert!((out[k][p] - difference).abs() < 1e-9, "{k}: {} {difference}", out[k][p]);
            }
            let gradient = layer.gradient(&theta, &at);
            for j in 0..2 {
                let moved = |s: f64| {
                    let mut at = at;
                    at[j] += s;
                    layer.value(&theta, &at)
                };
                let difference = (moved(step) - moved(-step)) / (2.0 * step);
                assert!((gradient[j] - difference).abs() < 1e-9, "{j}");
            }
        }
    }
}
