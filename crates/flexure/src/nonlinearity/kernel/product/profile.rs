//! The kernels as factors of a product.

use super::super::Kernel;

/// A kernel, for as many points at a time as there are lanes.
pub trait Profile: Copy + Sync {
    /// Multiplies the weights by K(u) for the difference `delta` = u h of one coordinate.
    fn factor<const L: usize>(self, delta: &[f64; L], h: f64, per_h: f64, weight: &mut [f64; L]);

    /// Turns what the factors have left into weights.
    #[inline(always)]
    fn finish<const L: usize>(self, _: &mut [f64; L]) {}

    /// The weights before the first factor.
    #[inline(always)]
    fn start(self) -> f64 {
        1.0
    }
}

macro_rules! profile {
    ($name:ident, $doc:literal, |$delta:ident, $h:ident, $u:ident| $weight:expr) => {
        #[doc = $doc]
        #[derive(Clone, Copy)]
        pub struct $name;

        impl Profile for $name {
            #[inline(always)]
            fn factor<const L: usize>(self, delta: &[f64; L], $h: f64, per_h: f64, weight: &mut [f64; L]) {
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
    #[inline(always)]
    fn start(self) -> f64 {
        0.0
    }

    #[inline(always)]
    fn factor<const L: usize>(self, delta: &[f64; L], _: f64, per_h: f64, weight: &mut [f64; L]) {
        for l in 0..L {
            let u = delta[l] * per_h;
            weight[l] += u * u;
        }
    }

    #[inline(always)]
    fn finish<const L: usize>(self, weight: &mut [f64; L]) {
        for l in 0..L {
            weight[l] = (-0.5 * weight[l]).exp();
        }
    }
}

/// Any of them: slower, but with little code for many dimensions.
impl Profile for Kernel {
    #[inline(always)]
    fn factor<const L: usize>(self, delta: &[f64; L], h: f64, per_h: f64, weight: &mut [f64; L]) {
        match self {
            Kernel::Uniform => Uniform.factor(delta, h, per_h, weight),
            Kernel::Triangular => Triangular.factor(delta, h, per_h, weight),
            Kernel::Epanechnikov => Epanechnikov.factor(delta, h, per_h, weight),
            Kernel::Biweight => Biweight.factor(delta, h, per_h, weight),
            Kernel::Triweight => Triweight.factor(delta, h, per_h, weight),
            Kernel::Gaussian => Gaussian.factor(delta, h, per_h, weight),
        }
    }

    #[inline(always)]
    fn finish<const L: usize>(self, weight: &mut [f64; L]) {
        if self == Kernel::Gaussian {
            Gaussian.finish(weight);
        }
    }

    #[inline(always)]
    fn start(self) -> f64 {
        if self == Kernel::Gaussian {
            Gaussian.start()
        } else {
            1.0
        }
    }
}

/// The weight of one point by any of the kernels.
pub fn weight(kernel: Kernel, delta: &[f64], h: &[f64]) -> f64 {
    let mut weight = [kernel.start()];
    for (&delta, &h) in delta.iter().zip(h) {
        kernel.factor(&[delta], h, 1.0 / h, &mut weight);
    }
    kernel.finish(&mut weight);
    weight[0]
}
