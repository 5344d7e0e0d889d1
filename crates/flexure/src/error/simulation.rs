//! Simulations that cannot be continued, and computations that were stopped.

use crate::text::{exact, short};

/// Why and when a simulation could not be continued.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the simulation stopped at t = {} s: {reason}", short(*.time))]
pub struct SimulationError {
    /// The time reached, s.
    pub time: f64,
    /// Why it could not go on.
    pub reason: IntegrationFailure,
}

/// The computation that was stopped, and its progress.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Stopped {
    /// A simulation.
    #[error("stopped at t = {time} s, as asked")]
    Simulating {
        /// The simulated time reached, s.
        time: f64,
    },
    /// A study or another computation that draws samples.
    #[error("stopped after {done} of {total} samples, as asked")]
    Sampling {
        /// The samples simulated so far.
        done: usize,
        /// The samples in all.
        total: usize,
    },
    /// An identification.
    #[error("stopped while {stage}, as asked")]
    Identifying {
        /// What it was doing.
        stage: &'static str,
    },
    /// Any computation, by an [`Interrupt`](crate::Interrupt).
    #[error("stopped, as asked")]
    Interrupted,
}

/// Why an integration could not be continued.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IntegrationFailure {
    /// The permitted number of steps was reached.
    #[error(
        "{limit} steps were not enough{}; raise max_steps, loosen rtol and atol, or shorten the run",
        if *.stiff { " (the equations are stiff: a joint is very stiff or its friction very steep)" } else { "" }
    )]
    TooManySteps {
        /// The permitted number.
        limit: u64,
        /// Whether the step size was dictated by stability rather than by accuracy.
        stiff: bool,
    },
    /// No step is short enough for the tolerances.
    #[error(
        "a step of {} s is still too long for the tolerances; the motion grows without bound or the input is not smooth",
        short(*.step)
    )]
    StepTooSmall {
        /// The step that would have come next, s.
        step: f64,
    },
    /// A joint moves faster than any real joint.
    #[error("a joint moves faster than {} rad/s (m/s of a sliding one); a loop is unstable, or a torque or noise too large", exact(*.limit))]
    TooFast {
        /// The largest speed, rad/s or m/s.
        limit: f64,
    },
    /// The state or its derivative has overflowed.
    #[error("the motion is no longer finite; it grows without bound")]
    NotFinite,
}
