//! The starts of the search for a sum of branches.
//!
//! Both starts come from an equation that is linear in the products of a nonlinearity's coefficients and a numerator's. These
//! unknowns form a matrix whose rank is about the number of branches. Its largest singular parts are the starts. They may mix the
//! branches; the joint fit separates them.

use super::candidate::Candidate;
use super::cascade::with_unit_variance;
use super::hammerstein_branches::branches;
use super::limits::{CLIMBS, MORE_COEFFICIENTS, MOST_COEFFICIENTS, MOST_POLE_GROUPS, SAME_SCORE, START_PIECES};
use super::rank_one::dominant_products;
use super::rational::{Rational, Root, groups, with_conjugates};
use super::signals::{Signals, delayed};
use super::spline::KinkedSpline;
use super::system::{Branch, System};
use crate::interrupt::{self, Interrupt};
use crate::linear::least_squares::least_squares;
use crate::parallel;
use crate::sort;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Static, linear: `count` branches with one denominator of this order.
pub(super) fn hammerstein(data: &Signals, order: usize, count: usize) -> Option<Candidate> {
    let mut all = branches(data, order, &[0], count)?.branches;
    let offset = all.iter_mut().map(|b| std::mem::take(&mut b.offset)).sum();
    take_offset(&mut all, offset);
    Some(Candidate::new(System::sum(all), data))
}

/// An offset of the sum becomes the level of the first nonlinearity whose back passes a constant.
fn take_offset(branches: &mut [Branch], offset: f64) {
    let gain = |b: &Branch| b.back.static_gain();
    let largest = branches
        .iter_mut()
        .max_by(|a, b| gain(a).abs().total_cmp(&gain(b).abs()));
    if let Some(branch) = largest {
        let level = offset / branch.back.static_gain();
        if level.is_finite() {
            branch.spline.c.iter_mut().for_each(|c| *c += level);
        }
    }
}

/// Linear, static, linear: the poles of a linear approximation assigned to the fronts and backs of `count`
/// branches, best first.
pub(super) fn assigned_poles(approximation: &Rational, data: &Signals, count: usize) -> Vec<Candidate> {
    let mut poles = groups(&approximation.poles());
    poles.truncate(MOST_POLE_GROUPS);
    let interrupt = interrupt::current();
    let pool = Pool {
        poles,
        data,
        count,
        interrupt,
    };
    let climbs = parallel::map(CLIMBS, |seed| pool.climbed(seed as u64));
    let mut all: Vec<Assignment> = climbs.into_iter().flatten().collect();
    sort::by_key(&mut all, |a| a.score);
    all.dedup_by(|b, a| (a.score - b.score).abs() <= SAME_SCORE * a.score.abs());
    all.iter()
        .filter_map(|assignment| pool.blocks(&assignment.places).sum(data))
        .collect()
}

/// The place of every group of poles, and the score of the sum: smaller is better.
struct Assignment {
    places: Vec<usize>,
    score: f64,
}

/// The poles (single real ones or pairs) to assign to the front or the back of a branch; the places are numbered branch by branch.
struct Pool<'a> {
    poles: Vec<Root>,
    data: &'a Signals,
    count: usize,
    interrupt: Interrupt,
}

impl Pool<'_> {
    /// Starts from a random assignment, and repeats the best move of one group.
    fn climbed(&self, seed: u64) -> Option<Assignment> {
        let mut random = Pcg64::seed_from_u64(seed);
        let count = 2 * self.count;
        let places = self.poles.iter().map(|_| random.random_range(0..count)).collect();
        let mut best = self.judged(places)?;
        loop {
            let moves = (0..best.places.len()).flat_map(|group| (0..count).map(move |place| (group, place)));
            let judged = moves
                .filter(|&(group, place)| best.places[group] != place)
                .filter_map(|(group, place)| {
                    let mut places = best.places.clone();
                    places[group] = place;
                    self.judged(places)
                });
            match judged.min_by(|a, b| a.score.total_cmp(&b.score)) {
                Some(next) if next.score < best.score => best = next,
                _ => return Some(best),
            }
        }
    }

    /// `None` if the assignment cannot be fitted, or if the work is asked to stop.
    fn judged(&self, places: Vec<usize>) -> Option<Assignment> {
        if self.interrupt.is_requested() {
            return None;
        }
        let score = self.blocks(&places).score(self.data)?;
        Some(Assignment { places, score })
    }

    fn blocks(&self, places: &[usize]) -> AllPole {
        let all_pole = |place: usize| {
            let mine = self.poles.iter().zip(places).filter(|(_, at)| **at == place);
            Rational::from_roots(&[], &with_conjugates(mine.map(|(root, _)| root)))
        };
        let branch = |i: usize| [all_pole(2 * i), all_pole(2 * i + 1)];
        AllPole {
            blocks: (0..self.count).map(branch).collect(),
        }
    }
}

/// Front and back of every branch, of poles alone.
struct AllPole {
    blocks: Vec<[Rational; 2]>,
}

/// A branch's part of the linear equation.
struct Part {
    front: Rational,
    back: Rational,
    spline: KinkedSpline,
    /// Numerator coefficients of the back.
    coefficients: usize,
}

/// The parts and the solution.
struct Solved {
    parts: Vec<Part>,
    entries: Vec<f64>,
    squares: f64,
}

impl AllPole {
    /// Least squares over all products of B-splines and numerator coefficients of all branches, and a constant.
    fn solve(&self, data: &Signals) -> Option<Solved> {
        let (mut parts, mut columns) = (Vec::new(), Vec::new());
        for [front, back] in &self.blocks {
            let mut front = front.clone();
            let w = with_unit_variance(&mut front, data)?;
            let spline = KinkedSpline::coarse(&w[data.from..], START_PIECES)?;
            let coefficients = (back.order() + MORE_COEFFICIENTS).min(MOST_COEFFICIENTS);
            for values in spline.others_at(&w) {
                let filtered = back.all_pole(&values);
                columns.extend((0..coefficients).map(|k| delayed(&filtered, k, 1.0)));
            }
            parts.push(Part {
                front,
                back: back.clone(),
                spline,
                coefficients,
            });
        }
        columns.push(vec![1.0; data.y.len()]);
        let solution = least_squares(&data.y, &columns, data.from)?;
        Some(Solved {
            parts,
            entries: solution.coefficients,
            squares: solution.squares.max(0.0),
        })
    }

    /// Schwarz's criterion, with the parameters of one product for each branch.
    fn score(&self, data: &Signals) -> Option<f64> {
        let solved = self.solve(data)?;
        let each = (solved.parts.iter()).map(|p| p.front.order() + p.back.order() + p.spline.c.len() + p.coefficients);
        Some(data.bic(solved.squares, each.sum()))
    }

    /// The branches of the dominant products.
    fn sum(&self, data: &Signals) -> Option<Candidate> {
        let Solved { parts, entries, .. } = self.solve(data)?;
        let mut rest = &entries[..];
        let mut all = Vec::new();
        for part in parts {
            let (mine, others) = rest.split_at((part.spline.c.len() - 1) * part.coefficients);
            rest = others;
            let product = dominant_products(mine, part.coefficients, 1)?.pop()?;
            let mut branch = Branch::new(part.front, part.spline, part.back);
            branch.spline.set_others(product.column);
            branch.back.b = product.row;
            branch.front.fill_numerator();
            branch.back.fill_numerator();
            all.push(branch);
        }
        take_offset(&mut all, rest.first().copied().unwrap_or(0.0));
        let sum = Candidate::new(System::sum(all), data);
        sum.squares.is_finite().then_some(sum)
    }
}
