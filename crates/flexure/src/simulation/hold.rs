//! The simulation of plants from one sample instant to the next.

use std::ops::ControlFlow;

use super::{Advance, StateVector};
use crate::error::{Error, Result, Stopped};

/// The largest number of rows of a simulated record.
const MOST_ROWS: f64 = 1e8;

/// The uniform instants `0, T, 2T, ...` up to and including the last one within the duration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    sample_time: f64,
    rows: usize,
}

impl Sampling {
    /// The instants of `duration` seconds, `sample_time` seconds apart.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless both are positive and finite, the duration is at least one
    /// sample time, and there are at most 100 million instants.
    pub fn new(duration: f64, sample_time: f64) -> Result<Self> {
        let invalid = |name: &str, value, requirement| Error::parameter(name, value, requirement);
        if !(sample_time > 0.0 && sample_time.is_finite()) {
            return Err(invalid("sample_time", sample_time, "positive and finite (in s)"));
        }
        if !(duration > 0.0 && duration.is_finite()) {
            return Err(invalid("duration", duration, "positive and finite (in s)"));
        }
        // The quotient of two decimal numbers may lie just below the whole number that is meant.
        let steps = (duration / sample_time * (1.0 + 1e-12)).floor();
        if steps < 1.0 {
            return Err(invalid("duration", duration, "at least one sample time (in s)"));
        }
        if steps >= MOST_ROWS {
            return Err(invalid(
                "duration",
                duration,
                "less than 100 million sample times (in s); shorten it, or lengthen the sample time",
            ));
        }
        Ok(Sampling {
            sample_time,
            rows: steps as usize + 1,
        })
    }

    /// The time between two instants, s.
    pub fn sample_time(&self) -> f64 {
        self.sample_time
    }

    /// The number of instants.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Instant `k`, s. It is `k` times the sample time, so that rounding does not add up.
    pub fn instant(&self, k: usize) -> f64 {
        k as f64 * self.sample_time
    }
}

/// Runs `x' = plant(x, u)` with the input `input(k, x)` held from instant `k` to instant `k + 1`.
///
/// `row(k, x, u)` gets the state at every instant and the input that is held from then on. The integration restarts where the input jumps.
/// `watch` is called with the time at every instant (and within long intervals); `Break` stops.
///
/// # Errors
/// Those of [`Dop853::advance`](super::Dop853::advance); [`Error::Parameter`] for more instants than `max_steps` can reach.
pub fn run_held<X: StateVector, U, P, I>(
    solver: &mut impl Advance<X>,
    plant: P,
    input: I,
    sampling: &Sampling,
    row: &mut dyn FnMut(usize, &X, &U),
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<()>
where
    U: PartialEq,
    P: Fn(&X, &U) -> X,
    I: Fn(usize, &X) -> U,
{
    run_held_in_time(solver, |_, x: &X, u: &U| plant(x, u), input, sampling, row, watch)
}

/// [`run_held`] of `x' = plant(t, x, u)`, where `plant` is continuous in time.
pub(crate) fn run_held_in_time<X: StateVector, U, P, I>(
    solver: &mut impl Advance<X>,
    plant: P,
    input: I,
    sampling: &Sampling,
    row: &mut dyn FnMut(usize, &X, &U),
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<()>
where
    U: PartialEq,
    P: Fn(f64, &X, &U) -> X,
    I: Fn(usize, &X) -> U,
{
    solver.check_instants(sampling.rows())?;
    let mut held = input(0, solver.x());
    row(0, solver.x(), &held);
    for k in 1..sampling.rows() {
        solver.advance(&|t, x: &X| plant(t, x, &held), sampling.instant(k), watch)?;
        let next = input(k, solver.x());
        if next != held {
            solver.restart();
        }
        held = next;
        row(k, solver.x(), &held);
        check(watch, solver.t())?;
    }
    Ok(())
}

/// Runs `x' = plant(t, x)`, where `plant` is continuous in time.
///
/// `row(k, x)` gets the state at every instant. `watch` is as in [`run_held`].
///
/// # Errors
/// Those of [`Dop853::advance`](super::Dop853::advance); [`Error::Parameter`] for more instants than `max_steps` can reach.
pub fn run_continuous<X: StateVector, P>(
    solver: &mut impl Advance<X>,
    plant: P,
    sampling: &Sampling,
    row: &mut dyn FnMut(usize, &X),
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<()>
where
    P: Fn(f64, &X) -> X,
{
    solver.check_instants(sampling.rows())?;
    row(0, solver.x());
    for k in 1..sampling.rows() {
        solver.advance(&plant, sampling.instant(k), watch)?;
        row(k, solver.x());
        check(watch, solver.t())?;
    }
    Ok(())
}

/// Asks `watch` whether to go on.
fn check(watch: &mut dyn FnMut(f64) -> ControlFlow<()>, time: f64) -> Result<()> {
    if watch(time).is_break() {
        return Err(Error::Stopped(Stopped::Simulating { time }));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::{Dop853, Tolerances};

    #[test]
    fn instants_are_multiples_of_the_sample_time_up_to_the_duration() {
        let rows = |d, t| Sampling::new(d, t).unwrap().rows();
        assert_eq!(rows(10.0, 0.01), 1001);
        assert_eq!(rows(0.3, 0.1), 4); // 0.3 / 0.1 is just below 3
        assert_eq!(rows(0.35, 0.1), 4);
        assert_eq!(Sampling::new(1.0, 0.1).unwrap().instant(7), 7.0 * 0.1);
    }

    #[test]
    fn more_instants_than_steps_are_refused_before_the_first() {
        let tolerances = Tolerances {
            max_steps: 20,
            ..Tolerances::default()
        };
        let run = |duration: f64| {
            let mut solver = Dop853::new(0.0, [1.0], tolerances)?;
            let sampling = Sampling::new(duration, 0.1)?;
            let mut rows = 0;
            let watch = &mut |_| ControlFlow::Continue(());
            let plant = |x: &[f64; 1], _: &()| [-x[0]];
            run_held(
                &mut solver,
                plant,
                |_, _| (),
                &sampling,
                &mut |_, _, _| rows += 1,
                watch,
            )?;
            Ok::<usize, Error>(rows)
        };
        assert_eq!(run(1.0).unwrap(), 11);
        let message = run(2.1).unwrap_err().to_string();
        assert!(
            message.contains("max_steps is 20") && message.contains("lengthen the sample time"),
            "{message}"
        );
    }

    #[test]
    fn bad_times_are_named() {
        for (d, t, word) in [
            (1.0, 0.0, "sample_time"),
            (1.0, f64::NAN, "sample_time"),
            (-1.0, 0.1, "duration"),
            (f64::INFINITY, 0.1, "duration"),
            (0.05, 0.1, "at least one sample time"),
            (1e9, 1e-3, "100 million"),
        ] {
            let message = Sampling::new(d, t).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
    }
}
