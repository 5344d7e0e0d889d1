//! Every threshold of the comparison of structures. A convention is a choice that no reference or measurement decided.

/// With more fitted samples, all structures are compared only where they are asked for. Convention: such a comparison can take minutes.
pub(super) const MOST_COMPARED: usize = 50_000;
/// If a larger percentage of the fresh input lies outside the fitted range, the fresh part says little about the structure. Convention.
pub(super) const MOST_ELSEWHERE: f64 = 10.0;

/// Robust standard deviations at which errors are cut before they are compared. Convention: normal errors are not cut.
pub(super) const CUT: f64 = 6.0;
/// A mean squared error that is larger by less than this share counts as equal: the candidates' estimation errors differ. Convention.
pub(super) const TOLERATED_SHARE: f64 = 0.02;
/// A misfit below this share of the output's standard deviation is not worth a search for a loop or parallel branches, which take longest.
/// Convention: a tenth of what is negligible.
pub(super) const TRIFLING_MISFIT: f64 = 0.001;
/// From this share of the error that follows from its own past on, a loop is fitted although something simpler holds. Convention: most of it.
pub(super) const COLOURED: f64 = 0.5;
/// A fit above this, in percent, leaves too little for that. Convention.
pub(super) const NEARLY_ALL: f64 = 98.0;

/// The error's regression: lags of every signal. Convention.
pub(super) const LAGS: usize = 12;
/// The error's regression: samples of a half that a regressor needs. Convention.
pub(super) const SAMPLES_PER_REGRESSOR: usize = 10;
/// The error's regression: standard deviations at which input and prediction are cut. Otherwise their cubes would depend on few samples.
/// Convention.
pub(super) const MODERATE: f64 = 4.0;
/// The error's regression: added to the regressors' variance, as a share. Rounding.
pub(super) const RIDGE: f64 = 1e-6;

/// A symptom is named from this share of the squared error on. Convention.
pub(super) const SEEN: f64 = 0.1;
/// Blocks of the fresh samples; a symptom is fitted to every other one. Convention.
pub(super) const DRIFT_BLOCKS: usize = 20;
/// Half widths of plays that act on the prediction, in its standard deviations. Convention.
pub(super) const PLAYS: [f64; 4] = [0.2, 0.5, 1.0, 1.6];
/// A sample of the error is far from all others from this many robust standard deviations on: normal noise never reaches it.
pub(super) const OUTLIERS_FROM: f64 = 8.0;
