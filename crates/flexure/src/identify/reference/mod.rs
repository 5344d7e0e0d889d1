//! Models without blocks, to compare those with blocks to: what could be predicted at all from this record.
//!
//! [`Narx`] feeds past outputs back, [`Volterra`] only looks at past inputs. Neither tells where the nonlinearity sits; a
//! model of blocks that comes near them has found the structure, one that stays far behind has not.

mod narx;
mod ridge;
mod volterra;

pub use narx::{Narx, NarxIdentification, NarxModel, NarxTerm, TriedNarx};
pub use volterra::{DecayPrior, Volterra, VolterraIdentification, VolterraModel};

use super::branches::Columns;
use super::checks::warn_of_levels;
use super::outcome::{Verdict, Warning};
use crate::error::Result;

/// The verdict on the fresh part of a free run over the whole record, and what the user should know.
fn judged(columns: &Columns, predicted: &[f64]) -> Result<(Verdict, Vec<Warning>)> {
    let (u, fitted) = (columns.u[0], columns.fitted);
    let verdict = Verdict::new(&u[fitted..], &columns.y[fitted..], &predicted[fitted..])?;
    let mut warnings = Vec::new();
    warn_of_levels(&u[..fitted], &mut warnings);
    if verdict.measures.fit_percent <= 0.0 {
        warnings.push(Warning::Useless {
            fit_percent: verdict.measures.fit_percent,
        });
    }
    Ok((verdict, warnings))
}
