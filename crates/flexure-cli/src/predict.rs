//! `flexure predict`: the output of a model, in free run or some samples ahead.

use std::path::PathBuf;

use anyhow::Result;
use flexure::Record;
use flexure::text::{BELOW_ZERO, fit, shown_path};
use flexure::validation::FitMeasures;
use flexure_io::{ModelFile, RecordFile, TimeColumn, write_record};
use flexure_workbench::Named;
use flexure_workbench::systems::{Ahead, FreeRun, Outside, Start, columns};
use flexure_workbench::text::{grouped, number};
use serde_json::{Value, json};

use crate::applied::{Applied, ModelOnRecord, with_missing};
use crate::arguments::{self, Usage};
use crate::output::{print, print_note};
use crate::progress::spinning;

/// Simulate a model under the input of a record, or predict its output from past outputs.
///
/// The command writes one row for each sample of the record, with these columns: t (in s, if the record has a time
/// column), measured (if the record has the output), predicted, and error (if the record has the output). Without
/// --horizon, the prediction is a free run: the model sees only the input. The first samples of the output are used
/// only to estimate the state at the start.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  flexure predict model.json fresh.csv -o predicted.csv\n  flexure predict model.json fresh.csv --horizon 5 -o predicted.csv"
)]
pub struct Arguments {
    #[command(flatten)]
    applied: ModelOnRecord,
    /// Predict K samples ahead: each value also uses the measured outputs up to K samples before it.
    #[arg(long, value_name = "K", allow_hyphen_values = true, value_parser = arguments::count_from_one)]
    horizon: Option<usize>,
    /// Write the prediction to this file: .csv or .parquet.
    #[arg(short = 'o', long = "out", value_name = "OUT.csv")]
    out: PathBuf,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// The measured output: the column that is named, or the model's where the record has it. Samples that are missing are NaN: the state at
    /// the start and the fit are computed from the others.
    ///
    /// # Errors
    /// Names the file and the line of a sample that is missing where a prediction of some samples ahead needs all; wrong usage where an
    /// option needs the output.
    fn measured<'a>(&self, file: &'a RecordFile, model: &ModelFile, output: &str) -> Result<Option<&'a [f64]>> {
        let needs = match (self.horizon, self.applied.initial_state) {
            (Some(_), _) => Some("--horizon"),
            (_, Some(Start::Estimate)) => Some("--initial-state estimate"),
            _ => None,
        };
        let there = file.has(output);
        if self.horizon.is_some() && there {
            return Ok(Some(file.finite(output)?));
        }
        if let (Some(option), false) = (needs, there) {
            return Err(Usage(format!(
                "{option} needs the measured output, and {} has no column '{}', as the model calls it; name it by --output",
                shown_path(&file.path),
                model.output
            ))
            .into());
        }
        let measured = match file.column(output) {
            Err(error) if self.applied.output.is_some() || needs.is_some() => return Err(error.into()),
            Err(error) => {
                if there {
                    print_note(&format!(
                        "note: {error}: no fit is computed, and the state at the start is not estimated from the output"
                    ));
                }
                return Ok(None);
            }
            Ok(measured) => measured,
        };
        let missing = measured.iter().filter(|y| !y.is_finite()).count();
        if missing > 0 {
            print_note(&format!(
                "note: {} of {} samples of '{output}' are missing or not finite; the fit and the state at the start are computed from the others",
                grouped(missing),
                grouped(measured.len())
            ));
        }
        Ok(Some(measured))
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let Applied {
        model,
        file,
        connected,
        time,
        ..
    } = arguments.applied.open([&arguments.out], [], None)?;
    let inputs = connected.inputs();
    let entering = columns(&file, &inputs).map_err(|error| with_missing(error, &connected.output, false))?;
    let measured = arguments.measured(&file, &model, &connected.output)?;
    let start = arguments.applied.initial_state;
    let run = |measured| FreeRun::new(&model.block, &file, &inputs, measured, start);
    // Too few outputs at the start leave its state open, unless it was asked for.
    let (free, open_start) = spinning("simulating", || match (run(measured), start) {
        (Err(error), None | Some(Start::Steady)) => run(None).map(|free| (free, Some(error))),
        (free, _) => free.map(|free| (free, None)),
    })?;
    if let Some(error) = open_start {
        print_note(&format!(
            "note: {error}: the state at the start is not estimated from the output"
        ));
    }
    let ahead = match (arguments.horizon, measured) {
        (Some(horizon), Some(measured)) => Some(Ahead::new(&model, &free, measured, horizon)?),
        _ => None,
    };
    let predicted = ahead.as_ref().map_or(&free.output, |ahead| &ahead.output);
    // Outputs that gave the state are no predictions, but a short record has no others. A constant output has no fit.
    let first = free
        .estimated_from
        .filter(|samples| *samples < predicted.len())
        .unwrap_or(0);
    let measures = measured.and_then(|measured| {
        let known = measured[first..]
            .iter()
            .zip(&predicted[first..])
            .filter(|(y, _)| y.is_finite());
        let (measured, predicted): (Vec<f64>, Vec<f64>) = known.unzip();
        FitMeasures::new(&measured, &predicted).ok()
    });
    let predicted = Predicted {
        measures,
        first,
        outside: Outside::new(&model.block, &entering),
        free,
        ahead,
    };
    write_record(&arguments.out, &predicted.record(&file, time, measured)?)?;
    match arguments.json {
        true => print(&predicted.json(arguments).to_string()),
        false => print(&predicted.text(arguments)),
    }
}

