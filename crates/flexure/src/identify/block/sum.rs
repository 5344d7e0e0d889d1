//! The search for a sum of branches of one input.

use std::ops::RangeInclusive;

use super::candidate::Candidate;
use super::cascade::{search as one_branch, splits, without_start};
use super::hammerstein_branches::of_rising_orders;
use super::limits::{
    BRANCH_ROUNDS, LAST, MOST_ADDED, MOST_SUM_STARTS, REFUTING_TESTS, START_SAMPLES, STRUCTURE_SAMPLES, SUM_ROUNDS,
    TRIAL,
};
use super::monitor::{Monitor, Stage};
use super::prepared::Prepared;
use super::search::{Search, SearchResult, finer};
use super::signals::Signals;
use super::sum_starts::{assigned_poles, hammerstein};
use super::system::{Branch, FreeParts, System};
use crate::validation::ResidualTests;

/// The best sum of branches, with a number of branches in `counts`. The branches are static, linear if the input explains nothing of their
/// error; otherwise linear, static, linear, if these are better by Schwarz's criterion. Without a start, the result is a static
/// nonlinearity or a constant.
pub(in crate::identify) fn find_sum(
    prepared: &Prepared,
    counts: RangeInclusive<usize>,
    monitor: &mut Monitor<'_>,
) -> SearchResult {
    let mut sums = Sums {
        prepared,
        search: Search::new(FreeParts::HAMMERSTEIN, monitor),
    };
    let best = sums.best(counts);
    SearchResult {
        system: best.map_or_else(|| without_start(&prepared.data).system, |best| best.sum.system),
        tried: sums.search.tried,
    }
}

/// A sum and the parts of its branches that are free.
struct Best {
    sum: Candidate,
    free: FreeParts,
}

/// A search in which all branches have the same free parts.
struct Sums<'p, 'a, 'm> {
    prepared: &'p Prepared,
    search: Search<'a, 'm>,
}

impl Sums<'_, '_, '_> {
    /// The best sum after the last fit.
    fn best(&mut self, counts: RangeInclusive<usize>) -> Option<Best> {
        let mut data = self.prepared.data.head(STRUCTURE_SAMPLES);
        let mut best: Option<Best> = None;
        'forms: for free in [FreeParts::HAMMERSTEIN, FreeParts::WIENER_HAMMERSTEIN] {
            self.search.free = free;
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
                    // The dependence is taken from the better sum: its errors are nearer to noise.
                    data.set_dependence(&sum.system.run(&data.u));
                }
                if best.as_ref().is_some_and(|b| !sum.better(&b.sum, &data)) {
                    break;
                }
                let complete = complete(&sum, &data);
                best = Some(Best { sum, free });
                if complete {
                    break 'forms;
                }
            }
        }
        let Best { sum, free } = best?;
        let monitor = &mut *self.search.monitor;
        monitor.stage = Stage::Refinement;
        let data = &self.prepared.data;
        let sum = sum.on(data).fitted(data, LAST, monitor);
        let sum = sum.fitted_efficiently(data, monitor).unwrap_or(sum);
        self.search.tried.push(sum.tried(data));
        let sum = self.search.surviving(sum, data);
        Some(Best { sum, free })
    }

    /// The best sum of `count` branches; `fewer` is a sum with one branch less.
    fn of_count(&mut self, count: usize, fewer: Option<&Candidate>, data: &Signals) -> Option<Candidate> {
        let free = self.search.free;
        if free != FreeParts::HAMMERSTEIN && count == 1 {
            let starts = splits(self.prepared, self.search.monitor);
            let SearchResult { system, .. } = one_branch(starts, free, data, self.search.monitor)?;
            return Some(Candidate::new(system, data));
        }
        self.search.monitor.stage = Stage::Split;
        let few = data.head(START_SAMPLES);
        let starts = match free {
            FreeParts::HAMMERSTEIN => of_rising_orders(&few, &mut self.search, |order, _| {
                hammerstein(&few, order, count).into_iter().collect()
            }),
            _ => self.pole_starts(&few, count, fewer),
        };
        let start = self.search.screened(starts, &SUM_ROUNDS, data)?;
        Some(self.improved(start.on(data), data))
    }

    /// The linear approximations' poles assigned to all branches, or to one more than `fewer` has.
    fn pole_starts(&mut self, data: &Signals, count: usize, fewer: Option<&Candidate>) -> Vec<Candidate> {
        let mut all = Vec::new();
        for approximation in self.prepared.starting() {
            if !self.search.monitor.keep_on() {
                continue;
            }
            all.extend(
                assigned_poles(approximation, data, count)
                    .into_iter()
                    .take(MOST_SUM_STARTS),
            );
            if let Some(System { branches, .. }) = fewer.map(|fewer| &fewer.system) {
                let rest = remainder(branches.iter(), data);
                let more = assigned_poles(approximation, &rest, 1).into_iter().take(MOST_ADDED);
                all.extend(more.map(|more| {
                    let sum = System::sum([&branches[..], &more.system.branches].concat());
                    Candidate::new(sum, data)
                }));
            }
        }
        all
    }

    /// Changes pieces, poles and numerator coefficients of one branch after the other, each fitted to the remainder of the others. Then
    /// fits all together. Repeats this while Schwarz's criterion falls.
    fn improved(&mut self, start: Candidate, data: &Signals) -> Candidate {
        self.search.monitor.stage = Stage::Structure;
        let mut best = start.fitted(data, TRIAL, self.search.monitor);
        let mut data = data.clone();
        for _ in 0..BRANCH_ROUNDS {
            data.set_dependence(&best.system.run(&data.u));
            let next = self.branch_by_branch(&best, &data);
            let next = self.search.listed(next, &data, TRIAL.times(3));
            if self.search.monitor.stopped().is_some() || !next.better(&best, &data) {
                break;
            }
            best = next;
        }
        // If a kink of one nonlinearity is mixed into all of them, all need more pieces at once.
        for _ in 0..BRANCH_ROUNDS {
            let next = finer(best.clone(), &data, |pieces| 2 * pieces);
            let next = self.search.listed(next, &data, TRIAL.times(2));
            if self.search.monitor.stopped().is_some() || !next.better(&best, &data) {
                break;
            }
            best = next;
        }
        best
    }

    fn branch_by_branch(&mut self, sum: &Candidate, data: &Signals) -> Candidate {
        let mut next = sum.clone();
        // Only sums of all branches are listed.
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
        REFUTING_TESTS,
    )
    .is_ok_and(|tests| tests.refutation().is_none())
}
