//! The files of a command: none is written over one that is read, or twice.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Result;
use flexure::text::shown_path;
use flexure_io::{check_record_writable, check_writable, destination, write_atomically};
use serde_json::{Value, json};

use crate::arguments::Usage;

/// Before anything is computed, refuses files that cannot be written: `records` will be tables, `others` text.
pub fn prepare<'a>(
    inputs: impl IntoIterator<Item = &'a PathBuf>,
    records: impl IntoIterator<Item = &'a PathBuf>,
    others: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<()> {
    let (records, others): (Vec<_>, Vec<_>) = (records.into_iter().collect(), others.into_iter().collect());
    keep_apart(inputs, records.iter().chain(&others).copied())?;
    let is_dash = |path: &&PathBuf| path.as_os_str() == "-";
    let a_name = match (records.iter().any(is_dash), others.iter().any(is_dash)) {
        (true, _) => Some("a name that ends in .csv or .parquet"),
        (_, true) => Some("a name, such as /dev/stdout"),
        _ => None,
    };
    if let Some(a_name) = a_name {
        return Err(Usage(format!("'-' names no file to write; give {a_name}")).into());
    }
    for path in records {
        check_record_writable(path)?;
    }
    for path in others {
        check_writable(path)?;
    }
    Ok(())
}

/// Writes a text, whole or not at all.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    Ok(write_atomically(path, |out| out.write_all(text.as_bytes()))?)
}

/// The lines that say what was written.
pub fn wrote<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> impl Iterator<Item = String> {
    paths.into_iter().map(|path| format!("wrote {}", shown_path(path)))
}

/// The name of a file as JSON; null where none was asked for.
pub fn name_json(path: &Option<PathBuf>) -> Value {
    json!(path.as_ref().map(|path| path.display().to_string()))
}

/// Refuses outputs that are one of the inputs, or one another.
///
/// Links and different spellings of a path are seen through, where the file or its folder exists.
pub fn keep_apart<'a>(
    inputs: impl IntoIterator<Item = &'a PathBuf>,
    outputs: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<(), Usage> {
    let inputs: Vec<PathBuf> = inputs.into_iter().map(|path| resolved(path)).collect();
    let mut written: Vec<PathBuf> = Vec::new();
    for path in outputs {
        let place = resolved(path);
        let shown = shown_path(path);
        // Special files, such as /dev/null, may be written.
        if path.exists() && !path.is_file() {
            continue;
        }
        if inputs.contains(&place) {
            return Err(Usage(format!(
                "{shown} is read and would be overwritten; give the output another name"
            )));
        }
        if written.contains(&place) {
            return Err(Usage(format!(
                "{shown} would be written twice; give every output a name of its own"
            )));
        }
        written.push(place);
    }
    Ok(())
}

fn resolved(path: &Path) -> PathBuf {
    // A link to a file that is not there yet means that file.
    let path = &destination(path).unwrap_or_else(|_| path.to_owned());
    let in_folder = || {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
        Some(folder.join(path.file_name()?))
    };
    path.canonicalize()
        .ok()
        .or_else(in_folder)
        .unwrap_or_else(|| path.to_owned())
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::keep_apart;

    #[test]
    fn what_is_read_is_not_written_under_any_spelling_of_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("a.csv"), "u\n1\n").unwrap();
        let checked = |inputs: &[PathBuf], outputs: &[PathBuf]| keep_apart(inputs, outputs).map_err(|e| e.0);
        let input = [path("a.csv")];
        assert!(checked(&input, &[path("b.csv"), path("c.html")]).is_ok());
        for name in ["a.csv", "./a.csv", "x/../a.csv"] {
            std::fs::create_dir_all(path("x")).unwrap();
            let message = checked(&input, &[path(name)]).unwrap_err();
            assert!(message.contains("is read and would be overwritten"), "{message}");
        }
        let message = checked(&input, &[path("new.csv"), path("x/../new.csv")]).unwrap_err();
        assert!(message.contains("written twice"), "{message}");
    }

    #[cfg(unix)]
    #[test]
    fn links_are_seen_through_and_devices_may_be_named_twice() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("a.csv"), folder.path().join("l.csv"));
        std::fs::write(&file, "u\n1\n").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        assert!(keep_apart([&file], [&link]).is_err());
        let (new, dangling) = (folder.path().join("new.csv"), folder.path().join("d.csv"));
        std::os::unix::fs::symlink("new.csv", &dangling).unwrap();
        assert!(keep_apart([], [&new, &dangling]).is_err());
        let nowhere = PathBuf::from("/dev/null");
        assert!(keep_apart([&file], [&nowhere, &nowhere]).is_ok());
    }
}
