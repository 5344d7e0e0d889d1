//! Standard errors of the coefficients.

use super::super::block::{Signals, delayed, matrix_product};
use super::integrators::{term_polynomial, with_integrators};
use super::system::{LinearSystem, Orders, columns};
use crate::linalg::covariance_factor;
use crate::linear::TransferFunction;
use crate::linear::autoregression::{SAMPLES_PER_COEFFICIENT, whitening};
use crate::parallel;
use crate::vectors::{combined, dot};

/// The covariance of the coefficients, as polynomials in the delay, row by row: first the numerators', input after input, then the
/// denominator's after its leading 1. `None` if the samples do not determine them.
///
/// It is that of the output error under coloured noise (Ljung 1999, equation 9.42): $\sigma^2 (J'J)^{-1} J_c'J_c (J'J)^{-1}$, with the
/// derivatives $J_c$ coloured like the errors.
pub fn covariance(system: &LinearSystem, data: &Signals) -> Option<Vec<f64>> {
    let mut jacobian = columns(&system.orders, &system.denominator, &data.u);
    let output = combined(&jacobian, &system.coefficients());
    let dynamic = system.dynamic(&jacobian);
    let by = system.denominator.all_pole(&dynamic);
    jacobian.extend((1..=system.orders.poles).map(|k| delayed(&by, k, -1.0)));
    let residuals: Vec<f64> = output.iter().zip(&data.y).map(|(p, y)| p - y).collect();
    let from = system.orders.first();
    let filter = whitening(&residuals[from..], SAMPLES_PER_COEFFICIENT);
    let colour = TransferFunction::monic(vec![1.0], filter[1..].to_vec());
    let coloured = parallel::batch(&jacobian, |c| colour.simulate(c)[from..].to_vec());
    let plain: Vec<Vec<f64>> = jacobian.iter().map(|c| c[from..].to_vec()).collect();
    let white = TransferFunction::new(filter, vec![1.0])
        .ok()?
        .simulate(&residuals[from..]);
    let size = jacobian.len();
    let degrees = residuals.len().checked_sub(from + size).filter(|d| *d > 0)?;
    let variance = white.iter().map(|e| e * e).sum::<f64>() / degrees as f64;
    let factor = covariance_factor(&plain, &coloured)?;
    let rows: Vec<&[f64]> = factor.chunks_exact(size).collect();
    let kept = (0..system.orders.numerators()).chain(size - system.orders.poles..size);
    let kept: Vec<f64> = kept.flat_map(|i| rows[i].iter().map(|v| variance.sqrt() * v)).collect();
    let factor = of_polynomials(&system.orders, kept);
    let rows: Vec<&[f64]> = factor.chunks_exact(size).collect();
    let pairs = rows.iter().flat_map(|a| rows.iter().map(|b| dot(a, b)));
    let covariance: Vec<f64> = pairs.collect();
    covariance.iter().all(|c| c.is_finite()).then_some(covariance)
}

/// The rows of a factor for the coefficients of polynomials in the delay, with the integrators in the denominator.
fn of_polynomials(orders: &Orders, factor: Vec<f64>) -> Vec<f64> {
    let d = orders.integrators;
    if d == 0 {
        return factor;
    }
    // The contribution of each coefficient to all polynomials: the columns of the map.
    let size = orders.numerators() + orders.poles + d;
    let mut map: Vec<Vec<f64>> = Vec::new();
    let mut column = |first: usize, polynomial: &[f64]| {
        let mut all = vec![0.0; size];
        all[first..first + polynomial.len()].copy_from_slice(polynomial);
        map.push(all);
    };
    let mut first = 0;
    for input in &orders.inputs {
        (0..input.count).for_each(|k| column(first, &term_polynomial(k, d)));
        first += input.count;
    }
    (0..orders.poles).for_each(|k| column(first + k, &with_integrators(&[1.0], d)));
    let count = map.len();
    let transposed = map.concat();
    let rows: Vec<f64> = (0..size * count)
        .map(|k| transposed[k % count * size + k / count])
        .collect();
    matrix_product(&rows, &factor, count)
}
