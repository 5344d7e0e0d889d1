//! How a record is read, and where its sample instants stand.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Result, anyhow, bail};
use clap::ValueEnum;
use flexure::error::DataError;
use flexure::text::{decimal, exact, shown_path};
use flexure_io::{Decimal, Instants, ReadOptions, RecordFile, TimeColumn};
use flexure_workbench::look::NOTED_JITTER;

use crate::arguments;
use crate::output::{print_note, quoted, this_command};
use crate::progress::spinning;

/// Relative difference of two sample times that still count as the same.
pub const SAME_SAMPLE_TIME: f64 = 1e-3;

/// The heading of the options in [`Reading`], which clap passes on to the options behind them.
pub const HEADING: &str = "Reading the record";

/// The options that say how to read a file where the file itself leaves it open.
#[derive(clap::Args)]
#[command(next_help_heading = HEADING)]
pub struct Reading {
    /// The separator of the columns. By default, it is the one that divides all lines into equally many fields.
    #[arg(long, value_name = "NAME")]
    separator: Option<Separator>,
    /// The decimal sign of the numbers. You need this option only if a comma may also group thousands, as in 1,250.
    #[arg(long, value_name = "SIGN")]
    decimal: Option<DecimalSign>,
    /// Whether the first line contains the names of the columns. By default, it does if it is text and numbers stand
    /// below it.
    #[arg(long, value_name = "yes|no")]
    header: Option<Answer>,
    /// Skip the first N lines of the file, which stand above the table.
    #[arg(long, value_name = "N")]
    skip_lines: Option<u64>,
    /// The time column: it contains the sample instants. By default, it is the column called t, time, timestamp or
    /// similar, such as "Time [s]" or time_ms.
    #[arg(long, value_name = "COLUMN")]
    time: Option<String>,
    /// The format of time stamps that are not ISO 8601, for example "%d.%m.%Y %H:%M:%S%.f".
    #[arg(long, value_name = "FORMAT")]
    time_format: Option<String>,
    /// Texts that stand for a missing sample, separated by commas. They are added to nan, NA, #N/A and the like.
    #[arg(long, value_name = "TEXTS", value_delimiter = ',', allow_hyphen_values = true)]
    missing_text: Vec<String>,
    /// In a ROS 2 bag: the topic to read. Without --joint, you need this option only if several topics have numbers.
    /// With --joint, you need it only if several topics have this joint. In an HDF5 file: the group to read.
    #[arg(long, value_name = "NAME")]
    topic: Option<String>,
    /// In a ROS 2 bag: the joint to read. The columns of the record are then position, velocity and effort.
    #[arg(long, value_name = "NAME")]
    pub joint: Option<String>,
    /// The most memory that the record may take, for example 8GiB. By default, it is 4GiB, or one twentieth of the free
    /// memory if that is less.
    #[arg(long, value_name = "SIZE", value_parser = arguments::memory)]
    memory: Option<u64>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Separator {
    Comma,
    Semicolon,
    Tab,
    Pipe,
    Space,
}

#[derive(Clone, Copy, ValueEnum)]
enum DecimalSign {
    Point,
    Comma,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Answer {
    Yes,
    No,
}

/// An option with its value, as it is typed.
pub fn typed((name, value): (&String, &String)) -> [String; 2] {
    [format!("--{name}"), value.clone()]
}

/// Extends the error about uneven instants by the command that brings them to uniform steps: `command` makes it of the typical step.
pub fn with_resampling(error: anyhow::Error, command: impl Fn(&str) -> String) -> anyhow::Error {
    let uneven = |cause: &flexure::Error| match cause {
        flexure::Error::Data(DataError::NonUniformTime { expected, .. }) => Some(decimal(*expected)),
        _ => None,
    };
    let step = match error.downcast_ref() {
        Some(flexure_io::Error::Data { cause, .. }) => uneven(cause),
        _ => None,
    };
    match step {
        Some(step) => anyhow!("{error}: {}", command(&step)),
        None => error,
    }
}

/// This command with uniform steps; inputs may hold their values between the samples.
pub fn resampled(step: &str, inputs: &[&str]) -> String {
    let held = quoted(&inputs.join(","));
    format!(
        "{} --resample {step} --hold {held} (without --hold where the input changes smoothly between its samples)",
        this_command()
    )
}

impl Reading {
    /// Reads the record at `path`, `-` for the standard input, and notes what was decided.
    ///
    /// # Errors
    /// As [`ReadOptions::read`].
    pub fn read(&self, path: &Path) -> Result<RecordFile> {
        let options = ReadOptions {
            separator: self.separator.map(|separator| match separator {
                Separator::Comma => ',',
                Separator::Semicolon => ';',
                Separator::Tab => '\t',
                Separator::Pipe => '|',
                Separator::Space => ' ',
            }),
            decimal: self.decimal.map(|sign| match sign {
                DecimalSign::Point => Decimal::Point,
                DecimalSign::Comma => Decimal::Comma,
            }),
            header: self.header.map(|answer| answer == Answer::Yes),
            skip: self.skip_lines.unwrap_or(0),
            missing_texts: self.missing_text.clone(),
            time_format: self.time_format.clone(),
            topic: self.topic.clone(),
            joint: self.joint.clone(),
            memory: self.memory,
        };
        let file = spinning("reading", || options.read(path))?;
        if !file.notes.is_empty() {
            print_note(&format!("note: {}: {}", shown_path(&file.path), file.notes.join("; ")));
        }
        Ok(file)
    }

