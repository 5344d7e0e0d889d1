//! The search for a system's structure, the same for all block structures.
//!
//! The search starts on a part of the record: pieces of the nonlinearities, poles and numerator coefficients, and kinks are changed while
//! Schwarz's criterion falls. Then it does the same on all samples. At last it uses generalised least squares, if the error is coloured
//! noise. A structure says by [`FreeParts`] what may change, and screens its starts by [`Round`]s.

use super::candidate::{Candidate, Tried};
use super::changes::{greedy, neighbours};
use super::descent::Residuals;
use super::efficient::whitening_filter;
use super::intersample::with_instant_between;
use super::limits::{
    FAR_FEWER_PIECES, FEWEST_PIECES, LAST, MOST_PIECES, PIECES, Round, STRUCTURE_SAMPLES, StopRule, TRIAL, WORSE_PIECES,
};
use super::loss::Loss;
use super::monitor::{Monitor, Stage};
use super::pieces::{anchored, with_pieces};
use super::signals::Signals;
use super::system::{FreeParts, System};
use crate::sort;

/// What the search has found.
#[derive(Debug, Clone)]
pub(in crate::identify) struct SearchResult {
    pub system: System,
    pub tried: Vec<Tried>,
}

/// A search with the list of its trials.
pub(in crate::identify) struct Search<'a, 'm> {
    pub free: FreeParts,
    pub monitor: &'a mut Monitor<'m>,
    pub tried: Vec<Tried>,
}

impl<'a, 'm> Search<'a, 'm> {
    pub fn new(free: FreeParts, monitor: &'a mut Monitor<'m>) -> Self {
        Search {
            free,
            monitor,
            tried: Vec::new(),
        }
    }

    /// From starts to the result; `None` without a start.
    pub fn run(mut self, starts: Vec<Candidate>, rounds: &[Round], data: &Signals) -> Option<SearchResult> {
        let start = self.screened(starts, rounds, data)?;
        let last = self.refined(start, data);
        let last = self.surviving(last, data);
        Some(SearchResult {
            system: last.system,
            tried: self.tried,
        })
    }

    /// The best of several starts, after rounds of short fits: fewer and more thorough from round to round.
    pub fn screened(&mut self, starts: Vec<Candidate>, rounds: &[Round], data: &Signals) -> Option<Candidate> {
        self.monitor.stage = Stage::Screening;
        let mut all = starts;
        for round in rounds {
            let data = data.head(round.samples);
            all.truncate(round.kept);
            all = self.monitor.side_by_side(&all, numbers(&all, &data), |c, monitor| {
                let c = c.on(&data);
                let c = match round.pieces {
                    Some(pieces) => finer(c, &data, |_| pieces),
                    None => c,
                };
                c.fitted(&data, round.rule, monitor)
            });
            all.retain(|c| c.squares.is_finite());
            sort::by_key(&mut all, |c| c.bic(&data));
            if round.listed {
                self.tried.extend(all.iter().map(|c| c.tried(&data)));
            }
        }
        all.into_iter().next()
    }

    /// From the best start to the last fit on all samples.
    pub fn refined(&mut self, start: Candidate, data: &Signals) -> Candidate {
        self.monitor.stage = Stage::Structure;
        let mut medium = data.head(STRUCTURE_SAMPLES);
        let start = self.trial(start.on(&medium), &medium, TRIAL);
        medium.set_dependence(&start.system.run(&medium.u));
        let chosen = self.pieces(start, &medium);
        let chosen = self.restructured(chosen, &medium);
        let chosen = self.kinked(chosen, &medium);
        self.monitor.stage = Stage::Refinement;
        let mut data = data.clone();
        let whole = self.trial(chosen.on(&data), &data, TRIAL);
        data.set_dependence(&whole.system.run(&data.u));
        let whole = self.restructured(whole, &data);
        let mut whole = self.pieces(whole, &data);
        if self.free.between {
            whole = self.intersample(whole, &data);
        }
        let last = self.trial(anchored(whole, &data), &data, LAST);
        let last = anchored(last, &data);
        let efficient = self.restructured_efficiently(&last, &data);
        let efficient = efficient.or_else(|| last.fitted_efficiently(&data, self.monitor));
        let last = efficient.unwrap_or(last);
        self.tried.push(last.tried(&data));
        last
    }

    fn trial(&mut self, c: Candidate, data: &Signals, rule: StopRule) -> Candidate {
        c.fitted(data, rule, self.monitor)
    }

