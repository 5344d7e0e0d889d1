//! Every threshold of the reference models. A convention is a choice that no reference or measurement decided.

// Ridge regression.

/// Penalties that are tried, relative to the number of samples: from the first, each this many times the one before. Conventions.
pub(super) const SMALLEST_PENALTY: f64 = 1e-10;
pub(super) const PENALTY_FACTOR: f64 = 10.0;
pub(super) const PENALTIES: usize = 11;
/// A column is constant if its variance is at most this share of its mean square. Rounding.
pub(super) const CONSTANT_COLUMN: f64 = 1e-12;

// NARX.

/// Largest number of past outputs, extra past inputs, and degrees that are tried. They bound the time.
pub(super) const MOST_PAST_OUTPUTS: usize = 5;
pub(super) const MORE_PAST_INPUTS: usize = 2;
pub(super) const LARGEST_DEGREE: usize = 3;
/// Structures with more monomials are not tried. It bounds the time.
pub(super) const MOST_TERMS: usize = 230;
/// At most this many samples, the last ones, are fitted. They bound the time.
pub(super) const NARX_SAMPLES: usize = 20_000;
/// The share of the fit's samples for the choice of lags, degree and penalty. Convention.
pub(super) const CHOICE_SHARE: f64 = 0.25;
/// Penalties above the one of generalised cross-validation that are tried. Convention.
pub(super) const LARGER_PENALTIES: usize = 4;

// Volterra series.

/// Memories of both orders that are tried; the second order is tried with the best memory of the first. They bound the time: at most 371
/// columns.
pub(super) const FIRST_MEMORIES: [usize; 4] = [20, 40, 80, 160];
pub(super) const SECOND_MEMORIES: [usize; 3] = [6, 12, 20];
/// At most this many samples, the last ones, are fitted: fewer than for the NARX model, since there may be more columns.
pub(super) const VOLTERRA_SAMPLES: usize = 15_000;
/// The prior standard deviation of the constant, for outputs of unit variance: so large that it has no effect.
pub(super) const CONSTANT_DEVIATION: f64 = 1e4;
/// The search for the prior's parameters: first steps of ln c and of ln(lambda/(1 - lambda)), the last steps as a share of these, and the
/// most rounds. Conventions.
pub(super) const FIRST_STEPS: [f64; 2] = [2.0, 1.0];
pub(super) const LAST_STEP: f64 = 0.1;
pub(super) const MOST_ROUNDS: usize = 60;
/// The steps are halved after a round that lowers the deviance by less than this. Convention: far below what chance explains.
pub(super) const LEAST_GAIN: f64 = 0.1;
/// The remaining sum of squares is at least this share of the output's. Rounding.
pub(super) const LEAST_SQUARES: f64 = 1e-12;
/// Bounds of the sizes' and decays' logarithm and logit. Convention; they keep the numbers finite.
pub(super) const LARGEST_LOGARITHMS: [f64; 2] = [30.0, 7.0];
