//! Tests of the residuals e = y - yh of a model on fresh data.
//!
//! - Whiteness (Ljung & Box 1978, with partial autocorrelations as Monti 1994): $Q = n(n+2) \sum_{k=1}^{M} \pi_k^2/(n-k)$
//!   is chi-squared with M degrees of freedom when e is white. A model of the system without one of the noise may well fail
//!   it. Plain autocorrelations depend on one another from lag to lag, which makes their sum's tail too heavy (2.6 % for
//!   a level of 1 % at n = 100, 1.4 % at n = 1000); partial ones hardly do (1.1 %).
//! - Independence of the input (Ljung 1999, section 16.6): with r the cross-covariances of v and w at lags
//!   0 to M, $\zeta = n\, r^T P^{-1} r$, $P_{ij} = \sum_k R_v(k) R_w(k + i - j)$, is chi-squared with M + 1
//!   degrees of freedom when v and w are independent, whatever the colour of either.
//! - Missed nonlinearity (Billings & Voon 1986): the same for the pairs e and u^2, e^2 and u^2, less
//!   their means, which see what the linear test is blind to.
//! - Missed nonlinearity in or after the dynamics, as in a Wiener or a feedback system: the same for e and the
//!   prediction's square and cube, less what is linear in the prediction. The prediction gathers the input's
//!   past over all of the memory, where no single u_{n-k}^2 says much.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use crate::error::{Error, Result};
use crate::linalg;
use crate::linear::correlation::{cross_covariance, mean, variance};

/// The level of every test: the probability that it rejects a true model.
pub const LEVEL: f64 = 0.01;
/// Lags of the tests, fewer on short records.
const LAGS: usize = 25;
/// Lags of the tests against the prediction, which has the input's past in it already.
const PREDICTION_LAGS: usize = 5;
/// The fewest samples that the asymptotic distributions are used for.
const FEWEST: usize = 40;

/// What a test asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TestKind {
    /// Is the residual white?
    Whiteness,
    /// Is the residual independent of the input's past?
    InputIndependence,
    /// Is the residual independent of the squared input's past?
    SquaredInputIndependence,
    /// Is the squared residual independent of the squared input's past?
    SquaredIndependence,
    /// Is the residual independent of the prediction's square?
    SquaredPredictionIndependence,
    /// Is the residual independent of the prediction's cube?
    CubedPredictionIndependence,
}

impl TestKind {
    /// A short name with the reference.
    pub fn name(self) -> &'static str {
        match self {
            TestKind::Whiteness => "residual whiteness (Ljung-Box, Monti)",
            TestKind::InputIndependence => "residual independent of input",
            TestKind::SquaredInputIndependence => "residual independent of squared input",
            TestKind::SquaredIndependence => "squared residual independent of squared input (Billings-Voon)",
            TestKind::SquaredPredictionIndependence => "residual independent of squared prediction",
            TestKind::CubedPredictionIndependence => "residual independent of cubed prediction",
        }
    }

    /// Whether a failure refutes the model of the system (and not only the assumption of white noise).
    pub fn refutes(self) -> bool {
        self != TestKind::Whiteness
    }
}

/// A test's outcome.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResidualTest {
    /// What was asked.
    pub kind: TestKind,
    /// Chi-squared under the hypothesis.
    pub statistic: f64,
    /// Its degrees of freedom.
    pub degrees: usize,
    /// The statistic above which the hypothesis is rejected at the level of 1 %.
    pub limit: f64,
    /// The probability of a statistic at least as large under the hypothesis.
    pub p_value: f64,
}

impl ResidualTest {
    fn new(kind: TestKind, statistic: f64, degrees: usize) -> Self {
        // Degrees of freedom are at least 1, for which the distribution always exists.
        let (limit, p_value) = match ChiSquared::new(degrees as f64) {
            Ok(chi) => (chi.inverse_cdf(1.0 - LEVEL), chi.sf(statistic)),
            Err(_) => (f64::NAN, f64::NAN),
        };
        ResidualTest {
            kind,
            statistic,
            degrees,
            limit,
            p_value,
        }
    }

