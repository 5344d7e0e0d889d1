//! The choice of the numbers of intervals of the free curves.

use std::cell::OnceCell;

use super::limits::DIVISION_MOVES;
use super::system::{Curve, Splines, System};

/// The numbers of intervals on either side of zero of a free curve.
#[derive(Debug)]
pub(super) struct Division {
    /// The candidates, ascending.
    pub candidates: &'static [usize],
    /// The number for the curve while the noise is still unknown.
    pub coarse: usize,
    /// The number for the splines that are added to a form in its test.
    pub tested: usize,
}

/// For the stiffness of a flexible joint.
pub(super) const STIFFNESS: Division = Division {
    candidates: &[3, 5, 7, 10, 14, 20],
    coarse: 5,
    tested: 7,
};

/// For the friction of a flexible joint.
pub(super) const FRICTION: Division = Division {
    candidates: &[9, 13, 18, 25, 34],
    coarse: 13,
    tested: 13,
};

/// For the friction of a rigid axis.
pub(super) const RIGID_FRICTION: Division = Division {
    candidates: &[4, 6, 9, 13, 18, 25],
    coarse: 6,
    tested: 9,
};

/// The number of the smallest score.
pub(super) fn lowest(scores: impl Iterator<Item = Option<f64>>) -> Option<usize> {
    let known = scores.enumerate().filter_map(|(i, score)| Some((i, score?)));
    known.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
}

impl Division {
    /// The candidate after this one, or the last.
    pub fn finer(&self, candidate: usize) -> usize {
        self.candidates[(candidate + 1).min(self.candidates.len() - 1)]
    }

    /// The candidate after the one with the smallest score.
    pub fn undersmoothed(&self, score: impl FnMut(usize) -> Option<f64>) -> Option<usize> {
        Some(self.finer(lowest(self.candidates.iter().copied().map(score))?))
    }
}

/// The candidate divisions of all curves of a system.
///
/// All curves are in the same equations: the best division of one depends on the others.
pub(super) struct Divisions<'a> {
    system: &'a System<'a>,
    /// The splines of each candidate of each curve, once they were needed.
    made: Vec<Vec<OnceCell<Splines>>>,
}

impl<'a> Divisions<'a> {
    pub fn new(system: &'a System<'a>) -> Self {
        let candidates = |curve: &Curve| vec![OnceCell::new(); curve.division.candidates.len()];
        Divisions {
            made: system.curves.iter().map(candidates).collect(),
            system,
        }
    }

    /// The splines of every curve with these candidates.
    fn splines(&self, at: &[usize]) -> Vec<&Splines> {
        let curves = self.system.curves.iter().zip(&self.made).zip(at);
        let splines = curves.map(|((curve, made), &k)| {
            made[k].get_or_init(|| curve.splines(self.system.modulation, curve.division.candidates[k]))
        });
        splines.collect()
    }

    /// The candidate of every curve: the search starts from the middle ones, and moves to the next finer or coarser one as long as that
    /// makes the score smaller.
    pub fn best(&self, score: &dyn Fn(&[&Splines]) -> Option<f64>) -> Option<Vec<usize>> {
        let mut at: Vec<usize> = self.made.iter().map(|made| made.len() / 2).collect();
        let mut best = score(&self.splines(&at))?;
        // Tries the curves in turn, until none has changed since its last turn.
        let (mut curve, mut unchanged, mut moves) = (0, 0, 0);
        while unchanged < at.len() && moves < DIVISION_MOVES * at.len() {
            let before = at[curve];
            for step in [1, -1] {
                while let Some(k) = at[curve].checked_add_signed(step)
                    && k < self.made[curve].len()
                {
                    moves += 1;
                    let mut next = at.clone();
                    next[curve] = k;
                    match score(&self.splines(&next)) {
                        Some(found) if found < best => (at, best) = (next, found),
                        _ => break,
                    }
                }
                if at[curve] != before {
                    break;
                }
            }
            unchanged = if at[curve] == before { unchanged + 1 } else { 1 };
            curve = (curve + 1) % at.len();
        }
        Some(at)
    }

    /// The splines of each curve that are `by` candidates finer than these.
    pub fn finer(&self, at: &[usize], by: usize) -> Vec<Splines> {
        let last = self.made.iter().map(|made| made.len() - 1);
        let at: Vec<usize> = at.iter().zip(last).map(|(k, last)| (k + by).min(last)).collect();
        self.splines(&at).into_iter().cloned().collect()
    }
}
