//! Whether a column integrates another, as a position integrates a force.
//!
//! The output's difference $d_k = y_k - y_{k-1}$ is regressed on the output, its own past and the input,
//! $$ d_k = \rho\, y_{k-1} + \sum_{i=1}^{4} c_i d_{k-i} + \sum_{i=0}^{4} b_i u_{k-i} + \text{const}, $$
//! over means of samples, so that the noise of an encoder does not hide the motion. An output that settles under a constant input has
//! $\rho < 0$ (Dickey & Fuller 1979), and an output that only drifts has $\sum_i b_i = 0$. An integrating output has neither property: its
//! difference follows the input at any level of the output. It also changes more slowly than the input, since integration divides its
//! spectrum by the frequency. For an oscillation at one frequency, the regression alone decides nothing.
//!
//! A record cannot show whether an output settles after its end: such an output counts as integrating.

use super::dependence::blocks;
use super::limits::{
    AIMED_BLOCKS, DRIVEN, DRIVEN_SHARE, FEWEST_INTEGRATED, INTEGRATED_LAGS, SETTLES, SLOWER, STANDARD_ERRORS,
};
use crate::linear::correlation::{about_mean, variance};
use crate::linear::least_squares::{UnitDiagonal, regression};
use crate::vectors::{combined, dot};

/// The evidence for an output that integrates its input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntegratedOutput {
    /// The share of the unpredicted part of the output's change that the input explains; the prediction is from the output's past.
    pub explained: f64,
    /// The fewest samples that the output would need to settle.
    pub settles_after: f64,
}

/// Whether `output` integrates `input`; `None` if it does not, or if the record does not show it.
///
/// Columns of different lengths, samples that are not finite, and columns that do not vary give `None`.
///
/// ```
/// let force = flexure::signal::white_gaussian(4000, 1.0, 1)?;
/// let (mut speed, mut position) = (0.0, 0.0);
/// let run = |force: &f64| {
///     speed += 0.1 * (force - 0.5 * speed);
///     position += speed;
///     (speed, position)
/// };
/// let (speeds, positions): (Vec<f64>, Vec<f64>) = force.iter().map(run).unzip();
/// assert!(flexure::look::integrated_output(&force, &positions).is_some());
/// assert!(flexure::look::integrated_output(&force, &speeds).is_none());
/// # Ok::<(), flexure::Error>(())
/// ```
pub fn integrated_output(input: &[f64], output: &[f64]) -> Option<IntegratedOutput> {
    if input.len() != output.len() || input.iter().chain(output).any(|v| !v.is_finite()) {
        return None;
    }
    let mut found = None;
    let mut before = 0;
    for aimed in AIMED_BLOCKS {
        let block = (output.len() / aimed).max(1);
        if block == before {
            continue;
        }
        before = block;
        let Some(regression) = Regression::new(&blocks(input, block), &blocks(output, block)) else {
            continue;
        };
        if regression.settles() {
            return None;
        }
        found = found.or(regression.integrates().then(|| IntegratedOutput {
            explained: regression.explained,
            settles_after: block as f64 / regression.fastest().max(f64::MIN_POSITIVE),
        }));
    }
    found
}

/// The regression of the output's difference.
struct Regression {
    blocks: f64,
    /// rho with its standard error.
    pull: [f64; 2],
    /// The sum of the b with its standard error.
    drive: [f64; 2],
    explained: f64,
    /// The output's change from block to block over the input's, each in standard deviations of its column.
    change: f64,
}

