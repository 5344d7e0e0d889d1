//! The Hammerstein system by the method of the paper (Krzyzak & Sasiadek, sections VI and VII).
//!
//! **Model.** A memoryless nonlinearity phi is followed by a linear system with memory. The signal W between them is never observed:
//! $$ W_n = \varphi(X_n) + \xi_n \quad (14), \qquad Y_n = \sum_{j \ge 0} k_j W_{n-s-j} \quad (17). $$
//! X is white with any distribution, xi is white noise with zero mean, and the linear system is stable. The delay s is zero in the
//! paper.
//!
//! **Method.** The two blocks are estimated one after the other. Each step has its own file.
//!
//! | file | estimates | in the paper |
//! |---|---|---|
//! | `delay.rs` | the delay s | |
//! | `regression.rs` | phi up to scale and offset: the regression m of output on input | (16), (21), theorem 2 |
//! | `correlation.rs` | the impulse response k up to scale | (17), section VII |
//! | `realisation.rs` | the order l and the coefficients a and b | (15) and the ARMA model of section VI |
//! | `calibration.rs` | the scale d1 and the offset alpha | section VII, before (21) |
//! | `colour.rs` | both blocks if the input is not white | |
//! | `details.rs` | what a reader is shown of these steps | |
//! | `limits.rs` | all thresholds | |
//! | `refined/` | both blocks at once by prediction error, with these estimates as the start | |
//!
//! Every equation and theorem of the paper, and the file that has it:
//!
//! | in the paper | what | file |
//! |---|---|---|
//! | (1) to (3) | Lagrange's equations, from which (4) to (9) follow | |
//! | (4) to (6) | the rigid arm | `manipulator/links.rs`, `manipulator/dynamics.rs` |
//! | (7), (8) | the arm with flexible joints | `manipulator/dynamics.rs` |
//! | (9) | the matrix S, by its one element | `manipulator/arm.rs`, `Arm::coupling` |
//! | (10) to (12) | a joint's stiffness and friction | `manipulator/joint.rs` |
//! | (7) to (12) | the same of any chain | `manipulator/chain/drives.rs` |
//! | (13), theorem 1 | the kernel estimate of independent pairs | `nonlinearity/kernel/mod.rs`; the quotient: `nonlinearity/kernel/sums.rs` |
//! | (13), (21) with d > 1 | in several columns; in a system with several inputs | `nonlinearity/kernel/product/`; `identify/surface/` |
//! | (14), (17) | the Hammerstein system | above |
//! | (15) | its linear part | `realisation.rs` |
//! | (16), (21) to (23), theorem 2 | the kernel estimate of the system's nonlinearity | `regression.rs` |
//! | (18) to (20) | its conditions: a stable linear part, phi(X) of finite variance | `regression.rs` |
//! | both theorems | their rates, measured | `study/rates.rs` |
//!
//! **Accuracy.** The estimate of phi is consistent by theorem 2 (Krzyzak 1990). It treats the linear part's memory as noise, so its
//! error is several times that of [`RefinedHammerstein`].

mod calibration;
mod colour;
mod correlation;
pub(super) mod delay;
mod details;
mod limits;
pub(super) mod options;
mod realisation;
mod refined;
mod regression;

use super::checks::{self, both_vary, fresh_part, warn_if_useless, warn_of_levels, warn_of_range};
use super::outcome::Verdict;
use super::request::{Options, Progress, Rank, Request, Structure};
use super::result::{Identification, ImpulseEstimate, LinearBlock, StaticBlock, StructureName};
use super::run::{Run, announce, path};
use super::samples::Samples;
use super::warning::Warning;
use crate::error::{Error, Result};
use crate::interrupt;
use crate::linear::TransferFunction;
use crate::linear::correlation::mean;
use crate::quantiles::NORMAL_95;
use crate::record::Record;
pub use calibration::Calibration;
use calibration::{Calibrated, Uncalibrated};
use delay::Lags;
pub use limits::{FEWEST_SAMPLES, LARGEST_ORDER, MOST_ORDER};
pub use options::{HammersteinMethod, PlainHammerstein, RefinedHammerstein, RegressionLag};
use realisation::Realisation;
pub use refined::{MOST_DEGREE, PhysicalForm, ShardPoint, ShardSums, ShardedHammerstein};
use regression::NonlinearityEstimate;

