//! From the starts to the sum of branches.

use std::ops::RangeInclusive;

use super::super::{
    Data, Form, Monitor, Prepared, START_SAMPLES, STRUCTURE_SAMPLES, SearchResult as Single, Stage, TRIAL_STEPS,
    dependence, pieces, restructure, search as one_cascade, splits, with_pieces,
};
use super::start::{cascades, hammerstein};
use super::sum::Sum;
use crate::validation::ResidualTests;

/// Largest order of the starts with Hammerstein branches.
const LARGEST_ORDER: usize = 8;
/// Orders in a row that are tried although Schwarz's criterion rises.
const WORSE_ORDERS: usize = 2;
/// Starts of every linear approximation that are refined; those of all that survive the first round, and the second.
const STARTS: usize = 8;
const SCREENED: usize = 8;
const SURVIVORS: usize = 3;
/// Branches that are added to a sum of one less, of every linear approximation.
const ADDED: usize = 2;
/// Steps of the first round.
const FIRST_STEPS: usize = 8;
/// Samples that they are judged on.
const SCREENING_SAMPLES: usize = 8_000;
/// Pieces of every nonlinearity in the second round.
const SCREENING_PIECES: usize = 12;
/// Most pieces of a nonlinearity.
const MOST_PIECES: usize = 64;
/// Rounds in which structure is added branch by branch.
const ROUNDS: usize = 4;
/// The residual tests that can refute a sum.
const REFUTING: usize = 5;
/// Steps of the last fit.
const LAST_STEPS: usize = 80;

/// A sum that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct TriedSum {
    /// Poles before every branch's nonlinearity.
    pub front_orders: Vec<usize>,
    /// Poles behind it.
    pub back_orders: Vec<usize>,
    /// Cubic pieces of every branch's nonlinearity.
    pub pieces: Vec<usize>,
    /// Samples that it was tried on.
    pub samples: usize,
    /// RMS of the simulation error there, relative to the output's standard deviation.
    pub relative_error: f64,
    /// Schwarz's criterion there; smaller is better among those of as many samples.
    pub bic: f64,
}

impl Sum {
    fn tried(&self, data: &Data) -> TriedSum {
        let of = |what: fn(&super::super::Cascade) -> usize| self.branches.iter().map(what).collect();
        TriedSum {
            front_orders: of(|b| b.front.order()),
            back_orders: of(|b| b.back.order()),
            pieces: of(|b| b.shape.breakpoints().len() - 1),
            samples: data.counted(),
            relative_error: (self.squares / data.counted() as f64).sqrt(),
            bic: self.bic(data),
        }
    }
}

/// The search on one record.
pub(in crate::identify) struct Search<'a, 'm> {
    pub prepared: &'a Prepared,
    /// How many branches may be tried.
    pub counts: RangeInclusive<usize>,
    pub monitor: &'a mut Monitor<'m>,
    pub tried: Vec<TriedSum>,
}

/// The sum and its branches' form.
pub(in crate::identify) struct SearchResult {
    pub sum: Sum,
    pub form: Form,
}

impl SearchResult {
    /// What is left where there was no start: a static nonlinearity, or a constant.
    pub fn nothing(data: &Data) -> SearchResult {
        SearchResult {
            sum: Sum::new(vec![Single::nothing(data).cascade], data),
            form: Form::WienerHammerstein,
        }
    }
}

