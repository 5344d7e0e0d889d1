//! Theorems 1 and 2 as an experiment.
//!
//! Both say that the kernel estimate (13) with h_n ~ n^(-1/(2p+d)) has the error O(n^(-p/(2p+d))) in
//! probability where m is Lipschitz of order p, and n^(-2/(4+d)) where it is twice differentiable and the kernel
//! symmetric: Theorem 1 for independent pairs, Theorem 2 for the Hammerstein system's correlated ones.
//! Here d = 1, and the error over n is measured by Monte Carlo.
//!
//! # Which error
//!
//! The theorems bound the error at (almost) every point from above, over a whole class of functions. To see the
//! exponent itself, and not just something below it, the error has to be measured where the class is at its
//! worst:
//!
//! - p = 1/2: at the cusp of |x|^(1/2), where the bias is exactly of order h^(1/2);
//! - p = 1: at the kink of |x|, where it is exactly of order h. In L2 a kink is harmless: the bias is of order h
//!   only on an interval of width h, so that its L2 norm is h^(3/2);
//! - smooth: at a point of non-zero curvature, the top of cos x, where it is of order h^2.
//!
//! The variance is of order 1/(n h) at every point, and the bandwidth's constant is the one that makes the
//! root mean square error smallest ([`Setting::at_worst_point`]); it follows from the setting, it is not fitted. Both
//! theorems are about convergence in probability; the root mean square over runs is of the same order here.
//!
//! # Correlated observations
//!
//! In the Hammerstein system the memory sum_{j>=1} k_j W_{n-j} acts as noise that is correlated from sample to
//! sample. To the variance of order 1/(n h) the correlation adds
//! ((sum k_j)^2 - sum k_j^2) Var(W) / n, j >= 1: a share of order h, which vanishes, but for smooth m only as
//! n^(-1/5), and shows in a slope measured at n = 1e3 to 1e5 by some hundredths. The settings at a worst point therefore
//! use a linear part with a strongly correlated memory in which those two sums nearly balance,
//! 1 / (1 - 1.1 z^-1 + 0.56 z^-2); any other one has the same exponents, further out.
//!
//! # The seven nonlinearities
//!
//! For those the error is the L2 norm over the inside of a uniform input's range
//! ([`Setting::over_the_interior`]):
//!
//! - cubic, x^2 + 0.2 x, soft wind-up and friction are smooth: -2/5;
//! - the dead zone is Lipschitz with p = 1: with the theorem's h ~ n^(-1/3) the variance gives -1/3, and the bias
//!   (h^(3/2), see above) falls faster: a bound;
//! - limiter and quantizer jump, so no p > 0 applies near a jump. There the bias is of order 1 on an interval of width
//!   h, so its L2 norm is h^(1/2), as if p were 1/2: h ~ n^(-1/2) balances it with the variance, and the L2 error is
//!   of order n^(-1/4).

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::sample::Sampler;
use super::setting::{Data, Input, Setting, Target};
use super::table::{RatePoint, RateResult, RateTable};
use crate::error::{Error, Result};
use crate::linear::TransferFunction;
use crate::systems::{KnownNonlinearity, known_linear_parts};

/// The fewest runs that give a standard error worth the name.
const FEWEST_RUNS: usize = 20;

