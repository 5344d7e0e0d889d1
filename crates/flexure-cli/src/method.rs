//! The method of `flexure identify`, and the options that belong to one method alone.

use clap::ValueEnum;
use flexure::identify::{HammersteinMethod, PhysicalForm, PlainHammerstein, RefinedHammerstein, RegressionLag};
use flexure::nonlinearity::{EstimatorName, Kernel};
use flexure_workbench::systems::form;

use crate::arguments::{self, Auto, Usage};
use crate::tuning;

/// A method by name.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum MethodName {
    /// Minimise the prediction error over both blocks. Breakpoints, noise model and standard errors come from the data.
    Refined,
    /// The method of the paper on which Flexure is based: kernel regression and correlation.
    Plain,
}

/// The options of the refined method alone.
#[derive(clap::Args)]
#[command(next_help_heading = "Options of --method refined")]
pub struct RefinedOptions {
    /// Fit a nonlinearity of this form, and test whether this form suffices: dead-zone, saturation, limited-dead-zone,
    /// quantizer, polynomial:N (N is the degree, from 1 to 15), friction or stiffness.
    #[arg(long, value_name = "FORM", value_parser = form)]
    form: Option<PhysicalForm>,
    /// The estimator of the nonlinearity from which the refinement starts. The default is kernel.
    #[arg(long, value_name = "NAME", value_parser = arguments::estimator())]
    start: Option<EstimatorName>,
}

/// The options of the plain method alone.
#[derive(clap::Args)]
#[command(next_help_heading = "Options of --method plain (each of these options selects it)")]
pub struct PlainOptions {
    /// The lag of the regression of the output on the input, in samples. The default is strongest: the lag of the
    /// strongest dependence. With delay, it is the delay of the model, as in the paper.
    #[arg(long, value_name = "strongest|delay|N", allow_hyphen_values = true, value_parser = regression_lag)]
    lag: Option<RegressionLag>,
    /// The estimator of the nonlinearity. The default is kernel, as in the paper.
    #[arg(long, value_name = "NAME", value_parser = arguments::estimator())]
    nonlinearity: Option<EstimatorName>,
    /// The bandwidth of an estimator with a kernel, in the unit of the input. The default is auto: it is chosen from
    /// the data.
    #[arg(long, value_name = "auto|H", allow_hyphen_values = true, value_parser = arguments::auto_positive)]
    bandwidth: Option<Auto<f64>>,
    /// The tuning parameter of an estimator without a kernel: its neighbours, terms, levels, degree, penalty or units.
    /// The default is auto: it is chosen from the data.
    #[arg(long, value_name = "auto|P", allow_hyphen_values = true, value_parser = arguments::auto_number)]
    parameter: Option<Auto<f64>>,
    /// The kernel: uniform, triangular, epanechnikov, biweight, triweight or gaussian. The default is epanechnikov.
    #[arg(long, value_name = "NAME", value_parser = arguments::kernel)]
    kernel: Option<Kernel>,
    /// Treat the input as white, as the paper does, even if it is not white.
    #[arg(long)]
    ignore_colour: bool,
}

/// The method with its options, and a note on the choice for the user; `shared` has the options of both methods.
pub fn choose(
    name: Option<MethodName>,
    shared: RefinedHammerstein,
    refined: &RefinedOptions,
    plain: &PlainOptions,
) -> Result<(HammersteinMethod, Option<String>), Usage> {
    let other = |option: &str, its: &str, chosen: &str| {
        Usage(format!(
            "{option} is an option of --method {its}, not of --method {chosen}; leave it out, or choose --method {its}"
        ))
    };
    let (name, note) = match (name, refined.first_given(), plain.first_given()) {
        (Some(MethodName::Refined), _, Some(option)) => return Err(other(option, "plain", "refined")),
        (Some(MethodName::Plain), Some(option), _) => return Err(other(option, "refined", "plain")),
        (None, Some(r), Some(p)) => {
            return Err(Usage(format!(
                "{r} is an option of --method refined, {p} one of --method plain; leave one of them out"
            )));
        }
        (None, None, Some(option)) => {
            let note = format!("note: {option} implies --method plain; the default is --method refined");
            (MethodName::Plain, Some(note))
        }
        (name, ..) => (name.unwrap_or(MethodName::Refined), None),
    };
    let method = match name {
        MethodName::Refined => refined.method(shared),
        MethodName::Plain => HammersteinMethod::Plain(plain.method(shared)?),
    };
    Ok((method, note))
}

impl RefinedOptions {
    /// The first of these options that was given.
    pub fn first_given(&self) -> Option<&'static str> {
        let given = [(self.form.is_some(), "--form"), (self.start.is_some(), "--start")];
        given.into_iter().find(|g| g.0).map(|g| g.1)
    }

    fn method(&self, shared: RefinedHammerstein) -> HammersteinMethod {
        HammersteinMethod::Refined(RefinedHammerstein {
            start: self.start.unwrap_or(EstimatorName::Kernel),
            form: self.form,
            ..shared
        })
    }
}

impl PlainOptions {
    /// The first of these options that was given.
    pub fn first_given(&self) -> Option<&'static str> {
        let given = [
            (self.lag.is_some(), "--lag"),
            (self.nonlinearity.is_some(), "--nonlinearity"),
            (self.bandwidth.is_some(), "--bandwidth"),
            (self.parameter.is_some(), "--parameter"),
            (self.kernel.is_some(), "--kernel"),
            (self.ignore_colour, "--ignore-colour"),
        ];
        given.into_iter().find(|g| g.0).map(|g| g.1)
    }

    fn method(&self, shared: RefinedHammerstein) -> Result<PlainHammerstein, Usage> {
        let (option, name) = ("--nonlinearity", self.nonlinearity.unwrap_or(EstimatorName::Kernel));
        tuning::check_kernel(option, name, self.kernel)?;
        let bandwidth = self.bandwidth.flatten().map(|h| vec![h]);
        let parameter = tuning::given(option, name, bandwidth, self.parameter.flatten())?;
        Ok(PlainHammerstein {
            estimator: name,
            kernel: self.kernel.unwrap_or_default(),
            parameter: parameter.map(|values| values[0]),
            order: shared.order,
            delay: shared.delay,
            regression_lag: self.lag.unwrap_or(RegressionLag::Strongest),
            calibration: shared.calibration,
            ignore_colour: self.ignore_colour,
            fresh_share: shared.fresh_share,
        })
    }
}

fn regression_lag(text: &str) -> Result<RegressionLag, String> {
    match text {
        "strongest" => Ok(RegressionLag::Strongest),
        "delay" => Ok(RegressionLag::Delay),
        _ => match arguments::count(text) {
            Ok(lag) => Ok(RegressionLag::At(lag)),
            Err(_) => Err("expected 'strongest', 'delay' or a whole number from 0".to_owned()),
        },
    }
}
