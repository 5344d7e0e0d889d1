//! Every threshold of the search for a loop, in the order of its steps. A threshold without a source is a convention: a choice that no
//! reference or measurement decided.

use crate::identify::block::StopRule;

/// At most this many samples, the last ones, are fitted; more only cost memory.
pub const MOST_SAMPLES: usize = 200_000;
/// Samples for the starts, and for the choice of the structure.
pub const START_SAMPLES: usize = 2_500;
pub const STRUCTURE_SAMPLES: usize = 8_000;

/// A free run farther from the output's mean than this, in its standard deviations, has run away. Convention.
pub const FARTHEST: f64 = 100.0;

/// The largest order.
pub const LARGEST_ORDER: usize = 6;
/// The fewest samples of the starts for each order.
pub const SAMPLES_AN_ORDER: usize = 40;
/// The first samples do not count in the linear approximations: one in this many, and at most this number.
pub const UNCOUNTED_PART: usize = 10;
pub const MOST_UNCOUNTED: usize = 500;
/// How many orders in a row are tried although Schwarz's criterion rises.
pub const WORSE_ORDERS: usize = 2;
/// Pieces of the starts' nonlinearity.
pub const START_PIECES: usize = 7;
/// Passes of the Steiglitz-McBride iteration of a start.
pub const PASSES: usize = 3;
/// Shares of the correction by the last prediction error with which a start is fitted, one after the other: the whole correction gives the
/// equation error, none the simulation error, which has many more local minima. The effect is like that of lengthening windows (Ribeiro et
/// al. 2020).
pub const CORRECTIONS: [f64; 4] = [0.4, 0.15, 0.05, 0.0];
/// Steps with all of these shares except the last.
pub const CORRECTED: StopRule = StopRule::new(5, 1e-3);
/// The most directions, in the state space of the linear approximation, in which a hidden signal is looked for.
pub const MOST_DIRECTIONS: usize = 12;
/// How many starts of every order are refined; for how many orders the best one is refined further, and its pieces then.
pub const REFINED: usize = 3;
pub const KEPT: usize = 3;
pub const KEPT_PIECES: usize = 12;

/// Fits of starts, fits that judge a change, and the last one.
pub const ROUGH: StopRule = StopRule::new(10, 1e-3);
pub const TRIAL: StopRule = StopRule::new(15, 1e-4);
pub const LAST: StopRule = StopRule::new(20, 1e-6);
/// How many last minimisations follow each other, each in its own coordinates.
pub const RESTARTS: usize = 2;
/// They end when the sum of squares falls by at most this many times the tolerance of one.
pub const RESTART_FALL: f64 = 10.0;

/// Numbers of pieces that are tried.
pub const PIECES: [usize; 9] = [1, 2, 3, 5, 8, 12, 18, 26, 36];
/// This many numbers of pieces in a row may be worse than the best.
pub const WORSE_PIECES: usize = 2;
/// Even pieces of the spline that shows where the curve bends.
pub const FINE_PIECES: usize = 40;
/// The fewest samples in a piece.
pub const FEWEST_IN_PIECE: usize = 15;
/// The most kinks.
pub const MOST_KINKS: usize = 4;
/// Numbers of pieces with which kinks are tried.
pub const PIECES_UNDER_KINKS: [usize; 2] = [1, 3];
/// At most about this many values of a signal take a curve to other breakpoints.
pub const CURVE_SAMPLES: usize = 4_000;

/// z is named after a signal that explains this share of its variance.
pub const NAMING_SHARE: f64 = 0.9;
/// A static gain passes a constant if it is at least this share of the root of the impulse response's sum of squares,
pub const PASSES_CONSTANT: f64 = 0.05;
/// and at least this number between signals of unit variance.
pub const SMALLEST_GAIN: f64 = 0.003;
/// Samples of these impulse responses.
pub const RESPONSE: usize = 500;
/// A polynomial continues beyond its data by this share of their range on either side; beyond that it is straight.
pub const CONTINUED_SHARE: f64 = 0.5;

/// Eigenvalues of the projector onto redundant directions below this share of the largest count as zero, and so does a nonlinearity's part
/// about its line below this share of the whole: rounding.
pub const NEGLIGIBLE: f64 = 1e-9;
/// Added to the states' covariance, relative to the largest variance: states that do not move stay finite.
pub const STATE_RIDGE: f64 = 1e-12;
