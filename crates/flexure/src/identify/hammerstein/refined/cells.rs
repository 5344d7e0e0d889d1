//! The input's samples in cells: what regressions on it need, gathered once.

use super::pieces::Unit;

/// Most cells that the samples are gathered in.
const MOST_CELLS: usize = 1500;
/// The fewest samples of a cell, but where values tie.
const FEWEST_IN_CELL: usize = 3;

/// The argument's samples in cells, once for all regressions on it.
pub(super) struct Cells {
    pub unit: Unit,
    /// The cell of every sample.
    pub of: Vec<u32>,
    /// Number, mean of s, lower limit of every cell.
    pub count: Vec<f64>,
    pub s: Vec<f64>,
    pub lower: Vec<f64>,
    /// Whether every cell holds one value.
    exact: bool,
    /// Sums of (s - t)^(0, 2, 6) over the samples above t = lower[m].
    pub norms: [Vec<f64>; 3],
}

impl Cells {
    /// Gathers the samples that count.
    pub fn new(u: &[f64]) -> Cells {
        let mut sorted = u.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let n = sorted.len();
        let unit = Unit::new(sorted[0], sorted[n - 1]);
        let cells = (n / FEWEST_IN_CELL).clamp(1, MOST_CELLS);
        let mut limits: Vec<f64> = Vec::with_capacity(cells);
        let distinct = {
            let mut d: Vec<f64> = sorted.clone();
            d.dedup();
            d
        };
        let exact = distinct.len() <= cells;
        if exact {
            limits.extend(distinct.windows(2).map(|w| 0.5 * w[0] + 0.5 * w[1]));
        } else {
            for i in 1..cells {
                let k = sorted.partition_point(|v| *v < sorted[i * n / cells]);
                if k > 0 {
                    let t = 0.5 * sorted[k - 1] + 0.5 * sorted[k];
                    if limits.last().is_none_or(|l| t > *l) {
                        limits.push(t);
                    }
                }
            }
        }
        let mut lower = vec![-1.0];
        lower.extend(limits.iter().map(|t| unit.of(*t)));
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

    /// The samples' values where there are at most so many.
    pub fn levels(&self, most: usize) -> Option<Vec<f64>> {
        (self.exact && self.len() <= most).then(|| self.s.iter().map(|s| self.unit.back(*s)).collect())
    }

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

    pub fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        self.count.iter().zip(a).zip(b).map(|((w, a), b)| w * a * b).sum()
    }

    /// Sums of w v (s - t)^d, d = 0, 1, 3, over the cells from m on, t = lower[m].
    pub fn moments(&self, v: &[f64]) -> [Vec<f64>; 3] {
        let n = self.len();
        let mut out = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        let mut mu = [0.0; 4];
        let mut last = 1.0;
        for m in (1..n).rev() {
            let t = self.lower[m];
            let d = last - t;
            last = t;
            mu[3] += d * (3.0 * mu[2] + d * (3.0 * mu[1] + d * mu[0]));
            mu[2] += d * (2.0 * mu[1] + d * mu[0]);
            mu[1] += d * mu[0];
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

    fn square_norms(&self) -> [Vec<f64>; 3] {
        let n = self.len();
        let mut out = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        let mut mu = [0.0; 7];
        let mut last = 1.0;
        for m in (1..n).rev() {
            let t = self.lower[m];
            let d = last - t;
            last = t;
            // Pascal's triangle in place: (x + d)^k from x^k, one d at a time.
            for top in 1..7 {
                for k in (top..7).rev() {
                    mu[k] += d * mu[k - 1];
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
