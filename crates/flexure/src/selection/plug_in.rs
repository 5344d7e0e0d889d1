//! The direct plug-in bandwidth of Ruppert, Sheather and Wand (1995), $\hat h_{DPI}$, for the local line.
//!
//! $$ h = \Bigl(\frac{R(K)}{\mu_2(K)^2} \frac{\sigma^2 (b - a)}{\theta_{22}\, n}\Bigr)^{1/5} $$
//! minimises the asymptotic error, where theta_22 is the mean of m''^2. Each of the two unknowns has its own kernel estimate. Its bandwidth
//! comes from a quartic fitted in blocks, and the number of blocks from Mallows' Cp. The settings, the binning and the order of operations
//! are those of `dpill` in the R package KernSmooth (Wand and Jones 1995), so its values are reproduced.

use super::BandwidthSearch;
use super::grid::Grid;
use crate::error::{Error, Result};
use crate::nonlinearity::kernel::{Kernel, Sorted};
use crate::parallel;
use crate::text::counted;

/// The share of the data that is left out at either end.
const TRIM: f64 = 0.01;
/// Points of the binning grid.
const BINS: usize = 401;
/// The most blocks, and the fewest points of a block.
const MOST_BLOCKS: usize = 5;
const BLOCK: usize = 20;
/// The share of the grid at either end where the second derivative does not count.
const ENDS: f64 = 0.05;
/// Bandwidths beyond which the Gaussian is cut off.
const TAU: f64 = 4.0;
/// The fewest points, and the fewest distinct abscissas.
const FEWEST: usize = 10;
const DISTINCT: usize = 5;

/// The chosen bandwidth and the quantities that determine it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlugIn {
    /// The bandwidth of the Gaussian kernel.
    gaussian: f64,
    /// The variance of the noise (at weight one), in the squared unit of y.
    noise: f64,
    /// The mean square of the second derivative.
    curvature: f64,
    blocks: usize,
    /// Whether the formula's value lay outside the range that the data allow.
    pub at_edge: bool,
}

impl PlugIn {
    pub fn from_data(data: &Sorted) -> Result<Self> {
        Ok(WithBend::new(data)?.plug_in)
    }

    /// The bandwidth of `kernel` that smooths equally (Marron and Nolan 1988), as a search without scores.
    pub fn search(&self, kernel: Kernel) -> BandwidthSearch {
        BandwidthSearch {
            bandwidth: self.gaussian * canonical(kernel) / canonical(Kernel::Gaussian),
            curve: Vec::new(),
            at_edge: self.at_edge,
            binning: None,
        }
    }

    pub fn description(&self) -> String {
        format!(
            "direct plug-in for the local line: noise variance {:.3e}, mean squared second derivative {:.3e}, pilot of {}",
            self.noise,
            self.curvature,
            counted(self.blocks, "block"),
        )
    }
}

/// The bandwidth, and m'' along x.
pub(crate) struct WithBend {
    pub plug_in: PlugIn,
    pub bend: Bend,
}

