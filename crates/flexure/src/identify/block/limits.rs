//! Every threshold that the search's steps share.
//!
//! Where no source is given, the value was chosen on random systems other than those that the examples report
//! (`examples/wiener_hammerstein.rs`, `parallel.rs`, `structures`).

use super::descent::StopRule;

/// At most this many samples, the last ones, are fitted; more only cost memory.
pub const MOST_SAMPLES: usize = 200_000;
/// Samples that do not count while the settling time is not known.
pub const SETTLING_UNKNOWN: usize = 500;
/// Samples that starts are made on.
pub const START_SAMPLES: usize = 5_000;
/// Samples that the structure is chosen on.
pub const STRUCTURE_SAMPLES: usize = 20_000;

/// Short fits of starts, and of kinks on trial.
pub const ROUGH: StopRule = StopRule {
    steps: 12,
    tolerance: 1e-3,
};
/// Fits that judge a structural change.
pub const TRIAL: StopRule = StopRule {
    steps: 12,
    tolerance: 1e-4,
};
/// The last fit.
pub const LAST: StopRule = StopRule {
    steps: 80,
    tolerance: 1e-6,
};
/// Rounds of structural change.
pub const ROUNDS: usize = 16;

/// Numbers of pieces that are tried, relative to the present number, until this many in a row are worse.
pub const PIECES: [f64; 6] = [0.7, 1.0, 1.4, 2.0, 2.8, 4.0];
pub const WORSE_PIECES: usize = 3;
/// Tried before those in a system of several nonlinearities, where each needs fewer pieces: without it, Schwarz's criterion ended higher
/// by 30 to 40 on a Hammerstein-Wiener system and on one of two inputs.
pub const FAR_FEWER_PIECES: f64 = 0.4;
/// The fewest pieces of a nonlinearity that is alone, and of one among several.
pub const FEWEST_PIECES: [usize; 2] = [2, 1];
pub const MOST_PIECES: usize = 64;
/// A piece has at least the samples' number divided by this, within these bounds.
pub const FINEST_PIECES: usize = 800;
pub const SAMPLES_IN_PIECE: [usize; 2] = [8, 50];
/// The same for pieces of starts, whose number is small.
pub const SAMPLES_IN_COARSE_PIECE: usize = 12;
/// The outermost pieces, whose slope goes on beyond the data, have at least this many times the samples of the others.
pub const OUTERMOST: usize = 2;
/// The share of the breakpoints that are spread evenly.
pub const EVEN: f64 = 0.3;
/// Outer breakpoints are moved back into the data's range if that raises the sum of squares by at most 5 %.
pub const LARGEST_RISE: f64 = 1.05;

/// Shares of the samples below the places at which a kink is tried.
pub const KINK_PLACES: usize = 40;
pub const MOST_KINKS: usize = 6;
/// Pieces of the spline that kinks are put on: too few to imitate one; half of the present number is tried too.
pub const PIECES_UNDER_KINKS: [usize; 2] = [1, 3];
/// Pieces relative to the present number, once there are kinks.
pub const FEWER_PIECES: [f64; 3] = [0.3, 0.5, 0.7];
/// Kinks are taken if Schwarz's criterion is lower by more than this: "very strong" evidence (Kass & Raftery 1995).
pub const KINK_EVIDENCE: f64 = 10.0;

/// Largest order of the starts whose branches have one denominator, and orders in a row that are tried although Schwarz's
/// criterion rises.
pub const LARGEST_START_ORDER: usize = 8;
pub const WORSE_ORDERS: usize = 2;
/// Pieces of the nonlinearities that these starts are made with.
pub const START_PIECES: usize = 5;
