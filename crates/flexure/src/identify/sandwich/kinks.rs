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
/// A fit with kinks on trial ends at steps that lower the sum of squares by less than this share.
const TOLERANCE: f64 = 1e-3;
/// Pieces of the spline that kinks are put on: too few to imitate one; and half of those there are.
const COARSE_PIECES: [usize; 2] = [1, 3];
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
    let half = (best.sandwich.shape.breakpoints().len() - 1) / 2;
    let mut kinked: Option<Candidate> = None;
    for pieces in COARSE_PIECES
        .into_iter()
        .chain((half > COARSE_PIECES[1]).then_some(half))
    {
        let Some(start) = with_pieces(&best, pieces, data) else {
            continue;
        };
        let start = fitted(start, data, TRIAL_STEPS, TOLERANCE, monitor);
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
        let next = fitted(next, data, TRIAL_STEPS, TOLERANCE, monitor);
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

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::super::loss::Sandwich;
    use super::super::rational::Rational;
    use super::super::refine::pieces;
    use super::super::shape::Shape;
    use super::super::split::fit_shape;
    use super::*;

    fn normal(n: usize, seed: u64) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        (0..n).map(|_| StandardNormal.sample(&mut rng)).collect()
    }

    fn front() -> Rational {
        Rational::from_polynomials(vec![0.6, 0.2], &[1.0, -0.5]).unwrap()
    }

    /// What the search makes of a curve behind [`front`], with noise of 0.05.
    fn found(curve: fn(f64) -> f64, seed: u64) -> (Vec<f64>, Candidate) {
        let u = normal(3000, seed);
        let w = front().run(&u);
        let y = w
            .iter()
            .zip(normal(3000, seed + 100))
            .map(|(w, e)| curve(*w) + 0.05 * e);
        let data = Data::new(u, y.collect(), 50);
        let go = &mut |_| ControlFlow::Continue(());
        let mut monitor = Monitor::new(go);
        let start = fit_shape(front(), Rational::pass(), &data).unwrap();
        let start = fitted(start, &data, TRIAL_STEPS, 1e-4, &mut monitor);
        let start = pieces(start, &data, TRIAL_STEPS, &mut monitor, &mut Vec::new());
        let found = kinked(start, &data, &mut monitor, &mut Vec::new());
        // Of the front only the ratio of the coefficients is determined.
        let gain = found.sandwich.front.static_gain() / front().static_gain();
        let mut places: Vec<f64> = found.sandwich.shape.kinks.iter().map(|k| k.at / gain).collect();
        places.sort_unstable_by(f64::total_cmp);
        (places, found)
    }

    #[test]
    fn the_ends_of_a_limiter_and_of_a_dead_zone_are_found() {
        for seed in 0..3 {
            let limiter = |w: f64| w.clamp(-0.5, 0.8);
            let dead_zone = |w: f64| (w - 0.8).max(0.0) + (w + 0.5).min(0.0);
            for (name, curve) in [("limiter", limiter as fn(f64) -> f64), ("dead zone", dead_zone)] {
                let (places, found) = found(curve, seed);
                assert_eq!(places.len(), 2, "{name} {seed}: {places:?}");
                for (place, truth) in places.iter().zip([-0.5, 0.8]) {
                    // With the slope known, its standard error is about 0.005.
                    assert!((place - truth).abs() < 0.03, "{name} {seed}: {places:?}");
                }
                assert!(found.sandwich.shape.breakpoints().len() <= 4, "{name} {seed}");
            }
        }
    }

    #[test]
    fn smooth_curves_have_none() {
        for seed in 0..3 {
            for curve in [f64::tanh as fn(f64) -> f64, f64::sin, |w| w + 0.3 * w * w * w] {
                let (places, _) = found(curve, seed);
                assert!(places.is_empty(), "{seed}: {places:?}");
            }
        }
    }

    #[test]
    fn a_kink_needs_samples_on_either_side() {
        let data = Data::new(normal(1000, 5), vec![0.0; 1000], 0);
        let with = |places: &[f64]| {
            let mut shape = Shape::new(&[-1.0, 1.0]);
            shape.kinks = places.iter().map(|at| Kink { at: *at, bend: 1.0 }).collect();
            let sandwich = Sandwich {
                front: Rational::pass(),
                shape,
                back: Rational::pass(),
                between: None,
                offset: 0.0,
            };
            let squares = 0.0;
            determined(&Candidate { sandwich, squares }, &data)
        };
        assert!(with(&[0.3, -0.3]));
        for places in [&[3.5] as &[f64], &[-9.0], &[0.3, 0.3001]] {
            assert!(!with(places), "{places:?}");
        }
    }
}
