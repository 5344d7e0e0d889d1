//! The study of convergence rates: its parts, their measurements so far, and the result as text, JSON and page.

mod page;

use std::ops::ControlFlow;

use anyhow::{Context as _, Result, bail};
use flexure::study::{
    Checkpoint, EstimatorSetting, EstimatorStudy, Experiment, RateStudy, RateTable, RefinedSetting, RefinedStudy,
    Setting, Study,
};
use serde::{Deserialize, Serialize};

use crate::named::{Named, NamedValue};

/// What `format` says in every state file.
const FORMAT: &str = "flexure-study";

/// A part by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The plain estimate: Theorems 1 and 2.
    Plain,
    /// The refined identification.
    Refined,
    /// Every estimator of a static nonlinearity except the network.
    Estimators,
    /// The network, whose training takes long.
    Networks,
}

impl Named for Part {
    const ALL: &'static [NamedValue<Part>] = &[
        NamedValue::new(Part::Plain, "plain", "The plain estimate: Theorems 1 and 2"),
        NamedValue::new(Part::Refined, "refined", "The refined identification"),
        NamedValue::new(
            Part::Estimators,
            "estimators",
            "Every estimator of a static nonlinearity but the network",
        ),
        NamedValue::new(Part::Networks, "networks", "The network; its training takes long"),
    ];
}

/// What is to be measured.
pub struct Plan {
    /// The parts.
    pub parts: Vec<Part>,
    /// Whether more samples and runs are made.
    pub full: bool,
    /// The numbers of samples, if not each part's own.
    pub lengths: Vec<usize>,
    /// The runs of each setting and number of samples, if not each part's own.
    pub runs: Option<usize>,
    /// The seed of all random numbers.
    pub seed: u64,
}

impl Plan {
    /// A part's study, if the plan has it.
    fn study<S: Experiment + Clone + Sync>(
        &self,
        part: Part,
        quick: Study<S>,
        full: Study<S>,
    ) -> Option<Checkpoint<S>> {
        let mut study = if self.full { full } else { quick };
        if !self.lengths.is_empty() {
            study.lengths.clone_from(&self.lengths);
        }
        study.runs = self.runs.unwrap_or(study.runs);
        study.seed = self.seed;
        self.parts.contains(&part).then(|| Checkpoint::new(study))
    }
}

/// The parts with their measurements so far.
#[derive(Serialize, Deserialize)]
pub struct Parts {
    format: String,
    plain: Option<Checkpoint<Setting>>,
    refined: Option<Checkpoint<RefinedSetting>>,
    estimators: Option<Checkpoint<EstimatorSetting>>,
    networks: Option<Checkpoint<EstimatorSetting>>,
}

/// A part with any type of settings.
trait Measured {
    /// The samples drawn so far, and those of the whole part.
    fn samples(&self) -> [usize; 2];
    /// Measures the next missing error; false if none is missing. `progress` is called with the samples drawn so far.
    fn step(&mut self, progress: &dyn Fn(usize)) -> flexure::Result<bool>;
}

impl<S: Experiment + Clone + Sync> Measured for Checkpoint<S> {
    fn samples(&self) -> [usize; 2] {
        [self.spent(), self.total()]
    }

    fn step(&mut self, progress: &dyn Fn(usize)) -> flexure::Result<bool> {
        self.step(&mut |drawn, _| {
            progress(drawn);
            ControlFlow::Continue(())
        })
    }
}

/// A part of a study, and the approximate cost of one of its samples, relative to one in a kernel estimate at a point.
struct Costly<'a> {
    part: &'a mut dyn Measured,
    cost: f64,
}

impl Parts {
    /// Nothing measured yet.
    pub fn new(plan: &Plan) -> Self {
        let [network, full_network] = [EstimatorStudy::quick_network(), EstimatorStudy::full_network()];
        Parts {
            format: FORMAT.to_owned(),
            plain: plan.study(Part::Plain, RateStudy::quick(), RateStudy::full()),
            refined: plan.study(Part::Refined, RefinedStudy::quick(), RefinedStudy::full()),
            estimators: plan.study(Part::Estimators, EstimatorStudy::quick(), EstimatorStudy::full()),
            networks: plan.study(Part::Networks, network, full_network),
        }
    }

    /// Reads the state of this study, which may already have measurements.
    ///
    /// # Errors
    /// For a text that is no state, or the state of another study.
    pub fn resumed(&self, text: &str) -> Result<Parts> {
        let state: Parts = match serde_json::from_str(text) {
            Ok(state) => state,
            Err(error) => bail!("not the state of a study ({error}); name another file, or remove this one"),
        };
        if state.format != FORMAT {
            let format = state.format;
            bail!("not the state of a study: its \"format\" is \"{format}\", not \"{FORMAT}\"");
        }
        fn study<S: Experiment + Clone + Sync>(part: &Option<Checkpoint<S>>) -> Option<&Study<S>> {
            part.as_ref().map(Checkpoint::study)
        }
        let same = study(&self.plain) == study(&state.plain)
            && study(&self.refined) == study(&state.refined)
            && study(&self.estimators) == study(&state.estimators)
            && study(&self.networks) == study(&state.networks);
        if !same {
            bail!(
                "the state of another study: give the same --parts, --full, --lengths, --runs and --seed as then, or name another file"
            );
        }
        Ok(state)
    }

