//! The splines in which the unknown curves are written.

use super::column_noise::Slopes;
use super::fourier::Modulation;
use super::limits::{
    FRICTION_DENSER, GRID_DENSER, POINTS_IN_INTERVAL, SHARE_IN_INTERVAL, SPLINE_SLOPE_STEP, STIFFNESS_DENSER,
};
use super::passages::Passage;
use crate::nonlinearity::spline::basis::{CubicSplines, LocalValues};

/// Simpson's weights of a sample and of the middles between it and its neighbours.
const MIDDLE: f64 = 4.0 / 6.0;
const SIDE: f64 = 1.0 / 6.0;

/// The mean of f(x) over the time of each sample, from half way before it to half way after it.
///
/// Friction changes within few samples while the velocity changes sign; sums of its values at the samples would be poor
/// integrals.
///
/// Within the samples of `passages`, the velocity is known in detail.
pub(super) fn mean_of(x: &[f64], passages: &[Passage], f: impl Fn(f64) -> f64) -> Vec<f64> {
    let between: Vec<f64> = x.windows(2).map(|w| f(0.5 * (w[0] + w[1]))).collect();
    let at_samples: Vec<f64> = x.iter().map(|&x| f(x)).collect();
    let side = |i: Option<usize>, own: f64| i.and_then(|i| between.get(i)).copied().unwrap_or(own);
    let mut means: Vec<f64> = at_samples
        .iter()
        .enumerate()
        .map(|(i, &y)| MIDDLE * y + SIDE * (side(i.checked_sub(1), y) + side(Some(i), y)))
        .collect();
    for passage in passages {
        means[passage.sample] = passage.mean_of(&f);
    }
    means
}

/// The sign of x, which is 0 at 0.
pub(super) fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// The smallest and the largest value.
pub(super) fn range(x: &[f64]) -> [f64; 2] {
    let both = |[low, high]: [f64; 2], x: &f64| [low.min(*x), high.max(*x)];
    x.iter().fold([f64::INFINITY, f64::NEG_INFINITY], both)
}

/// Points over a range, denser near zero: at $u \sinh t$ for uniform t.
pub(super) struct Spacing {
    unit: f64,
    from: f64,
    to: f64,
}

impl Spacing {
    /// Points that are about `denser` times as dense at zero as at the farther end.
    pub fn new([low, high]: [f64; 2], denser: f64) -> Self {
        let unit = low.abs().max(high.abs()) / denser;
        Spacing {
            unit,
            from: (low / unit).asinh(),
            to: (high / unit).asinh(),
        }
    }

    /// The end of the i-th of `count` intervals.
    pub fn point(&self, i: usize, count: usize) -> f64 {
        self.unit * (self.from + (self.to - self.from) * i as f64 / count as f64).sinh()
    }
}

/// Cubic splines over the range of some points, with breakpoints that are denser near zero.
///
/// Friction changes fastest where the velocity changes sign, and a soft wind-up acts at small deflections.
#[derive(Debug, Clone)]
pub(super) struct Basis {
    splines: CubicSplines,
    low: f64,
    high: f64,
    /// Whether the sign of the abscissa comes after the splines.
    jumps: bool,
}

impl Basis {
    /// For friction over the velocities x: `pieces` intervals on either side of zero, fewer if there are not enough points. The points of
    /// `x` must not be all equal.
    pub fn friction(x: &[f64], pieces: usize) -> Basis {
        Basis::new(x, pieces, FRICTION_DENSER)
    }

    /// The same and the sign of x, for a friction that jumps at zero. The jump is what changes fast there, so the breakpoints are less dense.
    pub fn dry_friction(x: &[f64], pieces: usize) -> Basis {
        Basis {
            jumps: true,
            ..Basis::new(x, pieces, STIFFNESS_DENSER)
        }
    }

    /// For stiffness over the deflections x, likewise.
    pub fn stiffness(x: &[f64], pieces: usize) -> Basis {
        Basis::new(x, pieces, STIFFNESS_DENSER)
    }

    fn new(x: &[f64], pieces: usize, denser: f64) -> Basis {
        let mut sorted = x.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
        let spacing = Spacing::new([low, high], denser);
        let count = 2 * pieces;
        let fewest = POINTS_IN_INTERVAL.max((x.len() as f64 * SHARE_IN_INTERVAL) as usize);
        let below = |b: f64| sorted.partition_point(|v| *v < b);
        let mut inner: Vec<f64> = Vec::new();
        let mut before = 0;
        for i in 1..count {
            let breakpoint = spacing.point(i, count);
            let rank = below(breakpoint);
            if rank >= before + fewest && sorted.len() - rank >= fewest {
                inner.push(breakpoint);
                before = rank;
            }
        }
        let breakpoints: Vec<f64> = std::iter::once(0.0)
            .chain(inner.iter().map(|b| (b - low) / (high - low)))
            .chain([1.0])
            .collect();
        Basis {
            splines: CubicSplines::new(&breakpoints),
            low,
            high,
            jumps: false,
        }
    }

