//! How much of the data the page carries, so that it opens quickly for records of any length.
//!
//! A signal no longer than its limit is embedded sample by sample and can be zoomed down to single samples. A longer one
//! is reduced to the minimum and the maximum of equal buckets of samples, in their order of occurrence, two points a
//! bucket: no spike is lost, and a point is off its true time by less than a bucket. A page of a million samples with a
//! dozen columns is then about 2 MB. Numbers are rounded to [`DIGITS`] significant digits; the coefficients of
//! the linear part are not.

/// Most points of measured, predicted and error on the fresh part, each.
pub const PREDICTION_POINTS: usize = 20_000;

/// Most points of all the record's signals together.
pub const RECORD_POINTS: usize = 96_000;

/// Most points of a single signal of the record.
pub const SIGNAL_POINTS: usize = 12_000;

/// Most samples of the moving arm. A longer motion is cut, not thinned: leaving out samples would show vibrations that
/// are not there (aliases). The page says what part it shows.
pub const ARM_SAMPLES: usize = 10_000;

/// Most coordinates of the points of a moving chain; a longer motion is cut for the same reason.
pub const CHAIN_COORDINATES: usize = 120_000;

/// Most points of a curve on a grid (nonlinearity, Bode, scores); a longer one keeps every k-th.
pub const CURVE_POINTS: usize = 4_000;

/// A nonlinearity known at no more points than this, that is at the levels of its input, is drawn with these points.
pub const FEW_POINTS: usize = 10;

/// Most lags of an impulse response or a correlation; later ones are left out.
pub const LAGS: usize = 2_000;

/// Most points of a scatter that are drawn one by one; more are counted in the cells of a grid.
pub const SCATTER_POINTS: usize = 5_000;

/// Columns and rows of that grid.
pub const SCATTER_CELLS: [usize; 2] = [160, 90];

/// Significant digits of the embedded numbers.
pub const DIGITS: usize = 7;
