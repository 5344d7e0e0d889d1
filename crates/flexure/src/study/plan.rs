//! Monte Carlo studies: every setting at every number of samples, many times.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use super::table::{RatePoint, RateResult, RateTable};
use crate::error::{Error, Result, Stopped};
use crate::parallel;

/// The fewest runs that give a usable standard error.
pub const FEWEST_RUNS: usize = 20;
/// The most runs. With more, the standard error would be smaller than the effect of the rates' curvature.
pub const MOST_RUNS: usize = 100_000;
/// The smallest number of samples.
pub const SHORTEST: usize = 10;
/// The largest number of samples: every core holds a few signals of this length, 80 MB each.
pub const LONGEST: usize = 10_000_000;

/// The mean squared error of one estimate, from the number of samples and the seed. `None` if there is no estimate.
pub type OneRun<'a> = Box<dyn Fn(usize, u64) -> Result<Option<f64>> + Sync + 'a>;

/// An experiment that a study measures: an estimator's error over the number of samples.
pub trait Experiment {
    /// A name of one line.
    fn name(&self) -> String;

    /// The exponent of the error in n that theory gives.
    fn exponent(&self) -> f64;

    /// Whether the error is of exactly that order. If not, the exponent is a bound, and the error may fall faster.
    fn sharp(&self) -> bool;

    /// Whether the setting makes sense.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a value outside its range.
    fn check(&self) -> Result<()>;

    /// One run of the experiment. Everything that does not change from run to run is prepared once.
    fn prepared(&self) -> OneRun<'_>;
}

