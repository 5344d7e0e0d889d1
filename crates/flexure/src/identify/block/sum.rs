//! The search for a sum of branches of one input.

use std::ops::RangeInclusive;

use super::candidate::{Candidate, Tried};
use super::cascade::{search as one_branch, splits, without_start};
use super::limits::{
    LARGEST_START_ORDER, LAST_STEPS, LAST_TOLERANCE, START_SAMPLES, STRUCTURE_SAMPLES, TRIAL_STEPS, TRIAL_TOLERANCE,
    WORSE_ORDERS,
};
use super::monitor::{Monitor, Stage};
use super::prepared::Prepared;
use super::search::{FreeParts, Round, Search, SearchResult, finer};
use super::shares::{hammerstein, shared_poles};
use super::signals::Signals;
use super::system::{Branch, System};
use crate::validation::ResidualTests;

/// Starts of every linear approximation that are refined.
const STARTS: usize = 8;
/// Branches that are added to a sum of one less, of every linear approximation.
const ADDED: usize = 2;
/// Rounds in which structure is added branch by branch.
const ROUNDS: usize = 4;
/// The residual tests that can refute a sum.
const REFUTING: usize = 5;
/// Short fits, more thorough for fewer.
const SCREENING: [Round; 3] = [
    Round {
        samples: START_SAMPLES,
        kept: usize::MAX,
        pieces: None,
        steps: 8,
        tolerance: TRIAL_TOLERANCE,
        listed: false,
    },
    Round {
        samples: 8_000,
        kept: 8,
        pieces: None,
        steps: TRIAL_STEPS,
        tolerance: TRIAL_TOLERANCE,
        listed: true,
    },
    Round {
        samples: 8_000,
        kept: 3,
        pieces: Some(12),
        steps: 3 * TRIAL_STEPS,
        tolerance: TRIAL_TOLERANCE,
        listed: true,
    },
];

/// What the search for a sum has found.
pub(in crate::identify) struct SumResult {
    pub system: System,
    /// Whether the branches are static, linear.
    pub hammerstein: bool,
    pub tried: Vec<Tried>,
}

/// The best sum of as many branches as `counts` allows: static, linear if the input explains nothing of their error; else linear,
/// static, linear, if those are better by Schwarz's criterion. Without a start, a static nonlinearity or a constant.
pub(in crate::identify) fn find_sum(
    prepared: &Prepared,
    counts: RangeInclusive<usize>,
    monitor: &mut Monitor<'_>,
) -> SumResult {
    let mut sums = Sums {
        prepared,
        search: Search::new(FreeParts::HAMMERSTEIN, monitor),
    };
    let best = sums.best(counts);
    let Sums { search, .. } = sums;
    match best {
        Some(Best { sum, form }) => SumResult {
            system: sum.system,
            hammerstein: form == FreeParts::HAMMERSTEIN,
            tried: search.tried,
        },
        None => SumResult {
            system: without_start(&prepared.data).system,
            hammerstein: false,
            tried: search.tried,
        },
    }
}

/// A sum and the form of its branches.
struct Best {
    sum: Candidate,
    form: FreeParts,
}

/// A search whose branches are all of one form at a time.
struct Sums<'p, 'a, 'm> {
    prepared: &'p Prepared,
    search: Search<'a, 'm>,
}

