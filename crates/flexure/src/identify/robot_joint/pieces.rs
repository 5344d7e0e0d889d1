//! How finely the free curves are divided.

use super::pair::Splines;

/// Rounds of choosing all divisions and weighing the equations anew.
pub(super) const ROUNDS: usize = 2;
/// Changes of division at most in a round.
const MOVES: usize = 12;

/// The number of the smallest score.
pub(super) fn lowest(scores: impl Iterator<Item = Option<f64>>) -> Option<usize> {
    let known = scores.enumerate().filter_map(|(i, score)| Some((i, score?)));
    known.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
}

/// The candidate after the one with the smallest score.
pub(super) fn undersmoothed(candidates: &[usize], scores: impl Iterator<Item = Option<f64>>) -> Option<usize> {
    let best = lowest(scores)?;
    candidates.get(best + 1).or(candidates.last()).copied()
}

/// The candidate divisions of several curves, of which each is in use in one.
///
/// All curves stand in the same equations: how fine one of them pays to be depends on the others.
pub(super) struct Divisions<'a> {
    /// The numbers of pieces to choose from, of each curve.
    candidates: Vec<&'static [usize]>,
    /// The splines of a curve in so many pieces.
    make: Box<dyn Fn(usize, usize) -> Splines + 'a>,
    made: Vec<Vec<Option<Splines>>>,
    /// Which candidate of each curve is in use.
    at: Vec<usize>,
}

impl<'a> Divisions<'a> {
    /// The middle ones of the candidates; `make(curve, pieces)` makes the splines of a curve.
    pub fn new(candidates: Vec<&'static [usize]>, make: impl Fn(usize, usize) -> Splines + 'a) -> Self {
        Divisions {
            made: candidates.iter().map(|c| vec![None; c.len()]).collect(),
            at: candidates.iter().map(|c| c.len() / 2).collect(),
            make: Box::new(make),
            candidates,
        }
    }

    fn prepare(&mut self, at: &[usize]) {
        for (curve, &k) in at.iter().enumerate() {
            if self.made[curve][k].is_none() {
                self.made[curve][k] = Some((self.make)(curve, self.candidates[curve][k]));
            }
        }
    }

    /// The score of a division, by the splines of every curve.
    fn score(&mut self, at: &[usize], score: &dyn Fn(&[&Splines]) -> Option<f64>) -> Option<f64> {
        self.prepare(at);
        let splines: Vec<&Splines> = at
            .iter()
            .enumerate()
            .filter_map(|(curve, &k)| self.made[curve][k].as_ref())
            .collect();
        score(&splines)
    }

    /// Moves to the next finer or coarser division of a curve for as long as that makes the score smaller.
    pub fn improve(&mut self, score: &dyn Fn(&[&Splines]) -> Option<f64>) -> Option<()> {
        let mut at = self.at.clone();
        let mut best = self.score(&at, score)?;
        let (mut curve, mut rests) = (0, 0);
        let mut moves = 0;
        while rests < at.len() && moves < MOVES * at.len() {
            let before = at[curve];
            for step in [1, -1] {
                // In one direction as long as it pays.
                while let Some(k) = at[curve].checked_add_signed(step)
                    && k < self.candidates[curve].len()
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
            rests = if at[curve] == before { rests + 1 } else { 1 };
            curve = (curve + 1) % at.len();
        }
        self.at = at;
        Some(())
    }

    /// The splines of the next finer division of each curve.
    pub fn finer(&mut self, by: usize) -> Vec<Splines> {
        let at: Vec<usize> = self
            .at
            .iter()
            .zip(&self.candidates)
            .map(|(k, c)| (k + by).min(c.len() - 1))
            .collect();
        self.prepare(&at);
        at.iter()
            .enumerate()
            .filter_map(|(curve, &k)| self.made[curve][k].clone())
            .collect()
    }
}
