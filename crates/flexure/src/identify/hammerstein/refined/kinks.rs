//! The places of the kinks as parameters: moved to where the error is least, with standard errors.
//!
//! A kink of slope change k that moves by d changes the curve above it by -k d, to first order:
//! $$ k (s - t - d)_+ = k (s - t)_+ - k d\, [s \ge t] + O(d^2). $$
//! So a jump is added to the basis at every kink, with the coefficient 0. Its Gauss-Newton step j moves the kink by -j / k, and its standard
//! error is that of the place times |k|. The covariance of all parameters then allows for the places, and so do the band and the standard
//! errors.
//!
//! A kink at a wrong place needs a jump or another kink beside it. So kinks and jumps near each other are replaced on trial by one kink. Removed on
//! trial are each jump next to a kink, each kink that is not clearly apart from the next breakpoint or end, and all curvature between kinks. The
//! kinks are moved. The terms stay away if the squared error rises by less than the cost of as many searched functions ([`SEARCHED_COST`]).

use super::alternation::Minimum;
use super::basis::selection;
use super::blocks::{Blocks, Observed};
use super::calibrated::Covariance;
use super::cells::Cells;
use super::descent::{admissible, descend, step};
use super::limits::{CLEARLY, CROWDED, FIRST_DAMPING, KINK_MOVES, LEAST_FALL, SEARCHED_COST, SHARES_OF_STEP, STEPS};
use super::loss::Equations;
use super::piecewise::Term;
use crate::interrupt;
use crate::sort;
use crate::vectors::dot;

/// The blocks of a minimum, with a jump of coefficient 0 at every kink, and the equations there.
pub(super) struct WithJumps {
    pub blocks: Blocks,
    pub equations: Equations,
    /// Of all parameters, including the jumps.
    pub covariance: Option<Covariance>,
    pub kinks: Vec<Kink>,
}

/// A minimum with its kinks at their best places.
pub(super) struct PlacedKinks {
    pub minimum: Minimum,
    /// The same minimum with a jump at every kink.
    pub extended: WithJumps,
}

/// Where one of the terms breaks the curve.
#[derive(Clone, Copy)]
pub(super) struct Break {
    /// Its place among the terms.
    pub term: usize,
    /// In the unit coordinate.
    pub at: f64,
    /// 0 for a jump, 1 for a kink.
    pub degree: u8,
}

/// The breaks of these terms.
pub(super) fn breaks(terms: &[Term]) -> impl Iterator<Item = Break> {
    terms.iter().enumerate().filter_map(|(term, power)| match *power {
        Term::TruncatedPower { at, degree } => Some(Break { term, at, degree }),
        _ => None,
    })
}

/// Kinks and jumps, at least one of them a kink, each of which is near the next.
fn crowds(terms: &[Term]) -> Vec<Vec<Break>> {
    let mut places: Vec<Break> = breaks(terms).filter(|place| place.degree < 2).collect();
    sort::by_key(&mut places, |place| place.at);
    let crowds = places.chunk_by(|a, b| b.at - a.at < CROWDED);
    let are_several = |crowd: &&[Break]| crowd.len() > 1 && crowd.iter().any(|place| place.degree == 1);
    crowds.filter(are_several).map(<[Break]>::to_vec).collect()
}

/// The curved terms of a curve that also has kinks: without them it is straight between these.
fn curved(terms: &[Term]) -> Option<Vec<usize>> {
    let is_curved = |term: &Term| matches!(term, Term::Power(2..) | Term::TruncatedPower { degree: 2.., .. });
    let found: Vec<usize> = (0..terms.len()).filter(|i| is_curved(&terms[*i])).collect();
    let has_kinks = breaks(terms).any(|place| place.degree == 1);
    (has_kinks && !found.is_empty()).then_some(found)
}

/// A kink whose place is a parameter.
#[derive(Clone)]
pub(super) struct Kink {
    /// Its place among the terms.
    pub term: usize,
    /// Where it is, and by how much the slope changes there, in the unit coordinate.
    pub at: f64,
    pub slope_change: f64,
    /// The parameter that is its jump.
    pub parameter: usize,
}

impl WithJumps {
    /// With a jump at every kink whose place the data determine: its standard error is smaller than the distance to the next breakpoint or
    /// end of the data.
    pub fn new(minimum: &Minimum, cells: &Cells, observed: &Observed) -> WithJumps {
        let mut places = movable(&minimum.terms, cells);
        loop {
            let found = WithJumps::at(minimum, &places, observed);
            let sure =
                |kink: &Kink| (found.place_error(kink)).is_some_and(|error| error < clearance(&minimum.terms, kink));
            let Some(unsure) = found.kinks.iter().position(|kink| !sure(kink)) else {
                return found;
            };
            places.remove(unsure);
        }
    }

    /// With jumps at these kinks.
    fn at(minimum: &Minimum, places: &[Break], observed: &Observed) -> WithJumps {
        let (blocks, kinks) = minimum.jumps_at(places);
        let equations = blocks.equations(observed, &minimum.whitening);
        WithJumps::solved(blocks, kinks, equations)
    }

