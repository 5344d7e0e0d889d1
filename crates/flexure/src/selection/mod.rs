//! Choosing an estimator's parameters from data (paper, section IX).
//!
//! # The bandwidth of a kernel estimate
//!
//! [`choose_bandwidth`] chooses it by any [`BandwidthRule`]. The score of every candidate is part of the [`BandwidthChoice`].
//!
//! | rule | when | cost for n points and a bandwidth | reference |
//! |---|---|---|---|
//! | [`LeaveOneOut`](BandwidthRule::LeaveOneOut) | the default: independent errors, or an input without memory | O(n) | Stone (1974) |
//! | [`Generalized`](BandwidthRule::Generalized) | the same; ties and single points in the windows disturb it less | O(n) | Craven and Wahba (1979) |
//! | [`HBlock`](BandwidthRule::HBlock) | a slow input and dependent errors: samples that are close in x are so in time, and leave-one-out undersmooths | O(n gap) | Chu and Marron (1991); Burman, Chow and Nolan (1994) |
//! | [`PlugIn`](BandwidthRule::PlugIn) | a smooth m and the local line: varies less from sample to sample, and is the fastest | one pass in all | Ruppert, Sheather and Wand (1995) |
//! | [`WildBootstrap`](BandwidthRule::WildBootstrap) | the error at the points themselves, where the noise depends on x | O(n) | Haerdle and Marron (1991) |
//! | [`BlockBootstrap`](BandwidthRule::BlockBootstrap) | the same, with dependent errors | O(n replicates) | Kuensch (1989) |
//!
//! If m has kinks or jumps as well as smooth pieces, no single bandwidth is right. [`LocalKernel`](crate::nonlinearity::LocalKernel) has
//! one for every point, by Lepski's rule or by plug-in.
//!
//! # Any other parameter
//!
//! | method | when | reference |
//! |---|---|---|
//! | [`Search`] by [`Criterion::LeaveOneOut`] or [`Criterion::Generalized`] | the estimators' own choice, without refits | Craven and Wahba (1979) |
//! | [`BlockFolds`] | dependent errors; any [`Estimator`](crate::nonlinearity::Estimator), by refits | Burman, Chow and Nolan (1994); Racine (2000) |

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
pub(crate) mod test_data;

pub use bandwidth::{BandwidthSearch, Binning, LeaveOneOut, Score, Scoring};
pub use folds::{BlockFolds, FoldScore, FoldSearch, Tunable};
pub(crate) use generalized::{generalized, generalized_score};
pub(crate) use grid::{Grid, bulk};
pub(crate) use plug_in::{Bend, WithBend, canonical};
pub use rule::{BandwidthChoice, BandwidthRule, choose_bandwidth};
pub use search::{Criterion, ScoredParameter, Search};
pub(crate) use search::{FLAT, OpenEnds, UNDETERMINED, lowest};