    /// Whether the hypothesis survived.
    pub fn passed(&self) -> bool {
        self.statistic <= self.limit
    }
}

/// Normalised correlations for a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlations {
    /// Residual autocorrelation at lags 0 to M.
    pub residual: Vec<f64>,
    /// Correlation of e_{n+k} with u_n at lags k = -M to M.
    pub with_input: Vec<f64>,
    /// Half width of the interval that holds a single correlation of white signals with 99 %.
    pub limit: f64,
}

/// All tests of a residual.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualTests {
    /// The tests, whiteness first.
    pub tests: Vec<ResidualTest>,
    /// For a plot.
    pub correlations: Correlations,
}

impl ResidualTests {
    /// Tests the residual `e` of a model driven by `u`.
    ///
    /// A residual that is exactly constant passes: there is nothing left to explain.
    ///
    /// # Errors
    /// [`Error::LengthMismatch`]; [`Error::TooShort`] with fewer than 40 samples.
    pub fn new(e: &[f64], u: &[f64]) -> Result<Self> {
        if e.len() != u.len() {
            return Err(Error::LengthMismatch {
                name: "the residual".to_owned(),
                got: e.len(),
                expected: u.len(),
            });
        }
        let n = e.len();
        if n < FEWEST {
            return Err(Error::TooShort {
                what: "a residual test",
                need: FEWEST,
                got: n,
            });
        }
        let lags = LAGS.min(n / 5);
        let squared = |v: &[f64]| -> Vec<f64> {
            let centre = mean(v);
            v.iter().map(|x| (x - centre).powi(2)).collect()
        };
        let (e2, u2) = (squared(e), squared(u));
        let tests = vec![
            whiteness(e, lags),
            independence(TestKind::InputIndependence, e, u, lags),
            independence(TestKind::SquaredInputIndependence, e, &u2, lags),
            independence(TestKind::SquaredIndependence, &e2, &u2, lags),
        ];
        Ok(ResidualTests {
            tests,
            correlations: correlations(e, u, lags),
        })
    }

    /// As [`ResidualTests::new`], with the two tests against functions of the prediction besides.
    ///
    /// # Errors
    /// Those of [`ResidualTests::new`]; all three signals have the same length.
    pub fn with_prediction(e: &[f64], u: &[f64], predicted: &[f64]) -> Result<Self> {
        let mut all = Self::new(e, u)?;
        if predicted.len() != e.len() {
            return Err(Error::LengthMismatch {
                name: "the prediction".to_owned(),
                got: predicted.len(),
                expected: e.len(),
            });
        }
        for (kind, power) in [
            (TestKind::SquaredPredictionIndependence, 2),
            (TestKind::CubedPredictionIndependence, 3),
        ] {
            all.tests.push(independence(
                kind,
                e,
                &power_beyond_linear(predicted, power),
                PREDICTION_LAGS,
            ));
        }
        Ok(all)
    }

    /// The first test that refutes the model of the system, if any.
    pub fn refutation(&self) -> Option<&ResidualTest> {
        self.tests.iter().find(|t| t.kind.refutes() && !t.passed())
    }
}

/// The power of the centred signal, less its regression on the signal.
fn power_beyond_linear(signal: &[f64], power: i32) -> Vec<f64> {
    let (centre, spread) = (mean(signal), variance(signal).sqrt());
    if !(spread > 0.0) {
        return vec![0.0; signal.len()];
    }
    let z: Vec<f64> = signal.iter().map(|v| (v - centre) / spread).collect();
    let slope = z.iter().map(|z| z.powi(power + 1)).sum::<f64>() / z.len() as f64;
    z.iter().map(|z| z.powi(power) - slope * z).collect()
}

/// Monti's variant of the Ljung-Box test of `v` with `lags` lags.
pub(crate) fn whiteness(v: &[f64], lags: usize) -> ResidualTest {
    let n = v.len() as f64;
    let partial = partial_autocorrelations(&cross_covariance(v, v, lags));
    let terms = (partial.iter().enumerate()).map(|(k, p)| p * p / (n - (k + 1) as f64));
    ResidualTest::new(TestKind::Whiteness, n * (n + 2.0) * terms.sum::<f64>(), lags)
}

