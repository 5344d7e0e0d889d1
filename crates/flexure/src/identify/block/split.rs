//! Which poles and zeros of the best linear approximation belong to the front, and which to the back.
//!
//! Every split of the poles is tried, and the zeros are handed over one by one while that helps (Sjoberg & Schoukens
//! 2012 try all). A split is cheap to judge: with both blocks known up to scale, the nonlinearity is linear least
//! squares on the intermediate signal's B-splines, filtered by the back.

use rayon::prelude::*;

use super::approximation::solve;
use super::loss::{Cascade, Data};
use super::products::normal_equations;
use super::rational::{Rational, convolved, groups};
use super::shape::{Local, Shape, thinned};
use crate::interrupt::{self, Interrupt};
use crate::linear::Complex;
use crate::linear::correlation::{mean, variance};

/// Quantiles of the intermediate signal that bound the nonlinearity's first pieces.
const QUANTILES: [f64; 7] = [0.03, 0.12, 0.3, 0.5, 0.7, 0.88, 0.97];
/// The fewest samples in a piece.
pub(super) const FEWEST_IN_PIECE: usize = 12;
/// More groups of poles than this are not split in every way; the rest stays in the front.
const MOST_GROUPS: usize = 10;
/// Splits of the poles for which the zeros are handed over.
const MOST_SPLITS: usize = 40;

/// A split and how well it does with the best nonlinearity for it.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Candidate {
    pub cascade: Cascade,
    pub squares: f64,
}

/// The best candidate of every split of the poles (of the most promising ones, if there are very many), best first.
pub(super) fn split(approximation: &Rational, data: &Data) -> Vec<Candidate> {
    let roots = Roots {
        poles: groups(&approximation.poles()),
        zeros: groups(&approximation.zeros().unwrap_or_default()),
        data,
        interrupt: interrupt::current(),
    };
    let splits = 1_usize << roots.poles.len().min(MOST_GROUPS);
    let started: Vec<Vec<Start>> = (0..splits).into_par_iter().map(|s| roots.starts(s)).collect();
    let mut promising: Vec<Vec<Start>> = started.into_iter().filter(|s| !s.is_empty()).collect();
    let least = |s: &Vec<Start>| s.iter().map(|s| s.candidate.squares).fold(f64::INFINITY, f64::min);
    promising.sort_by(|a, b| least(a).total_cmp(&least(b)));
    promising.truncate(MOST_SPLITS);
    let mut all: Vec<Candidate> = promising
        .into_par_iter()
        .filter_map(|starts| {
            let ends = starts.into_iter().map(|s| roots.hand_over_zeros(s));
            ends.min_by(|a, b| a.squares.total_cmp(&b.squares))
        })
        .collect();
    all.sort_by(|a, b| a.squares.total_cmp(&b.squares));
    all
}

/// The poles and zeros to share out, one or a pair at a time.
struct Roots<'a> {
    poles: Vec<(Complex<f64>, bool)>,
    zeros: Vec<(Complex<f64>, bool)>,
    data: &'a Data,
    interrupt: Interrupt,
}

/// The bits of the poles and zeros that are in the front, and how well that does.
struct Start {
    front_poles: usize,
    front_zeros: usize,
    candidate: Candidate,
}

impl Roots<'_> {
    /// `None` for what cannot be fitted, and where the work is asked to stop.
    fn judge(&self, front_poles: usize, front_zeros: usize) -> Option<Candidate> {
        if self.interrupt.is_requested() {
            return None;
        }
        let part = |front: bool| {
            let zeros = chosen(&self.zeros, front_zeros, front);
            Rational::from_roots(&zeros, &chosen(&self.poles, front_poles, front))
        };
        fit_shape(part(true), part(false), self.data)
    }

    /// All zeros in the front, and all in the back.
    fn starts(&self, front_poles: usize) -> Vec<Start> {
        let mut ends = vec![(1_usize << self.zeros.len()) - 1, 0];
        ends.dedup();
        let start = |front_zeros| {
            Some(Start {
                front_poles,
                front_zeros,
                candidate: self.judge(front_poles, front_zeros)?,
            })
        };
        ends.into_iter().filter_map(start).collect()
    }

    /// Moves the zeros that help most to the other side, one after the other.
    fn hand_over_zeros(&self, start: Start) -> Candidate {
        let (mut mask, mut current) = (start.front_zeros, start.candidate);
        loop {
            let moved = (0..self.zeros.len()).map(|i| mask ^ (1 << i));
            let judged = moved.filter_map(|m| Some((m, self.judge(start.front_poles, m)?)));
            match judged.min_by(|a, b| a.1.squares.total_cmp(&b.1.squares)) {
                Some((next, candidate)) if candidate.squares < current.squares => (mask, current) = (next, candidate),
                _ => return current,
            }
        }
    }
}

