//! Control scenarios: every controller in the same loop, over seeds, and the result as text, JSON and page.

mod build;
mod outcome;
mod page;

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use anyhow::{Result, bail};
use flexure::control::estimation::Consistency;
use flexure::control::{Controller, Figures, LoopOptions, Plant, Run, run_loop_watched, tip};
use flexure::simulation::{Sampling, batch};
use flexure_io::arm::{Body, ControllerTable, Scenario, unusable_name};
use flexure_io::check_computed;

pub use outcome::{Outcome, Row, Spread};

/// A controller that the caller provides.
pub type OwnController = Box<dyn Fn() -> Box<dyn Controller> + Sync>;

/// What is compared: a controller of the scenario, or one that the caller provides.
struct ComparedController<'a> {
    name: String,
    table: Option<&'a ControllerTable>,
    own: Option<&'a OwnController>,
}

impl ComparedController<'_> {
    fn is_shaped(&self) -> bool {
        self.table.is_some_and(|table| table.shaper.is_some())
    }
}

/// The figures by which a run is judged.
struct Judged {
    figures: Figures,
    unshaped: Option<f64>,
    consistency: Option<Consistency>,
}

/// The most runs of all controllers together.
const MOST_RUNS: usize = 1_000_000;

/// The number of parts of a run; progress is reported after each.
const PARTS: usize = 64;

/// The progress of all runs.
struct Watch<'a> {
    done: AtomicUsize,
    all: usize,
    stopped: AtomicBool,
    progress: &'a (dyn Fn(f64) -> ControlFlow<()> + Sync),
}

impl Watch<'_> {
    fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }

    /// Reports that `parts` more are done.
    fn advance(&self, parts: usize) {
        let done = parts + self.done.fetch_add(parts, Ordering::Relaxed);
        if (self.progress)(done as f64 / self.all as f64).is_break() {
            self.stopped.store(true, Ordering::Relaxed);
        }
    }
}

/// The controllers of a scenario and those of the caller, each with a unique name.
fn compared<'a>(scenario: &'a Scenario, own: &'a [(String, OwnController)]) -> Result<Vec<ComparedController<'a>>> {
    let tables = scenario.controllers.iter().map(|table| ComparedController {
        name: table.name.clone(),
        table: Some(table),
        own: None,
    });
    let brought = own.iter().map(|(name, make)| ComparedController {
        name: name.clone(),
        table: None,
        own: Some(make),
    });
    let all: Vec<ComparedController> = tables.chain(brought).collect();
    for (i, controller) in all.iter().enumerate().skip(scenario.controllers.len()) {
        let others = all[..i].iter().map(|other| other.name.as_str());
        if let Some(reason) = unusable_name(&controller.name, others) {
            bail!("the name of system {}: {reason}", i + 1 - scenario.controllers.len());
        }
    }
    Ok(all)
}

/// Refuses a comparison without runs, with too many, or with runs that take too much memory.
fn check_runs(scenario: &Scenario, seeds: usize, controllers: usize) -> Result<()> {
    let runs = seeds.saturating_mul(controllers);
    if seeds == 0 {
        bail!("the seeds are 0, but at least one run is needed");
    }
    if runs > MOST_RUNS {
        bail!(
            "{seeds} runs of {controllers} controllers are {runs}, but they can be at most {MOST_RUNS}; use fewer seeds"
        );
    }
    // Kept runs and running ones each have the 25 columns of a record.
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let rows = scenario.options.sampling.rows();
    Ok(check_computed(
        rows.saturating_mul(controllers + threads.min(runs)),
        25,
    )?)
}

