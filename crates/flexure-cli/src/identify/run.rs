//! The work of `flexure identify`.

use std::ffi::OsString;
use std::ops::ControlFlow;

use anyhow::{Context as _, Result};
use flexure::identify::{Options, Structure};
use flexure_io::{RecordFile, model_text};
use flexure_workbench::systems::{Decoration, Identified, SystemColumns, Task};

use super::{Arguments, stream};
use crate::applied::with_missing;
use crate::experiments::{self, Experiments};
use crate::files::{prepare, write_text, wrote};
use crate::output::{command_line, print, print_note, print_result, quoted, this_command};
use crate::progress::{spinning, spinning_through};

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    if arguments.stream {
        return stream::run(arguments);
    }
    arguments.check()?;
    let (task, note) = arguments.task()?;
    let others = [arguments.periods.first_given(), arguments.arm.as_ref().map(|_| "--arm")];
    experiments::refuse(arguments.records.len(), &task, others.into_iter().flatten().next())?;
    prepare(arguments.records.iter().chain(&arguments.arm), [], arguments.outputs())?;
    if let Some(note) = note {
        print_note(&note);
    }
    let file = arguments.source.reading.read(&arguments.records[0]);
    let file = file.map_err(|error| stream::with_stream(error, arguments))?;
    let (experiments, connected) = arguments.connected(file)?;
    let Experiments {
        file,
        samples,
        sample_time,
    } = experiments;
    let columns = SystemColumns {
        inputs: &connected.inputs(),
        output: &connected.output,
    };
    let task = arguments.of_prepared(task, &file, columns.output);
    let (task, note) = match samples.len() {
        1 => arguments.fitting(task, &file, columns),
        _ => (task, None),
    };
    if let Some(note) = note {
        print_note(&note);
    }
    let periodic = match samples.len() {
        1 => arguments.periods.approximate(&file, columns, sample_time)?,
        _ => None,
    };
    let mut identified = spinning_through("identifying", |report| {
        task.identify(&file, columns, sample_time, &samples, &|stage| {
            report(stage);
            ControlFlow::Continue(())
        })
    })
    .map_err(|error| with_missing(error, &connected.output, !arguments.missing))?;
    identified.periodic = periodic;
    Made {
        task: &task,
        file: &file,
        columns,
        sample_time,
        experiments: samples.len(),
        identified,
    }
    .write(arguments)
}

/// What was identified, and from what.
pub struct Made<'a> {
    pub task: &'a Task,
    pub file: &'a RecordFile,
    pub columns: SystemColumns<'a>,
    pub sample_time: Option<f64>,
    pub experiments: usize,
    pub identified: Identified,
}

impl Made<'_> {
    /// Writes and prints all that the options ask for.
    pub fn write(self, arguments: &Arguments) -> Result<()> {
        let Made {
            task,
            file,
            columns,
            sample_time,
            experiments,
            identified,
        } = self;
        // Everything is made before anything is written.
        let mut files = Vec::new();
        if let Some(path) = &arguments.report {
            let found = Task {
                structure: Structure::by_name(identified.result.structure.key).unwrap_or(task.structure),
                ..task.clone()
            };
            // The script on the page names the structure that was found.
            let of_page = if task.or_another { &found } else { task };
            let decoration = Decoration {
                command: Some(this_command()),
                python: arguments.python(file, columns, sample_time, of_page),
                arm: arguments.moving_arm(file, sample_time)?,
                ..Decoration::default()
            };
            files.push((path, identified.html(file, decoration)?));
        }
        if let Some(path) = &arguments.model {
            files.push((path, model_text(&arguments.model(&identified), path)?));
        }
        for (path, text) in files {
            write_text(path, &text)?;
        }
        if arguments.json {
            return print(&identified.json().to_string());
        }
        // Without the choices of one structure, and unless only linear has poles for the output, others can be tried.
        let is_one = experiments == 1 && columns.inputs.len() == 1 && identified.in_parts.is_none();
        let has_others = || {
            // Where none holds, a complete comparison has more than two candidates.
            let compared = identified.result.comparison.as_ref();
            let is_compared = compared.is_some_and(|c| c.candidates.len() > 2);
            let is_free = is_one && !is_compared && arguments.given().next().is_none();
            is_free && Task::integrated(file, columns).is_none()
        };
        let next = next_command(arguments, &identified, has_others);
        let next = next.map(|command| [String::new(), format!("next: {command}")]);
        print_result(
            &identified.summary(),
            wrote(arguments.outputs()).chain(next.into_iter().flatten()),
        )
    }
}

/// What to type next; `has_others` says whether other structures can be tried.
fn next_command(arguments: &Arguments, identified: &Identified, has_others: impl Fn() -> bool) -> Option<String> {
    let verdict = &identified.result.verdict;
    match &arguments.model {
        _ if identified.in_parts.is_some() && !verdict.holds() => None,
        _ if verdict.hidden_by.is_some() && !arguments.robust => Some(format!("{} --robust", this_command())),
        _ if !verdict.holds() => has_others().then(with_auto),
        Some(model) => {
            let page = arguments.report.as_ref().map_or("", |_| " --report validated.html");
            let model = quoted(&model.display().to_string());
            Some(format!("flexure validate {model} ANOTHER-LOG{page}"))
        }
        None => None,
    }
}

/// The command line of this process with the structure auto in place of any other.
fn with_auto() -> String {
    let mut given = std::env::args_os().skip(1);
    let mut words = Vec::new();
    while let Some(word) = given.next() {
        match word.to_str() {
            Some("--structure") => drop(given.next()),
            Some(text) if text.starts_with("--structure=") => {}
            _ => words.push(word),
        }
    }
    command_line(words.into_iter().chain(["--structure", "auto"].map(OsString::from)))
}

/// Identifies a system of this structure, with its usual choices, and says in which file and line an error lies.
pub fn by_name(structure: &str, file: &RecordFile, [input, output]: [&str; 2], sample_time: f64) -> Result<Identified> {
    let structure = Structure::by_name(structure).with_context(|| format!("there is no structure '{structure}'"))?;
    let options = Options::default();
    let task = Task {
        structure,
        options,
        or_another: false,
    };
    let columns = SystemColumns {
        inputs: &[input],
        output,
    };
    spinning("identifying", || {
        task.identify(file, columns, Some(sample_time), &[], &|_| ControlFlow::Continue(()))
    })
}
