//! A weak input beside stronger ones: what these leave of the output depends on it.
//!
//! A pair of columns shows no dependence if another input moves the output far more. So the output's difference equation with the known
//! inputs comes first: past outputs, and past values of every input with their squares and cubes, by least squares. Its error is then tested
//! against further columns as [`dependences`](super::Dependence) are.

use super::coherence::coherent_share;
use super::dependence::{Statistics, TimeScale, Whitened, best, scales, whitened};
use super::limits::{BESIDE_LAGS, BESIDE_PAST, BESIDE_SAMPLES, LAGS};
use crate::linear::correlation::{mean, variance};
use crate::linear::least_squares::least_squares;
use crate::parallel;
use crate::vectors::add;

/// A column that explains more of an output, beside its other inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beside {
    /// Its place among the columns that were tested.
    pub column: usize,
    /// The share of what the other inputs leave that is coherent with it.
    pub coherent: f64,
}

/// Which of the `others` an output depends on beside its inputs, each of which acts after its delay in samples. No sample may be missing.
///
/// All tests together have the level 1 %. A column that depends on the inputs or on the output is no candidate: it may stand for them.
pub fn beside(output: &[f64], inputs: &[(&[f64], usize)], others: &[&[f64]]) -> Vec<Beside> {
    let end = output.len().min(BESIDE_SAMPLES);
    let output = &output[..end];
    let Some(rest) = unexplained(output, inputs) else {
        return Vec::new();
    };
    let scales = scales(rest.len(), others.len());
    let tests = (others.len() * scales.len() * (LAGS + 1)).max(1) as f64;
    let from = end - rest.len();
    let at = |signal: &[f64], scale: &TimeScale| whitened(&signal[scale.range.clone()], scale.block);
    let found = parallel::map(others.len(), |column| {
        let candidate = &others[column][from..end];
        let both = scales.iter().map(|scale| vec![at(candidate, scale), at(&rest, scale)]);
        let both: Vec<Vec<Whitened>> = both.collect();
        best(&scales, &both, tests, &|c| {
            Statistics::from_zero(c[0].signal.as_ref()?, c[1].signal.as_ref()?)
        })?;
        Some(Beside {
            column,
            coherent: coherent_share(candidate, &rest),
        })
    });
    found.into_iter().flatten().collect()
}

/// The error of the output's difference equation with its inputs, behind the samples that have no past.
fn unexplained(output: &[f64], inputs: &[(&[f64], usize)]) -> Option<Vec<f64>> {
    let from = inputs
        .iter()
        .map(|(_, delay)| delay + BESIDE_LAGS)
        .max()?
        .max(BESIDE_PAST);
    let samples = output.len().checked_sub(from).filter(|n| *n > 0)?;
    let late = |signal: &[f64], lag: usize| signal[from - lag..output.len() - lag].to_vec();
    let mut columns: Vec<Vec<f64>> = (1..=BESIDE_PAST).map(|lag| late(output, lag)).collect();
    for (input, delay) in inputs {
        let (level, spread) = (mean(input), variance(input).sqrt().max(f64::MIN_POSITIVE));
        for power in 1..=3 {
            let raised: Vec<f64> = input.iter().map(|u| ((u - level) / spread).powi(power)).collect();
            columns.extend((0..BESIDE_LAGS).map(|lag| late(&raised, delay + lag)));
        }
    }
    columns.push(vec![1.0; samples]);
    let mut rest = late(output, 0);
    let found = least_squares(&rest, &columns, 0)?;
    for (coefficient, column) in found.coefficients.iter().zip(&columns) {
        add(&mut rest, -coefficient, column);
    }
    Some(rest)
}
