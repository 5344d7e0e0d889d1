//! From the best splits to the model: screening, structure, and the last fit on all samples.

use super::approximation::{Approximation, approximate};
use super::descent::descend;
use super::intersample::with_instant_between;
use super::loss::{Data, Sandwich, SandwichLoss};
use super::monitor::{Monitor, Stage};
use super::outcome::ApproximationScore;
use super::rational::Rational;
use super::shape::{Roughness, Shape, thinned};
use super::split::{Candidate, fit_shape, refit_coefficients, split};
use super::structure::neighbours;
use crate::linear::correlation::{cross_covariance, variance};

/// Largest order of the linear approximation.
const LARGEST_ORDER: usize = 10;
/// Orders of the approximation from which splits are made: the best by Schwarz's criterion and its neighbours.
const SPLIT_ORDERS: std::ops::RangeInclusive<isize> = -1..=2;
/// Samples that the splits, the screening, and the choice of structure are made on.
const SPLIT_SAMPLES: usize = 5_000;
const SCREENING_SAMPLES: usize = 10_000;
const STRUCTURE_SAMPLES: usize = 20_000;
/// Splits of every order that are screened, those that survive the first round, and the second.
const SCREENED: usize = 8;
const SURVIVORS: [usize; 2] = [8, 3];
/// Pieces of the nonlinearity in the screening's second round.
const SCREENING_PIECES: usize = 16;
/// Pieces that are tried, relative to the present number.
const PIECES: [f64; 6] = [0.7, 1.0, 1.4, 2.0, 2.8, 4.0];
const MOST_PIECES: usize = 64;
/// A piece of the nonlinearity has at least the samples' number divided by this, within 8 to 50.
const FINEST_PIECES: usize = 800;
/// The outermost pieces have at least so many times the samples of the others.
const OUTSIDE: usize = 2;
/// Lags of the errors' autocorrelation.
const LAGS: usize = 100;
/// The share of the breakpoints that are spread evenly.
const EVEN: f64 = 0.3;
/// Rounds of structural change.
const ROUNDS: usize = 16;
/// Steps that judge a structural change, and those of the last fit.
const TRIAL_STEPS: usize = 12;
const LAST_STEPS: usize = 80;

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
    /// Instants in a sampling interval at which the nonlinearity acts: 1, or 2.
    pub instants: usize,
    /// Samples that it was tried on.
    pub samples: usize,
    /// RMS of the simulation error there, relative to the output's standard deviation.
    pub relative_error: f64,
    /// Schwarz's criterion there; smaller is better among those of as many samples.
    pub bic: f64,
}

/// What the search found.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub sandwich: Sandwich,
    pub approximations: Vec<ApproximationScore>,
    pub tried: Vec<TriedStructure>,
}

impl Found {
    /// What is left where no linear approximation was found: a static nonlinearity, or a constant.
    pub fn nothing(data: &Data) -> Found {
        let pass = Rational {
            b: vec![1.0],
            sections: Vec::new(),
        };
        let constant = Sandwich {
            front: pass.clone(),
            shape: Shape::new(&[-1.0, 1.0]),
            back: pass.clone(),
            between: None,
            offset: 0.0,
        };
        Found {
            sandwich: fit_shape(pass.clone(), pass, data).map_or(constant, |c| c.sandwich),
            approximations: Vec::new(),
            tried: Vec::new(),
        }
    }
}

/// Schwarz's criterion of a sum of squares, for as many independent errors as the samples are worth.
fn bic(squares: f64, parameters: usize, data: &Data) -> f64 {
    let samples = data.counted() as f64;
    let n = samples / data.dependence;
    n * (squares.max(f64::MIN_POSITIVE) / samples).ln() + parameters as f64 * n.ln()
}

/// $1 + 2 \sum_j \rho_j^2$ of the errors: a comparison of two models with errors of this autocorrelation varies as much
/// as one with so many times fewer independent errors (Bartlett 1946).
fn dependence(c: &Candidate, data: &Data) -> f64 {
    let output = c.sandwich.run(&data.u);
    let errors: Vec<f64> = output.iter().zip(&data.y).skip(data.from).map(|(p, y)| p - y).collect();
    let covariance = cross_covariance(&errors, &errors, LAGS.min(errors.len() / 4));
    let noise = 1.0 / errors.len() as f64;
    let power = |r: &f64| ((r / covariance[0]).powi(2) - noise).max(0.0);
    let sum: f64 = covariance[1..].iter().map(power).sum();
    if sum.is_finite() {
        (1.0 + 2.0 * sum).min(errors.len() as f64 / 20.0)
    } else {
        1.0
    }
}

