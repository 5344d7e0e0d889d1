//! What identifications from several inputs refuse.

use crate::error::{DataError, Error, Result};

/// Refuses an input that is given twice.
pub(super) fn refuse_repeated(inputs: &[&str]) -> Result<()> {
    let twice = inputs.iter().enumerate().find(|(i, name)| inputs[..*i].contains(name));
    twice.map_or(Ok(()), |(_, name)| {
        Err(Error::Data(DataError::DuplicateColumn {
            name: (*name).to_owned(),
        }))
    })
}
