//! From the best splits to the model: screening, structure, and the last fit on all samples.

use super::approximation::{Approximation, approximate};
use super::descent::descend;
use super::loss::{Data, Sandwich, SandwichLoss};
use super::monitor::{Monitor, Stage};
use super::shape::thinned;
use super::split::{Candidate, fit_coefficients, split};
use super::structure::neighbours;
use crate::linear::correlation::variance;

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
/// Pieces that are tried.
const PIECES: [usize; 6] = [6, 10, 16, 24, 36, 54];
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
    /// Order and relative error of every linear approximation.
    pub approximations: Vec<(usize, f64)>,
    pub tried: Vec<TriedStructure>,
}

/// Schwarz's criterion of a sum of squares.
pub(super) fn bic(squares: f64, parameters: usize, samples: usize) -> f64 {
    let n = samples as f64;
    n * (squares.max(f64::MIN_POSITIVE) / n).ln() + parameters as f64 * n.ln()
}

impl Candidate {
    fn parameters(&self) -> usize {
        // Three of them only fix scales.
        self.sandwich.parameters().len() - 3
    }

    pub(super) fn bic(&self, data: &Data) -> f64 {
        bic(self.squares, self.parameters(), data.counted())
    }

    pub(super) fn tried(&self, data: &Data) -> TriedStructure {
        let s = &self.sandwich;
        TriedStructure {
            front_order: s.front.order(),
            front_numerator: s.front.b.len(),
            back_order: s.back.order(),
            back_numerator: s.back.b.len(),
            pieces: s.shape.breakpoints().len() - 1,
            samples: data.counted(),
            relative_error: (self.squares / data.counted() as f64).sqrt(),
            bic: self.bic(data),
        }
    }
}

/// The search, on data of unit variance and zero mean.
pub(super) fn find(data: &Data, monitor: &mut Monitor<'_>) -> Option<Found> {
    let approximations = approximations(&data.head(STRUCTURE_SAMPLES), monitor);
    let best = (0..approximations.len()).min_by(|i, j| approximations[*i].1.total_cmp(&approximations[*j].1))?;
    let settling = approximations[best].0.system.settling(1e-4);
    let mut data = data.clone();
    data.from = settling.clamp(data.y.len() / 100, data.y.len() / 10);
    let mut found = Found {
        approximations: approximations
            .iter()
            .map(|(a, _)| (a.system.order(), a.squares))
            .collect(),
        ..screen(&data, &approximations, best, monitor)?
    };
    let medium = data.head(STRUCTURE_SAMPLES);
    monitor.stage = Stage::Structure;
    let start = Candidate {
        squares: medium.squares(&found.sandwich.run(&medium.u)),
        sandwich: found.sandwich,
    };
    let start = pieces(start, &medium, TRIAL_STEPS, monitor, &mut found.tried);
    if std::env::var("DUMP").is_ok() { for (w, c) in start.sandwich.parameters().chunks(8).enumerate() { println!("{w} {c:?}"); } }
    if std::env::var("FAST").is_ok() {
        let mut c = start.clone();
        for f in super::structure::grown(&c.sandwich) { c.sandwich = f; }
        c.squares = medium.squares(&c.sandwich.run(&medium.u));
        let t = std::time::Instant::now();
        let c = fitted(c, &medium, 150, 1e-6, monitor);
        println!("FAST {:?} {}", c.tried(&medium), t.elapsed().as_secs_f64());
        found.sandwich = c.sandwich; return Some(found);
    }
    let chosen = restructure(start, &medium, monitor, &mut found.tried);
    monitor.stage = Stage::Refinement;
    let whole = Candidate {
        squares: data.squares(&chosen.sandwich.run(&data.u)),
        sandwich: chosen.sandwich,
    };
    let whole = fitted(whole, &data, TRIAL_STEPS, 1e-4, monitor);
    let whole = restructure(whole, &data, monitor, &mut found.tried);
    let whole = pieces(whole, &data, TRIAL_STEPS, monitor, &mut found.tried);
    let last = fitted(whole, &data, LAST_STEPS, 1e-6, monitor);
    found.tried.push(last.tried(&data));
    found.sandwich = last.sandwich;
    Some(found)
}

/// Linear approximations with Schwarz's criterion.
fn approximations(data: &Data, monitor: &mut Monitor<'_>) -> Vec<(Approximation, f64)> {
    let score = |a: Approximation| {
        let score = bic(a.squares, a.system.parameters().len(), data.counted());
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
fn with_pieces(c: &Candidate, pieces: usize, data: &Data) -> Option<Candidate> {
    let s = &c.sandwich;
    let mut sorted = s.front.run(&data.u)[data.from..].to_vec();
    let spread = variance(&sorted).sqrt();
    if !(spread > 0.0 && spread.is_finite()) {
        return None;
    }
    sorted.sort_unstable_by(f64::total_cmp);
    let mut at = s.shape.denser(pieces, EVEN);
    let last = at.len() - 1;
    (at[0], at[last]) = (sorted[0], sorted[sorted.len() - 1]);
    let at = thinned(&at, &sorted, fewest(data));
    let mut front = s.front.clone();
    front.b.iter_mut().for_each(|b| *b /= spread);
    let at: Vec<f64> = at.iter().map(|x| x / spread).collect();
    fit_coefficients(front, &at, s.back.clone(), data)
}

/// The fewest samples in a piece of the nonlinearity.
fn fewest(data: &Data) -> usize {
    (data.counted() / 800).clamp(8, 50)
}

/// More and more pieces while Schwarz's criterion falls.
fn pieces(
    mut best: Candidate,
    data: &Data,
    steps: usize,
    monitor: &mut Monitor<'_>,
    tried: &mut Vec<TriedStructure>,
) -> Candidate {
    let mut worse = 0;
    for pieces in PIECES {
        let Some(next) = with_pieces(&best, pieces, data) else { continue };
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
