//! Records from files.

use std::path::PathBuf;

use flexure_io::{Decimal, ReadOptions};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::columns;
use crate::errors::of_any;
use crate::names::known;
use crate::run::interruptible;

/// Reads a record: its columns, and what was decided.
#[pyfunction]
#[pyo3(signature = (path, topic=None, joint=None, separator=None, decimal=None, header=None, skip_lines=0, time_format=None, missing_text=None, memory=None))]
#[allow(clippy::too_many_arguments)] // The options of the command line.
pub fn read_record<'py>(
    py: Python<'py>,
    path: PathBuf,
    topic: Option<String>,
    joint: Option<String>,
    separator: Option<char>,
    decimal: Option<&str>,
    header: Option<bool>,
    skip_lines: u64,
    time_format: Option<String>,
    missing_text: Option<Vec<String>>,
    memory: Option<u64>,
) -> PyResult<(Bound<'py, PyDict>, Vec<String>)> {
    let signs = |name: &str| match name {
        "point" => Some(Decimal::Point),
        "comma" => Some(Decimal::Comma),
        _ => None,
    };
    let decimal = decimal.map(|name| known("decimal sign", name, &["point", "comma"], signs));
    let options = ReadOptions {
        separator,
        decimal: decimal.transpose()?,
        header,
        skip: skip_lines,
        missing_texts: missing_text.unwrap_or_default(),
        time_format,
        topic,
        joint,
        memory,
    };
    let file = interruptible(py, move |_| options.read(path))?;
    let file = file.map_err(|error| of_any(&error.into()))?;
    Ok((columns(py, &file.record)?, file.notes))
}
