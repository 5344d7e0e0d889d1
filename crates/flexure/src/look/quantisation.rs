//! The grid on which a column's values lie: the steps of a converter or of an encoder, or the last digit that was printed.

use super::limits::{FEWEST_ON_GRID, MOST_STEPS, ON_GRID, QUANTISED};

/// Evenly spaced values on which a column lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantisation {
    /// The distance between the values.
    pub step: f64,
    /// The share of the samples that lie on them, within a tenth of a step.
    pub share: f64,
    /// How many steps the column's range has.
    pub steps: f64,
}

impl Quantisation {
    /// The grid of samples in increasing order: the widest candidate on which nearly all of them lie.
    pub(super) fn of_sorted(sorted: &[f64]) -> Option<Self> {
        let range = sorted.last()? - sorted.first()?;
        let least = range / MOST_STEPS;
        // Values that differ by less are the same except for rounding.
        let mut values: Vec<Repeated> = Vec::new();
        for &v in sorted {
            match values.last_mut() {
                Some(last) if v - last.value < 0.5 * least => last.count += 1,
                _ => values.push(Repeated { value: v, count: 1 }),
            }
        }
        if values.len() < FEWEST_ON_GRID {
            return None;
        }
        let mut distances: Vec<(f64, usize)> = values.windows(2).map(|w| w[1].value - w[0].value).zip(0..).collect();
        distances.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        // Larger distances come first, since they give wider grids. With few values, most distances are steps.
        let places = [0.5, 0.2, 0.05, 0.01, 0.0].map(|q| (q * (distances.len() - 1) as f64) as usize);
        let grids = places.map(|place| {
            let (distance, start) = distances[place];
            grid(&values, start, distance)
        });
        let found = grids.into_iter().find(|grid| grid.share >= QUANTISED);
        found.map(|grid| Quantisation {
            step: grid.step,
            share: grid.share,
            steps: (range / grid.step).round(),
        })
    }
}

/// A value, and how many samples have it.
struct Repeated {
    value: f64,
    count: usize,
}

/// A grid, and the share of the samples that lie on it.
struct Grid {
    step: f64,
    share: f64,
}

/// The grid that has the value at `start` and the next one, about `step` away, with the share of the samples that lie on it. The step is
/// refined on the way from there to both ends.
fn grid(values: &[Repeated], start: usize, mut step: f64) -> Grid {
    let origin = values[start].value;
    let total: usize = values.iter().map(|v| v.count).sum();
    let mut on = values[start].count;
    let upwards = values[start + 1..].iter();
    let downwards = values[..start].iter().rev();
    let mut farthest = 0.0;
    for Repeated { value, count } in upwards.chain(downwards) {
        let multiple = ((value - origin) / step).round();
        let off = (value - origin) / step - multiple;
        if off.abs() > ON_GRID {
            continue;
        }
        on += count;
        if multiple.abs() > farthest {
            farthest = multiple.abs();
            step = (value - origin) / multiple;
        }
    }
    Grid {
        step,
        share: on as f64 / total as f64,
    }
}