/// A prediction.
struct Predicted {
    free: FreeRun,
    /// The prediction some samples ahead, where that is asked for.
    ahead: Option<Ahead>,
    /// How well it agrees with the measured output from sample `first` on.
    measures: Option<FitMeasures>,
    first: usize,
    outside: Outside,
}

impl Predicted {
    fn output(&self) -> &[f64] {
        self.ahead.as_ref().map_or(&self.free.output, |ahead| &ahead.output)
    }

    /// The record to write: instants, the measured output and its error where there is one, and the prediction.
    fn record(&self, file: &RecordFile, time: Option<TimeColumn>, measured: Option<&[f64]>) -> Result<Record> {
        let predicted = self.output();
        let mut columns = Vec::new();
        if let Some(time) = time {
            let instants = file.column(&time.name)?.iter().map(|t| t * time.seconds);
            columns.push(("t", instants.collect()));
        }
        columns.extend(measured.map(|measured| ("measured", measured.to_vec())));
        columns.push(("predicted", predicted.to_vec()));
        columns.extend(measured.map(|measured| {
            let error = measured.iter().zip(predicted).map(|(y, yh)| y - yh);
            ("error", error.collect())
        }));
        Ok(Record::new(columns)?)
    }

    fn json(&self, arguments: &Arguments) -> Value {
        json!({
            "samples": self.output().len(),
            "samples_outside_range": self.outside.samples,
            "initial_state": self.free.start().name(),
            "initial_state_samples": self.free.estimated_from,
            "horizon": arguments.horizon,
            "noise_model_used": self.ahead.as_ref().is_some_and(|ahead| ahead.noise),
            "fit_percent": self.measures.map(|m| m.fit_percent),
            "rms": self.measures.map(|m| m.rms),
            "out": arguments.out.display().to_string(),
        })
    }

    fn text(&self, arguments: &Arguments) -> String {
        let (path, samples) = (shown_path(&arguments.out), self.output().len());
        let mut lines = vec![format!("wrote {path} ({samples} samples)")];
        lines.extend(self.ahead.as_ref().map(|ahead| ahead.description.clone()));
        lines.push(format!("free run {}", self.free.description()));
        lines.extend(self.measures.map(|m| {
            let remaining = if self.first > 0 { "remaining " } else { "" };
            let (fit, rms) = (fit(m.fit_percent, 2), number(m.rms));
            format!("fit {fit}, RMS error {rms} over the {remaining}{} samples", m.samples)
        }));
        let below = self.measures.is_some_and(|m| m.fit_percent < 0.0);
        lines.extend(below.then(|| BELOW_ZERO.to_owned()));
        if self.free.took_most() {
            lines.push(
                "warning: the model is so slow that most outputs were used for the state at the start: the fit is over the few that are left; predict a \
                 longer record, or give --initial-state steady"
                    .to_owned(),
            );
        }
        lines.extend(self.outside.warning());
        lines.join("\n")
    }
}