impl Sums<'_, '_, '_> {
    /// The best sum after the last fit.
    fn best(&mut self, counts: RangeInclusive<usize>) -> Option<Best> {
        let mut data = self.prepared.data.head(STRUCTURE_SAMPLES);
        let mut best: Option<Best> = None;
        'forms: for form in [FreeParts::HAMMERSTEIN, FreeParts::WIENER_HAMMERSTEIN] {
            self.search.free = form;
            for count in counts.clone() {
                if self.search.monitor.stopped().is_some() {
                    return best;
                }
                let fewer = best.as_ref().map(|b| &b.sum);
                let fewer = fewer.filter(|b| b.system.branches.len() + 1 == count);
                let Some(sum) = self.of_count(count, fewer, &data) else {
                    continue;
                };
                if best.as_ref().is_none_or(|b| sum.squares < b.sum.squares) {
                    // The better sum's errors are nearer to noise.
                    data.set_dependence(&sum.system.run(&data.u));
                }
                if best.as_ref().is_some_and(|b| !sum.better(&b.sum, &data)) {
                    break;
                }
                let complete = complete(&sum, &data);
                best = Some(Best { sum, form });
                if complete {
                    break 'forms;
                }
            }
        }
        let Best { sum, form } = best?;
        let monitor = &mut *self.search.monitor;
        monitor.stage = Stage::Refinement;
        let data = &self.prepared.data;
        let sum = sum.on(data).fitted(data, LAST_STEPS, LAST_TOLERANCE, monitor);
        let sum = sum.fitted_efficiently(data, monitor).unwrap_or(sum);
        self.search.tried.push(sum.tried(data));
        Some(Best { sum, form })
    }

    /// The best sum of `count` branches; `fewer` is one of a branch less.
    fn of_count(&mut self, count: usize, fewer: Option<&Candidate>, data: &Signals) -> Option<Candidate> {
        let form = self.search.free;
        if form != FreeParts::HAMMERSTEIN && count == 1 {
            let starts = splits(self.prepared, self.search.monitor);
            let SearchResult { system, .. } = one_branch(starts, form, data, self.search.monitor)?;
            return Some(Candidate::new(system, data));
        }
        self.search.monitor.stage = Stage::Split;
        let few = data.head(START_SAMPLES);
        let starts = match form {
            FreeParts::HAMMERSTEIN => self.hammerstein_starts(&few, count),
            _ => self.pole_starts(&few, count, fewer),
        };
        let start = self.search.screened(starts, &SCREENING, data)?;
        Some(self.improved(start.on(data), data))
    }

    /// Hammerstein branches of rising orders.
    fn hammerstein_starts(&mut self, data: &Signals, count: usize) -> Vec<Candidate> {
        let mut all: Vec<Candidate> = Vec::new();
        let (mut least, mut worse) = (f64::INFINITY, 0);
        for order in 0..=LARGEST_START_ORDER.min(data.counted() / 30) {
            if !self.search.monitor.keep_on() || worse > WORSE_ORDERS {
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
    fn pole_starts(&mut self, data: &Signals, count: usize, fewer: Option<&Candidate>) -> Vec<Candidate> {
        let mut all = Vec::new();
        for approximation in self.prepared.starting() {
            if !self.search.monitor.keep_on() {
                continue;
            }
            all.extend(shared_poles(approximation, data, count).into_iter().take(STARTS));
            if let Some(System { branches, .. }) = fewer.map(|fewer| &fewer.system) {
                let rest = remainder(branches.iter(), data);
                let more = shared_poles(approximation, &rest, 1).into_iter().take(ADDED);
                all.extend(more.map(|more| {
                    let sum = System::sum([&branches[..], &more.system.branches].concat());
                    Candidate::new(sum, data)
                }));
            }
        }
        all
    }

    /// Pieces, poles and numerator coefficients of one branch after the other, each fitted to the remainder of the others, then all
    /// together; while Schwarz's criterion falls.
    fn improved(&mut self, start: Candidate, data: &Signals) -> Candidate {
        self.search.monitor.stage = Stage::Structure;
        let mut best = start.fitted(data, TRIAL_STEPS, TRIAL_TOLERANCE, self.search.monitor);
        let mut data = data.clone();
        for _ in 0..ROUNDS {
            data.set_dependence(&best.system.run(&data.u));
            let next = self.branch_by_branch(&best, &data);
            let next = self.search.listed(next, &data, 3 * TRIAL_STEPS, TRIAL_TOLERANCE);
            if self.search.monitor.stopped().is_some() || !next.better(&best, &data) {
                break;
            }
            best = next;
        }
        // A kink of one nonlinearity that is mixed into all of them asks for pieces in all at once.
        for _ in 0..ROUNDS {
            let next = finer(best.clone(), &data, |pieces| 2 * pieces);
            let next = self.search.listed(next, &data, 2 * TRIAL_STEPS, TRIAL_TOLERANCE);
            if self.search.monitor.stopped().is_some() || !next.better(&best, &data) {
                break;
            }
            best = next;
        }
        best
    }

    fn branch_by_branch(&mut self, sum: &Candidate, data: &Signals) -> Candidate {
        let mut next = sum.clone();
        // Only sums of all branches go on the list.
        let listed = self.search.tried.len();
        for i in 0..next.system.branches.len() {
            let others = next.system.branches.iter().enumerate().filter(|(j, _)| *j != i);
            let rest = remainder(others.map(|(_, b)| b), data);
            let alone = Candidate {
                system: System::sum(vec![next.system.branches[i].clone()]),
                squares: next.squares,
            };
            let alone = self.search.pieces(alone, &rest);
            let mut alone = self.search.restructured(alone, &rest);
            next.squares = alone.squares;
            next.system.branches[i] = alone.system.branches.swap_remove(0);
        }
        self.search.tried.truncate(listed);
        next
    }
}

/// The data with the output minus that of these branches.
fn remainder<'b>(branches: impl Iterator<Item = &'b Branch>, data: &Signals) -> Signals {
    let mut rest = data.clone();
    for branch in branches {
        rest.y.iter_mut().zip(branch.run(&data.u)).for_each(|(y, o)| *y -= o);
    }
    rest
}

/// Whether no test finds the input in the error of the sum. The five tests share the level of one: each false rejection adds a branch.
fn complete(sum: &Candidate, data: &Signals) -> bool {
    let predicted = sum.system.run(&data.u);
    let errors: Vec<f64> = data.y.iter().zip(&predicted).map(|(y, p)| y - p).collect();
    let from = data.from;
    ResidualTests::among(
        &errors[from..],
        &data.input()[from..],
        &predicted[from..],
        None,
        REFUTING,
    )
    .is_ok_and(|tests| tests.refutation().is_none())
}
