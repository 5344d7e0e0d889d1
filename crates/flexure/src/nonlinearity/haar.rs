//! The Haar series: means over the cells of a dyadic partition.
//!
//! Least squares on the Haar wavelets of the levels below L is the mean of each of the 2^L equal cells of the
//! data's range. A cell without data has no wavelet coefficients of its own. It takes the mean of the smallest dyadic interval around it
//! that has data. So does a cell whose only point is left out. Reference: Greblicki and Pawlak (2008), ch. 7.

use super::Outside;
use super::estimator::{Choice, Estimator, Points, Regression, check_queries, evaluate};
use crate::error::{Error, Result};
use crate::interrupt;
use crate::selection::{OpenEnds, ScoredParameter, Search};

/// The most levels: 2^20 cells.
const MOST_LEVELS: usize = 20;

/// The Haar series in one variable: a step function, for m with jumps.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `levels` | L, for 2^L cells | 0 to 20 | by leave-one-out, at most log2 n |
/// | `outside` | the estimate beyond the data's range | | NaN |
///
/// ```
/// use flexure::nonlinearity::{Estimator, HaarRegression, Regression};
/// let x: Vec<f64> = (0..800).map(|i| i as f64 / 799.0).collect();
/// let y: Vec<f64> = x.iter().map(|&x| if x < 0.25 { 0.0 } else { 1.0 }).collect();
/// let fit = HaarRegression::default().fit(&[&x], &y, None)?;
/// assert_eq!(fit.levels(), 2);
/// assert_eq!(fit.predict(&[&[0.24, 0.26]])?, [0.0, 1.0]);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HaarRegression {
    /// The number of levels L: 2^L cells.
    pub levels: Choice<usize>,
    /// The estimate beyond the data's range. The linear continuation of a step function is the nearest value.
    pub outside: Outside,
}

impl Estimator for HaarRegression {
    type Fit = HaarFit;

    fn fit(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<HaarFit> {
        if let Choice::Fixed(levels) = self.levels
            && levels > MOST_LEVELS
        {
            return Err(Error::parameter("the number of levels", levels as f64, "at most 20"));
        }
        let points = Points::new("a Haar regression", 1, x, y, weights)?;
        let most = match self.levels {
            Choice::Fixed(levels) => levels,
            Choice::FromData(_) => (points.len().ilog2() as usize).min(MOST_LEVELS),
        };
        let tree = Tree::new(&points, most);
        let search = match self.levels {
            Choice::Fixed(_) => None,
            Choice::FromData(criterion) => {
                let score = |levels| {
                    interrupt::leave();
                    tree.score(&points, levels)
                };
                let curve = (0..=most).map(score).collect();
                let open = OpenEnds::above(most < MOST_LEVELS);
                Some(Search::best(criterion, curve, open, points.size()))
            }
        };
        let levels = search.as_ref().map_or(most, |s| s.parameter);
        Ok(HaarFit {
            values: (0..1 << levels).map(|cell| tree.mean(levels, cell)).collect(),
            grid: tree.grid,
            outside: self.outside,
            search,
        })
    }
}

/// The data's range.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Grid {
    low: f64,
    high: f64,
}

impl Grid {
    /// The cell that contains `x`, of `1 << levels` cells. Each contains its left end, and the last one also its right end.
    fn cell(self, x: f64, levels: usize) -> usize {
        let length = if self.high > self.low {
            self.high - self.low
        } else {
            1.0
        };
        // The index of the finest cell is shifted: so the partitions nest exactly, in spite of rounding.
        let finest = (1_usize << MOST_LEVELS) as f64;
        let cell = ((x - self.low) / length * finest) as usize;
        cell.min((1 << MOST_LEVELS) - 1) >> (MOST_LEVELS - levels)
    }
}

/// The weight and the weighted sum of the centred ordinates in every dyadic interval, from the coarsest.
struct Tree {
    grid: Grid,
    offset: f64,
    levels: Vec<Vec<(f64, f64)>>,
}

impl Tree {
    fn new(points: &Points, most: usize) -> Tree {
        let (low, high) = points.range(0);
        let (grid, offset) = (Grid { low, high }, points.mean());
        let mut levels = vec![vec![(0.0, 0.0); 1 << most]];
        for ((x, y), w) in points.x[0].iter().zip(&points.y).zip(&points.w) {
            let sums = &mut levels[0][grid.cell(*x, most)];
            *sums = (sums.0 + w, sums.1 + w * (y - offset));
        }
        for level in 0..most {
            let pairs = levels[level].chunks_exact(2);
            levels.push(pairs.map(|p| (p[0].0 + p[1].0, p[0].1 + p[1].1)).collect());
        }
        levels.reverse();
        Tree { grid, offset, levels }
    }

    /// The mean of the smallest dyadic interval with data around a cell, and that interval's level.
    fn mean(&self, levels: usize, cell: usize) -> f64 {
        let around = (0..=levels).map(|up| self.levels[levels - up][cell >> up]);
        around
            .into_iter()
            .find(|s| s.0 > 0.0)
            .map_or(f64::NAN, |s| self.offset + s.1 / s.0)
    }

    fn score(&self, points: &Points, levels: usize) -> ScoredParameter<usize> {
        let (mut trace, mut left_out, mut residual) = (0.0, 0.0, 0.0);
        for ((x, y), w) in points.x[0].iter().zip(&points.y).zip(&points.w) {
            let (cell, y) = (self.grid.cell(*x, levels), y - self.offset);
            let own = self.levels[levels][cell];
            trace += w / own.0;
            residual += w * (y - own.1 / own.0).powi(2);
            // Without the point: the smallest interval around it that holds another point.
            let others = (0..=levels)
                .map(|up| self.levels[levels - up][cell >> up])
                .find(|s| s.0 - w > ALONE * s.0);
            left_out += w * others.map_or(f64::INFINITY, |s| ((y * s.0 - s.1) / (s.0 - w)).powi(2));
        }
        ScoredParameter::new(levels, trace, left_out, residual, points.total_weight(), points.len())
    }
}

/// If the rest of an interval's weight is below this share, it is rounding: there is no other point.
const ALONE: f64 = 1e-12;

/// A fitted Haar series.
#[derive(Debug, Clone, PartialEq)]
pub struct HaarFit {
    values: Vec<f64>,
    grid: Grid,
    outside: Outside,
    search: Option<Search<usize>>,
}

impl HaarFit {
    /// The number of levels L; there are 2^L cells.
    pub fn levels(&self) -> usize {
        self.values.len().ilog2() as usize
    }

    /// The values in the cells, from left to right.
    pub fn cells(&self) -> &[f64] {
        &self.values
    }

    /// The scores of all numbers of levels that were tried, where the number was chosen from the data.
    pub fn search(&self) -> Option<&Search<usize>> {
        self.search.as_ref()
    }
}

impl Regression for HaarFit {
    fn dimension(&self) -> usize {
        1
    }

    fn predict(&self, x: &[&[f64]]) -> Result<Vec<f64>> {
        let x = check_queries(x, 1)?[0];
        let value = |x| self.values[self.grid.cell(x, self.levels())];
        let range = (self.grid.low, self.grid.high);
        Ok(evaluate(x, range, self.outside, value, |_| 0.0))
    }
}
