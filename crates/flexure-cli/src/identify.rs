//! `flexure identify`: a model from a record.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::ValueEnum;
use flexure::identify::Calibration;
use flexure_io::{RecordFile, check_writable, read_record, write_atomically, write_model};
use flexure_report::data::ArmMotion;

use crate::arguments::{self, Auto};
use crate::estimate::Estimate;
use crate::method::{self, MethodName, PlainOptions, RefinedOptions, Shared};
use crate::outcome::{Context, identification_json, model_file, summary};
use crate::output::{command_line, print, print_note};
use crate::page::{self, Decoration};
use crate::progress::spinning;
use crate::simulate::read_arm;

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
    /// The method: refined unless an option of plain alone is given.
    #[arg(long, value_enum)]
    method: Option<MethodName>,
    /// Order of the linear part.
    #[arg(long, value_name = "auto|N", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_order)]
    order: Auto<usize>,
    /// Delay in samples.
    #[arg(long, value_name = "auto|N", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_count)]
    delay: Auto<usize>,
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
    #[command(flatten)]
    refined: RefinedOptions,
    #[command(flatten)]
    plain: PlainOptions,
}

#[derive(Clone, Copy, ValueEnum)]
enum Structure {
    /// A static nonlinearity, then linear dynamics.
    Hammerstein,
}

#[derive(Clone, Copy, ValueEnum)]
enum Unit {
    /// The linear part's static gain is 1.
    StaticGain,
    /// The linear part's first coefficient after the delay is 1.
    FirstCoefficient,
}

impl Arguments {
    /// What was given that both methods have.
    fn shared(&self) -> Shared {
        let Structure::Hammerstein = self.structure;
        let calibration = match (self.known.as_slice(), self.unit) {
            ([p, q], _) => Calibration::TwoPoints {
                x: [p[0], q[0]],
                phi: [p[1], q[1]],
            },
            (_, Unit::StaticGain) => Calibration::UnitStaticGain,
            (_, Unit::FirstCoefficient) => Calibration::UnitFirstCoefficient,
        };
        Shared {
            order: self.order.given(),
            delay: self.delay.given(),
            calibration,
            fresh_share: self.fresh,
        }
    }

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
    let (method, note) = method::choose(
        arguments.method,
        arguments.shared(),
        &arguments.refined,
        &arguments.plain,
    )?;
    for path in [&arguments.model, &arguments.report].into_iter().flatten() {
        check_writable(path)?;
    }
    if let Some(note) = note {
        print_note(&note);
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
pub fn identify(file: &RecordFile, context: &Context) -> Result<Estimate> {
    file.finite(context.input)?;
    if context.method.skips_missing() {
        file.column(context.output)?;
    } else {
        file.finite(context.output)?;
    }
    spinning("identifying", || {
        context.method.identify(&file.record, context.input, context.output)
    })
    .map_err(|error| file.locate(error).into())
}

/// Writes the model and the page, where asked for; neither if the page cannot be made.
pub fn write_files(
    file: &RecordFile,
    context: &Context,
    result: &Estimate,
    model: Option<&PathBuf>,
    report: Option<&PathBuf>,
    page: impl FnOnce(&RecordFile, &Context, &Estimate) -> Result<flexure_report::data::Page>,
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