/// What the band of a kernel estimate allows for.
const VARIANCE_ONLY: &str = "95 % pointwise, variance only";

/// The identification of a Hammerstein system, by either method.
pub const HAMMERSTEIN: Structure = Structure {
    name: StructureName {
        key: "hammerstein",
        title: "Hammerstein",
    },
    description: "a static nonlinearity, then linear dynamics",
    inputs: 1..=1,
    options: &[
        "method",
        "order",
        "delay",
        "unit",
        "known",
        "form",
        "start",
        "lag",
        "nonlinearity",
        "bandwidth",
        "parameter",
        "kernel",
        "ignore_colour",
    ],
    rank: Some(Rank::TwoBlocks),
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    announce("refining on all samples", progress)?;
    match &request.options.hammerstein {
        HammersteinMethod::Plain(method) => method.identified(request),
        HammersteinMethod::Refined(method) => method.identified(request),
    }
}

/// Both blocks up to scale and offset.
struct Estimate {
    /// The delay s.
    delay: usize,
    /// The lag j of the regression of Y_{n+j} on X_n.
    regression_lag: usize,
    /// m_n, the nonlinearity.
    regression: NonlinearityEstimate,
    /// k_j, the linear part.
    response: correlation::ImpulseResponse,
}

impl PlainHammerstein {
    /// Identifies the system from `input` to `output`.
    ///
    /// # Errors
    /// [`Error::Data`]: `MissingColumn`, `NonFinite`, `Constant`, `ConstantPart` (the input
    /// over the samples of the fit, the output over those or over the fresh ones), `TooShort` (fewer than
    /// 100 samples for the fit), [`Error::Parameter`] for a parameter outside its range.
    pub fn identify(&self, record: &Record, input: &str, output: &str) -> Result<Identification> {
        let (records, inputs) = ([record], [input]);
        let options = Options::with_method(HammersteinMethod::Plain(*self));
        self.identified(&Request::new(&records, &inputs, output, options))
    }

    fn identified(&self, request: &Request<'_>) -> Result<Identification> {
        let (record, input) = (request.record()?, request.input()?);
        let (u, y) = (record.finite(input)?, request.outputs()?);
        let fitted = self.check(u.len())?;
        both_vary(&[(input, u), (request.output, y)], fitted)?;
        let (x, y_fit) = (&u[..fitted], &y[..fitted]);
        let mut warnings = Vec::new();
        warn_of_levels(x, &mut warnings);
        let colour = checks::colour(x);
        warnings.extend(colour.as_ref().map(|c| Warning::InputNotWhite {
            largest: c.largest,
            lag: c.lag,
        }));

        let lags = Lags::find(self, x, y_fit, &mut warnings);
        let mut estimate = self.estimate_from_white_input(x, y_fit, &lags)?;
        if colour.is_some() && !self.ignore_colour {
            estimate = colour::corrected(self, x, y_fit, &lags, estimate)?;
        }
        warnings.extend(estimate.regression.warning(self.estimator));
        let realised = realisation::realise(&estimate, self.order, y_fit, &mut warnings)?;
        let calibrated = self.calibrate(&estimate, &realised, y_fit)?;
        warnings.extend(calibrated.warning.clone());
        self.outcome(
            request,
            &Samples {
                u: vec![u],
                y,
                fitted,
                present: request.present()?,
            },
            &estimate,
            &realised,
            &calibrated,
            warnings,
        )
    }

