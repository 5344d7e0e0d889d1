//! Step 4: the order and the coefficients of the linear part from its impulse response, (15) and the ARMA model of section VI.
//!
//! The denominator solves the Yule-Walker equations $\sum_{i=0}^{l} a_i k_{j-i} = 0$, j > l, in least squares; the numerator follows
//! as $b_j = \sum_i a_i k_{j-i}$. These equations weight the noise in k badly. So both are refined until the squared distance between the
//! model's impulse response and k is smallest. The order l has the smallest Schwarz criterion of the simulation error.

use super::super::limits::LARGEST_RADIUS;
use super::Estimate;
use super::limits::{HANKEL_ROWS, LARGEST_ORDER, REALISATION_STEPS, UNSETTLED};
use crate::error::{DataError, Error, Result};
use crate::identify::warning::Warning;
use crate::interrupt;
use crate::linalg::{self, Complex};
use crate::linear::TransferFunction;
use crate::linear::correlation::mean;
use crate::linear::levenberg_marquardt::{Linearisation, minimise};
use crate::vectors::dot;

/// An order that was tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OrderScore {
    /// The order l.
    pub order: usize,
    /// Schwarz's criterion of the free-run error on the fit's samples; smaller is better.
    pub bic: f64,
}

/// The order and how it was chosen.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ChosenOrder {
    /// The order l of the linear part.
    pub order: usize,
    /// Singular values of the Hankel matrix of the estimated impulse response, largest first.
    pub hankel_singular_values: Vec<f64>,
    /// The orders that were tried; one only if it was given.
    pub scores: Vec<OrderScore>,
}

/// A linear part, and how its order was chosen.
#[derive(Clone)]
pub(super) struct WithOrder<L> {
    pub linear: L,
    pub order: ChosenOrder,
}

/// The linear part, without the delay.
pub(super) struct Realisation {
    pub linear: TransferFunction,
    pub order: ChosenOrder,
    /// The last lag of the impulse response that was used.
    pub memory: usize,
}

/// The linear part whose impulse response is nearest to the estimated one.
///
/// # Errors
/// [`Error::Data`]: `ResponseTooShort` if the given order needs more lags than there are.
pub(super) fn realise(
    estimate: &Estimate,
    given: Option<usize>,
    y: &[f64],
    warnings: &mut Vec<Warning>,
) -> Result<Realisation> {
    interrupt::check()?;
    let (response, delay, m) = (&estimate.response, estimate.delay, &estimate.regression.centred);
    let last = response.k.len() - 1;
    let settled = response.settling_lag(delay);
    // A fit of order l needs 2 l + 1 lags; twice as many leave something to average.
    let memory = settled.max(delay + 4 * given.unwrap_or(LARGEST_ORDER) + 4).min(last);
    let k = response.k.get(delay..=memory).unwrap_or_default();
    let factor = (response.autocovariance.as_ref()).and_then(|r| linalg::toeplitz_factor(r.get(..k.len())?));
    let search = OrderSearch {
        k,
        factor: factor.as_deref(),
        given,
        beyond: None,
        samples: y.len(),
    };
    let centre = mean(y);
    let found = search.run(|model| {
        let simulated = std::iter::repeat_n(0.0, delay).chain(model.simulate(m));
        let squares: f64 = y.iter().zip(simulated).map(|(y, p)| (y - centre - p).powi(2)).sum();
        squares / y.len() as f64
    });
    interrupt::check()?;
    let Some(WithOrder { linear, order }) = found else {
        return Err(Error::Data(DataError::ResponseTooShort {
            delay,
            lags: k.len(),
            need: 2 * given.unwrap_or(0) + 1,
        }));
    };
    if settled > last || delay + linear.settling(UNSETTLED) > last {
        warnings.push(Warning::NotSettled { lags: last });
    }
    Ok(Realisation { linear, order, memory })
}

/// The choice of the order of a linear part with a known impulse response.
pub(super) struct OrderSearch<'a> {
    /// The impulse response from the delay on.
    pub k: &'a [f64],
    /// As in [`from_impulse_response`].
    pub factor: Option<&'a [f64]>,
    /// The order, if it was given.
    pub given: Option<usize>,
    /// The search ends after this many orders beyond the best.
    pub beyond: Option<usize>,
    pub samples: usize,
}

