//! `flexure identify`: a model from a record.

mod run;
mod stream;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::ValueEnum;
use flexure::identify::{AUTO, Calibration, HAMMERSTEIN, Options, RefinedHammerstein, Structure, structures};
use flexure::text::shown_path;
use flexure_io::{ModelFile, RecordFile, model_text};
use flexure_report::data::ArmMotion;
use flexure_workbench::fleet::{Outcome, joined, single_values};
use flexure_workbench::systems::{Identified, SystemColumns, Task, arm_motion};

use crate::arguments::{self, Auto, Usage};
use crate::columns::Connected;
use crate::experiments::Experiments;
use crate::method::{self, MethodName, PlainOptions, RefinedOptions};
use crate::output::quoted;
use crate::periods::PeriodOptions;
use crate::python::{self, Call};
use crate::reading::{resampled, with_resampling};
use crate::simulate::read_arm;
use crate::source::Source;
pub use run::{by_name, run};

/// Identify a block-oriented model from an input-output record.
///
/// The last quarter of the record is not used for the fit (see --fresh). The fit in percent, the RMS error and the
/// residual tests are about this part. If the record has only two signals, the first is the input and the second is the
/// output. If it has more signals, name the input and the output. A record is a text file with columns (such as CSV), a
/// Parquet, MAT or HDF5 file, or a topic of a ROS 2 bag.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  flexure identify record.csv --input u --output y -o model.json --report report.html"
)]
pub struct Arguments {
    /// The record. Several records are taken as experiments with one system. Only the refined method for Hammerstein
    /// models accepts several records. The end of the last record is then not used for the fit.
    #[arg(value_name = "RECORD", required = true)]
    records: Vec<PathBuf>,
    /// The column of the input, or A,B for several inputs. A record with only two signals needs no names.
    #[arg(long, value_name = "COLUMN")]
    input: Option<String>,
    /// The column of the output.
    #[arg(long, value_name = "COLUMN")]
    output: Option<String>,
    /// The structure of the model. For one input, hammerstein is tried first. If this model does not hold, the default is
    /// auto; with more than 50,000 fitted samples, linear if it predicts clearly better. For several inputs, the default
    /// is auto.
    #[arg(long, value_parser = arguments::structure())]
    structure: Option<&'static Structure>,
    /// The method for a Hammerstein model. The default is refined. If an option is given that only plain has, the
    /// default is plain.
    #[arg(long, value_enum)]
    method: Option<MethodName>,
    /// The order of the linear part of a Hammerstein model. With auto, it is chosen from the data.
    #[arg(long, value_name = "auto|N", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_order)]
    order: Auto<usize>,
    /// The delay of a Hammerstein model, in samples. With auto, it is chosen from the data.
    #[arg(long, value_name = "auto|N", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_count)]
    delay: Auto<usize>,
    /// The number of branches for --structure parallel, from 1 to 5. With auto, up to 3 branches are tried.
    #[arg(long, value_name = "auto|N", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_branches)]
    branches: Auto<usize>,
    /// The convention that fixes the scale between the two blocks of a Hammerstein model. The default is static-gain.
    #[arg(long, value_enum, conflicts_with = "known")]
    unit: Option<Unit>,
    /// Two known points of the nonlinearity: at the input X, its value is PHI. They fix its scale and its offset,
    /// instead of --unit.
    #[arg(long, value_name = "X=PHI", num_args = 2, allow_hyphen_values = true, value_parser = arguments::known_point)]
    known: Vec<[f64; 2]>,
    /// The share of the record that is not used for the fit. It is taken from the end of the record.
    #[arg(long, value_name = "SHARE", default_value = "0.25", allow_hyphen_values = true, value_parser = arguments::fresh_share)]
    fresh: f64,
    /// Do not use outliers of the output for the fit and the verdict. Without this option, outliers are only reported.
    #[arg(long)]
    robust: bool,
    /// Do not use samples whose output is missing (NaN or an empty field) for the fit and the verdict. Without this
    /// option, such samples are an error.
    #[arg(long)]
    missing: bool,
    /// The sample time in s. By default, it is taken from the time column. Without this column and this option, times
    /// are in samples.
    #[arg(long, value_name = "S", allow_hyphen_values = true, conflicts_with = "resample", value_parser = arguments::positive)]
    sample_time: Option<f64>,
    /// Write the model to this file.
    #[arg(short = 'o', long = "model", value_name = "MODEL.json")]
    model: Option<PathBuf>,
    /// Draw the arm in motion on the page of --report. This arm file gives the lengths of the links. The record needs
    /// the columns q1 and q2.
    #[arg(long, value_name = "ARM.toml", requires = "report")]
    arm: Option<PathBuf>,
    /// Write a page with all results to this file.
    #[arg(long, value_name = "REPORT.html")]
    report: Option<PathBuf>,
    /// Read the record in parts, for a Parquet file that is larger than memory. The file is read once for every step of
    /// the fit. The structure is hammerstein. The verdict is about the end of the last million samples.
    #[arg(long, conflicts_with_all = ["robust", "missing", "arm"])]
    stream: bool,
    #[command(flatten)]
    source: Source,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    periods: PeriodOptions,
    #[command(flatten)]
    refined: RefinedOptions,
    #[command(flatten)]
    plain: PlainOptions,
}