    fn each(&mut self) -> impl Iterator<Item = Costly<'_>> {
        fn costly(part: &mut dyn Measured, cost: f64) -> Costly<'_> {
            Costly { part, cost }
        }
        let plain = self.plain.iter_mut().map(|part| costly(part, 1.0));
        let refined = self.refined.iter_mut().map(|part| costly(part, 100.0));
        let estimators = self.estimators.iter_mut().map(|part| costly(part, 10.0));
        let networks = self.networks.iter_mut().map(|part| costly(part, 1000.0));
        plain.chain(refined).chain(estimators).chain(networks)
    }

    /// The work that is done, and all of it.
    fn work(&mut self) -> [f64; 2] {
        let each = self
            .each()
            .map(|Costly { part, cost }| part.samples().map(|samples| cost * samples as f64));
        each.fold([0.0; 2], |[done, all], [d, a]| [done + d, all + a])
    }

    /// The share of the work that is done.
    pub fn done(&mut self) -> f64 {
        let [done, all] = self.work();
        done / all
    }

    /// Measures the next missing error; false if none is missing.
    pub fn step(&mut self, progress: &dyn Fn(f64)) -> flexure::Result<bool> {
        let [done, all] = self.work();
        for Costly { part, cost } in self.each() {
            let [before, _] = part.samples();
            if part.step(&|drawn| progress((done + cost * (drawn - before) as f64) / all))? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The tables of what has been measured.
    pub fn outcome(&self) -> Outcome {
        let mut outcome = Outcome {
            agrees: true,
            plain: self.plain.as_ref().map(Checkpoint::table),
            refined: self.refined.as_ref().map(Checkpoint::table),
            estimators: self.estimators.as_ref().map(Checkpoint::table),
            networks: self.networks.as_ref().map(Checkpoint::table),
        };
        let agrees = outcome.titled().all(|(_, table)| !table.verdicts().contains(&false));
        outcome.agrees = agrees;
        outcome
    }
}

/// What was measured.
#[derive(Serialize)]
pub struct Outcome {
    /// Whether everything agrees with theory.
    agrees: bool,
    plain: Option<RateTable<Setting>>,
    refined: Option<RateTable<RefinedSetting>>,
    estimators: Option<RateTable<EstimatorSetting>>,
    networks: Option<RateTable<EstimatorSetting>>,
}

/// A table with any type of settings.
trait Rates: std::fmt::Display {
    /// Whether each slope agrees with theory.
    fn verdicts(&self) -> Vec<bool>;
    /// The numbers of samples.
    fn lengths(&self) -> Vec<usize>;
}

impl<S: Experiment> Rates for RateTable<S> {
    fn verdicts(&self) -> Vec<bool> {
        self.results.iter().map(|r| r.agrees).collect()
    }

    fn lengths(&self) -> Vec<usize> {
        self.results.iter().flat_map(|r| &r.points).map(|p| p.n).collect()
    }
}

impl Outcome {
    /// The tables with their headings.
    fn titled(&self) -> impl Iterator<Item = (&'static str, &dyn Rates)> {
        let plain = self
            .plain
            .iter()
            .map(|t| ("Plain estimate, Theorems 1 and 2", t as &dyn Rates));
        let refined = self.refined.iter().map(|t| ("Refined identification", t as &dyn Rates));
        let estimators = self.estimators.iter().map(|t| ("Static estimators", t as &dyn Rates));
        let networks = self.networks.iter().map(|t| ("Networks", t as &dyn Rates));
        plain.chain(refined).chain(estimators).chain(networks)
    }

    /// The tables, each with its heading, and the verdict, for a terminal.
    pub fn lines(&self) -> Vec<String> {
        let tables = self.titled().map(|(title, table)| format!("{title}\n\n{table}"));
        tables.chain([self.sentence()]).collect()
    }

    /// The verdict in a sentence.
    fn sentence(&self) -> String {
        let level = "(95 % intervals that hold jointly, and 0.01 for finite n)";
        match self.agrees {
            true => format!("All slopes agree with theory {level}."),
            false => format!("Some slopes differ from theory {level}; the tables say which."),
        }
    }

    /// The page that shows everything; `command` makes it again.
    ///
    /// # Errors
    /// For numbers that cannot be drawn.
    pub fn html(&self, command: String) -> Result<String> {
        flexure_report::render_study(&page::page(self, command)).context("the report")
    }
}

#[cfg(test)]
mod tests {
    use flexure::nonlinearity::Basis;
    use flexure::study::Method;

    #[test]
    fn a_series_has_the_name_of_its_functions_in_files() {
        for (method, text) in [
            (Method::Series(Basis::Hermite), "\"hermite\""),
            (Method::KernelLinear, "\"kernel_linear\""),
        ] {
            assert_eq!(serde_json::to_string(&method).unwrap(), text);
            assert_eq!(serde_json::from_str::<Method>(text).unwrap(), method);
        }
        assert!(serde_json::from_str::<Method>("\"wavelets\"").is_err());
    }
}
