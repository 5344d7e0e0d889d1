//! The search for the bandwidths of several columns by coordinate descent: a common scale first, then column by column.

use super::choice::{KernelScore, KernelSearch, Scores};
use crate::interrupt;
use crate::selection::FLAT;
use crate::sort;

/// Common factors of the logarithmic grid.
const GRID: usize = 12;
/// Bandwidths on one column's grid.
const COLUMN_GRID: usize = 8;
/// Points of a golden-section search.
const GOLDEN: usize = 5;
/// The most rounds of golden-section searches over all columns.
const ROUNDS: usize = 2;
/// A round is the last one if it gains less than this share of the score.
const GAIN: f64 = 1e-4;
/// The grid of factors starts between these.
const SMALLEST: (f64, f64) = (1e-4, 0.4);
/// If the bandwidth is this many extents, a column no longer separates points.
const WIDEST: f64 = 4.0;
/// The number of pairs of points. For the grids all pairs count, as all may be in reach; for the golden sections only the pairs in reach.
const GRID_PAIRS: f64 = 2e7;
const GOLDEN_PAIRS: f64 = 2e7;
/// Fewest points to score at. If there are fewer points, all are taken.
const FEWEST: usize = 500;
/// What a search needs to know of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// The extent of its bulk; `None` for a constant column.
    pub extent: Option<f64>,
    range: f64,
}

impl Column {
    /// A column of finite values.
    pub fn new(x: &[f64]) -> Column {
        let sorted = sort::sorted(x);
        let n = sorted.len();
        let between = |low: usize, high: usize| (sorted[high] - sorted[low]).min(f64::MAX);
        let range = between(0, n - 1);
        let bulk = 2.0 * between(n / 10, n - 1 - n / 10);
        let extent = if bulk > 0.0 { bulk.min(range) } else { range };
        Column {
            extent: (extent >= f64::MIN_POSITIVE / SMALLEST.0).then_some(extent),
            range,
        }
    }

    /// The widest bandwidth worth trying.
    fn widest(&self) -> f64 {
        (WIDEST * self.range).min(f64::MAX)
    }
}

struct Descent<'a> {
    scores: &'a Scores<'a>,
    columns: &'a [Column],
    /// The columns that are not constant.
    varying: Vec<usize>,
    /// The smallest bandwidth, as a share of a column's extent.
    smallest: f64,
    curve: Vec<KernelScore>,
    /// Points to score at.
    points: usize,
    best: KernelScore,
}

/// Searches for the bandwidths with the smallest score.
pub fn search(scores: &Scores<'_>, columns: &[Column]) -> KernelSearch {
    let n = scores.points();
    let points = ((GRID_PAIRS / n as f64) as usize).max(FEWEST).min(n);
    let extents: Vec<f64> = columns.iter().map(|c| c.extent.unwrap_or(1.0)).collect();
    let varying: Vec<usize> = (0..columns.len()).filter(|&j| columns[j].extent.is_some()).collect();
    // A window then holds a few points.
    let smallest = 0.5 * (3.0 * (varying.len() + 1) as f64 / n as f64).powf(1.0 / varying.len().max(1) as f64);
    let start = scores.score(&extents, points);
    let mut descent = Descent {
        scores,
        columns,
        varying,
        smallest: smallest.clamp(SMALLEST.0, SMALLEST.1),
        curve: vec![start.clone()],
        points,
        best: start,
    };
    let ratio = descent.smallest.powf(1.0 / (GRID - 1) as f64);
    descent.grids(&extents, ratio);
    descent.refine();
    descent.golden_sections(ratio.recip());
    let h = descent.best.bandwidths;
    let edge = descent.smallest * (1.0 + 1e-6);
    KernelSearch {
        at_edge: descent.varying.iter().any(|&j| h[j] <= edge * extents[j]),
        bandwidths: h,
        criterion: descent.scores.criterion,
        curve: descent.curve,
    }
}

