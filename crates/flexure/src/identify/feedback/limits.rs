//! Every threshold of the search for a loop, in the order of its steps. Where no source is given, it is a convention: a choice that no
//! reference or measurement decided.

use crate::identify::block::StopRule;

/// At most this many samples, the last ones, are fitted; more only cost memory.
pub const MOST_SAMPLES: usize = 200_000;
/// Samples that starts are made on, and that the structure is chosen on.
pub const START_SAMPLES: usize = 2_500;
pub const STRUCTURE_SAMPLES: usize = 8_000;

/// A free run farther from the output's mean than this, in its standard deviations, has run away. Convention.
pub const FARTHEST: f64 = 100.0;

/// The largest order.
pub const LARGEST_ORDER: usize = 6;
/// Orders in a row that are tried although Schwarz's criterion rises.
pub const WORSE_ORDERS: usize = 2;
/// Pieces of the nonlinearity that the starts are made with.
pub const START_PIECES: usize = 7;
/// Passes of the Steiglitz-McBride iteration of a start.
pub const PASSES: usize = 3;
/// Shares of the correction by the last prediction error with which a start is fitted, one after the other: with all of it the equation
/// error is fitted, with none the simulation error, whose landscape is much rougher. As windows that lengthen (Ribeiro et al. 2020).
pub const CORRECTIONS: [f64; 4] = [0.4, 0.15, 0.05, 0.0];
/// Steps with all of these shares but the last.
pub const CORRECTED: StopRule = StopRule::new(5, 1e-3);
/// The most directions in the state space of the linear approximation that a hidden signal is looked for in.
pub const MOST_DIRECTIONS: usize = 12;
/// The starts of every order that are refined; the orders whose best one is refined further, and its pieces then.
pub const REFINED: usize = 3;
pub const KEPT: usize = 3;
pub const KEPT_PIECES: usize = 12;

/// Fits of starts, fits that judge a change, and the last one.
pub const ROUGH: StopRule = StopRule::new(10, 1e-3);
pub const TRIAL: StopRule = StopRule::new(15, 1e-4);
pub const LAST: StopRule = StopRule::new(20, 1e-6);
/// Last minimisations one after the other, each in coordinates of its own.
pub const RESTARTS: usize = 2;

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

/// A signal that explains this share of z's variance names it.
pub const NAMING_SHARE: f64 = 0.9;
/// A static gain passes a constant if it is at least this share of the root of the impulse response's sum of squares,
pub const PASSES_CONSTANT: f64 = 0.05;
/// and at least this number between signals of unit variance.
pub const SMALLEST_GAIN: f64 = 0.003;
/// Samples of these impulse responses.
pub const RESPONSE: usize = 500;
/// A polynomial goes on beyond its data by this share of their range on either side; then straight.
pub const CONTINUED_SHARE: f64 = 0.5;

/// Eigenvalues of the projector onto redundant directions below this share of the largest count as zero: rounding.
pub const NEGLIGIBLE: f64 = 1e-9;
