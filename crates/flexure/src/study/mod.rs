//! Experiments on the algorithms themselves.
//!
//! [`rates`] measures how fast the plain estimator converges and puts that beside Theorems 1 and 2; [`estimators`]
//! does so for every estimator of a static nonlinearity, beside the theory of each.

pub mod estimators;
mod fit;
pub mod rates;
mod sample;
mod setting;
mod table;

pub use estimators::{ErrorNorm, EstimatorSetting, EstimatorStudy, Method, Regressand, Schedule};
pub use rates::{Checkpoint, RateStudy};
pub use setting::{Bandwidth, Data, Input, Norm, Setting, Target};
pub use table::{Experiment, FINITE_SAMPLES, LEVEL, RatePoint, RateResult, RateTable};
