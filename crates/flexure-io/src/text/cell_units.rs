//! A column with a unit behind each of its numbers.

use super::numbers::{Numbers, before_unit};
use crate::error::LineProblem;
use crate::units::factor;

/// The unit behind the numbers of a column.
pub(super) struct CellUnit {
    /// That of the first number.
    pub(super) unit: String,
    /// The same with other prefixes, from which numbers are converted.
    others: Vec<String>,
}

impl CellUnit {
    pub(super) fn new(unit: &str) -> Self {
        CellUnit {
            unit: unit.to_owned(),
            others: Vec::new(),
        }
    }

    /// The number in `field` in this unit; `None` if it is no number of it.
    ///
    /// # Errors
    /// As [`Numbers::number`].
    pub(super) fn number(&mut self, field: &str, line: u64, numbers: &mut Numbers) -> Result<Option<f64>, LineProblem> {
        let Some((number, own)) = before_unit(field) else {
            return Ok(None);
        };
        if own == self.unit {
            return numbers.number(number, line);
        }
        let Some(factor) = factor(own, &self.unit) else {
            return Ok(None);
        };
        if !self.others.iter().any(|other| other == own) {
            self.others.push(own.to_owned());
        }
        Ok(numbers.number(number, line)?.map(|value| value * factor))
    }

    /// A sentence on units that are converted.
    pub(super) fn words(&self, column: &str) -> Option<String> {
        let (unit, others) = (&self.unit, self.others.join(", "));
        (!others.is_empty())
            .then(|| format!("column '{column}' has numbers in {unit} and {others}; all are taken in {unit}"))
    }
}
