//! Starts for Wiener systems: the linear approximations, and rational blocks that imitate an impulse response from higher moments.

use super::super::super::block::{
    Candidate, LARGEST_ORDER, LONGEST_DELAY, Monitor, Prepared, Rational, START_SAMPLES, Scale, Signals, Stage,
    approximate_all, fit_nonlinearity,
};
use super::super::super::hammerstein::delay::Dependence;
use super::super::limits::{
    DELAY_SLACK, IMPULSE_RESPONSE, MOMENT_LAGS, MOMENT_SAMPLES, MOST_FRONTS, SAMPLES_PER_MOMENT_LAG,
};
use super::WienerStart;
use super::directions::directions;
use crate::sort;

/// The delay after which the output depends on the input in any way, less some slack.
pub(super) fn delay_of_any_dependence(u: &[f64], y: &[f64]) -> usize {
    let first = Dependence::new(u, y, LONGEST_DELAY.min(u.len() / 10)).first();
    first.unwrap_or(0).saturating_sub(DELAY_SLACK)
}

/// The starts of a search.
pub(super) struct WienerStarts {
    pub candidates: Vec<Candidate>,
    /// The source of the best one before refinement.
    pub from: WienerStart,
}

/// Candidates, and the source of the best one before refinement.
pub(super) fn starts(prepared: &Prepared, monitor: &mut Monitor<'_>) -> WienerStarts {
    monitor.stage = Stage::Correlation;
    let few = prepared.data.head(START_SAMPLES);
    let linear = prepared.starting().into_iter();
    let mut candidates: Vec<Candidate> = linear
        .filter_map(|g| fit_nonlinearity(g.clone(), Rational::pass(), &few))
        .collect();
    let least = candidates.iter().map(|c| c.squares).fold(f64::INFINITY, f64::min);
    match from_moments(&prepared.data, &few, monitor) {
        Some(response) if response.squares < least => {
            candidates.extend(rational(response, &few, monitor));
            WienerStarts {
                candidates,
                from: WienerStart::HigherMoments,
            }
        }
        _ => WienerStarts {
            candidates,
            from: WienerStart::LinearApproximation,
        },
    }
}

/// The best finite impulse response from higher moments.
fn from_moments(data: &Signals, few: &Signals, monitor: &mut Monitor<'_>) -> Option<Candidate> {
    if !monitor.keep_on() {
        return None;
    }
    let data = data.head(MOMENT_SAMPLES);
    let lags = MOMENT_LAGS.min(data.counted() / SAMPLES_PER_MOMENT_LAG).max(1);
    let judged = directions(data.input(), &data.y, lags)
        .into_iter()
        .filter_map(|b| fit_nonlinearity(Rational::pass().with_numerator(b), Rational::pass(), few));
    judged.min_by(|a, b| a.squares.total_cmp(&b.squares))
}

/// Rational blocks that imitate the refined finite impulse response.
fn rational(response: Candidate, few: &Signals, monitor: &mut Monitor<'_>) -> Vec<Candidate> {
    let response = response.fitted(few, IMPULSE_RESPONSE, monitor);
    let w = response.system.branches[0].front.run(few.input());
    let imitation = Signals {
        y: Scale::new(&w).standardised(&w),
        ..few.clone()
    };
    let approximations = approximate_all(&imitation, 1..=LARGEST_ORDER, monitor);
    let mut all: Vec<Candidate> = (approximations.into_iter().flatten())
        .filter_map(|a| fit_nonlinearity(a.system, Rational::pass(), few))
        .collect();
    sort::by_key(&mut all, |c| c.bic(few));
    all.truncate(MOST_FRONTS);
    all
}
