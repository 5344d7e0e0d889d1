//! Progress, and a way to stop.

use std::ops::ControlFlow;

use crate::error::{Error, Result, Stopped};
use crate::interrupt;

/// What an identification is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::identify) enum Stage {
    /// Best linear approximations of several orders.
    Approximation,
    /// Correlating the output, and functions of it, with the input's past.
    Correlation,
    /// Splitting the approximations' poles and zeros between the blocks.
    Split,
    /// Refining the best starts on a part of the record.
    Screening,
    /// Adding and removing poles, numerator coefficients and pieces of the nonlinearity.
    Structure,
    /// Refining the model on all samples.
    Refinement,
}

impl Stage {
    /// Its name, as it follows "while".
    pub fn name(self) -> &'static str {
        match self {
            Stage::Approximation => "approximating linearly",
            Stage::Correlation => "correlating",
            Stage::Split => "splitting poles and zeros",
            Stage::Screening => "screening the starts",
            Stage::Structure => "choosing the structure",
            Stage::Refinement => "refining on all samples",
        }
    }
}

/// Asks whether to continue; once stopped, it stays stopped.
pub(in crate::identify) struct Monitor<'a> {
    progress: &'a mut dyn FnMut(&str) -> ControlFlow<()>,
    pub stage: Stage,
    stopped: Option<Stage>,
}

impl<'a> Monitor<'a> {
    /// `progress` gets the name of the stage before every step; it stops the work by returning [`ControlFlow::Break`].
    pub fn new(progress: &'a mut dyn FnMut(&str) -> ControlFlow<()>) -> Self {
        Monitor {
            progress,
            stage: Stage::Approximation,
            stopped: None,
        }
    }

    /// Whether to continue.
    pub fn keep_on(&mut self) -> bool {
        if self.stopped.is_none() && (interrupt::requested() || (self.progress)(self.stage.name()).is_break()) {
            self.stopped = Some(self.stage);
        }
        self.stopped.is_none()
    }

    /// The stage at which it was stopped, if it was.
    pub fn stopped(&self) -> Option<Stage> {
        self.stopped
    }

    /// Checks that it was never stopped.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn finished(&self) -> Result<()> {
        match self.stopped {
            Some(stage) => Err(Error::Stopped(Stopped::Identifying { stage: stage.name() })),
            None => Ok(()),
        }
    }
}
