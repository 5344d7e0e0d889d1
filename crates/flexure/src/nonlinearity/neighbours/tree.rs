//! Neighbours in several dimensions: a k-d tree (Bentley 1975).

use super::super::estimator::Points;
use super::{Mass, Neighbourhood, Scores};
use crate::interrupt;
use crate::parallel;
use crate::sort::order;

/// Points of a leaf.
const LEAF: usize = 12;
/// Queries of one parallel piece: fixed, so that the sums do not depend on the number of threads.
const PIECE: usize = 256;

/// Points in an order in which every subtree is a range, split at its middle.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::nonlinearity) struct Tree {
    /// The standard deviations of the columns (1 for a constant one).
    pub scales: Vec<f64>,
    /// The coordinates, point after point. They are not scaled, so that differences of points on a grid, and ties, stay exact.
    x: Vec<f64>,
    /// The dimension along which the range with this middle is split.
    split: Vec<u8>,
    /// Weights and centred ordinates.
    points: Vec<(f64, f64)>,
    mean: f64,
}

/// A point and its squared distance.
#[derive(Debug, Clone, Copy)]
struct Neighbour {
    distance: f64,
    point: usize,
}

impl Tree {
    pub(super) fn new(data: &Points) -> Tree {
        Self::with_scales(data, data.x.iter().map(|column| deviation(column, &data.w)).collect())
    }

    /// For the Euclidean distance after division of the columns by these positive scales.
    pub fn with_scales(data: &Points, scales: Vec<f64>) -> Tree {
        let d = data.x.len();
        let mut order: Vec<usize> = (0..data.len()).collect();
        let mut split = vec![0; data.len()];
        arrange(&data.x, &scales, &mut order, &mut split);
        let mean = data.mean();
        Tree {
            scales,
            x: order
                .iter()
                .flat_map(|&i| (0..d).map(move |j| (j, i)))
                .map(|(j, i)| data.x[j][i])
                .collect(),
            split,
            points: order.iter().map(|&i| (data.w[i], data.y[i] - mean)).collect(),
            mean,
        }
    }

    fn dimension(&self) -> usize {
        self.scales.len()
    }

    fn at(&self, point: usize) -> &[f64] {
        let d = self.dimension();
        &self.x[point * d..][..d]
    }

    /// The nearest points, nearest first, with a total weight of at least `need` (at most that of all points). All points tied with the
    /// farthest of them are included.
    fn nearest(&self, q: &[f64], need: f64) -> Vec<Neighbour> {
        let mut search = Search {
            tree: self,
            q,
            need,
            found: Vec::new(),
            weight: 0.0,
            farthest: f64::INFINITY,
            full: 0,
        };
        search.visit(0, self.points.len(), 0.0, &mut vec![0.0; q.len()]);
        search.prune();
        search.found
    }

    /// The sums for k neighbours, from a sorted list that holds enough of them.
    fn neighbourhood(&self, found: &[Neighbour], k: f64) -> Neighbourhood {
        let mut sums = Neighbourhood::default();
        for group in found.chunk_by(|a, b| a.distance == b.distance) {
            sums.near = sums.near.plus(sums.tied);
            sums.tied = Mass::default();
            for found in group {
                let (w, y) = self.points[found.point];
                sums.tied = sums.tied.plus(Mass {
                    weight: w,
                    moment: w * y,
                });
            }
            sums.radius = group[0].distance;
            if sums.near.weight + sums.tied.weight >= k {
                break;
            }
        }
        sums
    }

    /// The coordinates of the point nearest to `q`. If several are nearest, the first in order of their coordinates.
    pub fn nearest_place(&self, q: &[f64]) -> &[f64] {
        let found = self.nearest(q, f64::MIN_POSITIVE);
        let tied = found.iter().take_while(|f| f.distance == found[0].distance);
        let places = tied.map(|f| self.at(f.point));
        places
            .min_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal))
            .unwrap_or(&[])
    }

    /// The mean of the ordinates at the other places nearest to the place `q`. The points at `q` have the total weight `w`.
    pub fn mean_of_others(&self, q: &[f64], w: f64) -> f64 {
        // This is more weight than there is at q.
        let found = self.nearest(q, w * (1.0 + 1e-9));
        let mut groups = found.chunk_by(|a, b| a.distance == b.distance);
        let nearest = groups.find(|group| group[0].distance > 0.0).unwrap_or(&[]);
        let (w, wy) = nearest.iter().fold((0.0, 0.0), |(total, sum), found| {
            let (w, y) = self.points[found.point];
            (total + w, sum + w * y)
        });
        self.mean + if w > 0.0 { wy / w } else { 0.0 }
    }

    /// The estimates at the points with the coordinates `columns`, all finite.
    pub fn means(&self, columns: &[Vec<f64>], k: f64) -> Vec<f64> {
        parallel::map(columns[0].len(), |i| {
            let q: Vec<f64> = columns.iter().map(|c| c[i]).collect();
            self.mean + self.neighbourhood(&self.nearest(&q, k), k).mean(k)
        })
    }

    /// The score's sums for all these increasing numbers of neighbours: one search per point.
    pub(super) fn scores(&self, numbers: &[usize]) -> Vec<Scores> {
        let Some(&most) = numbers.last() else {
            return Vec::new();
        };
        let n = self.points.len();
        let interrupt = interrupt::current();
        let pieces: Vec<Vec<Scores>> = parallel::map(n.div_ceil(PIECE), |piece| {
            let mut scores = vec![Scores::default(); numbers.len()];
            if interrupt.is_requested() {
                return scores;
            }
            for i in piece * PIECE..n.min((piece + 1) * PIECE) {
                let (w, y) = self.points[i];
                let found = self.nearest(self.at(i), most as f64 + w);
                for (scores, &k) in scores.iter_mut().zip(numbers) {
                    let k = k as f64;
                    let (with, more) = (self.neighbourhood(&found, k), self.neighbourhood(&found, k + w));
                    scores.add(k, w, y, with, more);
                }
            }
            scores
        });
        let mut total = vec![Scores::default(); numbers.len()];
        for piece in pieces {
            for (t, p) in total.iter_mut().zip(piece) {
                t.trace += p.trace;
                t.left_out += p.left_out;
                t.residual += p.residual;
            }
        }
        total
    }
}