impl OrderSearch<'_> {
    /// The linear part with the smallest Schwarz criterion, for the mean squared error of each; `None` if the response is too short.
    pub fn run(&self, mean_square: impl Fn(&TransferFunction) -> f64) -> Option<WithOrder<TransferFunction>> {
        let largest = LARGEST_ORDER.min(self.k.len().saturating_sub(1) / 2);
        let n = self.samples as f64;
        let mut scores = Vec::new();
        let mut best: Option<(TransferFunction, OrderScore)> = None;
        for order in self.given.map_or(0..=largest, |l| l..=l) {
            if interrupt::requested() {
                break;
            }
            let Some(model) = from_impulse_response(self.k, order, self.factor) else {
                continue;
            };
            let parameters = (2 * order + 1) as f64;
            let bic = n * mean_square(&model).max(f64::MIN_POSITIVE).ln() + parameters * n.ln();
            let score = OrderScore { order, bic };
            scores.push(score);
            let late = |b: &(_, OrderScore)| self.beyond.is_some_and(|beyond| order > b.1.order + beyond);
            if bic.is_finite() && best.as_ref().is_none_or(|b| bic < b.1.bic) {
                best = Some((model, score));
            } else if best.as_ref().is_some_and(late) {
                break;
            }
        }
        let (linear, score) = best?;
        let order = ChosenOrder {
            order: score.order,
            hankel_singular_values: hankel_singular_values(self.k, HANKEL_ROWS).unwrap_or_default(),
            scores,
        };
        Some(WithOrder { linear, order })
    }
}

/// The transfer function of order `order` whose impulse response is nearest to `k`.
///
/// The norm is Euclidean, or that of U d for the difference d, with `factor` an upper triangular row-major U. With U'U the autocovariance
/// of the system's input, this norm is the output error. Always stable. `None` if `k` is too short (it takes at least `2 order + 1` values)
/// or not finite.
fn from_impulse_response(k: &[f64], order: usize, factor: Option<&[f64]>) -> Option<TransferFunction> {
    let raw = yule_walker(k, order)?;
    let refined = refine(k, order, &raw, factor);
    refined.or(Some(raw))
}

/// The unrefined Yule-Walker solution, with unstable poles reflected into the unit circle.
fn yule_walker(k: &[f64], order: usize) -> Option<TransferFunction> {
    if k.len() < 2 * order + 1 || k.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let mut a = vec![1.0];
    if order > 0 {
        let equations = order + 1..k.len();
        let rows: Vec<f64> = equations
            .clone()
            .flat_map(|j| (1..=order).map(move |i| k[j - i]))
            .collect();
        let rhs: Vec<f64> = equations.map(|j| -k[j]).collect();
        a.extend(linalg::least_squares(&rows, order, &rhs)?);
    }
    let a = stabilised(&a)?;
    let b = numerator(&a, k, order);
    TransferFunction::new(b, a).ok()
}

/// b_j = sum_i a_i k_{j-i}.
fn numerator(a: &[f64], k: &[f64], order: usize) -> Vec<f64> {
    (0..=order)
        .map(|j| (0..=j.min(a.len() - 1)).map(|i| a[i] * k[j - i]).sum())
        .collect()
}

/// The denominator with every pole outside the unit circle replaced by its mirror image inside.
fn stabilised(a: &[f64]) -> Option<Vec<f64>> {
    let poles = linalg::roots(a)?;
    if poles.iter().all(|p| p.norm() <= LARGEST_RADIUS) {
        return Some(a.to_vec());
    }
    let inside: Vec<Complex<f64>> = poles
        .into_iter()
        .map(|p| {
            let radius = p.norm();
            let mirrored = if radius > 1.0 { 1.0 / radius } else { radius };
            p * (mirrored.min(LARGEST_RADIUS) / radius.max(f64::MIN_POSITIVE))
        })
        .collect();
    Some(linalg::polynomial(&inside))
}

