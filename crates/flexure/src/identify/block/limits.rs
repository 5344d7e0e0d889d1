//! Every threshold of the block structures' search, in the order of its steps.
//!
//! Values without a source were chosen on random systems other than those that the examples report
//! (`examples/wiener_hammerstein.rs`, `parallel.rs`, `structures`). A convention is a choice that no reference or measurement decided.

use std::ops::RangeInclusive;

/// When a minimisation ends.
#[derive(Debug, Clone, Copy)]
pub struct StopRule {
    /// After this many steps.
    pub steps: usize,
    /// After a step that lowers the sum of squares by less than this share.
    pub tolerance: f64,
}

impl StopRule {
    pub const fn new(steps: usize, tolerance: f64) -> StopRule {
        StopRule { steps, tolerance }
    }

    /// After this many times the steps.
    pub const fn times(self, factor: usize) -> StopRule {
        StopRule {
            steps: factor * self.steps,
            ..self
        }
    }
}

/// One round of short fits of many starts.
pub struct Round {
    /// Samples.
    pub samples: usize,
    /// How many of the best from the last round take part.
    pub kept: usize,
    /// Pieces of every nonlinearity; `None` keeps the present ones.
    pub pieces: Option<usize>,
    pub rule: StopRule,
    /// Whether the fits are added to the list of tried systems.
    pub listed: bool,
}

// The samples.

/// At most this many samples, the last ones, are fitted; more only cost memory.
pub const MOST_SAMPLES: usize = 200_000;
/// Samples that do not count as long as the settling time is unknown.
pub const SETTLING_UNKNOWN: usize = 500;
/// The first samples do not count until responses have fallen to this share, and at least and at most for these parts of the record (one in
/// so many samples). Conventions.
pub const SETTLED_START: f64 = 1e-4;
pub const SHORTEST_START: usize = 100;
pub const LONGEST_START: usize = 10;
/// A signal is constant if its range is at most this share of its largest value, or its deviation at most this number where all signals have
/// unit variance. Rounding.
pub const CONSTANT_RANGE: f64 = 1e-9;
pub const CONSTANT_SPREAD: f64 = 1e-12;
/// Samples for the starts.
pub const START_SAMPLES: usize = 5_000;
/// Samples for the choice of the structure.
pub const STRUCTURE_SAMPLES: usize = 20_000;

/// Fits run side by side as long as their Jacobians have at most this many numbers together. Convention: 256 MB.
pub const MOST_NUMBERS: usize = 1 << 25;

/// Lags of the errors' autocorrelation, which gives the number of independent errors, and the fewest independent errors that are assumed.
/// Conventions.
pub const ERROR_LAGS: usize = 100;
pub const FEWEST_ERRORS: f64 = 20.0;

// Minimisation.

/// Short fits of starts, and of kinks on trial.
pub const ROUGH: StopRule = StopRule::new(12, 1e-3);
/// Fits that judge a structural change.
pub const TRIAL: StopRule = StopRule::new(12, 1e-4);
/// The last fit.
pub const LAST: StopRule = StopRule::new(80, 1e-6);
/// The fit of a linear approximation.
pub const APPROXIMATION: StopRule = StopRule::new(40, 1e-7);
/// The fit of whitened errors.
pub const EFFICIENT: StopRule = StopRule::new(20, 1e-7);
/// Damping of the first step, relative to the normal equations' diagonal, and the smallest. Conventions.
pub const FIRST_DAMPING: f64 = 1e-3;
pub const SMALLEST_DAMPING: f64 = 1e-13;
/// A minimisation ends after this many rejected steps in a row. Convention; each is damped more than the one before.
pub const MOST_REJECTIONS: usize = 12;
/// The share of a step over which the second derivative is taken, and the largest correction as a share of the step: with a larger one, the
/// step is too long (Transtrum & Sethna 2012).
pub const PROBED_SHARE: f64 = 0.1;
pub const LARGEST_CORRECTION: f64 = 0.75;
/// The probability that a true model keeps its least-squares estimate. It is small: such models are those with the largest errors, and a
/// rise of the simulation error within chance costs little.
pub const EFFICIENT_LEVEL: f64 = 1e-4;

/// Power iterations for the dominant singular vectors. Convention.
pub const POWER_ITERATIONS: usize = 60;

// Linear systems.

/// Added to every input of a filter, so that a decaying response never reaches the (slow) denormal numbers.
pub const TINY_INPUT: f64 = 1e-100;
/// Roots with a smaller imaginary part, relative to their size, are real. Square root of rounding, rounded up.
pub const REAL_ROOT: f64 = 1e-9;
/// A pole within this radius has settled after one sample. Convention.
pub const AT_ORIGIN: f64 = 1e-6;
/// A pole outside the largest radius is moved to this share of it: strictly inside, whatever the rounding.
pub const WITHIN_RADIUS: f64 = 1.0 - 1e-6;
/// A system hardly passes a constant if its static gain is below this share of the gain with numerator coefficients of one sign.
/// Convention.
pub const HARDLY_PASSED: f64 = 1e-3;
/// A static gain below this share of the gain of the standard deviation does not fix the scale. Convention: the blocks' scale would be ten
/// times their values. `hammerstein/limits.rs` has another limit, relative to the impulse response's absolute sum.
pub const NO_STATIC_GAIN: f64 = 0.1;

