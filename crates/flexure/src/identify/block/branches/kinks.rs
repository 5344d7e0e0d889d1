//! Kinks of a system's nonlinearities.

use super::super::{Bendable, Kink, Monitor};
use super::pieces::{Part, entering, fewest_in_piece, refitted, with_pieces};
use super::search::{Candidate, TRIAL_STEPS, TriedBranches, fitted};
use super::system::Signals;

/// With kinks in every nonlinearity that the data show them in, one after the other.
pub(super) fn kinked(
    mut best: Candidate,
    data: &Signals,
    monitor: &mut Monitor<'_>,
    tried: &mut Vec<TriedBranches>,
) -> Candidate {
    for part in best.system.parts() {
        best = super::super::kinked(best, &mut InSystem { part, data, tried }, monitor);
    }
    best
}

/// One of a system's nonlinearities, to be given kinks.
struct InSystem<'a> {
    part: Part,
    data: &'a Signals,
    tried: &'a mut Vec<TriedBranches>,
}

impl Bendable for InSystem<'_> {
    type Candidate = Candidate;

    fn pieces(&self, c: &Candidate) -> usize {
        c.system.pieces(self.part)
    }

    fn kinks<'c>(&self, c: &'c Candidate) -> &'c [Kink] {
        c.system.shape(self.part).map_or(&[], |shape| &shape.kinks)
    }

    fn entering(&self, c: &Candidate) -> Vec<f64> {
        entering(&c.system, self.part, self.data)
    }

    fn with_pieces(&self, c: &Candidate, pieces: usize) -> Option<Candidate> {
        with_pieces(&c.system, self.part, pieces, self.data)
    }

    fn with_kinks(&self, c: &Candidate, kinks: Vec<Kink>, samples: usize) -> Option<Candidate> {
        let mut system = c.system.clone();
        let shape = match self.part {
            Part::Branch(i) => &mut system.branches.get_mut(i)?.shape,
            Part::Output => system.output.as_mut()?,
        };
        shape.kinks = kinks;
        let breakpoints = shape.breakpoints().to_vec();
        refitted(&system, self.part, &breakpoints, &self.data.head(samples))
    }

    fn squares(&self, c: &Candidate) -> f64 {
        c.squares
    }

    fn fitted(&mut self, c: Candidate, tolerance: f64, monitor: &mut Monitor<'_>) -> Candidate {
        let next = fitted(c, self.data, TRIAL_STEPS, tolerance, monitor);
        self.tried.push(next.tried(self.data));
        next
    }

    fn criterion(&self, c: &Candidate) -> f64 {
        c.bic(self.data)
    }

    fn fewest_in_piece(&self) -> usize {
        fewest_in_piece(self.data)
    }
}
