//! Choosing an estimator's parameters from data (paper, section IX).

mod bandwidth;
mod search;

pub use bandwidth::{BandwidthSearch, Binning, LeaveOneOut, Score, Scoring};
pub use search::{Candidate, Criterion, Search};
pub(crate) use search::{UNDETERMINED, lowest};
