//! How the record of a system is read and prepared, and how later records then are.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;

use anyhow::{Context as _, Result};
use clap::{Args as _, FromArgMatches as _};
use flexure::text::shown_path;
use flexure_io::{Format, ModelFile, RecordFile};
use flexure_workbench::preparation::{Conversion, Preparation};

use crate::arguments::Usage;
use crate::output::{print_note, quoted};
use crate::progress::spinning;
use crate::reading::{Reading, typed};
use crate::steps::Steps;

/// How a record is read, and what is then done to it. A model keeps both for later records.
#[derive(clap::Args)]
pub struct Source {
    #[command(flatten)]
    pub steps: Steps,
    #[command(flatten)]
    pub reading: Reading,
}

/// Options on the output that a model's record may have had, and records like it then have too.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct Switches {
    /// Do not use samples whose output is missing (NaN or an empty field) for the verdict. Without this option, such
    /// samples are an error. If the model was identified with --missing, this option is set automatically.
    #[arg(long)]
    pub missing: bool,
    /// Do not use outliers of the output for the verdict. An outlier is a sample that is far from the model and from
    /// the neighbouring samples. If the model was identified with --robust, this option is set automatically.
    #[arg(long)]
    pub robust: bool,
}

/// The options that name a part of a file.
const OF_PARTS: [&str; 2] = ["topic", "joint"];
/// The most bytes of a first line that are read.
const LONGEST_HEAD: u64 = 1 << 16;

/// Whether the first line of a text file names all columns of a model: the table then begins there.
fn begins_with_columns(record: &Path, model: &ModelFile) -> bool {
    let regular = record.metadata().is_ok_and(|m| m.is_file());
    let Some(file) = regular.then(|| File::open(record).ok()).flatten() else {
        return false;
    };
    let mut line = Vec::new();
    let mut head = BufReader::new(file.take(LONGEST_HEAD));
    if head.read_until(b'\n', &mut line).is_err() {
        return false;
    }
    let line = String::from_utf8_lossy(&line);
    let fields = line.split([',', ';', '\t']);
    let fields: Vec<&str> = fields.map(|field| field.trim_matches(['"', ' ', '\r', '\n'])).collect();
    // A unit may follow a name.
    let is_called = |field: &str, name: &str| {
        let rest = field.strip_prefix(name);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with([' ', '[', '(']))
    };
    let mut names = model.inputs.iter().chain([&model.output]);
    names.all(|name| fields.iter().any(|field| is_called(field, name)))
}

/// Gives the columns that steps name the names that they have in this file: `model`, which kept the steps, may have other names for the first
/// of the columns in use, its inputs and its output.
fn renamed(steps: &mut Preparation, file: &RecordFile, columns: &[&str], model: Option<&ModelFile>) {
    let of_model: Vec<&String> = model.iter().flat_map(|m| m.inputs.iter().chain([&m.output])).collect();
    steps.rename(|name| {
        let name = file.meant(name);
        let place = of_model.iter().position(|own| *own == name);
        let renamed = place.and_then(|place| columns.get(place).copied());
        let is_connected = columns.contains(&name);
        renamed.filter(|_| !is_connected).unwrap_or(name).to_owned()
    });
}

impl Source {
    /// The options that were given, by their names.
    pub fn kept(&self) -> BTreeMap<String, String> {
        let mut kept = self.reading.kept();
        kept.extend(self.steps.kept());
        kept
    }

    /// Refuses a list that names a column twice, and `--hold` without what it is for.
    ///
    /// # Errors
    /// Wrong usage.
    pub fn check(&self) -> Result<(), Usage> {
        self.steps.check()?;
        match self.steps.holds_in_vain() {
            true => Err(Usage(
                "--hold says what a column does between its samples where it is resampled; give --resample too"
                    .to_owned(),
            )),
            false => Ok(()),
        }
    }

    /// Whether the record is prepared. A note then says which samples are still missing.
    pub fn prepares(&self) -> bool {
        !self.steps.kept().is_empty()
    }

    /// Whether no option was given.
    pub fn is_usual(&self) -> bool {
        self.kept().is_empty()
    }

    /// All of it as it is typed for a command on this file, whose columns in use are those of the model.
    pub fn typed_for(&self, file: &RecordFile, columns: &[&str], model: &ModelFile) -> Vec<String> {
        let mut steps = self.steps.preparation();
        renamed(&mut steps, file, columns, Some(model));
        let mut kept = self.reading.kept();
        kept.extend(
            steps
                .repeated()
                .into_iter()
                .map(|(name, value)| (name.to_owned(), value)),
        );
        kept.iter().flat_map(typed).collect()
    }

