//! Standard errors of the coefficients.

use super::super::block::{Signals, UnitDiagonal, delayed, matrix_product, normal_equations};
use super::system::{LinearSystem, columns, combined};
use crate::linear::TransferFunction;
use crate::linear::autoregression::{SAMPLES_PER_COEFFICIENT, whitening};
use crate::parallel;

/// The covariance of the numerators' coefficients, input after input, and then those of the denominator behind its leading 1, row by row;
/// `None` where the samples do not determine them.
///
/// That of the output error under coloured noise (Ljung 1999, equation 9.42): $\sigma^2 (J'J)^{-1} J_c'J_c (J'J)^{-1}$, with the
/// derivatives $J_c$ coloured as the errors are.
pub fn covariance(system: &LinearSystem, data: &Signals) -> Option<Vec<f64>> {
    let mut jacobian = columns(&system.orders, &system.denominator, &data.u);
    let output = combined(&jacobian, &system.coefficients());
    let dynamic: Vec<f64> = output.iter().map(|y| y - system.offset).collect();
    let by = system.denominator.all_pole(&dynamic);
    jacobian.extend((1..=system.orders.poles).map(|k| delayed(&by, k, -1.0)));
    let residuals: Vec<f64> = output.iter().zip(&data.y).map(|(p, y)| p - y).collect();
    let from = system.orders.first();
    let filter = whitening(&residuals[from..], SAMPLES_PER_COEFFICIENT);
    let colour = TransferFunction::monic(vec![1.0], filter[1..].to_vec());
    let plain = normal_equations(&residuals, &jacobian, from);
    let coloured = parallel::batch(&jacobian, |c| colour.simulate(c));
    let coloured = normal_equations(&residuals, &coloured, from);
    let white = TransferFunction::new(filter, vec![1.0])
        .ok()?
        .simulate(&residuals[from..]);
    let size = jacobian.len();
    let degrees = residuals.len().checked_sub(from + size).filter(|d| *d > 0)?;
    let variance = white.iter().map(|e| e * e).sum::<f64>() / degrees as f64;
    let inverse = UnitDiagonal::new(&plain).inverse()?;
    let half = matrix_product(&inverse, &coloured.normal, size);
    let whole = matrix_product(&half, &inverse, size);
    let numerators = system.numerators.iter().map(Vec::len).sum::<usize>();
    let kept: Vec<usize> = (0..numerators).chain(size - system.orders.poles..size).collect();
    let pairs = kept.iter().flat_map(|i| kept.iter().map(move |j| (i, j)));
    let covariance: Vec<f64> = pairs.map(|(i, j)| variance * whole[i * size + j]).collect();
    covariance.iter().all(|c| c.is_finite()).then_some(covariance)
}