/// Runs all controllers of a scenario, and those in `own`, with `seeds` runs of each (left out: as the scenario says).
///
/// `progress` is called with the share that is done, from several threads, and stops the work by `Break`. The result is the same for any
/// number of threads.
///
/// # Errors
/// For a scenario whose controllers cannot be made, and if the work was stopped. A controller that makes the arm unstable is part of
/// the result.
pub fn compare(
    scenario: &Scenario,
    own: &[(String, OwnController)],
    seeds: Option<usize>,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Result<Outcome> {
    let all = compared(scenario, own)?;
    let seeds = seeds.unwrap_or(scenario.seeds);
    check_runs(scenario, seeds, all.len())?;
    let jobs: Vec<(usize, u64)> = (0..all.len())
        .flat_map(|i| (0..seeds as u64).map(move |k| (i, k)))
        .collect();
    let plant = build::plant(scenario)?;
    // Controllers that cannot be made are found before anything runs.
    for controller in &all {
        build::make(scenario, controller)?;
    }
    // A shaped controller runs twice.
    let weight = |controller: &ComparedController| if controller.is_shaped() { 2 } else { 1 };
    let watch = Watch {
        done: AtomicUsize::new(0),
        all: PARTS * seeds * all.iter().map(weight).sum::<usize>(),
        stopped: AtomicBool::new(false),
        progress,
    };
    // Each controller's first run that was completed; keeping others would take too much memory.
    let firsts: Vec<Mutex<Option<(u64, Run)>>> = all.iter().map(|_| Mutex::default()).collect();
    let results = batch(&jobs, |&(i, k)| {
        if watch.is_stopped() {
            return None;
        }
        let seed = scenario.options.seed.wrapping_add(k);
        Some(
            judge(scenario, plant.as_ref(), &all[i], seed, &watch).map(|(judged, run)| {
                if let Ok(mut first) = firsts[i].lock()
                    && first.as_ref().is_none_or(|(before, _)| k < *before)
                {
                    *first = Some((k, run));
                }
                judged
            }),
        )
    });
    if watch.is_stopped() || results.len() < jobs.len() {
        bail!("stopped, as asked");
    }
    let mut rows = Vec::with_capacity(all.len());
    let mut results = results.into_iter().flatten();
    for (controller, first) in all.iter().zip(firsts) {
        let of_this: Vec<_> = results.by_ref().take(seeds).collect();
        let run = first.into_inner().ok().flatten().map(|(_, run)| run);
        rows.push(Row::new(controller.name.clone(), of_this, run, extent(scenario)));
    }
    Ok(Outcome {
        rows,
        seeds,
        body: match scenario.body {
            Body::Arm { .. } => "the arm",
            Body::Link { .. } => "the flexible link",
        },
        links: scenario.links(),
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
        tip(&scenario.links(), q.map(|q| q.value()))
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
    plant: &dyn Plant,
    controller: &ComparedController,
    seed: u64,
    watch: &Watch,
) -> Result<(Judged, Run), flexure::Error> {
    let plain = build::make(scenario, controller)?;
    let (run, figures, kept) = driven(scenario, plant, plain, seed, watch)?;
    // A shaped controller is measured against itself without the shaper.
    let unshaped = match controller.table.filter(|_| controller.is_shaped()) {
        None => None,
        Some(table) => {
            let table = ControllerTable {
                shaper: None,
                ..table.clone()
            };
            let without = ComparedController {
                name: String::new(),
                table: Some(&table),
                own: None,
            };
            let made = build::make(scenario, &without)?;
            let (_, without, _) = driven(scenario, plant, made, seed, watch)?;
            Some(figures.residual_vibration / without.residual_vibration)
        }
    };
    let judged = Judged {
        figures,
        unshaped,
        consistency: (!kept.is_empty()).then(|| Consistency::new(&kept)),
    };
    Ok((judged, run))
}

type Driven = (Run, Figures, Vec<[f64; 2]>);

fn driven(
    scenario: &Scenario,
    plant: &dyn Plant,
    made: build::Made,
    seed: u64,
    watch: &Watch,
) -> Result<Driven, flexure::Error> {
    let build::Made {
        mut controller,
        mut estimator,
        trajectory,
    } = made;
    let step = scenario.options.sampling.sample_time();
    let end = trajectory.end() + scenario.hold;
    let options = LoopOptions {
        seed,
        sampling: Sampling::new(end, step)?,
        ..scenario.options
    };
    let mut told = 0;
    let mut tell = |t: f64| {
        let now = (PARTS as f64 * t / end) as usize;
        if now > told {
            watch.advance(now.min(PARTS) - told);
            told = now.min(PARTS);
        }
        match watch.is_stopped() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    };
    let run = run_loop_watched(
        plant,
        controller.as_mut(),
        estimator.as_estimator(),
        trajectory.as_ref(),
        &options,
        &mut tell,
    );
    // A failed run counts as done too.
    watch.advance(PARTS - told);
    let run = run?;
    let figures = Figures::new(&run, &scenario.links(), trajectory.end());
    Ok((run, figures, estimator.kept()))
}
