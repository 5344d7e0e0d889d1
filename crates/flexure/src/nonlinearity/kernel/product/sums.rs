//! Kernel sums at a point in several dimensions, and the fit that they make.

use super::super::{Degree, Kernel};

/// A direction in which the points in reach have a standard deviation below this share of the bandwidth counts as
/// none.
pub const NO_EXTENT: f64 = 1e-8;
/// Up to so many dimensions there is code of its own for points without weights.
pub const UNWEIGHTED_DIMENSIONS: usize = 3;
/// Below this share of the sum about the point, a sum about the points' mean has lost too many digits.
const RELIABLE: f64 = 1e-4;

/// The kernel in D coordinates at once, for as many points as there are lanes.
pub trait Profile: Copy + Sync {
    /// Multiplies the weights by K(u) for the difference `delta` = u h of one coordinate.
    fn factor<const L: usize>(delta: &[f64; L], h: f64, per_h: f64, weight: &mut [f64; L]);

    /// Turns what the factors have left into weights.
    #[inline(always)]
    fn finish<const L: usize>(_: &mut [f64; L]) {}

    /// The weights before the first factor.
    const START: f64 = 1.0;
}

macro_rules! profile {
    ($name:ident, $doc:literal, |$delta:ident, $h:ident, $u:ident| $weight:expr) => {
        #[doc = $doc]
        #[derive(Clone, Copy)]
        pub struct $name;

        impl Profile for $name {
            #[inline(always)]
            fn factor<const L: usize>(delta: &[f64; L], $h: f64, per_h: f64, weight: &mut [f64; L]) {
                for l in 0..L {
                    let $delta = delta[l];
                    let $u = $delta * per_h;
                    weight[l] *= $weight;
                }
            }
        }
    };
}

#[inline(always)]
fn positive(k: f64) -> f64 {
    if k > 0.0 { k } else { 0.0 }
}

profile!(Uniform, "1.", |delta, h, u| {
    let _ = u;
    if delta.abs() <= h { 1.0 } else { 0.0 }
});
profile!(Triangular, "1 - |u|.", |delta, h, u| {
    let _ = h;
    positive(1.0 - u.abs())
});
profile!(Epanechnikov, "1 - u^2.", |delta, h, u| {
    let _ = h;
    positive(1.0 - u * u)
});
profile!(Biweight, "(1 - u^2)^2.", |delta, h, u| {
    let _ = h;
    let k = positive(1.0 - u * u);
    k * k
});
profile!(Triweight, "(1 - u^2)^3.", |delta, h, u| {
    let _ = h;
    let k = positive(1.0 - u * u);
    k * k * k
});

/// exp(-u^2 / 2): the factors add up the squares.
#[derive(Clone, Copy)]
pub struct Gaussian;

impl Profile for Gaussian {
    const START: f64 = 0.0;

    #[inline(always)]
    fn factor<const L: usize>(delta: &[f64; L], _: f64, per_h: f64, weight: &mut [f64; L]) {
        for l in 0..L {
            let u = delta[l] * per_h;
            weight[l] += u * u;
        }
    }

    #[inline(always)]
    fn finish<const L: usize>(weight: &mut [f64; L]) {
        for l in 0..L {
            weight[l] = (-0.5 * weight[l]).exp();
        }
    }
}

/// The weight of one point by any of the kernels.
pub fn weight(kernel: Kernel, delta: &[f64], h: &[f64]) -> f64 {
    fn of<P: Profile>(delta: &[f64], h: &[f64]) -> f64 {
        let mut weight = [P::START];
        for (&delta, &h) in delta.iter().zip(h) {
            P::factor(&[delta], h, 1.0 / h, &mut weight);
        }
        P::finish(&mut weight);
        weight[0]
    }
    match kernel {
        Kernel::Uniform => of::<Uniform>(delta, h),
        Kernel::Triangular => of::<Triangular>(delta, h),
        Kernel::Epanechnikov => of::<Epanechnikov>(delta, h),
        Kernel::Biweight => of::<Biweight>(delta, h),
        Kernel::Triweight => of::<Triweight>(delta, h),
        Kernel::Gaussian => of::<Gaussian>(delta, h),
    }
}

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
        window: &Window<D>,
        x: [&[f64; L]; D],
        y: &[f64; L],
        w: Option<&[f64; L]>,
    ) {
        let mut k = [P::START; L];
        let mut u = [[0.0; L]; D];
        for j in 0..D {
            for l in 0..L {
                u[j][l] = x[j][l] - window.at[j];
            }
            P::factor(&u[j], window.h[j], window.per_h[j], &mut k);
            for l in 0..L {
                u[j][l] *= window.per_h[j];
            }
        }
        P::finish(&mut k);
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
#[inline(always)]
pub fn over<P: Profile, const D: usize, const L: usize, const LINEAR: bool>(
    points: &Columns,
    runs: &[std::ops::Range<usize>],
    window: &Window<D>,
) -> Sums<D, 1> {
    if D <= UNWEIGHTED_DIMENSIONS && points.w.is_empty() {
        over_runs::<P, D, L, LINEAR, false>(points, runs, window)
    } else {
        over_runs::<P, D, L, LINEAR, true>(points, runs, window)
    }
}

#[inline(always)]
fn over_runs<P: Profile, const D: usize, const L: usize, const LINEAR: bool, const WEIGHTED: bool>(
    points: &Columns,
    runs: &[std::ops::Range<usize>],
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
            lanes.add::<P, LINEAR>(window, std::array::from_fn(|j| &x[j].0[c]), y, w);
        }
        for (i, y) in y.1.iter().enumerate() {
            let w = WEIGHTED.then(|| std::array::from_ref(&w.1[i]));
            let x = std::array::from_fn(|j| std::array::from_ref(&x[j].1[i]));
            single.add::<P, LINEAR>(window, x, std::array::from_ref(y), w);
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

/// A function that sums over runs of points.
pub type SumsOver<const D: usize> = fn(&Columns, &[std::ops::Range<usize>], &Window<D>) -> Sums<D, 1>;

/// The one for this kernel and degree. More lanes than these do not fit into the registers.
pub fn chosen<const D: usize>(kernel: Kernel, degree: Degree) -> SumsOver<D> {
    fn of<P: Profile, const D: usize>(degree: Degree) -> SumsOver<D> {
        match degree {
            Degree::Constant => over::<P, D, 4, false>,
            Degree::Linear => over::<P, D, 2, true>,
        }
    }
    match kernel {
        Kernel::Uniform => of::<Uniform, D>(degree),
        Kernel::Triangular => of::<Triangular, D>(degree),
        Kernel::Epanechnikov => of::<Epanechnikov, D>(degree),
        Kernel::Biweight => of::<Biweight, D>(degree),
        Kernel::Triweight => of::<Triweight, D>(degree),
        Kernel::Gaussian => of::<Gaussian, D>(degree),
    }
}