impl Regression {
    /// `None` for few blocks, or for columns that do not vary.
    fn new(u: &[f64], y: &[f64]) -> Option<Self> {
        let m = y.len();
        let (u, y) = (scaled(u)?, scaled(y)?);
        if m < FEWEST_INTEGRATED {
            return None;
        }
        let d: Vec<f64> = y.windows(2).map(|w| w[1] - w[0]).collect();
        let p = INTEGRATED_LAGS;
        let changes = |of: &[f64]| of.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>().sqrt();
        // The difference d[k - 1] ends at y[k].
        let rows = p + 1..m;
        let target: Vec<f64> = rows.clone().map(|k| d[k - 1]).collect();
        let lagged = |of: &[f64], lag: usize| -> Vec<f64> { rows.clone().map(|k| of[k - lag]).collect() };
        let mut columns = vec![vec![1.0; target.len()], lagged(&y, 1)];
        columns.extend((1..=p).map(|i| lagged(&d, i + 1)));
        let past = columns.len();
        columns.extend((0..=p).map(|i| lagged(&u, i)));
        let without = LeastSquares::new(&columns[..past], &target)?;
        let with = LeastSquares::new(&columns, &target)?;
        let one = |i: usize| vec![(i, 1.0)];
        let drive: Vec<(usize, f64)> = (past..columns.len()).map(|i| (i, 1.0)).collect();
        Some(Regression {
            blocks: m as f64,
            pull: with.sum(&one(1)),
            drive: with.sum(&drive),
            explained: 1.0 - with.rest / without.rest.max(f64::MIN_POSITIVE),
            change: changes(&y) / changes(&u),
        })
    }

    /// The largest share of the distance to rest that the output covers in a block.
    fn fastest(&self) -> f64 {
        -self.pull[0] + STANDARD_ERRORS * self.pull[1]
    }

    /// Whether the output clearly settles within the record.
    fn settles(&self) -> bool {
        -self.pull[0] - STANDARD_ERRORS * self.pull[1] > 2.0 * SETTLES / self.blocks
    }

    fn integrates(&self) -> bool {
        let grows = self.pull[0] - STANDARD_ERRORS * self.pull[1] > SETTLES / self.blocks;
        self.fastest() < SETTLES / self.blocks
            && !grows
            && self.drive[0].abs() > DRIVEN * self.drive[1]
            && self.explained > DRIVEN_SHARE
            && self.change < SLOWER
    }
}

/// A column about its mean, in standard deviations; `None` if it does not vary.
fn scaled(column: &[f64]) -> Option<Vec<f64>> {
    let deviations = about_mean(column);
    let spread = variance(&deviations).sqrt();
    let largest = column.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    (spread > 1e-9 * largest).then(|| deviations.iter().map(|v| v / spread).collect())
}

/// Least squares, with a ridge that matters only if columns depend on one another.
struct LeastSquares {
    coefficients: Vec<f64>,
    inverse: Vec<f64>,
    /// The sum of the squared errors.
    rest: f64,
    freedom: f64,
}

impl LeastSquares {
    fn new(columns: &[Vec<f64>], target: &[f64]) -> Option<Self> {
        let equations = regression(target, columns, 0);
        // Without noise the past determines the present, and columns depend on one another: the inverse then has a ridge.
        let inverse = UnitDiagonal::new(&equations).inverse()?;
        let q = columns.len();
        let coefficients: Vec<f64> = inverse
            .chunks_exact(q)
            .map(|row| dot(row, &equations.descent))
            .collect();
        let fitted = combined(columns, &coefficients);
        Some(LeastSquares {
            rest: target.iter().zip(&fitted).map(|(y, f)| (y - f).powi(2)).sum(),
            freedom: (target.len() - q) as f64,
            coefficients,
            inverse,
        })
    }

    /// A weighted sum of coefficients, with its standard error.
    fn sum(&self, weights: &[(usize, f64)]) -> [f64; 2] {
        let q = self.coefficients.len();
        let value = weights.iter().map(|(i, w)| w * self.coefficients[*i]).sum();
        let pairs = weights.iter().flat_map(|a| weights.iter().map(move |b| (a, b)));
        let spread: f64 = pairs.map(|((i, v), (j, w))| v * w * self.inverse[i * q + j]).sum();
        [value, (spread.max(0.0) * self.rest / self.freedom).sqrt()]
    }
}