    /// From the equations of the blocks with jumps.
    pub fn solved(blocks: Blocks, kinks: Vec<Kink>, equations: Equations) -> WithJumps {
        WithJumps {
            covariance: Covariance::new(&blocks, &equations),
            blocks,
            equations,
            kinks,
        }
    }

    /// The standard error of a kink's place in the unit coordinate, if it is a number.
    pub fn place_error(&self, kink: &Kink) -> Option<f64> {
        let error = self.covariance.as_ref()?.error(kink.parameter) / kink.slope_change.abs();
        (error.is_finite() && error > 0.0).then_some(error)
    }

    /// Terms that a kink at its best place may replace: the jumps next to a kink, and the kinks that are not clearly apart from the next
    /// breakpoint or end.
    fn doubtful(&self, terms: &[Term]) -> Vec<usize> {
        let mut places: Vec<Break> = breaks(terms).collect();
        sort::by_key(&mut places, |place| place.at);
        let is_kink = |i: Option<usize>| i.and_then(|i| places.get(i)).is_some_and(|place| place.degree == 1);
        let is_clear =
            |kink: &Kink| (self.place_error(kink)).is_some_and(|error| CLEARLY * error < clearance(terms, kink));
        let is_placed = |place: &Break| (self.kinks.iter()).any(|kink| kink.term == place.term && is_clear(kink));
        let doubtful = |i: usize| match places[i].degree {
            0 => is_kink(i.checked_sub(1)) || is_kink(Some(i + 1)),
            1 => !is_placed(&places[i]),
            _ => false,
        };
        let found = (0..places.len()).filter(|i| doubtful(*i));
        found.map(|i| places[i].term).collect()
    }

    /// The equations of the minimum's own parameters.
    pub fn without_jumps(&self) -> Equations {
        let jumps = self.kinks.iter().rev().map(|kink| kink.parameter);
        let whole = self.equations.normal.clone();
        Equations {
            normal: jumps.fold(whole, |normal, jump| normal.without(jump)),
            count: self.equations.count,
        }
    }

    /// The damped step to the minimum of the equations.
    pub fn step(&self, damping: f64) -> Option<Vec<f64>> {
        step(&self.equations, self.blocks.fixed_parameter(), damping)
    }

    /// By how much a step to the minimum of the equations lowers the squared error.
    pub fn expected_fall(&self, step: &[f64]) -> f64 {
        dot(step, &self.equations.normal.descent)
    }
}

/// The kinks without a jump next to them: the two cannot be told apart.
fn movable(terms: &[Term], cells: &Cells) -> Vec<Break> {
    let cell = |place: &Break| cells.lower.partition_point(|l| *l < place.at);
    let is_jump_next_to = |kink: &Break, other: &Break| other.degree == 0 && cell(other).abs_diff(cell(kink)) <= 1;
    let kinks = breaks(terms).filter(|place| place.degree == 1);
    let kinks = kinks.filter(|kink| !breaks(terms).any(|other| is_jump_next_to(kink, &other)));
    kinks.collect()
}

impl Minimum {
    /// The blocks with a jump of coefficient 0 at these kinks.
    pub fn jumps_at(&self, places: &[Break]) -> (Blocks, Vec<Kink>) {
        let jumps = places
            .iter()
            .map(|kink| Term::TruncatedPower { at: kink.at, degree: 0 });
        let own = &self.blocks;
        let basis = own.basis.with_terms(&jumps.collect::<Vec<_>>());
        let phi = own.nonlinearity();
        let kinks = places.iter().enumerate().map(|(i, kink)| Kink {
            term: kink.term,
            at: kink.at,
            slope_change: phi.slope_change(kink.at),
            parameter: own.c.len() + i,
        });
        let blocks = Blocks {
            basis,
            c: [&own.c[..], &vec![0.0; places.len()]].concat(),
            ..own.clone()
        };
        (blocks, kinks.collect())
    }

