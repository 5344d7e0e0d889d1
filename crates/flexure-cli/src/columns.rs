//! Which columns of a record a system connects: those that are named, those of a model, or the only two that there are.

use anyhow::{Result, anyhow};
use flexure::text::{shortened, shown_path};
use flexure_io::{ModelFile, RecordFile};

use crate::arguments::{Usage, columns, distinct_inputs};
use crate::output::print_note;

/// The columns of a system's signals.
pub struct Connected {
    /// The inputs.
    pub inputs: Vec<String>,
    /// The output.
    pub output: String,
}

impl Connected {
    /// The columns that the options name. In a record with two signals, columns that are not named are found: the first is the input,
    /// unless the names are `y` and `u`. Constant columns are none.
    ///
    /// # Errors
    /// Wrong usage where the record leaves a choice: it lists the columns.
    pub fn of_record(
        file: &RecordFile,
        time: Option<&str>,
        inputs: Option<Vec<&str>>,
        output: Option<&str>,
    ) -> Result<Self> {
        let mut signals = file.signals(time);
        let given = |name: &str| {
            inputs
                .iter()
                .flatten()
                .chain(&output)
                .any(|given| file.meant(given) == name)
        };
        let is_constant = |name: &&str| {
            let repeats = |samples: &[f64]| samples.windows(2).all(|pair| pair[0] == pair[1]);
            !given(name) && file.record.column(name).is_ok_and(repeats)
        };
        let mut constant: Vec<&str> = signals.iter().copied().filter(is_constant).collect();
        match signals.len() - constant.len() {
            // Without them there is no system.
            0 | 1 => constant.clear(),
            _ => signals.retain(|name| !constant.contains(name)),
        }
        let (inputs, output) = match (inputs, output) {
            (Some(inputs), Some(output)) => (inputs, output),
            (inputs, output) => {
                let [first, second] = signals[..] else {
                    return Err(unnamed(file, &signals, inputs.is_some(), output.is_some()));
                };
                let other = |name: &str| if file.meant(name) == first { second } else { first };
                let (input, output) = match (inputs.as_deref(), output) {
                    (Some([input, ..]), _) => (*input, other(input)),
                    (_, Some(output)) => (other(output), output),
                    _ if [first, second] == ["y", "u"] => (second, first),
                    _ => (first, second),
                };
                let others = match &constant[..] {
                    [] => "the file has no other signals".to_owned(),
                    [name] => format!("'{}' is constant, and the file has no other signals", shortened(name)),
                    names => format!("{} other columns are constant", names.len()),
                };
                print_note(&format!(
                    "note: {}: the input is '{input}', the output '{output}'; {others} (--input and --output swap them)",
                    shown_path(&file.path)
                ));
                (inputs.unwrap_or(vec![input]), output)
            }
        };
        let inputs: Vec<String> = inputs.iter().map(|name| file.meant(name).to_owned()).collect();
        let output = file.meant(output).to_owned();
        let names: Vec<&str> = inputs.iter().map(String::as_str).collect();
        distinct_inputs(&names, Some(&output))?;
        Ok(Connected { inputs, output })
    }

    /// The columns that enter a model and its output: the model's own, unless options name others.
    ///
    /// # Errors
    /// Wrong usage for another number of inputs than the model has, and for a column that the record does not have.
    pub fn of_model(
        file: &RecordFile,
        model: &ModelFile,
        inputs: Option<&str>,
        output: Option<&str>,
    ) -> Result<Self, Usage> {
        let inputs = match inputs {
            Some(given) => model_inputs(model, given)?,
            None => model.inputs.iter().map(String::as_str).collect(),
        };
        let inputs: Vec<String> = inputs.iter().map(|name| file.meant(name).to_owned()).collect();
        let output = file.meant(output.unwrap_or(&model.output)).to_owned();
        let names: Vec<&str> = inputs.iter().map(String::as_str).collect();
        distinct_inputs(&names, Some(&output))?;
        Ok(Connected { inputs, output })
    }

    /// The inputs, borrowed.
    pub fn inputs(&self) -> Vec<&str> {
        self.inputs.iter().map(String::as_str).collect()
    }

    /// Inputs and output.
    pub fn all(&self) -> Vec<&str> {
        let mut all = self.inputs();
        all.push(&self.output);
        all
    }
}

/// The columns that enter a model: a list in `given` for a model of several inputs.
fn model_inputs<'a>(model: &ModelFile, given: &'a str) -> Result<Vec<&'a str>, Usage> {
    let needed = model.block.inputs();
    let names = match needed {
        1 => vec![given],
        _ => columns(given),
    };
    if names.len() != needed {
        return Err(Usage(format!(
            "--input names {} of the model's {needed} inputs; give them all, separated by commas, in the model's order: {}",
            names.len(),
            model.inputs.join(",")
        )));
    }
    Ok(names)
}

/// The record leaves open which columns are meant.
fn unnamed(file: &RecordFile, signals: &[&str], input: bool, output: bool) -> anyhow::Error {
    if signals.len() < 2 {
        let there = signals.first().map_or("there is no signal".to_owned(), |name| {
            format!("the only signal is {}", with_unit(file, name))
        });
        return anyhow!(
            "{}: {there}, but a system has an input and an output; if a column of instants or counts is one of them, name both by --input and --output",
            shown_path(&file.path)
        );
    }
    let missing = match (input, output) {
        (false, false) => "name the input by --input and the output by --output",
        (true, _) => "name the output by --output",
        (_, true) => "name the input by --input",
    };
    let more = signals.len().saturating_sub(LISTED);
    let mut listed: Vec<String> = signals.iter().take(LISTED).map(|name| with_unit(file, name)).collect();
    listed.extend((more > 0).then(|| format!("and {more} more")));
    let rises = file.nameless_instants().filter(|name| signals.contains(name));
    let rises = rises.map_or_else(String::new, |name| {
        format!("; '{name}' rises evenly: say --time {name} if it has the sample instants")
    });
    Usage(format!(
        "{}: the signals are {}; {missing}{rises}",
        shown_path(&file.path),
        listed.join(", ")
    ))
    .into()
}

/// Signals that a message lists.
const LISTED: usize = 20;

/// A column with its unit, where the file has it.
fn with_unit(file: &RecordFile, name: &str) -> String {
    match file.unit(name) {
        Some(unit) => format!("{} [{}]", shortened(name), shortened(unit)),
        None => shortened(name),
    }
}
