//! Progress, and a way to stop.

use std::ops::ControlFlow;

use super::limits::MOST_NUMBERS;
use crate::error::{Error, Result, Stopped};
use crate::{interrupt, parallel};

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

    /// Runs independent jobs side by side, on all cores. The results are in the order of the jobs. A job needs memory for this many
    /// `numbers`. The jobs that run at once need at most [`MOST_NUMBERS`] together; a larger job runs alone.
    ///
    /// The progress function belongs to this thread. So it is called before the jobs that run at once, and not during them.
    pub fn side_by_side<J: Sync, R: Send>(
        &mut self,
        jobs: &[J],
        numbers: usize,
        run: impl Fn(&J, &mut Monitor<'_>) -> R + Sync,
    ) -> Vec<R> {
        let at_once = (MOST_NUMBERS / numbers.max(1)).max(1);
        let mut results = Vec::with_capacity(jobs.len());
        for jobs in jobs.chunks(at_once) {
            if let [alone] = jobs {
                results.push(run(alone, self));
                continue;
            }
            self.keep_on();
            let (stage, stopped) = (self.stage, self.stopped);
            results.extend(parallel::batch(jobs, |job| {
                let progress = &mut |_: &str| ControlFlow::Continue(());
                run(
                    job,
                    &mut Monitor {
                        progress,
                        stage,
                        stopped,
                    },
                )
            }));
        }
        results
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jobs_side_by_side_keep_their_order_and_are_told_to_stop() {
        for numbers in [0, MOST_NUMBERS / 2, usize::MAX] {
            for flow in [ControlFlow::Continue(()), ControlFlow::Break(())] {
                let progress = &mut |_: &str| flow;
                let mut monitor = Monitor::new(progress);
                let results = monitor.side_by_side(&[3, 1, 2], numbers, |job, monitor| (10 * job, monitor.keep_on()));
                assert_eq!(results, [30, 10, 20].map(|r| (r, flow.is_continue())), "{numbers}");
                assert_eq!(monitor.finished().is_ok(), flow.is_continue());
            }
        }
    }
}
