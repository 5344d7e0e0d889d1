//! Points in cells, ordered so that those of a box are a few contiguous runs.
//!
//! ```text
//!  +--+--+--+--+--+      The points are ordered by the coordinates of their cells, the first coordinate first.
//!  |  |##|##|##|  |      So the cells of a box that differ in the last dimension alone are one run of points:
//!  +--+--+--+--+--+      here a box of two rows has two runs.
//!  |  |##|##|##|  |
//!  +--+--+--+--+--+
//! ```
//!
//! If there are few cells per point, every cell has a number ([`grid`]). Otherwise only the cells that hold points are kept
//! ([`tree`]), so that far outliers, clusters and many dimensions cost neither memory nor time for empty cells.

mod grid;
mod tree;

use std::ops::Range;

use grid::Grid;
use tree::Tree;

/// A grid is used if there are at most this many cells per point.
const DENSE: f64 = 2.0;
/// Cells are half as wide as a window's half width if they then hold this many points on average. Otherwise they are as wide as the half
/// width.
const OCCUPANCY: f64 = 2.0;
/// The largest number of dimensions in which such small cells save time.
const FINE_DIMENSIONS: usize = 3;
/// Cells are narrower by this factor along the last dimension, as that makes no further runs.
const SLICES: usize = 4;
/// The most dimensions.
const MOST: usize = 6;

/// A box of cells: the first and the last coordinate along every dimension.
type Ends = [(i64, i64); MOST];

/// The cells, and which points each holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    rule: Rule,
    /// Half widths of a window.
    reach: Vec<f64>,
    index: Index,
}

#[derive(Debug, Clone, PartialEq)]
enum Index {
    Grid(Grid),
    Tree(Tree),
}

/// How points go to cells.
#[derive(Debug, Clone, PartialEq)]
struct Rule {
    origin: Vec<f64>,
    /// Cells a unit of x.
    rate: Vec<f64>,
}

impl Rule {
    /// The coordinate of `x` along dimension `j`. It does not decrease when x increases.
    #[inline(always)]
    fn coordinate(&self, j: usize, x: f64) -> i64 {
        let cells = (x - self.origin[j]) * self.rate[j];
        // Rounded down, without a call.
        let toward_zero = cells as i64;
        if cells < toward_zero as f64 {
            toward_zero.saturating_sub(1)
        } else {
            toward_zero
        }
    }
}

/// Cells of points.
pub struct Celled {
    pub cells: Cells,
    /// The columns' ranges.
    pub ranges: Vec<(f64, f64)>,
    /// The points' indices in order of their cells.
    pub order: Vec<u32>,
}

/// An index of cells, and the points' indices in its order.
struct InOrder<I> {
    index: I,
    order: Vec<u32>,
}

impl Celled {
    /// Cells for windows of the half widths `reach`.
    pub fn new(x: &[&[f64]], reach: &[f64]) -> Celled {
        let n = x[0].len();
        let ends: Vec<(f64, f64)> = x.iter().map(|column| extent(column)).collect();
        let last = x.len() - 1;
        // The ends are halved first, as their difference may overflow.
        let cells_along = |j: usize, width: f64| ((0.5 * ends[j].1 - 0.5 * ends[j].0) / (0.5 * width)).floor() + 1.0;
        let cells = |widths: &[f64]| -> f64 { (0..=last).map(|j| cells_along(j, widths[j])).product() };
        let widths = |share: f64| -> Vec<f64> { reach.iter().map(|r| share * r).collect() };
        let fine = x.len() <= FINE_DIMENSIONS && cells(&widths(0.5)) * OCCUPANCY <= n as f64;
        let mut widths = widths(if fine { 0.5 } else { 1.0 });
        widths[last] /= SLICES as f64;
        let rule = Rule {
            origin: ends.iter().map(|e| e.0).collect(),
            rate: widths.iter().map(|width| 1.0 / width).collect(),
        };
        let finite = ends.iter().all(|end| (end.1 - end.0).is_finite());
        let InOrder { index, order } = if finite && cells(&widths) <= DENSE * n as f64 + 64.0 {
            Grid::ordered(&rule, x, &ends).map(Index::Grid)
        } else {
            Tree::ordered(&rule, x).map(Index::Tree)
        };
        let reach = reach.to_vec();
        Celled {
            cells: Cells { rule, reach, index },
            ranges: ends,
            order,
        }
    }
}

impl<I> InOrder<I> {
    fn map<J>(self, of: impl Fn(I) -> J) -> InOrder<J> {
        InOrder {
            index: of(self.index),
            order: self.order,
        }
    }
}

impl Cells {
    /// The points in order, in groups whose windows have much in common: cells as wide along the last dimension as along the
    /// others.
    pub fn groups(&self) -> Vec<Range<usize>> {
        match &self.index {
            Index::Grid(grid) => grid.groups(),
            Index::Tree(tree) => tree.groups(),
        }
    }

    /// The runs of points that hold the whole box from `low` to `high`. The box is widened by `share` of a window's half width on every
    /// side.
    pub fn runs(&self, low: &[f64], high: &[f64], share: f64, runs: &mut Vec<Range<usize>>) {
        let mut ends: Ends = [(0, 0); MOST];
        for (j, ends) in ends.iter_mut().enumerate().take(self.reach.len()) {
            // The box is a little wider than that, because the caller's comparisons round in another order.
            let margin = share * self.reach[j] * (1.0 + 1e-12) + 1e-15 * low[j].abs().max(high[j].abs());
            let coordinate = |x: f64| self.rule.coordinate(j, x);
            *ends = (coordinate(low[j] - margin), coordinate(high[j] + margin));
        }
        runs.clear();
        match &self.index {
            Index::Grid(grid) => grid.runs(&ends, runs),
            Index::Tree(tree) => tree.runs(&ends, runs),
        }
    }
}

/// The least and the largest of finite values.
fn extent(values: &[f64]) -> (f64, f64) {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    values.iter().fold(ends, |(low, high), v| (low.min(*v), high.max(*v)))
}

/// Adds a run. If it continues the last one, the two are joined.
#[inline(always)]
fn push(run: Range<usize>, runs: &mut Vec<Range<usize>>) {
    match runs.last_mut() {
        Some(last) if last.end == run.start => last.end = run.end,
        _ if run.is_empty() => {}
        _ => runs.push(run),
    }
}