impl Candidate {
    fn parameters(&self) -> usize {
        // Three of them only fix scales.
        self.sandwich.parameters().len() - 3
    }

    pub(super) fn bic(&self, data: &Data) -> f64 {
        bic(self.squares, self.parameters(), data)
    }

    pub(super) fn tried(&self, data: &Data) -> TriedStructure {
        let s = &self.sandwich;
        TriedStructure {
            front_order: s.front.order(),
            front_numerator: s.front.b.len(),
            back_order: s.back.order(),
            back_numerator: s.back.b.len(),
            pieces: s.shape.breakpoints().len() - 1,
            instants: s.instants().count(),
            samples: data.counted(),
            relative_error: (self.squares / data.counted() as f64).sqrt(),
            bic: self.bic(data),
        }
    }
}

/// The search, on data of unit variance and zero mean.
pub(super) fn find(data: &Data, monitor: &mut Monitor<'_>) -> Option<Found> {
    let approximated = data.head(STRUCTURE_SAMPLES);
    let approximations = approximations(&approximated, monitor);
    let best = (0..approximations.len()).min_by(|i, j| approximations[*i].1.total_cmp(&approximations[*j].1))?;
    let settling = approximations[best].0.system.settling(1e-4);
    let mut data = data.clone();
    data.from = settling.clamp(data.y.len() / 100, data.y.len() / 10);
    let mut found = Found {
        approximations: approximations
            .iter()
            .map(|(a, _)| ApproximationScore {
                order: a.system.order(),
                relative_error: (a.squares / approximated.counted() as f64).sqrt(),
            })
            .collect(),
        ..screen(&data, &approximations, best, monitor)?
    };
    let mut medium = data.head(STRUCTURE_SAMPLES);
    monitor.stage = Stage::Structure;
    let start = Candidate {
        squares: medium.squares(&found.sandwich.run(&medium.u)),
        sandwich: found.sandwich,
    };
    let start = fitted(start, &medium, TRIAL_STEPS, 1e-4, monitor);
    medium.dependence = dependence(&start, &medium);
    let start = pieces(start, &medium, TRIAL_STEPS, monitor, &mut found.tried);
    let chosen = restructure(start, &medium, monitor, &mut found.tried);
    monitor.stage = Stage::Refinement;
    let whole = Candidate {
        squares: data.squares(&chosen.sandwich.run(&data.u)),
        sandwich: chosen.sandwich,
    };
    let whole = fitted(whole, &data, TRIAL_STEPS, 1e-4, monitor);
    data.dependence = dependence(&whole, &data);
    let whole = restructure(whole, &data, monitor, &mut found.tried);
    let whole = pieces(whole, &data, TRIAL_STEPS, monitor, &mut found.tried);
    let whole = intersample(whole, &data, monitor, &mut found.tried);
    let last = fitted(whole, &data, LAST_STEPS, 1e-6, monitor);
    found.tried.push(last.tried(&data));
    found.sandwich = last.sandwich;
    Some(found)
}

/// Linear approximations with Schwarz's criterion.
fn approximations(data: &Data, monitor: &mut Monitor<'_>) -> Vec<(Approximation, f64)> {
    let score = |a: Approximation| {
        let score = bic(a.squares, a.system.parameters().len(), data);
        (a, score)
    };
    (1..=LARGEST_ORDER.min(data.counted() / 20))
        .filter_map(|order| approximate(data, order, monitor).map(score))
        .collect()
}

/// The best candidate after short fits, more thorough from round to round.
fn screen(
    data: &Data,
    approximations: &[(Approximation, f64)],
    best: usize,
    monitor: &mut Monitor<'_>,
) -> Option<Found> {
    monitor.stage = Stage::Split;
    let (tiny, small) = (data.head(SPLIT_SAMPLES), data.head(SCREENING_SAMPLES));
    let order = approximations[best].0.system.order() as isize;
    let mut candidates = Vec::new();
    for (a, _) in approximations {
        if SPLIT_ORDERS.contains(&(a.system.order() as isize - order)) && monitor.keep_on() {
            candidates.extend(split(&a.system, &tiny).into_iter().take(SCREENED));
        }
    }
    monitor.stage = Stage::Screening;
    let mut tried = Vec::new();
    let mut round: Vec<Candidate> = candidates
        .into_iter()
        .map(|mut c| {
            let s = &mut c.sandwich;
            s.front.b.resize(s.front.b.len().max(s.front.order() + 1), 0.0);
            s.back.b.resize(s.back.b.len().max(s.back.order() + 1), 0.0);
            c.squares = small.squares(&s.run(&small.u));
            fitted(c, &small, TRIAL_STEPS, 1e-3, monitor)
        })
        .collect();
    for survivors in SURVIVORS {
        round.sort_by(|a, b| a.bic(&small).total_cmp(&b.bic(&small)));
        tried.extend(round.iter().map(|c| c.tried(&small)));
        round.truncate(survivors);
        round = round
            .into_iter()
            .map(|c| {
                let finer = with_pieces(&c, SCREENING_PIECES, &small).unwrap_or(c);
                fitted(finer, &small, 2 * TRIAL_STEPS, 1e-4, monitor)
            })
            .collect();
    }
    round.sort_by(|a, b| a.bic(&small).total_cmp(&b.bic(&small)));
    tried.extend(round.iter().map(|c| c.tried(&small)));
    Some(Found {
        sandwich: round.into_iter().next()?.sandwich,
        approximations: Vec::new(),
        tried,
    })
}

