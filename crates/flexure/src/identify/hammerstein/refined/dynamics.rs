//! Delay, order and a first linear part for a known signal between the blocks.

use super::super::LARGEST_ORDER;
use super::super::correlation::{ImpulseEstimate, deconvolve};
use super::loss::{Data, Dynamics, filter};
use crate::identify::outcome::OrderScore;
use crate::interrupt;
use crate::linalg;
use crate::linear::TransferFunction;
use crate::linear::from_impulse_response::from_impulse_response;

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
    pub scores: Vec<OrderScore>,
    pub estimate: ImpulseEstimate,
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
    let delay = request.delay.unwrap_or_else(|| estimate.first());
    let k = estimate.k.get(delay..)?;
    let metric = estimate.metric.as_ref()?;
    let factor = linalg::toeplitz_factor(metric.get(..k.len())?)?;
    let power = crate::linear::correlation::variance(&y);
    let size = n as f64;
    let mut scores = Vec::new();
    let mut best: Option<(TransferFunction, f64, usize)> = None;
    let orders = request
        .order
        .map_or(0..=LARGEST_ORDER.min((k.len() - 1) / 2), |l| l..=l);
    for order in orders {
        if interrupt::requested() {
            return None;
        }
        let Some(model) = from_impulse_response(k, order, Some(&factor)) else {
            continue;
        };
        let h = model.impulse_response(k.len());
        let d: Vec<f64> = h.iter().zip(k).map(|(h, k)| h - k).collect();
        let distance: f64 = factor
            .chunks_exact(k.len())
            .enumerate()
            .map(|(i, row)| row[i..].iter().zip(&d[i..]).map(|(u, d)| u * d).sum::<f64>().powi(2))
            .sum();
        let squares = (estimate.unexplained * power + distance).max(f64::MIN_POSITIVE);
        let bic = size * squares.ln() + (2 * order + 1) as f64 * size.ln();
        scores.push(OrderScore { order, bic });
        if best.as_ref().is_none_or(|b| bic < b.1) {
            best = Some((model, bic, order));
        } else if best.as_ref().is_some_and(|b| order > b.2 + BEYOND) {
            break;
        }
    }
    let (model, ..) = best?;
    Some(Chosen {
        dynamics: Dynamics {
            b: model.b().to_vec(),
            a: model.a().to_vec(),
            delay,
        },
        scores,
        estimate,
    })
}
