//! The common parts of the block structures: one form of system, its simulation error with exact derivatives, and one search.
//!
//! | step | files |
//! |---|---|
//! | samples at zero mean and unit variance; their delays and best linear approximations | `signals`, `prepared`, `delay`, `approximation`, `equation_error` |
//! | linear blocks, static nonlinearities, and systems of them | `rational`, `spline`, `system` |
//! | the simulation error with its derivatives, and its minimum by (generalised) least squares | `loss`, `descent`, `least_squares`, `efficient` |
//! | starts: one branch; Hammerstein branches; sums of branches | `cascade`; `hammerstein_branches`, `rank_one`; `sum`, `sum_starts` |
//! | the search, the same for all, and its changes: poles and zeros, pieces, kinks, a second instant | `search`, `candidate`; `changes`, `pieces`, `kinks`, `intersample` |
//! | whether the result stays good from another start of its run | `restart` |
//! | thresholds; progress | `limits`; `monitor` |
//! | blocks in the record's units, their standard errors and bands | `units`, `uncertainty` |

mod approximation;
mod candidate;
mod cascade;
mod changes;
mod delay;
mod descent;
mod efficient;
mod equation_error;
pub(super) mod hammerstein_branches;
mod intersample;
mod kinks;
mod limits;
mod loss;
mod monitor;
mod pieces;
mod prepared;
mod rank_one;
mod rational;
mod restart;
mod search;
mod signals;
mod spline;
mod sum;
mod sum_starts;
mod system;
mod uncertainty;
mod units;

pub(super) use {
    approximation::{Approximation, approximate_all, restructured},
    candidate::{Candidate, Tried},
    cascade::{fit_nonlinearity, search, splits, without_start},
    changes::{greedy, linear_parts, with_a_pole_less},
    delay::{delays, least_lag, linear_delays},
    descent::{Minimum, Residuals, descend, descend_through},
    efficient::{efficient, matrix_product},
    equation_error::{EquationError, Judged},
    limits::{
        EVEN, KINK_EVIDENCE, KINK_PLACES, LARGEST_ORDER, LARGEST_START_ORDER, LONGEST_DELAY, PRODUCT_PASSES,
        SETTLED_START, START_SAMPLES, StopRule,
    },
    monitor::{Monitor, Stage},
    prepared::Prepared,
    rank_one::dominant_products,
    rational::Rational,
    restart::robust_to_restart,
    search::SearchResult,
    signals::{Scale, Signals, convolved, delayed, standardised},
    spline::{Kink, KinkedSpline, Roughness, Tangent, thinned},
    sum::find_sum,
    system::{Branch, FreeParts, System},
    uncertainty::{Band, Uncertainty, add_errors},
    units::{Blocks, Normalised, tabulated},
};
