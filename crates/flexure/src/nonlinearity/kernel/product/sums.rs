//! Kernel sums at a point in several dimensions, and the fit that they make.

use std::ops::Range;

use super::super::{Degree, Kernel};
use super::profile::{Biweight, Epanechnikov, Gaussian, Profile, Triangular, Triweight, Uniform};

/// A direction in which the points in reach have a standard deviation below this share of the bandwidth counts as
/// none.
pub const NO_EXTENT: f64 = 1e-8;
/// Up to so many dimensions there is code of its own for points without weights.
pub const UNWEIGHTED_DIMENSIONS: usize = 3;
/// Below this share of the sum about the point, a sum about the points' mean has lost too many digits.
const RELIABLE: f64 = 1e-3;

/// Points column by column.
#[derive(Debug, Clone, PartialEq)]
pub struct Columns {
    pub x: Vec<Vec<f64>>,
    /// Centred ordinates.
    pub y: Vec<f64>,
    /// Empty where all weights are 1, in no more than [`UNWEIGHTED_DIMENSIONS`].
    pub w: Vec<f64>,
}

impl Columns {
    #[inline(always)]
    pub fn weight(&self, i: usize) -> f64 {
        if self.w.is_empty() { 1.0 } else { self.w[i] }
    }
}

/// A window: its centre and its bandwidths.
#[derive(Clone, Copy)]
pub struct Window<const D: usize> {
    pub at: [f64; D],
    pub h: [f64; D],
    pub per_h: [f64; D],
}

/// sum w K, sum w K u_j, sum w K u_j u_k (j <= k), u = (X - q)/h, and the first two times the centred ordinates,
/// in L parts. For the local constant fit the sums with u are zero.
#[derive(Clone, Copy)]
pub struct Sums<const D: usize, const L: usize> {
    pub s0: [f64; L],
    pub s1: [[f64; L]; D],
    pub s2: [[[f64; L]; D]; D],
    pub t0: [f64; L],
    pub t1: [[f64; L]; D],
}

impl<const D: usize, const L: usize> Sums<D, L> {
    pub const ZERO: Self = Sums {
        s0: [0.0; L],
        s1: [[0.0; L]; D],
        s2: [[[0.0; L]; D]; D],
        t0: [0.0; L],
        t1: [[0.0; L]; D],
    };

    #[inline(always)]
    fn add<P: Profile, const LINEAR: bool>(
        &mut self,
        profile: P,
        window: &Window<D>,
        x: [&[f64; L]; D],
        y: &[f64; L],
        w: Option<&[f64; L]>,
    ) {
        let mut k = [profile.start(); L];
        let mut u = [[0.0; L]; D];
        for j in 0..D {
            for l in 0..L {
                u[j][l] = x[j][l] - window.at[j];
            }
            profile.factor(&u[j], window.h[j], window.per_h[j], &mut k);
            for l in 0..L {
                u[j][l] *= window.per_h[j];
            }
        }
        profile.finish(&mut k);
        if let Some(w) = w {
            for l in 0..L {
                k[l] *= w[l];
            }
        }
        for l in 0..L {
            self.s0[l] += k[l];
            self.t0[l] += k[l] * y[l];
        }
        if LINEAR {
            for j in 0..D {
                let mut ku = [0.0; L];
                for l in 0..L {
                    ku[l] = k[l] * u[j][l];
                    self.s1[j][l] += ku[l];
                    self.t1[j][l] += ku[l] * y[l];
                }
                for i in 0..=j {
                    for l in 0..L {
                        self.s2[i][j][l] += ku[l] * u[i][l];
                    }
                }
            }
        }
    }
}

/// The sums over the runs of points.
#[inline(never)]
fn over_runs<P: Profile, const D: usize, const L: usize, const LINEAR: bool, const WEIGHTED: bool>(
    profile: P,
    points: &Columns,
    runs: &[Range<usize>],
    window: &Window<D>,
) -> Sums<D, 1> {
    let mut lanes = Sums::<D, L>::ZERO;
    let mut single = Sums::<D, 1>::ZERO;
    for run in runs {
        let x: [(&[[f64; L]], &[f64]); D] = std::array::from_fn(|j| points.x[j][run.clone()].as_chunks::<L>());
        let y = points.y[run.clone()].as_chunks::<L>();
        let w = if WEIGHTED {
            points.w[run.clone()].as_chunks::<L>()
        } else {
            (&[][..], &[][..])
        };
        for (c, y) in y.0.iter().enumerate() {
            let w = WEIGHTED.then(|| &w.0[c]);
            lanes.add::<P, LINEAR>(profile, window, std::array::from_fn(|j| &x[j].0[c]), y, w);
        }
        for (i, y) in y.1.iter().enumerate() {
            let w = WEIGHTED.then(|| std::array::from_ref(&w.1[i]));
            let x = std::array::from_fn(|j| std::array::from_ref(&x[j].1[i]));
            single.add::<P, LINEAR>(profile, window, x, std::array::from_ref(y), w);
        }
    }
    let fold = |one: [f64; 1], many: [f64; L]| [one[0] + many.iter().sum::<f64>()];
    Sums {
        s0: fold(single.s0, lanes.s0),
        s1: std::array::from_fn(|j| fold(single.s1[j], lanes.s1[j])),
        s2: std::array::from_fn(|i| std::array::from_fn(|j| fold(single.s2[i][j], lanes.s2[i][j]))),
        t0: fold(single.t0, lanes.t0),
        t1: std::array::from_fn(|j| fold(single.t1[j], lanes.t1[j])),
    }
}

