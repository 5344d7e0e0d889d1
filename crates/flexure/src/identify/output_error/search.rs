//! The choice of poles, delays and numerators: by the free run on samples that were not fitted.
//!
//! First all numbers of poles are tried, with the delays seen in the data, and with integrators if a pole is near 1. Then changes of one
//! pole, delay or coefficient are tried until the choice stays the same. The choice is the system with the fewest parameters among those
//! that are as good as the best. If the noise is coloured, it is filtered out of the comparison ([`HighOrder`]).

use std::ops::{ControlFlow, RangeInclusive};

use super::super::block::{Monitor, Signals, Stage, StopRule, linear_delays};

use super::fit::{Criterion, Start, whitened};
use super::held_back::{HeldBack, fitted_samples};
use super::high_order::HighOrder;
use super::limits::{
    FIT, HELD_BACK, LAST, LONGEST_DECAY, MOST_INTEGRATORS, MOST_POLES, NEARLY_INTEGRATES, ROUNDS, SAMPLES_A_PARAMETER,
    SEARCH_SAMPLES, TOLERATED_IN_NOISE, TOLERATED_RATIO, USUAL_POLES,
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
        (0.5 * self.held_back.plain.score).exp()
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
    let high_order = HighOrder::new(&part);
    let delays = linear_delays(high_order.as_ref().map_or(&part, |system| &system.filtered));
    let from_data = Start {
        near: None,
        high_order: high_order.as_ref(),
    };
    let mut tried = Vec::new();
    for integrators in 0..=MOST_INTEGRATORS {
        if integrators > 0 && !tried.iter().any(nearly_integrates) {
            break;
        }
        tried.extend(started(
            start_orders(&delays, integrators, integrators..=USUAL_POLES),
            from_data,
            &part,
            monitor,
        ));
    }
    let most = chosen(&tried).map(|c| &c.orders).filter(|o| o.order() == USUAL_POLES);
    if let Some(integrators) = most.map(|o| o.integrators) {
        let more = start_orders(&delays, integrators, USUAL_POLES + 1..=MOST_POLES);
        tried.extend(started(more, from_data, &part, monitor));
    }
    for _ in 0..ROUNDS {
        let Some(chosen) = chosen(&tried).cloned() else {
            break;
        };
        let next = admissible(neighbours(&chosen.orders), &tried, &part);
        let jobs = next.into_iter().map(|o| (o, chosen.criterion)).collect();
        let near = from_data.near(&chosen.system);
        let more = self::tried(jobs, near, &part, monitor);
        tried.extend(more);
        if self::chosen(&tried).is_none_or(|next| next.orders == chosen.orders) {
            break;
        }
    }
    monitor.stage = Stage::Refinement;
    let chosen = polished(chosen(&tried)?, from_data, &part);
    let LinearCandidate {
        orders,
        criterion,
        system,
        ..
    } = chosen;
    let last = match data.y.len() > part.y.len() {
        true => criterion.fitted(&orders, &data, from_data.near(&system), LAST, monitor)?,
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

/// The candidates of these orders by every criterion, from the data alone.
fn started(orders: Vec<Orders>, start: Start<'_>, part: &Signals, monitor: &mut Monitor<'_>) -> Vec<LinearCandidate> {
    let of_all = |o: Orders| Criterion::CHOOSING.map(|c| (o.clone(), c));
    let jobs = admissible(orders, &[], part).into_iter().flat_map(of_all).collect();
    tried(jobs, start, part, monitor)
}

/// These numbers of poles, with `integrators` of them at 1 and the delays seen in the data.
fn start_orders(delays: &[usize], integrators: usize, poles: RangeInclusive<usize>) -> Vec<Orders> {
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
    let mut all: Vec<Orders> = poles.clone().map(|poles| with(poles, delays)).collect();
    if delays != at_once {
        all.extend(poles.map(|poles| with(poles, &at_once)));
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
    start: Start<'_>,
    data: &Signals,
    monitor: &mut Monitor<'_>,
) -> Vec<LinearCandidate> {
    if !monitor.keep_on() {
        return Vec::new();
    }
    // Without poles, the free run and the difference equation have the same error. The colour of the noise is known without integrators.
    jobs.retain(|(o, criterion)| o.order() > 0 || *criterion != Criterion::Equation);
    jobs.retain(|(o, criterion)| o.integrators == 0 || *criterion != Criterion::Filtered);
    let candidates = parallel::batch(&jobs, |(orders, criterion)| {
        let as_many = |o: &Orders| (o.poles, o.integrators) == (orders.poles, orders.integrators);
        let near = start.near.filter(|system| as_many(&system.orders));
        let start = Start { near, ..start };
        candidate(orders, *criterion, start, FIT, data)
    });
    candidates.into_iter().flatten().collect()
}

/// The fit with its errors on held-back samples. `None` if it rings for much longer than the record, or has a pole that no input moves:
/// with an initial state, such a system would follow any slow swing.
fn candidate(
    orders: &Orders,
    criterion: Criterion,
    start: Start<'_>,
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
    let held_back = HeldBack::new(orders, criterion, &system, start, data, monitor)?;
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
fn polished(chosen: &LinearCandidate, start: Start<'_>, data: &Signals) -> LinearCandidate {
    let further = |from: &LinearCandidate, criterion: Criterion| {
        let last = candidate(&from.orders, criterion, start.near(&from.system), LAST, data);
        last.filter(|last| last.held_back.plain.as_good_as(&from.held_back.plain, TOLERATED_RATIO))
    };
    let last = further(chosen, chosen.criterion).unwrap_or_else(|| chosen.clone());
    let mut go_on = |_: &str| ControlFlow::Continue(());
    let mut coloured = || whitened(&last.system, data, &mut Monitor::new(&mut go_on)).is_some();
    if last.criterion != Criterion::FreeRun || !coloured() {
        return last;
    }
    further(&last, Criterion::Whitened).unwrap_or(last)
}

/// The candidate with the fewest parameters among those that are as good as the best. If the noise is coloured, they are compared by the
/// filtered errors: the plain ones are mostly noise, and chance decides. But candidates with a clearly worse free run are left out.
fn chosen(tried: &[LinearCandidate]) -> Option<&LinearCandidate> {
    let plain = |c: &&LinearCandidate| c.held_back.plain.score;
    let best = tried.iter().min_by(|a, b| plain(a).total_cmp(&plain(b)))?;
    let tolerated = match best.held_back.filtered {
        Some(_) => TOLERATED_IN_NOISE,
        None => TOLERATED_RATIO,
    };
    let runs_well = |c: &&LinearCandidate| c.held_back.plain.as_good_as(&best.held_back.plain, tolerated);
    let score = |c: &&LinearCandidate| c.held_back.deciding().score;
    let good = || tried.iter().filter(runs_well);
    let best = good().min_by(|a, b| score(a).total_cmp(&score(b))).unwrap_or(best);
    let as_good = |c: &&LinearCandidate| {
        let [errors, least] = [c, best].map(|c| c.held_back.deciding());
        errors.as_good_as(least, TOLERATED_RATIO)
    };
    let parameters = |c: &LinearCandidate| c.orders.parameters();
    let simplest = good().filter(as_good);
    let simplest = simplest.min_by(|a, b| parameters(a).cmp(&parameters(b)).then(score(a).total_cmp(&score(b))));
    simplest.or(Some(best))
}
