//! Delay, order and a first linear part for a known signal between the blocks.

use super::super::LARGEST_ORDER;
use super::super::colour::deconvolve;
use super::super::limits::{MOST_DECONVOLVED, SAMPLES_PER_UNKNOWN};
use super::super::options::RefinedHammerstein;
use super::super::realisation::{OrderSearch, WithOrder, times_upper};
use super::blocks::Observed;
use super::limits::{LAGS_BEFORE_DELAY, ORDERS_BEYOND};
use super::linear_part::LinearPart;
use crate::linalg;
use crate::linear::correlation::variance;

impl RefinedHammerstein {
    /// The linear part with the given order and delay, or with those of the least Schwarz criterion of the whitened prediction error. It
    /// is computed from covariances alone.
    ///
    /// `w` is the signal between the blocks minus its mean. The delay is searched near `supposed_delay`, and the response is assumed to
    /// settle within `memory` lags.
    pub(super) fn choose_linear_part(
        &self,
        observed: &Observed,
        w: &[f64],
        whitening: &[f64],
        supposed_delay: usize,
        memory: usize,
    ) -> Option<WithOrder<LinearPart>> {
        let white = LinearPart::moving_average(whitening);
        let y = white.filter(&observed.experiments, &observed.y);
        let w = white.filter(&observed.experiments, w);
        let n = y.len();
        // A fit of order l needs 2 l + 1 lags; twice as many leave something to average.
        let for_order = 4 * self.order.unwrap_or(LARGEST_ORDER) + 5;
        let first = self.delay.unwrap_or(supposed_delay.saturating_sub(LAGS_BEFORE_DELAY));
        let before = supposed_delay.saturating_sub(first);
        let most = MOST_DECONVOLVED.min(n / SAMPLES_PER_UNKNOWN).max(for_order);
        let count = (before + memory + memory / 2 + for_order).min(most);
        let estimate = deconvolve(&y, &w, first..(first + count).min(n / 2))?;
        let delay = self.delay.unwrap_or_else(|| estimate.first_clear());
        let k = estimate.k.get(delay..)?;
        let factor = linalg::toeplitz_factor(estimate.autocovariance.as_ref()?.get(..k.len())?)?;
        let power = variance(&y);
        let search = OrderSearch {
            k,
            factor: Some(&factor),
            given: self.order,
            beyond: Some(ORDERS_BEYOND),
            samples: n,
        };
        // The error is that of the deconvolution, plus the change of the output by the model's response.
        let WithOrder { linear, order } = search.run(|model| {
            let response = model.impulse_response(k.len());
            let difference: Vec<f64> = response.iter().zip(k).map(|(h, k)| h - k).collect();
            let distance: f64 = times_upper(&factor, &difference).iter().map(|v| v * v).sum();
            estimate.unexplained * power + distance
        })?;
        let transfer = linear;
        Some(WithOrder {
            linear: LinearPart { transfer, delay },
            order,
        })
    }
}