    /// Checks the parameters and the record's length. Returns the number of samples to fit.
    fn check(&self, samples: usize) -> Result<usize> {
        let fitted = fresh_part(self.fresh_share, samples)?;
        let quarter = (fitted / 4).max(1);
        let below_quarter = "below a quarter of the number of samples that are fitted";
        let given_lag = match self.regression_lag {
            RegressionLag::At(j) => Some(j),
            _ => None,
        };
        for (name, value, most, requirement) in [
            ("the order", self.order, MOST_ORDER, "at most 50"),
            ("the delay", self.delay, quarter - 1, below_quarter),
            ("the regression lag", given_lag, quarter - 1, below_quarter),
        ] {
            if let Some(value) = value.filter(|v| *v > most) {
                return Err(Error::parameter(name, value as f64, requirement));
            }
        }
        self.calibration.check()?;
        if fitted < FEWEST_SAMPLES {
            return Err(Error::too_short(
                "a Hammerstein fit (besides the fresh part)",
                FEWEST_SAMPLES,
                fitted,
            ));
        }
        Ok(fitted)
    }

    /// The regression (21) at the chosen lag, and the impulse response (17) by correlation.
    fn estimate_from_white_input(&self, x: &[f64], y: &[f64], lags: &Lags) -> Result<Estimate> {
        let regression = NonlinearityEstimate::new(self, x, y, lags.regression)?;
        let response = correlation::correlate(x, y, &regression.centred, lags.last);
        Ok(Estimate {
            delay: lags.delay,
            regression_lag: lags.regression,
            regression,
            response,
        })
    }

    /// The scale d1 and the offset alpha.
    fn calibrate(&self, estimate: &Estimate, realised: &Realisation, y: &[f64]) -> Result<Calibrated> {
        interrupt::check()?;
        self.calibration.apply(&Uncalibrated {
            nonlinearity: &|x| estimate.regression.value(x),
            mean: estimate.regression.mean,
            linear: &realised.linear,
            gain_error: estimate.response.gain_error(2 * realised.order.order + 1),
            output_mean: mean(y),
        })
    }

    /// The calibrated blocks, the free run over the whole record, and the verdict on its fresh part.
    fn outcome(
        &self,
        request: &Request<'_>,
        samples: &Samples<'_>,
        estimate: &Estimate,
        realised: &Realisation,
        calibrated: &Calibrated,
        mut warnings: Vec<Warning>,
    ) -> Result<Identification> {
        let (u, y, fitted) = (samples.input(), samples.y, samples.fitted);
        let (gain, output_offset) = (calibrated.gain, calibrated.output_offset);
        let m = estimate.regression.tabulated(&u[..fitted - estimate.regression_lag])?;
        let curve = m.curve.affine(gain, calibrated.mean - gain * estimate.regression.mean);
        let linear = delayed(realised.linear.b(), realised.linear.a(), gain, estimate.delay)?;
        warn_of_range(&curve, &u[fitted..], true, &mut warnings);
        let response = &estimate.response;
        let mut curve = StaticBlock {
            band: (m.standard_errors.iter()).map(|e| NORMAL_95 * gain.abs() * e).collect(),
            band_label: VARIANCE_ONLY,
            ..StaticBlock::new(curve, self.estimator.title())
        };
        curve.description += &format!(", {}", self.tuning_text(estimate.regression.parameter));
        let linear = LinearBlock {
            system: linear,
            errors: None,
            impulse: Some(ImpulseEstimate {
                values: response.k[..=realised.memory].iter().map(|k| k / gain).collect(),
                limit: response.limit / gain.abs(),
            }),
        };
        let path = path(request, details::named(curve, linear));
        let model = path.model(output_offset);
        let predicted = model.simulate(u);
        let verdict = Verdict::new(&samples.fresh(u), &samples.fresh(y), &samples.fresh(&predicted))?;
        warn_if_useless(&verdict, &mut warnings);
        let run = Run {
            model,
            paths: vec![path],
            output_offset,
            fitted,
            predicted,
            verdicts: vec![verdict],
            warnings,
        };
        Ok(Identification {
            method: "plain".into(),
            order: realised.order.order,
            delay: estimate.delay,
            details: self.details(estimate, &realised.order, request.input()?),
            ..run.identification(&HAMMERSTEIN, request)?
        })
    }
}

/// z^-delay b / (gain a).
fn delayed(b: &[f64], a: &[f64], gain: f64, delay: usize) -> Result<TransferFunction> {
    let numerator = b.iter().map(|b| b / gain);
    TransferFunction::new(std::iter::repeat_n(0.0, delay).chain(numerator).collect(), a.to_vec())
}
