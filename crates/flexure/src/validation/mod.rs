//! Does a model hold on data that were not used for its fit?
//!
//! [`FitMeasures`] says how near the prediction is. [`ResidualTests`] says whether the input explains a part of the remaining error.
//! [`PairedComparison`] says which of two models predicts better. [`estimate_initial_state`] removes the effect of the unknown initial
//! state from a comparison. [`predict_ahead`] uses the measured output up to some samples ago.

mod ahead;
mod comparison;
mod initial;
mod measures;
mod output_functions;
mod regression;
mod residuals;
mod test;
mod whiteness;

pub use ahead::predict_ahead;
pub use comparison::PairedComparison;
pub use initial::{InitialState, estimate_initial_state, estimate_initial_state_of_inputs};
pub use measures::FitMeasures;
pub use residuals::{Correlations, LEVEL, ResidualTests};
pub use test::{Estimated, ResidualTest, TestKind};
pub(crate) use whiteness::whiteness;
