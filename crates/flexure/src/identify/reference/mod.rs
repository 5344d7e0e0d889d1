//! Models without blocks, for comparison with block models: how well this record can be predicted at all.
//!
//! [`NARX`] feeds past outputs back, [`VOLTERRA`] only looks at past inputs. Neither shows where the nonlinearity is. If a block model is
//! nearly as good as they are, it has found the structure; if it is far worse, it has not.

mod limits;
mod narx;
mod ridge;
mod volterra;

pub use narx::ROW as NARX;
pub use volterra::{DecayPrior, ROW as VOLTERRA};
