//! The identification of any structure: with missing outputs and outliers, and what is said of the inputs.

use std::ops::ControlFlow;

use super::request::{Options, Progress, Request, Structure};
use super::result::Identification;
use super::{missed_dynamics, missing, needless, reaction, robust};
use crate::error::Result;
use crate::record::Record;

impl Structure {
    /// Identifies a system of this structure from `inputs` to `output`, with the default choices.
    ///
    /// # Errors
    /// [`Error::Data`](crate::Error::Data): `MissingColumn`, `NonFinite`, `Constant`, `ConstantPart`, `DuplicateColumn` for an input that is given
    /// twice, `TooShort` (100 samples for a Hammerstein fit, 50 and 10 an input for a linear one, 200 an input for others), `Unit`; [`Error::Parameter`](crate::Error::Parameter) for a parameter
    /// outside its range and for a number of inputs that the structure does not take.
    pub fn identify(&self, record: &Record, inputs: &[&str], output: &str) -> Result<Identification> {
        let records = [record];
        let request = Request::new(&records, inputs, output, Options::default());
        self.identify_with(&request, &mut |_| ControlFlow::Continue(()))
    }

    /// Identifies what `request` asks for, with `progress` called before every step; it stops the identification by returning
    /// [`ControlFlow::Break`].
    ///
    /// The result depends neither on `progress` nor on the number of threads.
    ///
    /// # Errors
    /// Those of [`identify`](Self::identify); [`Error::Parameter`](crate::Error::Parameter) for several experiments if the method takes one;
    /// [`Error::Stopped`](crate::Error::Stopped) if `progress` stopped it.
    pub fn identify_with(&self, request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
        let result = self.identify_robustly(request, progress)?;
        let result = reaction::after_reaction(self, request, result, progress)?;
        let result = missed_dynamics::tested(result, request, progress)?;
        needless::warned(result, request)
    }

    /// The identification with the outliers left out or named.
    pub(super) fn identify_robustly(
        &self,
        request: &Request<'_>,
        progress: &mut Progress<'_>,
    ) -> Result<Identification> {
        match request.options.robust {
            true => robust::identify(self, request, progress),
            false => robust::warned(self.identify_as_is(request, progress)?, request),
        }
    }

    /// The identification from all outputs that there are.
    pub(super) fn identify_as_is(&self, request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
        if !request.options.missing || request.is_whole() {
            return (self.identify)(request, progress);
        }
        let mut result = match self.is_refined(&request.options) {
            true => (self.identify)(request, progress)?,
            false => missing::identify(self, request, progress)?,
        };
        result.warnings.extend(missing::warning(&result, request)?);
        Ok(result)
    }
}