    /// The number of splines, with the sign if there is one.
    pub fn len(&self) -> usize {
        self.splines.len() + usize::from(self.jumps)
    }

    /// The four splines that do not vanish at x; beyond the range, those at the nearest end.
    fn at(&self, x: f64) -> LocalValues<4> {
        self.splines
            .at(((x - self.low) / (self.high - self.low)).clamp(0.0, 1.0))
    }

    /// The values of every spline at the points x, times x.
    pub fn columns_times_x(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let mut columns = vec![vec![0.0; x.len()]; self.len()];
        for (i, &x) in x.iter().enumerate() {
            let LocalValues { first, values } = self.at(x);
            for (k, v) in values.iter().enumerate() {
                columns[first + k][i] = x * v;
            }
        }
        columns
    }

    /// The means of every spline over the time of a sample; see [`mean_of`].
    pub fn mean_columns(&self, x: &[f64], passages: &[Passage]) -> Vec<Vec<f64>> {
        let mut columns = vec![vec![0.0; x.len()]; self.splines.len()];
        let mut add = |at: usize, x: f64, weight: f64| {
            let LocalValues { first, values } = self.at(x);
            for (k, v) in values.iter().enumerate() {
                columns[first + k][at] += weight * v;
            }
        };
        let mut within = passages.iter().peekable();
        for i in 0..x.len() {
            if let Some(passage) = within.next_if(|passage| passage.sample == i) {
                passage.moving.iter().for_each(|&[v, share]| add(i, v, share));
                continue;
            }
            add(i, x[i], MIDDLE);
            for neighbour in [i.saturating_sub(1), (i + 1).min(x.len() - 1)] {
                add(i, 0.5 * (x[i] + x[neighbour]), SIDE);
            }
        }
        columns.extend(self.jumps.then(|| mean_of(x, passages, sign)));
        columns
    }

    /// The slopes of every spline times the abscissa, at the points x.
    pub fn slopes(&self, modulation: &Modulation, x: &[f64]) -> Slopes {
        let h = SPLINE_SLOPE_STEP * (self.high - self.low);
        Slopes::new(modulation, self.len(), |i| {
            let ends = [-h, h].map(|step| (step, self.at(x[i] + step)));
            let first = ends[0].1.first.min(ends[1].1.first);
            let mut slopes = [0.0; 5];
            for (step, local) in ends {
                // Neighbouring points are at most one breakpoint apart.
                for (slope, v) in slopes.iter_mut().skip(local.first - first).zip(local.values) {
                    *slope += step.signum() * v * (x[i] + step) / (2.0 * h);
                }
            }
            LocalValues { first, values: slopes }
        })
    }

    /// The spline with these coefficients at x.
    pub fn value(&self, coefficients: &[f64], x: f64) -> f64 {
        let jump = self.jump().map_or(0.0, |k| coefficients[k] * sign(x));
        self.at(x).combined(coefficients) + jump
    }

    /// The number of the sign among the coefficients.
    fn jump(&self) -> Option<usize> {
        self.jumps.then(|| self.splines.len())
    }

    /// The variance of [`Basis::value`], from the coefficients' covariance: `covariance(i, j)`.
    pub fn variance(&self, covariance: impl Fn(usize, usize) -> f64, x: f64) -> f64 {
        let LocalValues { first, values } = self.at(x);
        let jump = self.jump().map(|k| (k, sign(x)));
        let splines = values.iter().enumerate().map(|(k, v)| (first + k, *v));
        let terms: Vec<(usize, f64)> = splines.chain(jump).collect();
        let mut total = 0.0;
        for &(i, a) in &terms {
            for &(j, b) in &terms {
                total += a * b * covariance(i, j);
            }
        }
        total.max(0.0)
    }

    /// `points` abscissas over the range, closer to each other near zero; zero is one of them if it is in the range.
    pub fn grid(&self, points: usize) -> Vec<f64> {
        let spacing = Spacing::new([self.low, self.high], GRID_DENSER);
        let mut grid: Vec<f64> = (0..points)
            .map(|i| spacing.point(i, points - 1).clamp(self.low, self.high))
            .collect();
        if self.low < 0.0 && self.high > 0.0 {
            let zero = grid.iter().enumerate().min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            if let Some((at, _)) = zero {
                grid[at] = 0.0;
            }
        }
        grid.dedup();
        grid
    }
}
