//! Models without blocks, to compare those with blocks to: what could be predicted at all from this record.
//!
//! [`Narx`] feeds past outputs back, [`Volterra`] only looks at past inputs. Neither tells where the nonlinearity sits; a
//! model of blocks that comes near them has found the structure, one that stays far behind has not.

pub(super) mod narx;
mod ridge;
pub(super) mod volterra;

pub use narx::{Narx, NarxModel, NarxTerm};
pub use volterra::{DecayPrior, Volterra, VolterraModel};