impl WithBend {
    pub fn new(data: &Sorted) -> Result<Self> {
        let distinct = 1 + data.x.windows(2).filter(|w| w[0] < w[1]).take(DISTINCT).count();
        for (what, need, got) in [
            ("the plug-in bandwidth", FEWEST, data.len()),
            (
                "the plug-in bandwidth (counting distinct abscissas)",
                DISTINCT,
                distinct,
            ),
        ] {
            if got < need {
                return Err(Error::too_short(what, need, got));
            }
        }
        let trim = (TRIM * data.len() as f64).floor() as usize;
        let points = Points::new(data, trim);
        let (low, high) = points.ends();
        if !(high > low) {
            return Err(Error::too_short(
                "the plug-in bandwidth (counting distinct abscissas without the outer hundredth of the samples)",
                DISTINCT,
                1,
            ));
        }
        let quartic = blocked_quartic(&points);
        let bins = Bins::new(&points);
        let (range, n) = (high - low, points.weight);
        let cubic = bins.allowed({
            let ratio = quartic.noise * range / (quartic.theta24.abs() * n);
            let factor = if quartic.theta24 < 0.0 { 3.0 / 8.0 } else { 15.0 / 16.0 };
            (factor * ratio / PI_ROOT).powf(1.0 / 7.0)
        });
        let curvature = bins.curvature(cubic);
        let constant = 0.5 + 2.0 * 2.0_f64.sqrt() - 4.0 / 3.0 * 3.0_f64.sqrt();
        let constant = 4.0 * constant / (2.0 * std::f64::consts::PI).sqrt();
        let line = (constant * quartic.noise * quartic.noise * range / (curvature * n).powi(2)).powf(1.0 / 9.0);
        let noise = bins.noise(bins.allowed(line), &points);
        let wanted = (noise * range / (2.0 * PI_ROOT * curvature * n)).powf(0.2);
        // The limit is as wide as the widest window of the default kernel.
        let scale = canonical(Kernel::Gaussian) / canonical(Kernel::Epanechnikov);
        let gaussian = scale * Grid::new(&data.x).clamp(wanted / scale);
        let plug_in = PlugIn {
            gaussian,
            noise,
            curvature,
            blocks: quartic.blocks,
            at_edge: !((wanted / gaussian).ln().abs() < 1e-9),
        };
        let bend = Bend {
            low,
            step: bins.step,
            second: bins.second_derivatives(cubic),
            window: cubic,
        };
        Ok(WithBend { plug_in, bend })
    }
}

/// The second derivative of m along x, on an even grid.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bend {
    low: f64,
    step: f64,
    second: Vec<f64>,
    /// The standard deviation of the windows over which it was estimated, in the unit of x.
    pub window: f64,
}

impl Bend {
    /// m'' squared at `x`. Beyond the grid it is the value at its end.
    pub fn square(&self, x: f64) -> f64 {
        let last = self.second.len() - 1;
        // NaN becomes the first.
        let place = ((x - self.low) / self.step).max(0.0).min(last as f64);
        let left = (place.floor() as usize).min(last.saturating_sub(1));
        let share = place - left as f64;
        let [a, b] = [left, (left + 1).min(last)].map(|i| self.second[i].powi(2));
        a + share * (b - a)
    }
}

/// The square root of pi.
const PI_ROOT: f64 = 1.772_453_850_905_516;

/// The canonical bandwidth $(R(K) / \mu_2(K)^2)^{1/5}$ (Marron and Nolan 1988): kernels smooth equally if their bandwidths are in
/// proportion to it.
pub(crate) fn canonical(kernel: Kernel) -> f64 {
    let ratio: f64 = match kernel {
        Kernel::Uniform => 9.0 / 2.0,
        Kernel::Triangular => 24.0,
        Kernel::Epanechnikov => 15.0,
        Kernel::Biweight => 35.0,
        Kernel::Triweight => 81.0 * 350.0 / 429.0,
        Kernel::Gaussian => 0.5 / PI_ROOT,
    };
    ratio.powf(0.2)
}

/// The sorted points without the outer ones, with weights of mean one.
struct Points<'a> {
    x: &'a [f64],
    y: &'a [f64],
    w: Vec<f64>,
    /// The sum of the weights: the number of points where there are no weights.
    weight: f64,
}

impl<'a> Points<'a> {
    fn new(data: &'a Sorted, trim: usize) -> Self {
        let kept = trim..data.len() - trim;
        let total: f64 = (0..data.len()).map(|i| data.weight(i)).sum();
        let mean = total / data.len() as f64;
        let w: Vec<f64> = kept.clone().map(|i| data.weight(i) / mean).collect();
        Points {
            x: &data.x[kept.clone()],
            y: &data.y[kept],
            weight: w.iter().sum(),
            w,
        }
    }

    fn ends(&self) -> (f64, f64) {
        (self.x[0], self.x[self.x.len() - 1])
    }
}

/// The estimates from the quartic in blocks.
struct Quartic {
    blocks: usize,
    /// The variance of the noise.
    noise: f64,
    /// The mean of m'' m''''.
    theta24: f64,
}

