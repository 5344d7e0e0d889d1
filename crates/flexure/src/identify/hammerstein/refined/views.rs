//! Other searches from a minimum on, each of which sees what the first may not.
//!
//! Where the input is coloured or held, the memory-removed output shows the nonlinearity badly: its basis is chosen among filtered functions. And
//! where the nonlinearity is wrong, the error that it leaves looks like coloured noise, which whitening then hides: the output error shows it.

use super::super::options::RefinedHammerstein;
use super::alternation::{Alternation, Minimum, memory};
use super::blocks::Observed;
use super::cells::Cells;
use super::experiments::Experiments;
use super::limits::{DEPENDENT_NOISE, HIDDEN, POOR};

impl RefinedHammerstein {
    /// The best by Schwarz's criterion of the whitened error among `first` and the minima that other searches reach from there:
    ///
    /// 1. on filtered functions, where the input is coloured or held;
    /// 2. after a minimum of the output error without a noise model, where a pass without it leaves less in a free run.
    ///
    /// If the free run of the best is poor, and that of the minimum without a noise model is not, the latter is the result.
    pub(super) fn best_of_views(&self, first: Minimum, all: &Experiments, cells: &Cells, input: &[f64]) -> Minimum {
        let observed = &mut Observed::new(all, memory(&first.blocks.linear.transfer));
        let u = observed.u;
        // With its orders kept.
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
        if best.dependence > DEPENDENT_NOISE {
            let filtered = onwards(&best, self).minimum(observed);
            best = better(best, filtered);
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

/// The minimum of the smaller criterion.
fn better(first: Minimum, other: Option<Minimum>) -> Minimum {
    match other {
        Some(other) if other.criterion() < first.criterion() => other,
        _ => first,
    }
}

impl Minimum {
    /// With its equations on these samples, so that criteria can be compared.
    fn on(self, observed: &mut Observed) -> Minimum {
        observed.complete(&self.blocks.simulated(observed), self.blocks.offset);
        Minimum {
            equations: self.blocks.equations(observed, &self.whitening),
            ..self
        }
    }
}
