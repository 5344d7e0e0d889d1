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
            Block::Parallel(blocks) => added(blocks.iter().map(|b| b.simulate(input)), input.len()),
        }
    }

    /// The number of states of all linear blocks.
    pub fn states(&self) -> usize {
        match self {
            Block::Static(_) => 0,
            Block::Linear(system) => system.states(),
            Block::Series(blocks) | Block::Parallel(blocks) => blocks.iter().map(Block::states).sum(),
        }
    }

    /// What enters every linear block on average over a free run under `input`, in the order in which the blocks stand.
    pub(crate) fn levels(&self, input: &[f64], levels: &mut Vec<f64>) -> Vec<f64> {
        match self {
            Block::Static(_) => self.simulate(input),
            Block::Linear(system) => {
                levels.push(input.iter().sum::<f64>() / input.len().max(1) as f64);
                system.simulate_from_mean(input)
            }
            Block::Series(blocks) => (blocks.iter()).fold(input.to_vec(), |signal, b| b.levels(&signal, levels)),
            Block::Parallel(blocks) => added(blocks.iter().map(|b| b.levels(input, levels)), input.len()),
        }
    }

    /// The response to `input` where every linear block starts in the steady state that belongs to its level, plus its
    /// states ([`TransferFunction::simulate_from`]); both in the order in which the blocks stand.
    pub(crate) fn simulate_from(&self, input: &[f64], levels: &mut &[f64], states: &mut &[f64]) -> Vec<f64> {
        match self {
            Block::Static(_) => self.simulate(input),
            Block::Linear(system) => {
                let (level, others) = levels.split_first().unwrap_or((&0.0, &[]));
                let (own, rest) = states.split_at(system.states().min(states.len()));
                (*levels, *states) = (others, rest);
                system.simulate_from(input, *level, own)
            }
            Block::Series(blocks) => {
                (blocks.iter()).fold(input.to_vec(), |signal, b| b.simulate_from(&signal, levels, states))
            }
            Block::Parallel(blocks) => {
                let each = blocks.iter().map(|b| b.simulate_from(input, levels, states));
                added(each, input.len())
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

/// The sum of signals.
fn added(signals: impl Iterator<Item = Vec<f64>>, samples: usize) -> Vec<f64> {
    let mut sum = vec![0.0; samples];
    for signal in signals {
        sum.iter_mut().zip(signal).for_each(|(total, value)| *total += value);
    }
    sum
}
