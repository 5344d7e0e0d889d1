//! Every threshold of a look, with its source. A convention is a choice that no reference or measurement decided.

/// A deviation of at most this share of the largest value is rounding.
pub(super) const ROUNDING: f64 = 1e-12;
/// For a column with fewer samples, only the range is reported. Convention.
pub(super) const FEWEST_SAMPLES: usize = 50;

/// Most values of the grid of a quantised column within its range. Converters have up to 24 bits, but single precision, in which
/// many loggers store, does not distinguish a finer grid from rounding.
pub(super) const MOST_STEPS: f64 = (1 << 20) as f64;
/// A value is on the grid if its distance from it, in steps, is at most this. A fifth of all values are so by chance.
pub(super) const ON_GRID: f64 = 0.1;
/// A column is quantised if at least this share of the samples is on a grid. Convention: some samples may have been repaired.
pub(super) const QUANTISED: f64 = 0.98;
/// Fewest different values that show a grid: by chance, that many lie on one with a probability of $0.2^{12}$.
pub(super) const FEWEST_ON_GRID: usize = 12;

/// A column stands still at an extreme if at least this share of the samples is there: as for a joint's torque.
pub(super) const STOP_SHARE: f64 = 0.002;
/// The longest standstill at an extreme has at least this many consecutive samples: as for a joint's torque.
pub(super) const STOP_RUN: usize = 5;
/// The same in units of the column's usual holding time: a command held for seven samples is also held that long at its extremes.
/// Convention.
pub(super) const STOP_HELD: usize = 2;
/// The least ratio of the samples at an extreme to those in the next step of the range. A quantised sine, whose density is greatest at its
/// extremes, has at most $1/(\sqrt 2 - 1) = 2.4$.
pub(super) const STOP_RATIO: f64 = 5.0;
/// A fast signal that is clipped returns to its extreme at least this often, in runs of any length. Convention: the largest of many samples on
/// a grid is one of a few.
pub(super) const STOP_VISITS: usize = 10;
/// Fewest values of such a column. Of fewer, the extremes may be where a signal switches to, as three levels are.
pub(super) const STOP_VALUES: usize = 20;
/// Steps of the range of a column that is not quantised. Convention.
pub(super) const STOP_STEPS: f64 = 1000.0;

/// A sample is an outlier from this many usual deviations on. Normal white noise has none in a million samples (tested).
pub(super) const OUTLIER: f64 = 10.0;
/// The least distance of an outlier, in standard deviations of the column. Convention: nearer samples do little harm.
pub(super) const OUTLIER_SIZE: f64 = 0.25;
/// An outlier jumps by more than this many times the largest of the two changes before and the two after it. Convention: at a turn, a smooth
/// signal changes as it does around.
pub(super) const OUTLIER_JUMP: f64 = 2.0;
/// A column holds its values if they last for more than this many samples on average. Convention: a quantised signal that moves changes
/// more often.
pub(super) const HELD: usize = 3;
/// If a larger share of the samples stands alone, this is the nature of the signal. Convention.
pub(super) const MOST_OUTLIERS: f64 = 0.01;

/// From this deviation of a time step from the median step on, in steps, samples are missing, not late: as for a record's clock.
pub(super) const GAP: f64 = 0.5;

/// Longest segment of a spectrum, samples. Convention: two thousand frequencies fill a plot.
pub(super) const LONGEST_SEGMENT: usize = 4096;
/// Segments of a spectrum without their overlap. Convention: the spectrum then has a standard deviation of about a third.
pub(super) const SEGMENTS: usize = 8;

/// Level of all tests of dependence together.
pub(super) const LEVEL: f64 = 0.01;
/// Lags in either direction at every time scale. Convention.
pub(super) const LAGS: usize = 30;
/// One sample of the next time scale is the mean of this many. Convention: lags 8 to 30 of a scale occur again in the next.
pub(super) const SCALE: usize = 4;
/// Most time scales. Convention: blocks of 1024 samples.
pub(super) const MOST_SCALES: usize = 6;
/// Fewest blocks of a time scale. Convention, four times the lags on both sides.
pub(super) const FEWEST_BLOCKS: usize = 240;
/// Samples for each coefficient of an autoregression that whitens a column, as for a fit's errors.
pub(super) const SAMPLES_PER_COEFFICIENT: usize = 50;
/// The most autoregressions in sequence that whiten a column. Convention.
pub(super) const PASSES: usize = 4;
/// Most samples of a time scale, times the number of pairs of columns: a second or two of work.
pub(super) const MOST_WORK: usize = 3 << 19;
/// Most samples of a time scale. Convention: more samples show no further relevant dependence.
pub(super) const MOST_SAMPLES: usize = 1 << 18;
/// A finer time scale is preferred if its statistic is at least this share of the largest one. Convention.
pub(super) const FINER: f64 = 0.5;
/// A lag counts for the delay or the direction from this share of the largest correlation on: remainders of the whitening are smaller.
/// Convention.
pub(super) const COUNTS: f64 = 0.1;
/// A correlation in the other direction is feedback from this share of the largest one on. Convention.
pub(super) const FEEDBACK: f64 = 0.3;

/// The largest difference of a column and the integral of its derivative, as a share of its variance. Convention: a tenth of its standard
/// deviation.
pub(super) const DERIVATIVE_LEFT: f64 = 0.01;
/// Relative deviation of the factor of a derivative from 1. Convention: units agree or differ by far more.
pub(super) const DERIVATIVE_FACTOR: f64 = 0.05;
/// The largest difference of a column and another one times a factor, as a share of its variance. Convention: a hundredth of its standard
/// deviation.
pub(super) const SAME: f64 = 1e-4;

/// Approximate numbers of blocks for an output's differences: fine enough for a motion of some seconds in a log of minutes, and coarse
/// enough for a slow one.
pub(super) const AIMED_BLOCKS: [usize; 2] = [4000, 1000];
/// Fewest blocks. Convention.
pub(super) const FEWEST_INTEGRATED: usize = 200;
/// Past differences and past inputs in the regression. Convention: motion, friction and the delay of a block need three.
pub(super) const INTEGRATED_LAGS: usize = 4;
/// An output that would settle within this part of the record (one third) does not integrate.
pub(super) const SETTLES: f64 = 3.0;
/// The certainty of this, in standard errors.
pub(super) const STANDARD_ERRORS: f64 = 3.0;
/// Standard errors by which the sum of the input's coefficients must differ from 0. The EMPS axis has 5 to 8.
pub(super) const DRIVEN: f64 = 3.5;
/// The output's change from block to block must be less than this share of the input's, each in standard deviations. The EMPS axis has
/// 0.03; a wing in flutter, which oscillates at one frequency, has 1.0.
pub(super) const SLOWER: f64 = 0.5;
/// The least share of the output's unpredicted change that the input must explain.
pub(super) const DRIVEN_SHARE: f64 = 0.1;

/// Past outputs, and past values of each input behind its delay, in the difference equation beside which further inputs are looked for.
/// Convention: as many as a system of low order has.
pub(super) const BESIDE_PAST: usize = 8;
pub(super) const BESIDE_LAGS: usize = 8;
/// The most samples in which further inputs are looked for. Convention: these show a coherence of a thousandth.
pub(super) const BESIDE_SAMPLES: usize = 100_000;
/// A column counts the samples even if one in so many of its steps is longer, where rows are lost. Convention.
pub(super) const BROKEN: usize = 10;
