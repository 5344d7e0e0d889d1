//! A candidate made better: all parameters fitted, pieces of the nonlinearity, poles and numerator coefficients.

use super::super::criterion;
use super::descent::Residuals;
use super::efficient::{efficient, whitening_filter};
use super::intersample::with_instant_between;
use super::kinks::{Middle, kinked};
use super::loss::{Cascade, CascadeLoss, Data};
use super::monitor::Monitor;
use super::shape::{Roughness, thinned};
use super::split::{Candidate, refit_coefficients};
use super::structure::{Form, neighbours};
use super::whitened::descend_through;
use crate::linear::correlation::variance;

/// Samples that the structure is chosen on.
pub(in crate::identify) const STRUCTURE_SAMPLES: usize = 20_000;
/// Pieces that are tried, relative to the present number.
const PIECES: [f64; 6] = [0.7, 1.0, 1.4, 2.0, 2.8, 4.0];
const MOST_PIECES: usize = 64;
/// A piece of the nonlinearity has at least the samples' number divided by this, within 8 to 50.
const FINEST_PIECES: usize = 800;
/// The outermost pieces have at least so many times the samples of the others.
const OUTSIDE: usize = 2;
/// A fit with breakpoints brought back may have a sum of squares so many times that of the fit before.
const DEARER: f64 = 1.05;
/// The share of the breakpoints that are spread evenly.
const EVEN: f64 = 0.3;
/// Rounds of structural change.
const ROUNDS: usize = 16;
/// Steps that judge a structural change.
pub(in crate::identify) const TRIAL_STEPS: usize = 12;
/// Steps of the last fit.
pub(super) const LAST_STEPS: usize = 80;

/// A structure that was tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriedStructure {
    /// Poles of the front.
    pub front_order: usize,
    /// Numerator coefficients of the front.
    pub front_numerator: usize,
    /// Poles of the back.
    pub back_order: usize,
    /// Numerator coefficients of the back.
    pub back_numerator: usize,
    /// Cubic pieces of the nonlinearity.
    pub pieces: usize,
    /// Points at which its slope changes besides.
    pub kinks: usize,
    /// Instants in a sampling interval at which the nonlinearity acts: 1, or 2.
    pub instants: usize,
    /// Samples that it was tried on.
    pub samples: usize,
    /// RMS of the simulation error there, relative to the output's standard deviation.
    pub relative_error: f64,
    /// Schwarz's criterion there; smaller is better among those of as many samples.
    pub bic: f64,
}

/// Schwarz's criterion of a sum of squares, for as many independent errors as the samples are worth.
pub(in crate::identify) fn bic(squares: f64, parameters: usize, data: &Data) -> f64 {
    criterion::schwarz(squares, parameters, data.counted(), data.dependence)
}

/// What the errors' own autocorrelation makes of [`Data::dependence`].
pub(in crate::identify) fn dependence(output: &[f64], data: &Data) -> f64 {
    criterion::dependence(output, &data.y, data.from)
}

impl TriedStructure {
    /// The number of parameters that the data determine: all but the blocks' scales.
    pub fn parameters(&self) -> usize {
        // A cubic spline has three parameters more than pieces, a kink a place and a bend; both linear blocks' scales are the nonlinearity's.
        let numerators = |instant: usize| match instant {
            0 => self.front_numerator + self.back_numerator,
            _ => self.front_numerator.max(self.front_order + 1) + self.back_numerator.max(self.back_order + 1),
        };
        let linear = self.front_order + self.back_order + (0..self.instants).map(numerators).sum::<usize>();
        linear + self.pieces + 1 + 2 * self.kinks
    }
}

/// The parameters of a cascade that only one choice fits.
pub(in crate::identify) fn parameters(cascade: &Cascade) -> usize {
    // Three of them only fix scales.
    cascade.parameters().len() - 3
}

impl Candidate {
    fn parameters(&self) -> usize {
        parameters(&self.cascade)
    }

    pub(in crate::identify) fn bic(&self, data: &Data) -> f64 {
        bic(self.squares, self.parameters(), data)
    }

    pub(super) fn tried(&self, data: &Data) -> TriedStructure {
        let s = &self.cascade;
        TriedStructure {
            front_order: s.front.order(),
            front_numerator: s.front.b.len(),
            back_order: s.back.order(),
            back_numerator: s.back.b.len(),
            pieces: s.shape.breakpoints().len() - 1,
            kinks: s.shape.kinks.len(),
            instants: s.instants().count(),
            samples: data.counted(),
            relative_error: (self.squares / data.counted() as f64).sqrt(),
            bic: self.bic(data),
        }
    }
}

/// All parameters fitted from where they are; what was, if that fails.
pub(in crate::identify) fn fitted(
    c: Candidate,
    data: &Data,
    steps: usize,
    tolerance: f64,
    monitor: &mut Monitor<'_>,
) -> Candidate {
    let loss = CascadeLoss::new(c.cascade.clone(), data);
    match descend_through(&data.filter, &loss, loss.start(), steps, tolerance, monitor) {
        Some((p, squares)) => Candidate {
            cascade: loss.cascade(&p),
            squares,
        },
        None => c,
    }
}

