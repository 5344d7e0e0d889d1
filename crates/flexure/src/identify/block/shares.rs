//! Where the search for a sum of branches starts.
//!
//! Both starts come from an equation that is linear in products of a nonlinearity's coefficients and a numerator's: of such
//! products there are as many as branches, so that the matrix of all has their number as its rank (nearly), and its
//! dominant parts are the branches up to a mixing that the joint fit is free to change.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::approximation::solve;
use super::candidate::Candidate;
use super::limits::START_PIECES;
use super::products::normal_equations;
use super::rank::dominant_products;
use super::rational::{Rational, Root, groups, with_conjugates};
use super::signals::{Signals, delayed};
use super::spline::KinkedSpline;
use super::start::{Splines, branches};
use super::system::{Branch, System};
use crate::interrupt::{self, Interrupt};
use crate::linear::correlation::variance;
use crate::parallel;
use crate::sort;

/// More groups of poles than this are not shared out.
const MOST_GROUPS: usize = 8;
/// Random ways of sharing out the poles from which better ones are looked for.
const CLIMBS: usize = 16;
/// Numerator coefficients of a back beyond its poles' number, and most of them.
const MORE_ZEROS: usize = 1;
const MOST_COEFFICIENTS: usize = 4;

/// Static, linear: `count` branches with one denominator of this order.
pub(super) fn hammerstein(data: &Signals, order: usize, count: usize) -> Option<Candidate> {
    let mut all = branches(data, order, &[0], count)?.branches;
    let offset = all.iter_mut().map(|b| std::mem::take(&mut b.offset)).sum();
    take_offset(&mut all, offset);
    Some(Candidate::new(System::sum(all), data))
}

/// An offset of the sum becomes a level of the first nonlinearity whose back passes one.
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

/// Linear, static, linear: the poles of a linear approximation shared out between the fronts and backs of `count`
/// branches, best first.
pub(super) fn shared_poles(approximation: &Rational, data: &Signals, count: usize) -> Vec<Candidate> {
    let mut poles = groups(&approximation.poles());
    poles.truncate(MOST_GROUPS);
    let interrupt = interrupt::current();
    let pool = Pool {
        poles,
        data,
        count,
        interrupt,
    };
    let climbs = parallel::map(CLIMBS, |seed| pool.climbed(seed as u64));
    let mut all: Vec<(Vec<usize>, f64)> = climbs.into_iter().flatten().collect();
    sort::by_key(&mut all, |a| a.1);
    all.dedup_by(|b, a| (a.1 - b.1).abs() <= 1e-9 * a.1.abs());
    all.iter()
        .filter_map(|(slots, _)| pool.shared_out(slots).sum(data))
        .collect()
}

/// Poles, one or a pair at a time, and where they may go: front and back of every branch in turn.
struct Pool<'a> {
    poles: Vec<Root>,
    data: &'a Signals,
    count: usize,
    interrupt: Interrupt,
}

impl Pool<'_> {
    /// From a random way to share out the poles, the best move of one group over and over.
    fn climbed(&self, seed: u64) -> Option<(Vec<usize>, f64)> {
        let mut random = Pcg64::seed_from_u64(seed);
        let places = 2 * self.count;
        let mut slots: Vec<usize> = self.poles.iter().map(|_| random.random_range(0..places)).collect();
        let mut score = self.score(&slots)?;
        loop {
            let moves = (0..slots.len()).flat_map(|group| (0..places).map(move |place| (group, place)));
            let judged = moves
                .filter(|&(group, place)| slots[group] != place)
                .filter_map(|(group, place)| {
                    let mut next = slots.clone();
                    next[group] = place;
                    let score = self.score(&next)?;
                    Some((next, score))
                });
            match judged.min_by(|a, b| a.1.total_cmp(&b.1)) {
                Some((next, less)) if less < score => (slots, score) = (next, less),
                _ => return Some((slots, score)),
            }
        }
    }

    /// The score of a way to share out the poles; `None` where it cannot be fitted, and where the work is asked to stop.
    fn score(&self, slots: &[usize]) -> Option<f64> {
        (!self.interrupt.is_requested()).then(|| self.shared_out(slots).score(self.data))?
    }

    fn shared_out(&self, slots: &[usize]) -> SharedOut {
        let all_pole = |place: usize| {
            let mine = self.poles.iter().zip(slots).filter(|(_, slot)| **slot == place);
            Rational::from_roots(&[], &with_conjugates(mine.map(|(root, _)| root)))
        };
        SharedOut {
            blocks: (0..self.count)
                .map(|i| (all_pole(2 * i), all_pole(2 * i + 1)))
                .collect(),
        }
    }
}

/// Fronts and backs, of poles alone.
struct SharedOut {
    blocks: Vec<(Rational, Rational)>,
}

/// A branch's part of the linear equation.
struct Part {
    front: Rational,
    back: Rational,
    spline: KinkedSpline,
    /// The B-spline that the constant stands for.
    middle: usize,
    /// Numerator coefficients of the back.
    coefficients: usize,
}

/// The parts and the solution.
struct Solved {
    parts: Vec<Part>,
    entries: Vec<f64>,
    squares: f64,
}

impl SharedOut {
    /// Least squares over all products of B-splines and numerator coefficients of all branches, and a constant.
    fn solve(&self, data: &Signals) -> Option<Solved> {
        let (mut parts, mut columns) = (Vec::new(), Vec::new());
        for (front, back) in &self.blocks {
            let mut front = front.clone();
            let w = front.run(data.input());
            let spread = variance(&w[data.from..]).sqrt();
            if !(spread > 1e-12 && spread.is_finite()) {
                return None;
            }
            front.b.iter_mut().for_each(|b| *b /= spread);
            let w: Vec<f64> = w.iter().map(|w| w / spread).collect();
            let spline = KinkedSpline::coarse(&w[data.from..], START_PIECES)?;
            let splines = Splines::new(&w, &spline);
            let coefficients = (back.order() + MORE_ZEROS).min(MOST_COEFFICIENTS);
            for spline in &splines.columns {
                let filtered = back.all_pole(spline);
                columns.extend((0..coefficients).map(|k| delayed(&filtered, k, 1.0)));
            }
            parts.push(Part {
                front,
                back: back.clone(),
                spline,
                middle: splines.middle,
                coefficients,
            });
        }
        columns.push(vec![1.0; data.y.len()]);
        let minus: Vec<f64> = data.y.iter().map(|y| -y).collect();
        let equations = normal_equations(&minus, &columns, data.from);
        let entries = solve(&equations)?;
        let explained: f64 = entries.iter().zip(&equations.descent).map(|(p, d)| p * d).sum();
        Some(Solved {
            parts,
            entries,
            squares: (equations.cost - explained).max(0.0),
        })
    }

    /// Schwarz's criterion, with the parameters of one product a branch.
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
            branch.spline.c = product.column;
            branch.spline.c.insert(part.middle, 0.0);
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
