//! From samples to a cascade: linear approximations, the best of several starts, and the last fit on all samples.

use super::approximation::{Approximation, approximate, pure_delay};
use super::kinks::{Middle, kinked};
use super::loss::{Cascade, Data};
use super::monitor::{Monitor, Stage};
use super::rational::Rational;
use super::refine::{
    LAST_STEPS, STRUCTURE_SAMPLES, TRIAL_STEPS, TriedStructure, anchored, bic, dependence, fitted, fitted_efficiently,
    intersample, parameters, pieces, restructure, restructured_efficiently, with_pieces,
};
use super::shape::Shape;
use super::split::{Candidate, fit_shape, split};
use super::structure::Form;
use super::units::{ApproximationScore, Scales};

/// At most so many samples, the last ones, are fitted; more would only cost memory.
const MOST_SAMPLES: usize = 200_000;
/// Samples that do not count while the settling time is not known.
const FIRST_LEFT_OUT: usize = 500;
/// Largest order of the linear approximation.
pub(in crate::identify) const LARGEST_ORDER: usize = 10;
/// Orders of the approximation from which starts are made: the best by Schwarz's criterion and its neighbours.
const START_ORDERS: std::ops::RangeInclusive<isize> = -1..=2;
/// Samples that the starts are made on, and those of the screening.
pub(in crate::identify) const START_SAMPLES: usize = 5_000;
const SCREENING_SAMPLES: usize = 10_000;
/// Splits of every order that are screened, starts that survive the first round, and the second.
const SCREENED: usize = 8;
const SURVIVORS: [usize; 2] = [8, 3];
/// Pieces of the nonlinearity in the screening's second round.
const SCREENING_PIECES: usize = 16;

/// The samples of a fit at zero mean and unit variance, without the pure delay, and their linear approximations.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Prepared {
    pub scales: Scales,
    pub data: Data,
    /// Taken out of the data: input sample n stands beside output sample n + delay.
    pub delay: usize,
    /// In ascending order.
    pub approximations: Vec<Scored>,
}

/// A linear approximation and how good it is.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Scored {
    pub system: Rational,
    /// The RMS of its simulation error relative to the output's standard deviation.
    pub relative_error: f64,
    bic: f64,
}

impl Prepared {
    /// The delay is the linear approximation's.
    pub fn new(u: &[f64], y: &[f64], monitor: &mut Monitor<'_>) -> Prepared {
        Prepared::with_delay_at_most(u, y, usize::MAX, monitor)
    }

    /// The delay is the linear approximation's, or the largest.
    pub fn with_delay_at_most(u: &[f64], y: &[f64], largest: usize, monitor: &mut Monitor<'_>) -> Prepared {
        let mut prepared = Prepared::with_delay(u, y, 0);
        let delay = pure_delay(&prepared.data);
        prepared.shift(delay.min(largest));
        prepared.approximations = approximations(&prepared.data.head(STRUCTURE_SAMPLES), monitor);
        let n = prepared.data.y.len();
        if let Some(best) = prepared.best() {
            prepared.data.from = prepared.approximations[best]
                .system
                .settling(1e-4)
                .clamp(n / 100, n / 10);
        }
        prepared
    }

    /// The delay is given, and no linear approximations are made.
    pub fn with_delay(u: &[f64], y: &[f64], delay: usize) -> Prepared {
        let scales = Scales::new(u, y);
        let first = u.len().saturating_sub(MOST_SAMPLES);
        let (u, y) = (
            scales.input.standardised(&u[first..]),
            scales.output.standardised(&y[first..]),
        );
        let from = (u.len() / 10).min(FIRST_LEFT_OUT);
        let mut prepared = Prepared {
            scales,
            data: Data::new(u, y, from),
            delay: 0,
            approximations: Vec::new(),
        };
        prepared.shift(delay);
        prepared
    }

    fn shift(&mut self, delay: usize) {
        self.data.u.rotate_right(delay);
        self.data.u[..delay].fill(0.0);
        self.delay = delay;
    }

    /// The best approximation by Schwarz's criterion.
    pub fn best(&self) -> Option<usize> {
        (0..self.approximations.len())
            .min_by(|i, j| self.approximations[*i].bic.total_cmp(&self.approximations[*j].bic))
    }

    /// The best approximation and those of nearly its order.
    pub fn starting(&self) -> Vec<&Rational> {
        let Some(best) = self.best() else {
            return Vec::new();
        };
        let order = self.approximations[best].system.order() as isize;
        let near = |a: &&Scored| START_ORDERS.contains(&(a.system.order() as isize - order));
        self.approximations.iter().filter(near).map(|a| &a.system).collect()
    }

