//! Every threshold that the methods share, with its source. A convention is a choice that no reference or measurement decided.

use std::ops::RangeInclusive;

/// The shares of a record that can be kept for the verdict. Convention: a twentieth of a record shows little, and a fit to a tenth of it is
/// poor.
pub(super) const FRESH_SHARES: RangeInclusive<f64> = 0.05..=0.9;
/// The fewest samples for the fit of a block structure. Convention; `hammerstein/limits.rs` says what the paper's method needs.
pub(super) const FEWEST_SAMPLES: usize = 200;

/// An input with at most this many levels has few: a curve is known only at these. Convention.
pub(super) const FEW_LEVELS: usize = 10;
/// Lags at which the input's whiteness is tested. Convention, that of common software.
pub(super) const WHITENESS_LAGS: usize = 25;
/// Autocorrelations of the input below this distort the result less than noise does. Convention.
pub(super) const NEGLIGIBLE_COLOUR: f64 = 0.05;
/// A deviation of at most this share of the largest value is rounding.
pub(super) const CONSTANT: f64 = 1e-12;
/// A larger percentage of the fresh input outside the curve's range is reported. Convention.
pub(super) const MOST_OUTSIDE: f64 = 1.0;
/// Samples that are outside by at most this share of the range are as good as inside. Convention.
pub(super) const SLIGHTLY_OUTSIDE: f64 = 0.01;
/// A model that explains this share of the output's variance may leave an error that is not white. Convention.
pub(super) const NEARLY_ALL: f64 = 0.9;
/// A refuted model that explains this share of the output's variance, a fit of 90 %, does not hold "exactly". Convention.
pub(super) const MOSTLY: f64 = 0.99;
/// Outliers that carry more than this share of the squared error hide the rest of it from the tests. Convention: they then more than triple
/// the error's standard deviation, the scale of the tests.
pub(super) const MOST_OF_THE_ERROR: f64 = 0.9;
/// A misfit of less than this share of the output's standard deviation does not matter, even if it is certain. Convention: it is a third of
/// a line's width in a plot of the output.
pub(super) const NEGLIGIBLE_MISFIT: f64 = 0.01;

/// A pole is kept within this radius. Slower decay is not visible within 10,000 samples.
pub(super) const LARGEST_RADIUS: f64 = 0.9999;
/// Standard deviations from its mean at which the input of a polynomial is clipped. Otherwise a high power of a heavy tail would depend on
/// a few samples. Convention: 0.3 % of a normal input.
pub(super) const CLIP: f64 = 3.0;
