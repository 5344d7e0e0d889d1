//! Models without blocks, to compare those with blocks to: what could be predicted at all from this record.
//!
//! [`Narx`] feeds past outputs back, [`Volterra`] only looks at past inputs. Neither tells where the nonlinearity sits; a
//! model of blocks that comes near them has found the structure, one that stays far behind has not.

mod narx;
mod ridge;
mod volterra;

pub use narx::{Narx, NarxIdentification, NarxModel, NarxTerm, TriedNarx};
pub use volterra::{DecayPrior, Volterra, VolterraIdentification, VolterraModel};
