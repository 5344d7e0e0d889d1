//! `flexure identify`: a model from a record.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::ValueEnum;
use flexure::identify::{Calibration, Identification, PlainHammerstein, RegressionLag};
use flexure::nonlinearity::{EstimatorName, Kernel};
use flexure_io::{RecordFile, check_writable, read_record, write_atomically, write_model};
use flexure_report::data::ArmMotion;

use crate::arguments::{self, Auto, Usage};
use crate::outcome::{Context, identification_json, model_file, summary};
use crate::output::{command_line, print};
use crate::page::{self, Decoration};
use crate::progress::spinning;
use crate::simulate::read_arm;
use crate::tuning;

/// Identify a block-oriented model from an input-output record.
///
/// The last quarter of the record is kept from the fit; fit, RMS error and residual tests are those on it.
/// A record is CSV with a header, whitespace-separated columns without one (named c0, c1, ...), Parquet, or
/// MAT v5. Nothing has to be typed in but the two columns.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  flexure identify record.csv --input u --output y -o model.json --report report.html"
)]
pub struct Arguments {
    /// The record.
    record: PathBuf,
    /// The input's column.
    #[arg(long, value_name = "COLUMN")]
    input: String,
    /// The output's column.
    #[arg(long, value_name = "COLUMN")]
    output: String,
    /// The structure of the model.
    #[arg(long, value_enum, default_value = "hammerstein")]
    structure: Structure,
    /// The method: plain is the paper's, kernel regression and correlation.
    #[arg(long, value_enum, default_value = "plain")]
    method: Method,
    /// Order of the linear part.
    #[arg(long, value_name = "auto|N", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_order)]
    order: Auto<usize>,
    /// Delay in samples.
    #[arg(long, value_name = "auto|N", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_count)]
    delay: Auto<usize>,
    /// Lag of the regression of output on input: 'strongest' dependence, 'delay' (the paper's), or a number.
    #[arg(long, value_name = "strongest|delay|N", default_value = "strongest", allow_hyphen_values = true, value_parser = regression_lag)]
    lag: RegressionLag,
    /// Estimator of the nonlinearity: kernel (the paper's), local-linear, local-bandwidth, knn, fourier, cosine, legendre,
    /// hermite, haar, polynomial, spline, network or recursive.
    #[arg(long, value_name = "NAME", default_value = "kernel", value_parser = arguments::estimator)]
    nonlinearity: EstimatorName,
    /// Bandwidth of an estimator with a kernel, in the input's unit.
    #[arg(long, value_name = "auto|H", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_positive)]
    bandwidth: Auto<f64>,
    /// Tuning parameter of the other estimators: neighbours, terms, levels, degree, penalty or units.
    #[arg(long, value_name = "auto|P", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_number)]
    parameter: Auto<f64>,
    /// Kernel, epanechnikov unless given: uniform, triangular, epanechnikov, biweight, triweight or gaussian.
    #[arg(long, value_name = "NAME", value_parser = arguments::kernel)]
    kernel: Option<Kernel>,
    /// Treat the input as white, as the paper does, even where it is not.
    #[arg(long)]
    ignore_colour: bool,
    /// Convention for the scale between the blocks.
    #[arg(long, value_enum, default_value = "static-gain", conflicts_with = "known")]
    unit: Unit,
    /// A point at which the nonlinearity is known, twice: fixes scale and offset in place of --unit.
    #[arg(long, value_name = "X=PHI", num_args = 2, allow_hyphen_values = true, value_parser = arguments::known_point)]
    known: Vec<[f64; 2]>,
    /// Share of the record, at its end, kept from the fit.
    #[arg(long, value_name = "SHARE", default_value = "0.25", allow_hyphen_values = true, value_parser = arguments::fresh_share)]
    fresh: f64,
    /// Sample time in s; without it that of a column 't', if there is one that is neither input nor output.
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = arguments::positive)]
    sample_time: Option<f64>,
    /// Write the model here.
    #[arg(short = 'o', long = "model", value_name = "MODEL.json")]
    model: Option<PathBuf>,
    /// The arm's file, whose link lengths the page draws a record with the columns q1 and q2 with.
    #[arg(long, value_name = "ARM.toml", requires = "report")]
    arm: Option<PathBuf>,
    /// Write a page that shows everything here.
    #[arg(long, value_name = "REPORT.html")]
    report: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Structure {
    /// A static nonlinearity, then linear dynamics.
    Hammerstein,
}

#[derive(Clone, Copy, ValueEnum)]
enum Method {
    /// Kernel regression and correlation, as in the paper.
    Plain,
}

#[derive(Clone, Copy, ValueEnum)]
enum Unit {
    /// The linear part's static gain is 1.
    StaticGain,
    /// The linear part's first coefficient after the delay is 1.
    FirstCoefficient,
}

