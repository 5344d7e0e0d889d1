//! The choice of poles, delays and numerators: by the free run on samples that were not fitted.
//!
//! First all numbers of poles are tried, with the delays seen in the data, and with integrators if a pole is near 1. Then changes of one
//! pole, delay or coefficient are tried until the choice stays the same. The choice is the system with the fewest parameters among those
//! that are as good as the best.

use std::ops::ControlFlow;

use super::super::block::{Monitor, Signals, Stage, StopRule, linear_delays};

use super::fit::{Criterion, whitened};
use super::held_back::{HeldBack, fitted_samples};
use super::limits::{
    FIT, HELD_BACK, LAST, LONGEST_DECAY, MOST_INTEGRATORS, MOST_POLES, NEARLY_INTEGRATES, ROUNDS, SAMPLES_A_PARAMETER,
    SEARCH_SAMPLES,
};
use super::system::{LinearSystem, Numerator, Orders, head};
use crate::linear::{Complex, TransferFunction};
use crate::parallel;

/// A system that was tried.
#[derive(Debug, Clone)]
pub struct LinearCandidate {
    pub orders: Orders,
    pub criterion: Criterion,
    system: LinearSystem,
    held_back: HeldBack,
}

impl LinearCandidate {
    /// The RMS of the held-back errors, relative to the output's standard deviation.
    pub fn relative_error(&self) -> f64 {
        (0.5 * self.held_back.score).exp()
    }
}

/// The result of the search.
#[derive(Debug)]
pub struct Search {
    /// Fitted to all samples.
    pub system: LinearSystem,
    /// How it was fitted.
    pub criterion: Criterion,
    /// All candidates, in the order in which they were tried.
    pub tried: Vec<LinearCandidate>,
}

/// The system that the samples support; `None` if no fit succeeded.
pub fn search(data: &Signals, monitor: &mut Monitor<'_>) -> Option<Search> {
    let data = head(data, usize::MAX);
    let part = head(&data, SEARCH_SAMPLES);
    monitor.stage = Stage::Structure;
    let delays = linear_delays(&part);
    let mut tried = Vec::new();
    for integrators in 0..=MOST_INTEGRATORS {
        if integrators > 0 && !tried.iter().any(nearly_integrates) {
            break;
        }
        let starts = admissible(start_orders(&delays, integrators), &[], &part);
        let jobs = starts
            .into_iter()
            .flat_map(|o| Criterion::CHOOSING.map(|c| (o.clone(), c)))
            .collect();
        tried.extend(self::tried(jobs, None, &part, monitor));
    }
    for _ in 0..ROUNDS {
        let Some(chosen) = chosen(&tried).cloned() else {
            break;
        };
        let next = admissible(neighbours(&chosen.orders), &tried, &part);
        let jobs = next.into_iter().map(|o| (o, chosen.criterion)).collect();
        let more = self::tried(jobs, Some(&chosen.system), &part, monitor);
        tried.extend(more);
        if self::chosen(&tried).is_none_or(|next| next.orders == chosen.orders) {
            break;
        }
    }
    monitor.stage = Stage::Refinement;
    let chosen = polished(chosen(&tried)?, &part);
    let LinearCandidate {
        orders,
        criterion,
        system,
        ..
    } = chosen;
    let last = match data.y.len() > part.y.len() {
        true => criterion.fitted(&orders, &data, Some(&system), LAST, monitor)?,
        false => system,
    };
    Some(Search {
        system: last,
        criterion,
        tried,
    })
}

/// Whether an estimated pole is near 1.
fn nearly_integrates(candidate: &LinearCandidate) -> bool {
    let poles = candidate.system.denominator.poles();
    poles.iter().any(|pole| (pole - 1.0).norm() < NEARLY_INTEGRATES)
}

/// All numbers of poles, with `integrators` of them at 1 and the delays seen in the data.
fn start_orders(delays: &[usize], integrators: usize) -> Vec<Orders> {
    let with = |poles: usize, delays: &[usize]| Orders {
        poles: poles - integrators,
        integrators,
        inputs: delays
            .iter()
            .map(|&delay| Numerator {
                delay,
                count: poles + 1,
            })
            .collect(),
    };
    let at_once = vec![0; delays.len()];
    let mut all: Vec<Orders> = (integrators..=MOST_POLES).map(|poles| with(poles, delays)).collect();
    if delays != at_once {
        all.extend((integrators..=MOST_POLES).map(|poles| with(poles, &at_once)));
    }
    all
}

/// One pole, one sample of delay or one coefficient more or less.
fn neighbours(orders: &Orders) -> Vec<Orders> {
    let mut all = Vec::new();
    let resized = |poles: usize, more: isize| {
        let numerator = |i: &Numerator| Numerator {
            count: i.count.saturating_add_signed(more).max(1),
            ..*i
        };
        Orders {
            poles,
            integrators: orders.integrators,
            inputs: orders.inputs.iter().map(numerator).collect(),
        }
    };
    if orders.poles > 0 {
        all.extend([resized(orders.poles - 1, -1), resized(orders.poles - 1, 0)]);
    }
    if orders.poles < MOST_POLES {
        all.extend([resized(orders.poles + 1, 1), resized(orders.poles + 1, 0)]);
    }
    for (i, Numerator { delay, count }) in orders.inputs.iter().copied().enumerate() {
        let mut with = |delay: usize, count: usize| {
            let mut next = orders.clone();
            next.inputs[i] = Numerator { delay, count };
            all.push(next);
        };
        with(delay, count + 1);
        with(delay + 1, count);
        if count > 1 {
            with(delay, count - 1);
            with(delay + 1, count - 1);
        }
        if delay > 0 {
            with(delay - 1, count);
            with(delay - 1, count + 1);
        }
    }
    all
}

