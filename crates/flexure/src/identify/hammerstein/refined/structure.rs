//! Changes of the linear part: a pole, a numerator coefficient or a sample of delay more or less, while Schwarz's criterion of the whitened
//! error falls.
//!
//! Delay and order are first chosen from the estimated impulse response. Under a slow or held input, that estimate is poor, and a response
//! that rises slowly looks delayed. Here every change is fitted to the samples themselves.

use super::alternation::Alternation;
use super::blocks::{Blocks, Observed};
use super::descent::{Descended, descend};
use super::limits::{CHANGE_GAIN, CHANGE_STEPS, STRUCTURE_SAMPLES};
use super::linear_part::LinearPart;
use crate::identify::block::{Rational, greedy, linear_parts};
use crate::interrupt;
use crate::outliers::standing_alone;

impl Alternation<'_> {
    /// A better linear part for this nonlinearity and this noise; `None` if no change is better.
    pub(super) fn changed(&self, blocks: &Blocks, observed: &Observed, whitening: &[f64]) -> Option<LinearPart> {
        let mut head = observed.head(STRUCTURE_SAMPLES);
        // Outliers are left out: a change that follows a few of them would look better.
        for k in standing_alone(&blocks.errors(&head)) {
            head.counts[k] = false;
        }
        let fitted = |blocks: Blocks| descend(blocks, &head, whitening, CHANGE_STEPS);
        let start = fitted(blocks.clone());
        let before = criterion(&start);
        let best = greedy(start, criterion, |best| {
            let near = self.near(&best.blocks.linear).into_iter();
            let near = near.take_while(|_| !interrupt::requested());
            let with = |linear| Blocks {
                linear,
                ..best.blocks.clone()
            };
            near.map(|linear| fitted(with(linear))).collect()
        });
        (criterion(&best) < before - CHANGE_GAIN).then_some(best.blocks.linear)
    }

    /// The linear parts with one change; values chosen by the user stay.
    fn near(&self, linear: &LinearPart) -> Vec<LinearPart> {
        let Some(g) = Rational::from_polynomials(linear.b().to_vec(), linear.transfer.a()) else {
            return Vec::new();
        };
        let wanted = |order: usize, delay: usize| {
            self.method.order.is_none_or(|l| l == order) && self.method.delay.is_none_or(|s| s == delay)
        };
        let near = linear_parts(&g, linear.delay).into_iter();
        let near = near.filter(|(g, delay)| wanted(g.order(), *delay));
        near.filter_map(|(g, delay)| {
            let transfer = g.transfer_function(0).ok()?;
            Some(LinearPart { transfer, delay })
        })
        .collect()
    }
}

/// Schwarz's criterion of the whitened error. A pole counts as two parameters: among equally good linear parts, the one of least order is
/// best.
fn criterion(fit: &Descended) -> f64 {
    let poles = fit.blocks.linear.a().len();
    fit.equations.schwarz(fit.equations.parameters() + poles)
}
