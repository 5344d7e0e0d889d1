//! Models without blocks, to compare those with blocks to: what could be predicted at all from this record.
//!
//! [`NARX`] feeds past outputs back, [`VOLTERRA`] only looks at past inputs. Neither shows where the nonlinearity sits; a
//! model of blocks that comes near them has found the structure, one that stays far behind has not.

mod limits;
mod narx;
mod ridge;
mod volterra;

pub use narx::ROW as NARX;
pub use volterra::{DecayPrior, ROW as VOLTERRA};
