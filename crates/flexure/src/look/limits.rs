//! Every threshold of a look, with its source. A convention is a choice that no reference or measurement decided.

/// A deviation of no more than this share of the largest value is rounding.
pub(super) const ROUNDING: f64 = 1e-12;
/// Fewest samples of a column that more is said of than its range. Convention.
pub(super) const FEWEST_SAMPLES: usize = 50;

/// Most values of the grid of a quantised column within its range. Converters have up to 24 bits, but single precision, in which
/// many loggers store, does not distinguish a finer grid from rounding.
pub(super) const MOST_STEPS: f64 = (1 << 20) as f64;
/// Distance of a value from the grid, in steps, up to which it is on the grid. By chance a fifth of all values are.
pub(super) const ON_GRID: f64 = 0.1;
/// Share of the samples on a grid from which the column is quantised. Convention: some samples may have been repaired.
pub(super) const QUANTISED: f64 = 0.98;
/// Fewest different values that show a grid: by chance, that many lie on one with a probability of $0.2^{12}$.
pub(super) const FEWEST_ON_GRID: usize = 12;

/// Share of the samples at an extreme from which the column stands still there: as for a joint's torque.
pub(super) const STOP_SHARE: f64 = 0.002;
/// Samples in a row of which the longest standstill at an extreme has at least so many: as for a joint's torque.
pub(super) const STOP_RUN: usize = 5;
/// The same in units of how long the column usually holds a value: a command that is held for seven samples is held so at its ends, too.
/// Convention.
pub(super) const STOP_HELD: usize = 2;
/// Samples at an extreme for each in the next step of the range: the quantised sine, whose density is greatest at its extremes, has
/// at most $1/(\sqrt 2 - 1) = 2.4$.
pub(super) const STOP_RATIO: f64 = 5.0;
/// Steps of the range of a column that is not quantised. Convention.
pub(super) const STOP_STEPS: f64 = 1000.0;

/// Usual deviations from which a sample is an outlier. Normal white noise has none in a million samples (tested).
pub(super) const OUTLIER: f64 = 10.0;
/// Standard deviations of the column that an outlier must at least be away. Convention: what is nearer does little harm.
pub(super) const OUTLIER_SIZE: f64 = 0.25;
/// Share of the samples above which what stands alone is the nature of the signal. Convention.
pub(super) const MOST_OUTLIERS: f64 = 0.01;

/// Deviation of a time step from the median step, in steps, from which samples are missing rather than late: as for a record's clock.
pub(super) const GAP: f64 = 0.5;

/// Longest segment of a spectrum, samples. Convention: two thousand frequencies fill a plot.
pub(super) const LONGEST_SEGMENT: usize = 4096;
/// Segments of a spectrum without their overlap. Convention: the spectrum then has a standard deviation of about a third.
pub(super) const SEGMENTS: usize = 8;

/// Level of all tests of dependence together.
pub(super) const LEVEL: f64 = 0.01;
/// Lags that are looked at in either direction at every time scale. Convention.
pub(super) const LAGS: usize = 30;
/// Samples whose means make one of the next time scale. Convention: lags 8 to 30 of a scale are looked at again in the next.
pub(super) const SCALE: usize = 4;
/// Most time scales. Convention: blocks of 1024 samples.
pub(super) const MOST_SCALES: usize = 6;
/// Fewest blocks of a time scale. Convention, four times the lags on both sides.
pub(super) const FEWEST_BLOCKS: usize = 240;
/// Samples for each coefficient of an autoregression that whitens a column, as for a fit's errors.
pub(super) const SAMPLES_PER_COEFFICIENT: usize = 50;
/// Autoregressions that whiten a column, one after the other, at most. Convention.
pub(super) const PASSES: usize = 4;
/// Most samples of a time scale, times the number of pairs of columns: a second or two of work.
pub(super) const MOST_WORK: usize = 3 << 19;
/// Most samples of a time scale. Convention: more finds nothing that matters.
pub(super) const MOST_SAMPLES: usize = 1 << 18;
/// Share of the largest statistic that a finer time scale must have to be preferred. Convention.
pub(super) const FINER: f64 = 0.5;
/// Share of the largest correlation from which a lag counts for the delay or for the direction: what whitening leaves is smaller.
/// Convention.
pub(super) const COUNTS: f64 = 0.1;
/// Share of the largest correlation from which one in the other direction is feedback. Convention.
pub(super) const FEEDBACK: f64 = 0.3;

/// Share of its variance that a column may differ by from the integral of its derivative. Convention: a tenth of its standard deviation.
pub(super) const DERIVATIVE_LEFT: f64 = 0.01;
/// Relative deviation of the factor of a derivative from 1. Convention: units agree or differ by far more.
pub(super) const DERIVATIVE_FACTOR: f64 = 0.05;
/// Share of the variance that a column which is another times a factor leaves. Convention: a hundredth of its standard deviation.
pub(super) const SAME: f64 = 1e-4;

/// Numbers of blocks, roughly, over which an output's difference is looked at: fine enough for a motion of some seconds in a log of
/// minutes, and coarse enough for a slow one.
pub(super) const AIMED_BLOCKS: [usize; 2] = [4000, 1000];
/// Fewest blocks. Convention.
pub(super) const FEWEST_INTEGRATED: usize = 200;
/// Past differences and past inputs in that regression. Convention: motion, friction and the delay of a block need three.
pub(super) const INTEGRATED_LAGS: usize = 4;
/// An output that would settle within this part of the record (one third) does not integrate.
pub(super) const SETTLES: f64 = 3.0;
/// Standard errors within which that is known.
pub(super) const STANDARD_ERRORS: f64 = 3.0;
/// Standard errors by which the sum of the input's coefficients must differ from 0. The EMPS axis has 5 to 8.
pub(super) const DRIVEN: f64 = 3.5;
/// The output's change from block to block must be less than this share of the input's, each in standard deviations. The EMPS axis
/// has 0.03, a wing in flutter, which oscillates at one frequency, 1.0.
pub(super) const SLOWER: f64 = 0.5;
/// Share of the output's unforeseen change that the input must explain.
pub(super) const DRIVEN_SHARE: f64 = 0.1;