    /// The share of the output's variance that a linear approximation explains.
    pub fn explained(&self) -> f64 {
        let errors = self.approximations.iter().map(|a| a.relative_error);
        1.0 - errors.fold(1.0, f64::min).powi(2)
    }

    /// The scores of all approximations.
    pub fn scores(&self) -> Vec<ApproximationScore> {
        let score = |a: &Scored| ApproximationScore {
            order: a.system.order(),
            relative_error: a.relative_error,
        };
        self.approximations.iter().map(score).collect()
    }
}

/// Linear approximations of all orders that the samples allow.
fn approximations(data: &Data, monitor: &mut Monitor<'_>) -> Vec<Scored> {
    let score = |a: Approximation| Scored {
        bic: bic(a.squares, a.system.parameters().len(), data),
        relative_error: (a.squares / data.counted() as f64).sqrt(),
        system: a.system,
    };
    (1..=LARGEST_ORDER.min(data.counted() / 20))
        .filter_map(|order| approximate(data, order, monitor).map(score))
        .collect()
}

/// What the search found.
#[derive(Debug, Clone)]
pub(in crate::identify) struct SearchResult {
    pub cascade: Cascade,
    pub tried: Vec<TriedStructure>,
}

impl SearchResult {
    /// The number of parameters that only one choice fits.
    pub fn parameters(&self) -> usize {
        parameters(&self.cascade)
    }

    /// What is left where there was no start: a static nonlinearity, or a constant.
    pub fn nothing(data: &Data) -> SearchResult {
        let constant = Cascade::of(Shape::new(&[-1.0, 1.0]));
        SearchResult {
            cascade: fit_shape(Rational::pass(), Rational::pass(), data).map_or(constant, |c| c.cascade),
            tried: Vec::new(),
        }
    }
}

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

/// The best cascade of this form that the starts lead to, on data of unit variance and zero mean.
pub(in crate::identify) fn search(
    starts: Vec<Candidate>,
    form: Form,
    data: &Data,
    monitor: &mut Monitor<'_>,
) -> Option<SearchResult> {
    let mut tried = Vec::new();
    let screened = screen(starts, data, monitor, &mut tried)?;
    let mut medium = data.head(STRUCTURE_SAMPLES);
    monitor.stage = Stage::Structure;
    let start = Candidate {
        squares: medium.squares(&screened.run(&medium.u)),
        cascade: screened,
    };
    let start = fitted(start, &medium, TRIAL_STEPS, 1e-4, monitor);
    medium.dependence = dependence(&start.cascade.run(&medium.u), &medium);
    let start = pieces(start, &medium, TRIAL_STEPS, monitor, &mut tried);
    let chosen = restructure(start, form, &medium, monitor, &mut tried);
    let mut middle = Middle {
        data: &medium,
        tried: &mut tried,
    };
    let chosen = kinked(chosen, &mut middle, monitor);
    monitor.stage = Stage::Refinement;
    let mut data = data.clone();
    let whole = Candidate {
        squares: data.squares(&chosen.cascade.run(&data.u)),
        cascade: chosen.cascade,
    };
    let whole = fitted(whole, &data, TRIAL_STEPS, 1e-4, monitor);
    data.dependence = dependence(&whole.cascade.run(&data.u), &data);
    let whole = restructure(whole, form, &data, monitor, &mut tried);
    let mut whole = pieces(whole, &data, TRIAL_STEPS, monitor, &mut tried);
    if form == Form::WienerHammerstein {
        whole = intersample(whole, &data, monitor, &mut tried);
    }
    let last = fitted(anchored(whole, &data), &data, LAST_STEPS, 1e-6, monitor);
    let last = anchored(last, &data);
    let efficient =
        restructured_efficiently(&last, form, &data, monitor).or_else(|| fitted_efficiently(&last, &data, monitor));
    let last = efficient.unwrap_or(last);
    tried.push(last.tried(&data));
    Some(SearchResult {
        cascade: last.cascade,
        tried,
    })
}

/// The best candidate after short fits, more thorough from round to round.
fn screen(
    starts: Vec<Candidate>,
    data: &Data,
    monitor: &mut Monitor<'_>,
    tried: &mut Vec<TriedStructure>,
) -> Option<Cascade> {
    monitor.stage = Stage::Screening;
    let small = data.head(SCREENING_SAMPLES);
    let mut round: Vec<Candidate> = starts
        .into_iter()
        .map(|mut c| {
            let s = &mut c.cascade;
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
    Some(round.into_iter().next()?.cascade)
}
