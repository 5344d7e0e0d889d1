//! One test of a residual: its limit, its p-value, and the size of what it sees.

use serde::{Deserialize, Serialize};

use crate::distributions::{chi_squared_above, chi_squared_quantile, fisher_above, fisher_quantile};
use crate::text::percent;

/// Beyond so many degrees of freedom Fisher's distribution is chi-squared.
const LARGE: f64 = 1e4;

/// What a test asks.
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
}

impl TestKind {
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
    /// The level at which `limit` rejects: this test's share of the joint level.
    pub level: f64,
    /// The size of what the test sees, whatever the number of samples: the share of the variance of the signal under test that its
    /// regression explains, less what it would explain by chance; from 0 to 1. It is $R^2$, adjusted for the number of regressors
    /// (Ezekiel 1930), where that signal is white. The signal is the residual; of
    /// [`SquaredIndependence`](TestKind::SquaredIndependence) the ranks of its squares.
    pub effect: f64,
}

/// What a test computed.
pub(super) struct Observed {
    /// Nearly chi-squared with `terms` degrees of freedom.
    pub statistic: f64,
    /// The number of squares in it.
    pub terms: usize,
    /// The share of the signal's variance that the fit has, chance included.
    pub explained: f64,
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
        // Of the statistic, `mean` comes about by chance. 1 - m/statistic times R^2 is the adjusted R^2.
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

    /// The share of the residual's variance that depends on what the test regresses on.
    ///
    /// It is the [`effect`](Self::effect), of squares its root: a part with the share s of a normal signal's variance has the share
    /// s^2 of its square's.
    pub fn dependent_share(&self) -> f64 {
        match self.kind {
            TestKind::SquaredIndependence => self.effect.sqrt(),
            _ => self.effect,
        }
    }

    /// How much depends on what, as the test sees it: "12 % of the error's variance depends on the input".
    pub fn finding(&self) -> String {
        let size = percent(self.effect);
        match self.kind {
            TestKind::Whiteness => format!("{size} of the error's variance follows from its own past"),
            TestKind::InputIndependence => format!("{size} of the error's variance depends on the input"),
            TestKind::SquaredInputIndependence => {
                format!("{size} of the error's variance depends on the squared input")
            }
            TestKind::CubedInputIndependence => {
                format!("{size} of the error's variance depends on the cubed input")
            }
            TestKind::SquaredIndependence => {
                format!("{size} of the variation of the error's size depends on the squared input")
            }
            TestKind::SquaredPredictionIndependence => {
                format!("{size} of the error's variance depends on the squared prediction")
            }
            TestKind::CubedPredictionIndependence => {
                format!("{size} of the error's variance depends on the cubed prediction")
            }
            TestKind::OutputFunctionIndependence => {
                format!("{size} of the error's variance follows from functions of the output's past")
            }
        }
    }

    /// Whether the hypothesis survived.
    pub fn passed(&self) -> bool {
        self.statistic <= self.limit
    }
}
