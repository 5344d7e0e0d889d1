//! Every threshold of the refined method, with its source. A convention is a choice that no reference or measurement decided.
//! "By the benchmark" means: chosen for the errors in `benches/refined.rs`, over its 8 nonlinearities, 2 linear parts and 4 inputs.

use crate::identify::block::StopRule;

/// The start: the most samples for the plain estimate. Convention; the start need not be exact.
pub(super) const START_SAMPLES: usize = 40_000;
/// Samples after the impulse response has settled that do not count at the start of an experiment. Convention.
pub(super) const AFTER_SETTLING: usize = 30;
/// An experiment's unknown initial state costs at most one sample in this many. Convention.
pub(super) const SAMPLES_PER_UNCOUNTED: usize = 10;
/// The fewest samples after which a response is said to have settled. Convention.
pub(super) const SHORTEST_MEMORY: usize = 10;
/// A response has settled when this share of it remains. Convention.
pub(super) const SETTLED_RESPONSE: f64 = 0.01;
/// An initial state of the output's usual size counts as forgotten when it is this share of the noise. Convention. With 1 % of the output as
/// the only limit, the heaters of a control loop that starts cold had kinks 3 to 4 standard errors from the truth.
pub(super) const UNSEEN_START: f64 = 0.1;
/// The plain estimate's error on its own samples may be smaller than the refined one's by this share, plus this number over the samples: it
/// follows the samples' noise with more parameters. Convention.
pub(super) const OVERFITTED: f64 = 0.02;
pub(super) const OVERFITTED_SAMPLES: f64 = 20.0;

/// Alternation: most passes, and the Levenberg-Marquardt steps of a pass and of the last one. By the benchmark.
pub(super) const PASSES: usize = 6;
pub(super) const STEPS: usize = 3;
pub(super) const LAST_STEPS: usize = 100;
/// Alternation: a pass is the last if it lowers the noise's deviation by at most this share, and moves no breakpoint by more than this
/// distance in the unit coordinate. Convention.
pub(super) const UNCHANGED_NOISE: f64 = 2e-4;
pub(super) const UNCHANGED_PLACE: f64 = 0.02;
/// Alternation: most samples of the whitened impulse response, for its energy. Convention.
pub(super) const LONGEST_RESPONSE: usize = 2000;
/// Alternation: an autocorrelation of the input counts from this many standard deviations of white noise on. Convention: for a white input
/// and 2000 lags, one exceeds this in a thousandth of the records.
pub(super) const SEEN_CORRELATION: f64 = 5.0;

/// Output error: another start is tried if a free run leaves this share of the output's variance. Convention: noise at 10 dB.
pub(super) const POOR: f64 = 0.1;
/// Output error: samples and fits of the changes of a branch to the order and the delay that the user gave. Conventions.
pub(super) const BRANCH_SAMPLES: usize = 5_000;
pub(super) const BRANCH_CHANGE: StopRule = StopRule::new(12, 1e-4);

/// Output error: a free run without whitening is better if its squared error is below this share of the first one's. Convention.
pub(super) const HIDDEN: f64 = 0.9;

/// Order: lags before the supposed delay that are looked at. Convention.
pub(super) const LAGS_BEFORE_DELAY: usize = 12;
/// Order: orders beyond the best that are tried. Convention: a pair of poles may only pay together.
pub(super) const ORDERS_BEYOND: usize = 2;

/// Structure: samples for changes of the linear part, the steps of each change, and how often the other parameters are fitted again after
/// changes. Conventions; they bound the time.
pub(super) const STRUCTURE_SAMPLES: usize = 10_000;
pub(super) const CHANGE_STEPS: usize = 12;
pub(super) const CHANGES: usize = 3;
/// Structure: the least decrease of Schwarz's criterion by a change. Convention: many are tried, and some lower it by chance.
pub(super) const CHANGE_GAIN: f64 = 20.0;

/// Cells: the most cells for the samples. Convention: a place is then known to 0.07 % of the samples.
pub(super) const MOST_CELLS: usize = 1500;
/// Cells: the fewest samples of a cell, except for equal values. Convention.
pub(super) const FEWEST_IN_CELL: usize = 3;

