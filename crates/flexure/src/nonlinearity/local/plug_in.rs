//! Local bandwidths by plug-in (Fan and Gijbels 1996, section 4.3; Brockmann, Gasser and Herrmann 1993).
//!
//! $$ h(x) = \Bigl(\frac{R(K)}{\mu_2(K)^2} \frac{\sigma^2(x)}{m''(x)^2\, n f(x)}\Bigr)^{1/5} $$
//! minimises the asymptotic squared error of the local line at x. The noise comes from differences of neighbours ([`noise`](super::noise)).
//! n f(x) is the weight of the points around x divided by their extent. m'' is that of a local cubic, the pilot of the global plug-in rule
//! (Ruppert, Sheather and Wand 1995). At a zero of m'' the formula gives an infinite window. So m''^2 is averaged over the pilot's own
//! window, and the bandwidth is kept between the narrowest of Lepski's windows and the data's extent. It is also at most the bandwidth at
//! any other place plus the distance to it: so a window does not reach far into a place that needs a narrow one.

use super::choice::{LocalWindow, Side};
use super::windows::{Design, square_share};
use crate::error::Result;
use crate::nonlinearity::kernel::{Degree, Kernel, Sorted, for_each_sum};
use crate::parallel;
use crate::selection::{BandwidthSearch, Bend, WithBend, bulk, canonical};

/// Places on either side of a node at which m''^2 is averaged, over twice the pilot's standard deviation.
const PLACES: i32 = 8;

/// The plug-in choice of windows.
pub struct PlugInWindows {
    /// One bandwidth for all points.
    pub global: BandwidthSearch,
    /// The local window at every node.
    pub table: Vec<LocalWindow>,
}

impl PlugInWindows {
    pub fn new(data: &Sorted, kernel: Kernel) -> Result<Self> {
        let WithBend { plug_in, bend } = WithBend::new(data)?;
        let global = plug_in.search(kernel);
        let design = Design::new(data, kernel, global.bandwidth);
        let bandwidths = bandwidths(data, &design, &bend);
        let grouped = design.grouped(data);
        let factor = square_share(kernel);
        let window = |j: usize| {
            let (x, bandwidth) = (design.nodes[j], bandwidths[j]);
            let line = grouped
                .direct_sums(kernel, Degree::Linear, bandwidth, x, None)
                .fit(Degree::Linear)?;
            Some(LocalWindow {
                x,
                bandwidth,
                side: Side::Both,
                value: line.value,
                standard_error: design.noise[j] * (factor * line.leverage).sqrt(),
            })
        };
        let windows = parallel::map(design.nodes.len(), window);
        Ok(PlugInWindows {
            global,
            table: windows.into_iter().flatten().collect(),
        })
    }
}

/// The bandwidth at every node.
fn bandwidths(data: &Sorted, design: &Design, bend: &Bend) -> Vec<f64> {
    let (nodes, extent) = (&design.nodes, bulk(&data.x));
    let narrowest = design.bandwidths.first().copied().unwrap_or(extent);
    // The weight of the points per unit of x, over windows as wide as the pilot's.
    let reach = bend.window.max(narrowest);
    let (low, high) = (data.x[0], data.x[data.len() - 1]);
    let mut density = vec![0.0; nodes.len()];
    for_each_sum(data, Kernel::Uniform, Degree::Constant, reach, nodes, |j, sums| {
        let inside = (nodes[j] + reach).min(high) - (nodes[j] - reach).max(low);
        density[j] = sums.s[0] / inside;
    });
    let mut bandwidths: Vec<f64> = (0..nodes.len())
        .map(|j| {
            let ratio = design.noise[j].powi(2) / (curvature(bend, nodes[j]) * density[j]);
            // NaN arises for a straight line without noise. It becomes the widest window.
            (canonical(design.kernel) * ratio.powf(0.2)).min(extent).max(narrowest)
        })
        .collect();
    for j in 1..nodes.len() {
        bandwidths[j] = bandwidths[j].min(bandwidths[j - 1] + (nodes[j] - nodes[j - 1]));
    }
    for j in (1..nodes.len()).rev() {
        bandwidths[j - 1] = bandwidths[j - 1].min(bandwidths[j] + (nodes[j] - nodes[j - 1]));
    }
    bandwidths
}

/// m''^2 averaged around `x` with normal weights of the pilot's standard deviation.
fn curvature(bend: &Bend, x: f64) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for k in -PLACES..=PLACES {
        let u = 2.0 * f64::from(k) / f64::from(PLACES);
        let weight = (-0.5 * u * u).exp();
        sum += weight * bend.square(x + u * bend.window);
        total += weight;
    }
    sum / total
}