/// Least squares on the impulse response itself, over the numerator and the denominator.
fn refine(k: &[f64], order: usize, start: &TransferFunction, factor: Option<&[f64]>) -> Option<TransferFunction> {
    let split = |p: &[f64]| -> Option<TransferFunction> {
        let a = std::iter::once(1.0).chain(p[order + 1..].iter().copied()).collect();
        TransferFunction::new(p[..=order].to_vec(), a).ok()
    };
    let evaluate = |p: &[f64]| {
        let model = split(p)?;
        let admissible = model.poles()?.iter().all(|z| z.norm() <= LARGEST_RADIUS);
        if !admissible {
            return None;
        }
        let response = model.impulse_response(k.len());
        // dh/db_i is 1/A delayed by i, dh/da_i is -B/A^2 delayed by i.
        let poles_only = TransferFunction::new(vec![1.0], model.a().to_vec()).ok()?;
        let by_numerator = poles_only.impulse_response(k.len());
        let by_denominator = poles_only.simulate(&response);
        let delayed = |v: &[f64], i: usize, sign: f64| -> Vec<f64> {
            std::iter::repeat_n(0.0, i.min(v.len()))
                .chain(v.iter().map(|x| sign * x))
                .take(v.len())
                .collect()
        };
        let columns = (0..=order)
            .map(|i| delayed(&by_numerator, i, 1.0))
            .chain((1..=order).map(|i| delayed(&by_denominator, i, -1.0)));
        let weighted = |d: Vec<f64>| match factor {
            None => d,
            Some(factor) => times_upper(factor, &d),
        };
        Some(Linearisation {
            residuals: weighted(response.iter().zip(k).map(|(h, k)| h - k).collect()),
            jacobian: columns.map(weighted).collect(),
        })
    };
    let parameters = start.b().iter().chain(&start.a()[1..]).copied().collect();
    split(&minimise(parameters, REALISATION_STEPS, evaluate)?.parameters)
}

/// U d for an upper triangular row-major U.
pub(super) fn times_upper(factor: &[f64], d: &[f64]) -> Vec<f64> {
    let rows = factor.chunks_exact(d.len()).enumerate();
    rows.map(|(i, row)| dot(&row[i..], &d[i..])).collect()
}

/// The singular values of the Hankel matrix of k_1, k_2, ...: for a system of order l without noise,
/// l of them differ from zero. At most `size` are computed.
fn hankel_singular_values(k: &[f64], size: usize) -> Option<Vec<f64>> {
    let size = size.min(k.len() / 2);
    if size == 0 {
        return Some(Vec::new());
    }
    let rows: Vec<f64> = (0..size).flat_map(|i| (0..size).map(move |j| k[1 + i + j])).collect();
    linalg::singular_values(&rows, size)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn system() -> TransferFunction {
        TransferFunction::new(vec![0.05, 0.08, 0.02], vec![1.0, -1.8, 0.95]).unwrap()
    }

    #[test]
    fn an_exact_impulse_response_gives_the_system_back() {
        let truth = system();
        let k = truth.impulse_response(100);
        for estimate in [yule_walker(&k, 2).unwrap(), from_impulse_response(&k, 2, None).unwrap()] {
            for (got, want) in estimate
                .a()
                .iter()
                .chain(estimate.b())
                .zip(truth.a().iter().chain(truth.b()))
            {
                assert!((got - want).abs() < 1e-9, "{estimate:?}");
            }
        }
    }

    #[test]
    fn refinement_beats_the_equations_under_noise() {
        let truth = system();
        let k = truth.impulse_response(150);
        let mut rng = rand_pcg::Pcg64::seed_from_u64(11);
        let distance = |g: &TransferFunction| -> f64 {
            g.impulse_response(150)
                .iter()
                .zip(&k)
                .map(|(a, b)| (a - b) * (a - b))
                .sum()
        };
        let (mut raw, mut refined) = (0.0, 0.0);
        for _ in 0..20 {
            let noisy: Vec<f64> = k.iter().map(|v| v + rng.random_range(-0.05..0.05)).collect();
            raw += distance(&yule_walker(&noisy, 2).unwrap());
            refined += distance(&from_impulse_response(&noisy, 2, None).unwrap());
        }
        // Five parameters of noise with variance 0.05^2/3 each, 20 times, is 0.083.
        assert!(refined < 0.2 && refined < 0.5 * raw, "{refined} {raw}");
    }

    #[test]
    fn always_stable() {
        let growing: Vec<f64> = (0..40).map(|i| 1.1_f64.powi(i)).collect();
        assert!(from_impulse_response(&growing, 1, None).unwrap().is_stable());
        assert!(from_impulse_response(&[1.0; 30], 1, None).unwrap().is_stable());
        assert!(from_impulse_response(&[0.0; 30], 2, None).unwrap().is_stable());
    }

    #[test]
    fn hankel_rank_is_the_order() {
        let s = hankel_singular_values(&system().impulse_response(200), 10).unwrap();
        assert!(s[1] > 0.1 && s[2] < 1e-9 * s[0], "{s:?}");
    }
}
