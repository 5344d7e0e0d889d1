//! The refined system of a record in shards that no machine holds together: the equations of every step are sums over the shards.
//!
//! The structure comes from excerpts that one machine holds: order, delay, breakpoints and the noise's colour. Then all coefficients of both
//! blocks and the places of the kinks take Levenberg-Marquardt steps (Marquardt 1963) on the errors of all samples,
//! $$ J'J = \sum_k J_k'J_k, \quad J'e = \sum_k J_k'e_k, \quad e'e = \sum_k e_k'e_k, $$
//! with k the shards. A shard's errors depend on the samples just before it: it is given so many of these that what it cannot know has
//! died away to rounding ([`ShardPoint::reach`]). So the sums are those of the whole record, however it is cut.

use serde::{Deserialize, Serialize};

use super::super::super::robust;
use super::super::options::RefinedHammerstein;
use super::blocks::{Blocks, Observed, uncounted};
use super::descent::raised;
use super::experiments::Experiments;
use super::kinks::{Break, Kink, WithJumps, breaks};
use super::limits::{DAMPING_AFTER_FALL, FIRST_DAMPING, LEAST_STEP, MOST_DAMPING, MOST_SUMS};
use super::loss::Equations;
use super::{Minimum, RefinedMinimum, warnings};
use crate::error::{DataError, Error, Result};
use crate::identify::request::Request;
use crate::identify::result::Identification;
use crate::identify::warning::Warning;
use crate::linear::least_squares::NormalEquations;
use crate::record::Record;

/// The sums over the errors of some samples at one point; those of none are from [`ShardPoint::empty`].
#[derive(Debug, Clone, PartialEq)]
pub struct ShardSums(pub(super) Equations);

impl ShardSums {
    /// Adds the sums over a shard, as [`ShardPoint::sums`] takes it.
    ///
    /// # Errors
    /// Those of [`ShardPoint::sums`]; [`Error::Data`]: `NotSums` for a point of other parameters.
    pub fn push(
        &mut self,
        point: &ShardPoint,
        u: &[f64],
        y: &[f64],
        first: usize,
        before: usize,
        length: usize,
    ) -> Result<()> {
        self.merge(&point.sums(u, y, first, before, length)?)
    }

    /// The number of errors.
    pub fn count(&self) -> usize {
        self.0.count
    }

    /// Adds those of other samples at the same point.
    ///
    /// # Errors
    /// [`Error::Data`]: `NotSums` for sums of other parameters.
    pub fn merge(&mut self, other: &ShardSums) -> Result<()> {
        if !other.are_of(self.0.parameters()) {
            return Err(not_sums("they are of different systems"));
        }
        self.0.add(&other.0);
        Ok(())
    }

    /// Whether these are the sums of so many parameters; what was read may be damaged.
    fn are_of(&self, parameters: usize) -> bool {
        let NormalEquations { descent, normal, .. } = &self.0.normal;
        (descent.len(), normal.len()) == (parameters, parameters * parameters)
    }
}

fn not_sums(reason: &'static str) -> Error {
    Error::Data(DataError::NotSums { reason })
}

/// Where sums are wanted: both blocks with all parameters.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ShardPoint {
    blocks: Blocks,
    whitening: Vec<f64>,
    output_mean: f64,
    /// The lags after which the response counts as settled.
    memory: usize,
}

impl ShardPoint {
    /// The sums over no samples.
    pub fn empty(&self) -> ShardSums {
        ShardSums(Equations {
            count: 0,
            normal: NormalEquations::zero(self.blocks.layout().len()),
        })
    }

    /// How many samples before a shard it has to be given.
    pub fn reach(&self) -> usize {
        self.blocks.reach(&self.whitening)
    }

    /// The sums over a shard: samples of a record of `length` samples from its sample `first` on, of which `before` belong to the shards
    /// before and are not added.
    ///
    /// # Errors
    /// [`Error::Data`]: `LengthMismatch`, `NonFinite` with the place in the record, `NotSums` for a damaged point.
    pub fn sums(&self, u: &[f64], y: &[f64], first: usize, before: usize, length: usize) -> Result<ShardSums> {
        let is_whole = self.blocks.basis.is_whole() && self.blocks.c.len() + 1 == self.blocks.basis.size();
        if !is_whole || self.whitening.is_empty() {
            return Err(not_sums("the point is damaged"));
        }
        if u.len() != y.len() {
            return Err(Error::length("y", y.len(), u.len()));
        }
        for (name, values) in [("u", u), ("y", y)] {
            if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                return Err(Error::not_finite(name, first + i, values[i]));
            }
        }
        let from = before.max(uncounted(self.memory, length).saturating_sub(first));
        let observed = Observed::shard(u, y, self.output_mean, from);
        Ok(ShardSums(self.blocks.equations(&observed, &self.whitening)))
    }
}

/// The identification of a Hammerstein system over shards.
///
/// Take [`point`](Self::point), add up the sums of all shards there, and give them to [`advance`](Self::advance); again, until it says
/// that the error falls no more.
pub struct ShardedHammerstein {
    method: RefinedHammerstein,
    warnings: Vec<Warning>,
    /// The least squared error so far.
    best: RefinedMinimum,
    /// The sums over all shards so far; before the first, `best` is that of the excerpts.
    sums: usize,
    trial: Trial,
    damping: f64,
}

