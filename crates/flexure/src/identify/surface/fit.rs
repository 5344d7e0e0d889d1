//! From the starts to the system: the linear part's structure, the surface's pieces, and the last fit on all samples.

use super::super::block::{
    Monitor, Prepared, Rational, SETTLED_START, Signals, Stage, delayed, restructured, standardised,
};
use super::SurfaceCandidate;
use super::equations::{Penalty, equations, free_parameters, likeliest, penalised};
use super::limits::{
    FIRST_PIECES, FIRST_WEIGHT, HALVINGS, LAST_STEPS, LEAST_FALL, PIECES, ROUNDS, SAMPLES_PER_COEFFICIENT,
    STRUCTURE_SAMPLES, TRIAL_STEPS, WORSE_PIECES,
};
use super::start::starts;
use crate::nonlinearity::{Surface, SurfaceAxis};

/// A system on signals of unit variance and zero mean.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub surface: Surface,
    pub linear: Rational,
    pub delay: usize,
    pub offset: f64,
    /// The penalties' weights, relative to the mean information of the data about a coefficient.
    pub weights: Vec<f64>,
    /// The sum of squared errors.
    pub squares: f64,
    /// The effective number of parameters of the surface.
    pub effective: f64,
}

impl Fit {
    /// A flat surface of this many pieces along every axis, over the range of the inputs. `None` if an input is constant.
    pub fn flat(data: &Signals, linear: Rational, delay: usize, pieces: usize) -> Option<Fit> {
        let axis = |u: &Vec<f64>| SurfaceAxis {
            low: u.iter().copied().fold(f64::INFINITY, f64::min),
            high: u.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            pieces,
        };
        let axes: Vec<SurfaceAxis> = data.u.iter().map(axis).collect();
        let flat = Surface::constant(axes, 0.0);
        Some(Fit {
            weights: vec![FIRST_WEIGHT; data.u.len()],
            surface: Surface::new(flat.axes().to_vec(), flat.coefficients().to_vec()).ok()?,
            linear,
            delay,
            offset: 0.0,
            squares: f64::INFINITY,
            effective: 0.0,
        })
    }

    /// The output's mean.
    pub fn nothing(data: &Signals) -> Fit {
        let unit = SurfaceAxis {
            low: -1.0,
            high: 1.0,
            pieces: 1,
        };
        Fit {
            surface: Surface::constant(vec![unit; data.u.len()], 0.0),
            linear: Rational::pass(),
            delay: 0,
            offset: 0.0,
            weights: vec![FIRST_WEIGHT; data.u.len()],
            squares: data.squares(&vec![0.0; data.y.len()]),
            effective: 0.0,
        }
    }

    /// The surface's output for the inputs.
    pub fn inner(&self, data: &Signals) -> Vec<f64> {
        let inputs: Vec<&[f64]> = data.u.iter().map(Vec::as_slice).collect();
        self.surface.values(&inputs)
    }

    fn run(&self, data: &Signals) -> Vec<f64> {
        let mut output = self.linear.run(&delayed(&self.inner(data), self.delay, 1.0));
        output.iter_mut().for_each(|y| *y += self.offset);
        output
    }

    /// The square root of generalised cross-validation's score.
    fn score(&self, samples: usize) -> f64 {
        let n = samples as f64;
        let free = 1.0 - (self.effective + self.linear.count() as f64) / n;
        match free > 0.0 {
            true => (self.squares / n).sqrt() / free,
            false => f64::INFINITY,
        }
    }

    fn tried(&self, samples: usize) -> SurfaceCandidate {
        SurfaceCandidate {
            pieces: self.surface.axes().first().map_or(0, |a| a.pieces),
            effective_parameters: self.effective,
            relative_error: (self.squares / samples as f64).sqrt(),
            score: self.score(samples),
        }
    }
}

/// The result of the search.
pub(super) struct SurfaceSearch {
    pub fit: Fit,
    pub tried: Vec<SurfaceCandidate>,
}

/// The search, on signals of unit variance and zero mean; `None` if there is nothing to start from.
pub(super) fn find(data: &Signals, monitor: &mut Monitor<'_>) -> Option<SurfaceSearch> {
    let kind = data.u.len().clamp(2, 4) - 2;
    let mut data = data.clone();
    let mut medium = data.head(STRUCTURE_SAMPLES);
    let fits = starts(&medium, monitor).into_iter().filter_map(|inner| {
        let Delayed { linear, delay } = linear_part(&inner, &medium.y, monitor)?;
        let fit = Fit::flat(&medium, linear, delay, pieces_for(FIRST_PIECES[kind], &medium))?;
        refined(fit, &medium, TRIAL_STEPS, monitor)
    });
    let mut best = fits.min_by(|a, b| a.squares.total_cmp(&b.squares))?;
    monitor.stage = Stage::Structure;
    data.count_after(best.delay + best.linear.settling(SETTLED_START));
    medium = data.head(STRUCTURE_SAMPLES);
    let mut tried = Vec::new();
    for round in 0..ROUNDS {
        if let Some(fit) = with_structure(&best, &medium, monitor) {
            best = fit;
        }
        if round == 0 {
            best = refined(best.clone(), &medium, TRIAL_STEPS, monitor).unwrap_or(best);
            tried.push(best.tried(medium.counted()));
            best = with_pieces(best, PIECES[kind], &medium, monitor, &mut tried);
        }
    }
    monitor.stage = Stage::Refinement;
    best = refined(best.clone(), &data, LAST_STEPS, monitor).unwrap_or(best);
    Some(SurfaceSearch { fit: best, tried })
}

