//! Other searches that start from a minimum; each may find what the first search misses.
//!
//! With a coloured or held input, the memory-removed output shows the nonlinearity badly, so the basis is chosen among filtered functions.
//! And if the nonlinearity is wrong, its error looks like coloured noise and whitening hides it; the output error shows it.

use super::super::options::RefinedHammerstein;
use super::alternation::{Alternation, Minimum, memory};
use super::blocks::Observed;
use super::cells::Cells;
use super::experiments::Experiments;
use super::limits::{DEPENDENT_NOISE, HIDDEN, POOR, UNSEEN_START};
use crate::linear::correlation::variance;

impl RefinedHammerstein {
    /// The best minimum by Schwarz's criterion of the whitened error, among `first` and the results of other searches from there:
    ///
    /// 1. on filtered functions, if the input is coloured or held, and on fewer samples, if the unknown initial state still acts on the first
    ///    ones;
    /// 2. after a minimum of the output error without a noise model, if a pass without that model has a better free run.
    ///
    /// If the free run of the best is poor, and that of the minimum without a noise model is not, the latter is the result.
    pub(super) fn best_of_views(&self, first: Minimum, all: &Experiments, cells: &Cells, input: &[f64]) -> Minimum {
        let observed = &mut Observed::new(all, first.forgetting(all));
        let starts_later = observed.memory > first.memory;
        let u = observed.u;
        // An alternation that keeps the minimum's orders.
        let onwards = |minimum: &Minimum, method| Alternation {
            keeps_orders: true,
            filtered: true,
            offset: minimum.blocks.offset,
            order: minimum.order.clone(),
            ..Alternation::new(
                cells,
                method,
                input,
                minimum.blocks.signal(u),
                minimum.blocks.linear.clone(),
            )
        };
        let mut best = first.on(observed);
        if best.dependence > DEPENDENT_NOISE || starts_later {
            let again = onwards(&best, self).minimum(observed);
            best = better(best, again);
        }
        // Without whitening, the output error is what was minimised.
        if best.whitening.len() < 2 {
            return best;
        }
        let method = &self.without_noise_model();
        let pass = onwards(&best, method).pass(observed);
        let left = pass.map(|pass| pass.blocks.unexplained(observed));
        if !left.is_some_and(|left| left < HIDDEN * best.blocks.unexplained(observed)) {
            return best;
        }
        let Some(unwhitened) = onwards(&best, method).minimum(observed) else {
            return best;
        };
        let again = onwards(&unwhitened, self).minimum(observed);
        best = better(best, again);
        let poor = |minimum: &Minimum| minimum.blocks.unexplained(observed) > POOR;
        match poor(&best) && !poor(&unwhitened) {
            true => unwhitened,
            false => best,
        }
    }
}

/// The minimum with the smaller criterion.
fn better(first: Minimum, other: Option<Minimum>) -> Minimum {
    match other {
        Some(other) if other.criterion() < first.criterion() => other,
        _ => first,
    }
}

impl Minimum {
    /// The lags after which the response to an initial state is small against the noise.
    fn forgetting(&self, all: &Experiments) -> usize {
        let linear = &self.blocks.linear.transfer;
        let spread = variance(&all.y[..all.fitted]).sqrt();
        let share = UNSEEN_START * self.noise() / spread;
        let forgotten = if share > 0.0 { linear.settling(share) } else { 0 };
        forgotten.max(memory(linear))
    }

    /// The minimum with its equations on these samples, so that criteria can be compared.
    fn on(self, observed: &mut Observed) -> Minimum {
        observed.complete(&self.blocks.simulated(observed), self.blocks.offset);
        Minimum {
            equations: self.blocks.equations(observed, &self.whitening),
            memory: observed.memory,
            ..self
        }
    }
}
