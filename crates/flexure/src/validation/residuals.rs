//! Tests of the residuals e = y - yh of a model on fresh data.
//!
//! - Whiteness (Ljung & Box 1978, with partial autocorrelations as Monti 1994): $Q = n(n+2) \sum_{k=1}^{M} \pi_k^2/(n-k)$
//!   is chi-squared with M degrees of freedom when e is white. A model of the system without one of the noise may well fail
//!   it. Plain autocorrelations depend on one another from lag to lag, which makes their sum's tail too heavy (2.6 % for
//!   a level of 1 % at n = 100, 1.4 % at n = 1000); partial ones hardly do (1.1 %).
//! - Independence of the input (Ljung 1999, section 16.6): the regression of v on lags 0 to M of w, both through the
//!   autoregression that whitens v, so that the colour of neither matters. Its F statistic times M + 1 (nearly chi-squared with
//!   M + 1 degrees of freedom) is Fisher's where w says nothing about a Gaussian v, exactly so if v is white.
//! - Missed nonlinearity (Billings & Voon 1986): the same for the pairs e and u^2, e^2 and u^2, less
//!   their means, which see what the linear test is blind to. Of e^2 the ranks are taken: its own tail is so heavy that the
//!   level would be 2 %.
//! - Missed nonlinearity in or after the dynamics, as in a Wiener or a feedback system: the same for e and the
//!   prediction's square and cube, less what is linear in the prediction. The prediction gathers the input's
//!   past over all of the memory, where no single u_{n-k}^2 says much.
//!
//! A model whose q parameters were estimated from N samples leaves, besides the noise, its own error, which on n fresh samples
//! is worth up to q n/N squared noise deviations more and depends on the input ([`Estimated`]). The limit of the test against
//! the input allows for it; the others hardly notice it.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal};

use crate::error::{Error, Result};
use crate::linear::correlation::{cross_covariance, mean, variance};
use crate::sort::order;

use super::regression::{Explained, Regression};
use super::whiteness::whiteness_of;

/// The level of every test: the probability that it rejects a true model. Each of the five that can refute one has it, so
/// that one of them does so in about 5 % of all cases (4.5 % with identified Hammerstein models of 2000 samples in the example
/// `levels`, white or coloured; 3.9 and 5.4 % with linear ones, the test against the input alone in 0.9 and 0.9 %, 2000 and
/// 1200 runs: as estimates by simulation error are made efficient where the noise is coloured. Without that it would be 5.2 %).
/// Not kept is the level by identified Wiener models of a nonlinearity with kinks under strong coloured noise: the tests against
/// the input and the prediction's cube reject 14 and 24 % (250 runs of 2000 samples; 0 and 2 % with white noise), perhaps because
/// the structure is chosen by the simulation error as it is. The
/// whiteness of an error after an identified noise model ([`ResidualTests::of_whitened`]) is rejected in 1.0 and 1.25 % where the
/// noise is autoregressive (n = 2000 and 8000, 800 runs each), and more often, in 2.25 and 2.4 %, where it is ARMA: no
/// finite autoregression makes that white, and the test tells so.
pub const LEVEL: f64 = 0.01;
/// Lags of the tests, fewer on short records.
const LAGS: usize = 25;
/// Lags of the tests against the prediction, which has the input's past in it already.
const PREDICTION_LAGS: usize = 5;
/// Beyond so many degrees of freedom Fisher's distribution is chi-squared.
const LARGE: f64 = 1e4;
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
    /// Nearly chi-squared under the hypothesis.
    pub statistic: f64,
    /// Its degrees of freedom.
    pub degrees: usize,
    /// The statistic above which the hypothesis is rejected at [`level`](Self::level).
    pub limit: f64,
    /// The probability of a statistic at least as large under the hypothesis.
    pub p_value: f64,
    /// The level at which `limit` rejects.
    pub level: f64,
}

/// What a model was estimated from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Estimated {
    /// The number of its parameters.
    pub parameters: usize,
    /// The samples that they were fitted to.
    pub samples: usize,
}

