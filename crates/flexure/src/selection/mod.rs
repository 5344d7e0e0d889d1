//! Choosing an estimator's parameters from data (paper, section IX).

mod bandwidth;
mod bootstrap;
mod folds;
mod generalized;
mod grid;
mod h_block;
mod plug_in;
mod rule;
mod search;
#[cfg(test)]
mod test_data;

pub use bandwidth::{BandwidthSearch, Score};
pub use folds::{BlockFolds, FoldScore, FoldSearch, Tunable};
pub(crate) use grid::bulk;
pub use rule::{BandwidthChoice, BandwidthRule, choose_bandwidth};
pub use search::{Candidate, Criterion, Search};
pub(crate) use search::{UNDETERMINED, lowest};
