//! A model is blocks in series or in parallel; a block is a static nonlinearity or a linear system.
//!
//! Hammerstein is `Series[Static, Linear]`, Wiener `Series[Linear, Static]`, a sandwich
//! `Series[Linear, Static, Linear]`, a sum of sandwiches `Parallel[Series[..], ..]`: values of one
//! type, so that simulating, saving and exporting is one walk over it.

use serde::{Deserialize, Serialize};

use crate::linear::TransferFunction;
use crate::nonlinearity::Curve;

/// A block, or several in series or in parallel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Block {
    /// A memoryless nonlinearity.
    Static(Curve),
    /// A linear, time-invariant, discrete-time system.
    Linear(TransferFunction),
    /// Blocks in cascade, the input entering the first.
    Series(Vec<Block>),
    /// Blocks that share their input and whose outputs add up.
    Parallel(Vec<Block>),
}

impl Block {
    /// The free-run response to `input`, one value a sample.
    ///
    /// Every linear block starts in the steady state that belongs to the mean of its input.
    pub fn simulate(&self, input: &[f64]) -> Vec<f64> {
        match self {
            Block::Static(curve) => input.iter().map(|&u| curve.value(u)).collect(),
            Block::Linear(system) => system.simulate_from_mean(input),
            Block::Series(blocks) => {
                let mut signal = input.to_vec();
                for block in blocks {
                    signal = block.simulate(&signal);
                }
                signal
            }
            Block::Parallel(blocks) => {
                let mut sum = vec![0.0; input.len()];
                for block in blocks {
                    for (total, value) in sum.iter_mut().zip(block.simulate(input)) {
                        *total += value;
                    }
                }
                sum
            }
        }
    }

    /// The samples after which the response no longer depends on the state at the start, to `share`
    /// of its size: the longest cascade's sum of its linear blocks' settling times.
    pub fn settling(&self, share: f64) -> usize {
        match self {
            Block::Static(_) => 0,
            Block::Linear(system) => system.settling(share),
            Block::Series(blocks) => blocks.iter().map(|b| b.settling(share)).sum(),
            Block::Parallel(blocks) => blocks.iter().map(|b| b.settling(share)).max().unwrap_or(0),
        }
    }
}
