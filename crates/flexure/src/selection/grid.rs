//! The bandwidth with the lowest score. The search begins with a logarithmic grid, as the score may have several minima. Smaller steps
//! around the best and the lowest point of a parabola follow.

use super::search::FLAT;
use super::{BandwidthSearch, Score};
use crate::interrupt;
use crate::parallel;
use crate::sort;

/// Bandwidths of the logarithmic grid.
const COARSE: usize = 20;
/// The number of smaller steps into which a step of the grid on either side of the best is divided.
const STEPS: usize = 3;
/// The smallest bandwidth tried, as a share of the data's extent, for any number of points.
const SMALLEST: f64 = 1e-4;
/// The shortest length of the bulk of the data, as a share of all.
const SHORTEST: f64 = 1e-100;
/// The bandwidths worth trying, by the logarithm of their ratio to the smallest. So the unit of x does not matter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Grid {
    /// The smallest bandwidth.
    pub smallest: f64,
    /// The largest bandwidth.
    pub largest: f64,
}

/// Bandwidths that were tried, increasing, and whether the best is at the edge.
pub(crate) struct BandwidthScores {
    pub scores: Vec<Score>,
    pub at_edge: bool,
}

impl Grid {
    /// The grid for the abscissas `sorted`. There must be at least one.
    ///
    /// The extent is that of the bulk of the data, so that a few far outliers do not coarsen the grid.
    pub fn new(sorted: &[f64]) -> Self {
        let extent = bulk(sorted);
        let smallest = extent * (3.0 / sorted.len() as f64).clamp(SMALLEST, 0.2);
        Grid {
            smallest,
            largest: extent.max(2.0 * smallest),
        }
    }

    /// The nearest bandwidth that could be tried.
    pub fn clamp(&self, bandwidth: f64) -> f64 {
        // NaN becomes the largest.
        bandwidth.min(self.largest).max(self.smallest)
    }

    /// The whole search. All bandwidths of a round are scored in parallel. If scores are equal, the smoothest estimate is chosen.
    pub fn search(&self, score: impl Fn(f64) -> f64 + Sync) -> BandwidthSearch {
        let interrupt = interrupt::current();
        let score = |h: &f64| match interrupt.is_requested() {
            true => f64::INFINITY,
            false => score(*h),
        };
        self.search_by(|bandwidths| parallel::batch(bandwidths, score))
    }

    /// [`search`](Self::search), with the scores of many bandwidths at a time.
    pub fn search_by(&self, scores: impl Fn(&[f64]) -> Vec<f64>) -> BandwidthSearch {
        let BandwidthScores { scores: curve, at_edge } = self.curve(COARSE, scores);
        BandwidthSearch {
            bandwidth: curve[lowest(&curve)].bandwidth,
            curve,
            at_edge,
            binning: None,
        }
    }

    /// All candidates of a search that begins with `count` bandwidths.
    pub fn curve(&self, count: usize, scores: impl Fn(&[f64]) -> Vec<f64>) -> BandwidthScores {
        let step = (self.largest / self.smallest).ln() / (count - 1) as f64;
        let scores = |positions: &[f64]| {
            let bandwidths: Vec<f64> = positions.iter().map(|t| self.smallest * (step * t).exp()).collect();
            let errors = match interrupt::requested() {
                true => vec![f64::INFINITY; bandwidths.len()],
                false => scores(&bandwidths),
            };
            scored(&bandwidths, errors)
        };
        let places: Vec<f64> = (0..count).map(|i| i as f64).collect();
        let mut curve = scores(&places);
        let best = lowest(&curve);
        let inside = 0 < best && best < count - 1;
        let next = &curve[best.clamp(1, count - 2)];
        // If the score does not depend on the bandwidth (an input of a few levels), there is no minimum at the edge.
        let at_edge = !inside && next.error - curve[best].error > FLAT * next.error;
        if inside {
            let part = 1.0 / STEPS as f64;
            let near: Vec<f64> = (1..2 * STEPS)
                .filter(|&k| k != STEPS)
                .map(|k| best as f64 - 1.0 + part * k as f64)
                .collect();
            insert(&mut curve, scores(&near));
            // The neighbours of the best are now one step away from it.
            let best = lowest(&curve);
            let [below, here, above] = [best - 1, best, best + 1].map(|i| curve[i].error);
            let bend = below - 2.0 * here + above;
            let shift = 0.5 * (below - above) / bend;
            // If the best is next to a neighbour on the grid, the steps on its two sides differ, and the best is near enough.
            if shift.abs() <= 1.0 && shift != 0.0 {
                let place = (curve[best].bandwidth / self.smallest).ln() / step;
                insert(&mut curve, scores(&[place + part * shift]));
            }
        }
        BandwidthScores { scores: curve, at_edge }
    }
}

