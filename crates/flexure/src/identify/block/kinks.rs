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

/// One nonlinearity of models that are fitted to some samples.
pub(in crate::identify) trait Bendable {
    /// A model and how good it is.
    type Candidate: Clone;
    fn pieces(&self, c: &Self::Candidate) -> usize;
    fn kinks<'c>(&self, c: &'c Self::Candidate) -> &'c [Kink];
    /// What enters the nonlinearity at the samples that count.
    fn entering(&self, c: &Self::Candidate) -> Vec<f64>;
    /// With as many pieces; the rest as it is.
    fn with_pieces(&self, c: &Self::Candidate, pieces: usize) -> Option<Self::Candidate>;
    /// With these kinks, their bends and the coefficients by least squares on at most so many samples.
    fn with_kinks(&self, c: &Self::Candidate, kinks: Vec<Kink>, samples: usize) -> Option<Self::Candidate>;
    /// The sum of squares on the samples of the last fit.
    fn squares(&self, c: &Self::Candidate) -> f64;
    /// All parameters fitted from where they are; the structure goes on the list of those that were tried.
    fn fitted(&mut self, c: Self::Candidate, tolerance: f64, monitor: &mut Monitor<'_>) -> Self::Candidate;
    /// Schwarz's criterion.
    fn criterion(&self, c: &Self::Candidate) -> f64;
    /// The fewest samples in a piece.
    fn fewest_in_piece(&self) -> usize;
}

/// That of a cascade.
pub(super) struct Middle<'a> {
    pub data: &'a Data,
    pub tried: &'a mut Vec<TriedStructure>,
}

impl Bendable for Middle<'_> {
    type Candidate = Candidate;

    fn pieces(&self, c: &Candidate) -> usize {
        c.cascade.shape.breakpoints().len() - 1
    }

    fn kinks<'c>(&self, c: &'c Candidate) -> &'c [Kink] {
        &c.cascade.shape.kinks
    }

    fn entering(&self, c: &Candidate) -> Vec<f64> {
        c.cascade.front.run(&self.data.u)[self.data.from..].to_vec()
    }

    fn with_pieces(&self, c: &Candidate, pieces: usize) -> Option<Candidate> {
        with_pieces(c, pieces, self.data)
    }

    fn with_kinks(&self, c: &Candidate, kinks: Vec<Kink>, samples: usize) -> Option<Candidate> {
        let mut cascade = c.cascade.clone();
        cascade.shape.kinks = kinks;
        refit_coefficients(cascade, c.cascade.shape.breakpoints(), &self.data.head(samples))
    }

    fn squares(&self, c: &Candidate) -> f64 {
        c.squares
    }

    fn fitted(&mut self, c: Candidate, tolerance: f64, monitor: &mut Monitor<'_>) -> Candidate {
        let next = fitted(c, self.data, TRIAL_STEPS, tolerance, monitor);
        self.tried.push(next.tried(self.data));
        next
    }

    fn criterion(&self, c: &Candidate) -> f64 {
        c.bic(self.data)
    }

    fn fewest_in_piece(&self) -> usize {
        fewest_in_piece(self.data)
    }
}

/// With kinks, if the data show them.
pub(in crate::identify) fn kinked<B: Bendable>(
    best: B::Candidate,
    of: &mut B,
    monitor: &mut Monitor<'_>,
) -> B::Candidate {
    let half = of.pieces(&best) / 2;
    let mut kinked: Option<B::Candidate> = None;
    for pieces in COARSE_PIECES
        .into_iter()
        .chain((half > COARSE_PIECES[1]).then_some(half))
    {
        let Some(start) = of.with_pieces(&best, pieces) else {
            continue;
        };
        let start = of.fitted(start, TOLERANCE, monitor);
        if let Some(next) = with_kinks(start, of, monitor) {
            kinked = Some(better(kinked, next, of));
        }
    }
    let Some(mut kinked) = kinked.filter(|k| of.criterion(k) < of.criterion(&best) - EVIDENCE) else {
        return best;
    };
    let present = of.pieces(&kinked);
    for share in FEWER_PIECES {
        if !monitor.keep_on() {
            break;
        }
        let fewer = ((present as f64 * share).round() as usize).max(1);
        if let Some(next) = of.with_pieces(&kinked, fewer) {
            let next = of.fitted(next, 1e-4, monitor);
            kinked = better(Some(kinked), next, of);
        }
    }
    kinked
}

