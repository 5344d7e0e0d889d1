//! Hammerstein branches, one for each input, whose sum passes a last nonlinearity or none.
//!
//! The [Hammerstein-Wiener](crate::identify::HAMMERSTEIN_WIENER) system (one branch) and the
//! [one with several inputs](crate::identify::MULTIPLE_INPUTS) (no last nonlinearity) start here.

use super::approximation::approximate;
use super::candidate::Candidate;
use super::limits::{LARGEST_START_ORDER, START_PIECES, START_SAMPLES, STRUCTURE_SAMPLES, TRIAL_STEPS, WORSE_ORDERS};
use super::monitor::{Monitor, Stage};
use super::pieces::with_output;
use super::rational::Rational;
use super::search::{FreeParts, Round, Search, SearchResult};
use super::signals::Signals;
use super::spline::KinkedSpline;
use super::start::{branches, delays};
use super::system::{Branch, Level, System};
use crate::sort;

/// Short fits of the best starts, then of finer nonlinearities.
const ROUNDS: [Round; 2] = [
    Round {
        samples: STRUCTURE_SAMPLES,
        kept: 3,
        pieces: None,
        steps: TRIAL_STEPS,
        tolerance: 1e-3,
        listed: false,
    },
    Round {
        samples: STRUCTURE_SAMPLES,
        kept: 3,
        pieces: Some(10),
        steps: 2 * TRIAL_STEPS,
        tolerance: 1e-4,
        listed: true,
    },
];

/// The search, on signals of unit variance and zero mean; `None` if there is nothing to start from.
pub(in crate::identify) fn find(data: &Signals, last: bool, monitor: &mut Monitor<'_>) -> Option<SearchResult> {
    monitor.stage = Stage::Approximation;
    let mut search = Search::new(FreeParts::DELAYED_HAMMERSTEIN, monitor);
    let starts = starts(&data.head(START_SAMPLES), last, &mut search);
    let settling = starts.first()?.system.settling(1e-4);
    let mut data = data.clone();
    data.from = settling.clamp(data.y.len() / 100, data.y.len() / 10);
    search.run(starts, &ROUNDS, &data)
}

/// Systems of rising orders after short fits, best first.
fn starts(data: &Signals, last: bool, search: &mut Search<'_, '_>) -> Vec<Candidate> {
    let delays = delays(data);
    let mut all: Vec<Candidate> = Vec::new();
    let (mut least, mut worse) = (f64::INFINITY, 0);
    for order in 0..=LARGEST_START_ORDER.min(data.counted() / 30) {
        if !search.monitor.keep_on() || worse > WORSE_ORDERS {
            break;
        }
        let start = branches(data, order, &delays, 1).map(|system| Candidate::new(system, data));
        let mut of_order: Vec<Candidate> = start.into_iter().collect();
        for c in &mut of_order {
            *c = c.clone().fitted(data, TRIAL_STEPS, 1e-3, search.monitor);
        }
        if last {
            of_order.extend(linear(data, order, &delays, search.monitor));
            of_order = of_order
                .into_iter()
                .filter_map(|c| with_output(&c.system, START_PIECES, data))
                .map(|c| c.fitted(data, 2 * TRIAL_STEPS, 1e-3, search.monitor))
                .collect();
        }
        search.tried.extend(of_order.iter().map(|c| c.tried(data)));
        let best = of_order.iter().map(|c| c.bic(data)).fold(f64::INFINITY, f64::min);
        (least, worse) = if best < least { (best, 0) } else { (least, worse + 1) };
        all.extend(of_order);
    }
    sort::by_key(&mut all, |c| c.bic(data));
    all
}

/// A straight line, then the best linear approximation: where a Wiener system lies. Only for one input.
fn linear(data: &Signals, order: usize, delays: &[usize], monitor: &mut Monitor<'_>) -> Option<Candidate> {
    let ([u], [delay]) = (&data.u[..], delays) else {
        return None;
    };
    let mut branch = Branch {
        delay: *delay,
        ..Branch::of(KinkedSpline::coarse(&u[data.from..], START_PIECES)?)
    };
    branch.spline.straighten();
    let delayed = branch.delayed(&data.u).into_owned();
    let approximated = Signals::of_input(delayed, data.y.clone(), data.from);
    branch.back = approximate(&approximated, order.max(1), monitor)?.system;
    let system = System {
        branches: vec![branch],
        output: None,
        level: Level::Offset,
    };
    Some(Candidate::new(system, data))
}

/// The result without a start: a constant, with a branch that does nothing if there is a last nonlinearity.
pub(in crate::identify) fn without_start(last: bool) -> SearchResult {
    let branch = Branch::new(Rational::pass(), KinkedSpline::new(&[-1.0, 1.0]), Rational::pass());
    SearchResult {
        system: System {
            branches: if last { vec![branch] } else { Vec::new() },
            output: None,
            level: Level::Offset,
        },
        tried: Vec::new(),
    }
}
