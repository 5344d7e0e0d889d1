//! One test of a residual: its limit, its p-value, and the size of the effect that it finds.

use serde::{Deserialize, Serialize};

use crate::distributions::{chi_squared_above, chi_squared_quantile, fisher_above, fisher_quantile};

/// From this number of degrees of freedom on, Fisher's distribution is taken as chi-squared.
const LARGE: f64 = 1e4;

/// The question of a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TestKind {
    /// Is the residual white?
    Whiteness,
    /// Is the residual independent of the input's past?
    InputIndependence,
    /// Is the residual independent of the squared input's past?
    SquaredInputIndependence,
    /// Is the residual independent of the cubed input's past?
    CubedInputIndependence,
    /// Is the squared residual independent of the squared input's past?
    SquaredIndependence,
    /// Is the residual independent of the prediction's square?
    SquaredPredictionIndependence,
    /// Is the residual independent of the prediction's cube?
    CubedPredictionIndependence,
    /// Is the residual independent of nonlinear functions of the output's past?
    OutputFunctionIndependence,
    /// Can no linear dynamics predict the residual from the input?
    DynamicsOfInput,
}

impl TestKind {
    /// What a failure shows, as a sentence: "its error depends on the input".
    pub fn dependence(self) -> &'static str {
        match self {
            TestKind::Whiteness => "its error is correlated in time",
            TestKind::InputIndependence => "its error depends on the input",
            TestKind::SquaredInputIndependence => "its error depends on the squared input",
            TestKind::CubedInputIndependence => "its error depends on the cubed input",
            TestKind::SquaredIndependence => "the size of its error depends on the squared input",
            TestKind::SquaredPredictionIndependence => "its error depends on the squared prediction",
            TestKind::CubedPredictionIndependence => "its error depends on the cubed prediction",
            TestKind::OutputFunctionIndependence => "its error depends on functions of the output's past",
            TestKind::DynamicsOfInput => "linear dynamics predict its error from the input",
        }
    }

    /// A short name with the reference.
    pub fn name(self) -> &'static str {
        match self {
            TestKind::Whiteness => "residual whiteness (Ljung-Box, Monti)",
            TestKind::InputIndependence => "residual independent of input",
            TestKind::SquaredInputIndependence => "residual independent of squared input",
            TestKind::CubedInputIndependence => "residual independent of cubed input",
            TestKind::SquaredIndependence => "squared residual independent of squared input (Billings-Voon)",
            TestKind::SquaredPredictionIndependence => "residual independent of squared prediction",
            TestKind::CubedPredictionIndependence => "residual independent of cubed prediction",
            TestKind::OutputFunctionIndependence => "residual independent of functions of the output's past",
            TestKind::DynamicsOfInput => "residual not predicted by linear dynamics",
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
    /// The question.
    pub kind: TestKind,
    /// Nearly chi-squared under the hypothesis.
    pub statistic: f64,
    /// Its degrees of freedom.
    pub degrees: usize,
    /// The statistic above which the hypothesis is rejected at [`level`](Self::level).
    pub limit: f64,
    /// The probability of a statistic at least as large under the hypothesis.
    pub p_value: f64,
    /// The level at which `limit` rejects: this test's share of the joint level.
    pub level: f64,
    /// The size of the effect that the test finds, from 0 to 1. It does not depend on the number of samples: it is the share of the
    /// signal's variance that the regression explains, minus the share that it would explain by chance. If the signal is white, it is
    /// $R^2$, adjusted for the number of regressors (Ezekiel 1930). The signal is the residual; for
    /// [`SquaredIndependence`](TestKind::SquaredIndependence) it is the ranks of its squares.
    pub effect: f64,
}

/// The values that a test computed.
pub(super) struct Observed {
    /// Nearly chi-squared with `terms` degrees of freedom.
    pub statistic: f64,
    /// The number of squares in it.
    pub terms: usize,
    /// The share of the signal's variance that the fit explains, including chance.
    pub explained: f64,
}

/// The size of a model's estimation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Estimated {
    /// The number of the model's parameters.
    pub parameters: usize,
    /// The samples that they were fitted to.
    pub samples: usize,
}

/// The amount that the parameters' own error adds to a sum of squares on fresh samples.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Inflation {
    /// The number of terms that it adds to.
    pub terms: f64,
    /// How much it adds to each.
    pub share: f64,
}

impl Estimated {
    /// The amount that the parameters' own error adds to this number of terms.
    pub(super) fn inflation(self, fresh: usize, terms: usize) -> Inflation {
        Inflation {
            terms: self.parameters.min(terms) as f64,
            share: fresh as f64 / self.samples.max(1) as f64,
        }
    }
}

impl ResidualTest {
    /// A sum of squares; see [`fisher`](Self::fisher).
    pub(super) fn chi_squared(kind: TestKind, observed: Observed, inflation: Inflation, level: f64) -> Self {
        Self::fisher(kind, observed, f64::INFINITY, inflation, level)
    }

    /// The statistic is the number of regressors times their F statistic, with `rest` degrees of freedom left.
    ///
    /// With the error of estimated parameters the sum of squares is a chi-squared variable with other degrees of freedom times
    /// a factor (Satterthwaite 1946).
    pub(super) fn fisher(kind: TestKind, observed: Observed, rest: f64, inflation: Inflation, level: f64) -> Self {
        let statistic = observed.statistic;
        let m = observed.terms as f64;
        let Inflation { terms, share } = inflation;
        let (mean, power) = (m + share * terms, m + terms * share * (2.0 + share));
        let degrees = mean * mean / power;
        let factor = mean / degrees;
        let (limit, p_value) = if rest < LARGE {
            let freedom = [degrees, rest];
            (
                mean * fisher_quantile(1.0 - level, freedom),
                fisher_above(statistic / mean, freedom),
            )
        } else {
            (
                factor * chi_squared_quantile(1.0 - level, degrees),
                chi_squared_above(statistic / factor, degrees),
            )
        };
        // The part `mean` of the statistic is due to chance. 1 - m/statistic times R^2 is the adjusted R^2.
        let beyond_chance = (1.0 - mean / statistic).max(0.0);
        ResidualTest {
            kind,
            statistic,
            degrees: observed.terms,
            limit,
            p_value,
            level,
            effect: observed.explained.clamp(0.0, 1.0) * beyond_chance,
        }
    }

    /// The share of the residual's variance that depends on the test's regressors.
    ///
    /// It is the [`effect`](Self::effect); for squares it is its root. A part with the share s of a normal signal's variance has the share
    /// s^2 of the variance of the square.
    pub fn dependent_share(&self) -> f64 {
        match self.kind {
            TestKind::SquaredIndependence => self.effect.sqrt(),
            _ => self.effect,
        }
    }

    /// Whether the test does not reject the hypothesis.
    pub fn passed(&self) -> bool {
        self.statistic <= self.limit
    }
}
