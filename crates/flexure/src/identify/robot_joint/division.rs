//! How finely the free curves are divided.

use super::system::{Splines, System};

/// Changes of division at most in a round, for each curve.
const MOVES: usize = 12;

/// The numbers of intervals on either side of zero of a free curve.
#[derive(Debug)]
pub(super) struct Division {
    /// Those to choose from, ascending.
    pub candidates: &'static [usize],
    /// That of the curve while the noise is still unknown.
    pub coarse: usize,
    /// That beside which forms are tested.
    pub tested: usize,
}

/// Of the stiffness of a flexible joint.
pub(super) const STIFFNESS: Division = Division {
    candidates: &[3, 5, 7, 10, 14, 20],
    coarse: 5,
    tested: 7,
};

/// Of the friction of a flexible joint.
pub(super) const FRICTION: Division = Division {
    candidates: &[9, 13, 18, 25, 34],
    coarse: 13,
    tested: 13,
};

/// Of the friction of a rigid axis.
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

/// The candidate divisions of all curves of a system, of which each has one in use.
///
/// All curves stand in the same equations: how fine one of them has to be depends on the others.
pub(super) struct Divisions<'a> {
    system: &'a System<'a>,
    /// The splines of each candidate of each curve, once they were needed.
    made: Vec<Vec<Option<Splines>>>,
    /// Which candidate of each curve is in use.
    at: Vec<usize>,
}

impl<'a> Divisions<'a> {
    /// The middle candidates.
    pub fn new(system: &'a System<'a>) -> Self {
        let counts = || system.curves.iter().map(|c| c.division.candidates.len());
        Divisions {
            made: counts().map(|n| vec![None; n]).collect(),
            at: counts().map(|n| n / 2).collect(),
            system,
        }
    }

    fn prepare(&mut self, at: &[usize]) {
        for ((curve, made), &k) in self.system.curves.iter().zip(&mut self.made).zip(at) {
            if made[k].is_none() {
                made[k] = Some(curve.splines(self.system.modulation, curve.division.candidates[k]));
            }
        }
    }

    /// The score of a division, by the splines of every curve.
    fn score(&mut self, at: &[usize], score: &dyn Fn(&[&Splines]) -> Option<f64>) -> Option<f64> {
        self.prepare(at);
        let splines: Vec<&Splines> = self
            .made
            .iter()
            .zip(at)
            .filter_map(|(made, &k)| made[k].as_ref())
            .collect();
        score(&splines)
    }

    /// Moves to the next finer or coarser division of a curve for as long as that makes the score smaller.
    pub fn improve(&mut self, score: &dyn Fn(&[&Splines]) -> Option<f64>) -> Option<()> {
        let mut at = self.at.clone();
        let mut best = self.score(&at, score)?;
        // Curves in turn, until none has changed since its last turn.
        let (mut curve, mut unchanged, mut moves) = (0, 0, 0);
        while unchanged < at.len() && moves < MOVES * at.len() {
            let before = at[curve];
            for step in [1, -1] {
                while let Some(k) = at[curve].checked_add_signed(step)
                    && k < self.made[curve].len()
                {
                    moves += 1;
                    let mut next = at.clone();
                    next[curve] = k;
                    match self.score(&next, score) {
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
        self.at = at;
        Some(())
    }

    /// The splines of a division of each curve that is `by` candidates finer.
    pub fn finer(&mut self, by: usize) -> Vec<Splines> {
        let last = self.made.iter().map(|made| made.len() - 1);
        let at: Vec<usize> = self.at.iter().zip(last).map(|(k, last)| (k + by).min(last)).collect();
        self.prepare(&at);
        self.made
            .iter()
            .zip(&at)
            .filter_map(|(made, &k)| made[k].clone())
            .collect()
    }
}
