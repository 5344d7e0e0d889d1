//! Kernel regression in one dimension, the estimate of Nadaraya and Watson (paper, (13) with theorem 1, (21) with theorem 2):
//! $$ m_n(x) = \frac{\sum_i Y_i K((x - X_i)/h)}{\sum_i K((x - X_i)/h)} , $$
//! and its local linear form (Fan 1993), with weights.
//!
//! Theorem 1: let K be bounded, with bounds $c_1 H(|x|) \le K(x) \le c_2 H(|x|)$, where H is bounded, does not increase, and
//! $t^d H(t) \to 0$; let $h_n \to 0$ and $n h_n^d \to \infty$ (d columns). Then $m_n(x) \to m(x)$ in probability for almost all x; under a Lipschitz condition of order p, $0 < p \le 1$, with an error of
//! $O(n^{-p/(2p+d)})$. [`study::rates`](crate::study) measures it.
//!
//! One column. The data are sorted once ([`sorted`]). Then every point costs O(1) for any bandwidth:
//!
//! | file | what |
//! |---|---|
//! | [`sums`] | the kernel sums at a point, and the local constant or the local line that follows from them |
//! | [`polynomials`] | kernels of bounded support: sums of K by the moments of a window |
//! | [`moments`], [`window_sums`], [`window_bounds`] | moments over a window that slides over the data, and where windows begin and end |
//! | [`gaussian`] | the Gaussian: sums by a fast Gauss transform |
//! | [`leave_one_out`](mod@leave_one_out) | exact scores of bandwidths |
//! | [`bin`], [`binned`] | scores from data in bins, for searches among many points |
//! | [`regression`], [`line`] | the estimate itself, and its continuation beyond the data |
//! | [`recursive`] | the estimate for streams, at given points |
//! | [`streamed`] | the estimate for streams, with its bandwidth and a band: sums in bins that are merged |
//!
//! Several columns: [`product`] kernels. [`estimator`] serves any number of columns, and [`choice`] and [`descent`] search for
//! their bandwidths. All sums agree with direct summation to about 1e-12.
//!
//! References: Nadaraya (1964); Watson (1964); Seifert, Brockmann, Engel, Gasser (1994), fast
//! algorithms; Greengard and Strain (1991), the Gauss transform.

mod bin;
mod binned;
mod choice;
mod descent;
mod estimator;
mod gaussian;
mod leave_one_out;
mod line;
mod moments;
mod polynomials;
mod product;
mod recursive;
mod regression;
mod sorted;
mod streamed;
mod sums;
mod window_bounds;
mod window_sums;

pub(crate) use binned::BinnedScales;
pub use choice::{Bandwidth, KernelScore, KernelSearch};
pub use estimator::{KernelEstimate, KernelEstimator};
pub(crate) use leave_one_out::leave_one_out;
pub use recursive::{RecursiveFit, RecursiveForm, RecursiveKernel, RecursiveRegression, RecursiveSums};
use regression::direct_without;
pub use regression::{KernelFit, KernelRegression};
pub(crate) use regression::{check_points, check_weights};
pub(crate) use sorted::Sorted;
pub use streamed::{StreamedBand, StreamedFit, StreamedRegression};
pub use sums::Degree;
pub(crate) use sums::{ONE_ABSCISSA, Sums};

use serde::{Deserialize, Serialize};

use crate::interrupt;

/// The weight function K. The bandwidth h is the half width of the support for the kernels of bounded
/// support, and the standard deviation for the Gaussian.
///
/// K is scaled to K(0) = 1: the estimate does not depend on the scale.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kernel {
    /// 1 on [-1, 1].
    Uniform,
    /// 1 - |u| on [-1, 1].
    Triangular,
    /// 1 - u^2 on [-1, 1].
    #[default]
    Epanechnikov,
    /// (1 - u^2)^2 on [-1, 1].
    Biweight,
    /// (1 - u^2)^3 on [-1, 1].
    Triweight,
    /// exp(-u^2 / 2).
    Gaussian,
}

impl Kernel {
    /// All kernels.
    pub const ALL: [Kernel; 6] = [
        Kernel::Uniform,
        Kernel::Triangular,
        Kernel::Epanechnikov,
        Kernel::Biweight,
        Kernel::Triweight,
        Kernel::Gaussian,
    ];

    /// The name in lower case, as it is written in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Kernel::Uniform => "uniform",
            Kernel::Triangular => "triangular",
            Kernel::Epanechnikov => "epanechnikov",
            Kernel::Biweight => "biweight",
            Kernel::Triweight => "triweight",
            Kernel::Gaussian => "gaussian",
        }
    }

    /// K(u).
    pub fn weight(self, u: f64) -> f64 {
        let inside = |k: f64| if u.abs() <= 1.0 { k } else { 0.0 };
        let parabola = (1.0 - u) * (1.0 + u);
        match self {
            Kernel::Uniform => inside(1.0),
            Kernel::Triangular => inside(1.0 - u.abs()),
            Kernel::Epanechnikov => inside(parabola),
            Kernel::Biweight => inside(parabola * parabola),
            Kernel::Triweight => inside(parabola * parabola * parabola),
            Kernel::Gaussian => (-0.5 * u * u).exp(),
        }
    }

    /// A point with |u| above this is out of reach: K(u) is zero or, for the Gaussian, close to underflow.
    pub(crate) fn reach(self) -> f64 {
        match self {
            Kernel::Gaussian => 38.0,
            _ => 1.0,
        }
    }
}

/// Calls `visit(j, sums)` for each of the increasing points `at` that has any data in reach.
pub(crate) fn for_each_sum(
    data: &Sorted,
    kernel: Kernel,
    degree: Degree,
    h: f64,
    at: &[f64],
    mut visit: impl FnMut(usize, Sums),
) {
    // The call goes through a pointer, so that the sums for all kernels are compiled once, not for every caller.
    visit_sums(data, kernel, degree, h, at, &mut visit);
}

fn visit_sums(data: &Sorted, kernel: Kernel, degree: Degree, h: f64, at: &[f64], visit: &mut dyn FnMut(usize, Sums)) {
    // Direct sums are kept for the next point, as many points may have one abscissa.
    let mut last = (f64::NAN, Sums::NONE);
    let mut visit = |j: usize, mut sums: Sums| {
        interrupt::leave_at(j);
        if !sums.reliable(degree) {
            if last.0 != at[j] {
                last = (at[j], data.direct_sums(kernel, degree, h, at[j], None));
            }
            sums = last.1;
        }
        visit(j, sums);
    };
    match kernel {
        Kernel::Gaussian => gaussian::transform::<{ gaussian::TERMS }, { gaussian::NEIGHBOURS }>(data, h, at, visit),
        _ => polynomials::at_points(data, kernel, degree, h, at, &mut visit),
    }
}
