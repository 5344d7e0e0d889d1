//! The preparation of a measured record before an identification.
//!
//! | to | call |
//! |---|---|
//! | find samples that do not belong to their neighbours | [`Outliers::find`] |
//! | bring uneven instants onto a uniform grid | [`Resampling::resample`] |
//! | interpolate short gaps | [`fill`] |
//! | take out what is fast, without a delay | [`LowPass::filter`] |
//! | take out the mean, or a straight line | [`mean`], [`Trend::of`] |
//!
//! A sample that is NaN or infinite is missing. A missing sample is not used and stays missing, unless it is interpolated.
//!
//! ```
//! use flexure::preparation::{LowPass, Outliers, fill};
//!
//! let mut y: Vec<f64> = (0..200).map(|i| (0.05 * i as f64).sin()).collect();
//! y[70] = 40.0; // the encoder lost a bit
//! for sample in Outliers::default().find(&y)? {
//!     y[sample] = f64::NAN;
//! }
//! let y = fill(&y, 3);
//! assert!((y[70] - 3.5_f64.sin()).abs() < 1e-5);
//! let slow = LowPass { cutoff: 5.0, order: 4 }.filter(&y, 0.01)?;
//! assert!((slow[100] - 5.0_f64.sin()).abs() < 1e-3);
//! # Ok::<(), flexure::Error>(())
//! ```

mod interpolation;
mod low_pass;
mod outliers;
mod resampling;
mod trend;

pub use low_pass::LowPass;
pub use outliers::Outliers;
pub use resampling::{Between, Grid, Resampling, fill, nominal_step};
pub use trend::{Trend, mean};

/// The default for the most missing samples in a row that are interpolated. Convention: the error is negligible for a signal with ten
/// samples in a period.
pub const LONGEST_GAP: usize = 3;

#[cfg(test)]
mod reference_tests;
#[cfg(test)]
mod resampling_tests;