/// Basis: the least gain of a function with a searched breakpoint, in noise variances. About 2 ln of the number of candidates (Foster &
/// George 1994), which is 17 for 4500.
pub(super) const ENTRY_COST: f64 = 20.0;
/// Basis: the share of a function with a searched breakpoint in the estimated risk. With its search, it counts as about four parameters
/// (Friedman 1991) of two variances each; 10 by the benchmark.
pub(super) const SEARCHED_COST: f64 = 10.0;
/// Basis: the same share for a function with a given breakpoint. Mallows' C_p has 2; 2.5 by the benchmark.
pub(super) const GIVEN_COST: f64 = 2.5;
/// Basis: the least advantage of given breakpoints over searched ones. By the benchmark.
pub(super) const GIVEN_MARGIN: f64 = 4.0;
/// Basis: a search among cubic knots alone is tried if evenly placed knots are worse by at most the cost of this many searched functions.
/// Convention.
pub(super) const NEARLY_SMOOTH: f64 = 2.0;
/// Basis: the numbers of evenly placed knots that are tried. Convention: each about a quarter more than the one before.
pub(super) const EVEN_KNOTS: [usize; 14] = [1, 2, 3, 5, 7, 9, 11, 14, 17, 21, 26, 32, 40, 50];
/// Basis: the number of powers without cost: those up to the cube.
pub(super) const FREE_POWERS: u8 = 4;
/// Basis: the cells for each evenly placed knot. Convention.
pub(super) const CELLS_PER_KNOT: usize = 4;
/// Basis: the cells on either side in which a jump may move. Convention.
pub(super) const JUMP_REACH: usize = 3;

/// Filtered: filtered functions are compared if correlation raises the variance of the memory-removed output's noise by more than this
/// factor (D). Convention.
pub(super) const DEPENDENT_NOISE: f64 = 1.5;
/// Filtered: samples for the choice, places of each kind of breakpoint, and how many places on either side are tried when a breakpoint
/// moves. Conventions; they bound the time.
pub(super) const FILTERED_SAMPLES: usize = 10_000;
pub(super) const FILTERED_PLACES: usize = 32;
pub(super) const MOVED_PLACES: usize = 4;
/// Filtered: the fewest cells between a place that is not by rank and the one before it. Convention: with one or two, the curve is hardly determined between
/// breakpoints. With the same condition towards the next place, one of six simulated heaters had no place near its kink.
pub(super) const CELLS_BETWEEN: usize = 3;
/// Filtered: the least gain of a jump, in noise variances: twice that of other functions, since a few samples can look like a jump.
/// Convention.
pub(super) const JUMP_COST: f64 = 40.0;

/// Stepwise: most functions of a basis. Convention; it bounds the time.
pub(super) const MOST_TERMS: usize = 40;
/// Stepwise: a candidate counts as a combination of the terms if they leave at most this share of its squared norm. The underlying running
/// sums are exact to about 1e-12.
pub(super) const DEPENDENT: f64 = 1e-9;
/// Stepwise: the same for a term that is orthogonalised twice, which is exact to rounding.
pub(super) const ROUNDING: f64 = 1e-13;
/// Stepwise: forward steps continue while the gain exceeds this share of a function's cost, since two may be worth their cost only
/// together. Convention.
pub(super) const PATIENCE: f64 = 0.4;
/// Stepwise: the fewest samples on either side of a jump. Convention.
pub(super) const FEWEST_AT_JUMP: f64 = 5.0;
/// Stepwise: the most breakpoints that are moved, and the most sweeps over them. Convention; it bounds the time.
pub(super) const MOST_MOVED: usize = 16;
pub(super) const SWEEPS: usize = 4;

/// Stepwise: a breakpoint moves only if that improves the criterion by more than this share, ten times the effect of rounding.
pub(super) const LEAST_GAIN: f64 = 1e-9;