/// What the parameters' own error adds to a sum of squares on fresh samples.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Inflation {
    /// The number of terms that it adds to.
    pub terms: f64,
    /// How much it adds to each.
    pub share: f64,
}

impl Estimated {
    /// What the parameters' own error adds to so many terms.
    pub(super) fn inflation(self, fresh: usize, terms: usize) -> Inflation {
        Inflation {
            terms: self.parameters.min(terms) as f64,
            share: fresh as f64 / self.samples.max(1) as f64,
        }
    }
}

impl ResidualTest {
    /// A sum of `terms` squares; see [`fisher`](Self::fisher).
    pub(super) fn chi_squared(kind: TestKind, statistic: f64, terms: usize, inflation: Inflation, level: f64) -> Self {
        Self::fisher(kind, statistic, terms, f64::INFINITY, inflation, level)
    }

    /// `regressors` times the F statistic of as many, with `rest` degrees of freedom left.
    ///
    /// With the error of estimated parameters the sum of squares is a chi-squared variable with other degrees of freedom times
    /// a factor (Satterthwaite 1946).
    fn fisher(kind: TestKind, statistic: f64, regressors: usize, rest: f64, inflation: Inflation, level: f64) -> Self {
        let m = regressors as f64;
        let Inflation { terms, share } = inflation;
        let (mean, power) = (m + share * terms, m + terms * share * (2.0 + share));
        let degrees = mean * mean / power;
        let factor = mean / degrees;
        let (limit, p_value) = if rest < LARGE {
            match FisherSnedecor::new(degrees, rest) {
                Ok(fisher) => (mean * fisher.inverse_cdf(1.0 - level), fisher.sf(statistic / mean)),
                Err(_) => (f64::NAN, f64::NAN),
            }
        } else {
            match ChiSquared::new(degrees) {
                Ok(chi) => (factor * chi.inverse_cdf(1.0 - level), chi.sf(statistic / factor)),
                Err(_) => (f64::NAN, f64::NAN),
            }
        };
        ResidualTest {
            kind,
            statistic,
            degrees: regressors,
            limit,
            p_value,
            level,
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

/// Under what a residual is tested.
struct Conditions<'a> {
    predicted: Option<&'a [f64]>,
    /// What the model was estimated from.
    estimated: Option<Estimated>,
    /// What the autoregression that whitened the residual was estimated from.
    noise: Option<Estimated>,
    level: f64,
}

impl Default for Conditions<'_> {
    fn default() -> Self {
        Conditions {
            predicted: None,
            estimated: None,
            noise: None,
            level: LEVEL,
        }
    }
}

impl ResidualTests {
    /// Tests the residual `e` of a model driven by `u`.
    ///
    /// A residual that is exactly constant passes: there is nothing left to explain.
    ///
    /// # Errors
    /// [`Error::Data`]: `LengthMismatch`; `TooShort` with fewer than 40 samples.
    pub fn new(e: &[f64], u: &[f64]) -> Result<Self> {
        Self::all(e, u, &Conditions::default())
    }

    /// As [`ResidualTests::new`], with the two tests against functions of the prediction besides.
    ///
    /// # Errors
    /// Those of [`ResidualTests::new`]; all three signals have the same length.
    pub fn with_prediction(e: &[f64], u: &[f64], predicted: &[f64]) -> Result<Self> {
        Self::all(
            e,
            u,
            &Conditions {
                predicted: Some(predicted),
                ..Conditions::default()
            },
        )
    }

    /// As [`ResidualTests::with_prediction`], of a model that was estimated from other samples of the same kind.
    ///
    /// # Errors
    /// Those of [`ResidualTests::with_prediction`].
    pub fn of_estimate(e: &[f64], u: &[f64], predicted: &[f64], estimated: Estimated) -> Result<Self> {
        Self::all(
            e,
            u,
            &Conditions {
                predicted: Some(predicted),
                estimated: Some(estimated),
                ..Conditions::default()
            },
        )
    }

