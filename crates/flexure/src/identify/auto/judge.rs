//! Which of the candidates the fresh samples support: tests and comparisons, no fits.

use super::limits::{COLOURED, CUT, NEARLY_ALL, TOLERATED_SHARE, TRIFLING_MISFIT};
use super::remainder::explained;
use super::symptoms::{Symptom, symptoms};
use super::{Refutation, rank};
use crate::identify::outcome::Verdict;
use crate::identify::request::{Rank, Structure};
use crate::identify::result::StructureName;
use crate::linear::correlation::mean_square;
use crate::quantiles::NORMAL_MAD;
use crate::validation::{LEVEL, PairedComparison, ResidualTest, TestKind};

/// A candidate with its fresh errors and their verdict.
pub(super) struct Judged<'a> {
    pub structure: StructureName,
    pub verdict: &'a Verdict,
    predicted: Vec<f64>,
    /// Fresh errors, uncut and cut.
    uncut: Vec<f64>,
    errors: Vec<f64>,
}

impl<'a> Judged<'a> {
    pub fn new(structure: StructureName, verdict: &'a Verdict, y: &[f64], predicted: Vec<f64>) -> Judged<'a> {
        let errors: Vec<f64> = y.iter().zip(&predicted).map(|(y, p)| y - p).collect();
        Judged {
            structure,
            verdict,
            predicted,
            errors: cut(errors.clone()),
            uncut: errors,
        }
    }

    /// The residual tests that reject the candidate; empty if the misfit that they detect is negligible.
    pub fn failed(&self) -> Vec<ResidualTest> {
        if self.verdict.holds() {
            return Vec::new();
        }
        let tests = self.verdict.residuals.iter().flat_map(|r| &r.tests);
        tests.filter(|t| t.kind.refutes() && !t.passed()).copied().collect()
    }

    /// The RMS of the fresh errors.
    pub fn error(&self) -> f64 {
        self.verdict.measures.rms
    }

    /// Whether the candidate makes it unnecessary to fit a more complex structure: it leaves white noise; or the structure is a general
    /// one, and the candidate holds and has the `least` error of all. A loop is also fitted if most of that error is coloured.
    ///
    /// A simple candidate holds here only if the misfit that a test detects is tiny: a general structure may explain a negligible one.
    pub fn suffices(&self, structure: &Structure, least: f64) -> bool {
        let own = rank(self.structure);
        let holds = || self.verdict.holds() && (self.verdict.misfit() < TRIFLING_MISFIT || own >= Some(Rank::General));
        let is_enough = || structure.rank >= Some(Rank::General) && holds() && self.error() <= least;
        let is_loop = structure.rank == Some(Rank::General) && !structure.has_several_inputs();
        let doubtful = is_loop && self.leaves_much_colour();
        own < structure.rank && (self.leaves_white_noise() || is_enough() && !doubtful)
    }

    /// Whether the error is more than small, and most of it follows from its own past. Noise may be like that, but so is the error on a system
    /// that remembers where it stuck, which no test of a dependence on the input sees.
    fn leaves_much_colour(&self) -> bool {
        if self.verdict.measures.fit_percent > NEARLY_ALL {
            return false;
        }
        let tests = self.verdict.residuals.iter().flat_map(|r| &r.tests);
        let mut coloured = tests.filter(|t| t.kind == TestKind::Whiteness && t.p_value < LEVEL);
        coloured.any(|t| t.dependent_share() > COLOURED)
    }

    /// Whether no test finds anything in the errors, not even that they are coloured.
    ///
    /// Each test has the level of 1 % here, not its share of the joint level: an unnecessary fit only costs time.
    fn leaves_white_noise(&self) -> bool {
        let silent = |t: &ResidualTest| t.p_value >= LEVEL;
        let residuals = self.verdict.residuals.as_ref();
        self.verdict.measures.fit_percent > 0.0 && residuals.is_some_and(|r| r.tests.iter().all(silent))
    }
}

/// Errors cut at several robust standard deviations: a few samples at which a candidate extrapolates must not decide.
fn cut(mut errors: Vec<f64>) -> Vec<f64> {
    let mut sizes: Vec<f64> = errors.iter().map(|e| e.abs()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let median = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    if median > 0.0 {
        let limit = CUT * median / NORMAL_MAD;
        errors.iter_mut().for_each(|e| *e = e.clamp(-limit, limit));
    }
    errors
}

/// The outcome for all candidates.
pub(super) struct Judgement<'a> {
    /// The candidate's index.
    pub chosen: usize,
    /// Its verdict.
    pub verdict: &'a Verdict,
    /// Other candidates of the same complexity that are as good.
    pub ties: Vec<usize>,
    /// What refutes each.
    pub refuted_by: Vec<Vec<Refutation>>,
    /// The share of the chosen one's squared error that is not noise.
    pub not_noise: f64,
    /// What its error looks like, if it does not hold.
    pub looks_like: Vec<(Symptom, f64)>,
    /// Whether the chosen one holds.
    pub supported: bool,
}

/// Judges candidates, at least one, in order of rank, on the fresh samples of these inputs.
pub(super) fn judge<'a>(candidates: &[Judged<'a>], inputs: &[&[f64]]) -> Judgement<'a> {
    let squares: Vec<f64> = candidates.iter().map(|c| mean_square(&c.errors)).collect();
    let worse = comparisons(candidates, &squares);
    let tier = simplest(candidates, &worse);
    // Among equally good ones, the one with the fewest parameters.
    let parameters = |i: &usize| candidates[*i].verdict.estimated.map_or(0, |e| e.parameters);
    let fewest = tier.iter().map(parameters).min();
    let chosen = smallest(&squares, tier.iter().copied().filter(|i| Some(parameters(i)) == fewest));
    let refuted_by: Vec<Vec<Refutation>> = (candidates.iter().zip(worse))
        .map(|(c, worse)| {
            let failed = c.failed().into_iter().map(Refutation::Test);
            worse.into_iter().chain(failed).collect()
        })
        .collect();
    let c = &candidates[chosen];
    let supported = c.verdict.holds();
    let looks_like = match supported {
        true => Vec::new(),
        false => symptoms(c.verdict, &c.uncut, inputs, &c.predicted),
    };
    Judgement {
        chosen,
        verdict: c.verdict,
        ties: tier.into_iter().filter(|i| *i != chosen).collect(),
        supported,
        not_noise: not_noise(c, !refuted_by[chosen].is_empty(), &looks_like, inputs),
        looks_like,
        refuted_by,
    }
}

