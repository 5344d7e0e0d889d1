//! The Hammerstein system, identified by the paper's algorithm as it stands (sections VI and VII):
//! $$ W_n = \varphi(X_n) + \xi_n, \qquad Y_n = \sum_{j \ge 0} k_j W_{n-s-j} . $$
//!
//! For a white input X, $E(Y_{n+j} | X_n = x) = k_{j-s} \varphi(x) + \text{const}$, so the kernel regression of
//! output on input recovers phi up to scale and offset without knowing the linear part (16), and
//! $\mathrm{cov}(Y_{n+j}, \psi(X_n)) = k_{j-s}\,\mathrm{cov}(\varphi(X), \psi(X))$ is the impulse response up to scale.
//!
//! In order: delay, nonlinearity (21), impulse response by correlation, order and rational linear part,
//! calibration, verdict on fresh data. Consistent under Theorem 2 (Krzyzak 1990), but it pays for the
//! linear memory as if it were noise. The paper regresses at the delay ([`RegressionLag::Delay`]); by default
//! it is done at the lag of the strongest dependence, which has the least noise.
//!
//! The paper and the theorem assume a white input. Where the record's is not, the covariances are deconvolved
//! (Wiener-Hopf) and the other lags' share is taken out of the regression, a few times over, unless
//! [`PlainHammerstein::ignore_colour`] is set; the theorem says nothing of that.

mod calibration;
mod correlation;
pub(super) mod delay;
mod refined;

use super::checks::{must_vary, warn_of_colour, warn_of_levels, warn_of_range};
use super::outcome::{Identification, Verdict, Warning};
use crate::error::{Error, Result};
use crate::interrupt;
use crate::linear::TransferFunction;
use crate::linear::correlation::mean;
use crate::model::Block;
use crate::nonlinearity;
use crate::nonlinearity::{Curve, EstimatorName, Kernel, NamedEstimator, Outside, Scores, Tuning, tabulate};
use crate::record::Record;
use calibration::Calibrated;
pub use calibration::Calibration;
use correlation::{correlate, deconvolve, deconvolved_lags, less_other_lags, linear_part};
use delay::Dependence;
pub use refined::{
    Breakpoint, BreakpointKind, CoefficientErrors, Form, FormFit, FormParameter, MemoryRemoved, RefinedHammerstein,
    RefinedIdentification,
};

/// The fewest samples that are worth a fit.
pub const FEWEST: usize = 100;
/// The largest order that can be asked for.
pub const MOST_ORDER: usize = 50;
/// The largest order tried when it is chosen from data.
pub const LARGEST_ORDER: usize = 8;
/// Most lags of the impulse response.
const MOST_LAGS: usize = 1000;
/// The normal quantile of a two-sided 95 % band.
const BAND_QUANTILE: f64 = 1.959_963_984_540_054;
/// Most passes that take the other lags out of the regression, where the input is not white.
const PASSES: usize = 4;

/// More than this share of the impulse response beyond the last lag: it has not settled.
const UNSETTLED: f64 = 0.05;
/// A purpose of a part of the record, in [`Error::Data`]: `ConstantPart`.
const FOR_THE_FIT: &str = "used for the fit";

/// Which lag the output is regressed at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RegressionLag {
    /// The lag of the strongest dependence: every lag gives phi up to scale and offset, this one with
    /// the least noise.
    #[default]
    Strongest,
    /// The delay itself, as in the paper.
    Delay,
    /// A given lag.
    At(usize),
}