    /// As [`ResidualTests::of_estimate`], of errors that went through an autoregression which whitened the errors of other
    /// samples of the same kind: `noise` tells its order and how many those were, for the limit of the whiteness test.
    ///
    /// # Errors
    /// Those of [`ResidualTests::with_prediction`].
    pub fn of_whitened(
        e: &[f64],
        u: &[f64],
        predicted: &[f64],
        estimated: Estimated,
        noise: Estimated,
    ) -> Result<Self> {
        Self::all(
            e,
            u,
            &Conditions {
                predicted: Some(predicted),
                estimated: Some(estimated),
                noise: Some(noise),
                ..Conditions::default()
            },
        )
    }

    /// As [`ResidualTests::of_estimate`], or as [`ResidualTests::with_prediction`] without `estimated`, each test at the level
    /// of 1 % over `among`: the family's level then stays when one error is tested against so many inputs.
    pub(crate) fn among(
        e: &[f64],
        u: &[f64],
        predicted: &[f64],
        estimated: Option<Estimated>,
        among: usize,
    ) -> Result<Self> {
        Self::all(
            e,
            u,
            &Conditions {
                predicted: Some(predicted),
                estimated,
                level: LEVEL / among.max(1) as f64,
                ..Conditions::default()
            },
        )
    }

    fn all(e: &[f64], u: &[f64], conditions: &Conditions) -> Result<Self> {
        let Conditions {
            predicted,
            estimated,
            noise,
            level,
        } = *conditions;
        let n = u.len();
        let columns = [
            ("the residual", e.len()),
            ("the prediction", predicted.map_or(n, <[f64]>::len)),
        ];
        if let Some((name, got)) = columns.into_iter().find(|c| c.1 != n) {
            return Err(Error::length(name, got, n));
        }
        if n < FEWEST {
            return Err(Error::too_short("a residual test", FEWEST, n));
        }
        let lags = LAGS.min(n / 5);
        let squared = |v: &[f64]| -> Vec<f64> {
            let centre = mean(v);
            v.iter().map(|x| (x - centre).powi(2)).collect()
        };
        let (e2, u2) = (squared(e), squared(u));
        let [error, size] = [e, &ranks(&e2)].map(Regression::new);
        let mut tests = vec![
            whiteness_of(e, lags, noise, level),
            independence(TestKind::InputIndependence, &error, u, lags, estimated, level),
            independence(TestKind::SquaredInputIndependence, &error, &u2, lags, None, level),
            independence(TestKind::SquaredIndependence, &size, &u2, lags, None, level),
        ];
        if let Some(predicted) = predicted {
            for (kind, power) in [
                (TestKind::SquaredPredictionIndependence, 2),
                (TestKind::CubedPredictionIndependence, 3),
            ] {
                let beyond = power_beyond_linear(predicted, power);
                tests.push(independence(kind, &error, &beyond, PREDICTION_LAGS, None, level));
            }
        }
        Ok(ResidualTests {
            tests,
            correlations: correlations(e, u, lags),
        })
    }

    /// The first test that refutes the model of the system, if any.
    pub fn refutation(&self) -> Option<&ResidualTest> {
        self.tests.iter().find(|t| t.kind.refutes() && !t.passed())
    }
}

/// The rank of every value; equal ones share the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    for equal in order(&[values]).chunk_by(|&i, &j| values[i] == values[j]) {
        let rank = first as f64 + 0.5 * (equal.len() - 1) as f64;
        equal.iter().for_each(|&i| ranks[i] = rank);
        first += equal.len();
    }
    ranks
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

/// The test that the past of `w` says nothing about `v`.
fn independence(
    kind: TestKind,
    v: &Regression,
    w: &[f64],
    lags: usize,
    estimated: Option<Estimated>,
    level: f64,
) -> ResidualTest {
    let regressors = lags + 1;
    let Explained { share, rest } = v.explained_by_past(w, lags);
    let statistic = rest * share / (1.0 - share);
    let inflation = estimated.map(|from| from.inflation(v.samples(), regressors));
    ResidualTest::fisher(kind, statistic, regressors, rest, inflation.unwrap_or_default(), level)
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
