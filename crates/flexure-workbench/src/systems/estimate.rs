//! What was identified, by whichever method: what the methods have in common, and what is one's own.

use flexure::identify::{Breakpoint, BreakpointKind};
use flexure::identify::{
    ChosenOrder, CoefficientErrors, FormFit, Identification, MemoryRemoved, PhysicalForm, PlainHammerstein, Psi,
    RefinedHammerstein, RefinedIdentification, Verdict, Warning,
};
use flexure::linear::TransferFunction;
use flexure::nonlinearity::{Curve, EstimatorName, Kernel, Scores};
use flexure::{Block, Record, Result};

use crate::text::number;

/// Breakpoints of one kind up to so many are told one by one.
const MOST_TOLD: usize = 6;

/// A method with the choices that were given; the others are made from data.
pub enum Method {
    /// Prediction error over both blocks, and the form to fit to the nonlinearity, if any.
    Refined {
        /// The method.
        method: RefinedHammerstein,
        /// The form, if one was asked for.
        form: Option<PhysicalForm>,
    },
    /// The paper's.
    Plain(PlainHammerstein),
}

impl Method {
    /// Its name on the command line and in files.
    pub fn name(&self) -> &'static str {
        match self {
            Method::Refined { .. } => "refined",
            Method::Plain(_) => "plain",
        }
    }

    /// The order, if it was given.
    pub fn order(&self) -> Option<usize> {
        match self {
            Method::Refined { method, .. } => method.order,
            Method::Plain(method) => method.order,
        }
    }

    /// The delay, if it was given.
    pub fn delay(&self) -> Option<usize> {
        match self {
            Method::Refined { method, .. } => method.delay,
            Method::Plain(method) => method.delay,
        }
    }

    /// Whether NaN in the output are missing samples.
    pub fn skips_missing(&self) -> bool {
        matches!(self, Method::Refined { method, .. } if method.missing)
    }

    /// Identifies the system from `input` to `output`.
    pub fn identify(&self, record: &Record, input: &str, output: &str) -> Result<Estimate> {
        match self {
            Method::Plain(method) => method.identify(record, input, output).map(Estimate::from_plain),
            Method::Refined { method, form } => Self::of_experiments(method, *form, &[record], input, output),
        }
    }

    /// Identifies one system by the refined method from several experiments, each with an initial state of its own.
    pub fn of_experiments(
        method: &RefinedHammerstein,
        form: Option<PhysicalForm>,
        records: &[&Record],
        input: &str,
        output: &str,
    ) -> Result<Estimate> {
        let result = method.identify_experiments(records, input, output)?;
        let form = form.map(|form| result.fit_form(form)).transpose()?;
        Ok(Estimate::from_refined(result, form))
    }
}

/// An identified model with all that was chosen on the way; the fields are those of [`Identification`].
pub struct Estimate {
    /// Both blocks in series, with the offset.
    pub model: Block,
    /// The static nonlinearity.
    pub nonlinearity: Curve,
    /// Half the width of its band at each of its points; empty if there is none.
    pub band: Vec<f64>,
    /// The linear part.
    pub linear: TransferFunction,
    /// What is added to the output.
    pub output_offset: f64,
    /// Samples.
    pub delay: usize,
    /// The order of the linear part, and how it was chosen.
    pub order: ChosenOrder,
    /// The samples that were fitted.
    pub fitted: usize,
    /// The free run over the record.
    pub predicted: Vec<f64>,
    /// How the model does on the samples that were not fitted.
    pub verdict: Verdict,
    /// What to know before trusting it.
    pub warnings: Vec<Warning>,
    /// What only this method has.
    pub own: Own,
}

/// What only one method has.
pub enum Own {
    /// Of the plain method.
    Plain(Plain),
    /// Of the refined method.
    Refined(Refined),
}

/// What only the plain method has; the fields are those of [`Identification`].
pub struct Plain {
    pub regression_lag: usize,
    pub estimator: EstimatorName,
    pub kernel: Kernel,
    pub parameter: f64,
    pub scores: Option<Scores>,
    pub impulse_estimate: Vec<f64>,
    pub impulse_limit: f64,
    pub psi: Psi,
}

/// What only the refined method has; the fields are those of [`RefinedIdentification`].
pub struct Refined {
    pub linear_errors: CoefficientErrors,
    pub breakpoints: Vec<Breakpoint>,
    pub memory_removed: MemoryRemoved,
    pub noise_model: Vec<f64>,
    pub noise: f64,
    pub refined: bool,
    /// The form that was asked for.
    pub form: Option<FormFit>,
}