/// The paper's algorithm.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `estimator` | the estimator of the nonlinearity; the paper's is the kernel's, (21) | | kernel |
/// | `kernel` | weight function of (21) | | Epanechnikov |
/// | `parameter` | the estimator's tuning parameter; for (21) the bandwidth h | that of the estimator | leave-one-out cross-validation |
/// | `order` | order l of the linear part | 0 to 50 | Schwarz's criterion, 0 to 8 |
/// | `delay` | delay s in samples | below a quarter of the record | first significant dependence |
/// | `regression_lag` | lag of the regression | below a quarter of the record | the strongest dependence |
/// | `calibration` | convention for scale and offset | | unit static gain |
/// | `ignore_colour` | treat any input as white, as the paper does | | false |
/// | `fresh_share` | share at the record's end kept for the verdict | 0.05 to 0.9 | 0.25 |
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlainHammerstein {
    /// The estimator of the nonlinearity.
    pub estimator: EstimatorName,
    /// The weight function of an estimator with a kernel.
    pub kernel: Kernel,
    /// The estimator's tuning parameter, see [`EstimatorName::parameter`]; a bandwidth is in the input's unit.
    pub parameter: Option<f64>,
    /// The order of the linear part.
    pub order: Option<usize>,
    /// The delay in samples.
    pub delay: Option<usize>,
    /// The lag of the regression.
    pub regression_lag: RegressionLag,
    /// The convention for scale and offset.
    pub calibration: Calibration,
    /// Whether to treat an input that is not white as if it were.
    pub ignore_colour: bool,
    /// The share of the record that the verdict is made on.
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

/// The regression's result: the estimate m_n and its values at the samples.
pub(super) struct Regression {
    pub(super) fit: Box<dyn nonlinearity::Regression>,
    parameter: f64,
    scores: Option<Scores>,
    /// m_n(X_n) less its mean.
    pub(super) centred: Vec<f64>,
    pub(super) mean: f64,
}

impl PlainHammerstein {
    /// Identifies the system from `input` to `output`.
    ///
    /// # Errors
    /// [`Error::Data`]: `MissingColumn`, `NonFinite`, `Constant`, `ConstantPart` (the input
    /// over the samples of the fit, the output over those or over the fresh ones), `TooShort` (fewer than
    /// 100 samples for the fit), [`Error::Parameter`] for a parameter outside its range.
    pub fn identify(&self, record: &Record, input: &str, output: &str) -> Result<Identification> {
        let (u, y) = (record.finite(input)?, record.finite(output)?);
        let fitted = self.check(u.len())?;
        if fitted < FEWEST {
            return Err(Error::too_short(
                "a Hammerstein fit (besides the fresh part)",
                FEWEST,
                fitted,
            ));
        }
        must_vary(input, u, 0..fitted, FOR_THE_FIT)?;
        must_vary(output, y, 0..fitted, FOR_THE_FIT)?;
        must_vary(input, u, fitted..y.len(), "kept for the verdict")?;
        must_vary(output, y, fitted..y.len(), "kept for the verdict")?;
        self.run(u, y, fitted)
    }

    /// Checks the parameters; the number of samples to fit.
    fn check(&self, samples: usize) -> Result<usize> {
        let parameter = |name: &str, value: f64, valid: bool, requirement: &'static str| {
            if valid {
                Ok(())
            } else {
                Err(Error::parameter(name, value, requirement))
            }
        };
        parameter(
            "the fresh share",
            self.fresh_share,
            (0.05..=0.9).contains(&self.fresh_share),
            "between 0.05 and 0.9",
        )?;
        let fitted = samples - (self.fresh_share * samples as f64).round() as usize;
        let quarter = (fitted / 4).max(1);
        let below_quarter = "below a quarter of the number of samples that are fitted";
        if let Some(l) = self.order {
            parameter("the order", l as f64, l <= MOST_ORDER, "at most 50")?;
        }
        if let Some(s) = self.delay {
            parameter("the delay", s as f64, s < quarter, below_quarter)?;
        }
        if let RegressionLag::At(j) = self.regression_lag {
            parameter("the regression lag", j as f64, j < quarter, below_quarter)?;
        }
        self.calibration.check()?;
        Ok(fitted)
    }

    fn run(&self, u: &[f64], y: &[f64], fitted: usize) -> Result<Identification> {
        let (fit_u, fit_y) = (&u[..fitted], &y[..fitted]);
        let mut warnings = Vec::new();
        warn_of_levels(fit_u, &mut warnings);
        let coloured = warn_of_colour(fit_u, &mut warnings);

        // Delay and lag of the regression, from the cross-covariances.
        let given = match self.regression_lag {
            RegressionLag::At(j) => j.max(self.delay.unwrap_or(0)),
            _ => self.delay.unwrap_or(0),
        };
        let lags = MOST_LAGS.min(fitted / 5) + given;
        let dependence = Dependence::new(fit_u, fit_y, lags);
        let first = dependence.first();
        if first.is_none() {
            warnings.push(Warning::NoDependence { lags });
        }
        let strongest = dependence.strongest();
        let mut delay = self.delay.unwrap_or_else(|| first.unwrap_or(strongest));
        let mut lag = self.lag_of_regression(strongest, delay);

        // m_n, by (21), and the impulse response by correlation.
        let mut regression = self.regress(fit_u, fit_y, lag)?;
        let mut estimate = correlate(fit_u, fit_y, &regression, lags);
        let order = self.order.unwrap_or(LARGEST_ORDER);
        let window = deconvolved_lags(self.delay, strongest, order, fitted, lags);
        let corrected = coloured && !self.ignore_colour;
        if corrected && let Some(better) = deconvolve(fit_y, &regression.centred, window.clone()) {
            estimate = better;
            for _ in 0..PASSES {
                delay = self.delay.unwrap_or_else(|| estimate.first());
                let next_lag = self.lag_of_regression(estimate.strongest(), delay);
                let rest = less_other_lags(fit_y, &regression.centred, &estimate.k, next_lag);
                let next = self.regress(fit_u, &rest, next_lag)?;
                match deconvolve(fit_y, &next.centred, window.clone()) {
                    Some(better) if better.unexplained < estimate.unexplained => {
                        (regression, estimate, lag) = (next, better, next_lag);
                    }
                    _ => break,
                }
            }
            delay = self.delay.unwrap_or_else(|| estimate.first());
        }
        if regression.scores.as_ref().is_some_and(|s| s.at_edge) {
            warnings.push(match self.estimator {
                EstimatorName::Kernel => Warning::BandwidthAtEdge {
                    bandwidth: regression.parameter,
                },
                other => Warning::ParameterAtEdge {
                    parameter: other.parameter(),
                    value: regression.parameter,
                },
            });
        }

        // Its rational form.
        interrupt::check()?;
        let settled = estimate.settling_lag(delay);
        let last = estimate.k.len() - 1;
        let memory = settled.max(delay + 4 * order + 4).min(last);
        let (linear, order) = linear_part(&estimate, delay, memory, self.order, &regression.centred, fit_y)?;
        if settled > last || delay + linear.settling(UNSETTLED) > last {
            warnings.push(Warning::NotSettled { lags: last });
        }

        // Scale and offset by convention, then the verdict.
        interrupt::check()?;
        let calibrated = self.calibration.apply(
            &regression,
            &linear,
            estimate.gain_error(2 * order.order + 1),
            mean(fit_y),
            &mut warnings,
        )?;
        let Calibrated { gain, mean: level, .. } = calibrated;
        let (curve, errors) = tabulate(&*regression.fit, &fit_u[..fitted - lag], Outside::Nearest)?;
        let curve = curve.affine(gain, level - gain * regression.mean);
        let band = errors.iter().map(|e| BAND_QUANTILE * gain.abs() * e).collect();
        let linear = delayed(&linear, gain, delay)?;
        let mut blocks = vec![Block::Static(curve.clone()), Block::Linear(linear.clone())];
        if calibrated.output_offset != 0.0 {
            let offset = calibrated.output_offset;
            blocks.push(Block::Static(Curve::new(
                vec![0.0, 1.0],
                vec![offset, 1.0 + offset],
                Outside::Linear,
            )?));
        }
        let model = Block::Series(blocks);
        let predicted = model.simulate(u);
        let verdict = Verdict::new(&u[fitted..], &y[fitted..], &predicted[fitted..])?;
        warn_of_range(&curve, &u[fitted..], &mut warnings);
        if verdict.measures.fit_percent <= 0.0 {
            warnings.push(Warning::Useless {
                fit_percent: verdict.measures.fit_percent,
            });
        }
        Ok(Identification {
            model,
            nonlinearity: curve,
            band,
            output_offset: calibrated.output_offset,
            linear,
            delay,
            regression_lag: lag,
            estimator: self.estimator,
            kernel: self.kernel,
            parameter: regression.parameter,
            scores: regression.scores,
            order,
            impulse_estimate: estimate.k[..=memory].iter().map(|k| k / gain).collect(),
            impulse_limit: estimate.limit / gain.abs(),
            psi: estimate.psi,
            fitted,
            predicted,
            verdict,
            warnings,
        })
    }

    fn lag_of_regression(&self, strongest: usize, delay: usize) -> usize {
        match self.regression_lag {
            RegressionLag::Strongest => strongest.max(delay),
            RegressionLag::Delay => delay,
            RegressionLag::At(j) => j,
        }
    }

    /// Regresses Y_{n+lag} on X_n.
    fn regress(&self, u: &[f64], y: &[f64], lag: usize) -> Result<Regression> {
        let (x, y) = (&u[..u.len() - lag], &y[lag..]);
        let method = NamedEstimator {
            name: self.estimator,
            tuning: self
                .parameter
                .map_or_else(Tuning::default, |value| Tuning::Fixed(vec![value])),
            kernel: self.kernel,
            // Nothing is invented in the gaps of the paper's estimate.
            outside: match self.estimator {
                EstimatorName::Kernel => Outside::Nan,
                _ => Outside::Nearest,
            },
            ..NamedEstimator::default()
        };
        interrupt::check()?;
        let fit = method.fit(&[x], y, None)?;
        // The last samples of the input have no partner, and may lie out of reach of all others.
        let overall = fit
            .regression
            .kernel_fit()
            .map_or_else(|| mean(y), |fit| fit.data().mean);
        let mut centred: Vec<f64> = fit.regression.predict(&[u])?;
        centred.iter_mut().filter(|m| m.is_nan()).for_each(|m| *m = overall);
        let mean = mean(&centred);
        centred.iter_mut().for_each(|m| *m -= mean);
        Ok(Regression {
            fit: fit.regression,
            parameter: fit.parameter[0],
            scores: fit.scores,
            centred,
            mean,
        })
    }
}

/// The transfer function divided by a gain, after a delay.
fn delayed(linear: &TransferFunction, gain: f64, delay: usize) -> Result<TransferFunction> {
    let numerator = linear.b().iter().map(|b| b / gain);
    TransferFunction::new(
        std::iter::repeat_n(0.0, delay).chain(numerator).collect(),
        linear.a().to_vec(),
    )
}
