//! `flexure look`: what a record is like, and the command to type next.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::Result;
use flexure::Record;
use flexure::text::readable;
use flexure_io::{RecordFile, Topic};
use flexure_workbench::look::{Inspection, Request, Suggestion};
use flexure_workbench::text::decimal;
use serde_json::json;

use crate::arguments;
use crate::files::{prepare, write_text, wrote};
use crate::output::{command_line, print, print_result, this_command};
use crate::progress::spinning;
use crate::reading::Reading;

/// A longer record than this is not looked at unless that is asked for: a look at it takes seconds.
const LOOKED_AT: usize = 300_000;

/// Look at a record: what its columns are like, what depends on what, and which command to type next.
///
/// For each column, the command reports the range, missing samples, outliers, levels (if the column takes few values),
/// rounding steps, standstill at an extreme value, and the power spectrum. For the time, it reports gaps and jitter.
/// For each pair of columns, it tests whether one column follows the other, and after how many samples. A record is a
/// text file with columns (such as CSV), a Parquet, MAT or HDF5 file, or a topic of a ROS 2 bag. If a bag has several
/// topics, the command lists the topics and the joints.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  flexure look record.csv --report look.html")]
pub struct Arguments {
    /// The record, or - for the standard input.
    record: PathBuf,
    /// The column of the input, or A,B for several inputs. By default, it is found from the names and the data.
    #[arg(long, value_name = "COLUMN")]
    input: Option<String>,
    /// The column of the output. By default, it is found from the names and the data.
    #[arg(long, value_name = "COLUMN")]
    output: Option<String>,
    /// The sample time in s. By default, it is taken from the time column.
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = arguments::positive)]
    sample_time: Option<f64>,
    /// Write a page with all results and with plots to this file.
    #[arg(long, value_name = "LOOK.html")]
    report: Option<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// A suggested command as it is typed: for this record, with the reading options of this command.
    fn typed(&self, suggestion: &Suggestion) -> String {
        let step = self.sample_time.filter(|_| suggestion.command != "regress");
        let step = step.map(|step| ["--sample-time".to_owned(), decimal(step)]);
        typed(
            &self.record,
            suggestion,
            step.into_iter().flatten().chain(self.reading.given()),
        )
    }
}

/// A suggested command as it is typed, with further options.
fn typed(record: &Path, suggestion: &Suggestion, further: impl IntoIterator<Item = String>) -> String {
    let options = suggestion.options.iter().cloned().chain(further);
    let record = [suggestion.command.into(), record.into()];
    command_line(record.into_iter().chain(options.map(Into::into)))
}

/// The command to type after this record was written to `path`: what a look at it suggests, or the look where that takes long.
pub fn next_for(record: Record, units: Vec<Option<String>>, path: &Path) -> Option<String> {
    if record.len() > LOOKED_AT {
        return Some(command_line([OsString::from("look"), path.into()]));
    }
    let mut file = RecordFile::in_memory(record, &path.display().to_string());
    file.units = units;
    let request = Request {
        time: file.instants(None, &[]).ok()?,
        sample_time: None,
        inputs: &[],
        output: None,
    };
    let inspection = spinning("looking", || Inspection::new(&file, &request)).ok()?;
    let suggestion = inspection.suggestion.as_ref()?;
    Some(typed(path, suggestion, []))
}

/// Lists the topics of a bag of which none was chosen, and what to type next; passes on any other error.
fn list_topics(arguments: &Arguments, error: anyhow::Error) -> Result<()> {
    let topics = match error.downcast_ref() {
        Some(flexure_io::Error::Topics {
            topics, choose: true, ..
        }) => topics,
        _ => return Err(error),
    };
    let joint = arguments.reading.joint.as_ref();
    let can_be_read = topics.iter().filter(|topic| {
        let has = joint.is_none_or(|joint| topic.joints.contains(joint));
        topic.problem.is_none() && topic.messages > 0 && has
    });
    // Joints come first, for any name of their topic.
    let first = can_be_read.min_by_key(|topic| topic.joints.is_empty());
    let next = first.map(|topic| {
        let words = [
            "look".into(),
            arguments.record.clone().into_os_string(),
            "--topic".into(),
        ];
        let given = arguments.reading.given().into_iter().map(Into::into);
        command_line(words.into_iter().chain([topic.name.clone().into()]).chain(given))
    });
    if arguments.json {
        let object = |topic: &Topic| {
            json!({ "name": topic.name, "type": topic.kind, "messages": topic.messages, "joints": topic.joints,
                "problem": topic.problem })
        };
        let topics: Vec<_> = topics.iter().map(object).collect();
        return print(
            &json!({ "topics": topics, "next": next.map(|command| json!({ "command": command })) }).to_string(),
        );
    }
    let lines = topics.iter().map(|topic| readable(&topic.to_string()));
    let last = [String::new(), format!("next: {}", next.unwrap_or_default())];
    print(&lines.chain(last).collect::<Vec<_>>().join("\n"))
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let inputs = arguments.input.as_deref().map(arguments::columns).unwrap_or_default();
    arguments::distinct_inputs(&inputs, arguments.output.as_deref())?;
    prepare([&arguments.record], [], &arguments.report)?;
    let file = match arguments.reading.read(&arguments.record) {
        Err(error) => return list_topics(arguments, error),
        Ok(file) => file,
    };
    let output = arguments.output.as_deref();
    let in_use: Vec<&str> = inputs.iter().copied().chain(output).collect();
    let request = Request {
        time: arguments.reading.instants(&file, &in_use)?,
        sample_time: arguments.sample_time,
        inputs: &inputs,
        output,
    };
    let inspection = spinning("looking", || Inspection::new(&file, &request))?;
    let next = inspection.suggestion.as_ref().map(|s| arguments.typed(s));
    if let Some(path) = &arguments.report {
        write_text(path, &inspection.html(next.clone(), Some(this_command()))?)?;
    }
    if arguments.json {
        return print(&inspection.json(next).to_string());
    }
    let next = match (next, &inspection.either) {
        (None, Some(either)) => {
            let line =
                |(when, suggestion): &(&str, Suggestion)| format!("next, {when}: {}", arguments.typed(suggestion));
            either.each_ref().map(line).join("\n")
        }
        (next, _) => format!("next: {}", next.unwrap_or_else(|| inspection.remedy.to_owned())),
    };
    print_result(
        &inspection.summary(),
        wrote(&arguments.report).chain([String::new(), next]),
    )
}