/// The groups whose bit is (or is not) set, with conjugates.
fn chosen(groups: &[(Complex<f64>, bool)], mask: usize, set: bool) -> Vec<Complex<f64>> {
    let mine = groups.iter().enumerate().filter(|(i, _)| (mask >> i & 1 == 1) == set);
    mine.flat_map(|(_, &(z, pair))| std::iter::once(z).chain(pair.then(|| z.conj())))
        .collect()
}

/// The cascade of these linear blocks and the best coarse nonlinearity between them.
pub(in crate::identify) fn fit_shape(mut front: Rational, back: Rational, data: &Data) -> Option<Candidate> {
    let w = front.run(&data.u);
    let spread = variance(&w[data.from..]).sqrt();
    if !(spread > 1e-12 && spread.is_finite()) {
        return None;
    }
    front.b.iter_mut().for_each(|b| *b /= spread);
    let w: Vec<f64> = w.iter().map(|w| w / spread).collect();
    let mut sorted = w[data.from..].to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let last = sorted.len() - 1;
    let quantile = |q: f64| sorted[(q * last as f64) as usize];
    let mut breakpoints = vec![sorted[0]];
    breakpoints.extend(QUANTILES.map(quantile));
    breakpoints.push(sorted[last]);
    fit_coefficients(
        front,
        &thinned(&breakpoints, &sorted, FEWEST_IN_PIECE, FEWEST_IN_PIECE),
        back,
        data,
    )
}

/// The cascade of these linear blocks with the best spline on these breakpoints.
pub(super) fn fit_coefficients(front: Rational, breakpoints: &[f64], back: Rational, data: &Data) -> Option<Candidate> {
    let shape = Shape::new(breakpoints);
    let linear = Cascade {
        front,
        shape,
        back,
        between: None,
        offset: 0.0,
    };
    refit_coefficients(linear, breakpoints, data)
}

/// The linear blocks of a cascade and its kinks' places, with the best spline on these breakpoints and the best bends.
pub(super) fn refit_coefficients(mut cascade: Cascade, breakpoints: &[f64], data: &Data) -> Option<Candidate> {
    let kinks = std::mem::take(&mut cascade.shape.kinks);
    cascade.shape = Shape::new(breakpoints);
    cascade.shape.kinks = kinks;
    let (shape, back) = (&cascade.shape, &cascade.back);
    let all_pole = cascade.front.all_pole(&data.u);
    let instants: Vec<_> = (cascade.instants())
        .map(|(front, numerator)| {
            let w = convolved(front, &all_pole);
            let local: Vec<Local> = w.iter().map(|w| shape.local(*w)).collect();
            (w, local, numerator)
        })
        .collect();
    let column = |j: usize| {
        let mut sum = vec![0.0; all_pole.len()];
        for (w, local, numerator) in &instants {
            let more = convolved(numerator, &shape.by_parameter(j, w, local));
            sum.iter_mut().zip(more).for_each(|(s, m)| *s += m);
        }
        convolved(&data.filter, &back.all_pole(&sum))
    };
    let linear: Vec<usize> = shape.linear_parameters().collect();
    let columns: Vec<Vec<f64>> = linear.into_par_iter().map(column).collect();
    let level = mean(&data.y[data.from..]);
    let minus: Vec<f64> = data.y.iter().map(|y| level - y).collect();
    let coefficients = solve(&normal_equations(&convolved(&data.filter, &minus), &columns, data.from))?;
    cascade.shape.set_linear(coefficients);
    cascade.offset = level;
    let squares = data.squares(&cascade.run(&data.u));
    squares.is_finite().then_some(Candidate { cascade, squares })
}
