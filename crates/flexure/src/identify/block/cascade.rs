//! One branch: linear, static, linear. Its starts are the poles and zeros of linear approximations, assigned to the front and to the
//! back.
//!
//! Every split of the poles is tried, and the zeros are moved one by one while that helps (Sjoberg & Schoukens 2012 try all). Judging a
//! split is cheap: with both blocks known up to scale, the nonlinearity follows by linear least squares from the intermediate signal's
//! B-splines, filtered by the back.

use super::candidate::Candidate;
use super::limits::{
    CASCADE_ROUNDS, CONSTANT_SPREAD, FIRST_PIECE_QUANTILES, MOST_POLE_GROUPS, MOST_SCREENED, MOST_SPLITS,
    SAMPLES_IN_COARSE_PIECE, START_SAMPLES,
};
use super::monitor::{Monitor, Stage};
use super::pieces::refitted;
use super::prepared::Prepared;
use super::rational::{Rational, Root, groups, with_conjugates};
use super::search::{Search, SearchResult};
use super::signals::Signals;
use super::spline::{KinkedSpline, thinned};
use super::system::{Branch, FreeParts, Part, System};
use crate::interrupt::{self, Interrupt};
use crate::linear::Complex;
use crate::linear::correlation::variance;
use crate::parallel;
use crate::sort;

/// All splits of the linear approximations' poles and zeros that are worth a fit.
pub(in crate::identify) fn splits(prepared: &Prepared, monitor: &mut Monitor<'_>) -> Vec<Candidate> {
    monitor.stage = Stage::Split;
    let few = prepared.data.head(START_SAMPLES);
    let mut candidates = Vec::new();
    for system in prepared.starting() {
        if monitor.keep_on() {
            candidates.extend(split(system, &few).into_iter().take(MOST_SCREENED));
        }
    }
    candidates
}

/// The best system of one branch from all starts, on data of unit variance and zero mean.
pub(in crate::identify) fn search(
    mut starts: Vec<Candidate>,
    free: FreeParts,
    data: &Signals,
    monitor: &mut Monitor<'_>,
) -> Option<SearchResult> {
    for branch in starts.iter_mut().flat_map(|c| &mut c.system.branches) {
        branch.front.fill_numerator();
        branch.back.fill_numerator();
    }
    Search::new(free, monitor).run(starts, &CASCADE_ROUNDS, data)
}

/// The result without a start: a static nonlinearity, or a constant.
pub(in crate::identify) fn without_start(data: &Signals) -> SearchResult {
    let constant = || System::sum(vec![Branch::of(KinkedSpline::new(&[-1.0, 1.0]))]);
    let fit = fit_nonlinearity(Rational::pass(), Rational::pass(), data);
    SearchResult {
        system: fit.map_or_else(constant, |c| c.system),
        tried: Vec::new(),
    }
}

/// The best candidate of every split of the poles, best first; with very many splits, only of the most promising ones.
fn split(approximation: &Rational, data: &Signals) -> Vec<Candidate> {
    let roots = Roots {
        poles: groups(&approximation.poles()),
        zeros: groups(&approximation.zeros().unwrap_or_default()),
        data,
        interrupt: interrupt::current(),
    };
    let splits = 1_usize << roots.poles.len().min(MOST_POLE_GROUPS);
    let started: Vec<Vec<Start>> = parallel::map(splits, |s| roots.starts(s));
    let mut promising: Vec<Vec<Start>> = started.into_iter().filter(|s| !s.is_empty()).collect();
    let least = |s: &Vec<Start>| s.iter().map(|s| s.candidate.squares).fold(f64::INFINITY, f64::min);
    sort::by_key(&mut promising, least);
    promising.truncate(MOST_SPLITS);
    let moved = parallel::batch(&promising, |starts| {
        let ends = starts.iter().map(|s| roots.move_zeros(s));
        ends.min_by(|a, b| a.squares.total_cmp(&b.squares))
    });
    let mut all: Vec<Candidate> = moved.into_iter().flatten().collect();
    sort::by_key(&mut all, |c| c.squares);
    all
}

/// The poles and zeros to share out, one or a pair at a time.
struct Roots<'a> {
    poles: Vec<Root>,
    zeros: Vec<Root>,
    data: &'a Signals,
    interrupt: Interrupt,
}

/// The bits of the poles and zeros in the front, and the error of this split.
struct Start {
    front_poles: usize,
    front_zeros: usize,
    candidate: Candidate,
}

impl Roots<'_> {
    /// `None` if it cannot be fitted, or if the work is asked to stop.
    fn judge(&self, front_poles: usize, front_zeros: usize) -> Option<Candidate> {
        if self.interrupt.is_requested() {
            return None;
        }
        let part = |front: bool| {
            let zeros = chosen(&self.zeros, front_zeros, front);
            Rational::from_roots(&zeros, &chosen(&self.poles, front_poles, front))
        };
        fit_nonlinearity(part(true), part(false), self.data)
    }

    /// Two starts: all zeros in the front, or all in the back.
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
    fn move_zeros(&self, start: &Start) -> Candidate {
        let (mut mask, mut current) = (start.front_zeros, start.candidate.clone());
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

/// The roots whose bit is (or is not) set, with conjugates.
fn chosen(roots: &[Root], mask: usize, set: bool) -> Vec<Complex<f64>> {
    let mine = roots.iter().enumerate().filter(|(i, _)| (mask >> i & 1 == 1) == set);
    with_conjugates(mine.map(|(_, root)| root))
}

/// The branch of these linear blocks and the best coarse nonlinearity between them.
pub(in crate::identify) fn fit_nonlinearity(mut front: Rational, back: Rational, data: &Signals) -> Option<Candidate> {
    let w = with_unit_variance(&mut front, data)?;
    let mut sorted = w[data.from..].to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let last = sorted.len() - 1;
    let quantile = |q: f64| sorted[(q * last as f64) as usize];
    let mut breakpoints = vec![sorted[0]];
    breakpoints.extend(FIRST_PIECE_QUANTILES.map(quantile));
    breakpoints.push(sorted[last]);
    let breakpoints = thinned(&breakpoints, &sorted, SAMPLES_IN_COARSE_PIECE, SAMPLES_IN_COARSE_PIECE);
    let system = System::sum(vec![Branch::new(front, KinkedSpline::new(&breakpoints), back)]);
    refitted(&system, Part::Branch(0), &breakpoints, data)
}

/// Scales a front so that its output has unit variance, and returns this output; `None` if it does not vary.
pub(super) fn with_unit_variance(front: &mut Rational, data: &Signals) -> Option<Vec<f64>> {
    let w = front.run(data.input());
    let spread = variance(&w[data.from..]).sqrt();
    if !(spread > CONSTANT_SPREAD && spread.is_finite()) {
        return None;
    }
    front.b.iter_mut().for_each(|b| *b /= spread);
    Some(w.iter().map(|w| w / spread).collect())
}
