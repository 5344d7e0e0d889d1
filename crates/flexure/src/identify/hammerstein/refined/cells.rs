//! The input's samples in cells, and running sums over these for all breakpoints at once.

use super::limits::{FEWEST_IN_CELL, MOST_CELLS};
use super::piecewise::UnitCoordinate;

/// The degrees of the truncated powers, in the order of all sums over them.
pub(super) const DEGREES: [u8; 3] = [0, 1, 3];

/// The input's samples in cells, which are gathered once for all regressions.
pub(super) struct Cells {
    pub unit: UnitCoordinate,
    /// The cell of every sample.
    pub of: Vec<u32>,
    /// The number of samples in every cell, the mean of their s, and the cell's lower limit.
    pub count: Vec<f64>,
    pub s: Vec<f64>,
    pub lower: Vec<f64>,
    /// Whether every cell holds one value.
    exact: bool,
    /// The squared norm of (s - t)^d for d in [`DEGREES`] over the samples above t = lower[m].
    pub norms: [Vec<f64>; 3],
}

impl Cells {
    /// Gathers all samples.
    pub fn new(u: &[f64]) -> Cells {
        let mut sorted = u.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let unit = UnitCoordinate::new(sorted[0], sorted[sorted.len() - 1]);
        let CellLimits { between, exact } = CellLimits::new(&sorted);
        let mut lower = vec![-1.0];
        lower.extend(between.iter().map(|t| unit.of(*t)));
        lower.dedup();
        let of: Vec<u32> = u
            .iter()
            .map(|x| lower[1..].partition_point(|l| *l <= unit.of(*x)) as u32)
            .collect();
        let mut count = vec![0.0; lower.len()];
        let mut s = vec![0.0; lower.len()];
        for (x, m) in u.iter().zip(&of) {
            count[*m as usize] += 1.0;
            s[*m as usize] += unit.of(*x);
        }
        s.iter_mut().zip(&count).for_each(|(s, c)| *s /= f64::max(*c, 1.0));
        let mut cells = Cells {
            unit,
            of,
            count,
            s,
            lower,
            exact,
            norms: Default::default(),
        };
        cells.norms = cells.square_norms();
        cells
    }

    /// The samples' values, if there are at most `most` different ones.
    pub fn levels(&self, most: usize) -> Option<Vec<f64>> {
        (self.exact && self.len() <= most).then(|| self.s.iter().map(|s| self.unit.back(*s)).collect())
    }

    /// The number of cells.
    pub fn len(&self) -> usize {
        self.count.len()
    }

    /// The cells' means of values at the samples.
    pub fn means(&self, values: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.len()];
        for (v, m) in values.iter().zip(&self.of) {
            sums[*m as usize] += v;
        }
        sums.iter().zip(&self.count).map(|(s, c)| s / c.max(1.0)).collect()
    }

    /// The product of two functions over all samples, from their values at the cells.
    pub fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        self.count.iter().zip(a).zip(b).map(|((w, a), b)| w * a * b).sum()
    }

    /// The products of v with (s - t)^d for d in [`DEGREES`], over the cells from m on, t = lower[m].
    ///
    /// The cells are passed from the last to the first. `mu[d]` is the sum of w v (s - t)^d for the present t. When t moves down by
    /// delta, (s - t)^d becomes (s - t + delta)^d, which the binomial formula expresses by the present sums:
    /// ```text
    ///   -1 |------|------|--- m ---|-----------| 1
    ///                    t = lower[m]          cells that are already in mu
    /// ```
    /// Then the cell m itself is added.
    pub fn moments(&self, v: &[f64]) -> [Vec<f64>; 3] {
        let n = self.len();
        let mut out = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        let mut mu = [0.0; 4];
        let mut last = 1.0;
        for m in (1..n).rev() {
            let t = self.lower[m];
            let delta = last - t;
            last = t;
            mu[3] += delta * (3.0 * mu[2] + delta * (3.0 * mu[1] + delta * mu[0]));
            mu[2] += delta * (2.0 * mu[1] + delta * mu[0]);
            mu[1] += delta * mu[0];
            let (wv, x) = (self.count[m] * v[m], self.s[m] - t);
            mu[0] += wv;
            mu[1] += wv * x;
            mu[2] += wv * x * x;
            mu[3] += wv * x * x * x;
            out[0][m] = mu[0];
            out[1][m] = mu[1];
            out[2][m] = mu[3];
        }
        out
    }

    /// The same for the squares of (s - t)^d, whose sums of degree 2 d = 0, 2, 6 need all lower ones.
    fn square_norms(&self) -> [Vec<f64>; 3] {
        let n = self.len();
        let mut out = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        let mut mu = [0.0; 7];
        let mut last = 1.0;
        for m in (1..n).rev() {
            let t = self.lower[m];
            let delta = last - t;
            last = t;
            // Pascal's triangle in place: (x + delta)^k from x^k, one delta at a time.
            for top in 1..7 {
                for k in (top..7).rev() {
                    mu[k] += delta * mu[k - 1];
                }
            }
            let (mut p, x) = (self.count[m], self.s[m] - t);
            for mu in &mut mu {
                *mu += p;
                p *= x;
            }
            out[0][m] = mu[0];
            out[1][m] = mu[2];
            out[2][m] = mu[6];
        }
        out
    }
}

/// The limits between the cells.
struct CellLimits {
    between: Vec<f64>,
    /// Whether every cell holds one value.
    exact: bool,
}

impl CellLimits {
    /// Few distinct values have a cell each. Otherwise the limits are evenly spaced by rank, and equal values stay together.
    fn new(sorted: &[f64]) -> CellLimits {
        let n = sorted.len();
        let cells = (n / FEWEST_IN_CELL).clamp(1, MOST_CELLS);
        let mut distinct = sorted.to_vec();
        distinct.dedup();
        if distinct.len() <= cells {
            return CellLimits {
                between: distinct.windows(2).map(|w| 0.5 * w[0] + 0.5 * w[1]).collect(),
                exact: true,
            };
        }
        let mut between: Vec<f64> = Vec::with_capacity(cells);
        for i in 1..cells {
            let k = sorted.partition_point(|v| *v < sorted[i * n / cells]);
            if k > 0 {
                let t = 0.5 * sorted[k - 1] + 0.5 * sorted[k];
                if between.last().is_none_or(|l| t > *l) {
                    between.push(t);
                }
            }
        }
        CellLimits { between, exact: false }
    }
}
