//! The mean over the k nearest neighbours (Stone 1977).
//!
//! $$ m_n(x) = \frac1k \sum_{i \in N_k(x)} Y_i . $$
//! Points at exactly the distance of the k-th neighbour share the places that are left, so that ties need no arbitrary choice. A point of
//! weight w counts as w points. In one variable a sweep over the sorted points costs O(1) per query for every k. In several variables a k-d
//! tree finds the neighbours.

mod line;
mod tree;

use super::Outside;
use super::estimator::{Choice, Estimator, Points, Regression, check_queries};
use crate::error::{Error, ParameterError, Result};
use crate::nonlinearity::estimator::MOST_COLUMNS;
use crate::parallel;
use crate::selection::{Criterion, OpenEnds, ScoredParameter, Search};
use crate::sort;
use line::Line;
pub(super) use tree::Tree;

/// Numbers of neighbours tried on the logarithmic grid.
const GRID: usize = 20;
/// Further numbers tried on either side of the best.
const FINER: usize = 5;

/// The mean over the nearest neighbours, in one to six variables.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `neighbours` | k, compared with sums of weights | 1 to the total weight | by leave-one-out |
/// | `outside` | the estimate where a coordinate lies beyond its column's range | | NaN |
///
/// In several variables the distance is Euclidean after division of every column by its standard deviation.
/// Distances are equal if they are equal in floating-point arithmetic.
///
/// In one variable the data choose among all k. In d > 1 variables they choose among those up to 2 n^(4/(4 + d)), twice the order that is
/// best for a smooth m.
///
/// ```
/// use flexure::nonlinearity::{Choice, Estimator, NearestNeighbours, Regression};
/// let method = NearestNeighbours { neighbours: Choice::Fixed(2), ..Default::default() };
/// let fit = method.fit(&[&[0.0, 1.0, 2.0, 5.0]], &[1.0, 3.0, 5.0, 9.0], None)?;
/// assert_eq!(fit.predict(&[&[0.2, 1.0]])?, [2.0, 3.0]); // at 1, points 0 and 2 share the second place
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NearestNeighbours {
    /// The number of neighbours k.
    pub neighbours: Choice<usize>,
    /// The estimate where a coordinate lies beyond its column's range. The estimate is a step function, so its linear continuation is the
    /// value at the nearest point of the range.
    pub outside: Outside,
}

impl Estimator for NearestNeighbours {
    type Fit = NeighboursFit;

    fn fit(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<NeighboursFit> {
        let points = Points::new("a nearest-neighbour regression", MOST_COLUMNS, x, y, weights)?;
        let total = points.total_weight();
        if let Choice::Fixed(k) = self.neighbours {
            if k < 1 {
                return Err(Error::parameter("the number of neighbours", k as f64, "at least 1"));
            }
            if k as f64 > total {
                return Err(Error::Parameter(ParameterError::BeyondData {
                    parameter: "the number of neighbours",
                    value: k,
                    most: total as usize,
                    reason: "the weights of all points add up to no more",
                }));
            }
        }
        let ranges = (0..x.len()).map(|j| points.range(j)).collect();
        let data = if x.len() == 1 {
            Index::Line(Line::new(&points))
        } else {
            Index::Tree(Tree::new(&points))
        };
        let search = match self.neighbours {
            Choice::Fixed(_) => None,
            Choice::FromData(criterion) => Some(data.search(&points, criterion)?),
        };
        let neighbours = match self.neighbours {
            Choice::Fixed(k) => k,
            Choice::FromData(_) => search.as_ref().map_or(1, |s| s.parameter),
        };
        Ok(NeighboursFit {
            data,
            ranges,
            neighbours,
            outside: self.outside,
            search,
        })
    }
}

/// The weight of some points, and the weighted sum of their centred ordinates.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Mass {
    weight: f64,
    moment: f64,
}

impl Mass {
    fn plus(self, other: Mass) -> Mass {
        Mass {
            weight: self.weight + other.weight,
            moment: self.moment + other.moment,
        }
    }
}

/// The sums of one query.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Neighbourhood {
    /// The points nearer than the k-th neighbour.
    near: Mass,
    /// The points at exactly the same distance as the k-th neighbour.
    tied: Mass,
    /// That distance, in some monotone measure that is zero for zero.
    radius: f64,
}

impl Neighbourhood {
    fn mean(&self, k: f64) -> f64 {
        (self.near.moment + self.share(k) * self.tied.moment) / k
    }

    /// The share with which the tied points count.
    fn share(&self, k: f64) -> f64 {
        (k - self.near.weight) / self.tied.weight
    }

    /// The same without one of its points, at the query itself.
    fn without(mut self, w: f64, y: f64) -> Self {
        let own = if self.radius > 0.0 {
            &mut self.near
        } else {
            &mut self.tied
        };
        *own = Mass {
            weight: own.weight - w,
            moment: own.moment - w * y,
        };
        self
    }
}

/// Adds up the three sums of a candidate over all points.
#[derive(Debug, Clone, Copy, Default)]
struct Scores {
    trace: f64,
    left_out: f64,
    residual: f64,
}

