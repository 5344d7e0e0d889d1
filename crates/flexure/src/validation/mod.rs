//! Does a model hold on data that were not used for its fit?
//!
//! [`FitMeasures`] says how near the prediction is, [`ResidualTests`] whether what it leaves behind
//! still carries something that the input explains, [`PairedComparison`] which of two models predicts better.

mod comparison;
mod measures;
mod residuals;

pub use comparison::PairedComparison;
pub use measures::FitMeasures;
pub(crate) use residuals::whiteness;
pub use residuals::{Correlations, LEVEL, ResidualTest, ResidualTests, TestKind};
