//! `--stream`, which reads a record in parts.

use std::path::Path;

use anyhow::anyhow;
use flexure_io::usual_memory;

use crate::arguments::Usage;
use crate::reading::Reading;

fn is_parquet(record: &Path) -> bool {
    let extension = record.extension();
    extension.is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"))
}

/// The memory for a record that is read in parts, bytes; `least` is what the computation needs, and `known` are
/// the options on reading that it knows.
///
/// # Errors
/// Wrong usage for less memory, for other options on reading, and for files that cannot be read in parts.
pub fn memory(record: &Path, reading: &Reading, known: &[&str], least: u64) -> Result<u64, Usage> {
    let given = reading.kept();
    if let Some(option) = given.keys().find(|option| !known.contains(&option.as_str())) {
        return Err(Usage(format!(
            "--stream reads Parquet files as they are; leave out --{option}"
        )));
    }
    let memory = reading.memory().unwrap_or_else(|| usual_memory().max(least));
    if memory < least {
        let least = least >> 20;
        return Err(Usage(format!("--memory: --stream takes {least}MiB or more")));
    }
    if !is_parquet(record) {
        return Err(Usage(
            "--stream reads Parquet files; flexure prepare RECORD -o RECORD.parquet makes one of what fits into memory"
                .to_owned(),
        ));
    }
    Ok(memory)
}

/// Extends the error of a record that is too large: it names the option that reads the record in parts, if the command `can` do that.
pub fn with_stream(error: anyhow::Error, record: &Path, can: bool) -> anyhow::Error {
    match error.downcast_ref() {
        Some(flexure_io::Error::TooLarge { .. }) if can && is_parquet(record) => {
            anyhow!("{error}, and --stream reads it in parts")
        }
        _ => error,
    }
}
