//! Changes of the linear part: a pole, a numerator coefficient or a sample of delay more or less, while Schwarz's criterion of the whitened
//! error falls.
//!
//! Delay and order are first chosen from the deconvolved impulse response. Under a slow or held input that is a coarse view: the first
//! samples of a response that begins gently look like a delay. Here every change is fitted to the samples themselves.

use super::alternation::Alternation;
use super::blocks::{Blocks, Observed};
use super::descent::{Descended, descend};
use super::limits::{CHANGE_GAIN, CHANGE_STEPS, STRUCTURE_SAMPLES};
use super::linear_part::LinearPart;
use crate::identify::block::{Rational, greedy, linear_parts};
use crate::interrupt;
use crate::outliers::standing_alone;

impl Alternation<'_> {
    /// A better linear part for this nonlinearity and this noise; `None` where no change is better.
    pub(super) fn changed(&self, blocks: &Blocks, observed: &Observed, whitening: &[f64]) -> Option<LinearPart> {
        let mut head = observed.head(STRUCTURE_SAMPLES);
        // A few large outliers would pay for any change that follows them.
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

    /// The linear parts with one change, but for what the user has chosen.
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

/// Schwarz's criterion of the whitened error, where a pole counts as two parameters: of several equally good linear parts that of least order.
fn criterion(fit: &Descended) -> f64 {
    let n = fit.equations.count.max(1) as f64;
    let parameters = fit.equations.parameters() + fit.blocks.linear.a().len();
    n * (fit.equations.normal.cost / n).max(f64::MIN_POSITIVE).ln() + parameters as f64 * n.ln()
}
