//! Kinks of a nonlinearity: points at which, according to the data, its slope changes at once.
//!
//! A cubic spline rounds the ends of a dead zone or of a limiter off, over the width of a piece. A kink is a term $b\,(w - \kappa)_+$ in
//! addition to the spline; its place and bend are fitted with all other parameters. With kinks, fewer pieces are enough.

use super::candidate::Candidate;
use super::limits::{
    FEWER_PIECES, KINK_EVIDENCE, KINK_PLACES, MOST_KINKS, PIECES_UNDER_KINKS, RARE_KINK_PLACES, ROUGH, START_SAMPLES,
    TRIAL,
};
use super::pieces::{fewest_in_piece, refitted, with_pieces};
use super::search::{Search, numbers};
use super::signals::Signals;
use super::spline::Kink;
use super::system::{Part, System};
use crate::parallel;
use crate::sort::sorted;

impl Search<'_, '_> {
    /// Adds kinks to every nonlinearity in which the data show them, one after the other.
    pub(super) fn kinked(&mut self, mut best: Candidate, data: &Signals) -> Candidate {
        for part in best.system.parts() {
            best = self.kinked_part(best, part, data);
        }
        best
    }

    fn kinked_part(&mut self, best: Candidate, part: Part, data: &Signals) -> Candidate {
        let half = best.system.pieces(part) / 2;
        let half = (half > PIECES_UNDER_KINKS[1]).then_some(half);
        let pieces = PIECES_UNDER_KINKS.into_iter().chain(half);
        let starts: Vec<Candidate> = pieces
            .filter_map(|p| with_pieces(&best.system, part, p, data))
            .collect();
        let free = self.free;
        let searched = self
            .monitor
            .side_by_side(&starts, numbers(&starts, data), |start, monitor| {
                let mut search = Search::new(free, monitor);
                let start = search.listed(start.clone(), data, ROUGH);
                (search.with_kinks(start, part, data), search.tried)
            });
        let mut kinked: Option<Candidate> = None;
        for (next, tried) in searched {
            self.tried.extend(tried);
            let next = next.filter(|next| kinked.as_ref().is_none_or(|k| next.better(k, data)));
            kinked = next.or(kinked);
        }
        let Some(mut kinked) = kinked.filter(|k| k.bic(data) < best.bic(data) - KINK_EVIDENCE) else {
            return best;
        };
        let present = kinked.system.pieces(part);
        for share in FEWER_PIECES {
            if !self.monitor.keep_on() {
                break;
            }
            let fewer = ((present as f64 * share).round() as usize).max(1);
            if let Some(next) = with_pieces(&kinked.system, part, fewer, data) {
                let next = self.listed(next, data, TRIAL);
                if next.better(&kinked, data) {
                    kinked = next;
                }
            }
        }
        kinked
    }

    /// Adds kinks one by one while Schwarz's criterion falls; `None` if none lowers it.
    fn with_kinks(&mut self, start: Candidate, part: Part, data: &Signals) -> Option<Candidate> {
        let (mut best, mut found) = (start, false);
        while kinks(&best.system, part).len() < MOST_KINKS && self.monitor.keep_on() {
            let Some(next) = with_kink(&best.system, part, data) else {
                break;
            };
            let next = self.listed(next, data, ROUGH);
            if !(determined(&next.system, part, data) && next.better(&best, data)) {
                break;
            }
            (best, found) = (next, true);
        }
        found.then_some(best)
    }
}

fn kinks(system: &System, part: Part) -> &[Kink] {
    system.spline(part).map_or(&[], |spline| &spline.kinks)
}

/// Adds a kink at the place where it helps most with unchanged linear blocks.
fn with_kink(system: &System, part: Part, data: &Signals) -> Option<Candidate> {
    let sorted = sorted(&system.entering(part, data));
    let breakpoints = system.spline(part)?.breakpoints();
    let with = |at: f64, data: &Signals| {
        let mut next = system.clone();
        next.spline_mut(part)?.kinks.push(Kink { at, bend: 0.0 });
        refitted(&next, part, breakpoints, data)
    };
    let few = data.head(START_SAMPLES);
    let last = sorted.len() - 1;
    let even = (1..=KINK_PLACES).map(|i| i * sorted.len() / (KINK_PLACES + 1));
    let rare = RARE_KINK_PLACES.into_iter().flat_map(|share| {
        let i = (share * last as f64) as usize;
        [i, last - i]
    });
    let places: Vec<f64> = even.chain(rare).map(|i| sorted[i]).collect();
    let tried = parallel::batch(&places, |at| Some((*at, with(*at, &few)?.squares)));
    let (at, _) = tried.into_iter().flatten().min_by(|a, b| a.1.total_cmp(&b.1))?;
    with(at, data)
}

/// Whether there are samples on either side of all kinks, and between them.
fn determined(system: &System, part: Part, data: &Signals) -> bool {
    let sorted_in = sorted(&system.entering(part, data));
    let places = sorted(&kinks(system, part).iter().map(|k| k.at).collect::<Vec<_>>());
    let below = places.iter().map(|at| sorted_in.partition_point(|w| w < at));
    let bounds: Vec<usize> = std::iter::once(0).chain(below).chain([sorted_in.len()]).collect();
    bounds.windows(2).all(|w| w[1] - w[0] >= fewest_in_piece(data))
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::super::cascade::fit_nonlinearity;
    use super::super::monitor::Monitor;
    use super::super::rational::Rational;
    use super::super::spline::KinkedSpline;
    use super::super::system::{Branch, FreeParts};
    use super::*;
    use crate::signal::gaussian;

    fn front() -> Rational {
        Rational::from_polynomials(vec![0.6, 0.2], &[1.0, -0.5]).unwrap()
    }

    /// The result of the search for a curve after [`front`], with noise of 0.05.
    fn found(curve: fn(f64) -> f64, seed: u64) -> (Vec<f64>, Branch) {
        let u = gaussian(3000, seed);
        let w = front().run(&u);
        let y = w
            .iter()
            .zip(gaussian(3000, seed + 100))
            .map(|(w, e)| curve(*w) + 0.05 * e);
        let data = Signals::of_input(u, y.collect(), 50);
        let go = &mut |_: &str| ControlFlow::Continue(());
        let mut monitor = Monitor::new(go);
        let start = fit_nonlinearity(front(), Rational::pass(), &data).unwrap();
        let start = start.fitted(&data, TRIAL, &mut monitor);
        let mut search = Search::new(FreeParts::WIENER, &mut monitor);
        let start = search.pieces(start, &data);
        let found = search.kinked(start, &data).system.branches.swap_remove(0);
        // Only the ratio of the front's coefficients is determined.
        let gain = found.front.static_gain() / front().static_gain();
        let mut places: Vec<f64> = found.spline.kinks.iter().map(|k| k.at / gain).collect();
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
                assert!(found.spline.breakpoints().len() <= 4, "{name} {seed}");
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
        let data = Signals::of_input(gaussian(1000, 5), vec![0.0; 1000], 0);
        let with = |places: &[f64]| {
            let mut spline = KinkedSpline::new(&[-1.0, 1.0]);
            spline.kinks = places.iter().map(|at| Kink { at: *at, bend: 1.0 }).collect();
            determined(&System::sum(vec![Branch::of(spline)]), Part::Branch(0), &data)
        };
        assert!(with(&[0.3, -0.3]));
        for places in [&[3.5] as &[f64], &[-9.0], &[0.3, 0.3001]] {
            assert!(!with(places), "{places:?}");
        }
    }
}
