//! The required accuracy of an integration, and the limit on its length.

use crate::error::{Error, Result};

/// The required accuracy of an integration.
///
/// | field | default | range |
/// |---|---|---|
/// | `rtol` | 1e-9 | 1e-14 to 0.1: the error of a step relative to each component of the state |
/// | `atol` | 1e-12 | positive: the error of a step that is always allowed, in the state's units |
/// | `max_steps` | 10 000 000 | at least 1: accepted and rejected steps together |
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Relative tolerance of a step.
    pub rtol: f64,
    /// Absolute tolerance of a step, in the units of the state.
    pub atol: f64,
    /// The number of steps, accepted or not, after which the integration gives up.
    pub max_steps: u64,
}

impl Default for Tolerances {
    fn default() -> Self {
        Tolerances {
            rtol: 1e-9,
            atol: 1e-12,
            max_steps: 10_000_000,
        }
    }
}

impl Tolerances {
    /// Checks the ranges.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a tolerance outside its range.
    pub fn check(&self) -> Result<()> {
        let invalid = |name: &str, value, requirement| Error::parameter(name, value, requirement);
        if !(1e-14..=0.1).contains(&self.rtol) {
            return Err(invalid("rtol", self.rtol, "between 1e-14 and 0.1"));
        }
        if !(self.atol > 0.0 && self.atol.is_finite()) {
            return Err(invalid("atol", self.atol, "positive and finite"));
        }
        if self.max_steps == 0 {
            return Err(invalid("max_steps", 0.0, "at least 1"));
        }
        Ok(())
    }
}
