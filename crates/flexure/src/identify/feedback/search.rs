//! The search: starts of several orders, the best of them refined, then pieces, kinks and the input of the nonlinearity.

use super::limits::{
    CORRECTED, CORRECTIONS, FEWEST_IN_PIECE, FINE_PIECES, KEPT, KEPT_PIECES, LARGEST_ORDER, LAST, MOST_KINKS,
    MOST_UNCOUNTED, PIECES, PIECES_UNDER_KINKS, REFINED, RESTART_FALL, RESTARTS, ROUGH, SAMPLES_AN_ORDER,
    START_SAMPLES, STRUCTURE_SAMPLES, TRIAL, UNCOUNTED_PART, WORSE_ORDERS, WORSE_PIECES,
};
use super::loss::LoopError;
use super::starts::{guesses, start};
use super::system::{Entering, Loop, Observed};
use super::units::on_breakpoints;
use crate::identify::block::{
    Approximation, EVEN, KINK_EVIDENCE, KINK_PLACES, Kink, KinkedSpline, Monitor, Residuals, Roughness, Signals, Stage,
    StopRule, approximate_all, descend, robust_to_restart, thinned,
};
use crate::identify::result::{Value, Values};
use crate::linear::least_squares::least_squares;
use crate::{parallel, sort};

/// A loop and its sum of squared simulation errors.
#[derive(Debug, Clone)]
pub(super) struct LoopCandidate {
    pub system: Loop,
    pub squares: f64,
    /// The number of parameters that change the system.
    pub degrees: usize,
    /// The guess that it started from.
    pub origin: &'static str,
}

/// The samples on which candidates are compared.
struct Judge<'a> {
    data: &'a Observed,
    /// This many samples carry as much information as one with an independent error.
    dependence: f64,
}

impl Judge<'_> {
    fn bic(&self, c: &LoopCandidate) -> f64 {
        let samples = self.data.counted() as f64;
        let n = samples / self.dependence;
        n * (c.squares.max(f64::MIN_POSITIVE) / samples).ln() + c.degrees as f64 * n.ln()
    }

    fn better(&self, a: &LoopCandidate, b: &LoopCandidate) -> bool {
        a.squares.is_finite() && self.bic(a) < self.bic(b)
    }

    /// Takes the dependence from the errors of a candidate.
    fn set_dependence(&mut self, c: &LoopCandidate) {
        if let Some(output) = c.system.output(self.data) {
            let mut signals = Signals::of_input(Vec::new(), self.data.y.clone(), 0);
            for (k, y) in signals.y.iter_mut().enumerate().filter(|(k, _)| self.data.missing[*k]) {
                *y = output[k];
            }
            signals.set_dependence(&output);
            self.dependence = signals.dependence;
        }
    }
}

/// What the search found.
pub(super) struct LoopSearchResult {
    pub best: LoopCandidate,
    pub tried: Vec<Values>,
    /// The relative errors of the linear approximations of order 1, 2, ...
    pub approximations: Vec<f64>,
    /// This many samples carry as much information as one with an independent error.
    pub dependence: f64,
}

pub(super) struct Search<'a, 'm> {
    /// The samples that are fitted.
    pub data: &'a Observed,
    /// The whole record, over which a loop must not run away.
    pub whole: &'a Observed,
    pub monitor: &'a mut Monitor<'m>,
    pub tried: Vec<Values>,
    /// All tried loops that do not run away.
    pub seen: Vec<LoopCandidate>,
}

impl Search<'_, '_> {
    /// The best loop; `None` if every start runs away, or if the work was stopped.
    pub fn run(mut self) -> Option<LoopSearchResult> {
        let few = self.data.head(START_SAMPLES);
        let signals = Signals::of_input(
            few.u.clone(),
            few.y.clone(),
            (few.y.len() / UNCOUNTED_PART).min(MOST_UNCOUNTED),
        );
        let largest = LARGEST_ORDER.min(few.y.len() / SAMPLES_AN_ORDER).max(1);
        let linear = approximate_all(&signals, 1..=largest, self.monitor);
        let started = self.best_starts(&few, &linear);
        let medium = self.data.head(STRUCTURE_SAMPLES);
        let mut judge = Judge {
            data: &medium,
            dependence: 1.0,
        };
        let refined = self.side_by_side(started, &medium, |search, c| search.refine(c, &judge));
        let best = refined.into_iter().filter(|c| c.squares.is_finite());
        let mut best = best.min_by(|a, b| judge.bic(a).total_cmp(&judge.bic(b)))?;
        self.monitor.stage = Stage::Structure;
        judge.set_dependence(&best);
        best = self.choose_pieces(best, &judge);
        best = self.try_hidden(best, &judge);
        best = self.add_kinks(best, &judge);
        self.monitor.stage = Stage::Refinement;
        let mut judge = Judge {
            data: self.data,
            dependence: 1.0,
        };
        best = self.fit_and_list(best, self.data, TRIAL);
        judge.set_dependence(&best);
        best = self.try_hidden(best, &judge);
        let last = self.fit_and_list(best.clone(), self.data, LAST);
        best = if last.squares.is_finite() { last } else { best };
        best = self.one_that_restarts(best);
        let errors = linear.iter().flatten();
        Some(LoopSearchResult {
            approximations: errors.map(|a| (a.squares / signals.counted() as f64).sqrt()).collect(),
            dependence: judge.dependence,
            best,
            tried: self.tried,
        })
    }