impl Estimate {
    fn from_plain(result: Identification) -> Self {
        Estimate {
            model: result.model,
            nonlinearity: result.nonlinearity,
            band: result.band,
            linear: result.linear,
            output_offset: result.output_offset,
            delay: result.delay,
            order: result.order,
            fitted: result.fitted,
            predicted: result.predicted,
            verdict: result.verdict,
            warnings: result.warnings,
            own: Own::Plain(Plain {
                regression_lag: result.regression_lag,
                estimator: result.estimator,
                kernel: result.kernel,
                parameter: result.parameter,
                scores: result.scores,
                impulse_estimate: result.impulse_estimate,
                impulse_limit: result.impulse_limit,
                psi: result.psi,
            }),
        }
    }

    /// Of a refined identification, and the form that was fitted to its nonlinearity.
    pub fn from_refined(result: RefinedIdentification, form: Option<FormFit>) -> Self {
        Estimate {
            model: result.model,
            nonlinearity: result.nonlinearity,
            band: result.band,
            linear: result.linear,
            output_offset: result.output_offset,
            delay: result.delay,
            order: result.order,
            fitted: result.fitted,
            predicted: result.predicted,
            verdict: result.verdict,
            warnings: result.warnings,
            own: Own::Refined(Refined {
                linear_errors: result.linear_errors,
                breakpoints: result.breakpoints,
                memory_removed: result.memory_removed,
                noise_model: result.noise_model,
                noise: result.noise,
                refined: result.refined,
                form,
            }),
        }
    }

    /// The samples of the record that are neither fitted nor judged, as their output is missing.
    pub fn missing_fresh(&self) -> usize {
        self.predicted.len() - self.fitted - self.verdict.measures.samples
    }

    /// The lower (`sign` -1) or upper (1) edge of the nonlinearity's band; empty if there is none.
    pub fn band_edge(&self, sign: f64) -> Vec<f64> {
        let points = self.nonlinearity.y().iter().zip(&self.band);
        points.map(|(y, b)| y + sign * b).collect()
    }
}

/// A breakpoint's kind in one word.
pub fn kind_name(kind: BreakpointKind) -> &'static str {
    match kind {
        BreakpointKind::Value => "jump",
        BreakpointKind::Slope => "kink",
        BreakpointKind::ThirdDerivative => "knot",
    }
}

impl Refined {
    /// Where the nonlinearity breaks, for reading: "kinks at -1.000, 1.000".
    pub fn breakpoint_words(&self) -> String {
        let kinds = [
            BreakpointKind::Value,
            BreakpointKind::Slope,
            BreakpointKind::ThirdDerivative,
        ];
        let told = kinds.map(|kind| {
            let at: Vec<String> = (self.breakpoints.iter())
                .filter(|b| b.kind == kind)
                .map(|b| number(b.at))
                .collect();
            let name = kind_name(kind);
            match at.len() {
                0 => String::new(),
                1 => format!("{name} at {}", at[0]),
                n if n <= MOST_TOLD && kind != BreakpointKind::ThirdDerivative => {
                    format!("{name}s at {}", at.join(", "))
                }
                n => format!("{n} {name}s"),
            }
        });
        let told: Vec<String> = told.into_iter().filter(|t| !t.is_empty()).collect();
        match told.is_empty() {
            true => "no breakpoint".to_owned(),
            false => told.join("; "),
        }
    }

    /// The noise model for reading.
    pub fn noise_words(&self) -> String {
        match self.noise_model.len() {
            0 | 1 => "taken as white".to_owned(),
            n => format!("whitened by an autoregression of order {}", n - 1),
        }
    }
}

/// The parameters of a form for reading, each with its standard error where it has one.
pub fn form_parameters(fit: &FormFit) -> String {
    let told = fit.parameters.iter().map(|p| match standard_error(p.error) {
        Some(error) => format!("{} = {} ± {}", p.name, number(p.value), number(error)),
        None if p.error == 0.0 => format!("{} = {}", p.name, number(p.value)),
        None => format!("{} not determined", p.name),
    });
    told.collect::<Vec<_>>().join(", ")
}

/// A standard error, if it is one: neither the 0 of what has none nor the infinity of what the data do not determine.
pub fn standard_error(error: f64) -> Option<f64> {
    (error > 0.0 && error.is_finite()).then_some(error)
}

/// The test of a form for reading.
pub fn form_verdict(fit: &FormFit) -> String {
    let verdict = match fit.holds() {
        true => "the data do not refute this form",
        false => "the data refute this form at 1 %",
    };
    let p = match fit.p_value {
        p if p < 0.001 => "p < 0.001".to_owned(),
        p => format!("p = {p:.3}"),
    };
    format!(
        "{verdict} (lack of fit {:.1}, limit {:.1}, {} degrees of freedom, {p})",
        fit.statistic, fit.limit, fit.degrees
    )
}