#[derive(Clone, Copy, ValueEnum)]
enum Unit {
    /// The static gain of the linear part is 1.
    StaticGain,
    /// The first coefficient of the linear part after the delay is 1.
    FirstCoefficient,
}

impl Arguments {
    /// The structure that was given, or the default for this number of inputs.
    fn structure(&self) -> &'static Structure {
        let several = self
            .input
            .as_deref()
            .is_some_and(|names| arguments::columns(names).len() > 1);
        self.structure.unwrap_or(if several { &AUTO } else { &HAMMERSTEIN })
    }

    /// The given options that both methods have.
    fn shared(&self) -> RefinedHammerstein {
        let calibration = match (self.known.as_slice(), self.unit.unwrap_or(Unit::StaticGain)) {
            ([p, q], _) => Calibration::TwoPoints {
                x: [p[0], q[0]],
                phi: [p[1], q[1]],
            },
            (_, Unit::StaticGain) => Calibration::UnitStaticGain,
            (_, Unit::FirstCoefficient) => Calibration::UnitFirstCoefficient,
        };
        RefinedHammerstein {
            order: self.order,
            delay: self.delay,
            calibration,
            fresh_share: self.fresh,
            ..Default::default()
        }
    }

    /// The inputs' columns, if they are named: one, or several for a structure with several inputs.
    fn inputs(&self) -> Option<Vec<&str>> {
        self.input
            .as_deref()
            .map(|names| match self.structure().has_several_inputs() {
                true => arguments::columns(names),
                false => vec![names],
            })
    }

    /// The given options that not every structure knows.
    fn given(&self) -> impl Iterator<Item = &'static str> {
        let given = [
            (self.branches.is_some(), "--branches"),
            (self.method.is_some(), "--method"),
            (self.order.is_some(), "--order"),
            (self.delay.is_some(), "--delay"),
            (self.unit.is_some(), "--unit"),
            (!self.known.is_empty(), "--known"),
        ];
        let own = given.into_iter().filter(|g| g.0).map(|g| g.1);
        own.chain(self.refined.first_given()).chain(self.plain.first_given())
    }

    /// What is to be done, and a note on the choice of the method.
    fn task(&self) -> Result<(Task, Option<String>)> {
        refuse_foreign(self.structure(), self.given())?;
        let (hammerstein, note) = method::choose(self.method, self.shared(), &self.refined, &self.plain)?;
        let options = Options {
            fresh_share: self.fresh,
            robust: self.robust,
            missing: self.missing,
            branches: self.branches,
            hammerstein,
        };
        let structure = self.structure();
        let or_another = self.is_default() && structure.name == HAMMERSTEIN.name;
        let task = Task {
            structure,
            options,
            or_another,
        };
        Ok((task, note))
    }

    /// Whether neither a structure nor a choice of one is given.
    fn is_default(&self) -> bool {
        self.structure.is_none() && self.given().next().is_none()
    }

    /// The task for a record whose output may miss samples that its preparation does not make up.
    fn of_prepared(&self, mut task: Task, file: &RecordFile, output: &str) -> Task {
        let misses = |y: &[f64]| y.iter().any(|y| y.is_nan());
        task.options.missing |= self.source.prepares() && file.column(output).is_ok_and(misses);
        task
    }

    /// The task for a record: without a given structure, linear dynamics where the output integrates the input, as no other structure has
    /// poles for that; then with a note.
    fn fitting(&self, task: Task, file: &RecordFile, columns: SystemColumns) -> (Task, Option<String>) {
        let integrated = self.is_default().then(|| Task::integrated(file, columns)).flatten();
        let Some(input) = integrated else {
            return (task, None);
        };
        let (path, output) = (quoted(&shown_path(&file.path)), columns.output);
        let [position, torque] = [output, input].map(quoted);
        let note = format!(
            "note: '{output}' integrates '{input}', so that the structure linear is taken; if they are a position and a torque or force: \
             flexure joint {path} --position {position} --torque {torque}"
        );
        let linear = Structure::by_name("linear").unwrap_or(task.structure);
        (
            Task {
                structure: linear,
                or_another: false,
                ..task
            },
            Some(note),
        )
    }

    /// Refuses options that are wrong for every record.
    pub fn check(&self) -> Result<()> {
        if let Some(inputs) = self.inputs() {
            arguments::distinct_inputs(&inputs, self.output.as_deref())?;
            check_input_count(self.structure(), inputs.len())?;
        }
        self.source.check()?;
        arguments::distinct_points(&self.known)?;
        self.task().map(|_| ())
    }

    /// The model of one record of many: the output of `--json` without lists, and the model file.
    pub fn of_file(&self, file: RecordFile) -> Result<Outcome> {
        let (task, _) = self.task()?;
        let (experiments, connected) = self.connected(file)?;
        let Experiments { file, sample_time, .. } = experiments;
        let columns = SystemColumns {
            inputs: &connected.inputs(),
            output: &connected.output,
        };
        let task = self.of_prepared(task, &file, columns.output);
        let (task, _) = self.fitting(task, &file, columns);
        let identified = task.identify(&file, columns, sample_time, &[], &|_| ControlFlow::Continue(()))?;
        let object = identified.json();
        let mut row = single_values(&object);
        row.push(("warnings".to_owned(), joined(&object["warnings"])));
        Ok(Outcome {
            row,
            model: model_text(&self.model(&identified), Path::new("model.json"))?,
        })
    }

    /// The files to write.
    fn outputs(&self) -> impl Iterator<Item = &PathBuf> {
        [&self.model, &self.report].into_iter().flatten()
    }

    /// Reads all experiments, of whose records `file` is the first, and finds the columns.
    fn connected(&self, file: RecordFile) -> Result<(Experiments, Connected)> {
        let columns = Connected::of_record(
            &file,
            self.source.reading.time_column(),
            self.inputs(),
            self.output.as_deref(),
        )?;
        check_input_count(self.structure(), columns.inputs.len())?;
        let experiments = match &self.records[1..] {
            [] => {
                let file = self.source.prepared(file, &columns.all(), &[&columns.output], None)?;
                Experiments {
                    sample_time: (self.source.reading)
                        .sample_time(&file, self.sample_time, &columns.all())
                        .map_err(|error| with_resampling(error, |step| resampled(step, &columns.inputs())))?,
                    samples: vec![file.record.len()],
                    file,
                }
            }
            others => Experiments::read(
                &self.source,
                file,
                others,
                &columns,
                self.sample_time,
                self.missing || self.source.prepares(),
            )?,
        };
        Ok((experiments, columns))
    }

    /// Python code that identifies the same model and writes its page; `None` where Python works differently.
    fn python(
        &self,
        file: &RecordFile,
        columns: SystemColumns,
        sample_time: Option<f64>,
        task: &Task,
    ) -> Option<String> {
        let is_plain = self.records.len() == 1 && self.source.is_usual() && self.periods.first_given().is_none();
        let reading = python::reading(file, &[columns.inputs, &[columns.output]].concat()).filter(|_| is_plain)?;
        let model = python::estimator(task.structure, &task.options)?.text();
        let fit = Call::new(".fit")
            .code("record")
            .with("input", Some(python::names(columns.inputs)))
            .with("output", Some(columns.output))
            .with("dt", sample_time);
        let report = Call::new("model.report").by_place(self.report.as_ref()?.to_str()?);
        Some(format!("{reading}model = {model}{}\n{}", fit.text(), report.text()))
    }

    /// The model file, which says how its record was read.
    fn model(&self, identified: &Identified) -> ModelFile {
        ModelFile {
            reading: self.source.kept(),
            ..identified.model()
        }
    }

    /// The arm in motion, for a record that has its angles.
    fn moving_arm(&self, file: &RecordFile, sample_time: Option<f64>) -> Result<Option<ArmMotion>> {
        let (lengths, known) = match &self.arm {
            Some(path) => (read_arm(path)?.arm.links.map(|link| link.length), ""),
            None => (
                [1.0; 2],
                " The links' lengths are not known (--arm tells them): they are drawn equal.",
            ),
        };
        let caption = format!("The record's angles, seen from above the plane of motion.{known}");
        Ok(arm_motion(&file.record, lengths, sample_time, caption))
    }
}