/// A convergence study: every setting at every number of samples, many times.
///
/// | parameter | purpose | valid range | quick | full |
/// |---|---|---|---|---|
/// | `settings` | what is measured | not empty | 18 points + 7 nonlinearities | the same |
/// | `lengths` | numbers of samples n | at least two, increasing, from 10 | 1,000 to 64,000 | 1,000 to 1,000,000 |
/// | `runs` | Monte Carlo runs for each | at least 20 | 200 | 400 |
/// | `seed` | of all random numbers | | 1 | 1 |
///
/// ```no_run
/// use std::ops::ControlFlow;
/// use flexure::study::RateStudy;
/// let table = RateStudy::quick().run(&mut |_, _| ControlFlow::Continue(()))?;
/// println!("{table}");
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RateStudy {
    /// What is measured.
    pub settings: Vec<Setting>,
    /// The numbers of samples, increasing.
    pub lengths: Vec<usize>,
    /// Monte Carlo runs for each setting and number of samples.
    pub runs: usize,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl RateStudy {
    /// The settings of Theorems 1 and 2 and the seven nonlinearities: well under a minute on two cores.
    pub fn quick() -> Self {
        RateStudy {
            settings: theorem_settings().into_iter().chain(known_settings()).collect(),
            lengths: vec![1000, 4000, 16_000, 64_000],
            runs: 200,
            seed: 1,
        }
    }

    /// The same settings up to a million samples: about a quarter of an hour on two cores.
    pub fn full() -> Self {
        RateStudy {
            lengths: vec![1000, 3000, 10_000, 30_000, 100_000, 300_000, 1_000_000],
            runs: 400,
            ..RateStudy::quick()
        }
    }

    /// Runs the whole study. `progress` is called now and then with the samples simulated so far and in
    /// all, and stops the study by returning [`ControlFlow::Break`]; see [`Checkpoint`] for one that can be resumed.
    ///
    /// The result depends on the study alone, not on the number of threads.
    ///
    /// # Errors
    /// [`Error::InvalidParameter`] for a study outside the valid ranges,
    /// [`Error::Stopped`] if `progress` stopped it.
    pub fn run(&self, progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>) -> Result<RateTable> {
        Checkpoint::new(self.clone()).run(progress)
    }

    fn check(&self) -> Result<()> {
        check_plan(self.settings.len(), &self.lengths, self.runs)?;
        self.settings.iter().try_for_each(Setting::check)
    }

    /// The samples of one setting at one n.
    fn cost(&self, n: usize) -> usize {
        n.saturating_mul(self.runs)
    }
}

/// The number of settings, the lengths and the runs of a study.
pub(super) fn check_plan(settings: usize, lengths: &[usize], runs: usize) -> Result<()> {
    for (what, need, got, requirement) in [
        ("settings", 1, settings, "at least 1"),
        ("lengths", 2, lengths.len(), "at least 2"),
        ("runs", FEWEST_RUNS, runs, "at least 20"),
    ] {
        if got < need {
            return Err(Error::InvalidParameter {
                name: format!("the number of {what} of a rate study"),
                value: got as f64,
                requirement,
            });
        }
    }
    let mut previous = 9;
    for (i, &n) in lengths.iter().enumerate() {
        if n <= previous {
            return Err(Error::InvalidParameter {
                name: format!("lengths[{i}]"),
                value: n as f64,
                requirement: "at least 10, and greater than the one before it",
            });
        }
        previous = n;
    }
    Ok(())
}

/// The runs between two calls of a study's progress: about a second.
pub(super) fn batch(n: usize, runs: usize) -> usize {
    (20_000_000 / n).clamp(1, runs)
}

/// One seed for each setting, n and run, whatever else the study contains.
pub(super) fn seed_of(seed: u64, setting: usize, n: usize, run: usize) -> u64 {
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

/// The three classes at their worst point, from static and Hammerstein data, for the three inputs.
pub fn theorem_settings() -> Vec<Setting> {
    let linear = TransferFunction::monic(vec![1.0], vec![-1.1, 0.56]);
    let data = [
        Data::Static { noise: 0.5 },
        Data::Hammerstein {
            linear,
            lag: 0,
            process_noise: 0.1,
            noise: 0.1,
        },
    ];
    let inputs = [Input::Uniform { range: 2.0 }, Input::Gaussian, Input::StudentT];
    let mut settings = Vec::new();
    for target in [Target::Cusp, Target::Kink, Target::Cosine] {
        for data in &data {
            for input in inputs {
                settings.push(Setting::at_worst_point(target, input, data.clone()));
            }
        }
    }
    settings
}

/// The seven nonlinearities in front of the well damped linear part, regressed at its strongest lag.
pub fn known_settings() -> Vec<Setting> {
    let [linear, _] = known_linear_parts();
    KnownNonlinearity::ALL
        .into_iter()
        .map(|phi| Setting::over_the_interior(phi, linear.clone(), 1))
        .collect()
}

/// A study with what it has measured so far: save it, and a study that was stopped goes on where it was.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    study: RateStudy,
    /// By setting, then n.
    done: BTreeMap<usize, BTreeMap<usize, RatePoint>>,
}

impl Checkpoint {
    /// A study of which nothing has been measured.
    pub fn new(study: RateStudy) -> Self {
        Checkpoint {
            study,
            done: BTreeMap::new(),
        }
    }

    /// The study.
    pub fn study(&self) -> &RateStudy {
        &self.study
    }

    /// Measures what is missing. As [`RateStudy::run`], but what was measured before a stop is kept in `self`.
    ///
    /// # Errors
    /// Those of [`RateStudy::run`].
    pub fn run(&mut self, progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>) -> Result<RateTable> {
        self.study.check()?;
        let study = &self.study;
        let each: usize = study.lengths.iter().map(|&n| study.cost(n)).sum();
        let total = each.saturating_mul(study.settings.len());
        let mut spent: usize = self.done.values().flat_map(|d| d.keys()).map(|&n| study.cost(n)).sum();
        for (s, setting) in study.settings.iter().enumerate() {
            let done = self.done.entry(s).or_default();
            let sampler = Sampler::new(setting);
            for &n in &study.lengths {
                if done.contains_key(&n) {
                    continue;
                }
                let mut errors = Vec::with_capacity(study.runs);
                let batch = batch(n, study.runs);
                for first in (0..study.runs).step_by(batch) {
                    if progress(spent, total).is_break() {
                        return Err(Error::Stopped { done: spent, total });
                    }
                    let runs = first..study.runs.min(first + batch);
                    spent += n * runs.len();
                    let squared: Result<Vec<Option<f64>>> = runs
                        .into_par_iter()
                        .map(|run| sampler.squared_error(n, seed_of(study.seed, s, n, run)))
                        .collect();
                    errors.extend(squared?);
                }
                done.insert(n, RatePoint::new(n, &errors));
            }
        }
        // The last call is only news; there is nothing left to stop.
        let _ = progress(total, total);
        let results = study.settings.iter().enumerate().map(|(s, setting)| {
            let points = self.done.get(&s).into_iter().flat_map(|d| d.values().copied());
            RateResult::new(setting.clone(), points.collect(), study.settings.len())
        });
        Ok(RateTable {
            results: results.collect(),
        })
    }
}

#[cfg(test)]
#[path = "rates_tests.rs"]
mod tests;
