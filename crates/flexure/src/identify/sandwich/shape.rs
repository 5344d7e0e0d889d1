//! The static nonlinearity: a cubic spline, straight on beyond its ends.

/// A cubic spline in B-splines.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shape {
    /// The breakpoints with the ends four times.
    knots: Vec<f64>,
    /// One coefficient a B-spline.
    pub c: Vec<f64>,
}

/// The four B-splines that do not vanish at a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Local {
    /// The index of the first.
    pub first: usize,
    pub values: [f64; 4],
    pub slopes: [f64; 4],
}

impl Shape {
    /// The spline with these breakpoints, at least two, strictly increasing; all coefficients zero.
    pub fn new(breakpoints: &[f64]) -> Shape {
        let ends = |x| std::iter::repeat_n(x, 3);
        let (first, last) = (breakpoints[0], breakpoints[breakpoints.len() - 1]);
        let knots: Vec<f64> = ends(first).chain(breakpoints.iter().copied()).chain(ends(last)).collect();
        let c = vec![0.0; knots.len() - 4];
        Shape { knots, c }
    }

    /// The breakpoints.
    pub fn breakpoints(&self) -> &[f64] {
        &self.knots[3..self.knots.len() - 3]
    }

    /// The B-splines at `x`; beyond the ends their tangents there.
    pub fn local(&self, x: f64) -> Local {
        let t = &self.knots;
        let at = x.clamp(t[0], t[t.len() - 1]);
        let span = t[4..self.c.len()].partition_point(|&k| k <= at) + 3;
        let mut v = [1.0, 0.0, 0.0, 0.0];
        let mut shares = [0.0; 3];
        for degree in 1..4 {
            let mut saved = 0.0;
            for r in 0..degree {
                let (right, left) = (t[span + r + 1], t[span + r + 1 - degree]);
                let share = v[r] / (right - left);
                v[r] = saved + (right - at) * share;
                saved = (at - left) * share;
                shares[r] = share;
            }
            v[degree] = saved;
        }
        let [p, q, s] = shares;
        let slopes = [-3.0 * p, 3.0 * (p - q), 3.0 * (q - s), 3.0 * s];
        for (v, d) in v.iter_mut().zip(&slopes) {
            *v += (x - at) * d;
        }
        Local {
            first: span - 3,
            values: v,
            slopes,
        }
    }

    /// Value and slope from the B-splines at a point.
    pub fn combine(&self, local: &Local) -> (f64, f64) {
        let c = &self.c[local.first..local.first + 4];
        let dot = |v: &[f64; 4]| c.iter().zip(v).map(|(c, v)| c * v).sum::<f64>();
        (dot(&local.values), dot(&local.slopes))
    }

    pub fn value(&self, x: f64) -> f64 {
        self.combine(&self.local(x)).0
    }

    /// Interpolates `f` at the new breakpoints and, to fix the ends, just inside the outermost intervals
    /// ("not a knot" would ignore them).
    pub fn resampled(&self, breakpoints: &[f64]) -> Option<Shape> {
        let mut next = Shape::new(breakpoints);
        let m = next.c.len();
        // Greville's abscissas: one for every B-spline, never singular.
        let at: Vec<f64> = (0..m).map(|j| next.knots[j + 1..j + 4].iter().sum::<f64>() / 3.0).collect();
        let mut rows = vec![0.0; m * m];
        for (i, x) in at.iter().enumerate() {
            let local = next.local(*x);
            rows[i * m + local.first..i * m + local.first + 4].copy_from_slice(&local.values);
        }
        let rhs: Vec<f64> = at.iter().map(|x| self.value(*x)).collect();
        next.c = crate::linalg::least_squares(&rows, m, &rhs)?;
        Some(next)
    }

    /// `intervals + 1` breakpoints that share out the curve's own roughness evenly (de Boor 2001, chapter XII,
    /// `newknot`): dense where the fourth derivative is large. A part `floor` is shared out evenly over the range.
    pub fn denser(&self, intervals: usize, floor: f64) -> Vec<f64> {
        let t = self.breakpoints();
        let n = t.len() - 1;
        let third: Vec<f64> = (0..n).map(|i| self.third(i)).collect();
        // The fourth derivative from the third's jumps, spread over the neighbouring intervals.
        let fourth = |i: usize| -> f64 {
            let jump = |k: usize| {
                if k == 0 || k == n {
                    0.0
                } else {
                    2.0 * (third[k] - third[k - 1]).abs() / (t[k + 1] - t[k - 1])
                }
            };
            jump(i).max(jump(i + 1))
        };
        let mut density: Vec<f64> = (0..n).map(|i| fourth(i).powf(0.25)).collect();
        let widths: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
        let total: f64 = density.iter().zip(&widths).map(|(d, h)| d * h).sum();
        let length = t[n] - t[0];
        if !(total > 0.0 && total.is_finite()) {
            return (0..=intervals).map(|i| t[0] + length * i as f64 / intervals as f64).collect();
        }
        density.iter_mut().for_each(|d| *d = (1.0 - floor) * *d / total + floor / length);
        let (mut at, mut sum, mut i) = (vec![t[0]], 0.0, 0);
        for k in 1..intervals {
            let goal = k as f64 / intervals as f64;
            while i + 1 < n && sum + density[i] * widths[i] < goal {
                sum += density[i] * widths[i];
                i += 1;
            }
            at.push(t[i] + ((goal - sum) / density[i]).min(widths[i]));
        }
        at.push(t[n]);
        at
    }

    /// The third derivative in interval `i`.
    fn third(&self, i: usize) -> f64 {
        let t = &self.knots;
        let mut d: Vec<f64> = self.c[i..i + 4].to_vec();
        for degree in (1..4).rev() {
            // Coefficients i + 4 - len .. of the derivative's B-splines of one degree less.
            let first = i + 4 - d.len() + 1;
            d = d
                .windows(2)
                .enumerate()
                .map(|(k, w)| {
                    let j = first + k;
                    degree as f64 * (w[1] - w[0]) / (t[j + degree] - t[j])
                })
                .collect();
        }
        d[0]
    }
}

/// Breakpoints without those that would leave an interval with fewer than `fewest` of the sorted samples.
pub(super) fn thinned(breakpoints: &[f64], sorted: &[f64], fewest: usize) -> Vec<f64> {
    let below = |x: f64| sorted.partition_point(|&v| v < x);
    let last = breakpoints.len() - 1;
    let total = sorted.len();
    let mut kept = vec![breakpoints[0]];
    let mut count = 0;
    for &x in &breakpoints[1..last] {
        let here = below(x);
        if here >= count + fewest && total >= here + fewest {
            kept.push(x);
            count = here;
        }
    }
    kept.push(breakpoints[last]);
    kept
}