/// Quartics in the number of blocks, 1 to 5, with the lowest Cp.
fn blocked_quartic(points: &Points) -> Quartic {
    let n = points.x.len();
    let most = (n / BLOCK).clamp(1, MOST_BLOCKS);
    let all: Vec<(usize, usize)> = (1..=most)
        .flat_map(|blocks| (0..blocks).map(move |k| (blocks, k)))
        .collect();
    let fits = parallel::batch(&all, |&(blocks, k)| {
        let length = n / blocks;
        let end = if k + 1 == blocks { n } else { (k + 1) * length };
        (blocks, quartic(points, k * length..end))
    });
    let sums: Vec<[f64; 2]> = (1..=most)
        .map(|blocks| {
            let of = fits.iter().filter(|f| f.0 == blocks);
            of.fold([0.0; 2], |[a, b], (_, [c, d])| [a + c, b + d])
        })
        .collect();
    let finest = sums[most - 1][0];
    let cp = |blocks: usize| {
        let rest = points.weight - (5 * most) as f64;
        rest * sums[blocks - 1][0] / finest + (10 * blocks) as f64
    };
    // Without residuals the most blocks are taken.
    let blocks = (1..=most)
        .min_by(|&i, &j| cp(i).total_cmp(&cp(j)))
        .filter(|_| finest > 0.0)
        .unwrap_or(most);
    let [squares, theta24] = sums[blocks - 1];
    Quartic {
        blocks,
        noise: squares / (points.weight - (5 * blocks) as f64),
        theta24: theta24 / points.weight,
    }
}

/// The residual sum of squares of the least-squares quartic over a range, and the sum of m'' m''''.
fn quartic(points: &Points, range: std::ops::Range<usize>) -> [f64; 2] {
    let (x, y, w) = (&points.x[range.clone()], &points.y[range.clone()], &points.w[range]);
    let half = 0.5 * (x[x.len() - 1] - x[0]);
    let centre = x[0] + half;
    let half = if half > 0.0 { half } else { 1.0 };
    // Moments of t = (x - centre)/half, and of y t^k.
    let (mut s, mut t, mut squares) = ([0.0; 9], [0.0; 5], 0.0);
    for ((x, y), w) in x.iter().zip(y).zip(w) {
        let u = (x - centre) / half;
        let mut power = *w;
        for k in 0..9 {
            s[k] += power;
            if k < 5 {
                t[k] += power * y;
            }
            power *= u;
        }
        squares += w * y * y;
    }
    let matrix = std::array::from_fn(|i| std::array::from_fn(|j| s[i + j]));
    let b = solve::<5>(matrix, t);
    let explained: f64 = (0..5).map(|k| b[k] * t[k]).sum();
    let curved = 24.0 * b[4] * (2.0 * b[2] * s[0] + 6.0 * b[3] * s[1] + 12.0 * b[4] * s[2]);
    [(squares - explained).max(0.0), curved / half.powi(6)]
}

/// Solves a symmetric positive system. The solution has no part in a direction that the matrix does not determine.
fn solve<const N: usize>(mut a: [[f64; N]; N], mut b: [f64; N]) -> [f64; N] {
    const NONE: f64 = 1e-13;
    let diagonal: [f64; N] = std::array::from_fn(|i| a[i][i]);
    for k in 0..N {
        if !(a[k][k] > NONE * diagonal[k]) {
            for i in 0..N {
                (a[i][k], a[k][i]) = (0.0, 0.0);
            }
            (a[k][k], b[k]) = (1.0, 0.0);
        }
        for i in k + 1..N {
            let factor = a[i][k] / a[k][k];
            for j in k..N {
                a[i][j] -= factor * a[k][j];
            }
            b[i] -= factor * b[k];
        }
    }
    for k in (0..N).rev() {
        let known: f64 = (k + 1..N).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / a[k][k];
    }
    b
}

/// Linear binning on an even grid: every point is divided between its two neighbours.
struct Bins {
    weights: Vec<f64>,
    moments: Vec<f64>,
    step: f64,
}

/// Sums at a bin: over the weights, and over the moments.
struct BinSums<const S: usize, const T: usize> {
    s: [f64; S],
    t: [f64; T],
}

