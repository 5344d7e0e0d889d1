//! The choices of a Hammerstein identification, for both methods.

use super::calibration::Calibration;
use super::refined::forms::PhysicalForm;
use crate::nonlinearity::{EstimatorName, Kernel};

/// A method for a Hammerstein system with the given choices; the other choices are made from the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HammersteinMethod {
    /// Prediction error over both blocks.
    Refined(RefinedHammerstein),
    /// The paper's.
    Plain(PlainHammerstein),
}

/// The paper's algorithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlainHammerstein {
    /// The estimator of the nonlinearity; by default the paper's, the kernel's of (21).
    pub estimator: EstimatorName,
    /// The weight function of an estimator with a kernel; by default Epanechnikov's.
    pub kernel: Kernel,
    /// The estimator's tuning parameter, see [`EstimatorName::parameter`]: for (21) the bandwidth h, in the input's unit. By default
    /// leave-one-out cross-validation chooses it.
    pub parameter: Option<f64>,
    /// The order l of the linear part, 0 to 50; by default 0 to 8, chosen by Schwarz's criterion.
    pub order: Option<usize>,
    /// The delay s in samples, below a quarter of the fitted ones; by default the first lag with a significant dependence.
    pub delay: Option<usize>,
    /// The lag of the regression; by default that of the strongest dependence.
    pub regression_lag: RegressionLag,
    /// The convention for scale and offset; by default unit static gain.
    pub calibration: Calibration,
    /// Whether to treat an input that is not white as if it were, as the paper does.
    pub ignore_colour: bool,
    /// The share of the record, at its end, that is used for the verdict, 0.05 to 0.9; by default 0.25.
    pub fresh_share: f64,
}

impl Default for PlainHammerstein {
    fn default() -> Self {
        PlainHammerstein {
            estimator: EstimatorName::Kernel,
            kernel: Kernel::default(),
            parameter: None,
            order: None,
            delay: None,
            regression_lag: RegressionLag::default(),
            calibration: Calibration::default(),
            ignore_colour: false,
            fresh_share: 0.25,
        }
    }
}

/// The refined identification of a Hammerstein system.
///
/// ```
/// use flexure::identify::RefinedHammerstein;
/// use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};
///
/// let [linear, _] = known_linear_parts();
/// let system = KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear);
/// let result = RefinedHammerstein::default().identify(&system.simulate(20_000, 2), "u", "y")?;
/// assert_eq!((result.delay, result.order), (0, 2));
/// assert_eq!(result.detail("breakpoints").unwrap().list().len(), 2); // the dead zone's two kinks
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefinedHammerstein {
    /// The order of the linear part, 0 to 50; by default 0 to 8, chosen by Schwarz's criterion.
    pub order: Option<usize>,
    /// The delay s in samples, below a quarter of the fitted ones; by default the first clear lag.
    pub delay: Option<usize>,
    /// The convention for scale and offset; by default unit static gain.
    pub calibration: Calibration,
    /// The estimator of the nonlinearity for the start of the refinement; by default the kernel estimator, as in (21).
    pub start: EstimatorName,
    /// Whether to whiten the output error by an autoregression; by default it is.
    pub noise_model: bool,
    /// The form to fit to the nonlinearity and to test.
    pub form: Option<PhysicalForm>,
    /// The share of the samples, at their end, that is used for the verdict, 0.05 to 0.9; by default 0.25.
    pub fresh_share: f64,
}

impl Default for RefinedHammerstein {
    fn default() -> Self {
        RefinedHammerstein {
            order: None,
            delay: None,
            calibration: Calibration::default(),
            start: EstimatorName::Kernel,
            noise_model: true,
            form: None,
            fresh_share: 0.25,
        }
    }
}

/// The lag at which the output is regressed on the input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RegressionLag {
    /// The lag of the strongest dependence: every lag gives phi up to scale and offset; this one has the least noise.
    #[default]
    Strongest,
    /// The delay itself, as in the paper.
    Delay,
    /// A given lag.
    At(usize),
}

impl RegressionLag {
    /// The lag, if the dependence is strongest at `strongest`.
    pub(super) fn resolve(self, strongest: usize, delay: usize) -> usize {
        match self {
            RegressionLag::Strongest => strongest.max(delay),
            RegressionLag::Delay => delay,
            RegressionLag::At(j) => j,
        }
    }
}
