//! Every threshold of a single structure; those of the search are in `block/limits.rs`. A convention is a choice that no reference
//! or measurement decided.

use super::super::block::StopRule;

// Linear systems.

/// The fewest samples for the fit of a linear system, and further ones for every input. Convention.
pub const FEWEST_SAMPLES: usize = 50;
pub const FEWEST_SAMPLES_AN_INPUT: usize = 10;

// Wiener systems.

/// Lags of the impulse responses from higher moments, and the samples that a lag needs. Conventions.
pub const MOMENT_LAGS: usize = 80;
pub const SAMPLES_PER_MOMENT_LAG: usize = 20;
/// Samples for the moments. They bound the time.
pub const MOMENT_SAMPLES: usize = 20_000;
/// Slices of the output, of as many samples each (Li 1991). Convention.
pub const SLICES: usize = 20;
/// Added to the input's variance, as a share: narrow-band inputs are not whitened without limit. Convention: 40 dB.
pub const WHITENING_RIDGE: f64 = 1e-4;
/// Rows whose products are summed at a time, few enough for the processor's cache.
pub const ROWS_TOGETHER: usize = 64;
/// The end of a finite impulse response's refinement; the response is only a start.
pub const IMPULSE_RESPONSE: StopRule = StopRule::new(15, 1e-3);
/// Rational fronts that are kept, the best by Schwarz's criterion. They bound the time.
pub const MOST_FRONTS: usize = 4;
/// The samples that are subtracted from the delay of the first dependence, for the numerators. Convention.
pub const DELAY_SLACK: usize = 2;

// Hammerstein-Wiener systems.

/// A line through f that explains less than this share of its spread does not fix its scale. Convention.
pub const NO_LINE: f64 = 0.1;

// Sums of branches.

/// Most branches that are tried if their number is not given. They bound the time.
pub const MOST_CHOSEN_BRANCHES: usize = 3;
/// Most branches that can be asked for. Convention.
pub const MOST_BRANCHES: usize = 5;
/// Samples for the search of the delay. They bound the time.
pub const DELAY_SAMPLES: usize = 10_000;
