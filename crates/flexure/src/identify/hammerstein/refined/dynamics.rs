//! Delay, order and a first linear part for a known signal between the blocks.

use super::super::LARGEST_ORDER;
use super::super::colour::deconvolve;
use super::super::realisation::{OrderSearch, times_upper};
use super::loss::{Data, Dynamics, filter};
use crate::identify::outcome::ChosenOrder;
use crate::linalg;
use crate::linear::correlation::variance;

/// Most lags of the impulse response that is estimated.
const MOST_LAGS: usize = 300;
/// Samples for each lag.
const SAMPLES: usize = 10;
/// Lags before the supposed delay that are looked at.
const BEFORE: usize = 12;
/// Orders beyond the best that are tried.
const BEYOND: usize = 2;

/// The linear part that the data choose, and the orders that were tried.
pub(super) struct Chosen {
    pub dynamics: Dynamics,
    pub order: ChosenOrder,
}

/// What is given, and what is supposed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Request {
    pub order: Option<usize>,
    pub delay: Option<usize>,
    pub supposed_delay: usize,
    /// Lags after which the response has settled, as far as is known.
    pub memory: usize,
}

/// Chooses by Schwarz's criterion of the whitened prediction error, from covariances alone.
pub(super) fn choose(data: &Data, w: &[f64], whitening: &[f64], request: Request) -> Option<Chosen> {
    let white = Dynamics::moving_average(whitening);
    let y = filter(&white, &data.parts, &data.y);
    let w = filter(&white, &data.parts, w);
    let n = y.len();
    let order = request.order.unwrap_or(LARGEST_ORDER);
    let first = request.delay.unwrap_or(request.supposed_delay.saturating_sub(BEFORE));
    let lead = request.supposed_delay.saturating_sub(first);
    let most = MOST_LAGS.min(n / SAMPLES).max(4 * order + 5);
    let count = (lead + request.memory + request.memory / 2 + 4 * order + 5).min(most);
    let window = first..(first + count).min(n / 2);
    let estimate = deconvolve(&y, &w, window)?;
    let delay = request.delay.unwrap_or_else(|| estimate.first_clear());
    let k = estimate.k.get(delay..)?;
    let factor = linalg::toeplitz_factor(estimate.autocovariance.as_ref()?.get(..k.len())?)?;
    let power = variance(&y);
    let search = OrderSearch {
        k,
        factor: Some(&factor),
        given: request.order,
        beyond: Some(BEYOND),
        samples: n,
    };
    let (model, order) = search.run(|model| {
        let response = model.impulse_response(k.len());
        let d: Vec<f64> = response.iter().zip(k).map(|(h, k)| h - k).collect();
        let distance: f64 = times_upper(&factor, &d).iter().map(|v| v * v).sum();
        estimate.unexplained * power + distance
    })?;
    Some(Chosen {
        dynamics: Dynamics {
            b: model.b().to_vec(),
            a: model.a().to_vec(),
            delay,
        },
        order,
    })
}
