//! Writes records as CSV or Parquet.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use flexure::Record;

use crate::atomic::{check_writable, write_atomically};
use crate::error::{Error, Result};
use crate::parquet_file;

/// Writes `record` to `path`, whole or not at all: CSV if it ends in `.csv`, Parquet if in `.parquet`.
///
/// Numbers are the shortest that read back as the same `f64`.
///
/// # Errors
/// [`Error::UnknownExtension`]; [`Error::Unwritable`] if the record has no column or no sample, or
/// if a name is empty or contains a line break; [`Error::Write`].
pub fn write_record(path: impl AsRef<Path>, record: &Record) -> Result<()> {
    write_record_with_units(path, record, &[])
}

/// [`write_record`], with the columns' units in their names: `q [rad]`. Columns after the end of `units` have none.
///
/// # Errors
/// As [`write_record`].
pub fn write_record_with_units(path: impl AsRef<Path>, record: &Record, units: &[Option<String>]) -> Result<()> {
    let path = path.as_ref();
    let write = writer(path)?;
    if let Some(problem) = unwritable(record) {
        return Err(Error::Unwritable {
            path: path.to_owned(),
            problem,
        });
    }
    let units = units.iter().map(Option::as_deref).chain(std::iter::repeat(None));
    let header = record.names().iter().zip(units).map(|(name, unit)| match unit {
        Some(unit) => format!("{name} [{unit}]"),
        None => name.clone(),
    });
    let header: Vec<String> = header.collect();
    write_atomically(path, |out| write(out, record, &header))
}

/// Refuses `path` if [`write_record`] would refuse it for every record. Writes nothing.
///
/// # Errors
/// [`Error::UnknownExtension`], and those of [`check_writable`].
pub fn check_record_writable(path: impl AsRef<Path>) -> Result<()> {
    writer(path.as_ref())?;
    check_writable(path)
}

/// Writes a record under these names.
type Writer = fn(&mut BufWriter<File>, &Record, &[String]) -> io::Result<()>;

/// The writer for the format that the extension of `path` names.
fn writer(path: &Path) -> Result<Writer> {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match extension.as_deref() {
        Some("csv") => Ok(csv),
        Some("parquet") => Ok(parquet_file::write),
        _ => Err(Error::UnknownExtension { path: path.to_owned() }),
    }
}

fn unwritable(record: &Record) -> Option<String> {
    if record.is_empty() {
        return Some("the record has no samples".to_owned());
    }
    let bad = record
        .names()
        .iter()
        .find(|n| n.trim().is_empty() || n.contains(['\n', '\r']))?;
    Some(format!(
        "the column name {bad:?} is empty or contains a line break; rename it"
    ))
}

fn csv<W: Write>(out: &mut W, record: &Record, header: &[String]) -> io::Result<()> {
    for (i, name) in header.iter().enumerate() {
        let separator = if i == 0 { "" } else { "," };
        if is_plain(name) {
            write!(out, "{separator}{name}")?;
        } else {
            write!(out, "{separator}\"{}\"", name.replace('"', "\"\""))?;
        }
    }
    out.write_all(b"\n")?;
    let columns: Vec<&[f64]> = record.columns().map(|(_, samples)| samples).collect();
    for sample in 0..record.len() {
        for (i, column) in columns.iter().enumerate() {
            let separator = if i == 0 { "" } else { "," };
            // Debug is the shortest text that reads back exactly, with an exponent where that is shorter.
            write!(out, "{separator}{:?}", column[sample])?;
        }
        out.write_all(b"\n")?;
    }
    Ok(())
}

/// Whether a name needs no quotation marks to be read back as this name.
fn is_plain(name: &str) -> bool {
    name.chars().all(|c| c.is_alphanumeric() || "_-./".contains(c)) && name.parse::<f64>().is_err()
}
