//! Choosing an estimator's parameters from data (paper, section IX).

mod bandwidth;

pub use bandwidth::{BandwidthSearch, Score};
