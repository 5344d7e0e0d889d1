//! Which poles and zeros of the best linear approximation belong to the front, and which to the back.
//!
//! Every split of the poles is tried, and the zeros are handed over one by one while that helps (Sjoberg & Schoukens
//! 2012 try all). A split is cheap to judge: with both blocks known up to scale, the nonlinearity is linear least
//! squares on the intermediate signal's B-splines, filtered by the back.

use rayon::prelude::*;

use super::approximation::solve;
use super::loss::{Data, Sandwich};
use super::products::normal_equations;
use super::rational::{Rational, groups};
use super::shape::{Shape, thinned};
use crate::linear::Complex;
use crate::linear::correlation::{mean, variance};

/// Quantiles of the intermediate signal that bound the nonlinearity's first pieces.
const QUANTILES: [f64; 7] = [0.03, 0.12, 0.3, 0.5, 0.7, 0.88, 0.97];
/// The fewest samples in a piece.
pub(super) const FEWEST_IN_PIECE: usize = 12;
/// More groups of poles than this are not split in every way; the rest stays in the front.
const MOST_GROUPS: usize = 10;

/// A split and how well it does with the best nonlinearity for it.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub sandwich: Sandwich,
    pub squares: f64,
}

/// The best candidate of every split of the poles, best first.
pub(super) fn split(approximation: &Rational, data: &Data) -> Vec<Candidate> {
    let poles = groups(&approximation.poles());
    let zeros = groups(&approximation.zeros().unwrap_or_default());
    let splits = 1_usize << poles.len().min(MOST_GROUPS);
    let mut all: Vec<Candidate> = (0..splits)
        .into_par_iter()
        .filter_map(|front_poles| hand_over_zeros(&poles, &zeros, front_poles, data))
        .collect();
    all.sort_by(|a, b| a.squares.total_cmp(&b.squares));
    all
}

/// The best split of the zeros that moving one group at a time finds, from all in the front and from all in the back.
fn hand_over_zeros(
    poles: &[(Complex<f64>, bool)],
    zeros: &[(Complex<f64>, bool)],
    front_poles: usize,
    data: &Data,
) -> Option<Candidate> {
    let judge = |front_zeros: usize| {
        let front = Rational::from_roots(&chosen(zeros, front_zeros, true), &chosen(poles, front_poles, true));
        let back = Rational::from_roots(&chosen(zeros, front_zeros, false), &chosen(poles, front_poles, false));
        fit_shape(front, back, data)
    };
    let all = (1_usize << zeros.len()) - 1;
    let mut best: Option<Candidate> = None;
    for start in [all, 0] {
        let Some(mut current) = judge(start) else { continue };
        let mut mask = start;
        loop {
            let neighbours = (0..zeros.len()).filter_map(|i| Some((mask ^ (1 << i), judge(mask ^ (1 << i))?)));
            match neighbours.min_by(|a, b| a.1.squares.total_cmp(&b.1.squares)) {
                Some((next, candidate)) if candidate.squares < current.squares => (mask, current) = (next, candidate),
                _ => break,
            }
        }
        if best.as_ref().is_none_or(|b| current.squares < b.squares) {
            best = Some(current);
        }
        if zeros.is_empty() {
            break;
        }
    }
    best
}

/// The groups whose bit is (or is not) set, with conjugates.
fn chosen(groups: &[(Complex<f64>, bool)], mask: usize, set: bool) -> Vec<Complex<f64>> {
    let mine = groups.iter().enumerate().filter(|(i, _)| (mask >> i & 1 == 1) == set);
    mine.flat_map(|(_, &(z, pair))| std::iter::once(z).chain(pair.then(|| z.conj())))
        .collect()
}

/// The sandwich of these linear blocks and the best coarse nonlinearity between them.
pub(super) fn fit_shape(mut front: Rational, back: Rational, data: &Data) -> Option<Candidate> {
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

/// The sandwich of these linear blocks with the best spline on these breakpoints.
pub(super) fn fit_coefficients(front: Rational, breakpoints: &[f64], back: Rational, data: &Data) -> Option<Candidate> {
    let mut shape = Shape::new(breakpoints);
    let w = front.run(&data.u);
    let mut columns = vec![vec![0.0; w.len()]; shape.c.len()];
    for (t, w) in w.iter().enumerate() {
        let local = shape.local(*w);
        for (k, v) in local.values.iter().enumerate() {
            columns[local.first + k][t] = *v;
        }
    }
    let columns: Vec<Vec<f64>> = columns.par_iter().map(|c| back.run(c)).collect();
    let level = mean(&data.y[data.from..]);
    let minus: Vec<f64> = data.y.iter().map(|y| level - y).collect();
    shape.c = solve(&normal_equations(&minus, &columns, data.from))?;
    let sandwich = Sandwich {
        front,
        shape,
        back,
        offset: level,
    };
    let squares = data.squares(&sandwich.run(&data.u));
    squares.is_finite().then_some(Candidate { sandwich, squares })
}
