//! Choosing an estimator's parameters from data (paper, section IX).

mod bandwidth;
mod search;

pub use bandwidth::{BandwidthSearch, Score};
pub use search::{Candidate, Criterion, Search};
pub(crate) use search::{UNDETERMINED, lowest};
