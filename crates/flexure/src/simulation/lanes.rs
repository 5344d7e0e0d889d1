//! Several plants in time, each in a lane of a register.
//!
//! Every lane has a time and a step size of its own, and is at an instant of its own; the lanes share nothing but the instructions. So a
//! plant moves as it does alone, bit for bit, whatever its neighbours do.

use std::ops::ControlFlow;

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::control::{Attempt, Control, EVALUATIONS, STEPS_PER_CALL};
use super::hold::Sampling;
use super::step::{combine, step, still};
use super::tolerances::Tolerances;
use crate::error::{Error, Result, Stopped};
use crate::number::{LANES, Lanes};

/// What gets the number of a row, its state and its input.
type RowSink<'a, const N: usize, const M: usize> = &'a mut dyn FnMut(usize, &[f64; N], &[f64; M]);

/// A plant of `N` components that is run in a lane under `M` inputs, as by [`run_held`](super::run_held).
pub(crate) struct HeldLane<'a, const N: usize, const M: usize> {
    pub initial: [f64; N],
    pub tolerances: Tolerances,
    pub sampling: Sampling,
    /// The input that is held from an instant on.
    pub input: &'a dyn Fn(usize, &[f64; N]) -> [f64; M],
    /// Gets the state at every instant, and that input.
    pub row: RowSink<'a, N, M>,
    pub watch: &'a mut dyn FnMut(f64) -> ControlFlow<()>,
}

/// What is known of a lane beside its state.
struct Lane<const N: usize, const M: usize> {
    /// The place of its run.
    run: usize,
    control: Control,
    /// The next instant.
    instant: usize,
    held: [f64; M],
    /// Whether the slope is to be evaluated anew, as the input has jumped.
    restarted: bool,
    attempt: Attempt,
    /// Whether the run goes on.
    running: bool,
}

impl<const N: usize, const M: usize> Lane<N, M> {
    fn new(place: usize, run: &mut HeldLane<N, M>) -> Result<Self> {
        let control = Control::new(0.0, &run.initial, run.tolerances)?;
        control.check_instants(run.sampling.rows())?;
        let held = (run.input)(0, &run.initial);
        (run.row)(0, &run.initial, &held);
        Ok(Lane {
            run: place,
            control,
            instant: 1,
            held,
            restarted: true,
            attempt: Attempt::default(),
            running: run.sampling.rows() > 1,
        })
    }

    /// The size of the next step.
    fn attempt(&mut self, run: &HeldLane<N, M>) -> Result<f64> {
        let preferred = self.control.step.unwrap_or_default();
        self.attempt = self
            .control
            .attempt(preferred, run.sampling.instant(self.instant), EVALUATIONS)?;
        Ok(self.attempt.h)
    }

    /// Hands out the row of the next instant if it is reached, in the state `x`, and takes its input.
    fn arrive(&mut self, run: &mut HeldLane<N, M>, x: impl Fn() -> [f64; N]) -> Result<()> {
        self.control.show(STEPS_PER_CALL, run.watch)?;
        let time = self.control.t;
        if time < run.sampling.instant(self.instant) {
            return Ok(());
        }
        let x = x();
        let next = (run.input)(self.instant, &x);
        self.restarted = next != self.held;
        self.held = next;
        (run.row)(self.instant, &x, &next);
        if (run.watch)(time).is_break() {
            return Err(Error::Stopped(Stopped::Simulating { time }));
        }
        self.instant += 1;
        self.running = self.instant < run.sampling.rows();
        Ok(())
    }
}

/// The runs of a group, and their results.
struct Group<'r, 'a, const N: usize, const M: usize> {
    runs: &'r mut [HeldLane<'a, N, M>],
    lanes: Vec<Lane<N, M>>,
    results: Vec<Result<()>>,
}

impl<'r, 'a, const N: usize, const M: usize> Group<'r, 'a, N, M> {
    fn new(runs: &'r mut [HeldLane<'a, N, M>]) -> Self {
        let (mut lanes, mut results) = (Vec::with_capacity(runs.len()), Vec::with_capacity(runs.len()));
        for (place, run) in runs.iter_mut().enumerate() {
            let lane = Lane::new(place, run);
            results.push(lane.map(|lane| lanes.push(lane)));
        }
        Group { runs, lanes, results }
    }

    /// Calls `work` with the lanes of runs that go on and with their numbers; a run ends with its first error.
    #[inline(always)]
    fn each(&mut self, mut work: impl FnMut(usize, &mut Lane<N, M>, &mut HeldLane<'a, N, M>) -> Result<()>) {
        for (number, lane) in self.lanes.iter_mut().enumerate().filter(|(_, lane)| lane.running) {
            if let Err(error) = work(number, lane, &mut self.runs[lane.run]) {
                lane.running = false;
                self.results[lane.run] = Err(error);
            }
        }
    }

    fn any(&self, is: impl Fn(&Lane<N, M>) -> bool) -> bool {
        self.lanes.iter().any(|lane| lane.running && is(lane))
    }
}