/// Refuses the first option that the structure does not know.
fn refuse_foreign(structure: &Structure, given: impl Iterator<Item = &'static str>) -> Result<(), Usage> {
    let knows = |structure: &Structure, option: &str| {
        let name = option.trim_start_matches('-').replace('-', "_");
        structure.options.contains(&name.as_str())
    };
    let mut foreign = given.filter(|option| !knows(structure, option));
    foreign.next().map_or(Ok(()), |option| {
        let others = structures().iter().filter(|s| knows(s, option));
        let names: Vec<&str> = others.map(|s| s.name.key).collect();
        let names = names.join(" or ");
        // A form is that of the curve between input and dynamics; the curves of other structures are on the page.
        let form = match option {
            "--form" => ". Other structures draw their curves on the page, without a form",
            _ => "",
        };
        Err(Usage(format!(
            "{option} is an option of --structure {names}, not of --structure {}; leave it out, or choose --structure {names}{form}",
            structure.name.key
        )))
    })
}

/// Refuses another number of inputs than the structure takes.
fn check_input_count(structure: &Structure, inputs: usize) -> Result<(), Usage> {
    if structure.inputs.contains(&inputs) {
        return Ok(());
    }
    let (least, most) = (structure.inputs.start(), structure.inputs.end());
    Err(Usage(format!(
        "--structure {} needs {least} to {most} inputs; name them by --input A,B, or choose another structure",
        structure.name.key
    )))
}