/// The standard deviation of a column; 1 for a constant one.
fn deviation(column: &[f64], w: &[f64]) -> f64 {
    if column.iter().all(|x| *x == column[0]) {
        return 1.0;
    }
    // The values are added in order of size, so that columns of the same values have the same deviation to the last digit.
    let order = order(&[column, w]);
    let sorted: Vec<(f64, f64)> = order.into_iter().map(|i| (column[i], w[i])).collect();
    let total: f64 = sorted.iter().map(|p| p.1).sum();
    let mean: f64 = sorted.iter().map(|(x, w)| w / total * x).sum();
    let square: f64 = sorted.iter().map(|(x, w)| w / total * (x - mean).powi(2)).sum();
    let deviation = square.sqrt();
    if deviation > 0.0 && deviation.is_finite() {
        deviation
    } else {
        1.0
    }
}

/// Orders the points of a subtree around its middle along the column of the widest extent.
fn arrange(columns: &[Vec<f64>], scales: &[f64], order: &mut [usize], split: &mut [u8]) {
    if order.len() <= LEAF {
        return;
    }
    let extent = |j: usize| {
        let along = order.iter().map(|&i| columns[j][i]);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        (high - low) / scales[j]
    };
    let widest = (0..columns.len())
        .max_by(|&a, &b| extent(a).total_cmp(&extent(b)))
        .unwrap_or(0);
    let middle = order.len() / 2;
    let column = &columns[widest];
    order.select_nth_unstable_by(middle, |&i, &j| column[i].total_cmp(&column[j]).then(i.cmp(&j)));
    split[middle] = widest as u8;
    let (left, right) = order.split_at_mut(middle);
    let (split_left, split_right) = split.split_at_mut(middle);
    rayon::join(
        || arrange(columns, scales, left, split_left),
        || arrange(columns, scales, &mut right[1..], &mut split_right[1..]),
    );
}

struct Search<'a> {
    tree: &'a Tree,
    q: &'a [f64],
    need: f64,
    /// Candidates. After pruning they are sorted, and none is too far.
    found: Vec<Neighbour>,
    /// Their weight.
    weight: f64,
    /// Points farther than this are left out. It is infinite until enough points are found.
    farthest: f64,
    /// The number of candidates from which on pruning pays.
    full: usize,
}

impl Search<'_> {
    /// Searches the range of points from `from` to `to`, whose box is at the squared distance `away`, with the
    /// distances along every dimension in `offsets`.
    fn visit(&mut self, from: usize, to: usize, away: f64, offsets: &mut Vec<f64>) {
        // There is a margin because the distance to a box is rounded in another order than the distance to a point.
        if away * (1.0 - 1e-12) > self.farthest {
            return;
        }
        if to - from <= LEAF {
            (from..to).for_each(|point| self.add(point));
            return;
        }
        let middle = from + (to - from) / 2;
        let dimension = usize::from(self.tree.split[middle]);
        let side = (self.q[dimension] - self.tree.at(middle)[dimension]) / self.tree.scales[dimension];
        let (near, far) = if side < 0.0 {
            ((from, middle), (middle + 1, to))
        } else {
            ((middle + 1, to), (from, middle))
        };
        self.visit(near.0, near.1, away, offsets);
        self.add(middle);
        let before = offsets[dimension];
        offsets[dimension] = side;
        let away = offsets.iter().map(|o| o * o).sum();
        self.visit(far.0, far.1, away, offsets);
        offsets[dimension] = before;
    }

    fn add(&mut self, point: usize) {
        let along = self.tree.at(point).iter().zip(self.q).zip(&self.tree.scales);
        let distance: f64 = along.map(|((x, q), s)| ((x - q) / s).powi(2)).sum();
        if distance > self.farthest {
            return;
        }
        self.found.push(Neighbour { distance, point });
        self.weight += self.tree.points[point].0;
        if self.weight >= self.need && self.found.len() >= self.full {
            self.prune();
            // So the cost of pruning is shared by as many new candidates.
            self.full = 2 * self.found.len() + LEAF;
        }
    }

    /// Sorts the candidates and drops those beyond the one at which the weight is reached.
    fn prune(&mut self) {
        self.found
            .sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance).then(a.point.cmp(&b.point)));
        let mut weight = 0.0;
        for i in 0..self.found.len() {
            weight += self.tree.points[self.found[i].point].0;
            let last = self
                .found
                .get(i + 1)
                .is_none_or(|next| next.distance > self.found[i].distance);
            if last && weight >= self.need {
                self.farthest = self.found[i].distance;
                self.found.truncate(i + 1);
                break;
            }
        }
        self.weight = self.found.iter().map(|f| self.tree.points[f.point].0).sum();
    }
}