impl Descent<'_> {
    /// The bandwidths `h` times a common factor. The bandwidths of constant columns do not change.
    fn scaled(&self, h: &[f64], factor: f64) -> Vec<f64> {
        let each = h.iter().zip(self.columns);
        each.map(|(h, c)| if c.extent.is_some() { h * factor } else { *h })
            .collect()
    }

    /// Steps 1 and 2 of [`KernelSearch`]: the grid of common factors, powers of `ratio`, and that of each column.
    fn grids(&mut self, extents: &[f64], ratio: f64) {
        if self.varying.is_empty() {
            return;
        }
        for i in 1..GRID {
            self.attempt(self.scaled(extents, ratio.powi(i as i32)));
        }
        if self.varying.len() > 1 {
            for j in self.varying.clone() {
                self.column_grid(j, self.smallest * extents[j], self.columns[j].widest());
            }
        }
    }

    /// Step 3: golden-section searches over the common factor, then over each column.
    fn golden_sections(&mut self, mut step: f64) {
        for _ in 0..ROUNDS {
            if self.varying.is_empty() {
                return;
            }
            let before = self.best.score;
            let h = self.best.bandwidths.clone();
            self.golden(step, |search, factor| search.scaled(&h, factor));
            if self.varying.len() == 1 {
                return;
            }
            for j in self.varying.clone() {
                let h = self.best.bandwidths.clone();
                let widest = self.columns[j].widest();
                self.golden(step, |_, factor| {
                    let mut h = h.clone();
                    h[j] = (h[j] * factor).min(widest);
                    h
                });
            }
            if !(self.best.score < before * (1.0 - GAIN)) {
                return;
            }
            step = step.sqrt().max(1.2);
        }
    }

    /// Scores these bandwidths. If scores are equal, the wider bandwidths are preferred.
    fn attempt(&mut self, bandwidths: Vec<f64>) -> f64 {
        if interrupt::requested() {
            return self.best.score;
        }
        let tried = self.scores.score(&bandwidths, self.points);
        let size = |h: &[f64]| h.iter().map(|h| h.ln()).sum::<f64>();
        let best = &self.best;
        let equal = (tried.score - best.score).abs() <= FLAT * best.score;
        let wider = size(&tried.bandwidths) > size(&best.bandwidths);
        if (equal && wider) || (!equal && tried.score < best.score) {
            self.best = tried.clone();
        }
        let score = tried.score;
        self.curve.push(tried);
        score
    }

    /// One column's bandwidth from `low` to `high`.
    fn column_grid(&mut self, j: usize, low: f64, high: f64) {
        let h = self.best.bandwidths.clone();
        // The grid lies around the present bandwidth, which was already tried.
        let (below, above) = (h[j] / low, high / h[j]);
        let half = COLUMN_GRID / 2;
        for i in 1..=half {
            let share = i as f64 / half as f64;
            for factor in [above.powf(share), below.powf(-share)] {
                // The golden sections make the finer steps.
                if factor != 1.0 && factor.is_finite() {
                    let mut h = h.clone();
                    h[j] = (h[j] * factor).min(f64::MAX);
                    self.attempt(h);
                }
            }
        }
    }

    /// Scores at more points from now on, if these are cheap enough.
    fn refine(&mut self) {
        let n = self.scores.points();
        if self.points >= n {
            return;
        }
        let pairs = self.scores.pairs(&self.best.bandwidths).max(1.0);
        let points = ((GOLDEN_PAIRS / pairs) as usize).min(n);
        if points > self.points {
            self.points = points;
            self.best = self.scores.score(&self.best.bandwidths.clone(), points);
            self.curve.push(self.best.clone());
        }
    }

    /// A golden-section search over the factors from 1/step to step.
    fn golden(&mut self, step: f64, along: impl Fn(&Self, f64) -> Vec<f64>) {
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut a, mut b) = (-step.ln(), step.ln());
        let (mut c, mut d) = (b - golden * (b - a), a + golden * (b - a));
        let mut low = self.attempt(along(self, c.exp()));
        let mut high = self.attempt(along(self, d.exp()));
        for _ in 2..GOLDEN {
            if low < high {
                (b, d, high) = (d, c, low);
                c = b - golden * (b - a);
                low = self.attempt(along(self, c.exp()));
            } else {
                (a, c, low) = (c, d, high);
                d = a + golden * (b - a);
                high = self.attempt(along(self, d.exp()));
            }
        }
    }
}
