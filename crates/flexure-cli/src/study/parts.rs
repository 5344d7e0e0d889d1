//! The parts of the study of convergence rates, and their state in a file.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Result, bail};
use clap::ValueEnum;
use flexure::study::{
    Checkpoint, EstimatorSetting, EstimatorStudy, Experiment, RateStudy, RateTable, RefinedSetting, RefinedStudy,
    Setting, Study,
};
use flexure_io::read_text;
use serde::{Deserialize, Serialize};

use crate::files::write_text;

/// What `format` says in every state file.
const FORMAT: &str = "flexure-study";

/// What a sample costs in each part, about, as a multiple of one in a kernel estimate at a point.
const COST: [f64; 4] = [1.0, 100.0, 10.0, 1000.0];

/// A part by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// The plain estimate: Theorems 1 and 2.
    Plain,
    /// The refined identification.
    Refined,
    /// Every estimator of a static nonlinearity but the network.
    Estimators,
    /// The network, which takes its time to train.
    Networks,
}

/// What was asked for.
pub struct Plan {
    pub parts: Vec<Part>,
    pub full: bool,
    pub lengths: Vec<usize>,
    pub runs: Option<usize>,
    pub seed: u64,
}

impl Plan {
    /// A part's study, if it was asked for.
    fn of<S: Experiment + Clone + Sync>(&self, part: Part, quick: Study<S>, full: Study<S>) -> Option<Checkpoint<S>> {
        if !self.parts.contains(&part) {
            return None;
        }
        let mut study = if self.full { full } else { quick };
        if !self.lengths.is_empty() {
            study.lengths.clone_from(&self.lengths);
        }
        study.runs = self.runs.unwrap_or(study.runs);
        study.seed = self.seed;
        Some(Checkpoint::new(study))
    }
}

/// The parts with what has been measured of them.
#[derive(Serialize, Deserialize)]
pub struct Parts {
    format: String,
    plain: Option<Checkpoint<Setting>>,
    refined: Option<Checkpoint<RefinedSetting>>,
    estimators: Option<Checkpoint<EstimatorSetting>>,
    networks: Option<Checkpoint<EstimatorSetting>>,
}

/// What was measured.
#[derive(Serialize)]
pub struct Outcome {
    /// Whether everything agrees with theory.
    pub agrees: bool,
    pub plain: Option<RateTable<Setting>>,
    pub refined: Option<RateTable<RefinedSetting>>,
    pub estimators: Option<RateTable<EstimatorSetting>>,
    pub networks: Option<RateTable<EstimatorSetting>>,
}

impl Outcome {
    /// The tables, each with its heading.
    pub fn tables(&self) -> Vec<String> {
        let titled = |title: &str, table: Option<String>| table.map(|table| format!("{title}\n\n{table}"));
        let tables = [
            titled(
                "Plain estimate, Theorems 1 and 2",
                self.plain.as_ref().map(ToString::to_string),
            ),
            titled("Refined identification", self.refined.as_ref().map(ToString::to_string)),
            titled("Static estimators", self.estimators.as_ref().map(ToString::to_string)),
            titled("Networks", self.networks.as_ref().map(ToString::to_string)),
        ];
        tables.into_iter().flatten().collect()
    }

    /// The verdict in a sentence.
    pub fn sentence(&self) -> String {
        match self.agrees {
            true => "All slopes agree with theory (95 % intervals that hold jointly, and 0.01 for finite n).".to_owned(),
            false => {
                "Some slopes differ from theory (95 % intervals that hold jointly, and 0.01 for finite n); the tables say which."
                    .to_owned()
            }
        }
    }
}

impl Parts {
    /// Nothing measured yet.
    pub fn new(plan: &Plan) -> Self {
        Parts {
            format: FORMAT.to_owned(),
            plain: plan.of(Part::Plain, RateStudy::quick(), RateStudy::full()),
            refined: plan.of(Part::Refined, RefinedStudy::quick(), RefinedStudy::full()),
            estimators: plan.of(Part::Estimators, EstimatorStudy::quick(), EstimatorStudy::full()),
            networks: plan.of(
                Part::Networks,
                EstimatorStudy::quick_network(),
                EstimatorStudy::full_network(),
            ),
        }
    }

