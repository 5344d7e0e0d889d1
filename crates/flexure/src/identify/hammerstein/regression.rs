//! Step 2: the nonlinearity up to scale and offset, equations (16) and (21), theorem 2.
//!
//! For a white input,
//! $$ m(x) = E(Y_{n+j} \mid X_n = x) = k_{j-s}\, \varphi(x) + \text{const}, \quad (16) $$
//! because the other terms of (17) do not depend on $X_n$. The coefficient is the paper's d1 for j = s = 0. The linear part need
//! not be known. The regression is estimated by
//! $$ m_n(x) = \frac{\sum_i Y_{i+j} K((x - X_i)/h)}{\sum_i K((x - X_i)/h)} \quad (21) $$
//! or by any other estimator of one variable; the quotient itself is in `nonlinearity/kernel/sums.rs`. Theorem 2: m_n(x)
//! converges to m(x) in probability for almost all x if h -> 0 (22) and n h -> infinity (23); the error is $O(n^{-p/(2p+1)})$ for phi and density Lipschitz of order p. It needs a stable linear part and
//! an output of finite variance, (18) to (20).

use super::options::PlainHammerstein;
use crate::error::Result;
use crate::identify::warning::Warning;
use crate::interrupt;
use crate::linear::correlation::mean;
use crate::nonlinearity::{EstimatorName, NamedEstimator, Outside, Regression, Scores, Tabulated, Tuning, tabulate};

/// The estimate m_n and its values at the samples.
pub(super) struct NonlinearityEstimate {
    fit: Box<dyn Regression>,
    /// The estimator's tuning parameter; for (21) the bandwidth h.
    pub parameter: f64,
    /// The cross-validation curve; `None` if the parameter was given.
    pub scores: Option<Scores>,
    /// m_n(X_n) minus its mean.
    pub centred: Vec<f64>,
    /// The mean of m_n(X_n).
    pub mean: f64,
}

impl NonlinearityEstimate {
    /// Regresses Y_{n+lag} on X_n.
    pub fn new(method: &PlainHammerstein, x: &[f64], y: &[f64], lag: usize) -> Result<NonlinearityEstimate> {
        let (partners, y) = (&x[..x.len() - lag], &y[lag..]);
        let estimator = NamedEstimator {
            name: method.estimator,
            tuning: (method.parameter).map_or_else(Tuning::default, |value| Tuning::Fixed(vec![value])),
            kernel: method.kernel,
            // Gaps of the paper's estimate stay empty.
            outside: match method.estimator {
                EstimatorName::Kernel => Outside::Nan,
                _ => Outside::Nearest,
            },
            ..NamedEstimator::default()
        };
        interrupt::check()?;
        let fit = estimator.fit(&[partners], y, None)?;
        // The last samples of the input have no output sample, and may be out of reach of all others.
        let overall = (fit.regression.kernel_fit()).map_or_else(|| mean(y), |fit| fit.data().mean);
        let mut centred: Vec<f64> = fit.regression.predict(&[x])?;
        centred.iter_mut().filter(|m| m.is_nan()).for_each(|m| *m = overall);
        let mean = mean(&centred);
        centred.iter_mut().for_each(|m| *m -= mean);
        Ok(NonlinearityEstimate {
            fit: fit.regression,
            parameter: fit.parameter[0],
            scores: fit.scores,
            centred,
            mean,
        })
    }

    /// m_n(x); NaN where there are no data.
    pub fn value(&self, x: f64) -> f64 {
        let m = self.fit.predict(&[&[x]]);
        m.ok().and_then(|m| m.first().copied()).unwrap_or(f64::NAN)
    }

    /// m_n as a table over the range of x, and its standard errors at the table's points.
    pub fn tabulated(&self, x: &[f64]) -> Result<Tabulated> {
        tabulate(&*self.fit, x, Outside::Nearest)
    }

    /// Warns if the tuning parameter is at the end of the searched range.
    pub fn warning(&self, estimator: EstimatorName) -> Option<Warning> {
        let at_edge = self.scores.as_ref().is_some_and(|s| s.at_edge);
        at_edge.then_some(match estimator {
            EstimatorName::Kernel => Warning::BandwidthAtEdge {
                bandwidth: self.parameter,
            },
            other => Warning::ParameterAtEdge {
                parameter: other.parameter(),
                value: self.parameter,
            },
        })
    }
}
