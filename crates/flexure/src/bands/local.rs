//! The weighted least-squares polynomial around one point, as weights of the ordinates.
//!
//! In the basis p_0 = 1, p_1, p_2 that is orthogonal under the kernel's weights the fitted value at v is
//! sum_k g_k p_k(v), g_k = sum_i w_i K_i p_k(v_i) y_i / n_k, n_k = sum_i w_i K_i p_k(v_i)^2.

use std::ops::Range;

use crate::nonlinearity::Kernel;
use crate::nonlinearity::kernel::ONE_ABSCISSA;
use crate::nonlinearity::kernel::Sorted;

/// Bandwidths beyond which the Gaussian kernel does not count: exp(-9^2 / 2) = 3e-18.
const GAUSSIAN_REACH: f64 = 9.0;
/// If a line leaves no more than this share of the squared abscissas, there are only two distinct ones.
const TWO_ABSCISSAS: f64 = 1e-10;

/// The points in reach of one point, and the kernel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window<'a> {
    pub data: &'a Sorted,
    pub kernel: Kernel,
    /// The bandwidth.
    pub h: f64,
}

impl Window<'_> {
    /// The points that count at `q`.
    pub fn range(&self, q: f64) -> Range<usize> {
        let reach = if self.kernel == Kernel::Gaussian {
            GAUSSIAN_REACH
        } else {
            1.0
        };
        self.data.within(q, reach * self.h)
    }

    /// w_i K((X_i - q)/h).
    #[inline(always)]
    pub fn weight(&self, i: usize, q: f64) -> f64 {
        self.data.weight(i) * self.kernel.weight((q - self.data.x[i]) / self.h)
    }
}

/// A polynomial of degree 0, 1 or 2 fitted around one point.
#[derive(Debug, Clone)]
pub(super) struct LocalPolynomial {
    q: f64,
    per_h: f64,
    /// The abscissas' weighted mean, in bandwidths from q.
    mean: f64,
    /// p_2(v) = v^2 - slope v - offset.
    slope: f64,
    offset: f64,
    /// 1 / n_k; zero for the k that the points do not determine.
    per_norm: [f64; 3],
    /// The points that count.
    pub range: Range<usize>,
    /// The coefficients g_k, of the centred ordinates.
    pub coefficients: [f64; 3],
}

impl LocalPolynomial {
    /// The fit of at most this `degree` around `q`; nothing without points in reach. `weights` gets
    /// the w_i K_i of the points in `range`.
    ///
    /// The degree is lower if the points have fewer than three (two) distinct abscissas.
    pub fn new(window: Window<'_>, degree: usize, q: f64, weights: &mut Vec<f64>) -> Option<Self> {
        let range = window.range(q);
        let per_h = 1.0 / window.h;
        let x = &window.data.x[range.clone()];
        let y = &window.data.y[range.clone()];
        weights.clear();
        weights.extend(range.clone().map(|i| window.weight(i, q)));
        let (mut s0, mut s1) = (0.0, 0.0);
        for (k, x) in weights.iter().zip(x) {
            s0 += k;
            s1 += k * (x - q) * per_h;
        }
        if !(s0 > 0.0) {
            return None;
        }
        let mean = s1 / s0;
        let (mut s2, mut s3, mut s4, mut t) = (0.0, 0.0, 0.0, [0.0; 3]);
        for ((k, x), y) in weights.iter().zip(x).zip(y) {
            let v = (x - q) * per_h - mean;
            let (kv, ky) = (k * v, k * y);
            s2 += kv * v;
            s3 += kv * v * v;
            s4 += kv * v * v * v;
            t[0] += ky;
            t[1] += ky * v;
            t[2] += ky * v * v;
        }
        let mut fit = LocalPolynomial {
            q,
            per_h,
            mean,
            slope: 0.0,
            offset: 0.0,
            per_norm: [1.0 / s0, 0.0, 0.0],
            range,
            coefficients: [t[0] / s0, 0.0, 0.0],
        };
        if degree >= 1 && s2 > ONE_ABSCISSA * ONE_ABSCISSA * s0 {
            fit.per_norm[1] = 1.0 / s2;
            fit.coefficients[1] = t[1] / s2;
            let (slope, offset) = (s3 / s2, s2 / s0);
            let norm = s4 - slope * s3 - offset * s2;
            if degree >= 2 && norm > TWO_ABSCISSAS * s4 {
                (fit.slope, fit.offset) = (slope, offset);
                fit.per_norm[2] = 1.0 / norm;
                fit.coefficients[2] = (t[2] - slope * t[1] - offset * t[0]) / norm;
            }
        }
        Some(fit)
    }

    /// p_0, p_1, p_2 at `x`.
    #[inline(always)]
    pub fn basis(&self, x: f64) -> [f64; 3] {
        let v = (x - self.q) * self.per_h - self.mean;
        [1.0, v, v * v - self.slope * v - self.offset]
    }

    /// p_k(x) / n_k: an ordinate at X of weight w K counts w K sum_k p_k(X) p_k(x) / n_k at x.
    #[inline(always)]
    pub fn dual(&self, x: f64) -> [f64; 3] {
        let p = self.basis(x);
        [0, 1, 2].map(|k| p[k] * self.per_norm[k])
    }

    /// The fitted value at `x` minus the ordinates' mean.
    pub fn value(&self, x: f64) -> f64 {
        dot(self.coefficients, self.basis(x))
    }

    /// sum_i (w_i K_i)^2 p_k(X_i) p_l(X_i) over the points that count, whose w_i K_i are `weights`.
    pub fn squared_weights(&self, data: &Sorted, weights: &[f64]) -> [[f64; 3]; 3] {
        let mut sums = [[0.0; 3]; 3];
        for (k, x) in weights.iter().zip(&data.x[self.range.clone()]) {
            let p = self.basis(*x).map(|p| k * p);
            for a in 0..3 {
                for b in a..3 {
                    sums[a][b] += p[a] * p[b];
                }
            }
        }
        for a in 0..3 {
            for b in 0..a {
                sums[a][b] = sums[b][a];
            }
        }
        sums
    }
}

#[inline(always)]
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