impl Bins {
    fn new(points: &Points) -> Self {
        let (low, high) = points.ends();
        let step = (high - low) / (BINS - 1) as f64;
        let (mut weights, mut moments) = (vec![0.0; BINS], vec![0.0; BINS]);
        for ((x, y), w) in points.x.iter().zip(points.y).zip(&points.w) {
            let position = (x - low) / step;
            let bin = (position as usize).min(BINS - 2);
            let upper = w * (position - bin as f64).min(1.0);
            let lower = w - upper;
            weights[bin] += lower;
            weights[bin + 1] += upper;
            moments[bin] += lower * y;
            moments[bin + 1] += upper * y;
        }
        Bins { weights, moments, step }
    }

    /// A bandwidth that the grid can resolve and that does not exceed the range. NaN (no bandwidth follows) becomes the range.
    fn allowed(&self, h: f64) -> f64 {
        h.min(self.step * (BINS - 1) as f64).max(self.step)
    }

    /// For every bin, the sums of K^p v^k times the weights (k < S) and times the moments (k < T). v is in bandwidths.
    fn sums<const S: usize, const T: usize>(&self, h: f64, p: i32) -> Vec<BinSums<S, T>> {
        let reach = (TAU * h / self.step).floor() as usize;
        let table: Vec<[f64; S]> = (0..=2 * reach)
            .map(|i| {
                let v = (i as f64 - reach as f64) * self.step / h;
                let k = (-0.5 * v * v * f64::from(p)).exp();
                std::array::from_fn(|power| k * v.powi(power as i32))
            })
            .collect();
        (0..BINS)
            .map(|j| {
                let (mut s, mut t) = ([0.0; S], [0.0; T]);
                let range = j.saturating_sub(reach)..(j + reach + 1).min(BINS);
                for (k, row) in range.clone().zip(&table[range.start + reach - j..]) {
                    for power in 0..S {
                        s[power] += self.weights[k] * row[power];
                    }
                    for power in 0..T {
                        t[power] += self.moments[k] * row[power];
                    }
                }
                BinSums { s, t }
            })
            .collect()
    }

    /// m'' at every bin by a local cubic.
    fn second_derivatives(&self, h: f64) -> Vec<f64> {
        let curvature = |BinSums { s, t }: BinSums<7, 4>| {
            let matrix = std::array::from_fn(|i| std::array::from_fn(|j| s[i + j]));
            2.0 * solve::<4>(matrix, t)[2] / (h * h)
        };
        self.sums::<7, 4>(h, 1).into_iter().map(curvature).collect()
    }

    /// The mean of m''^2.
    fn curvature(&self, h: f64) -> f64 {
        let ends = (ENDS * BINS as f64).floor() as usize;
        let total: f64 = self.weights.iter().sum();
        let second = self.second_derivatives(h).into_iter().zip(&self.weights);
        let sum: f64 = second
            .skip(ends)
            .take(BINS - 2 * ends)
            .map(|(second, weight)| weight * second.powi(2))
            .sum();
        sum / total
    }

    /// The variance of the noise: the residual sum of squares about a local line divided by its degrees of freedom, n - 2 tr S + tr S S'.
    fn noise(&self, h: f64, points: &Points) -> f64 {
        let squares: f64 = points.y.iter().zip(&points.w).map(|(y, w)| w * y * y).sum();
        let (mut residual, mut freedom) = (squares, points.weight);
        let sums = self.sums::<3, 2>(h, 1).into_iter().zip(self.sums::<3, 0>(h, 2));
        for ((BinSums { s, t }, squared), (weight, moment)) in sums.zip(self.weights.iter().zip(&self.moments)) {
            let u = squared.s;
            let matrix = [[s[0], s[1]], [s[1], s[2]]];
            let fitted = solve(matrix, t)[0];
            // The row of the smoother's weights, and its square.
            let [a, b] = solve(matrix, [1.0, 0.0]);
            let square = a * a * u[0] + 2.0 * a * b * u[1] + b * b * u[2];
            residual += fitted * (fitted * weight - 2.0 * moment);
            freedom += weight * (square - 2.0 * a);
        }
        (residual / freedom).max(0.0)
    }
}

#[cfg(test)]
#[path = "plug_in_tests.rs"]
mod tests;
