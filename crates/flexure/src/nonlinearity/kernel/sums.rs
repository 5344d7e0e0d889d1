//! Kernel sums at a point, and the fit from them: the local constant fit, which is the quotient (13) and (21), or the local linear fit.

use serde::{Deserialize, Serialize};

/// The degree of the polynomial that is fitted around every point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Degree {
    /// The weighted mean (Nadaraya 1964, Watson 1964).
    #[default]
    Constant,
    /// The weighted least-squares line (Fan 1993): no bias of first order at the boundary nor where the
    /// density of x is uneven. If the points in reach have (nearly) one abscissa, they determine no line, and the fit is the weighted mean:
    /// see [`crate::nonlinearity::KernelFit::with_degree`].
    Linear,
}

/// If a fast sum is below this share of the largest possible sum, the direct sum replaces it: the weights are then so small that the
/// rounding of the moments would show.
pub(super) const DIRECT_BELOW: f64 = 1e-3;

/// Abscissas count as one if their standard deviation is below this share of the bandwidth: only rounding separates them, and they
/// determine no slope.
pub(crate) const ONE_ABSCISSA: f64 = 1e-9;

/// Weighted sums over the points about one point, in the coordinate u = (X - c)/h about some anchor c.
///
/// For [`Degree::Constant`] only the sums without u count; the others are zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sums {
    /// sum w, sum w u^2 over the points in reach: upper bounds for `s`.
    pub mass: [f64; 2],
    /// sum w K u^k
    pub s: [f64; 3],
    /// sum w K u^k (Y - mean Y)
    pub t: [f64; 2],
    /// The point itself: (q - c)/h.
    pub at: f64,
}

/// The fit at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Local {
    /// The estimate minus the ordinates' mean.
    pub value: f64,
    /// The share that an observation of weight 1 at this point would have in the estimate.
    pub leverage: f64,
}

impl Sums {
    pub const NONE: Self = Sums {
        mass: [0.0; 2],
        s: [0.0; 3],
        t: [0.0; 2],
        at: 0.0,
    };

    /// Whether fast sums are as accurate as direct ones, for the fit of this degree.
    #[inline(always)]
    pub fn reliable(&self, degree: Degree) -> bool {
        let heavy = self.s[0] > 0.0 && self.s[0] >= DIRECT_BELOW * self.mass[0];
        match degree {
            Degree::Constant => heavy,
            Degree::Linear => {
                let spread = self.s[2] - self.s[1] * (self.s[1] / self.s[0]);
                heavy && self.s[2] >= DIRECT_BELOW * self.mass[1] && spread >= DIRECT_BELOW * self.s[2]
            }
        }
    }

    /// The fit; `None` without points in reach.
    #[inline(always)]
    pub fn fit(&self, degree: Degree) -> Option<Local> {
        let [s0, s1, s2] = self.s;
        if !(s0 > 0.0) {
            return None;
        }
        // The quotient (13), and (21) where the pairs are a system's.
        let mean = Local {
            value: self.t[0] / s0,
            leverage: 1.0 / s0,
        };
        if degree == Degree::Constant {
            return Some(mean);
        }
        let centre = s1 / s0;
        let spread = s2 - s1 * centre;
        if !(spread > ONE_ABSCISSA * ONE_ABSCISSA * s0) {
            return Some(mean);
        }
        let distance = self.at - centre;
        Some(Local {
            value: mean.value + (self.t[1] - centre * self.t[0]) / spread * distance,
            leverage: mean.leverage + distance * distance / spread,
        })
    }

    /// The share that a point with w K = 1 at (X - q)/h = `v` has in the estimate.
    pub fn share(&self, degree: Degree, v: f64) -> f64 {
        let [s0, s1, s2] = self.s;
        let centre = s1 / s0;
        let spread = s2 - s1 * centre;
        if degree == Degree::Constant || !(spread > ONE_ABSCISSA * ONE_ABSCISSA * s0) {
            return 1.0 / s0;
        }
        let distance = self.at - centre;
        1.0 / s0 + distance * (distance + v) / spread
    }

    /// The residual of the ordinate `y`, of weight `w`, at this point from the fit without it. `None` if the other points' share in the fit
    /// is too small to decide.
    #[inline(always)]
    pub fn residual_without(&self, degree: Degree, y: f64, w: f64) -> Option<f64> {
        if degree == Degree::Constant {
            let LeftOut { scaled, rest, .. } = LeftOut::new(y, w, [self.s[0], self.t[0]]);
            return (rest > DIRECT_BELOW * self.mass[0]).then(|| scaled / rest);
        }
        let fit = self.fit(degree)?;
        let rest = 1.0 - w * fit.leverage;
        (rest > DIRECT_BELOW).then(|| (y - fit.value) / rest)
    }
}

/// An ordinate in comparison with the local constant without it.
#[derive(Clone, Copy, Default)]
pub(super) struct LeftOut {
    /// The ordinate's weight.
    pub weight: f64,
    /// The residual times `rest`.
    pub scaled: f64,
    /// The other points' sum of K. If its share in the mass in reach is too small, it says nothing.
    pub rest: f64,
}

impl LeftOut {
    /// For an ordinate `y` of weight `w`, from the sums of K and K y.
    #[inline(always)]
    pub fn new(y: f64, w: f64, [s, t]: [f64; 2]) -> LeftOut {
        // K(0) = 1: y - m_{-i} = (y sum K - sum K y) / (sum K - 1).
        LeftOut {
            weight: w,
            scaled: y * s - t,
            rest: s - w,
        }
    }
}

impl std::ops::Add for Sums {
    type Output = Self;

    /// The sums over both sets of points, about the anchor of the first.
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // u about the first anchor is u about the second plus d.
        let d = self.at - other.at;
        let [s0, s1, s2] = other.s;
        let [t0, t1] = other.t;
        Sums {
            mass: [
                self.mass[0] + other.mass[0],
                self.mass[1] + 2.0 * (other.mass[1] + d * d * other.mass[0]),
            ],
            s: [
                self.s[0] + s0,
                self.s[1] + (s1 + d * s0),
                self.s[2] + (s2 + d * (2.0 * s1 + d * s0)),
            ],
            t: [self.t[0] + t0, self.t[1] + (t1 + d * t0)],
            at: self.at,
        }
    }
}
