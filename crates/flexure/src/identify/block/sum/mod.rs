//! Sums of cascades of one input.

mod search;
mod start;
#[expect(clippy::module_inception)]
mod sum;
mod units;

pub use search::TriedSum;
pub(in crate::identify) use search::{Search, SearchResult};
pub(in crate::identify) use units::InUnits;
pub use units::ParallelBranch;