/// Descent: a step that lowers the sum of squares by at most this share is the last. Convention.
pub(super) const LEAST_FALL: f64 = 1e-7;
/// Descent: the damping of the first step, in units of the scaled equations' diagonal: very small, since the start is near. It is
/// multiplied by `DAMPING_AFTER_FALL` after a step that lowers the sum of squares, and otherwise by `DAMPING_AFTER_RISE`, to at least
/// `LEAST_RAISED`. The search ends above `MOST_DAMPING`. Conventions.
pub(super) const FIRST_DAMPING: f64 = 1e-7;
pub(super) const DAMPING_AFTER_FALL: f64 = 0.1;
pub(super) const DAMPING_AFTER_RISE: f64 = 30.0;
pub(super) const LEAST_RAISED: f64 = 1e-5;
pub(super) const MOST_DAMPING: f64 = 1e4;

/// Loss: samples in a chunk, so that their rows stay in the cache.
pub(super) const CHUNK: usize = 256;
/// Loss: rows of the Jacobian that are added to the equations at a time, which saves passes over the matrix.
pub(super) const ROWS: usize = 4;

/// Shards: a step that lowers the squared error by no more than this share of an error's variance, and so is no longer than a hundredth of
/// a standard error, is not taken. Convention.
pub(super) const LEAST_STEP: f64 = 1e-4;
/// Shards: the most sums over all of them. Convention: the start is near, and each sum reads the record once.
pub(super) const MOST_SUMS: usize = 20;

/// Kinks: one nearer than this to another breakpoint, in the unit coordinate, may be superfluous. Convention: a tenth of the input's range.
pub(super) const CROWDED: f64 = 0.2;
/// Kinks: one that is fewer standard errors from the next breakpoint or end is removed on trial. Convention.
pub(super) const CLEARLY: f64 = 5.0;
/// Kinks: moves of all kinks at once. Convention; each is a Gauss-Newton step, and the start is near.
pub(super) const KINK_MOVES: usize = 12;
/// Kinks: the shares of a step that are tried until the error falls. Convention.
pub(super) const SHARES_OF_STEP: [f64; 3] = [1.0, 0.5, 0.25];

/// Result: beyond the data the curve continues straight if each of its two end pieces has this share of the samples. Convention: a few
/// samples do not determine the slope of a piece.
pub(super) const END_SHARE: f64 = 0.05;
/// Result: evenly spaced points of the tabulated nonlinearity. Convention.
pub(super) const POINTS: usize = 401;
/// Result: the distance of the two points on either side of a jump, in the unit coordinate. Convention.
pub(super) const JUMP_WIDTH: f64 = 1e-9;
/// Result: the step of a numerical derivative, in standard errors. Small against the error, large against rounding.
pub(super) const DERIVATIVE_STEP: f64 = 1e-2;
/// Result: added to the unit diagonal of equations that are singular to rounding. Convention.
pub(super) const SINGULAR_RIDGE: f64 = 1e-9;

/// Result: the most breakpoints of one kind that are listed one by one. Convention.
pub(super) const MOST_LISTED: usize = 6;

/// Forms: the level of the test of lack of fit, and the most groups of samples in it. Conventions.
pub(super) const FORM_LEVEL: f64 = 0.01;
pub(super) const FORM_GROUPS: usize = 40;
/// Forms: standard errors by which a place where a form breaks must lie within the data; otherwise it may as well be at their end. Convention.
pub(super) const PLACE_INSIDE: f64 = 2.0;
/// Forms: points of the grid that are refined, and the most steps of each refinement. Conventions.
pub(super) const FORM_STARTS: usize = 4;
pub(super) const FORM_STEPS: usize = 60;
/// Forms: the largest degree of a polynomial. Powers of higher degree cannot be distinguished in double precision.
pub const MOST_DEGREE: usize = 15;
/// Forms: the step of a central difference relative to a parameter, near the third root of rounding; for smaller parameters than the second
/// number, relative to that.
pub(super) const DIFFERENCE_STEP: f64 = 1e-6;
pub(super) const SMALLEST_PARAMETER: f64 = 1e-12;
/// Forms: a quantizer's finer grid has steps of this relative distance around the best of the coarse grid. The coarse grid is geometric
/// with 1 %; the finer one covers that.
pub(super) const FINER_STEP: f64 = 3e-5;
pub(super) const FINER_STEPS: std::ops::RangeInclusive<i32> = -400..=400;