/// The largest number of pieces, up to the wanted one and at least one, at which every coefficient has enough samples.
fn pieces_for(wanted: usize, data: &Signals) -> usize {
    let most = data.counted() / SAMPLES_PER_COEFFICIENT;
    let fits = |pieces: &usize| (pieces + 3).pow(data.u.len() as u32) <= most;
    (1..=wanted).rev().find(fits).unwrap_or(1)
}

/// A linear system after a delay.
struct Delayed {
    linear: Rational,
    delay: usize,
}

/// The linear part from the surface's output to the output.
fn linear_part(inner: &[f64], y: &[f64], monitor: &mut Monitor<'_>) -> Option<Delayed> {
    let prepared = Prepared::new(&[inner], y).approximated(usize::MAX, monitor);
    let found = restructured(&prepared.data, prepared.best()?, monitor);
    Some(without_leading(found.system, &prepared, monitor))
}

/// Replaces leading numerator coefficients by delay while Schwarz's criterion falls.
fn without_leading(start: Rational, prepared: &Prepared, monitor: &mut Monitor<'_>) -> Delayed {
    let mut data = prepared.data.clone();
    let output = start.run(data.input());
    data.set_dependence(&output);
    let mut least = data.bic(data.squares(&output), start.count());
    let mut best = Delayed {
        linear: start,
        delay: prepared.delay,
    };
    while best.linear.b.len() > 1 {
        data.u = vec![delayed(data.input(), 1, 1.0)];
        let shorter = best.linear.with_numerator(best.linear.b[1..].to_vec());
        let next = restructured(&data, &shorter, monitor);
        let score = data.bic(next.squares, next.system.count());
        if !(score < least) {
            break;
        }
        least = score;
        best = Delayed {
            linear: next.system,
            delay: best.delay + 1,
        };
    }
    best
}

/// Chooses the linear part's structure again for the present surface, and refines both; `None` if that fails.
fn with_structure(fit: &Fit, data: &Signals, monitor: &mut Monitor<'_>) -> Option<Fit> {
    let inner = standardised(&fit.inner(data));
    let Delayed { linear, delay } = linear_part(&inner, &data.y, monitor)?;
    let pieces = fit.surface.axes().first()?.pieces;
    let next = Fit {
        weights: fit.weights.clone(),
        ..Fit::flat(data, linear, delay, pieces)?
    };
    refined(next, data, TRIAL_STEPS, monitor)
}

/// Tries other numbers of pieces while generalised cross-validation's score falls.
fn with_pieces(
    mut best: Fit,
    wanted: &[usize],
    data: &Signals,
    monitor: &mut Monitor<'_>,
    tried: &mut Vec<SurfaceCandidate>,
) -> Fit {
    let (mut worse, mut last) = (0, 0);
    for &pieces in wanted {
        let allowed = pieces_for(pieces, data);
        if !monitor.keep_on() || worse >= WORSE_PIECES || allowed == last {
            break;
        }
        last = allowed;
        let flat = Fit::flat(data, best.linear.clone(), best.delay, allowed);
        let Some(next) = flat.and_then(|f| refined(f, data, 1, monitor)) else {
            continue;
        };
        tried.push(next.tried(data.counted()));
        if next.score(data.counted()) < best.score(data.counted()) {
            (best, worse) = (next, 0);
        } else {
            worse += 1;
        }
    }
    best
}

/// Fits the surface through the linear part, then both together; `None` if the first fit fails.
pub(super) fn refined(start: Fit, data: &Signals, steps: usize, monitor: &mut Monitor<'_>) -> Option<Fit> {
    let penalty = Penalty::new(start.surface.axes())?;
    let mut fit = step(&start, &penalty, data, false)?;
    for _ in 0..steps {
        if !monitor.keep_on() {
            break;
        }
        let Some(next) = step(&fit, &penalty, data, true) else {
            break;
        };
        let fall = fit.squares - next.squares;
        let done = fall.abs() <= LEAST_FALL * fit.squares;
        fit = next;
        if done {
            break;
        }
    }
    Some(fit)
}

/// One Gauss-Newton step under the likeliest penalties, the linear part free or not; `None` if none lowers the cost.
fn step(fit: &Fit, penalty: &Penalty, data: &Signals, free: bool) -> Option<Fit> {
    let equations = equations(fit, data, free);
    let c = fit.surface.coefficients();
    let solution = likeliest(&equations, penalty, c, &fit.weights, data.counted())?;
    let (new_c, others) = solution.unknowns.split_at(c.len());
    let cost = |c: &[f64], squares: f64| squares + penalised(penalty, c, &solution.weights, &equations);
    let before = cost(c, equations.cost);
    let places = if free { free_parameters(&fit.linear) } else { Vec::new() };
    let mut share = 1.0;
    for _ in 0..HALVINGS {
        let moved: Vec<f64> = c.iter().zip(new_c).map(|(c, n)| c + share * (n - c)).collect();
        let mut parameters = fit.linear.parameters();
        places.iter().zip(others).for_each(|(&i, d)| parameters[i] += share * d);
        let mut next = Fit {
            surface: fit.surface.with_coefficients(moved)?,
            linear: fit.linear.with(&parameters),
            offset: fit.offset + share * others.last().copied().unwrap_or(0.0),
            weights: solution.weights.clone(),
            effective: solution.effective,
            ..fit.clone()
        };
        if next.linear.is_stable() {
            next.squares = data.squares(&next.run(data));
            let now = cost(next.surface.coefficients(), next.squares);
            if now < before {
                return Some(next);
            }
        }
        share *= 0.5;
    }
    None
}
