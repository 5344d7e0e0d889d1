//! The regression of one column on others: its fit, its band and its warnings, as text, JSON and page.
//!
//! A [`Regression`] is the fit. [`Report`] adds what a reader needs in addition: how well the fit predicts rows that it did not use, the
//! curve with its band, and the warnings.

mod band;
mod data;
mod dependence;
mod diagnosis;
mod evaluation;
mod outliers;
mod page;
mod report;
mod streamed;
mod text;
mod validation;
mod warnings;

use flexure::nonlinearity::{NamedEstimator, NamedFit, Tuning};

use crate::Spelling;
use warnings::Subject;

pub use band::{BandMethod, BandOptions};
pub use data::{Columns, RegressionData};
pub use diagnosis::Diagnosis;
pub use evaluation::{BandDescription, Evaluation};
pub use outliers::without_outliers;
pub use page::html;
pub use report::Report;
pub use streamed::{Streamed, StreamedReport};
pub use validation::Validation;

/// A fitted regression.
pub struct Regression {
    /// The estimator, with the parameter as given.
    pub estimator: NamedEstimator,
    /// The fit.
    pub fit: NamedFit,
}

impl Regression {
    /// Fits the estimator.
    pub fn new(estimator: NamedEstimator, data: &RegressionData) -> flexure::Result<Self> {
        let fit = estimator.fit(&data.x, data.y, data.weights)?;
        Ok(Regression { estimator, fit })
    }

    /// Fits the estimator with a parameter that its rule chose earlier.
    pub fn with_chosen(estimator: NamedEstimator, parameter: Vec<f64>, data: &RegressionData) -> flexure::Result<Self> {
        let fixed = NamedEstimator {
            tuning: Tuning::Fixed(parameter),
            ..estimator.clone()
        };
        let fit = fixed.fit(&data.x, data.y, data.weights)?;
        Ok(Regression { estimator, fit })
    }

    /// Warnings about the fit that hold for all points of evaluation, one sentence each.
    pub fn warnings(&self, data: &RegressionData, spelling: Spelling) -> flexure::Result<Vec<String>> {
        let subject = Subject {
            regression: self,
            data,
            diagnosis: &Diagnosis::new(self, data)?,
            evaluation: None,
            spelling,
        };
        Ok(subject.warnings())
    }
}

/// Columns as slices.
fn slices(columns: &[Vec<f64>]) -> Vec<&[f64]> {
    columns.iter().map(Vec::as_slice).collect()
}
