//! Many arms in time: several in the lanes of a register, over all cores.

use std::ops::ControlFlow;

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::arm::Arm;
use super::coefficients::{Coefficients, Form};
use super::simulate::{
    Deflected, Drive, Equations, EquationsOfMotion, Flexible, Rigid, Rows, SimulationOptions, check, held_input,
    simulate_watched,
};
use crate::error::Result;
use crate::number::{LANES, Lanes, Wide};
use crate::parallel;
use crate::record::Record;
use crate::simulation::{HeldLane, Tolerances, run_held_lanes};

/// Fewer arms than these are faster one after the other.
const WORTHWHILE: usize = 3;

/// An arm to simulate.
#[derive(Clone, Copy)]
pub struct ArmRun<'a> {
    /// The arm.
    pub arm: &'a Arm,
    /// What moves it.
    pub drive: Drive<'a>,
    /// How it is simulated.
    pub options: SimulationOptions,
}

/// What must be the same in all lanes.
type Kind = (Equations, Form, Tolerances);

/// Simulates many arms, over all cores of the current rayon thread pool: each exactly as [`simulate_watched`] does, with the same record
/// to the last bit or the same error, in their order. `watch` is called for all of them.
///
/// Arms in the lanes of a register take their steps at once: those under held torques, servos or deflections whose equations have the
/// same terms and whose tolerances are the same. They may differ in parameters, states, torques and lengths.
pub fn simulate_batch(runs: &[ArmRun], watch: &(dyn Fn(f64) -> ControlFlow<()> + Sync)) -> Vec<Result<Record>> {
    on(Wide::all().next(), runs, watch)
}

/// [`simulate_batch`] with these registers.
fn on(wide: Option<Wide>, runs: &[ArmRun], watch: &(dyn Fn(f64) -> ControlFlow<()> + Sync)) -> Vec<Result<Record>> {
    // If there are few runs, every thread has some.
    let size = match wide {
        Some(_) => runs.len().div_ceil(rayon::current_num_threads()).clamp(1, LANES),
        None => 1,
    };
    let groups = groups(runs, size);
    let of_groups = parallel::batch(&groups, |group| {
        let results = match wide {
            Some(wide) if group.len() >= WORTHWHILE => {
                in_lanes(wide, &group.iter().map(|&i| runs[i]).collect::<Vec<_>>(), watch)
            }
            _ => group.iter().map(|&i| alone(&runs[i], watch)).collect(),
        };
        group.iter().copied().zip(results).collect::<Vec<_>>()
    });
    let mut placed: Vec<(usize, Result<Record>)> = of_groups.into_iter().flatten().collect();
    placed.sort_by_key(|(place, _)| *place);
    placed.into_iter().map(|(_, result)| result).collect()
}

/// The places of the runs that go through the lanes together, at most `size` of one kind.
fn groups(runs: &[ArmRun], size: usize) -> Vec<Vec<usize>> {
    let mut groups = Vec::new();
    let mut open: Vec<(Kind, Vec<usize>)> = Vec::new();
    for (place, run) in runs.iter().enumerate() {
        if matches!(run.drive, Drive::Torque(_)) {
            groups.push(vec![place]);
            continue;
        }
        let equations = Equations::of(run.arm, &run.drive);
        let kind = (equations, run.arm.coefficients.form, run.options.tolerances);
        let group = match open.iter().position(|(k, _)| *k == kind) {
            Some(found) => found,
            None => {
                open.push((kind, Vec::new()));
                open.len() - 1
            }
        };
        open[group].1.push(place);
        if open[group].1.len() == size {
            groups.push(open.swap_remove(group).1);
        }
    }
    groups.extend(open.into_iter().map(|(_, places)| places));
    groups
}

fn alone(run: &ArmRun, watch: &(dyn Fn(f64) -> ControlFlow<()> + Sync)) -> Result<Record> {
    simulate_watched(run.arm, &run.drive, &run.options, &mut |t| watch(t))
}

