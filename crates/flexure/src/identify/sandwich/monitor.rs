//! Progress, and a way to stop.

use std::ops::ControlFlow;

/// What an identification is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// Best linear approximations of several orders.
    Approximation,
    /// Sharing out their poles and zeros.
    Split,
    /// Refining the best splits on a part of the record.
    Screening,
    /// Adding and removing poles, numerator coefficients and pieces of the nonlinearity.
    Structure,
    /// Refining the model on all samples.
    Refinement,
}

impl Stage {
    /// In words, after "while".
    pub fn name(self) -> &'static str {
        match self {
            Stage::Approximation => "approximating linearly",
            Stage::Split => "splitting poles and zeros",
            Stage::Screening => "screening the splits",
            Stage::Structure => "choosing the structure",
            Stage::Refinement => "refining on all samples",
        }
    }
}

/// Asks whether to go on; once stopped, for good.
pub(in crate::identify) struct Monitor<'a> {
    progress: &'a mut dyn FnMut(Stage) -> ControlFlow<()>,
    pub stage: Stage,
    stopped: Option<Stage>,
}

impl<'a> Monitor<'a> {
    pub fn new(progress: &'a mut dyn FnMut(Stage) -> ControlFlow<()>) -> Self {
        Monitor {
            progress,
            stage: Stage::Approximation,
            stopped: None,
        }
    }

    /// Whether to go on.
    pub fn keep_on(&mut self) -> bool {
        if self.stopped.is_none() && (self.progress)(self.stage).is_break() {
            self.stopped = Some(self.stage);
        }
        self.stopped.is_none()
    }

    /// The stage at which it was stopped, if it was.
    pub fn stopped(&self) -> Option<Stage> {
        self.stopped
    }
}
