//! What the block structures share: signals, simulation errors with exact derivatives, descents, and the search.

mod approximation;
pub(super) mod branches;
mod descent;
mod efficient;
mod intersample;
mod kinks;
mod loss;
mod monitor;
mod products;
mod rational;
mod refine;
mod search;
mod shape;
mod split;
mod structure;
pub(super) mod sum;
mod units;
mod whitened;

pub use monitor::Stage;
pub use refine::TriedStructure;
pub use units::{ApproximationScore, Intersample};
pub(super) use {
    approximation::{approximate, restructured, solve},
    descent::{Residuals, descend},
    efficient::{efficient, whitening_filter},
    kinks::{Bendable, kinked},
    loss::{Cascade, CascadeLoss, Data, delayed, squares_through},
    monitor::Monitor,
    products::normal_equations,
    rational::{Rational, convolved, groups},
    refine::{
        STRUCTURE_SAMPLES, TRIAL_STEPS, bic as schwarz, dependence, fitted, parameters, pieces, restructure,
        with_pieces,
    },
    search::{LARGEST_ORDER, Prepared, START_SAMPLES, SearchResult, search, splits},
    shape::{Kink, Local, Roughness, Shape, thinned},
    split::{Candidate, fit_shape},
    structure::{Form, changes},
    units::{Blocks, Scale, abscissas, blocks, conventional_gain, mapped, tabulated},
    whitened::descend_through,
};

/// A linear approximation that explains less than this share of the output's variance is a weak start.
pub(super) const WEAK: f64 = 0.1;
