//! `flexure identify --stream`: a record that is read in parts.

use anyhow::Result;
use flexure::identify::{HAMMERSTEIN, HammersteinMethod};
use flexure::text::shown_path;
use flexure_io::ParquetParts;
use flexure_workbench::systems::{Streamed, SystemColumns};

use super::Arguments;
use super::run::Made;
use crate::arguments::Usage;
use crate::columns::Connected;
use crate::files::prepare;
use crate::output::print_note;
use crate::progress::{spinning, spinning_through};
use crate::streamed;

/// The first rows, which show columns, units and sample time.
const HEAD: u64 = 10_000;

/// Refuses what records in parts do not have.
fn check(arguments: &Arguments) -> Result<(), Usage> {
    let foreign = match arguments.task().map(|(task, _)| task.options.hammerstein) {
        _ if arguments.records.len() > 1 => Some("is for one record"),
        _ if arguments.structure().name != HAMMERSTEIN.name => Some("is for --structure hammerstein"),
        Ok(HammersteinMethod::Refined(method)) if method.form.is_some() => Some("cannot fit a --form"),
        Ok(HammersteinMethod::Plain(_)) => Some("is for --method refined"),
        _ if arguments.periods.first_given().is_some() => Some("cannot look for periods"),
        _ if arguments.source.prepares() => Some("cannot prepare the record; use flexure prepare before"),
        _ => None,
    };
    foreign.map_or(Ok(()), |what| Err(Usage(format!("--stream {what}"))))
}

/// Extends the error of a record that is too large: it names the option that reads the record in parts.
pub fn with_stream(error: anyhow::Error, arguments: &Arguments) -> anyhow::Error {
    let can = !arguments.robust && !arguments.missing && arguments.arm.is_none() && check(arguments).is_ok();
    streamed::with_stream(error, &arguments.records[0], can)
}

/// Runs the command with --stream.
pub fn run(arguments: &Arguments) -> Result<()> {
    arguments.check()?;
    check(arguments)?;
    let path = &arguments.records[0];
    let reading = &arguments.source.reading;
    let memory = streamed::memory(path, reading, &["time"], Streamed::LEAST_MEMORY)?;
    prepare([path], [], arguments.outputs())?;
    let head = spinning("reading", || ParquetParts::head(path, HEAD))?;
    let connected = Connected::of_record(
        &head,
        reading.time_column(),
        arguments.inputs(),
        arguments.output.as_deref(),
    )?;
    let inputs = connected.inputs();
    let signals = connected.all();
    if !head.notes.is_empty() {
        print_note(&format!("note: {}: {}", shown_path(path), head.notes.join("; ")));
    }
    let instants = reading.instants(&head, &signals)?;
    let streamed = Streamed {
        input: inputs[0],
        output: &connected.output,
        time: instants.map(|(name, _)| name),
        time_unit: instants.map_or(1.0, |(_, unit)| unit),
        sample_time: reading.sample_time(&head, arguments.sample_time, &signals)?,
        memory,
    };
    let (task, _) = arguments.task()?;
    let (file, identified) = spinning_through("identifying", |stage| streamed.identify(path, &task, stage))?;
    Made {
        task: &task,
        file: &file,
        columns: SystemColumns {
            inputs: &inputs,
            output: &connected.output,
        },
        sample_time: identified.sample_time,
        experiments: 1,
        identified,
    }
    .write(arguments)
}