/// The components of a lane.
#[inline(always)]
fn of_lane<S: Simd, const N: usize>(x: &[Lanes<S>; N], lane: usize) -> [f64; N] {
    let mut values = [0.0; N];
    for (value, x) in values.iter_mut().zip(x) {
        *value = x[lane];
    }
    values
}

/// Sets the components of a lane.
#[inline(always)]
fn set_lane<S: Simd, const N: usize>(x: &mut [Lanes<S>; N], lane: usize, values: &[f64; N]) {
    for (x, &value) in x.iter_mut().zip(values) {
        x[lane] = value;
    }
}

/// Up to [`LANES`] runs of `plant`, one in each lane; the components from `first_speed` on are speeds. The results are in their order.
#[inline(always)]
pub(crate) fn run_held_lanes<S: Simd, const N: usize, const M: usize>(
    simd: S,
    runs: &mut [HeldLane<N, M>],
    first_speed: usize,
    plant: impl Fn(&[Lanes<S>; N], &[Lanes<S>; M]) -> [Lanes<S>; N],
) -> Vec<Result<()>> {
    debug_assert!(runs.len() <= LANES);
    // The runs of one group have the same tolerances.
    let tolerances = runs[0].tolerances;
    let zero = Lanes::splat(simd, 0.0);
    let (mut x, mut u, mut slope) = ([zero; N], [zero; M], [zero; N]);
    let mut group = Group::new(runs);
    group.each(|number, lane, run| {
        set_lane(&mut x, number, &run.initial);
        set_lane(&mut u, number, &lane.held);
        Ok(())
    });
    loop {
        if group.any(|lane| lane.restarted) {
            slope = plant(&x, &u);
            let still = still(zero, &slope);
            group.each(|number, lane, _| match std::mem::take(&mut lane.restarted) {
                true => lane.control.check_slope(still[number] == 0.0),
                false => Ok(()),
            });
        }
        if group.any(|lane| lane.control.step.is_none()) {
            first_steps(
                &mut group,
                &x,
                &slope,
                zero,
                #[inline(always)]
                |x| plant(x, &u),
            );
        }
        let mut h = zero;
        group.each(|number, lane, run| {
            h[number] = lane.attempt(run)?;
            Ok(())
        });
        if !group.any(|_| true) {
            return group.results;
        }
        let trial = step(
            #[inline(always)]
            |_, x: &[Lanes<S>; N]| plant(x, &u),
            zero,
            &x,
            &slope,
            h,
        );
        let error = trial.error(&tolerances, &x, h);
        let slope_new = plant(&trial.x, &u);
        let arrival = trial.arrival(&slope_new, first_speed, zero);
        let mut accepted = zero;
        group.each(|number, lane, run| {
            let error = error.of_lane(number);
            if !(error.value() <= 1.0) {
                let end = run.sampling.instant(lane.instant);
                return lane.control.reject(&lane.attempt, &error, end);
            }
            accepted[number] = 1.0;
            lane.control.accept(&lane.attempt, &error, &arrival.of_lane(number))?;
            lane.arrive(run, || of_lane(&trial.x, number))?;
            set_lane(&mut u, number, &lane.held);
            Ok(())
        });
        let accepted = accepted.simd_gt(0.0);
        for i in 0..N {
            x[i] = accepted.select(trial.x[i], x[i]);
            slope[i] = accepted.select(slope_new[i], slope[i]);
        }
    }
}

/// The first step size of every lane that has none.
#[inline(always)]
fn first_steps<S: Simd, const N: usize, const M: usize>(
    group: &mut Group<N, M>,
    x: &[Lanes<S>; N],
    slope: &[Lanes<S>; N],
    zero: Lanes<S>,
    plant: impl Fn(&[Lanes<S>; N]) -> [Lanes<S>; N],
) {
    let mut short = zero;
    group.each(|number, lane, run| {
        let span = run.sampling.instant(lane.instant) - lane.control.t;
        short[number] = (lane.control).short_step(&of_lane(x, number), &of_lane(slope, number), span);
        Ok(())
    });
    let ahead = plant(&combine(x, short, &[1.0], std::slice::from_ref(slope)));
    let mut change = ahead;
    for i in 0..N {
        change[i] = ahead[i] - slope[i];
    }
    group.each(|number, lane, _| {
        if lane.control.step.is_none() {
            let (x, slope) = (of_lane(x, number), of_lane(slope, number));
            let first = (lane.control).first_step(&x, &slope, &of_lane(&change, number), short[number]);
            lane.control.step = Some(first);
        }
        Ok(())
    });
}