/// The orders that were not yet tried and that the shortest fitted part determines.
fn admissible(orders: Vec<Orders>, before: &[LinearCandidate], data: &Signals) -> Vec<Orders> {
    let shortest = fitted_samples(HELD_BACK[0], data.y.len());
    let determined = |o: &Orders| SAMPLES_A_PARAMETER * o.parameters() <= shortest.saturating_sub(o.first());
    let known = |o: &Orders| before.iter().any(|c| c.orders == *o);
    orders.into_iter().filter(|o| determined(o) && !known(o)).collect()
}

/// The candidates of these orders; the fit starts from a system if that has as many poles.
fn tried(
    mut jobs: Vec<(Orders, Criterion)>,
    near: Option<&LinearSystem>,
    data: &Signals,
    monitor: &mut Monitor<'_>,
) -> Vec<LinearCandidate> {
    if !monitor.keep_on() {
        return Vec::new();
    }
    // Without poles, both errors are the same.
    jobs.retain(|(o, criterion)| o.order() > 0 || *criterion == Criterion::FreeRun);
    let candidates = parallel::batch(&jobs, |(orders, criterion)| {
        let as_many = |o: &Orders| (o.poles, o.integrators) == (orders.poles, orders.integrators);
        let start = near.filter(|system| as_many(&system.orders));
        candidate(orders, *criterion, start, FIT, data)
    });
    candidates.into_iter().flatten().collect()
}

/// The fit with its errors on held-back samples. `None` if it rings for much longer than the record, or has a pole that no input moves:
/// with an initial state, such a system would follow any slow swing.
fn candidate(
    orders: &Orders,
    criterion: Criterion,
    start: Option<&LinearSystem>,
    rule: StopRule,
    data: &Signals,
) -> Option<LinearCandidate> {
    let mut go_on = |_: &str| ControlFlow::Continue(());
    let monitor = &mut Monitor::new(&mut go_on);
    let system = criterion.fitted(orders, data, start, rule, monitor)?;
    let longest = (-1.0 / (LONGEST_DECAY * data.y.len() as f64)).exp();
    let rings_on = |pole: &Complex<f64>| pole.im != 0.0 && pole.norm() > longest;
    if system.denominator.poles().iter().any(rings_on) || drifts_alone(&system, longest) {
        return None;
    }
    let held_back = HeldBack::new(orders, criterion, &system, data, monitor)?;
    Some(LinearCandidate {
        orders: orders.clone(),
        criterion,
        system,
        held_back,
    })
}

/// Whether there is a real pole slower than `longest` and, for every input, a zero slower than that too. The two nearly cancel over the
/// record: only the initial state moves such a pole.
pub(super) fn drifts_alone(system: &LinearSystem, longest: f64) -> bool {
    let slow = |root: &Complex<f64>| root.im == 0.0 && root.re > longest;
    let has_slow_zero = |b: Vec<f64>| {
        let zeros = TransferFunction::new(b, vec![1.0]).ok().and_then(|g| g.zeros());
        zeros.is_some_and(|zeros| zeros.iter().any(slow))
    };
    let has_slow_pole = system.orders.integrators > 0 || system.denominator.poles().iter().any(slow);
    has_slow_pole && system.numerator_polynomials().into_iter().all(has_slow_zero)
}

/// The candidate after full minimisation, and whitened, unless it then predicts worse: in that case it follows effects that later samples
/// do not have.
fn polished(chosen: &LinearCandidate, data: &Signals) -> LinearCandidate {
    let further = |from: &LinearCandidate, criterion: Criterion| {
        let last = candidate(&from.orders, criterion, Some(&from.system), LAST, data);
        last.filter(|last| last.held_back.as_good_as(&from.held_back))
    };
    let last = further(chosen, chosen.criterion).unwrap_or_else(|| chosen.clone());
    let mut go_on = |_: &str| ControlFlow::Continue(());
    let mut coloured = || whitened(&last.system, data, &mut Monitor::new(&mut go_on)).is_some();
    if last.criterion != Criterion::FreeRun || !coloured() {
        return last;
    }
    further(&last, Criterion::Whitened).unwrap_or(last)
}

/// The candidate with the fewest parameters among those that are as good as the best.
fn chosen(tried: &[LinearCandidate]) -> Option<&LinearCandidate> {
    let score = |c: &LinearCandidate| c.held_back.score;
    let best = tried.iter().min_by(|a, b| score(a).total_cmp(&score(b)))?;
    let as_good = tried.iter().filter(|c| c.held_back.as_good_as(&best.held_back));
    let simplest = as_good.min_by(|a, b| {
        let parameters = |c: &LinearCandidate| c.orders.parameters();
        parameters(a).cmp(&parameters(b)).then(score(a).total_cmp(&score(b)))
    });
    simplest.or(Some(best))
}