/// Runs whose equations have the same terms, at most [`LANES`].
fn in_lanes(wide: Wide, runs: &[ArmRun], watch: &(dyn Fn(f64) -> ControlFlow<()> + Sync)) -> Vec<Result<Record>> {
    match Equations::of(runs[0].arm, &runs[0].drive) {
        Equations::Flexible => together::<8, Flexible>(wide, runs, watch),
        Equations::Rigid => together::<4, Rigid>(wide, runs, watch),
        Equations::Deflected => together::<4, Deflected>(wide, runs, watch),
    }
}

fn together<const N: usize, E: EquationsOfMotion<N>>(
    wide: Wide,
    runs: &[ArmRun],
    watch: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Vec<Result<Record>> {
    let checks: Vec<Result<()>> = runs
        .iter()
        .map(|run| check(run.arm, &run.drive, &run.options))
        .collect();
    let sound: Vec<&ArmRun> = runs
        .iter()
        .zip(&checks)
        .filter(|(_, check)| check.is_ok())
        .map(|(run, _)| run)
        .collect();
    let mut simulated = moved::<N, E>(wide, &sound, watch).into_iter();
    let record = |rows: Result<Rows>, run: &ArmRun| rows?.into_record(&run.options.sampling, run.arm.model());
    let results = checks.into_iter().zip(runs).filter_map(|(check, run)| match check {
        Ok(()) => simulated.next().map(|rows| record(rows, run)),
        Err(error) => Some(Err(error)),
    });
    results.collect()
}

/// The rows of checked runs.
fn moved<const N: usize, E: EquationsOfMotion<N>>(
    wide: Wide,
    runs: &[&ArmRun],
    watch: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Vec<Result<Rows>> {
    if runs.is_empty() {
        return Vec::new();
    }
    let mut rows: Vec<Rows> = runs.iter().map(|_| Rows::default()).collect();
    let inputs: Vec<_> = (runs.iter())
        .map(|run| move |k: usize, x: &[f64; N]| held_input::<N, E>(run.arm, &run.drive, &run.options.initial, k, x))
        .collect();
    let mut sinks: Vec<_> = (runs.iter().zip(&mut rows))
        .map(|(run, rows)| move |_: usize, x: &[f64; N], u: &[f64; 2]| rows.push(E::row(run.arm, x, u)))
        .collect();
    let mut watches: Vec<_> = runs.iter().map(|_| |t: f64| watch(t)).collect();
    let lanes = (runs.iter().zip(&inputs)).zip(sinks.iter_mut().zip(&mut watches));
    let mut lanes: Vec<HeldLane<N, 2>> = lanes
        .map(|((run, input), (row, watch))| HeldLane {
            initial: E::vector(&run.options.initial),
            tolerances: run.options.tolerances,
            sampling: run.options.sampling,
            input,
            row,
            watch,
        })
        .collect();
    let ended = match wide {
        #[cfg(target_arch = "x86_64")]
        Wide::Avx512(simd) => simd.vectorize(
            #[inline(always)]
            || run_lanes::<_, N, E>(simd, runs, &mut lanes),
        ),
        #[cfg(target_arch = "x86_64")]
        Wide::Avx2(simd) => simd.vectorize(
            #[inline(always)]
            || run_lanes::<_, N, E>(simd, runs, &mut lanes),
        ),
    };
    drop(lanes);
    drop(sinks);
    ended
        .into_iter()
        .zip(rows)
        .map(|(ended, rows)| ended.map(|()| rows))
        .collect()
}

/// [`run_held_lanes`] of arms, compiled for the processor of `simd`.
#[inline(always)]
fn run_lanes<S: Simd, const N: usize, E: EquationsOfMotion<N>>(
    simd: S,
    runs: &[&ArmRun],
    lanes: &mut [HeldLane<N, 2>],
) -> Vec<Result<()>> {
    // Lanes without a run have the coefficients of the last.
    let arm = |lane: usize| &runs[lane.min(runs.len() - 1)].arm.coefficients;
    let coefficients = Coefficients::gathered(arm(0).form, |of| Lanes::from_fn(simd, |lane| of(arm(lane))));
    run_held_lanes(
        simd,
        lanes,
        N / 2,
        #[inline(always)]
        |x, u| E::derivative(&coefficients, x, u),
    )
}

#[cfg(test)]
#[path = "batch_tests.rs"]
mod tests;