    /// The best start of each order, until larger orders are worse; the best of these, best first.
    fn best_starts(&mut self, few: &Observed, linear: &[Option<Approximation>]) -> Vec<LoopCandidate> {
        self.monitor.stage = Stage::Screening;
        let judge = Judge {
            data: few,
            dependence: 1.0,
        };
        let (mut all, mut least, mut worse): (Vec<LoopCandidate>, _, _) = (Vec::new(), f64::INFINITY, 0);
        for (i, linear) in linear.iter().enumerate() {
            if worse == WORSE_ORDERS {
                break;
            }
            let Some(linear) = linear else { continue };
            let found = self.starts(few, &linear.system, i + 1);
            let best = found.into_iter().min_by(|a, b| judge.bic(a).total_cmp(&judge.bic(b)));
            let score = best.as_ref().map_or(f64::INFINITY, |c| judge.bic(c));
            (least, worse) = if score < least { (score, 0) } else { (least, worse + 1) };
            all.extend(best);
        }
        sort::by_key(&mut all, |c| judge.bic(c));
        all.truncate(KEPT);
        all
    }

    /// Fits a candidate to more samples, and tries more pieces and a hidden signal.
    fn refine(&mut self, c: LoopCandidate, judge: &Judge<'_>) -> LoopCandidate {
        let c = self.fit_and_list(c, judge.data, TRIAL);
        let finer = self.with_pieces(&c, KEPT_PIECES, judge, None);
        let finer = finer
            .map(|c| self.fit_and_list(c, judge.data, TRIAL))
            .filter(|f| judge.better(f, &c));
        self.try_hidden(finer.unwrap_or(c), judge)
    }

    /// The best starts of an order, fitted.
    fn starts(
        &mut self,
        few: &Observed,
        linear: &crate::identify::block::Rational,
        order: usize,
    ) -> Vec<LoopCandidate> {
        let mut all = Vec::new();
        for guess in guesses(few, linear) {
            if !self.monitor.keep_on() {
                return Vec::new();
            }
            all.extend(start(few, &guess, order).map(|s| (s, guess.name)));
        }
        sort::by_key(&mut all, |(s, _)| s.squares);
        all.truncate(REFINED);
        let candidates = all.into_iter().map(|(s, origin)| LoopCandidate {
            degrees: 0,
            squares: s.squares,
            system: s.system,
            origin,
        });
        let fitted = self.side_by_side(candidates.collect(), few, |search, c| {
            search.fit_with_less_correction(c, few)
        });
        fitted.into_iter().filter(|c| c.squares.is_finite()).collect()
    }

    /// Searches from several candidates on these samples, side by side.
    fn side_by_side(
        &mut self,
        candidates: Vec<LoopCandidate>,
        data: &Observed,
        run: impl Fn(&mut Search<'_, '_>, LoopCandidate) -> LoopCandidate + Sync,
    ) -> Vec<LoopCandidate> {
        let parameters = candidates.iter().map(|c| c.system.count()).max().unwrap_or(0);
        let numbers = 2 * data.y.len() * parameters;
        let (given, whole) = (self.data, self.whole);
        let searched = self.monitor.side_by_side(&candidates, numbers, |c, monitor| {
            let mut search = Search {
                data: given,
                whole,
                monitor,
                tried: Vec::new(),
                seen: Vec::new(),
            };
            let found = run(&mut search, c.clone());
            (found, search.tried, search.seen)
        });
        let kept = |(found, tried, seen)| {
            self.tried.extend::<Vec<Values>>(tried);
            self.seen.extend::<Vec<LoopCandidate>>(seen);
            found
        };
        searched.into_iter().map(kept).collect()
    }

