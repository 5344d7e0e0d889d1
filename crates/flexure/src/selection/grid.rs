//! The bandwidth with the lowest score: a logarithmic grid, then a finer one around its best.

use rayon::prelude::*;

use super::{BandwidthSearch, Score};

/// Bandwidths of the logarithmic grid.
const COARSE: usize = 20;
/// Bandwidths tried between the best of the grid and each of its neighbours.
const FINE: usize = 3;
/// The smallest bandwidth tried, as a share of the data's extent, whatever the number of points.
const SMALLEST: f64 = 1e-4;
/// Relative difference of two scores that counts as none.
const FLAT: f64 = 1e-9;

/// The bandwidths worth trying, by the logarithm of their ratio to the smallest: the unit of x changes nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    smallest: f64,
    step: f64,
}

impl Grid {
    /// For the abscissas `sorted`, of which there is at least one.
    ///
    /// The extent is that of the bulk of the data, so that a few far outliers do not coarsen the grid.
    pub fn new(sorted: &[f64]) -> Self {
        let extent = bulk(sorted);
        let smallest = extent * (3.0 / sorted.len() as f64).clamp(SMALLEST, 0.2);
        let largest = extent.max(2.0 * smallest);
        Grid {
            smallest,
            step: (largest / smallest).ln() / (COARSE - 1) as f64,
        }
    }

    fn at(&self, position: f64) -> f64 {
        self.smallest * (self.step * position).exp()
    }

    /// The nearest bandwidth that could be tried.
    pub fn clamp(&self, bandwidth: f64) -> f64 {
        // NaN becomes the largest.
        bandwidth.min(self.at((COARSE - 1) as f64)).max(self.smallest)
    }

    /// The whole search, all bandwidths of a round in parallel; of equal scores the smoothest wins.
    pub fn search(&self, score: impl Fn(f64) -> f64 + Sync) -> BandwidthSearch {
        let tried = |positions: Vec<f64>| -> Vec<Score> {
            positions
                .into_par_iter()
                .map(|position| self.at(position))
                .map(|bandwidth| Score {
                    bandwidth,
                    error: score(bandwidth),
                })
                .collect()
        };
        let mut curve = tried((0..COARSE).map(|i| i as f64).collect());
        let best = lowest(&curve);
        let inside = 0 < best && best < COARSE - 1;
        let next = &curve[best.clamp(1, COARSE - 2)];
        // A score that does not depend on the bandwidth (an input of a few levels) has no edge.
        let at_edge = !inside && next.error - curve[best].error > FLAT * next.error;
        if inside {
            let part = |k: usize| (k as f64 - FINE as f64 - 1.0) / (FINE + 1) as f64;
            let between = (1..2 * FINE + 2).filter(|&k| k != FINE + 1);
            curve.extend(tried(between.map(|k| best as f64 + part(k)).collect()));
            curve.sort_by(|a, b| a.bandwidth.total_cmp(&b.bandwidth));
        }
        BandwidthSearch {
            bandwidth: curve[lowest(&curve)].bandwidth,
            curve,
            at_edge,
            binning: None,
        }
    }
}

/// Twice the length that holds the middle four fifths of the data, but not more than all; 1 for a constant.
pub(crate) fn bulk(sorted: &[f64]) -> f64 {
    let last = sorted.len() - 1;
    let tenth = sorted.len() / 10;
    let range = sorted[last] - sorted[0];
    let middle = 2.0 * (sorted[last - tenth] - sorted[tenth]);
    let extent = if middle > 0.0 { middle.min(range) } else { range };
    if extent > 0.0 { extent } else { 1.0 }
}

/// The index of the lowest score; of equal ones the last, the smoothest.
fn lowest(curve: &[Score]) -> usize {
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
    fn the_minimum_is_found_to_a_fraction_of_a_step() {
        let grid = Grid::new(&evenly(1000));
        let search = grid.search(|h| (h / 0.05).ln().powi(2));
        assert!((search.bandwidth / 0.05).ln().abs() <= 0.5 * grid.step / (FINE + 1) as f64 * 1.0001);
        assert_eq!(search.curve.len(), COARSE + 2 * FINE);
        assert!(search.curve.windows(2).all(|w| w[0].bandwidth < w[1].bandwidth) && !search.at_edge);
    }

    #[test]
    fn edges_are_told_and_ties_go_to_the_smoothest() {
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
    }
}