    /// Whether both are about the same study, whatever has been measured of it.
    fn same_study(&self, other: &Parts) -> bool {
        fn study<S>(part: &Option<Checkpoint<S>>) -> Option<&Study<S>>
        where
            S: Experiment + Clone + Sync,
        {
            part.as_ref().map(Checkpoint::study)
        }
        study(&self.plain) == study(&other.plain)
            && study(&self.refined) == study(&other.refined)
            && study(&self.estimators) == study(&other.estimators)
            && study(&self.networks) == study(&other.networks)
    }

    /// The share of the work that is done.
    pub fn done(&self) -> f64 {
        let [spent, total] = self.work();
        spent / total
    }

    fn work(&self) -> [f64; 2] {
        let all = [
            work(&self.plain, COST[0]),
            work(&self.refined, COST[1]),
            work(&self.estimators, COST[2]),
            work(&self.networks, COST[3]),
        ];
        [0, 1].map(|k| all.iter().map(|part| part[k]).sum())
    }

    /// Measures the next error that is missing; false if none is.
    ///
    /// # Errors
    /// Those of [`Study::run`].
    pub fn step(&mut self, progress: &dyn Fn(f64)) -> flexure::Result<bool> {
        let [spent, total] = self.work();
        let at = |more: f64| progress((spent + more) / total);
        Ok(step(&mut self.plain, COST[0], &at)?
            || step(&mut self.refined, COST[1], &at)?
            || step(&mut self.estimators, COST[2], &at)?
            || step(&mut self.networks, COST[3], &at)?)
    }

    /// The tables of what has been measured.
    pub fn outcome(&self) -> Outcome {
        let plain = self.plain.as_ref().map(Checkpoint::table);
        let refined = self.refined.as_ref().map(Checkpoint::table);
        let estimators = self.estimators.as_ref().map(Checkpoint::table);
        let networks = self.networks.as_ref().map(Checkpoint::table);
        Outcome {
            agrees: plain.as_ref().is_none_or(RateTable::agrees)
                && refined.as_ref().is_none_or(RateTable::agrees)
                && estimators.as_ref().is_none_or(RateTable::agrees)
                && networks.as_ref().is_none_or(RateTable::agrees),
            plain,
            refined,
            estimators,
            networks,
        }
    }
}

/// What is done of a part, and all of it.
fn work<S: Experiment + Clone + Sync>(part: &Option<Checkpoint<S>>, cost: f64) -> [f64; 2] {
    let samples = part.as_ref().map_or([0, 0], |part| [part.spent(), part.total()]);
    samples.map(|samples| cost * samples as f64)
}

/// The next step of a part; `progress` is told the work of this step so far.
fn step<S: Experiment + Clone + Sync>(
    part: &mut Option<Checkpoint<S>>,
    cost: f64,
    progress: &dyn Fn(f64),
) -> flexure::Result<bool> {
    let Some(part) = part else { return Ok(false) };
    let before = part.spent();
    part.step(&mut |done, _| {
        progress(cost * (done - before) as f64);
        ControlFlow::Continue(())
    })
}

/// Reads the state of the study that `asked` is about.
///
/// # Errors
/// Where the file cannot be read, is no such state, or is that of another study.
pub fn load(path: &Path, asked: &Parts) -> Result<Parts> {
    let name = path.display();
    let state: Parts = match serde_json::from_str(&read_text(path)?) {
        Ok(state) => state,
        Err(error) => bail!("{name}: not the state of a study ({error}); name another file, or remove this one"),
    };
    if state.format != FORMAT {
        bail!(
            "{name}: not the state of a study: its \"format\" is \"{}\", not \"{FORMAT}\"",
            state.format
        );
    }
    if !state.same_study(asked) {
        bail!(
            "{name}: the state of another study: give the same --parts, --full, --lengths, --runs and --seed as then, or name another file"
        );
    }
    Ok(state)
}

/// Writes the state.
///
/// # Errors
/// Where the file cannot be written; it is then as it was before.
pub fn save(path: &Path, parts: &Parts) -> Result<()> {
    let text = serde_json::to_string(parts)?;
    write_text(path, &text)
}
