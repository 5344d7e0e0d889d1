//! Whether a fit stays good from another start of its run.
//!
//! A model may follow a record from only one start: poles with a memory longer than the record hold a level that the record does not
//! determine. A fit starts from rest; a free run starts in the steady state of the input's mean. So every result is run once more from
//! there. If its error is then much larger, poor, and much larger than that of other tried models, the simplest of the good ones replaces
//! it.

use super::candidate::Candidate;
use super::limits::{AS_GOOD_RESTARTED, POOR, RUN_AWAY};
use super::search::Search;
use super::signals::Signals;

/// `last`, or the simplest of `others` that stays good from another start if `last` does not. `usual` is the mean squared error of `last`
/// on its record; `restarted` gives that from another start. The output's variance is 1.
pub(in crate::identify) fn robust_to_restart<C>(
    last: C,
    usual: f64,
    others: Vec<C>,
    degrees: impl Fn(&C) -> usize,
    restarted: impl Fn(&C) -> f64,
) -> C {
    let own = restarted(&last);
    if own <= (RUN_AWAY * usual).max(POOR) {
        return last;
    }
    let judged: Vec<(f64, C)> = others.into_iter().map(|c| (restarted(&c), c)).collect();
    let least = judged.iter().map(|(error, _)| *error).fold(f64::INFINITY, f64::min);
    // If all others fail too, the other start is hard for the system itself.
    if own <= RUN_AWAY * least {
        return last;
    }
    let good = judged
        .into_iter()
        .filter(|(error, _)| *error <= AS_GOOD_RESTARTED * least);
    good.min_by_key(|(_, c)| degrees(c)).map_or(last, |(_, c)| c)
}

impl Search<'_, '_> {
    /// The last candidate; if it does not stay good from another start, the simplest one that does, among those tried on equally many
    /// samples.
    pub fn surviving(&self, last: Candidate, data: &Signals) -> Candidate {
        let mut others: Vec<Candidate> = self.tried.iter().filter_map(|t| t.on(data)).collect();
        others.retain(|c| c.system.degrees() < last.system.degrees());
        let usual = last.squares / data.counted() as f64;
        let degrees = |c: &Candidate| c.system.degrees();
        robust_to_restart(last, usual, others, degrees, |c| {
            data.squares(&c.system.run_settled(&data.u)) / data.counted() as f64
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Candidates are numbers of parameters; errors come from a table.
    fn chosen(own: f64, usual: f64, others: &[(usize, f64)]) -> usize {
        let all: Vec<usize> = others.iter().map(|(n, _)| *n).collect();
        let restarted = |n: &usize| others.iter().find(|(m, _)| m == n).map_or(own, |(_, error)| *error);
        robust_to_restart(100, usual, all, |n| *n, restarted)
    }

    #[test]
    fn what_holds_stays_and_what_runs_away_gives_way_to_the_simplest_that_does_not() {
        let others = [(20, 1.0), (10, 1.2), (5, 30.0)];
        assert_eq!(chosen(2.0, 1.0, &others), 100);
        assert_eq!(chosen(0.1, 1e-4, &[(5, 1e-4)]), 100);
        assert_eq!(chosen(1e4, 1.0, &others), 10);
        assert_eq!(chosen(f64::NAN, 1.0, &others), 10);
        assert_eq!(chosen(f64::INFINITY, 1.0, &[]), 100);
    }

    #[test]
    fn a_start_that_is_hard_for_all_decides_nothing() {
        assert_eq!(chosen(50.0, 1.0, &[(20, 40.0), (10, 60.0)]), 100);
    }
}