/// Bandwidths and their scores.
pub(super) fn scored(bandwidths: &[f64], errors: Vec<f64>) -> Vec<Score> {
    let score = |(&bandwidth, error)| Score { bandwidth, error };
    bandwidths.iter().zip(errors).map(score).collect()
}

fn insert(curve: &mut Vec<Score>, scores: Vec<Score>) {
    curve.extend(scores);
    sort::by_key(curve, |c| c.bandwidth);
}

/// Twice the length of the middle four fifths of the data, but not more than the whole range; 1 for a constant. It is never so short in
/// comparison with the range that the reciprocals of bandwidths overflow.
pub(crate) fn bulk(sorted: &[f64]) -> f64 {
    let last = sorted.len() - 1;
    let tenth = sorted.len() / 10;
    let range = sorted[last] - sorted[0];
    let middle = 2.0 * (sorted[last - tenth] - sorted[tenth]);
    let extent = if middle > 0.0 {
        middle.min(range).max(SHORTEST * range)
    } else {
        range
    };
    if extent > 0.0 { extent } else { 1.0 }
}

/// The index of the lowest score. If scores are equal, it is the last one, the smoothest estimate.
pub(super) fn lowest(curve: &[Score]) -> usize {
    (0..curve.len())
        .rev()
        .min_by(|&i, &j| curve[i].error.total_cmp(&curve[j].error))
        .unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evenly(n: usize) -> Vec<f64> {
        (0..n).map(|i| i as f64 / (n - 1) as f64).collect()
    }

    #[test]
    fn the_minimum_of_a_parabola_is_found_exactly() {
        let grid = Grid::new(&evenly(1000));
        let search = grid.search(|h| (h / 0.05).ln().powi(2));
        assert!((search.bandwidth / 0.05 - 1.0).abs() < 1e-9, "{}", search.bandwidth);
        assert_eq!(search.curve.len(), COARSE + 2 * (STEPS - 1) + 1);
        assert!(search.curve.windows(2).all(|w| w[0].bandwidth < w[1].bandwidth) && !search.at_edge);
    }

    #[test]
    fn other_minima_are_found_to_a_part_of_a_step() {
        let grid = Grid::new(&evenly(1000));
        let step = (grid.largest / grid.smallest).ln() / (COARSE - 1) as f64;
        // Far from a parabola, with a second minimum.
        for target in [0.011_f64, 0.047, 0.2] {
            let score = |h: f64| (h / target).ln().abs().sqrt().min(0.7 + (h / 0.9).ln().abs());
            let search = grid.search(score);
            let off = (search.bandwidth / target).ln().abs();
            assert!(off <= 0.5 * step / STEPS as f64 * 1.0001, "{target}: {off}");
        }
    }

    #[test]
    fn edges_are_reported_and_ties_go_to_the_smoothest() {
        let grid = Grid::new(&evenly(50));
        assert!(grid.search(|h| h).at_edge && grid.search(|h| -h).at_edge);
        let flat = grid.search(|_| 1.0);
        assert!(!flat.at_edge && flat.bandwidth == flat.curve.last().unwrap().bandwidth);
        assert_eq!(grid.clamp(f64::NAN), flat.bandwidth);
        assert_eq!(grid.clamp(0.0), grid.smallest);
    }

    #[test]
    fn outliers_do_not_coarsen_the_grid() {
        let mut x = evenly(100);
        x[99] = 1e6;
        assert!(bulk(&x) < 2.0);
        assert_eq!(bulk(&[3.0; 5]), 1.0);
        // Ten points at the smallest numbers that exist, and one far away.
        let mut tiny: Vec<f64> = (0..10).map(|i| f64::from(i) * 5e-324).collect();
        tiny.push(1.0);
        assert_eq!(bulk(&tiny), 1e-100);
    }
}