    /// Fits with less and less correction of the state, in the end with none.
    fn fit_with_less_correction(&mut self, mut c: LoopCandidate, data: &Observed) -> LoopCandidate {
        c.system = c.system.corrected(CORRECTIONS[0]);
        for pair in CORRECTIONS.windows(2) {
            let next = self.fit(c.clone(), data, CORRECTED);
            if next.squares.is_finite() {
                c = next;
            }
            c.system = c.system.corrected(pair[1] / pair[0]);
        }
        self.fit_and_list(c, data, ROUGH)
    }

    /// Fits all parameters from their present values, and adds the result to the list.
    fn fit_and_list(&mut self, c: LoopCandidate, data: &Observed, rule: StopRule) -> LoopCandidate {
        let mut next = self.fit(c, data, rule);
        if !next.system.squares(self.whole).is_finite() {
            next.squares = f64::INFINITY;
        } else {
            self.seen.push(next.clone());
        }
        let count = data.counted() as f64;
        self.tried.push(Values::new([
            ("start", Value::from(next.origin)),
            ("order", next.system.order().into()),
            ("pieces", next.system.spline.pieces().into()),
            ("kinks", next.system.spline.kinks.len().into()),
            ("output_fed_back", (next.system.entering == Entering::Output).into()),
            ("relative_error", (next.squares / count).sqrt().into()),
        ]));
        next
    }

    /// The best candidate; if its error is far larger after a restart in the middle of the record, the simplest one without this problem.
    fn one_that_restarts(&self, best: LoopCandidate) -> LoopCandidate {
        let data = self.data;
        let restarted = data.restarted();
        let usual = best.squares / data.counted() as f64;
        let simpler = |c: &&LoopCandidate| c.degrees < best.degrees;
        let others: Vec<LoopCandidate> = self.seen.iter().filter(simpler).cloned().collect();
        robust_to_restart(
            best,
            usual,
            others,
            |c| c.degrees,
            |c| c.system.squares(&restarted) / restarted.counted().max(1) as f64,
        )
    }

    fn fit(&mut self, mut c: LoopCandidate, data: &Observed, rule: StopRule) -> LoopCandidate {
        c.squares = c.system.squares(data);
        let restarts = if rule.steps == LAST.steps { RESTARTS } else { 1 };
        for _ in 0..restarts {
            let at = c.system.balanced(data);
            let problem = LoopError::new(at, data);
            c.degrees = problem.directions();
            let Some(minimum) = descend(&problem, problem.start(), rule, self.monitor) else {
                break;
            };
            let fall = c.squares - minimum.squares;
            if !(fall > 0.0) {
                break;
            }
            c.system = problem.with(&minimum.parameters);
            c.squares = minimum.squares;
            if fall <= RESTART_FALL * rule.tolerance * c.squares {
                break;
            }
        }
        c
    }

    /// Tries other numbers of pieces while Schwarz's criterion falls.
    fn choose_pieces(&mut self, mut best: LoopCandidate, judge: &Judge<'_>) -> LoopCandidate {
        let fine = self
            .with_pieces(&best, FINE_PIECES, judge, None)
            .map(|c| self.fit(c, judge.data, ROUGH));
        let fine = fine.filter(|c| c.squares.is_finite()).map(|c| c.system.spline);
        let present = best.system.spline.pieces();
        let more = PIECES.iter().filter(|p| **p > present);
        let fewer = PIECES.iter().rev().filter(|p| **p <= present);
        for direction in [more.collect::<Vec<_>>(), fewer.collect()] {
            let mut worse = 0;
            for pieces in direction {
                if worse == WORSE_PIECES || !self.monitor.keep_on() {
                    break;
                }
                let mut improved = false;
                for shape in [None, fine.as_ref()] {
                    let Some(next) = self.with_pieces(&best, *pieces, judge, shape) else {
                        continue;
                    };
                    let next = self.fit_and_list(next, judge.data, TRIAL);
                    if judge.better(&next, &best) {
                        (best, improved) = (next, true);
                    }
                }
                worse = if improved { 0 } else { worse + 1 };
            }
        }
        best
    }