/// The partial autocorrelations at lags 1, 2, ... from covariances at lags 0, 1, ... (Levinson 1947, Durbin 1960).
///
/// They end early where the past determines the signal.
fn partial_autocorrelations(covariance: &[f64]) -> Vec<f64> {
    let (mut coefficients, mut partial): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut power = covariance[0];
    for k in 1..covariance.len() {
        if !(power > 0.0) {
            break;
        }
        let expected: f64 = coefficients
            .iter()
            .zip(covariance[..k].iter().rev())
            .map(|(a, c)| a * c)
            .sum();
        let next = ((covariance[k] - expected) / power).clamp(-1.0, 1.0);
        let mirrored: Vec<f64> = coefficients.iter().rev().copied().collect();
        coefficients.iter_mut().zip(mirrored).for_each(|(a, m)| *a -= next * m);
        coefficients.push(next);
        partial.push(next);
        power *= 1.0 - next * next;
    }
    partial
}

/// The test that the past of `w` says nothing about `v`.
fn independence(kind: TestKind, v: &[f64], w: &[f64], lags: usize) -> ResidualTest {
    let n = v.len();
    let scale = (variance(v) * variance(w)).sqrt();
    if !(scale > 0.0) {
        return ResidualTest::new(kind, 0.0, lags + 1);
    }
    let r: Vec<f64> = cross_covariance(w, v, lags).iter().map(|c| c / scale).collect();
    // The products' sum is cut where sample covariances are mostly noise; a triangular window keeps P
    // positive definite.
    let reach = ((n as f64).sqrt() as usize).clamp(lags, 20 * LAGS).min(n - 1 - lags);
    let rv = cross_covariance(v, v, reach);
    let rw = cross_covariance(w, w, reach + lags);
    let taper = |k: usize| 1.0 - k as f64 / (reach + 1) as f64;
    let entry = |difference: usize| -> f64 {
        let both_sides = |k: i64| -> f64 {
            let shifted = (k + difference as i64).unsigned_abs() as usize;
            rv[k.unsigned_abs() as usize] * taper(k.unsigned_abs() as usize) * rw[shifted]
        };
        (-(reach as i64)..=reach as i64).map(both_sides).sum::<f64>() / (scale * scale)
    };
    let column: Vec<f64> = (0..=lags).map(entry).collect();
    let size = lags + 1;
    let matrix: Vec<f64> = (0..size * size)
        .map(|k| column[(k / size).abs_diff(k % size)])
        .collect();
    let statistic = match linalg::solve_positive_definite(&matrix, &r) {
        Some(solution) => n as f64 * solution.iter().zip(&r).map(|(a, b)| a * b).sum::<f64>(),
        // A nearly singular P (a very narrow band): fall back on the sum of squares for white signals.
        None => n as f64 * r.iter().map(|c| c * c).sum::<f64>() / column[0].max(f64::MIN_POSITIVE),
    };
    ResidualTest::new(kind, statistic, size)
}

fn correlations(e: &[f64], u: &[f64], lags: usize) -> Correlations {
    let normalised = |c: Vec<f64>, scale: f64| -> Vec<f64> {
        c.into_iter()
            .map(|c| if scale > 0.0 { c / scale } else { 0.0 })
            .collect()
    };
    let both = (variance(e) * variance(u)).sqrt();
    let after = cross_covariance(u, e, lags);
    let before = cross_covariance(e, u, lags);
    let with_input = before.into_iter().skip(1).rev().chain(after).collect();
    let quantile = Normal::standard().inverse_cdf(1.0 - LEVEL / 2.0);
    Correlations {
        residual: normalised(cross_covariance(e, e, lags), variance(e)),
        with_input: normalised(with_input, both),
        limit: quantile / (e.len() as f64).sqrt(),
    }
}

#[cfg(test)]
#[path = "residuals_tests.rs"]
mod tests;
