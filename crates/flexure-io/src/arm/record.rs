//! The record that an arm file names.

use std::path::{Component, Path};

use crate::error::Error;
use crate::options::ReadOptions;
use crate::record_file::RecordFile;

/// Which records an arm file may name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Paths {
    /// Those in the arm file's folder and below: an arm from somebody else reads nothing else.
    #[default]
    Below,
    /// Any.
    All,
}

/// Reads the record `name` of an arm file in `folder`.
///
/// # Errors
/// Says what is wrong. No message quotes the content of a file outside the folder.
pub fn read_arm_record(
    folder: &Path,
    name: &str,
    paths: Paths,
    options: &ReadOptions,
) -> std::result::Result<RecordFile, String> {
    let path = folder.join(name);
    let below = is_below(folder, Path::new(name));
    if !below && paths == Paths::Below {
        return Err(
            "an arm file names a record in its own folder or below, without '..' or links that lead out; put it there, or, if you \
             trust the arm file, give --allow-paths (in Python allow_paths=True)"
                .to_owned(),
        );
    }
    if name == "-" {
        return Err("an arm file names a file, not the standard input".to_owned());
    }
    match options.read(&path) {
        Ok(mut file) => {
            file.is_foreign = !below;
            Ok(file)
        }
        Err(error) if below => Err(error.to_string()),
        Err(error) => Err(without_content(&error)),
    }
}

/// Whether `name` is relative, and its target lies below `folder`.
pub(super) fn is_below(folder: &Path, name: &Path) -> bool {
    let plain = |part: Component| matches!(part, Component::Normal(_) | Component::CurDir);
    if !name.components().all(plain) {
        return false;
    }
    let folder = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    // A file that does not exist passes here; reading it reports the error.
    match (folder.canonicalize(), folder.join(name).canonicalize()) {
        (Ok(folder), Ok(path)) => path.starts_with(folder),
        _ => true,
    }
}

/// What is wrong, without any content of the file.
fn without_content(error: &Error) -> String {
    match error {
        Error::Read { .. }
        | Error::TooLarge { .. }
        | Error::Truncated { .. }
        | Error::Empty { .. }
        | Error::AllSkipped { .. } => error.to_string(),
        _ => "it is no record that can be read".to_owned(),
    }
}
