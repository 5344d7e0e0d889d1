//! Bandwidths, given or chosen from the data, in any number of columns.

use std::sync::OnceLock;

use super::descent::{self, Column};
use super::product::Product;
use super::{Degree, Kernel, Sorted, leave_one_out};
use crate::error::Result;
use crate::nonlinearity::estimator::{Checked, Points};
use crate::nonlinearity::neighbours::Tree;
use crate::selection::{BandwidthSearch, Criterion, Score, ScoredParameter, generalized, generalized_score};

/// The bandwidths of a kernel estimate: given, or chosen from the data.
#[derive(Debug, Clone, PartialEq)]
pub enum Bandwidth {
    /// One for all columns, or one for each column, in the column's unit. It is half the width of the window; for the Gaussian, its
    /// standard deviation.
    Fixed(Vec<f64>),
    /// Those with the smallest score: see [`KernelSearch`].
    FromData(Criterion),
}

impl Default for Bandwidth {
    /// From the data, by leave-one-out.
    fn default() -> Self {
        Bandwidth::FromData(Criterion::default())
    }
}

/// Bandwidths that were tried, and their score.
#[derive(Debug, Clone, PartialEq)]
pub struct KernelScore {
    /// The bandwidths, one per column, in the columns' units.
    pub bandwidths: Vec<f64>,
    /// The score, in the squared unit of y.
    pub score: f64,
    /// The number of points at which errors were taken. The estimates at these points are always made from all points.
    pub points: usize,
}

/// The search for the bandwidths of a kernel estimate. Its result is part of every fit that used it.
///
/// In one column it is a [`BandwidthSearch`]. In several columns the search goes from a common scale to one scale for each column:
///
/// 1. bandwidths in proportion to the extents of the columns' bulks (twice the distance between the first and
///    the ninth decile, but no more than the range), on a logarithmic grid of common factors;
/// 2. for each column in turn a logarithmic grid, up to bandwidths so wide that the column no longer separates points. Such a width is
///    right for a column that the regression does not depend on (Hall, Li and Racine 2007). For the local linear fit it is also right for a
///    column with a linear effect;
/// 3. golden-section searches around the best, over the common factor and then over each column.
///
/// Up to 4472 points, errors are taken at every point. With more, they are taken at some of the points, spread evenly in order of their
/// coordinates. Steps 1 and 2 take 2e7/n points (at least 500). Step 3 takes more: all points, or about as many as make 2e7 pairs of points
/// within reach of each other. The estimates at these points are exact: they are made from all points. The chosen bandwidths have the
/// smallest score among those scored at the most points; [`KernelScore::points`] says how many.
///
/// The result does not depend on the number of threads nor on the order of the points.
#[derive(Debug, Clone, PartialEq)]
pub struct KernelSearch {
    /// The bandwidths with the smallest score, one per column. A constant column's is 1.
    pub bandwidths: Vec<f64>,
    /// The score that was minimised.
    pub criterion: Criterion,
    /// All bandwidths that were tried. In one column they are in increasing order, in several columns in the order of the search.
    pub curve: Vec<KernelScore>,
    /// Whether a bandwidth is the smallest one tried (in one column also: the largest one). The minimum may then lie beyond.
    pub at_edge: bool,
}

impl KernelSearch {
    /// Searches over checked data of at least three points.
    pub(super) fn over(data: &Checked<'_>, kernel: Kernel, degree: Degree, criterion: Criterion) -> Result<Self> {
        if let [x] = data.x {
            let line = Sorted::new(x, data.y, data.w);
            let search = match criterion {
                Criterion::LeaveOneOut => BandwidthSearch::with_degree(kernel, degree, &line),
                Criterion::Generalized => generalized(kernel, degree, &line),
            };
            let score = |s: &Score| KernelScore {
                bandwidths: vec![s.bandwidth],
                score: s.error,
                points: line.len(),
            };
            return Ok(KernelSearch {
                bandwidths: vec![search.bandwidth],
                criterion,
                curve: search.curve.iter().map(score).collect(),
                at_edge: search.at_edge,
            });
        }
        let points = data.sorted();
        let columns: Vec<Column> = points.x.iter().map(|x| Column::new(x)).collect();
        Ok(with_scores(&points, kernel, degree, criterion, |scores| {
            descent::search(scores, &columns)
        }))
    }