/// A point whose sums are wanted.
#[derive(Clone)]
struct Trial {
    minimum: Minimum,
    blocks: Blocks,
    kinks: Vec<Kink>,
}

impl Trial {
    /// With the kinks that have a place among the parameters.
    fn new(minimum: Minimum, kinks: &[Kink]) -> Trial {
        let is_placed = |place: &Break| kinks.iter().any(|kink| kink.term == place.term);
        let places: Vec<Break> = breaks(&minimum.terms).filter(is_placed).collect();
        let (blocks, kinks) = minimum.jumps_at(&places);
        Trial { minimum, blocks, kinks }
    }
}

impl ShardedHammerstein {
    /// The structure from excerpts of the record, each an experiment of its own.
    ///
    /// # Errors
    /// Those of [`RefinedHammerstein::identify_experiments`]; [`Error::Parameter`] for a form; [`Error::Data`]:
    /// `NotRefined` where the excerpts show no such system, `TooSlowForParts` for one that remembers more samples than a shard is given.
    pub fn new(method: RefinedHammerstein, excerpts: &[&Record], input: &str, output: &str) -> Result<Self> {
        method.check()?;
        if method.form.is_some() {
            return Err(Error::parameter("the number of physical forms", 1.0, "0 over shards"));
        }
        let all = Experiments::new(excerpts, input, output, false, method.fresh_share)?;
        let plain = method.plain_estimate(&all, input, output)?;
        let found = method.refined_minimum(&all, &plain)?;
        let best = found.ok_or(Error::Data(DataError::NotRefined))?;
        let trial = Trial::new(best.minimum.clone(), &best.extended.kinks);
        if trial.blocks.linear.transfer.outlasts() {
            let most = trial.blocks.linear.transfer.forgotten();
            return Err(Error::Data(DataError::TooSlowForParts { most }));
        }
        Ok(ShardedHammerstein {
            trial,
            warnings: warnings(&plain),
            method,
            best,
            sums: 0,
            damping: FIRST_DAMPING,
        })
    }

    /// Where the sums over all shards are wanted.
    pub fn point(&self) -> ShardPoint {
        ShardPoint {
            blocks: self.trial.blocks.clone(),
            whitening: self.best.minimum.whitening.clone(),
            output_mean: self.best.output_mean,
            memory: self.best.minimum.memory,
        }
    }

    /// Takes the sums over all shards at the point, and goes to the next one; whether there is one.
    ///
    /// # Errors
    /// [`Error::Data`]: `NotSums` for those of another system; `TooShort` where no error counts.
    pub fn advance(&mut self, sums: ShardSums) -> Result<bool> {
        if !sums.are_of(self.trial.blocks.layout().len()) {
            return Err(not_sums("they are of another system"));
        }
        let ShardSums(equations) = sums;
        if equations.count <= equations.parameters() {
            return Err(Error::too_short(
                "the shards",
                equations.parameters() + 1,
                equations.count,
            ));
        }
        if self.sums == 0 || equations.normal.cost < self.best.extended.equations.normal.cost {
            self.accept(equations);
        } else {
            self.damping = raised(self.damping);
        }
        self.sums += 1;
        Ok(self.sums < MOST_SUMS && self.propose())
    }

    fn accept(&mut self, equations: Equations) {
        let Trial { minimum, blocks, kinks } = self.trial.clone();
        self.best.extended = WithJumps::solved(blocks, kinks, equations);
        self.best.minimum = Minimum {
            equations: self.best.extended.without_jumps(),
            ..minimum
        };
        if self.sums > 0 {
            self.damping *= DAMPING_AFTER_FALL;
        }
    }

    /// Whether there is another point worth its sums.
    fn propose(&mut self) -> bool {
        let RefinedMinimum {
            minimum,
            extended,
            cells,
            ..
        } = &self.best;
        let least = LEAST_STEP * extended.equations.noise().powi(2);
        while self.damping < MOST_DAMPING {
            if let Some(step) = extended.step(self.damping) {
                if !(extended.expected_fall(&step) > least) {
                    return false;
                }
                if let Some(moved) = minimum.with_kinks_moved(extended, &step, 1.0, cells) {
                    let trial = Trial::new(moved, &extended.kinks);
                    if !trial.blocks.linear.transfer.outlasts() {
                        self.trial = trial;
                        return true;
                    }
                }
            }
            self.damping = raised(self.damping);
        }
        false
    }

    /// The number of errors that the estimate is from.
    pub fn count(&self) -> usize {
        self.best.extended.equations.count
    }

    /// The system, with standard errors from all shards, and the verdict on the fresh share of the record of the request,
    /// which is the end of all shards.
    ///
    /// # Errors
    /// Those of [`RefinedHammerstein::identify`].
    pub fn identification(&self, request: &Request<'_>) -> Result<Identification> {
        let (input, output) = (request.input()?, request.output);
        let all = Experiments::new(request.records, input, output, false, request.options.fresh_share)?;
        let result = self
            .method
            .outcome(request, &all, &self.best, self.count(), self.warnings.clone())?;
        robust::warned(result, request)
    }
}

#[cfg(test)]
#[path = "sharded_tests.rs"]
mod tests;
