//! What can be wrong with an arm file.

use toml::de::{DeTable, DeValue};

use crate::error::NoMemory;

/// What was wrong with an arm file, where.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArmError {
    /// The text is not TOML, or a key is unknown, missing or of the wrong type.
    #[error("{file}{}: {message}", at(*line))]
    Format {
        /// The file, as it was named by the caller.
        file: String,
        /// The line, from 1.
        line: Option<usize>,
        /// What is wrong.
        message: String,
    },
    /// A value is missing or outside its range.
    #[error("{file}{}: {key}: {reason}", at(*line))]
    Value {
        /// The file, as it was named by the caller.
        file: String,
        /// The line, from 1, of the value or of the table it is missing from.
        line: Option<usize>,
        /// The key with its table; links and joints count from 1.
        key: String,
        /// What is wrong, with the value, its unit and its range.
        reason: String,
    },
    /// There is no preset of this name.
    #[error("no preset '{name}'; the presets are: {}", available.join(", "))]
    UnknownPreset {
        /// The name that was asked for.
        name: String,
        /// The names that exist.
        available: Vec<&'static str>,
    },
    /// The record with the excitation could not be loaded or does not fit.
    #[error("the excitation record '{record}': {reason}")]
    Record {
        /// The record's file, as the arm file names it.
        record: String,
        /// What is wrong.
        reason: String,
    },
    /// There is no memory for the simulated record.
    #[error(transparent)]
    Memory(#[from] NoMemory),
    /// The excitation or the simulation failed.
    #[error(transparent)]
    Simulation(#[from] flexure::Error),
}

impl ArmError {
    /// Says where in the arm file the excitation record was named, if it is that record that is wrong.
    ///
    /// `text` is the arm file's text, and `source_name` names the file, as in [`ArmFile::from_toml_str`].
    ///
    /// [`ArmFile::from_toml_str`]: super::ArmFile::from_toml_str
    pub fn located(self, text: &str, source_name: &str) -> Self {
        match self {
            ArmError::Record { .. } => {
                let key = "excitation.file";
                ArmError::Value {
                    file: source_name.to_owned(),
                    line: find_line(text, key),
                    key: key.to_owned(),
                    reason: self.to_string(),
                }
            }
            other => other,
        }
    }
}

fn at(line: Option<usize>) -> String {
    line.map_or(String::new(), |n| format!(", line {n}"))
}

/// The number, from 1, of the line that holds byte `offset`.
pub(super) fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|b| *b == b'\n').count()
}

/// The line of the value at `key`, such as `arm.link[2].mass`, or of the innermost table around it.
pub(super) fn find_line(text: &str, key: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let mut table = document.get_ref();
    let mut found = None;
    for segment in key.split('.') {
        let (name, number) = match segment.split_once('[') {
            Some((name, rest)) => (name, rest.trim_end_matches(']').parse::<usize>().ok()),
            None => (segment, None),
        };
        let Some((_, mut value)) = table.iter().find(|(k, _)| k.get_ref() == name) else {
            break;
        };
        if let (Some(number), DeValue::Array(items)) = (number, value.get_ref()) {
            let Some(item) = number.checked_sub(1).and_then(|i| items.get(i)) else {
                break;
            };
            value = item;
        }
        found = Some(line_of(text, value.span().start));
        match value.get_ref() {
            DeValue::Table(inner) => table = inner,
            _ => break,
        }
    }
    found
}