// Delays.

/// The longest delay that is looked for. Convention.
pub const LONGEST_DELAY: usize = 100;
/// Order of the search for a long delay of a linear system, and the samples that are subtracted from it, for the numerators.
pub const LINEAR_DELAY_ORDER: usize = 3;
pub const LINEAR_DELAY_SLACK: usize = 6;
/// Past outputs and past samples of every input in the equation error that shows delays.
pub const DELAY_PAST: usize = 10;
pub const DELAY_LAGS: usize = 10;
/// The probability that the coefficients before the delay, which are all zero, are taken for a response. Convention.
pub const DELAY_LEVEL: f64 = 0.001;
/// Added to the diagonal of these equations, relative to it. Rounding.
pub const DELAY_RIDGE: f64 = 1e-12;
/// The least size of the first coefficient after a delay, in standard errors. A smaller one may be the slow beginning of a response without
/// a delay, as in the circuit of 2009. Convention.
pub const DELAY_EDGE: f64 = 10.0;
/// Samples, order and pieces of the search for delays before nonlinearities, and the samples that are subtracted from them. The samples are
/// fewer than for a linear system, since the equations have more columns.
pub const SPLINE_DELAY_SAMPLES: usize = 4_000;
pub const SPLINE_DELAY_ORDER: usize = 2;
pub const SPLINE_DELAY_PIECES: usize = 3;
pub const SPLINE_DELAY_SLACK: usize = 1;

// The linear approximation.

/// Its largest order. It has the poles of a front and a back together, so it may have more than `LARGEST_START_ORDER`.
pub const LARGEST_ORDER: usize = 10;
/// Orders of the approximation from which starts are made: the best by Schwarz's criterion and its neighbours.
pub const START_ORDERS: RangeInclusive<isize> = -1..=2;
/// A linear approximation that explains less than this share of the output's variance is a weak start. Convention.
pub const WEAK_APPROXIMATION: f64 = 0.1;
/// Passes of the Steiglitz-McBride iteration for one linear system.
pub const EQUATION_ERROR_PASSES: usize = 12;
/// The same if numerators are multiplied with a nonlinearity: the equations are larger, and a fit of both blocks follows.
pub const PRODUCT_PASSES: usize = 8;

// Changes of structure.

/// Rounds of structural change.
pub const ROUNDS: usize = 16;
/// A numerator is at most this much longer than the denominator.
pub const LONGEST_NUMERATOR: usize = 8;
/// Most poles of one block: two more than the linear approximation of all blocks has.
pub const MOST_POLES: usize = 12;
/// A pole and a zero nearly cancel if they are at most this far apart.
pub const NEARLY_CANCELLED: f64 = 0.3;
/// Samples on either side from which one half-way between is interpolated. Convention.
pub const INTERPOLATION_REACH: usize = 32;

// Nonlinearities.

/// Numbers of pieces that are tried, relative to the present number, until this many in a row are worse.
pub const PIECES: [f64; 6] = [0.7, 1.0, 1.4, 2.0, 2.8, 4.0];
pub const WORSE_PIECES: usize = 3;
/// Tried before these numbers in a system of several nonlinearities, since each then needs fewer pieces. Without it, Schwarz's criterion
/// ended 30 to 40 higher on a Hammerstein-Wiener system and on one of two inputs.
pub const FAR_FEWER_PIECES: f64 = 0.4;
/// The fewest pieces of a single nonlinearity, and of one among several.
pub const FEWEST_PIECES: [usize; 2] = [2, 1];
pub const MOST_PIECES: usize = 64;
/// A piece has at least the samples' number divided by this, within these bounds.
pub const FINEST_PIECES: usize = 800;
pub const SAMPLES_IN_PIECE: [usize; 2] = [8, 50];
/// The same for pieces of starts, whose number is small.
pub const SAMPLES_IN_COARSE_PIECE: usize = 12;
/// Quantiles nearer than this share of the range are one breakpoint. Convention.
pub const NEAREST_QUANTILES: f64 = 1e-6;
/// The outermost pieces have at least this many times the samples of the others, since their slope continues beyond the data.
pub const OUTERMOST: usize = 2;
/// The share of the breakpoints that are spread evenly.
pub const EVEN: f64 = 0.3;
/// Outer breakpoints are moved back into the data's range if that raises the sum of squares by at most 5 %.
pub const LARGEST_RISE: f64 = 1.05;

/// Evenly spaced points of the tabulated nonlinearity. Convention.
pub const CURVE_POINTS: usize = 2001;
/// Points of the table nearer than this share of the range are one: the slope between them would be rounding error, and the outermost slope
/// continues beyond the ends.
pub const NEAREST_POINTS: f64 = 1e-9;

