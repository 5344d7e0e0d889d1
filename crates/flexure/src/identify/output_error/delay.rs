//! The delay of every input: the lags whose coefficients are zero in a difference equation that leaves white errors.

use super::super::block::{Signals, UnitDiagonal, delayed, pure_delay, regression};
use super::limits::{DELAY_LAGS, DELAY_LEVEL, DELAY_PAST};
use super::system::{Numerator, Orders, lagged};
use crate::distributions::chi_squared_quantile;
use crate::linalg;

/// The delay of every input: the most leading coefficients that are zero together, as far as a test can see.
pub fn delays(data: &Signals) -> Vec<usize> {
    let far = |u: &Vec<f64>| pure_delay(&Signals::of_input(u.clone(), data.y.clone(), data.from));
    let first: Vec<usize> = data.u.iter().map(far).collect();
    let leading = leading(data, &first).unwrap_or_else(|| vec![0; first.len()]);
    first.iter().zip(leading).map(|(far, near)| far + near).collect()
}

/// The leading coefficients behind the lags `first` that are zero.
fn leading(data: &Signals, first: &[usize]) -> Option<Vec<usize>> {
    let orders = Orders {
        poles: DELAY_PAST,
        inputs: first
            .iter()
            .map(|&delay| Numerator {
                delay,
                count: DELAY_LAGS,
            })
            .collect(),
    };
    let mut columns = lagged(&orders, data.u.iter().cloned());
    columns.extend((1..=DELAY_PAST).map(|k| delayed(&data.y, k, -1.0)));
    columns.push(vec![1.0; data.y.len()]);
    let size = columns.len();
    let from = orders.first().max(DELAY_PAST);
    let degrees = data.y.len().checked_sub(from + size).filter(|d| *d > 0)?;
    let equations = regression(&data.y, &columns, from);
    let diagonal = UnitDiagonal::new(&equations);
    let coefficients = diagonal.solve(&equations.descent, |d| d * (1.0 + 1e-12))?;
    let explained: f64 = coefficients.iter().zip(&equations.descent).map(|(c, d)| c * d).sum();
    let variance = (equations.cost - explained).max(0.0) / degrees as f64;
    let inverse = diagonal.inverse()?;
    let zero = |start: usize, count: usize| {
        let b = &coefficients[start..start + count];
        let block: Vec<f64> = (0..count * count)
            .map(|k| variance * inverse[(start + k / count) * size + start + k % count])
            .collect();
        let Some(weighted) = linalg::solve_positive_definite(&block, b) else {
            return false;
        };
        let statistic: f64 = weighted.iter().zip(b).map(|(w, b)| w * b).sum();
        statistic < chi_squared_quantile(1.0 - DELAY_LEVEL, count as f64)
    };
    let of = |i: usize| {
        let start = i * DELAY_LAGS;
        let zeros = (1..=DELAY_LAGS).take_while(|count| zero(start, *count)).count();
        // All of them zero: nothing is seen of this input.
        if zeros == DELAY_LAGS { 0 } else { zeros }
    };
    Some((0..first.len()).map(of).collect())
}