/// The parameters by generalised least squares; `None` unless the error is coloured noise.
pub(super) fn fitted_efficiently(c: &Candidate, data: &Data, monitor: &mut Monitor<'_>) -> Option<Candidate> {
    let loss = CascadeLoss::new(c.cascade.clone(), data);
    let (p, squares) = efficient(&loss, &loss.start(), monitor)?;
    Some(Candidate {
        cascade: loss.cascade(&p),
        squares,
    })
}

/// The structure chosen anew, by errors made white, for one that generalised least squares fits; all parameters by that.
///
/// Of coloured errors the criterion sees the sum of squares, most of which may be slow noise, and not what stands out from the
/// noise at other frequencies: it then takes too few pieces. `None` where there is no better structure, or its error is not coloured noise.
pub(super) fn restructured_efficiently(
    c: &Candidate,
    form: Form,
    data: &Data,
    monitor: &mut Monitor<'_>,
) -> Option<Candidate> {
    let loss = CascadeLoss::new(c.cascade.clone(), data);
    let all = data.through(whitening_filter(&loss, &loss.residuals(&loss.start())?)?);
    let white = all.head(STRUCTURE_SAMPLES);
    let on = |data: &Data, cascade: &Cascade| Candidate {
        squares: data.squares(&cascade.run(&data.u)),
        cascade: cascade.clone(),
    };
    let start = on(&white, &c.cascade);
    // Their errors are not those of simulation, which is what the structures that were tried are listed by.
    let unlisted = &mut Vec::new();
    let found = match start.cascade.between {
        Some(_) => start,
        None => restructure(start, form, &white, monitor, unlisted),
    };
    let found = pieces(found, &white, TRIAL_STEPS, monitor, unlisted);
    let mut middle = Middle {
        data: &white,
        tried: unlisted,
    };
    let found = kinked(found, &mut middle, monitor);
    let found = fitted(on(&all, &found.cascade), &all, TRIAL_STEPS, 1e-4, monitor);
    if !(found.bic(&all) < on(&all, &c.cascade).bic(&all)) {
        return None;
    }
    let found = fitted(on(data, &found.cascade), data, LAST_STEPS, 1e-6, monitor);
    fitted_efficiently(&anchored(found, data), data, monitor)
}

/// The nonlinearity on new breakpoints, dense where it is rough; the intermediate signal at unit variance.
///
/// Where it is rough is read from the present curve, which is good for smooth ones, and from one on many even breakpoints,
/// which shows kinks; the better of the two is taken.
pub(in crate::identify) fn with_pieces(c: &Candidate, pieces: usize, data: &Data) -> Option<Candidate> {
    let s = &c.cascade;
    let mut sorted = s.front.run(&data.u)[data.from..].to_vec();
    let spread = variance(&sorted).sqrt();
    if !(spread > 0.0 && spread.is_finite()) {
        return None;
    }
    sorted.sort_unstable_by(f64::total_cmp);
    let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
    let fewest = fewest_in_piece(data);
    let on = |at: Vec<f64>| {
        let mut at = at;
        let last = at.len() - 1;
        (at[0], at[last]) = (low, high);
        let at = thinned(&at, &sorted, fewest, OUTSIDE * fewest);
        let mut scaled = s.clone();
        let between = scaled.between.iter_mut().flat_map(|b| &mut b.front);
        scaled.front.b.iter_mut().chain(between).for_each(|b| *b /= spread);
        scaled.shape.kinks.iter_mut().for_each(|k| k.at /= spread);
        let at: Vec<f64> = at.iter().map(|x| x / spread).collect();
        refit_coefficients(scaled, &at, data)
    };
    let smooth = on(s.shape.denser(pieces, Roughness::Fourth, EVEN));
    let even = (0..=MOST_PIECES).map(|i| low + (high - low) * i as f64 / MOST_PIECES as f64);
    let kinked = on(even.collect()).and_then(|fine| {
        let at = fine.cascade.shape.denser(pieces, Roughness::Second, EVEN);
        on(at.iter().map(|x| x * spread).collect())
    });
    let both = [smooth, kinked].into_iter().flatten();
    both.min_by(|a, b| a.squares.total_cmp(&b.squares))
}