    /// The same loop with the nonlinearity on other breakpoints: dense where the nonlinearity is rough, or, if `shape` is given, where that
    /// curve bends.
    fn with_pieces(
        &self,
        c: &LoopCandidate,
        pieces: usize,
        judge: &Judge<'_>,
        shape: Option<&KinkedSpline>,
    ) -> Option<LoopCandidate> {
        let mut sorted = c.system.entering(judge.data)?;
        let z = sorted.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
        let even = || {
            (0..=pieces)
                .map(|i| low + (high - low) * i as f64 / pieces as f64)
                .collect()
        };
        let mut at: Vec<f64> = match shape {
            Some(shape) => shape.denser(pieces, Roughness::Second, EVEN),
            None if pieces == FINE_PIECES => even(),
            None => c.system.spline.denser(pieces, Roughness::Fourth, EVEN),
        };
        at.retain(|x| (low..=high).contains(x));
        if at.len() < 2 {
            at = even();
        }
        let last = at.len() - 1;
        (at[0], at[last]) = (low, high);
        let at = thinned(&at, &sorted, FEWEST_IN_PIECE, 2 * FEWEST_IN_PIECE);
        let spline = on_breakpoints(&c.system.spline, &at, &z)?;
        let system = Loop {
            spline,
            ..c.system.clone()
        };
        let squares = system.squares(judge.data);
        squares.is_finite().then(|| LoopCandidate {
            system,
            squares,
            ..c.clone()
        })
    }

    /// Lets a hidden signal enter the nonlinearity, if that lowers Schwarz's criterion.
    fn try_hidden(&mut self, best: LoopCandidate, judge: &Judge<'_>) -> LoopCandidate {
        if best.system.entering == Entering::Hidden {
            return best;
        }
        let mut free = best.clone();
        free.system.entering = Entering::Hidden;
        let free = self.fit_and_list(free, judge.data, TRIAL);
        if judge.better(&free, &best) { free } else { best }
    }

    /// Adds kinks, one after the other, on very strong evidence.
    fn add_kinks(&mut self, best: LoopCandidate, judge: &Judge<'_>) -> LoopCandidate {
        let mut kinked: Option<LoopCandidate> = None;
        for pieces in PIECES_UNDER_KINKS {
            let Some(start) = self.with_pieces(&best, pieces, judge, None) else {
                continue;
            };
            let mut present = self.fit_and_list(start, judge.data, ROUGH);
            while present.system.spline.kinks.len() < MOST_KINKS && self.monitor.keep_on() {
                let Some(next) = with_kink(&present, judge) else { break };
                let next = self.fit_and_list(next, judge.data, TRIAL);
                if !judge.better(&next, &present) {
                    break;
                }
                present = next;
            }
            let has_kinks = !present.system.spline.kinks.is_empty();
            if has_kinks && kinked.as_ref().is_none_or(|k| judge.better(&present, k)) {
                kinked = Some(present);
            }
        }
        kinked
            .filter(|k| judge.bic(k) < judge.bic(&best) - KINK_EVIDENCE)
            .unwrap_or(best)
    }
}

/// Adds a kink at the place where, to first order, its bend explains most of the error that all other parameters leave.
fn with_kink(c: &LoopCandidate, judge: &Judge<'_>) -> Option<LoopCandidate> {
    let few = judge.data.head(START_SAMPLES);
    let mut sorted = c.system.entering(&few)?;
    sorted.sort_unstable_by(f64::total_cmp);
    let places = (1..=KINK_PLACES).map(|i| sorted[i * sorted.len() / (KINK_PLACES + 1)]);
    let tried = parallel::batch(&places.collect::<Vec<_>>(), |&at| {
        let mut next = c.system.clone();
        next.spline.kinks.push(Kink { at, bend: 0.0 });
        let problem = LoopError::new(next, &few);
        let linearised = problem.linearise(&problem.start());
        let target: Vec<f64> = linearised.residuals.iter().map(|r| -r).collect();
        let found = least_squares(&target, &linearised.jacobian, 0)?;
        let moved = problem.with(&add(&problem.start(), &found.coefficients));
        Some((moved, found.squares))
    });
    let tried: Option<Vec<_>> = tried.into_iter().collect();
    let (moved, _) = tried?.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let bend = *moved.spline.kinks.last()?;
    // The whole step if the loop stays stable with it, otherwise its kink alone.
    let mut alone = c.system.clone();
    alone.spline.kinks.push(Kink { bend: 0.0, ..bend });
    let systems = [moved, alone].into_iter();
    let each = systems.map(|system| LoopCandidate {
        squares: system.squares(judge.data),
        system,
        ..c.clone()
    });
    each.min_by(|a, b| a.squares.total_cmp(&b.squares))
        .filter(|c| c.squares.is_finite())
}

fn add(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}