    /// A trial that goes on the list.
    pub(super) fn listed(&mut self, c: Candidate, data: &Signals, rule: StopRule) -> Candidate {
        let next = self.trial(c, data, rule);
        self.tried.push(next.tried(data));
        next
    }

    /// Tries fewer and more pieces of every nonlinearity, one after the other, while Schwarz's criterion falls.
    pub fn pieces(&mut self, mut best: Candidate, data: &Signals) -> Candidate {
        let parts = best.system.parts();
        // Among several nonlinearities, each needs fewer pieces than a single one.
        let several = parts.len() > 1;
        let far_fewer = several.then_some(FAR_FEWER_PIECES);
        let fewest = FEWEST_PIECES[usize::from(several)];
        for part in parts {
            let present = best.system.pieces(part) as f64;
            let mut worse = 0;
            for factor in far_fewer.into_iter().chain(PIECES) {
                if self.monitor.stopped().is_some() || worse == WORSE_PIECES {
                    break;
                }
                let pieces = ((present * factor).round() as usize).clamp(fewest, MOST_PIECES);
                let Some(next) = with_pieces(&best.system, part, pieces, data) else {
                    continue;
                };
                let next = self.listed(next, data, TRIAL);
                if next.better(&best, data) {
                    (best, worse) = (next, 0);
                } else if factor >= PIECES[0] {
                    worse += 1;
                }
            }
        }
        best
    }

    /// Repeats the change of a linear block that lowers Schwarz's criterion most.
    pub fn restructured(&mut self, best: Candidate, data: &Signals) -> Candidate {
        let score = |c: &Candidate| c.bic(data);
        greedy(best, score, |best| {
            let near = neighbours(&best.system, self.free);
            let numbers = numbers(std::slice::from_ref(best), data);
            let changed = self.monitor.side_by_side(&near, numbers, |system, monitor| {
                Candidate::new(system.clone(), data).fitted(data, TRIAL, monitor)
            });
            self.tried.extend(changed.iter().map(|c| c.tried(data)));
            changed
        })
    }

    /// Lets the nonlinearity act between the samples too, if that lowers Schwarz's criterion.
    fn intersample(&mut self, best: Candidate, data: &Signals) -> Candidate {
        if !self.monitor.keep_on() {
            return best;
        }
        let Some(start) = with_instant_between(&best.system, data) else {
            return best;
        };
        let next = self.listed(start, data, TRIAL.times(2));
        if next.better(&best, data) {
            self.pieces(next, data)
        } else {
            best
        }
    }

    /// The structure chosen again with whitened errors, then generalised least squares over all parameters.
    ///
    /// For coloured errors, the sum of squares may be mostly slow noise, and the criterion does not see misfits at other frequencies, where
    /// the noise is small: it then takes too few pieces. `None` if there is no better structure, or if the error is not coloured noise.
    fn restructured_efficiently(&mut self, c: &Candidate, data: &Signals) -> Option<Candidate> {
        let loss = Loss::new(c.system.clone(), data);
        let all = data.through(whitening_filter(&loss, &loss.residuals(&loss.start())?)?);
        let white = all.head(STRUCTURE_SAMPLES);
        // The list has simulation errors only, so these trials are left out.
        let listed = self.tried.len();
        let mut found = c.on(&white);
        if c.system.branches.iter().all(|b| b.between.is_none()) {
            found = self.restructured(found, &white);
        }
        found = self.pieces(found, &white);
        found = self.kinked(found, &white);
        self.tried.truncate(listed);
        let found = self.trial(found.on(&all), &all, TRIAL);
        if !found.better(&c.on(&all), &all) {
            return None;
        }
        let found = self.trial(found.on(data), data, LAST);
        anchored(found, data).fitted_efficiently(data, self.monitor)
    }
}

/// The numbers of the largest Jacobian of these candidates, and as many again for its products.
pub(super) fn numbers(candidates: &[Candidate], data: &Signals) -> usize {
    let parameters = candidates.iter().map(|c| c.system.degrees()).max().unwrap_or(0);
    2 * data.y.len() * parameters
}

/// Every nonlinearity with another number of pieces, dense where it is rough.
pub(in crate::identify) fn finer(mut c: Candidate, data: &Signals, pieces: impl Fn(usize) -> usize) -> Candidate {
    for part in c.system.parts() {
        let pieces = pieces(c.system.pieces(part)).min(MOST_PIECES);
        c = with_pieces(&c.system, part, pieces, data).unwrap_or(c);
    }
    c
}
