//! Every threshold of the comparison of structures. A convention is a choice that no reference or measurement decided.

/// Robust standard deviations at which errors are cut before they are compared. Convention: normal errors are not cut.
pub(super) const CUT: f64 = 6.0;
/// A mean squared error larger by less than this share is as good: the candidates' own estimation errors differ. Convention.
pub(super) const AS_GOOD: f64 = 0.02;
/// Of the error's variance, what a general function of the input may explain if the error is to be called noise. Convention.
pub(super) const NEAR_NOISE: f64 = 0.1;
/// The share of the output's variance that a candidate explains if its error is to be called small. A right structure with much
/// noise is not refuted in the first place, and of a wrong one's large error the regression may find little. Convention.
pub(super) const MOST_EXPLAINED: f64 = 0.9;

/// The error's regression: lags of every signal. Convention.
pub(super) const LAGS: usize = 12;
/// The error's regression: samples of a half that a regressor needs. Convention.
pub(super) const SAMPLES_PER_REGRESSOR: usize = 10;
/// The error's regression: standard deviations at which input and prediction are cut. Their cubes depend on few samples else. Convention.
pub(super) const MODERATE: f64 = 4.0;
/// The error's regression: added to the regressors' variance, as a share. Rounding.
pub(super) const RIDGE: f64 = 1e-6;