/// The same blocks with the nonlinearity's outermost breakpoints brought back to where the samples are, if the descent has left them
/// outside: pieces without samples have coefficients that nothing determines.
pub(super) fn anchored(c: Candidate, data: &Data) -> Candidate {
    let s = &c.cascade;
    let mut sorted: Vec<f64> = s.intermediate(&data.u).flat_map(|w| w[data.from..].to_vec()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
    let present = s.shape.breakpoints();
    let (first, last) = (present[0].max(low), present[present.len() - 1].min(high));
    if first == present[0] && last == present[present.len() - 1] || !(first < last) {
        return c;
    }
    let inside = present
        .iter()
        .copied()
        .filter(|x| (first..last).contains(x) && *x > first);
    let at: Vec<f64> = std::iter::once(first).chain(inside).chain([last]).collect();
    let fewest = fewest_in_piece(data);
    let at = thinned(&at, &sorted, fewest, OUTSIDE * fewest);
    let moved = refit_coefficients(s.clone(), &at, data);
    // A little worse is worth it: it is the price of what the pieces outside did for samples inside.
    moved.filter(|m| m.squares <= DEARER * c.squares).unwrap_or(c)
}

/// The fewest samples in a piece of the nonlinearity.
pub(super) fn fewest_in_piece(data: &Data) -> usize {
    (data.counted() / FINEST_PIECES).clamp(8, 50)
}

/// More and more pieces while Schwarz's criterion falls.
pub(in crate::identify) fn pieces(
    mut best: Candidate,
    data: &Data,
    steps: usize,
    monitor: &mut Monitor<'_>,
    tried: &mut Vec<TriedStructure>,
) -> Candidate {
    let present = best.cascade.shape.breakpoints().len() - 1;
    let mut worse = 0;
    for factor in PIECES {
        if monitor.stopped().is_some() {
            break;
        }
        let pieces = ((present as f64 * factor).round() as usize).clamp(2, MOST_PIECES);
        let Some(next) = with_pieces(&best, pieces, data) else {
            continue;
        };
        let next = fitted(next, data, steps, 1e-4, monitor);
        tried.push(next.tried(data));
        if next.bic(data) < best.bic(data) {
            (best, worse) = (next, 0);
        } else {
            worse += 1;
        }
        if worse > 2 {
            break;
        }
    }
    best
}

/// With the nonlinearity acting between the samples too, if that lowers Schwarz's criterion.
pub(super) fn intersample(
    best: Candidate,
    data: &Data,
    monitor: &mut Monitor<'_>,
    tried: &mut Vec<TriedStructure>,
) -> Candidate {
    if !monitor.keep_on() {
        return best;
    }
    let Some(start) = with_instant_between(&best.cascade, data) else {
        return best;
    };
    let next = fitted(start, data, 2 * TRIAL_STEPS, 1e-4, monitor);
    tried.push(next.tried(data));
    if next.bic(data) < best.bic(data) {
        pieces(next, data, TRIAL_STEPS, monitor, tried)
    } else {
        best
    }
}

/// The structural change that lowers Schwarz's criterion most, over and over.
pub(in crate::identify) fn restructure(
    mut best: Candidate,
    form: Form,
    data: &Data,
    monitor: &mut Monitor<'_>,
    tried: &mut Vec<TriedStructure>,
) -> Candidate {
    for _ in 0..ROUNDS {
        let mut next: Option<Candidate> = None;
        for cascade in neighbours(&best.cascade, form) {
            if monitor.stopped().is_some() {
                return best;
            }
            let squares = data.squares(&cascade.run(&data.u));
            let c = fitted(Candidate { cascade, squares }, data, TRIAL_STEPS, 1e-4, monitor);
            tried.push(c.tried(data));
            if next.as_ref().is_none_or(|n| c.bic(data) < n.bic(data)) {
                next = Some(c);
            }
        }
        match next.filter(|n| n.bic(data) < best.bic(data)) {
            Some(n) => best = n,
            None => break,
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::super::shape::Shape;
    use super::*;

    #[test]
    fn pieces_without_samples_are_taken_away_and_others_stay() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
        let u: Vec<f64> = (0..2000).map(|_| rng.random_range(-1.0..1.0)).collect();
        let y: Vec<f64> = u.iter().map(|u| u.max(0.0)).collect();
        let data = Data::new(u, y, 0);
        let candidate = |breakpoints: &[f64]| {
            let mut shape = Shape::new(breakpoints);
            let last = shape.c.len() - 1;
            shape.c.fill(0.5);
            // Nothing that the samples, all below 1, would notice much.
            shape.c[last] = 1e3;
            let cascade = Cascade::of(shape);
            let squares = data.squares(&cascade.run(&data.u));
            Candidate { cascade, squares }
        };
        let outside = anchored(candidate(&[-2.0, -0.5, 0.0, 0.5, 0.999, 3.0]), &data);
        let at = outside.cascade.shape.breakpoints();
        assert!(at[0] >= -1.0 && at[at.len() - 1] <= 1.0 && at.contains(&0.5), "{at:?}");
        let beyond = outside.cascade.shape.value(1.5);
        assert!((beyond - 1.5).abs() < 0.2, "{beyond}");
        let inside = candidate(&[-0.9, 0.0, 0.9]);
        let same = anchored(inside.clone(), &data);
        assert_eq!(same.cascade, inside.cascade);
    }
}
