//! Systems of one branch, whose starts are the poles and zeros of linear approximations.

use super::candidate::Candidate;
use super::limits::{START_SAMPLES, TRIAL_STEPS};
use super::monitor::{Monitor, Stage};
use super::prepared::Prepared;
use super::rational::Rational;
use super::search::{FreeParts, Round, Search, SearchResult};
use super::signals::Signals;
use super::spline::KinkedSpline;
use super::split::{fit_nonlinearity, split};
use super::system::{Branch, System};

/// Splits of every order that are screened.
const SCREENED: usize = 8;
/// Short fits: of all starts as they are, then with finer nonlinearities.
const ROUNDS: [Round; 3] = [
    Round {
        samples: 10_000,
        kept: usize::MAX,
        pieces: None,
        steps: TRIAL_STEPS,
        tolerance: 1e-3,
        listed: true,
    },
    Round {
        samples: 10_000,
        kept: 8,
        pieces: Some(16),
        steps: 2 * TRIAL_STEPS,
        tolerance: 1e-4,
        listed: true,
    },
    Round {
        samples: 10_000,
        kept: 3,
        pieces: Some(16),
        steps: 2 * TRIAL_STEPS,
        tolerance: 1e-4,
        listed: true,
    },
];

/// All splits of the linear approximations' poles and zeros that are worth a fit.
pub(in crate::identify) fn splits(prepared: &Prepared, monitor: &mut Monitor<'_>) -> Vec<Candidate> {
    monitor.stage = Stage::Split;
    let few = prepared.data.head(START_SAMPLES);
    let mut candidates = Vec::new();
    for system in prepared.starting() {
        if monitor.keep_on() {
            candidates.extend(split(system, &few).into_iter().take(SCREENED));
        }
    }
    candidates
}

/// The best system of one branch that the starts lead to, on data of unit variance and zero mean.
pub(in crate::identify) fn search(
    mut starts: Vec<Candidate>,
    free: FreeParts,
    data: &Signals,
    monitor: &mut Monitor<'_>,
) -> Option<SearchResult> {
    for branch in starts.iter_mut().flat_map(|c| &mut c.system.branches) {
        branch.front.fill_numerator();
        branch.back.fill_numerator();
    }
    Search::new(free, monitor).run(starts, &ROUNDS, data)
}

/// The result without a start: a static nonlinearity, or a constant.
pub(in crate::identify) fn without_start(data: &Signals) -> SearchResult {
    let constant = || System::sum(vec![Branch::of(KinkedSpline::new(&[-1.0, 1.0]))]);
    let fit = fit_nonlinearity(Rational::pass(), Rational::pass(), data);
    SearchResult {
        system: fit.map_or_else(constant, |c| c.system),
        tried: Vec::new(),
    }
}