    /// The exact score of these bandwidths over checked data of at least three points.
    pub(super) fn score_of(data: &Checked<'_>, kernel: Kernel, degree: Degree, criterion: Criterion, h: &[f64]) -> f64 {
        if let ([x], [h]) = (data.x, h) {
            let line = Sorted::new(x, data.y, data.w);
            return match criterion {
                Criterion::LeaveOneOut => leave_one_out(&line, kernel, degree, &[*h])[0],
                Criterion::Generalized => generalized_score(&line, kernel, degree, *h),
            };
        }
        if data.w.is_none() {
            return Scores::new(*data, kernel, degree, criterion)
                .score(h, data.y.len())
                .score;
        }
        let points = data.sorted();
        with_scores(&points, kernel, degree, criterion, |scores| {
            scores.score(h, points.len()).score
        })
    }
}

/// Calls `run` with the scores over these points.
fn with_scores<R>(
    points: &Points,
    kernel: Kernel,
    degree: Degree,
    criterion: Criterion,
    run: impl FnOnce(&Scores<'_>) -> R,
) -> R {
    let columns: Vec<&[f64]> = points.x.iter().map(Vec::as_slice).collect();
    let weighted = points.w.iter().any(|w| *w != 1.0);
    let data = Checked {
        x: &columns,
        y: &points.y,
        w: weighted.then_some(&points.w),
    };
    run(&Scores::new(data, kernel, degree, criterion))
}

/// Sums of squared errors over points.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Errors {
    weight: f64,
    trace: f64,
    left_out: f64,
    residual: f64,
    points: usize,
}

impl Errors {
    /// Adds a point of weight `w`: its leverage per weight, its residual, and its residual from the estimate without it.
    #[inline(always)]
    pub fn add(&mut self, w: f64, leverage: f64, residual: f64, left_out: f64) {
        self.weight += w;
        self.trace += w * leverage;
        self.residual += w * residual * residual;
        self.left_out += w * left_out * left_out;
        self.points += 1;
    }

    pub fn plus(self, other: Errors) -> Errors {
        Errors {
            weight: self.weight + other.weight,
            trace: self.trace + other.trace,
            left_out: self.left_out + other.left_out,
            residual: self.residual + other.residual,
            points: self.points + other.points,
        }
    }

    /// The score of these bandwidths.
    pub fn score(&self, bandwidths: &[f64], criterion: Criterion) -> KernelScore {
        let of = ScoredParameter::new((), self.trace, self.left_out, self.residual, self.weight, self.points);
        KernelScore {
            bandwidths: bandwidths.to_vec(),
            score: of.score(criterion),
            points: self.points,
        }
    }
}

/// Scores of bandwidths in several columns.
pub(super) struct Scores<'a> {
    /// Without points of weight zero.
    data: Checked<'a>,
    /// The tree and the mean of the ordinates. They are made only if some point has no other in reach.
    tree: OnceLock<(Tree, f64)>,
    kernel: Kernel,
    degree: Degree,
    pub criterion: Criterion,
}

impl<'a> Scores<'a> {
    fn new(data: Checked<'a>, kernel: Kernel, degree: Degree, criterion: Criterion) -> Self {
        Scores {
            data,
            tree: OnceLock::new(),
            kernel,
            degree,
            criterion,
        }
    }

    /// The mean of the ordinates nearest to point `i`, minus the mean of all.
    fn alone(&self, i: usize) -> f64 {
        let (tree, mean) = self.tree.get().unwrap_or_else(|| {
            // The tree is made outside the lock of the cell. It is made in parallel, and a thread that waits for it may come here again.
            let points = self.data.sorted();
            let extents = points.x.iter().map(|x| Column::new(x).extent.unwrap_or(1.0));
            let made = (Tree::with_scales(&points, extents.collect()), points.mean());
            self.tree.get_or_init(|| made)
        });
        let at: Vec<f64> = self.data.x.iter().map(|column| column[i]).collect();
        tree.mean_of_others(&at, self.data.weight(i)) - mean
    }

    /// The number of points.
    pub fn points(&self) -> usize {
        self.data.y.len()
    }

    /// The score with errors taken at this many of the points.
    pub fn score(&self, bandwidths: &[f64], points: usize) -> KernelScore {
        let n = self.points();
        let product = Product::new(&self.data, self.kernel, bandwidths);
        // Every (n / points)-th point.
        let scored = |i: usize| points >= n || (i + 1) * points / n > i * points / n;
        product
            .errors(self.degree, &scored, &|i| self.alone(i))
            .score(bandwidths, self.criterion)
    }

    /// About how many points there are in a window.
    pub fn pairs(&self, bandwidths: &[f64]) -> f64 {
        Product::new(&self.data, self.kernel, bandwidths).pairs()
    }
}