/// What refutes each candidate in comparison with the best one; `squares` are their mean squared errors.
///
/// A candidate is also refuted if its error is larger than that of a refuted one that is no more general. Its own comparison can be uncertain,
/// for example if all of its error lies in a short time. It gets the p-value of the refuted one.
fn comparisons(candidates: &[Judged<'_>], squares: &[f64]) -> Vec<Option<Refutation>> {
    // A few wild samples do not refute a candidate, but it is then not the best one.
    let uncut: Vec<f64> = candidates.iter().map(|c| mean_square(&c.uncut)).collect();
    let best = smallest(&uncut, 0..candidates.len());
    let level = LEVEL / candidates.len().saturating_sub(1).max(1) as f64;
    let compared = |(i, c): (usize, &Judged<'_>)| {
        let test = PairedComparison::new(&c.errors, &candidates[best].errors).ok()?;
        let excess = squares[i] / squares[best] - 1.0;
        (test.p_value < level && excess > TOLERATED_SHARE).then(|| Refutation::Comparison {
            better: candidates[best].structure,
            ratio: squares[i] / squares[best],
            p_value: test.p_value,
        })
    };
    let refuted: Vec<Option<Refutation>> = candidates.iter().enumerate().map(compared).collect();
    let rank_of = |i: usize| rank(candidates[i].structure);
    let even_worse = |i: usize| {
        let less_wrong = |j: &usize| rank_of(*j) <= rank_of(i) && squares[*j] < squares[i];
        let by = (0..candidates.len()).filter(less_wrong).find_map(|j| refuted[j])?;
        let Refutation::Comparison { better, p_value, .. } = by else {
            return None;
        };
        Some(Refutation::Comparison {
            better,
            ratio: squares[i] / squares[best],
            p_value,
        })
    };
    (0..candidates.len())
        .map(|i| refuted[i].or_else(|| even_worse(i)))
        .collect()
}

/// The simplest of the candidates that no comparison refutes: of those that hold, if any does.
fn simplest(candidates: &[Judged<'_>], worse: &[Option<Refutation>]) -> Vec<usize> {
    let as_good = |i: &usize| worse[*i].is_none();
    let holds = |i: &usize| candidates[*i].verdict.holds();
    let any_holds = (0..candidates.len()).filter(as_good).any(|i| holds(&i));
    let best = || (0..candidates.len()).filter(as_good).filter(|i| !any_holds || holds(i));
    let rank_of = |i: usize| rank(candidates[i].structure);
    let simplest = best().map(rank_of).min();
    best().filter(|i| Some(rank_of(*i)) == simplest).collect()
}

/// The share of a candidate's squared error that is not noise: the largest that its tests, the inputs or what the error `looks_like` show.
fn not_noise(c: &Judged<'_>, is_refuted: bool, looks_like: &[(Symptom, f64)], inputs: &[&[f64]]) -> f64 {
    let test = c.verdict.refutation();
    let by_inputs = match is_refuted || test.is_some() {
        true => inputs.iter().map(|u| explained(&c.errors, u, &c.predicted)).collect(),
        false => Vec::new(),
    };
    let by_symptoms = looks_like.iter().filter(|(kind, _)| *kind != Symptom::Outliers);
    let shares = by_inputs.into_iter().chain(by_symptoms.map(|(_, share)| *share));
    shares.fold(test.map_or(0.0, ResidualTest::dependent_share), f64::max)
}

fn smallest(values: &[f64], among: impl IntoIterator<Item = usize>) -> usize {
    let least = among.into_iter().min_by(|i, j| values[*i].total_cmp(&values[*j]));
    least.unwrap_or(0)
}