/// The fit at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Local<const D: usize> {
    /// The estimate less the ordinates' mean.
    pub value: f64,
    /// The share of an observation of weight 1 at this very point in the estimate.
    pub leverage: f64,
    /// The slopes per bandwidth; zeros of a local constant.
    pub slope: [f64; D],
}

/// What the sums tell of the fit.
pub enum Told<const D: usize> {
    /// No points in reach.
    Nothing,
    Fit(Local<D>),
    /// It has to be found from the points one by one.
    Doubtful,
}

impl<const D: usize> Sums<D, 1> {
    /// The fit of this degree.
    #[inline(always)]
    pub fn fit(&self, degree: Degree) -> Told<D> {
        let s0 = self.s0[0];
        if !(s0 > 0.0) {
            return Told::Nothing;
        }
        let mean = Local {
            value: self.t0[0] / s0,
            leverage: 1.0 / s0,
            slope: [0.0; D],
        };
        if degree == Degree::Constant {
            return Told::Fit(mean);
        }
        self.plane(mean)
    }

    /// By Cholesky's decomposition of the sums about the points' mean.
    #[inline(always)]
    fn plane(&self, mean: Local<D>) -> Told<D> {
        let centre: [f64; D] = std::array::from_fn(|j| self.s1[j][0] * mean.leverage);
        let mut lower = [[0.0; D]; D];
        // L a = the centre's and L b = the ordinates' sums.
        let (mut a, mut b) = ([0.0; D], [0.0; D]);
        for j in 0..D {
            for i in 0..=j {
                let mut sum = self.s2[i][j][0] - self.s1[i][0] * centre[j];
                for k in 0..i {
                    sum -= lower[j][k] * lower[i][k];
                }
                if i < j {
                    lower[j][i] = sum / lower[i][i];
                } else if sum > RELIABLE * self.s2[j][j][0] {
                    lower[j][j] = sum.sqrt();
                } else {
                    return Told::Doubtful;
                }
            }
            let (mut p, mut r) = (-centre[j], self.t1[j][0] - centre[j] * self.t0[0]);
            for k in 0..j {
                p -= lower[j][k] * a[k];
                r -= lower[j][k] * b[k];
            }
            a[j] = p / lower[j][j];
            b[j] = r / lower[j][j];
        }
        let mut slope = [0.0; D];
        for j in (0..D).rev() {
            let mut sum = b[j];
            for k in j + 1..D {
                sum -= lower[k][j] * slope[k];
            }
            slope[j] = sum / lower[j][j];
        }
        Told::Fit(Local {
            value: mean.value + (0..D).map(|j| a[j] * b[j]).sum::<f64>(),
            leverage: mean.leverage + a.iter().map(|a| a * a).sum::<f64>(),
            slope,
        })
    }
}

/// The way to the sums for one kernel and degree.
#[derive(Clone, Copy)]
pub struct SumsOver<const D: usize> {
    kernel: Kernel,
    over: fn(Kernel, &Columns, &[Range<usize>], &Window<D>) -> Sums<D, 1>,
}

impl<const D: usize> SumsOver<D> {
    /// In few dimensions every kernel has code of its own.
    pub fn new(kernel: Kernel, degree: Degree) -> Self {
        let over = match (D <= UNWEIGHTED_DIMENSIONS, degree) {
            (true, Degree::Constant) => by_kernel::<D, 4, false>,
            (true, Degree::Linear) => by_kernel::<D, 2, true>,
            (false, Degree::Constant) => over_runs::<Kernel, D, 4, false, true>,
            (false, Degree::Linear) => over_runs::<Kernel, D, 2, true, true>,
        };
        SumsOver { kernel, over }
    }

    /// The sums over the runs of points.
    #[inline(always)]
    pub fn over(&self, points: &Columns, runs: &[Range<usize>], window: &Window<D>) -> Sums<D, 1> {
        (self.over)(self.kernel, points, runs, window)
    }
}

/// More lanes than those of [`SumsOver::new`] do not fit into the registers.
fn by_kernel<const D: usize, const L: usize, const LINEAR: bool>(
    kernel: Kernel,
    points: &Columns,
    runs: &[Range<usize>],
    window: &Window<D>,
) -> Sums<D, 1> {
    macro_rules! by {
        ($profile:expr) => {
            if points.w.is_empty() {
                over_runs::<_, D, L, LINEAR, false>($profile, points, runs, window)
            } else {
                over_runs::<_, D, L, LINEAR, true>($profile, points, runs, window)
            }
        };
    }
    match kernel {
        Kernel::Uniform => by!(Uniform),
        Kernel::Triangular => by!(Triangular),
        Kernel::Epanechnikov => by!(Epanechnikov),
        Kernel::Biweight => by!(Biweight),
        Kernel::Triweight => by!(Triweight),
        Kernel::Gaussian => by!(Gaussian),
    }
}