impl Scores {
    /// Adds a point of weight `w` and centred ordinate `y`, from its neighbourhoods of k and of k + w neighbours.
    fn add(&mut self, k: f64, w: f64, y: f64, with: Neighbourhood, without: Neighbourhood) {
        self.trace += if with.radius > 0.0 {
            w / k
        } else {
            with.share(k) * w / k
        };
        self.residual += w * (y - with.mean(k)).powi(2);
        self.left_out += w * (y - without.without(w, y).mean(k)).powi(2);
    }
}

#[derive(Debug, Clone, PartialEq)]
enum Index {
    Line(Line),
    Tree(Tree),
}

impl Index {
    fn search(&self, points: &Points, criterion: Criterion) -> Result<Search<usize>> {
        let heaviest = points.w.iter().copied().fold(0.0, f64::max);
        // Enough weight must remain if any one point is left out.
        let possible = (points.total_weight() - heaviest) as usize;
        if possible < 1 {
            return Err(Error::too_short(
                "the choice of a number of neighbours",
                2,
                points.len(),
            ));
        }
        let d = points.x.len() as f64;
        let most = match self {
            Index::Line(_) => possible,
            Index::Tree(_) => possible.min((2.0 * (points.len() as f64).powf(4.0 / (4.0 + d))).ceil() as usize),
        };
        let mut curve = self.scores(points, &between(1, most, GRID));
        let score = |c: &ScoredParameter<usize>| c.score(criterion);
        let best = crate::selection::lowest(&curve, score);
        let below = curve[best.saturating_sub(1)].parameter;
        let above = curve[(best + 1).min(curve.len() - 1)].parameter;
        let centre = curve[best].parameter;
        let mut finer = between(below, centre, FINER + 2);
        finer.extend(between(centre, above, FINER + 2));
        finer.retain(|k| curve.iter().all(|c| c.parameter != *k));
        finer.dedup();
        curve.extend(self.scores(points, &finer));
        sort::by_key(&mut curve, |c| c.parameter as f64);
        let open = OpenEnds::above(most < possible);
        Ok(Search::best(criterion, curve, open, points.size()))
    }

    /// The candidates for these increasing numbers of neighbours.
    fn scores(&self, points: &Points, numbers: &[usize]) -> Vec<ScoredParameter<usize>> {
        let sums = match self {
            Index::Line(line) => parallel::batch(numbers, |&k| line.scores(k as f64)),
            Index::Tree(tree) => tree.scores(numbers),
        };
        let (weight, n) = (points.total_weight(), points.len());
        let candidates = numbers.iter().zip(sums);
        candidates
            .map(|(&k, s): (_, Scores)| ScoredParameter::new(k, s.trace, s.left_out, s.residual, weight, n))
            .collect()
    }
}

/// About `count` integers from `low` to `high`, both included, with evenly spaced logarithms.
fn between(low: usize, high: usize, count: usize) -> Vec<usize> {
    let ratio = high as f64 / low as f64;
    let at = |i: usize| (low as f64 * ratio.powf(i as f64 / (count - 1) as f64)).round() as usize;
    let mut numbers: Vec<usize> = (0..count).map(|i| at(i).clamp(low, high)).collect();
    numbers.dedup();
    numbers
}

/// A fitted nearest-neighbour regression.
#[derive(Debug, Clone, PartialEq)]
pub struct NeighboursFit {
    data: Index,
    ranges: Vec<(f64, f64)>,
    neighbours: usize,
    outside: Outside,
    search: Option<Search<usize>>,
}

impl NeighboursFit {
    /// The number of neighbours k, given or chosen.
    pub fn neighbours(&self) -> usize {
        self.neighbours
    }

    /// The scores of all numbers that were tried, where the number was chosen from the data.
    pub fn search(&self) -> Option<&Search<usize>> {
        self.search.as_ref()
    }
}

impl Regression for NeighboursFit {
    fn dimension(&self) -> usize {
        self.ranges.len()
    }

    fn predict(&self, x: &[&[f64]]) -> Result<Vec<f64>> {
        let x = check_queries(x, self.dimension())?;
        // The nearest point of the ranges; NaN where the estimate is to be NaN.
        let within = |j: usize, x: f64| {
            let nearest = x.clamp(self.ranges[j].0, self.ranges[j].1);
            if self.outside == Outside::Nan && nearest != x {
                f64::NAN
            } else {
                nearest
            }
        };
        let known: Vec<usize> = (0..x[0].len())
            .filter(|&i| (0..x.len()).all(|j| !within(j, x[j][i]).is_nan()))
            .collect();
        let columns: Vec<Vec<f64>> = (0..x.len())
            .map(|j| known.iter().map(|&i| within(j, x[j][i])).collect())
            .collect();
        let k = self.neighbours as f64;
        let means = match &self.data {
            Index::Line(line) => line.means(&columns[0], k),
            Index::Tree(tree) => tree.means(&columns, k),
        };
        let mut estimates = vec![f64::NAN; x[0].len()];
        for (i, mean) in known.into_iter().zip(means) {
            estimates[i] = mean;
        }
        Ok(estimates)
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