fn regression_lag(text: &str) -> Result<RegressionLag, String> {
    match text {
        "strongest" => Ok(RegressionLag::Strongest),
        "delay" => Ok(RegressionLag::Delay),
        _ => text
            .parse()
            .map(RegressionLag::At)
            .map_err(|_| "expected 'strongest', 'delay' or a whole number from 0".to_owned()),
    }
}

impl Arguments {
    fn method(&self) -> Result<PlainHammerstein, Usage> {
        let (option, name) = ("--nonlinearity", self.nonlinearity);
        tuning::check_kernel(option, name, self.kernel)?;
        let bandwidth = match self.bandwidth {
            Auto::Auto => Auto::Auto,
            Auto::Given(h) => Auto::Given(vec![h]),
        };
        let parameter = tuning::given(option, name, bandwidth, self.parameter)?;
        let Method::Plain = self.method;
        let Structure::Hammerstein = self.structure;
        let calibration = match (self.known.as_slice(), self.unit) {
            ([p, q], _) => Calibration::TwoPoints {
                x: [p[0], q[0]],
                phi: [p[1], q[1]],
            },
            (_, Unit::StaticGain) => Calibration::UnitStaticGain,
            (_, Unit::FirstCoefficient) => Calibration::UnitFirstCoefficient,
        };
        Ok(PlainHammerstein {
            estimator: name,
            kernel: self.kernel.unwrap_or_default(),
            parameter: parameter.map(|values| values[0]),
            order: self.order.given(),
            delay: self.delay.given(),
            regression_lag: self.lag,
            calibration,
            ignore_colour: self.ignore_colour,
            fresh_share: self.fresh,
        })
    }
}

impl Arguments {
    /// The arm in motion, for a record that has its angles.
    fn moving_arm(&self, file: &RecordFile, context: &Context) -> Result<Option<ArmMotion>> {
        let (lengths, known) = match &self.arm {
            Some(path) => (read_arm(path)?.arm.links.map(|link| link.length), ""),
            None => (
                [1.0; 2],
                " The links' lengths are not known (--arm tells them): they are drawn equal.",
            ),
        };
        let caption = format!("The record's angles, seen from above the plane of motion.{known}");
        Ok(page::arm_motion(&file.record, lengths, context.sample_time, caption))
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    arguments::distinct_columns(&arguments.input, &arguments.output)?;
    arguments::distinct_points(&arguments.known)?;
    let method = arguments.method()?;
    for path in [&arguments.model, &arguments.report].into_iter().flatten() {
        check_writable(path)?;
    }
    let file = spinning("reading", || read_record(&arguments.record))?;
    let context = Context {
        input: &arguments.input,
        output: &arguments.output,
        sample_time: arguments::sample_time(&file, arguments.sample_time, &[&arguments.input, &arguments.output])?,
        method,
    };
    let result = identify(&file, &context)?;
    let arm = arguments.moving_arm(&file, &context)?;
    let command = command_line(std::env::args_os().skip(1));
    write_files(
        &file,
        &context,
        &result,
        arguments.model.as_ref(),
        arguments.report.as_ref(),
        |file, context, result| {
            page::page(
                file,
                context,
                result,
                Decoration {
                    command: Some(command),
                    arm,
                    ..Decoration::default()
                },
            )
        },
    )?;
    if arguments.json {
        return print(&identification_json(&result, &context).to_string());
    }
    let written = [&arguments.model, &arguments.report].into_iter().flatten();
    let mut lines = vec![summary(&result, &context)];
    lines.extend(written.map(|path| format!("wrote {}", path.display())));
    print(&lines.join("\n"))
}

/// Identifies, and says in which file and line an error lies.
pub fn identify(file: &RecordFile, context: &Context) -> Result<Identification> {
    file.finite(context.input)?;
    file.finite(context.output)?;
    spinning("identifying", || {
        context.method.identify(&file.record, context.input, context.output)
    })
    .map_err(|error| file.locate(error).into())
}

/// Writes the model and the page, where asked for; neither if the page cannot be made.
pub fn write_files(
    file: &RecordFile,
    context: &Context,
    result: &Identification,
    model: Option<&PathBuf>,
    report: Option<&PathBuf>,
    page: impl FnOnce(&RecordFile, &Context, &Identification) -> Result<flexure_report::data::Page>,
) -> Result<()> {
    let rendered = match report {
        Some(path) => {
            let html = flexure_report::render(&page(file, context, result)?).context("the report")?;
            Some((path, html))
        }
        None => None,
    };
    if let Some(path) = model {
        write_model(path, &model_file(result, context))?;
    }
    if let Some((path, html)) = rendered {
        write_atomically(path, |out| out.write_all(html.as_bytes()))?;
    }
    Ok(())
}
