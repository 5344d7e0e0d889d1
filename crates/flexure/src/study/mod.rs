//! Experiments on the algorithms themselves.
//!
//! [`rates`] measures how fast the plain estimator converges and compares this with Theorems 1 and 2. [`estimators`] compares every
//! estimator of a static nonlinearity with its theory. [`refined`] does the same for the refined identification.
//!
//! A [`Study`] is a list of [`Experiment`]s. Its [`Checkpoint`] can be saved and resumed.

pub mod estimators;
mod fit;
mod plan;
pub mod rates;
pub mod refined;
mod sample;
mod setting;
mod table;

pub use estimators::{ErrorNorm, EstimatorSetting, EstimatorStudy, Method, Regressand, Schedule};
pub use plan::{Checkpoint, Experiment, FEWEST_RUNS, LONGEST, MOST_RUNS, OneRun, SHORTEST, Study};
pub use rates::RateStudy;
pub use refined::{RefinedSetting, RefinedStudy};
pub use setting::{Bandwidth, DataSource, Input, Norm, Setting, Target};
pub use table::{FINITE_SAMPLES, LEVEL, RatePoint, RateResult, RateTable};