/// A convergence study.
///
/// | parameter | purpose | valid range |
/// |---|---|---|
/// | `settings` | what is measured | not empty |
/// | `lengths` | numbers of samples n | at least two, increasing, from 10 to 10 million |
/// | `runs` | Monte Carlo runs for each | 20 to 100,000 |
/// | `seed` | of all random numbers | |
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Study<S> {
    /// What is measured.
    pub settings: Vec<S>,
    /// The numbers of samples, increasing.
    pub lengths: Vec<usize>,
    /// Monte Carlo runs for each setting and number of samples.
    pub runs: usize,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl<S: Experiment + Clone + Sync> Study<S> {
    /// Runs the whole study. `progress` is called now and then with the number of samples drawn so far and of all samples. The study stops
    /// if it returns [`ControlFlow::Break`]. A [`Checkpoint`] can be resumed.
    ///
    /// The result depends only on the study, not on the number of threads.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a study outside the valid ranges, [`Error::Stopped`] if `progress` stopped it, and
    /// those of the estimators.
    pub fn run(&self, progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>) -> Result<RateTable<S>> {
        Checkpoint::new(self.clone()).run(progress)
    }

    fn check(&self) -> Result<()> {
        for (what, need, got, requirement) in [
            ("settings", 1, self.settings.len(), "at least 1"),
            ("lengths", 2, self.lengths.len(), "at least 2"),
            ("runs", FEWEST_RUNS, self.runs, "at least 20"),
        ] {
            if got < need {
                return Err(Error::parameter(
                    format!("the number of {what} of a rate study"),
                    got as f64,
                    requirement,
                ));
            }
        }
        if self.runs > MOST_RUNS {
            let what = "the number of runs of a rate study";
            return Err(Error::parameter(what, self.runs as f64, "at most 100000"));
        }
        let mut previous = 0;
        for (i, &n) in self.lengths.iter().enumerate() {
            let wrong = |requirement| Err(Error::parameter(format!("lengths[{i}]"), n as f64, requirement));
            if !(SHORTEST..=LONGEST).contains(&n) {
                return wrong("between 10 and 10 million");
            }
            if n <= previous {
                return wrong("greater than the one before it");
            }
            previous = n;
        }
        self.settings.iter().try_for_each(S::check)
    }

    /// The samples of one setting at one n.
    fn cost(&self, n: usize) -> usize {
        n.saturating_mul(self.runs)
    }

    /// The number of runs between two calls of `progress`. Slow runs take about a second together.
    fn batch(&self, n: usize) -> usize {
        (4_000_000 / n).clamp(1, self.runs)
    }
}

/// One seed for each setting, n and run. It does not depend on the rest of the study.
fn seed_of(seed: u64, setting: usize, n: usize, run: usize) -> u64 {
    [setting, n, run]
        .iter()
        .fold(seed, |state, &v| mix(state.wrapping_add(mix(v as u64))))
}

/// The finaliser of SplitMix64 (Steele, Lea & Flood 2014) after its increment.
fn mix(v: u64) -> u64 {
    let v = v.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let v = (v ^ (v >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let v = (v ^ (v >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    v ^ (v >> 31)
}

/// A study with its measurements so far. A stopped study can go on from a saved checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint<S> {
    study: Study<S>,
    /// The results by setting, then n.
    done: BTreeMap<usize, BTreeMap<usize, RatePoint>>,
}

impl<S: Experiment + Clone + Sync> Checkpoint<S> {
    /// A study without measurements yet.
    pub fn new(study: Study<S>) -> Self {
        Checkpoint {
            study,
            done: BTreeMap::new(),
        }
    }

    /// The study.
    pub fn study(&self) -> &Study<S> {
        &self.study
    }

    /// The number of samples drawn for the measurements so far.
    pub fn spent(&self) -> usize {
        let lengths = self.done.values().flat_map(|d| d.keys());
        lengths.map(|&n| self.study.cost(n)).sum()
    }

    /// Measures all that is missing, as [`Study::run`] does. After a stop, `self` keeps the measurements made before it.
    ///
    /// # Errors
    /// Those of [`Study::run`].
    pub fn run(&mut self, progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>) -> Result<RateTable<S>> {
        while self.step(progress)? {}
        // The last call only informs: nothing is left to stop.
        let _ = progress(self.spent(), self.total());
        Ok(self.table())
    }

    /// The samples of the whole study.
    pub fn total(&self) -> usize {
        let each: usize = self.study.lengths.iter().map(|&n| self.study.cost(n)).sum();
        each.saturating_mul(self.study.settings.len())
    }

    /// Measures the next missing error, of one setting at one n. Returns false if none is missing. A checkpoint can be saved between two
    /// steps.
    ///
    /// # Errors
    /// Those of [`Study::run`]; the measurements of this step before a stop are lost.
    pub fn step(&mut self, progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>) -> Result<bool> {
        self.study.check()?;
        let study = &self.study;
        let measured = |s: usize, n: usize| self.done.get(&s).is_some_and(|done| done.contains_key(&n));
        let mut points = (0..study.settings.len()).flat_map(|s| study.lengths.iter().map(move |&n| (s, n)));
        let Some((s, n)) = points.find(|&(s, n)| !measured(s, n)) else {
            return Ok(false);
        };
        let (mut spent, total) = (self.spent(), self.total());
        let one_run = study.settings[s].prepared();
        let mut errors = Vec::with_capacity(study.runs);
        let batch = study.batch(n);
        for first in (0..study.runs).step_by(batch) {
            if progress(spent, total).is_break() {
                return Err(Error::Stopped(Stopped::Sampling { done: spent, total }));
            }
            let runs = first..study.runs.min(first + batch);
            spent += n * runs.len();
            let squared = parallel::map(runs.len(), |k| one_run(n, seed_of(study.seed, s, n, runs.start + k)));
            for squared in squared {
                errors.push(squared?);
            }
        }
        self.done.entry(s).or_default().insert(n, RatePoint::new(n, &errors));
        Ok(true)
    }

    /// The measurements so far.
    pub fn table(&self) -> RateTable<S> {
        let settings = &self.study.settings;
        let result = |(s, setting): (usize, &S)| {
            let points = self.done.get(&s).into_iter().flat_map(|d| d.values().copied());
            RateResult::new(setting.clone(), points.collect(), settings.len())
        };
        RateTable {
            results: settings.iter().enumerate().map(result).collect(),
        }
    }
}
