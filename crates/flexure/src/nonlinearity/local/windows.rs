//! The local lines over windows of growing width at the nodes of a table.

use super::noise;
use crate::nonlinearity::kernel::{Degree, Kernel, Sorted, Sums, for_each_sum};
use crate::parallel;
use crate::selection::bulk;

/// The most nodes, and the number of points for each node.
const NODES: usize = 2000;
const POINTS_A_NODE: usize = 8;
/// Every window is wider than the one before by this factor.
const GROWTH: f64 = std::f64::consts::SQRT_2;
/// The narrowest window holds about this many points, and is at least this share of the data's extent.
const SMALLEST: f64 = 12.0;
const SMALLEST_SHARE: f64 = 1e-4;
/// It is at least this share of the bandwidth that serves for all points: narrower windows would only be noise.
const SMALLEST_OF_ONE: f64 = 0.125;
/// If there are more points than this, points that are close together are taken as one.
const GROUPS: usize = 32_768;
/// A one-sided window reaches beyond its node by this share.
const EDGE: f64 = 1e-9;
/// The widest group, in narrowest bandwidths.
const GROUP: f64 = 0.125;

/// The nodes, the bandwidths and the size of the noise. The halves of the data share them with the whole.
pub struct Design {
    /// Increasing.
    pub nodes: Vec<f64>,
    /// The standard deviation of the noise at each node, at weight one.
    pub noise: Vec<f64>,
    /// Increasing.
    pub bandwidths: Vec<f64>,
    pub kernel: Kernel,
    /// The bandwidth that serves for all points.
    pub global: f64,
}

impl Design {
    pub fn new(data: &Sorted, kernel: Kernel, global: f64) -> Self {
        let n = data.len();
        let count = (n / POINTS_A_NODE).clamp(32, NODES).min(n);
        // Counted from the nearer end, so that mirrored data give the mirrored table.
        let rank = |i: usize| i * (n - 1) / (count - 1).max(1);
        let node = |i: usize| {
            data.x[if 2 * i < count {
                rank(i)
            } else {
                n - 1 - rank(count - 1 - i)
            }]
        };
        let mut nodes: Vec<f64> = (0..count).map(node).collect();
        nodes.dedup();
        let extent = bulk(&data.x);
        let smallest = (extent * (0.5 * SMALLEST / n as f64).max(SMALLEST_SHARE)).max(SMALLEST_OF_ONE * global);
        let scales = (0..).map(|k| smallest * GROWTH.powi(k));
        Design {
            noise: noise::deviation(data, extent, &nodes),
            bandwidths: scales.take_while(|h| *h < GROWTH * extent).collect(),
            nodes,
            kernel,
            global,
        }
    }

    /// The data. If there are many points, runs of near points are replaced by their means.
    pub fn grouped(&self, data: &Sorted) -> Sorted {
        if data.len() <= GROUPS {
            return data.clone();
        }
        let (most, widest) = (data.len().div_ceil(GROUPS), GROUP * self.bandwidths[0]);
        let (mut x, mut y, mut w) = (Vec::new(), Vec::new(), Vec::new());
        let mut start = 0;
        while start < data.len() {
            let (mut end, mut sums) = (start, [0.0; 3]);
            let origin = data.x[start];
            while end < data.len().min(start + most) && data.x[end] - origin <= widest {
                let weight = data.weight(end);
                sums[0] += weight;
                sums[1] += weight * (data.x[end] - origin);
                sums[2] += weight * data.y[end];
                end += 1;
            }
            x.push(origin + sums[1] / sums[0]);
            y.push(sums[2] / sums[0]);
            w.push(sums[0]);
            start = end;
        }
        let mut grouped = Sorted::new(&x, &y, Some(&w));
        // The ordinates are relative to the same mean as before.
        grouped.y.iter_mut().for_each(|y| *y += grouped.mean);
        grouped.mean = 0.0;
        grouped
    }
}

/// A local line at a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    pub value: f64,
    pub slope: f64,
    /// The standard error of the value.
    pub error: f64,
}

/// The lines of one family, for every bandwidth and node; `None` where no data are in reach.
pub type Family = Vec<Vec<Option<Line>>>;

/// All lines at all nodes.
pub struct Windows<'a> {
    pub design: &'a Design,
    pub left: Family,
    pub both: Family,
    pub right: Family,
    grouped: Sorted,
}

impl<'a> Windows<'a> {
    pub fn new(data: &Sorted, design: &'a Design) -> Self {
        let grouped = design.grouped(data);
        let family =
            |centre: f64| -> Family { parallel::batch(&design.bandwidths, |h| lines(&grouped, design, *h, centre)) };
        Windows {
            left: family(-1.0),
            both: family(0.0),
            right: family(1.0),
            design,
            grouped,
        }
    }

    /// The lines around the nodes with one bandwidth.
    pub fn around(&self, h: f64) -> Vec<Option<Line>> {
        lines(&self.grouped, self.design, h, 0.0)
    }
}

/// The lines over windows that reach from the node by `h` to both sides (`centre` 0), or to one.
fn lines(data: &Sorted, design: &Design, h: f64, centre: f64) -> Vec<Option<Line>> {
    // The half of a window is a window itself, and the line is evaluated at its end. It reaches a little further, so that the node's own
    // point is inside in spite of rounding.
    let (kernel, half, reach) = if centre == 0.0 {
        (design.kernel, h, h)
    } else {
        (Kernel::Uniform, 0.5 * h, 0.5 * h * (1.0 + EDGE))
    };
    let at: Vec<f64> = design.nodes.iter().map(|x| x + centre * half).collect();
    let away = centre * half / reach;
    let factor = square_share(kernel);
    let mut lines = vec![None; at.len()];
    for_each_sum(data, kernel, Degree::Linear, reach, &at, |j, sums| {
        let here = Sums {
            at: sums.at - away,
            ..sums
        };
        let beside = Sums {
            at: here.at + 1.0,
            ..sums
        };
        if let (Some(here), Some(beside)) = (here.fit(Degree::Linear), beside.fit(Degree::Linear)) {
            lines[j] = Some(Line {
                value: here.value,
                slope: (beside.value - here.value) / reach,
                error: design.noise[j] * (factor * here.leverage).sqrt(),
            });
        }
    });
    lines
}

/// $\int K^2 / \int K$: the variance of an estimate is its leverage times this. It is exact for the uniform kernel, asymptotic for the
/// others.
pub(super) fn square_share(kernel: Kernel) -> f64 {
    match kernel {
        Kernel::Uniform => 1.0,
        Kernel::Triangular => 2.0 / 3.0,
        Kernel::Epanechnikov => 4.0 / 5.0,
        Kernel::Biweight => 16.0 / 21.0,
        Kernel::Triweight => 320.0 / 429.0,
        Kernel::Gaussian => std::f64::consts::FRAC_1_SQRT_2,
    }
}
