//! `flexure compare`: several models on one record.

use std::path::PathBuf;

use anyhow::Result;
use flexure_io::{ModelFile, read_model};
use flexure_workbench::systems::{Compared, ComparedModel, Judging};

use crate::applied::lacking;
use crate::arguments;
use crate::columns::Connected;
use crate::files::{prepare, write_text, wrote};
use crate::output::{print, print_result, this_command};
use crate::progress::spinning;
use crate::source::{Source, Switches};

/// Judge several models on one record, side by side.
///
/// Every model is simulated in a free run under the inputs of the record. All models are judged on the same samples. A
/// model that was identified from this same record is marked. Each model uses the columns with its own names, unless
/// --input and --output name others.
#[derive(clap::Args)]
#[command(
    override_usage = "flexure compare [OPTIONS] <MODEL>... <RECORD>",
    after_help = "Example:\n  flexure compare a.json b.json fresh.csv --report comparison.html"
)]
pub struct Arguments {
    /// The models, from `flexure identify -o`. The last file is the record.
    #[arg(value_name = "FILE", required = true, num_args = 2..)]
    files: Vec<PathBuf>,
    /// The column of the input, if its name differs from the name in the models. A,B for models with several inputs.
    #[arg(long, value_name = "COLUMN")]
    input: Option<String>,
    /// The column of the measured output, if its name differs from the name in the models.
    #[arg(long, value_name = "COLUMN")]
    output: Option<String>,
    /// Leave the first N samples out of the comparison. By default, N is the settling time of the slowest model, but at
    /// most one tenth of the record.
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = arguments::count)]
    skip: Option<usize>,
    #[command(flatten)]
    switches: Switches,
    /// Write a page with the free runs of all models to this file.
    #[arg(long, value_name = "REPORT.html")]
    report: Option<PathBuf>,
    #[command(flatten)]
    source: Source,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    // At least two files are required.
    let Some((record, models)) = arguments.files.split_last() else {
        return Ok(());
    };
    prepare(&arguments.files, [], &arguments.report)?;
    let models: Vec<_> = models
        .iter()
        .map(|path| Ok((path.display().to_string(), read_model(path)?)))
        .collect::<Result<_>>()?;
    // Every model's record may have been read in its own way: what this one takes of it, the first model says.
    let mut switches = arguments.switches;
    let source = match models.first() {
        Some((_, model)) => &arguments.source.as_of_model(model, Some(&mut switches), record)?,
        None => &arguments.source,
    };
    source.check()?;
    let lacking =
        |(_, model): &(String, ModelFile)| lacking(&arguments.source, record, model, arguments.input.as_deref());
    let read = source.reading.read(record);
    let file = read.map_err(|error| models.iter().find_map(lacking).unwrap_or(error))?;
    let connected = |model: &ModelFile| {
        let (input, output) = (arguments.input.as_deref(), arguments.output.as_deref());
        Connected::of_model(&file, model, input, output)
    };
    let connected = models
        .iter()
        .map(|(_, model)| connected(model))
        .collect::<Result<Vec<_>, _>>()?;
    switches.missing |= source.prepares();
    let mut columns: Vec<&str> = Vec::new();
    for name in connected.iter().flat_map(Connected::all) {
        if !columns.contains(&name) {
            columns.push(name);
        }
    }
    let outputs: Vec<&str> = connected.iter().map(|connected| connected.output.as_str()).collect();
    let file = source.prepared(file, &columns, &outputs, models.first().map(|(_, model)| model))?;
    let mut compared = Vec::with_capacity(models.len());
    for ((name, model), connected) in models.into_iter().zip(connected) {
        source
            .reading
            .same_sample_time(&file, model.sample_time, &connected.all())?;
        let Connected { inputs, output } = connected;
        compared.push(ComparedModel {
            name,
            model,
            inputs,
            output,
        });
    }
    let judging = Judging {
        skip: arguments.skip,
        missing: switches.missing,
        robust: switches.robust,
        ..Judging::default()
    };
    let compared = spinning("simulating", || Compared::new(compared, &file, judging))?;
    if let Some(path) = &arguments.report {
        write_text(path, &compared.html(&file, Some(this_command()))?)?;
    }
    if arguments.json {
        return print(&compared.json().to_string());
    }
    print_result(&compared.summary(), wrote(&arguments.report))
}
