//! Other views of the same data, from a minimum on.
//!
//! The memory-removed output is a coarse view of the nonlinearity where the input is coloured or held, and whitening is a deceptive one
//! where the model is wrong.

use super::super::options::RefinedHammerstein;
use super::alternation::{Alternation, Minimum, memory};
use super::blocks::Observed;
use super::cells::Cells;
use super::experiments::Experiments;
use super::limits::{DEPENDENT_NOISE, HIDDEN, POOR};

impl RefinedHammerstein {
    /// The best of several minima by Schwarz's criterion of the whitened error: `first`, and what other views of the same data lead to from
    /// there.
    ///
    /// 1. With the basis chosen among filtered functions, where the input is coloured or held.
    /// 2. After a minimum of the output error without a noise model, if a pass without it leaves less in a free run. What a wrong
    ///    nonlinearity leaves looks like coloured noise too, and its whitening then hides what is wrong.
    ///
    /// Where a free run of these is poor and that without a noise model is not, that is the best.
    pub(super) fn best_of_views(&self, first: Minimum, all: &Experiments, cells: &Cells, input: &[f64]) -> Minimum {
        let observed = &mut Observed::new(all, memory(&first.blocks.linear.transfer));
        // On the same samples as the others.
        let first = Minimum {
            equations: first.blocks.equations(observed, &first.whitening),
            ..first
        };
        let views = Views {
            cells,
            input,
            u: observed.u,
        };
        let better = |a: Minimum, b: Option<Minimum>| match b {
            Some(b) if b.criterion() < a.criterion() => b,
            _ => a,
        };
        let mut best = first;
        if best.dependence > DEPENDENT_NOISE {
            let filtered = views.onwards(&best, self).minimum(observed);
            best = better(best, filtered);
        }
        let plain = RefinedHammerstein {
            noise_model: false,
            ..*self
        };
        if best.whitening.len() < 2 {
            return best;
        }
        let pass = views.onwards(&best, &plain).pass(observed);
        let left = pass.map(|pass| pass.blocks.unexplained(observed));
        if !left.is_some_and(|left| left < HIDDEN * best.blocks.unexplained(observed)) {
            return best;
        }
        let Some(unwhitened) = views.onwards(&best, &plain).minimum(observed) else {
            return best;
        };
        let again = views.onwards(&unwhitened, self).minimum(observed);
        let best = better(best, again);
        match best.blocks.unexplained(observed) > POOR && unwhitened.blocks.unexplained(observed) < POOR {
            true => unwhitened,
            false => best,
        }
    }
}

/// What the searches from a minimum on have in common.
struct Views<'a> {
    cells: &'a Cells,
    input: &'a [f64],
    u: &'a [f64],
}

impl<'a> Views<'a> {
    /// A search that goes on from a minimum, with its orders and the basis chosen among filtered functions.
    fn onwards(&self, minimum: &Minimum, method: &'a RefinedHammerstein) -> Alternation<'a> {
        Alternation {
            cells: self.cells,
            method,
            input: self.input,
            w: minimum.blocks.signal(self.u),
            linear: minimum.blocks.linear.clone(),
            keeps_orders: true,
            filtered: true,
            memory: memory(&minimum.blocks.linear.transfer),
            offset: minimum.blocks.offset,
            terms: Vec::new(),
            order: minimum.order.clone(),
        }
    }
}
