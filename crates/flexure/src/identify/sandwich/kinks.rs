//! Kinks of the nonlinearity: points at which the data show that its slope changes at once.
//!
//! A cubic spline rounds the ends of a dead zone or of a limiter off, over the width of a piece. A kink is a term
//! $b\,(w - \kappa)_+$ besides the spline, whose place and bend are fitted with all the rest. Where kinks take over
//! what pieces were there for, fewer pieces do.

use super::loss::Data;
use super::monitor::Monitor;
use super::refine::{TRIAL_STEPS, TriedStructure, fewest_in_piece, fitted, with_pieces};
use super::search::START_SAMPLES;
use super::shape::Kink;
use super::split::{Candidate, refit_coefficients};

/// Shares of the samples below the places at which a kink is tried.
const PLACES: usize = 40;
const MOST_KINKS: usize = 6;
/// Pieces of the spline that kinks are first put on: too few to imitate one.
const COARSE_PIECES: usize = 3;
/// Pieces relative to the present number, once there are kinks.
const FEWER_PIECES: [f64; 3] = [0.3, 0.5, 0.7];
/// Kinks are taken if Schwarz's criterion is lower by more than this: "very strong" evidence (Kass & Raftery 1995).
const EVIDENCE: f64 = 10.0;

/// With kinks, if the data show them.
pub(super) fn kinked(
    best: Candidate,
    data: &Data,
    monitor: &mut Monitor<'_>,
    tried: &mut Vec<TriedStructure>,
) -> Candidate {
    let coarse = with_pieces(&best, COARSE_PIECES, data).map(|c| fitted(c, data, TRIAL_STEPS, 1e-4, monitor));
    let mut kinked: Option<Candidate> = None;
    for start in coarse.into_iter().chain([best.clone()]) {
        if let Some(next) = with_kinks(start, data, monitor, tried) {
            kinked = Some(better(kinked, next, data));
        }
    }
    let Some(mut kinked) = kinked.filter(|k| k.bic(data) < best.bic(data) - EVIDENCE) else {
        return best;
    };
    let present = kinked.sandwich.shape.breakpoints().len() - 1;
    for share in FEWER_PIECES {
        if !monitor.keep_on() {
            break;
        }
        let pieces = ((present as f64 * share).round() as usize).max(1);
        if let Some(next) = with_pieces(&kinked, pieces, data) {
            let next = fitted(next, data, TRIAL_STEPS, 1e-4, monitor);
            tried.push(next.tried(data));
            kinked = better(Some(kinked), next, data);
        }
    }
    kinked
}

/// The one of lower criterion.
fn better(first: Option<Candidate>, second: Candidate, data: &Data) -> Candidate {
    match first {
        Some(first) if first.bic(data) <= second.bic(data) => first,
        _ => second,
    }
}

/// One kink more, and one more, while Schwarz's criterion falls; `None` if none lowers it.
fn with_kinks(
    start: Candidate,
    data: &Data,
    monitor: &mut Monitor<'_>,
    tried: &mut Vec<TriedStructure>,
) -> Option<Candidate> {
    let (mut best, mut found) = (start, false);
    while best.sandwich.shape.kinks.len() < MOST_KINKS && monitor.keep_on() {
        let Some(next) = with_kink(&best, data) else { break };
        let next = fitted(next, data, TRIAL_STEPS, 1e-4, monitor);
        tried.push(next.tried(data));
        if !(determined(&next, data) && next.bic(data) < best.bic(data)) {
            break;
        }
        (best, found) = (next, true);
    }
    found.then_some(best)
}

/// A kink more, at the place at which it does most for the linear blocks as they are.
fn with_kink(c: &Candidate, data: &Data) -> Option<Candidate> {
    let few = data.head(START_SAMPLES);
    let mut sorted = c.sandwich.front.run(&data.u)[data.from..].to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let place = |i: usize| sorted[(i * sorted.len()) / (PLACES + 1)];
    let with = |at: f64| {
        let mut sandwich = c.sandwich.clone();
        sandwich.shape.kinks.push(Kink { at, bend: 0.0 });
        refit_coefficients(sandwich, c.sandwich.shape.breakpoints(), &few)
    };
    let tried = (1..=PLACES).filter_map(|i| with(place(i)));
    let best = tried.min_by(|a, b| a.squares.total_cmp(&b.squares))?;
    refit_coefficients(best.sandwich, c.sandwich.shape.breakpoints(), data)
}

/// Whether there are samples on either side of every kink, and between them.
fn determined(c: &Candidate, data: &Data) -> bool {
    let mut sorted = c.sandwich.front.run(&data.u)[data.from..].to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let mut places: Vec<f64> = c.sandwich.shape.kinks.iter().map(|k| k.at).collect();
    places.sort_unstable_by(f64::total_cmp);
    let below = places.iter().map(|at| sorted.partition_point(|w| w < at));
    let bounds: Vec<usize> = std::iter::once(0).chain(below).chain([sorted.len()]).collect();
    let fewest = fewest_in_piece(data);
    bounds.windows(2).all(|w| w[1] - w[0] >= fewest)
}