    /// The column that the user says has the sample instants.
    pub fn time_column(&self) -> Option<&str> {
        self.time.as_deref()
    }

    /// The name of the column of the sample instants, which need not be uniform, and its unit in s; `signals` are the columns in use.
    ///
    /// # Errors
    /// As [`RecordFile::instants`].
    pub fn instants<'a>(&'a self, file: &'a RecordFile, signals: &[&str]) -> Result<Option<(&'a str, f64)>> {
        Ok(file.instants(self.time.as_deref(), signals)?)
    }

    /// Takes the memory that was given to another reading, as no model keeps that.
    pub fn keep_memory(&mut self, other: &Reading) {
        self.memory = other.memory;
    }

    /// The memory that was given, bytes.
    pub fn memory(&self) -> Option<u64> {
        self.memory
    }

    /// The options that were given, as they are typed for another command on the same file.
    pub fn given(&self) -> Vec<String> {
        self.kept().iter().flat_map(typed).collect()
    }

    /// The options that were given, by their names.
    pub fn kept(&self) -> BTreeMap<String, String> {
        let choice = |value: Option<clap::builder::PossibleValue>| value.map(|v| v.get_name().to_owned());
        let all = [
            ("separator", choice(self.separator.and_then(|v| v.to_possible_value()))),
            ("decimal", choice(self.decimal.and_then(|v| v.to_possible_value()))),
            ("header", choice(self.header.and_then(|v| v.to_possible_value()))),
            ("skip-lines", self.skip_lines.map(|lines| lines.to_string())),
            ("time", self.time.clone()),
            ("time-format", self.time_format.clone()),
            (
                "missing-text",
                (!self.missing_text.is_empty()).then(|| self.missing_text.join(",")),
            ),
            ("topic", self.topic.clone()),
            ("joint", self.joint.clone()),
        ];
        let given = all
            .into_iter()
            .filter_map(|(name, value)| Some((name.to_owned(), value?)));
        given.collect()
    }

    /// The column of the sample instants; `signals` are the columns in use.
    ///
    /// # Errors
    /// As [`RecordFile::time`].
    pub fn time(&self, file: &RecordFile, signals: &[&str]) -> Result<Option<TimeColumn>> {
        let time = file.time(self.time.as_deref(), signals)?;
        if let Some(TimeColumn { name, clock, .. }) = &time
            && clock.jitter > NOTED_JITTER
        {
            print_note(&format!(
                "note: {}: the instants of column '{name}' deviate from a uniform grid by up to {:.0} % of a step; they count as uniform",
                shown_path(&file.path),
                100.0 * clock.jitter
            ));
        }
        Ok(time)
    }

    /// The sample instants of a record, uniform or not.
    ///
    /// # Errors
    /// As [`RecordFile::instants_in_seconds`].
    pub fn instants_in_seconds(&self, file: &RecordFile) -> Result<Option<Instants>> {
        Ok(file.instants_in_seconds(self.time.as_deref())?)
    }

    /// The sample time of a record in s: as given, or from its column of instants, unless that is one of the `signals`; `None` if
    /// neither says it.
    ///
    /// # Errors
    /// As [`RecordFile::time`]; for another sample time than the given one, and for dates that may be read in two ways.
    pub fn sample_time(&self, file: &RecordFile, given: Option<f64>, signals: &[&str]) -> Result<Option<f64>> {
        let recorded = self.time(file, signals)?;
        if let (Some(given), Some(time)) = (given, &recorded)
            && (given - time.clock.step).abs() > SAME_SAMPLE_TIME * time.clock.step
        {
            bail!(
                "{}: column '{}' has a sample time of {} s, but --sample-time says {} s; leave the option out or correct the column",
                shown_path(&file.path),
                time.name,
                exact(time.clock.step),
                exact(given)
            );
        }
        if let (None, None, Some(dates)) = (given, &recorded, file.unsettled_dates()) {
            bail!(
                "{}: {dates}; --sample-time S takes the rows as evenly spaced",
                shown_path(&file.path)
            );
        }
        Ok(given.or(recorded.map(|time| time.clock.step)))
    }

    /// Refuses a record whose sample time is not the model's; `signals` are the columns in use.
    pub fn same_sample_time(
        &self,
        file: &RecordFile,
        model: Option<f64>,
        signals: &[&str],
    ) -> Result<Option<TimeColumn>> {
        let time = self.time(file, signals)?;
        if let (Some(model), Some(time)) = (model, &time)
            && (model - time.clock.step).abs() > SAME_SAMPLE_TIME * model
        {
            bail!(
                "{}: the sample time is {} s, but the model was identified at {model} s; --resample {model} brings the record to that",
                shown_path(&file.path),
                exact(time.clock.step)
            );
        }
        if let (Some(model), None) = (model, &time) {
            print_note(&format!(
                "note: {}: no column has the sample instants; the sample time is taken as the model's, {model} s",
                shown_path(&file.path)
            ));
        }
        Ok(time)
    }
}
