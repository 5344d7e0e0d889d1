//! `flexure prepare`: a record made ready for identification.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use flexure::Record;
use flexure::preparation::LowPass;
use flexure::text::shown_path;
use flexure_io::{RecordMark, read_model, write_record_with_units};
use flexure_workbench::preparation::{Columns, Conversion, Cut, Preparation, Table};
use flexure_workbench::text::grouped;
use serde_json::json;

use crate::arguments;
use crate::files::prepare;
use crate::look;
use crate::output::{print, quoted};
use crate::progress::spinning;
use crate::reading::Reading;
use crate::steps::{STEPS, Steps, columns};

/// Cut, resample, filter, clean or merge records.
///
/// The command reads one or several files and writes one record. The time in the new record is the column 't', in s.
/// The command says what it did, in one line for each step. The steps have a fixed order: keep, cut, convert, outliers,
/// merge and resample, fill, low-pass, means and trends. The order of the options does not matter. Several files are
/// merged at the instants of the first file. If the instants of the files differ, the columns are resampled.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  flexure prepare record.csv --cut-samples 100: --outliers y --fill 3 -o clean.csv\n  flexure prepare record.csv --sample-time 0.01 --resample 0.02 --hold u --remove-mean y -o slow.csv"
)]
pub struct Arguments {
    /// The files: any records that `flexure` reads.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Keep only these columns and the time: A,B,... By default, all columns are kept.
    #[arg(long, help_heading = STEPS, value_name = "COLUMNS")]
    keep: Option<String>,
    /// Keep the samples from time A to time B, in s of the record's own clock. The samples at A and at B are kept. A or
    /// B may be left out.
    #[arg(long, help_heading = STEPS, value_name = "A:B", allow_hyphen_values = true, conflicts_with = "cut_samples", value_parser = time_range)]
    cut: Option<[Option<f64>; 2]>,
    /// Keep the samples from number A to number B - 1. The first sample has the number 0. A or B may be left out.
    #[arg(long, help_heading = STEPS, value_name = "A:B", value_parser = sample_range)]
    cut_samples: Option<[Option<usize>; 2]>,
    /// Convert the unit of a column, for example q=rad. If the file does not say the unit of the column, name both
    /// units: q=deg:rad, or q=rev/4096:rad for an encoder with 4096 counts per revolution. This option may be given
    /// several times.
    #[arg(long, help_heading = STEPS, value_name = "COLUMN=UNIT", value_parser = conversion)]
    convert: Vec<Conversion>,
    #[command(flatten)]
    steps: Steps,
    /// Filter all columns by a low-pass with the cutoff frequency HZ, in Hz. It takes out what is faster, and causes no
    /// delay.
    #[arg(long, help_heading = STEPS, value_name = "HZ", value_parser = arguments::positive)]
    low_pass: Option<f64>,
    /// The order of the low-pass: an even number. The low-pass is a Butterworth filter that is run forward and
    /// backward.
    #[arg(long, help_heading = STEPS, value_name = "N", default_value_t = 4, requires = "low_pass", value_parser = arguments::even_order)]
    order: usize,
    /// Subtract the mean from these columns: A,B,... or all.
    #[arg(long, help_heading = STEPS, value_name = "COLUMNS")]
    remove_mean: Option<String>,
    /// Subtract the straight-line trend from these columns: A,B,... or all.
    #[arg(long, help_heading = STEPS, value_name = "COLUMNS")]
    detrend: Option<String>,
    /// The sample time in s. Give it for a record without a time column, or to replace time stamps that are not exact.
    #[arg(long, value_name = "S", value_parser = arguments::positive)]
    sample_time: Option<f64>,
    /// Write the new record to this file: .csv or .parquet.
    #[arg(short = 'o', long = "out", value_name = "OUT.csv")]
    out: PathBuf,
    #[command(flatten)]
    reading: Reading,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// `A:B` with both ends optional.
fn range<T>(text: &str, parse: impl Fn(&str) -> Option<T>) -> Option<[Option<T>; 2]> {
    let end = |text: &str| match text.trim() {
        "" => Some(None),
        text => parse(text).map(Some),
    };
    let (from, to) = text.split_once(':')?;
    Some([end(from)?, end(to)?])
}

fn time_range(text: &str) -> Result<[Option<f64>; 2], String> {
    let range = range(text, |text| text.parse().ok().filter(|t: &f64| t.is_finite()));
    let ordered = range.filter(|range| !matches!(range, [Some(from), Some(to)] if from > to));
    ordered.ok_or_else(|| "expected A:B with two instants in s, A before B, for example 10:60, 10: or :60".to_owned())
}

fn sample_range(text: &str) -> Result<[Option<usize>; 2], String> {
    let range = range(text, |text| text.parse().ok());
    let ordered = range.filter(|range| !matches!(range, [Some(from), Some(to)] if from >= to));
    ordered.ok_or_else(|| {
        "expected A:B with two whole numbers from 0, A before B, for example 100:5000, 100: or :5000".to_owned()
    })
}

pub fn conversion(text: &str) -> Result<Conversion, String> {
    let parts = text
        .rsplit_once('=')
        .map(|(column, units)| (column.trim(), units.trim()));
    let Some((column, units)) = parts.filter(|(column, units)| !column.is_empty() && !units.is_empty()) else {
        return Err("expected COLUMN=UNIT or COLUMN=UNIT:UNIT, for example q=rad or q=deg:rad".to_owned());
    };
    let (from, to) = match units.split_once(':') {
        Some((from, to)) => (Some(from.trim().to_owned()), to.trim()),
        None => (None, units),
    };
    Ok(Conversion {
        column: column.to_owned(),
        from,
        to: to.to_owned(),
    })
}

impl Arguments {
    fn preparation(&self) -> Preparation {
        let chosen = |list: &Option<String>| list.as_deref().map(columns);
        Preparation {
            keep: chosen(&self.keep).unwrap_or(Columns::All),
            cut: self.cut.map(Cut::Time).or(self.cut_samples.map(Cut::Samples)),
            convert: self.convert.clone(),
            low_pass: self.low_pass.map(|cutoff| LowPass {
                cutoff,
                order: self.order,
            }),
            remove_mean: chosen(&self.remove_mean),
            detrend: chosen(&self.detrend),
            ..self.steps.preparation()
        }
    }

