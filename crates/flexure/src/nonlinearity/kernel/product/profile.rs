//! The kernels as factors of a product: [`start`], [`factor`] for every dimension, [`finish`].

use super::super::Kernel;

/// Sets the weights to their values before the first factor.
#[inline(always)]
pub fn start(kernel: Kernel, weights: &mut [f64]) {
    // The Gaussian's factors add up the squares.
    weights.fill(if kernel == Kernel::Gaussian { 0.0 } else { 1.0 });
}

/// Multiplies the weights of points by K((x - at)/h).
#[inline(always)]
pub fn factor(kernel: Kernel, x: &[f64], at: f64, h: f64, weights: &mut [f64]) {
    let per_h = 1.0 / h;
    macro_rules! each {
        (|$weight:ident, $delta:ident, $u:ident| $change:expr) => {
            for ($weight, x) in weights.iter_mut().zip(x) {
                let $delta = x - at;
                let $u = $delta * per_h;
                $change;
            }
        };
    }
    match kernel {
        Kernel::Uniform => each!(|weight, delta, _u| *weight *= if delta.abs() <= h { 1.0 } else { 0.0 }),
        Kernel::Triangular => each!(|weight, _delta, u| *weight *= positive(1.0 - u.abs())),
        Kernel::Epanechnikov => each!(|weight, _delta, u| *weight *= positive(1.0 - u * u)),
        Kernel::Biweight => each!(|weight, _delta, u| {
            let k = positive(1.0 - u * u);
            *weight *= k * k;
        }),
        Kernel::Triweight => each!(|weight, _delta, u| {
            let k = positive(1.0 - u * u);
            *weight *= k * k * k;
        }),
        Kernel::Gaussian => each!(|weight, _delta, u| *weight += u * u),
    }
}

/// Turns the product of the factors into weights.
#[inline(always)]
pub fn finish(kernel: Kernel, weights: &mut [f64]) {
    if kernel == Kernel::Gaussian {
        weights.iter_mut().for_each(|weight| *weight = (-0.5 * *weight).exp());
    }
}

/// `k` within the support, zero outside it.
#[inline(always)]
pub fn positive(k: f64) -> f64 {
    if k > 0.0 { k } else { 0.0 }
}

/// The weight of one point for any kernel, from its differences from the centre.
pub fn weight(kernel: Kernel, delta: &[f64], h: &[f64]) -> f64 {
    let mut weight = [0.0];
    start(kernel, &mut weight);
    for (&delta, &h) in delta.iter().zip(h) {
        factor(kernel, &[delta], 0.0, h, &mut weight);
    }
    finish(kernel, &mut weight);
    weight[0]
}