impl Search<'_, '_> {
    /// The best sum: of Hammerstein branches where they leave nothing that the input explains, of cascades where those
    /// are better by Schwarz's criterion.
    pub fn run(&mut self) -> Option<SearchResult> {
        let mut data = self.prepared.data.head(STRUCTURE_SAMPLES);
        let mut best: Option<SearchResult> = None;
        for form in [Form::Hammerstein, Form::WienerHammerstein] {
            for count in self.counts.clone() {
                if self.monitor.stopped().is_some() {
                    return best;
                }
                let fewer = best.as_ref().map(|b| &b.sum).filter(|b| b.branches.len() + 1 == count);
                let Some(sum) = self.of_form(form, count, fewer, &data) else {
                    continue;
                };
                if best.as_ref().is_none_or(|b| sum.squares < b.sum.squares) {
                    // The better sum's errors are nearer to noise.
                    data.dependence = dependence(&sum.run(&data.u), &data);
                }
                if best.as_ref().is_some_and(|b| b.sum.bic(&data) <= sum.bic(&data)) {
                    break;
                }
                let complete = complete(&sum, &data);
                best = Some(SearchResult { sum, form });
                if complete {
                    break;
                }
            }
            if best.as_ref().is_some_and(|b| complete(&b.sum, &data)) {
                break;
            }
        }
        let SearchResult { sum, form } = best?;
        self.monitor.stage = Stage::Refinement;
        let data = &self.prepared.data;
        let sum = Sum::new(sum.branches, data).fitted(data, LAST_STEPS, 1e-6, self.monitor);
        let sum = sum.efficient(data, self.monitor);
        self.tried.push(sum.tried(data));
        Some(SearchResult { sum, form })
    }

    /// The best sum of so many branches of this form; `fewer` is one of a branch less.
    fn of_form(&mut self, form: Form, count: usize, fewer: Option<&Sum>, data: &Data) -> Option<Sum> {
        let start = match (form, count) {
            (Form::Hammerstein, _) => self.screened(|s, small| s.hammerstein_starts(small, count), data)?,
            (_, 1) => {
                let starts = splits(self.prepared, self.monitor);
                let found = one_cascade(starts, Form::WienerHammerstein, data, self.monitor)?;
                return Some(Sum::new(vec![found.cascade], data));
            }
            _ => self.screened(|s, small| s.cascade_starts(small, count, fewer), data)?,
        };
        Some(self.improved(start, form, data))
    }

    /// Hammerstein branches of rising orders after short fits.
    fn hammerstein_starts(&mut self, data: &Data, count: usize) -> Vec<Sum> {
        let mut all: Vec<Sum> = Vec::new();
        let (mut least, mut worse) = (f64::INFINITY, 0);
        for order in 0..=LARGEST_ORDER.min(data.counted() / 30) {
            if !self.monitor.keep_on() || worse > WORSE_ORDERS {
                break;
            }
            let Some(start) = hammerstein(data, order, count) else {
                continue;
            };
            let bic = start.bic(data);
            (least, worse) = if bic < least { (bic, 0) } else { (least, worse + 1) };
            all.push(start);
        }
        all
    }

    /// The linear approximations' poles shared out among all branches, or given to one more than `fewer` has.
    fn cascade_starts(&mut self, data: &Data, count: usize, fewer: Option<&Sum>) -> Vec<Sum> {
        let mut all = Vec::new();
        let left = fewer.map(|fewer| fewer.left(data));
        for approximation in self.prepared.starting() {
            if self.monitor.keep_on() {
                all.extend(cascades(approximation, data, count).into_iter().take(STARTS));
                if let (Some(fewer), Some(left)) = (fewer, &left) {
                    let more = cascades(approximation, left, 1).into_iter().take(ADDED);
                    all.extend(more.map(|more| Sum::new([&fewer.branches[..], &more.branches].concat(), data)));
                }
            }
        }
        all
    }

