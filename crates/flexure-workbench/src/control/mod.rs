//! Control scenarios: every controller in the same loop, over seeds, and the result as text, JSON and page.

mod build;
mod outcome;
mod page;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use anyhow::{Result, bail};
use flexure::control::estimation::Consistency;
use flexure::control::{Controller, Figures, LoopOptions, Run, run_loop_watched, start_of, tip};
use flexure::manipulator::{Arm, Link};
use flexure::simulation::{Sampling, batch};
use flexure_io::arm::{ControllerTable, Scenario};

pub use outcome::{Outcome, Row, Spread};

/// A controller that a caller brings along.
pub type OwnController = Box<dyn Fn() -> Box<dyn Controller> + Sync>;

/// What is compared: a controller of the scenario, or one that is brought along.
struct Contestant<'a> {
    name: String,
    table: Option<&'a ControllerTable>,
    own: Option<&'a OwnController>,
}

/// A run with what it was judged by.
struct Judged {
    figures: Figures,
    unshaped: Option<f64>,
    kept: Vec<[f64; 2]>,
    /// Of the first seed alone: a run of a minute takes megabytes.
    run: Option<Run>,
}

/// Runs all controllers of a scenario, and those in `own`, with `seeds` runs of each (left out: as the scenario says).
///
/// `progress` is called with the share that is done, from several threads, and stops the work by `Break`. What comes out is the same for any
/// number of threads.
///
/// # Errors
/// For a scenario whose controllers cannot be made, and where the work was stopped. A controller that makes the arm unstable is part of
/// the result.
pub fn compare(
    scenario: &Scenario,
    own: &[(String, OwnController)],
    seeds: Option<usize>,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Result<Outcome> {
    let tables = scenario.controllers.iter().map(|table| Contestant {
        name: table.name.clone(),
        table: Some(table),
        own: None,
    });
    let brought = own.iter().map(|(name, make)| Contestant {
        name: name.clone(),
        table: None,
        own: Some(make),
    });
    let all: Vec<Contestant> = tables.chain(brought).collect();
    let seeds = seeds.unwrap_or(scenario.seeds);
    let jobs: Vec<(usize, u64)> = (0..all.len())
        .flat_map(|i| (0..seeds as u64).map(move |k| (i, scenario.options.seed.wrapping_add(k))))
        .collect();
    let plant = Arm::new(scenario.plant)?;
    // What cannot be made is found before anything runs.
    for contestant in &all {
        build::contestant(scenario, contestant)?;
    }
    let done = AtomicUsize::new(0);
    let stopped = AtomicBool::new(false);
    let results = batch(&jobs, |&(i, seed)| {
        if stopped.load(Ordering::Relaxed) {
            return None;
        }
        let judged = judge(scenario, &plant, &all[i], seed, &stopped);
        let share = (1 + done.fetch_add(1, Ordering::Relaxed)) as f64 / jobs.len() as f64;
        if progress(share).is_break() {
            stopped.store(true, Ordering::Relaxed);
        }
        Some(judged)
    });
    if stopped.load(Ordering::Relaxed) || results.len() < jobs.len() {
        bail!("stopped, as asked");
    }
    let mut rows = Vec::with_capacity(all.len());
    let mut results = results.into_iter().flatten();
    for contestant in &all {
        let of_this: Vec<_> = results.by_ref().take(seeds).collect();
        rows.push(Row::new(contestant.name.clone(), of_this, extent(scenario)));
    }
    Ok(Outcome {
        rows,
        seeds,
        links: scenario.plant.links,
        end: scenario.motion.trajectory().end(),
        sample_time: scenario.options.sampling.sample_time(),
    })
}

/// The diagonal of the box around the tip's reference, m.
fn extent(scenario: &Scenario) -> f64 {
    const PLACES: usize = 1000;
    let trajectory = scenario.motion.trajectory();
    let place = |k: usize| {
        let q = trajectory.at(trajectory.end() * k as f64 / PLACES as f64);
        tip(&scenario.plant.links, q.map(|q| q.value()))
    };
    let mut range = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for k in 0..=PLACES {
        let p = place(k);
        range = [
            [0, 1].map(|j| range[0][j].min(p[j])),
            [0, 1].map(|j| range[1][j].max(p[j])),
        ];
    }
    (range[1][0] - range[0][0]).hypot(range[1][1] - range[0][1])
}

/// One run.
fn judge(
    scenario: &Scenario,
    plant: &Arm,
    contestant: &Contestant,
    seed: u64,
    stopped: &AtomicBool,
) -> Result<Judged, flexure::Error> {
    let links = scenario.plant.links;
    let plain = build::contestant(scenario, contestant)?;
    let (run, figures, kept) = driven(scenario, plant, plain, seed, &links, stopped)?;
    // A shaped controller is measured against itself without the shaper.
    let shaped = contestant.table.filter(|table| table.shaper.is_some());
    let unshaped = match shaped {
        None => None,
        Some(table) => {
            let table = ControllerTable {
                shaper: None,
                ..table.clone()
            };
            let without = Contestant {
                name: String::new(),
                table: Some(&table),
                own: None,
            };
            let made = build::contestant(scenario, &without)?;
            let (_, without, _) = driven(scenario, plant, made, seed, &links, stopped)?;
            Some(figures.residual_vibration / without.residual_vibration)
        }
    };
    Ok(Judged {
        figures,
        unshaped,
        kept,
        run: (seed == scenario.options.seed).then_some(run),
    })
}

type Driven = (Run, Figures, Vec<[f64; 2]>);

fn driven(
    scenario: &Scenario,
    plant: &Arm,
    made: build::Made,
    seed: u64,
    links: &[Link; 2],
    stopped: &AtomicBool,
) -> Result<Driven, flexure::Error> {
    let build::Made {
        mut controller,
        mut estimator,
        trajectory,
    } = made;
    let step = scenario.options.sampling.sample_time();
    let options = LoopOptions {
        seed,
        sampling: Sampling::new(trajectory.end() + scenario.hold, step)?,
        ..scenario.options
    };
    let start = start_of(plant, trajectory.as_ref());
    let mut watch = |_: f64| match stopped.load(Ordering::Relaxed) {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    };
    let run = run_loop_watched(
        plant,
        start,
        controller.as_mut(),
        estimator.as_estimator(),
        trajectory.as_ref(),
        &options,
        &mut watch,
    )?;
    let figures = Figures::new(&run, links, trajectory.end());
    Ok((run, figures, estimator.kept()))
}

/// The consistency of a filter over runs, where there is one.
fn consistency(kept: &[[f64; 2]]) -> Option<Consistency> {
    (!kept.is_empty()).then(|| Consistency::new(kept))
}