    /// Refuses a list that names a column twice.
    fn check_lists(&self) -> Result<(), arguments::Usage> {
        let lists = [
            ("keep", &self.keep),
            ("remove-mean", &self.remove_mean),
            ("detrend", &self.detrend),
        ];
        for (option, list) in lists {
            arguments::named_once(option, &list.as_deref().map(arguments::columns).unwrap_or_default())?;
        }
        self.steps.check()
    }

    /// The columns of a file at its instants.
    fn table(&self, path: &Path) -> Result<Table> {
        let file = self.reading.read(path)?;
        let instants = self.reading.instants_in_seconds(&file)?;
        let table = Table::of(&file, instants, self.sample_time)?;
        let steps = [
            ("--cut", self.cut.is_some()),
            ("--resample", self.steps.resample.is_some()),
            ("--low-pass", self.low_pass.is_some()),
        ];
        if let Some((option, _)) = steps.iter().find(|(_, given)| *given && table.instants.is_none()) {
            bail!(
                "{}: {option} needs the sample time, and there is no time column; name it by --time, or give --sample-time{}",
                table.name,
                file.sample_time_hint()
            );
        }
        Ok(table)
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    arguments.check_lists()?;
    prepare(&arguments.files, [&arguments.out], [])?;
    let tables = arguments
        .files
        .iter()
        .map(|path| arguments.table(path))
        .collect::<Result<Vec<_>>>()?;
    let prepared = spinning("preparing", || arguments.preparation().run(tables))?;
    let (record, units) = prepared.table.record()?;
    write_record_with_units(&arguments.out, &record, &units)?;
    if arguments.json {
        let mut object = prepared.json();
        object["files"] = json!(arguments.files);
        object["out"] = json!(arguments.out);
        return print(&object.to_string());
    }
    let mut lines: Vec<String> = prepared.done.iter().map(|done| done.text.clone()).collect();
    lines.push(format!(
        "wrote {} ({} samples)",
        shown_path(&arguments.out),
        grouped(prepared.table.len())
    ));
    let missing: usize = prepared.missing().iter().sum();
    if missing > 0 {
        let samples = match missing {
            1 => "1 sample is".to_owned(),
            n => format!("{} samples are", grouped(n)),
        };
        let hint = match arguments.steps.fill {
            Some(_) => "",
            None => "; --fill N interpolates gaps of at most N",
        };
        lines.push(format!("{samples} missing, written as NaN{hint}"));
    }
    let validation = validation(&record, &arguments.files, &arguments.out);
    let next = look::next_for(record, units, &arguments.out);
    let next = match (validation, next) {
        (Some(validation), Some(next)) => format!("next: {validation}\nor, for a model of its own: {next}"),
        (Some(next), None) | (None, Some(next)) => format!("next: {next}"),
        (None, None) => return print(&lines.join("\n")),
    };
    lines.extend([String::new(), next]);
    print(&lines.join("\n"))
}

/// The model file that a look suggests to write.
const MODEL: &str = "model.json";

/// The validation of the model in this folder by another record with its columns. A file with the name of the model's own may be that record
/// before it was prepared.
fn validation(record: &Record, files: &[PathBuf], out: &Path) -> Option<String> {
    let model = read_model(Path::new(MODEL)).ok()?;
    let name = |path: &Path| path.file_name().map(|name| shown_path(name.as_ref()));
    let is_own = |path: &Path| model.records.iter().any(|own| name(path).as_ref() == Some(&own.name));
    if model.records.is_empty() || files.iter().map(PathBuf::as_path).chain([out]).any(is_own) {
        return None;
    }
    let columns: Vec<&str> = model.inputs.iter().chain([&model.output]).map(String::as_str).collect();
    let mark = RecordMark::new(&shown_path(out), record, &columns).ok()?;
    let out = quoted(&out.display().to_string());
    (!model.was_identified_from(&mark)).then(|| format!("flexure validate {MODEL} {out} --report validated.html"))
}