    /// The best of the starts after short fits, more thorough for fewer.
    fn screened(&mut self, starts: impl FnOnce(&mut Self, &Data) -> Vec<Sum>, data: &Data) -> Option<Sum> {
        self.monitor.stage = Stage::Split;
        let (few, small) = (data.head(START_SAMPLES), data.head(SCREENING_SAMPLES));
        let mut round = starts(self, &few);
        self.monitor.stage = Stage::Screening;
        let fit = |sums: Vec<Sum>, data: &Data, steps: usize, monitor: &mut Monitor<'_>| -> Vec<Sum> {
            let sums = sums.into_iter().map(|s| Sum::new(s.branches, data));
            let mut fitted: Vec<Sum> = sums.map(|s| s.fitted(data, steps, 1e-4, monitor)).collect();
            fitted.retain(|s| s.squares.is_finite());
            fitted.sort_by(|a, b| a.bic(data).total_cmp(&b.bic(data)));
            fitted
        };
        round = fit(round, &few, FIRST_STEPS, self.monitor);
        round.truncate(SCREENED);
        round = fit(round, &small, TRIAL_STEPS, self.monitor);
        self.tried.extend(round.iter().map(|s| s.tried(&small)));
        round.truncate(SURVIVORS);
        round = round
            .into_iter()
            .map(|s| finer(s, &small, |_| SCREENING_PIECES))
            .collect();
        round = fit(round, &small, 3 * TRIAL_STEPS, self.monitor);
        self.tried.extend(round.iter().map(|s| s.tried(&small)));
        Some(Sum::new(round.into_iter().next()?.branches, data))
    }

    /// Pieces, poles and numerator coefficients of one branch after the other, each fitted to what the others leave, then all
    /// together; while Schwarz's criterion falls.
    fn improved(&mut self, start: Sum, form: Form, data: &Data) -> Sum {
        self.monitor.stage = Stage::Structure;
        let mut best = start.fitted(data, TRIAL_STEPS, 1e-4, self.monitor);
        let mut data = data.clone();
        for _ in 0..ROUNDS {
            data.dependence = dependence(&best.run(&data.u), &data);
            let mut next = best.clone();
            for branch in 0..next.branches.len() {
                let (alone, left) = next.alone(branch, &data);
                let mut tried = Vec::new();
                let alone = pieces(alone, &left, TRIAL_STEPS, self.monitor, &mut tried);
                let alone = restructure(alone, form, &left, self.monitor, &mut tried);
                next.branches[branch] = alone.cascade;
                next.squares = alone.squares;
            }
            let next = next.fitted(&data, 3 * TRIAL_STEPS, 1e-4, self.monitor);
            self.tried.push(next.tried(&data));
            if self.monitor.stopped().is_some() || next.bic(&data) >= best.bic(&data) {
                break;
            }
            best = next;
        }
        // A kink of one nonlinearity that is mixed into all of them asks for pieces in all at once.
        for _ in 0..ROUNDS {
            let next = finer(best.clone(), &data, |pieces| 2 * pieces);
            let next = next.fitted(&data, 2 * TRIAL_STEPS, 1e-4, self.monitor);
            self.tried.push(next.tried(&data));
            if self.monitor.stopped().is_some() || next.bic(&data) >= best.bic(&data) {
                break;
            }
            best = next;
        }
        best
    }
}

/// Every nonlinearity on another number of pieces, dense where it is rough.
fn finer(mut sum: Sum, data: &Data, pieces: impl Fn(usize) -> usize) -> Sum {
    for branch in 0..sum.branches.len() {
        let (alone, left) = sum.alone(branch, data);
        let present = alone.cascade.shape.breakpoints().len() - 1;
        let pieces = pieces(present).min(MOST_PIECES);
        if let Some(finer) = with_pieces(&alone, pieces, &left) {
            sum.branches[branch] = finer.cascade;
            sum.squares = finer.squares;
        }
    }
    sum
}

/// Whether no test finds the input in what the sum leaves; the five of them share the level of one, for every one that rejects a sum
/// that is complete adds a branch.
fn complete(sum: &Sum, data: &Data) -> bool {
    let predicted = sum.run(&data.u);
    let errors: Vec<f64> = data.y.iter().zip(&predicted).map(|(y, p)| y - p).collect();
    let from = data.from;
    ResidualTests::among(&errors[from..], &data.u[from..], &predicted[from..], None, REFUTING)
        .is_ok_and(|tests| tests.refutation().is_none())
}
