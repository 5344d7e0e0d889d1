//! Every threshold of the fit of a surface, in the order of its steps. A convention is a choice that no reference or measurement decided.

// The starts.

/// Largest degree of the polynomials, for two inputs and for more. Convention: 14 products of two inputs, 19 of three.
pub(super) const DEGREES: [usize; 2] = [4, 3];
/// How many lags are tried together, and the samples of the search for lags. They bound the time.
pub(super) const LAGS_TOGETHER: usize = 3;
pub(super) const LAG_SAMPLES: usize = 3_000;

// Structure.

/// Samples for the choice of structure and pieces. They are fewer than for curves: the equations have up to 441 columns.
pub(super) const STRUCTURE_SAMPLES: usize = 15_000;
/// Pieces along every axis at the start, for two, three and four inputs, and those that are tried after that. Convention: at most 441,
/// 512 and 625 coefficients.
pub(super) const FIRST_PIECES: [usize; 3] = [6, 2, 1];
pub(super) const PIECES: [&[usize]; 3] = [&[4, 9, 13, 18], &[1, 3, 5], &[2]];
/// The fewest samples for a coefficient. Convention; the penalties hold coefficients that the samples do not determine.
pub(super) const SAMPLES_PER_COEFFICIENT: usize = 6;
/// How many numbers of pieces in a row are tried although the score rises: one less than for curves, since the next number has about twice
/// the coefficients, and its equations take eight times as long.
pub(super) const WORSE_PIECES: usize = 2;
/// Rounds of linear structure and surface in turn. Convention.
pub(super) const ROUNDS: usize = 2;

// Gauss-Newton steps.

/// Steps that judge a change, and those of the last fit. They bound the time.
pub(super) const TRIAL_STEPS: usize = 3;
pub(super) const LAST_STEPS: usize = 8;
/// Halvings of a step that does not lower the cost. Convention.
pub(super) const HALVINGS: usize = 8;
/// A step that changes the sum of squares by at most this share is the last. Convention.
pub(super) const LEAST_FALL: f64 = 1e-6;
/// Samples whose columns are in memory at a time.
pub(super) const SEGMENT: usize = 8192;
/// The effect of samples before a segment has fallen to this share. Convention.
pub(super) const FORGOTTEN: f64 = 1e-7;

// The penalties.

/// Their first weights. Convention.
pub(super) const FIRST_WEIGHT: f64 = 1e-2;
/// Most steps. Convention; they settle earlier.
pub(super) const PENALTY_STEPS: usize = 25;
/// The factor on each step: the formula's steps are too short where penalties grow large.
pub(super) const OVERSTEP: f64 = 1.5;
/// The relative change of the effective parameters at which the penalties have settled. Convention.
pub(super) const SETTLED: f64 = 5e-3;
/// Bounds of the penalties, relative to the information that the data have of a coefficient on average. Convention.
pub(super) const PENALTIES: [f64; 2] = [1e-7, 1e5];
/// Holds directions that neither data nor penalty determine. Rounding.
pub(super) const RIDGE: f64 = 1e-9;
/// Eigenvalues of a penalty below this share of the largest are zero, the remaining sum of squares is at least this share of the output's,
/// and a penalty takes at least this part of a parameter. Rounding.
pub(super) const ZERO_EIGENVALUE: f64 = 1e-10;
pub(super) const LEAST_SQUARES: f64 = 1e-14;
pub(super) const LEAST_SHARE: f64 = 1e-12;