/// The one of lower criterion.
fn better<B: Bendable>(first: Option<B::Candidate>, second: B::Candidate, of: &B) -> B::Candidate {
    match first {
        Some(first) if of.criterion(&first) <= of.criterion(&second) => first,
        _ => second,
    }
}

/// One kink more, and one more, while Schwarz's criterion falls; `None` if none lowers it.
fn with_kinks<B: Bendable>(start: B::Candidate, of: &mut B, monitor: &mut Monitor<'_>) -> Option<B::Candidate> {
    let (mut best, mut found) = (start, false);
    while of.kinks(&best).len() < MOST_KINKS && monitor.keep_on() {
        let Some(next) = with_kink(&best, of) else { break };
        let next = of.fitted(next, TOLERANCE, monitor);
        if !(determined(&next, of) && of.criterion(&next) < of.criterion(&best)) {
            break;
        }
        (best, found) = (next, true);
    }
    found.then_some(best)
}

/// A kink more, at the place at which it does most while the linear blocks stay.
fn with_kink<B: Bendable>(c: &B::Candidate, of: &B) -> Option<B::Candidate> {
    let sorted = sorted(of.entering(c));
    let with = |at: f64| {
        let mut kinks = of.kinks(c).to_vec();
        kinks.push(Kink { at, bend: 0.0 });
        kinks
    };
    let tried = (1..=PLACES).filter_map(|i| {
        let at = sorted[i * sorted.len() / (PLACES + 1)];
        Some((at, of.squares(&of.with_kinks(c, with(at), START_SAMPLES)?)))
    });
    let (at, _) = tried.min_by(|a, b| a.1.total_cmp(&b.1))?;
    of.with_kinks(c, with(at), usize::MAX)
}

/// Whether there are samples on either side of every kink, and between them.
fn determined<B: Bendable>(c: &B::Candidate, of: &B) -> bool {
    let sorted_in = sorted(of.entering(c));
    let places = sorted(of.kinks(c).iter().map(|k| k.at).collect());
    let below = places.iter().map(|at| sorted_in.partition_point(|w| w < at));
    let bounds: Vec<usize> = std::iter::once(0).chain(below).chain([sorted_in.len()]).collect();
    bounds.windows(2).all(|w| w[1] - w[0] >= of.fewest_in_piece())
}

fn sorted(mut x: Vec<f64>) -> Vec<f64> {
    x.sort_unstable_by(f64::total_cmp);
    x
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::super::loss::Cascade;
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
        let mut middle = Middle {
            data: &data,
            tried: &mut Vec::new(),
        };
        let found = kinked(start, &mut middle, &mut monitor);
        // Of the front only the ratio of the coefficients is determined.
        let gain = found.cascade.front.static_gain() / front().static_gain();
        let mut places: Vec<f64> = found.cascade.shape.kinks.iter().map(|k| k.at / gain).collect();
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
                assert!(found.cascade.shape.breakpoints().len() <= 4, "{name} {seed}");
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
            let (cascade, squares) = (Cascade::of(shape), 0.0);
            let tried = &mut Vec::new();
            determined(&Candidate { cascade, squares }, &Middle { data: &data, tried })
        };
        assert!(with(&[0.3, -0.3]));
        for places in [&[3.5] as &[f64], &[-9.0], &[0.3, 0.3001]] {
            assert!(!with(places), "{places:?}");
        }
    }
}
