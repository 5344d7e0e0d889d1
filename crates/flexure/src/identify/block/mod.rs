//! What the block structures share: one form of system, its simulation error with exact derivatives, and one search.
//!
//! - `signals`, `prepared`, `columns`: what is fitted, scaled; best linear approximations (`approximation`).
//! - `rational`, `spline`, `system`: linear blocks, static nonlinearities, and the systems that are made of them.
//! - `loss`, `descent`, `products`, `efficient`: the error with its derivatives, and its minimum by (generalised) least squares.
//! - `candidate`, `pieces`, `kinks`, `changes`, `intersample`: a system and the changes of its structure.
//! - `search`: the order of those changes, the same for all; `limits`: its thresholds.
//! - `split`, `cascade`: one branch, started from linear approximations; `start`, `rank`, `ends`: static blocks first, started from least
//!   squares over products; `shares`, `sum`: several branches of one input.
//! - `units`: blocks in the record's units.

mod approximation;
mod candidate;
mod cascade;
mod changes;
mod columns;
mod criterion;
mod descent;
mod efficient;
pub(super) mod ends;
mod intersample;
mod kinks;
mod limits;
mod loss;
mod monitor;
mod pieces;
mod prepared;
mod products;
mod rank;
mod rational;
mod search;
mod shares;
mod signals;
mod spline;
mod split;
mod start;
mod sum;
mod system;
mod units;

pub use monitor::Stage;
pub use units::{ApproximationScore, Intersample};
pub(super) use {
    approximation::{EquationError, approximate, least_lag, restructured},
    candidate::{Candidate, Tried},
    cascade::{search, splits, without_start},
    columns::Columns,
    limits::START_SAMPLES,
    monitor::Monitor,
    prepared::{LARGEST_ORDER, Prepared, WEAK},
    products::normal_equations,
    rank::dominant_products,
    rational::Rational,
    search::FreeParts,
    signals::{Signals, delayed},
    spline::KinkedSpline,
    split::fit_nonlinearity,
    start::delays,
    sum::{SumResult, find_sum},
    system::System,
    units::{Blocks, Scale, Tabulated, blocks, conventional_gain, normalised, tabulated},
};