    /// The file with the steps done to the columns in use; a note says what they did. `model` is the one that kept the steps: it may have
    /// other names for the first of the columns, its inputs and its output. Gaps of the columns `unfilled`
    /// stay.
    ///
    /// # Errors
    /// For steps that name other columns; as [`Preparation::of_file`](flexure_workbench::preparation::Preparation::of_file).
    pub fn prepared(
        &self,
        file: RecordFile,
        columns: &[&str],
        unfilled: &[&str],
        model: Option<&ModelFile>,
    ) -> Result<RecordFile> {
        let mut steps = self.steps.preparation();
        steps.unfilled = unfilled.iter().map(|&name| name.to_owned()).collect();
        self.with_steps(steps, file, columns, model)
    }

    /// The same with units of columns converted first.
    ///
    /// # Errors
    /// Those of [`prepared`](Self::prepared); for a unit that is not known.
    pub fn converted(&self, file: RecordFile, columns: &[&str], units: &[Conversion]) -> Result<RecordFile> {
        let mut steps = self.steps.preparation();
        steps.convert = units.to_vec();
        self.with_steps(steps, file, columns, None)
    }

    /// The file with these steps done to the columns in use.
    fn with_steps(
        &self,
        mut steps: Preparation,
        file: RecordFile,
        columns: &[&str],
        model: Option<&ModelFile>,
    ) -> Result<RecordFile> {
        let time = self.reading.time_column();
        // Without instants, the sample time counts as the model's.
        if steps.resample.is_some() && model.is_some() && file.instants(time, columns)?.is_none() {
            steps.resample = None;
            steps.held.clear();
            print_note(&format!(
                "note: {} has no instants, so it is not resampled",
                shown_path(&file.path)
            ));
        }
        if steps.repeated().is_empty() && steps.convert.is_empty() {
            return Ok(file);
        }
        renamed(&mut steps, &file, columns, model);
        let converted = steps.convert.iter().map(|convert| convert.column.as_str());
        if let Some(name) = steps.named().chain(converted).find(|name| !columns.contains(name)) {
            return Err(Usage(format!(
                "{}: a step names the column '{name}', but the columns in use are {}",
                shown_path(&file.path),
                columns.join(", ")
            ))
            .into());
        }
        // A prediction needs no output.
        let is_signal = |name: &str| file.record.names().iter().any(|own| own == name);
        let there: Vec<&str> = columns.iter().copied().filter(|name| is_signal(name)).collect();
        let steps = steps.only_for(&there);
        let (prepared, done) = spinning("preparing", || steps.of_file(&file, time, &there))?;
        let done: Vec<&str> = done.iter().map(|done| done.text.as_str()).collect();
        if !done.is_empty() {
            print_note(&format!("note: {}: {}", shown_path(&file.path), done.join("; ")));
        }
        Ok(prepared)
    }

    /// The same, but options that were given only for the model's record are taken from there; a note lists them. `switches` are options of
    /// the command, if it has them; they become true if they were set for the model's record.
    ///
    /// # Errors
    /// For options in the model file that this version does not know.
    pub fn as_of_model(&self, model: &ModelFile, switches: Option<&mut Switches>, record: &Path) -> Result<Source> {
        let own = self.kept();
        let parts = Format::of(record).is_some_and(|format| format.has_parts);
        let headed = begins_with_columns(record, model);
        let fits = |name: &String| {
            let fits_file = (parts || !OF_PARTS.contains(&name.as_str())) && !(headed && name == "skip-lines");
            fits_file && !own.contains_key(name)
        };
        let taken = model.reading.iter().filter(|(name, _)| fits(name));
        let taken: Vec<String> = taken.flat_map(typed).collect();
        let mut said: Vec<String> = taken.iter().map(|word| quoted(word)).collect();
        if let Some(Switches { missing, robust }) = switches {
            for (option, own, of_model) in [
                ("--missing", missing, model.missing),
                ("--robust", robust, model.robust),
            ] {
                if of_model && !*own {
                    *own = true;
                    said.push(option.to_owned());
                }
            }
        }
        if !said.is_empty() {
            print_note(&format!(
                "note: {} is read with the options of the model's log: {}",
                shown_path(record),
                said.join(" ")
            ));
        }
        let command = Source::augment_args(clap::Command::new("flexure").no_binary_name(true));
        let matches = command
            .try_get_matches_from(taken.into_iter().chain(own.iter().flat_map(typed)))
            .context("the model file says how its record was read, in a way that this version does not know")?;
        let mut source = Source::from_arg_matches(&matches)?;
        source.reading.keep_memory(&self.reading);
        Ok(source)
    }
}