    /// The minimum over the kinks' places as well. Jumps and kinks that are then no longer needed are removed.
    pub fn with_kinks_placed(self, cells: &Cells, observed: &Observed) -> PlacedKinks {
        let mut best = self.with_kinks_settled(cells, observed);
        'fewer: while !interrupt::requested() {
            let PlacedKinks { minimum, extended } = &best;
            let merged = crowds(&minimum.terms).into_iter().map(|crowd| {
                let kink = Term::TruncatedPower {
                    at: crowd.iter().map(|place| place.at).sum::<f64>() / crowd.len() as f64,
                    degree: 1,
                };
                (crowd.iter().map(|place| place.term).collect(), vec![kink])
            });
            let doubtful = extended.doubtful(&minimum.terms).into_iter();
            let removed = doubtful.map(|term| vec![term]).chain(curved(&minimum.terms));
            let removed = removed.map(|terms| (terms, Vec::new()));
            for (terms, instead) in merged.chain(removed) {
                let fewer = (terms.len() - instead.len()) as f64;
                let Some(other) = minimum.replaced(&terms, &instead, cells, observed) else {
                    continue;
                };
                let risen = other.minimum.equations.normal.cost - minimum.equations.normal.cost;
                if risen < SEARCHED_COST * fewer * minimum.noise().powi(2) {
                    best = other;
                    continue 'fewer;
                }
            }
            break;
        }
        best
    }

    /// Moves all kinks until the error falls no more.
    fn with_kinks_settled(mut self, cells: &Cells, observed: &Observed) -> PlacedKinks {
        let mut extended = WithJumps::new(&self, cells, observed);
        for _ in interrupt::rounds(KINK_MOVES) {
            let Some(step) = extended.step(FIRST_DAMPING) else {
                break;
            };
            let least = LEAST_FALL * extended.equations.normal.cost;
            if extended.kinks.is_empty() || !(extended.expected_fall(&step) > least) {
                break;
            }
            let lower = SHARES_OF_STEP.iter().find_map(|share| {
                let moved = self.with_kinks_moved(&extended, &step, *share, cells)?;
                let next = WithJumps::new(&moved, cells, observed);
                let fall = extended.equations.normal.cost - next.equations.normal.cost;
                (fall > least).then_some(PlacedKinks {
                    minimum: moved,
                    extended: next,
                })
            });
            let Some(next) = lower else { break };
            self = next.minimum;
            extended = next.extended;
        }
        self.equations = extended.without_jumps();
        PlacedKinks {
            minimum: self,
            extended,
        }
    }

    /// The minimum with other terms instead of some; `None` where no nonlinearity is left.
    pub fn replaced(
        &self,
        gone: &[usize],
        instead: &[Term],
        cells: &Cells,
        observed: &Observed,
    ) -> Option<PlacedKinks> {
        let kept = self.terms.iter().enumerate().filter(|(i, _)| !gone.contains(i));
        let terms: Vec<Term> = kept.map(|(_, term)| *term).chain(instead.iter().copied()).collect();
        let phi = self.blocks.nonlinearity();
        let curve: Vec<f64> = cells.s.iter().map(|s| phi.value(cells.unit.back(*s))).collect();
        let selection = selection(cells, &curve, &terms);
        if selection.terms.len() < 2 {
            return None;
        }
        let blocks = selection.blocks(&self.blocks.linear, self.blocks.offset);
        let descended = descend(blocks, observed, &self.whitening, STEPS);
        Some(
            self.with(descended.blocks, selection.terms)
                .with_kinks_settled(cells, observed),
        )
    }

    /// The same with other blocks. Its equations and its memory-removed values still belong to the old ones.
    fn with(&self, blocks: Blocks, terms: Vec<Term>) -> Minimum {
        Minimum {
            blocks,
            terms,
            equations: self.equations.clone(),
            whitening: self.whitening.clone(),
            order: self.order.clone(),
            values: self.values.clone(),
            ..*self
        }
    }

    /// Takes this share of a step of all parameters and of the kinks' places. It takes less where a kink would move more than half of the way
    /// to the next breakpoint.
    pub fn with_kinks_moved(&self, extended: &WithJumps, step: &[f64], share: f64, cells: &Cells) -> Option<Minimum> {
        let by = |kink: &Kink| -step[kink.parameter] / kink.slope_change;
        let within = |kink: &Kink| 0.5 * clearance(&self.terms, kink) / by(kink).abs();
        let share = share * extended.kinks.iter().map(within).fold(1.0, f64::min);
        let mut p: Vec<f64> = self.blocks.parameters();
        let own = (0..step.len()).filter(|i| extended.kinks.iter().all(|kink| kink.parameter != *i));
        p.iter_mut().zip(own).for_each(|(p, i)| *p += share * step[i]);
        let mut blocks = self.blocks.with(&p);
        let mut terms = self.terms.clone();
        for kink in &extended.kinks {
            let to = kink.at + share * by(kink);
            blocks.basis = blocks.basis.with_kink_moved(kink.at, to);
            terms[kink.term] = Term::TruncatedPower { at: to, degree: 1 };
        }
        let means = blocks.basis.centre(&cells.s, &cells.count);
        // phi loses its mean, which the output had with the linear part's static gain. The offset gets it.
        let mean: f64 = means.iter().zip(blocks.coefficients()).map(|(m, c)| m * c).sum();
        blocks.offset += mean * blocks.linear.transfer.static_gain();
        admissible(&blocks).then(|| self.with(blocks, terms))
    }
}

/// How far a kink is from the next breakpoint, or from an end of the data.
fn clearance(terms: &[Term], kink: &Kink) -> f64 {
    let others = breaks(terms).filter(|place| place.term != kink.term);
    let distances = others.map(|place| place.at).chain([-1.0, 1.0]);
    distances.map(|at| (at - kink.at).abs()).fold(f64::INFINITY, f64::min)
}
