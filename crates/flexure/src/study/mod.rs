//! Experiments on the algorithms themselves.
//!
//! [`rates`] measures how fast the plain estimator converges and puts that beside Theorems 1 and 2.

mod fit;
pub mod rates;
mod sample;
mod setting;
mod table;

pub use rates::{Checkpoint, RateStudy};
pub use setting::{Bandwidth, Data, Input, Norm, Setting, Target};
pub use table::{FINITE_SAMPLES, LEVEL, RatePoint, RateResult, RateTable};