/// All parameters fitted from where they are; what was, if that fails.
pub(super) fn fitted(c: Candidate, data: &Data, steps: usize, tolerance: f64, monitor: &mut Monitor<'_>) -> Candidate {
    let loss = SandwichLoss::new(c.sandwich.clone(), data);
    match descend(&loss, loss.start(), steps, tolerance, monitor) {
        Some((p, squares)) => Candidate {
            sandwich: loss.sandwich(&p),
            squares,
        },
        None => c,
    }
}

/// The nonlinearity on new breakpoints, dense where it is rough; the intermediate signal at unit variance.
///
/// Where it is rough is read from the present curve, which is good for smooth ones, and from one on many even breakpoints,
/// which shows kinks; the better of the two is taken.
fn with_pieces(c: &Candidate, pieces: usize, data: &Data) -> Option<Candidate> {
    let s = &c.sandwich;
    let mut sorted = s.front.run(&data.u)[data.from..].to_vec();
    let spread = variance(&sorted).sqrt();
    if !(spread > 0.0 && spread.is_finite()) {
        return None;
    }
    sorted.sort_unstable_by(f64::total_cmp);
    let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
    let fewest = (data.counted() / FINEST_PIECES).clamp(8, 50);
    let on = |at: Vec<f64>| {
        let mut at = at;
        let last = at.len() - 1;
        (at[0], at[last]) = (low, high);
        let at = thinned(&at, &sorted, fewest, OUTSIDE * fewest);
        let mut scaled = s.clone();
        let between = scaled.between.iter_mut().flat_map(|b| &mut b.front);
        scaled.front.b.iter_mut().chain(between).for_each(|b| *b /= spread);
        let at: Vec<f64> = at.iter().map(|x| x / spread).collect();
        refit_coefficients(scaled, &at, data)
    };
    let smooth = on(s.shape.denser(pieces, Roughness::Fourth, EVEN));
    let even = (0..=MOST_PIECES).map(|i| low + (high - low) * i as f64 / MOST_PIECES as f64);
    let kinked = on(even.collect()).and_then(|fine| {
        let at = fine.sandwich.shape.denser(pieces, Roughness::Second, EVEN);
        on(at.iter().map(|x| x * spread).collect())
    });
    let both = [smooth, kinked].into_iter().flatten();
    both.min_by(|a, b| a.squares.total_cmp(&b.squares))
}

/// More and more pieces while Schwarz's criterion falls.
fn pieces(
    mut best: Candidate,
    data: &Data,
    steps: usize,
    monitor: &mut Monitor<'_>,
    tried: &mut Vec<TriedStructure>,
) -> Candidate {
    let present = best.sandwich.shape.breakpoints().len() - 1;
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
fn intersample(best: Candidate, data: &Data, monitor: &mut Monitor<'_>, tried: &mut Vec<TriedStructure>) -> Candidate {
    if !monitor.keep_on() {
        return best;
    }
    let Some(start) = with_instant_between(&best.sandwich, data) else {
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
fn restructure(
    mut best: Candidate,
    data: &Data,
    monitor: &mut Monitor<'_>,
    tried: &mut Vec<TriedStructure>,
) -> Candidate {
    for _ in 0..ROUNDS {
        let mut next: Option<Candidate> = None;
        for sandwich in neighbours(&best.sandwich) {
            if monitor.stopped().is_some() {
                return best;
            }
            let squares = data.squares(&sandwich.run(&data.u));
            let c = fitted(Candidate { sandwich, squares }, data, TRIAL_STEPS, 1e-4, monitor);
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