/// Shares of the samples below the places at which a kink is tried.
pub const KINK_PLACES: usize = 40;
/// Further such shares at either end: the limits of a sensor may be seldom reached. Convention.
pub const RARE_KINK_PLACES: [f64; 3] = [0.003, 0.006, 0.012];
pub const MOST_KINKS: usize = 6;
/// Pieces of the spline to which kinks are added: too few to imitate a kink; half of the present number is tried too.
pub const PIECES_UNDER_KINKS: [usize; 2] = [1, 3];
/// Pieces relative to the present number, once there are kinks.
pub const FEWER_PIECES: [f64; 3] = [0.3, 0.5, 0.7];
/// Kinks are taken if Schwarz's criterion is lower by more than this: "very strong" evidence (Kass & Raftery 1995).
pub const KINK_EVIDENCE: f64 = 10.0;

// Starts of one branch: splits of a linear approximation's poles.

/// Quantiles of the intermediate signal that bound the nonlinearity's first pieces.
pub const FIRST_PIECE_QUANTILES: [f64; 7] = [0.03, 0.12, 0.3, 0.5, 0.7, 0.88, 0.97];
/// At most this many groups of poles are split, so there are at most `2^MOST_POLE_GROUPS` splits. In a cascade the rest stays in the front;
/// in a sum it is left out.
pub const MOST_POLE_GROUPS: usize = 10;
/// Splits of the poles for which the zeros are moved, and those of every order that are screened. They bound the time.
pub const MOST_SPLITS: usize = 40;
pub const MOST_SCREENED: usize = 8;
/// Short fits: first of all starts unchanged, then with finer nonlinearities.
pub const CASCADE_ROUNDS: [Round; 3] = [
    Round {
        samples: 10_000,
        kept: usize::MAX,
        pieces: None,
        rule: ROUGH,
        listed: true,
    },
    Round {
        samples: 10_000,
        kept: 8,
        pieces: Some(16),
        rule: TRIAL.times(2),
        listed: true,
    },
    Round {
        samples: 10_000,
        kept: 3,
        pieces: Some(16),
        rule: TRIAL.times(2),
        listed: true,
    },
];

// Starts with a nonlinearity at the input, of one branch or several.

/// Largest order of the starts whose branches have one denominator, and how many orders in a row are tried although Schwarz's criterion
/// rises.
pub const LARGEST_START_ORDER: usize = 8;
pub const WORSE_ORDERS: usize = 2;
/// Pieces of these starts' nonlinearities.
pub const START_PIECES: usize = 5;
/// Short fits of the best starts, then of finer nonlinearities.
pub const BRANCHES_ROUNDS: [Round; 2] = [
    Round {
        samples: STRUCTURE_SAMPLES,
        kept: 3,
        pieces: None,
        rule: ROUGH,
        listed: false,
    },
    Round {
        samples: STRUCTURE_SAMPLES,
        kept: 3,
        pieces: Some(10),
        rule: TRIAL.times(2),
        listed: true,
    },
];

// Sums of branches.

/// Random assignments of the poles from which a search for better ones begins.
pub const CLIMBS: usize = 16;
/// Assignments whose scores differ by no more than this share are the same. Rounding.
pub const SAME_SCORE: f64 = 1e-9;
/// How many numerator coefficients a back has beyond its number of poles, and the most of all.
pub const MORE_COEFFICIENTS: usize = 1;
pub const MOST_COEFFICIENTS: usize = 4;
/// The most refined starts of every linear approximation, and the most branches that are tried in addition to a sum of one branch less.
pub const MOST_SUM_STARTS: usize = 8;
pub const MOST_ADDED: usize = 2;
/// Rounds in which structure is added branch by branch.
pub const BRANCH_ROUNDS: usize = 4;
/// The residual tests that can refute a sum; the level is divided by their number.
pub const REFUTING_TESTS: usize = 5;
/// Short fits, more thorough for fewer.
pub const SUM_ROUNDS: [Round; 3] = [
    Round {
        samples: START_SAMPLES,
        kept: usize::MAX,
        pieces: None,
        rule: StopRule { steps: 8, ..TRIAL },
        listed: false,
    },
    Round {
        samples: 8_000,
        kept: 8,
        pieces: None,
        rule: TRIAL,
        listed: true,
    },
    Round {
        samples: 8_000,
        kept: 3,
        pieces: Some(12),
        rule: TRIAL.times(3),
        listed: true,
    },
];

// Whether a fit stays stable from another start.

/// A mean squared error that is larger by this factor from another start shows that a fit runs away. Convention: three times the error.
pub const RUN_AWAY: f64 = 9.0;
/// An error below this share of the output's variance is no running away: a lightly damped system forgets its start slowly. Convention.
pub const POOR: f64 = 0.25;
/// An error that is larger by less than this factor counts as equal. Convention.
pub const AS_GOOD_RESTARTED: f64 = 1.5;

/// The change of a parameter, in standard errors, for the derivatives of the blocks.
pub const BAND_STEP: f64 = 1e-3;
/// Points of a band; it is interpolated between them.
pub const BAND_POINTS: usize = 201;

/// A change of the slope below this share of the steepest slope is not called a kink. Convention.
pub const SLIGHT_KINK: f64 = 0.05;
