//! Every threshold of the paper's method, with its source. A convention is a choice that no reference or measurement decided.

/// The fewest samples that are fitted. With fewer, the 99 % limit of a correlation, 2.58 / sqrt(n), is above a quarter.
pub const FEWEST_SAMPLES: usize = 100;
/// The largest order that can be asked for. Convention.
pub const MOST_ORDER: usize = 50;
/// The largest order tried when the order is chosen from data. Convention: four modes of vibration.
pub const LARGEST_ORDER: usize = 8;
/// Most lags of the impulse response. Convention; a longer response is reported as not settled.
pub(super) const MOST_LAGS: usize = 1000;
/// The lags take up at most one sample in this many. The covariance at the last lag is then a mean over 80 % of the samples.
pub(super) const SAMPLES_PER_LAG: usize = 5;

/// The delay: the output is correlated with polynomials of the input up to this degree. An even or an odd nonlinearity, and a
/// product of both, correlates with one of the first two; the others are for nonlinearities like a quantizer. Convention.
pub(super) const DEGREES: usize = 4;
/// The delay: the probability that a record without any dependence shows one at some lag. The test
/// `unrelated_signals_show_no_dependence` counts it.
pub(super) const FALSE_ALARM: f64 = 1e-3;
/// The delay: a polynomial counts as a combination of those of lower degree if they leave at most this share of it. Square root of
/// rounding, rounded up.
pub(super) const DEPENDENT: f64 = 1e-6;

/// Correlation: a coefficient above this multiple of the 99 % limit is clear of noise. That is 4.4 standard deviations, which noise
/// exceeds at one of 1000 lags in 1.2 % of all records.
pub(super) const CLEAR: f64 = 1.7;
/// Correlation: below this squared correlation of X and m(X), the output is correlated with m(X) instead of X. The variance of the response
/// from X is that from m(X) divided by the squared correlation, so at most 4 times as large. Convention.
pub(super) const WEAK_CORRELATION: f64 = 0.25;
/// Correlation: a nonlinearity whose variance is at most this share of the output's is constant except for rounding.
pub(super) const CONSTANT: f64 = 1e-20;

/// Coloured input: most lags of a deconvolution, whose cost grows with their cube (300 take some 10 ms). Convention.
pub(super) const MOST_DECONVOLVED: usize = 300;
/// Coloured input: samples for each lag of a deconvolution, an unknown of least squares. Convention.
pub(super) const SAMPLES_PER_UNKNOWN: usize = 10;
/// Coloured input: the share of the variance that is added to the autocovariance before it is inverted. Frequencies at which the
/// input has 50 dB less power than on average are not resolved. Convention.
pub(super) const RIDGE: f64 = 1e-5;
/// Coloured input: most passes that take the other lags out of the regression. Convention; a pass that does not lower the
/// unexplained share of the output is the last.
pub(super) const COLOUR_PASSES: usize = 4;

/// Realisation: most Levenberg-Marquardt steps after the Yule-Walker solution. Convention; it converges in about ten.
pub(super) const REALISATION_STEPS: usize = 50;
/// Realisation: the rows of the Hankel matrix whose singular values are reported. Convention.
pub(super) const HANKEL_ROWS: usize = 20;
/// Realisation: the impulse response has not settled if more than this share of it lies beyond the last lag. Convention.
pub(super) const UNSETTLED: f64 = 0.05;

/// Calibration: a static gain below this share of the impulse response's absolute sum counts as none. Convention: the scale of both blocks
/// would be 50 times their largest values.
pub(super) const SMALLEST_GAIN: f64 = 0.02;
/// Calibration: a static gain of at most this many standard errors also counts as none. Chance exceeds three in 0.3 % of all
/// records.
pub(super) const CLEAR_GAIN: f64 = 3.0;
/// Calibration: the response is summed until at most this share of it remains. Convention.
pub(super) const GAIN_TAIL: f64 = 1e-3;
