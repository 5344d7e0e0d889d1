//! Whether a model holds on fresh data, and what the user should know besides.

use super::limits::NEARLY_ALL;
use crate::linear::correlation::mean;
use crate::validation::{Estimated, FitMeasures, ResidualTest, ResidualTests};

/// Something that the user should know before trusting the model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// The input's samples depend on one another.
    #[error(
        "the input is not white (its largest autocorrelation is {largest:.2} at lag {lag}), which the paper's algorithm \
         assumes: the covariances were deconvolved and the other lags taken out of the regression, which is less exact"
    )]
    InputNotWhite {
        /// The largest autocorrelation in absolute value.
        largest: f64,
        /// Its lag.
        lag: usize,
    },
    /// The input takes few values.
    #[error(
        "the input has only {levels} levels: the nonlinearity is known at those and drawn straight between them{}",
        if *.levels == 2 { "; with two, it cannot be distinguished from a straight line" } else { "" }
    )]
    FewLevels {
        /// The number of distinct values.
        levels: usize,
    },
    /// The output does not seem to depend on the input.
    #[error(
        "the output shows no significant dependence on the input at lags 0 to {lags}: the model is not to be trusted"
    )]
    NoDependence {
        /// The last lag that was looked at.
        lags: usize,
    },
    /// The cross-validation score is best at the end of its range.
    #[error(
        "the cross-validation score is smallest at the edge of the bandwidths tried ({bandwidth}): the nonlinearity is constant, or rougher than the data resolve"
    )]
    BandwidthAtEdge {
        /// The bandwidth.
        bandwidth: f64,
    },
    /// The linear part was still far from settled at the last lag that the record allows.
    #[error(
        "the impulse response has not settled after {lags} samples, the most that this record allows: sample more slowly, or record for longer"
    )]
    NotSettled {
        /// The last lag that was used.
        lags: usize,
    },
    /// The static gain nearly vanishes, so that the linear part could not be scaled to a unit one.
    #[error(
        "the linear part's static gain nearly vanishes: its first coefficient is 1 instead, and the output's mean is kept as an offset"
    )]
    NoStaticGain,
    /// The fresh part's input leaves the range in which the nonlinearity was estimated.
    #[error(
        "{percent:.1} % of the fresh part's input lies outside the range [{low}, {high}] of the fit, where the curve is held at its end value"
    )]
    OutsideRange {
        /// Share of the fresh samples.
        percent: f64,
        /// Smallest input of the fit.
        low: f64,
        /// Largest input of the fit.
        high: f64,
    },
    /// The model predicts no better than the output's mean.
    #[error(
        "the free-run error on fresh data exceeds the output's own spread (fit {fit_percent:.1} %): the model explains nothing"
    )]
    Useless {
        /// The fit on fresh data.
        fit_percent: f64,
    },
    /// The input's samples depend on one another, which the refined estimate allows.
    #[error(
        "the input is not white (its largest autocorrelation is {largest:.2} at lag {lag}): the refined estimate does not \
         need it to be, but the blocks are separated less well"
    )]
    ColouredInput {
        /// The largest autocorrelation in absolute value.
        largest: f64,
        /// Its lag.
        lag: usize,
    },
    /// The refinement found nothing better than the plain estimate.
    #[error("the refinement did not lower the error of the plain estimate, which is returned without standard errors")]
    NotRefined,
    /// The score of an estimator without a bandwidth is best at the end of its range.
    #[error(
        "the cross-validation score is smallest at the edge of the values tried ({parameter} {value}): the nonlinearity is rougher than these resolve"
    )]
    ParameterAtEdge {
        /// The parameter's name.
        parameter: &'static str,
        /// Its value.
        value: f64,
    },
    /// There is little for a cascade's search to start from.
    #[error(
        "the best linear approximation explains only {percent:.1} % of the output's variance, from which a cascade's poles and \
         zeros are hardly known: give the input a mean where the nonlinearity is steep, or record for longer"
    )]
    WeakLinearApproximation {
        /// The share explained.
        percent: f64,
    },
}

/// The answer to "does the model hold?", on data that were not used for the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// How near the free-run prediction is.
    pub measures: FitMeasures,
    /// Tests of what it leaves behind; `None` if the fresh part is too short for them.
    pub residuals: Option<ResidualTests>,
    /// What the model was estimated from, where the tests allow for its own error.
    pub estimated: Option<Estimated>,
}

impl Verdict {
    /// Judges a free-run prediction of `y` under the input `u`.
    ///
    /// # Errors
    /// Those of [`FitMeasures::new`].
    pub fn new(u: &[f64], y: &[f64], predicted: &[f64]) -> crate::Result<Self> {
        Verdict::tested(y, predicted, |e| ResidualTests::with_prediction(e, u, predicted))
    }

    /// As [`Verdict::new`], for the prediction of a model that was estimated from other samples, whose parameters' own
    /// error the tests allow for.
    ///
    /// # Errors
    /// Those of [`FitMeasures::new`].
    pub fn of_estimate(u: &[f64], y: &[f64], predicted: &[f64], estimated: Estimated) -> crate::Result<Self> {
        let test = |e: &[f64]| ResidualTests::of_estimate(e, u, predicted, estimated);
        Ok(Verdict {
            estimated: Some(estimated),
            ..Verdict::tested(y, predicted, test)?
        })
    }

    /// The verdicts of several inputs, one an input and then one a pair of inputs; of an estimate, if `estimated` says from what.
    ///
    /// A pair stands for the product of its inputs' deviations from their means: what inputs do together, and none alone, does not
    /// turn up in a test with any one of them. All verdicts share the level of a single one.
    ///
    /// # Errors
    /// Those of [`FitMeasures::new`].
    pub fn of_inputs(
        inputs: &[&[f64]],
        y: &[f64],
        predicted: &[f64],
        estimated: Option<Estimated>,
    ) -> crate::Result<Vec<Self>> {
        let deviations: Vec<Vec<f64>> = (inputs.iter())
            .map(|u| {
                let centre = mean(u);
                u.iter().map(|u| u - centre).collect()
            })
            .collect();
        let pairs = (0..inputs.len()).flat_map(|i| (i + 1..inputs.len()).map(move |j| (i, j)));
        let products = pairs.map(|(i, j)| deviations[i].iter().zip(&deviations[j]).map(|(a, b)| a * b).collect());
        let tested: Vec<Vec<f64>> = inputs.iter().map(|u| u.to_vec()).chain(products).collect();
        let of = |u: &Vec<f64>| -> crate::Result<Verdict> {
            let test = |e: &[f64]| ResidualTests::among(e, u, predicted, estimated, tested.len());
            Ok(Verdict {
                estimated,
                ..Verdict::tested(y, predicted, test)?
            })
        };
        tested.iter().map(of).collect()
    }

    /// Of several verdicts on one prediction, the first with a test that refutes the model, else the first that does not hold, else
    /// the first.
    pub fn worst(verdicts: &[Verdict]) -> Option<&Verdict> {
        let refuted = verdicts.iter().find(|v| v.refutation().is_some());
        refuted
            .or_else(|| verdicts.iter().find(|v| !v.holds()))
            .or(verdicts.first())
    }

    fn tested(
        y: &[f64],
        predicted: &[f64],
        test: impl FnOnce(&[f64]) -> crate::Result<ResidualTests>,
    ) -> crate::Result<Self> {
        let measures = FitMeasures::new(y, predicted)?;
        let residual: Vec<f64> = y.iter().zip(predicted).map(|(y, p)| y - p).collect();
        Ok(Verdict {
            measures,
            residuals: test(&residual).ok(),
            estimated: None,
        })
    }

    /// The test that refutes the model of the system, if one does.
    pub fn refutation(&self) -> Option<&ResidualTest> {
        self.residuals.as_ref().and_then(ResidualTests::refutation)
    }

    /// Whether the model holds: it explains something, no test refutes it, and what it leaves is white noise, or at
    /// most a tenth of the output's variance.
    ///
    /// A large error with a colour of its own may be noise or something that the model misses: that no test
    /// finds the input in it does not say which.
    pub fn holds(&self) -> bool {
        self.measures.fit_percent > 0.0 && self.residuals.is_some() && self.refutation().is_none() && !self.is_open()
    }

    /// Whether the error is neither white nor small.
    fn is_open(&self) -> bool {
        let white = self
            .residuals
            .iter()
            .flat_map(|r| &r.tests)
            .all(|t| t.kind.refutes() || t.passed());
        !white && self.measures.r_squared < NEARLY_ALL
    }

    /// The answer as a heading.
    pub fn headline(&self) -> &'static str {
        match (self.holds(), &self.residuals) {
            (true, _) => "The model holds on fresh data",
            (false, None) => "Too few fresh data to judge the model",
            (false, Some(_)) if self.refutation().is_none() && self.measures.fit_percent > 0.0 => {
                "The fresh data do not refute the model, nor do they support it"
            }
            (false, Some(_)) if self.measures.r_squared >= 0.5 => {
                "The model explains most of the fresh data, but does not hold exactly"
            }
            (false, Some(_)) => "The model does not hold on fresh data",
        }
    }

    /// The answer in sentences.
    pub fn text(&self) -> String {
        let fit = self.measures.fit_percent;
        let explains = format!(
            "On fresh data the free-run fit is {fit:.1} % (it explains {:.1} % of the output's variance).",
            100.0 * self.measures.r_squared.max(0.0)
        );
        let Some(tests) = &self.residuals else {
            return format!(
                "{explains} The fresh part is too short for residual tests: whether the model holds is not known."
            );
        };
        if fit <= 0.0 {
            return format!(
                "The model does not hold: on fresh data it predicts no better than the output's mean (fit {fit:.1} %)."
            );
        }
        let white = tests.tests.iter().all(|t| t.kind.refutes() || t.passed());
        match tests.refutation() {
            Some(test) => format!(
                "{explains} The model does not hold exactly: the test '{}' rejects it at {} % (statistic {:.1}, limit {:.1}), \
                 so the error still carries something that the input explains: another structure, or the estimate's own error.",
                test.kind.name(),
                (1e4 * test.level).round() / 100.0,
                test.statistic,
                test.limit
            ),
            None if self.is_open() => format!(
                "{explains} No test refutes the model, but its error is large and not white. That is coloured \
                 noise or something that the model misses: these data do not show which."
            ),
            None if white => {
                format!("{explains} The model holds: no residual test finds anything that it leaves unexplained.")
            }
            None => format!(
                "{explains} The model holds: its error is independent of the input. It is not white, \
                 so the noise is coloured or enters before the linear part."
            ),
        }
    }
}
