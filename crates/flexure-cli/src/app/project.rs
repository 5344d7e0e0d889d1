//! A project: a folder of records, models and pages.

use std::collections::HashSet;
use std::fs::{self, OpenOptions};
use std::io::{self, Read};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::UNIX_EPOCH;

use flexure_io::{Format, write_atomically};
use serde_json::{Value, json};

/// The longest name of a file, bytes: what file systems take, with room for a number.
const LONGEST_NAME: usize = 200;
/// The largest number that is appended to a name to make it free.
const MOST_NUMBER: usize = 10_000;
/// The most bytes of a file that are looked at to tell what it is.
const BEGINNING: u64 = 4096;

/// A folder, and the names in it that are promised to commands which still run.
pub struct Project {
    pub folder: PathBuf,
    largest: u64,
    promised: Mutex<HashSet<String>>,
}

/// What is wrong with a name for a file.
pub fn no_name(name: &str) -> String {
    format!(
        "'{name}' is no name for a file; leave out slashes, colons and leading dots, and take at most {LONGEST_NAME} bytes"
    )
}

/// Why a file is not taken.
pub enum Refusal {
    Name,
    Size,
    Failed(String),
}

impl Project {
    pub fn new(folder: PathBuf, largest: u64) -> Self {
        Project {
            folder,
            largest,
            promised: Mutex::default(),
        }
    }

    /// The file of this name; `None` if the name cannot be that of a file in the folder.
    pub fn path(&self, name: &str) -> Option<PathBuf> {
        let is_plain = |c: char| !(c.is_control() || "/\\:".contains(c));
        let good = !name.is_empty()
            && name.len() <= LONGEST_NAME
            && !name.starts_with(['.', '-'])
            && name.chars().all(is_plain);
        good.then(|| self.folder.join(name))
    }

    /// The files, by name, each with what it is, its bytes, and when it was last written (s since 1970).
    pub fn files(&self) -> flexure_io::Result<Vec<Value>> {
        let mut files = Vec::new();
        let entries = fs::read_dir(&self.folder).map_err(|cause| flexure_io::Error::Read {
            path: self.folder.clone(),
            cause,
        })?;
        for entry in entries.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let Ok(found) = entry.metadata() else { continue };
            if found.is_file() && self.path(&name).is_some() {
                let modified = found.modified().ok().and_then(|at| at.duration_since(UNIX_EPOCH).ok());
                files.push((name, found.len(), modified.map(|since| since.as_secs_f64())));
            }
        }
        files.sort_by(|a, b| a.0.cmp(&b.0));
        let object = |(name, size, modified): (String, u64, Option<f64>)| {
            let kind = self.kind(&name);
            json!({ "kind": kind, "name": name, "size": size, "modified": modified })
        };
        Ok(files.into_iter().map(object).collect())
    }

    /// What a file is, by its name and, of JSON, its beginning.
    fn kind(&self, name: &str) -> &'static str {
        let extension = name
            .rsplit_once('.')
            .map_or("", |(_, extension)| extension)
            .to_ascii_lowercase();
        match extension.as_str() {
            "csv" if self.begins(name, is_curve) => "curve",
            "html" => "page",
            "json" if self.begins(name, |text| text.contains("\"flexure-model\"")) => "model",
            "toml" if self.begins(name, |text| text.lines().any(|line| line.trim() == "[arm]")) => "arm",
            _ if Format::of(name).is_some() => "record",
            _ => "file",
        }
    }

    fn begins(&self, name: &str, test: fn(&str) -> bool) -> bool {
        let mut start = Vec::new();
        let file = fs::File::open(self.folder.join(name));
        let read = file.and_then(|file| file.take(BEGINNING).read_to_end(&mut start));
        read.is_ok() && test(&String::from_utf8_lossy(&start))
    }

    /// Reserves free names: `names` with one common number, none of which exists or is promised yet. The names of headers are reserved too.
    pub fn promise(&self, names: &[&str]) -> Option<Vec<String>> {
        let mut promised = self.promised.lock().unwrap_or_else(PoisonError::into_inner);
        let free = |name: &String| {
            !promised.contains(name) && self.path(name).is_some_and(|path| path.symlink_metadata().is_err())
        };
        let numbered = |number: usize| names.iter().map(|name| with_number(name, number)).collect();
        let chosen: Vec<String> = (1..MOST_NUMBER).map(numbered).find(|names: &Vec<String>| {
            names
                .iter()
                .all(|name| free(name) && header(name).as_ref().is_none_or(free))
        })?;
        promised.extend(chosen.iter().filter_map(|name| header(name)));
        promised.extend(chosen.iter().cloned());
        Some(chosen)
    }

    /// Names are no longer promised.
    pub fn release<'a>(&self, names: impl IntoIterator<Item = &'a String>) {
        let mut promised = self.promised.lock().unwrap_or_else(PoisonError::into_inner);
        for name in names {
            promised.remove(name);
            header(name).map(|header| promised.remove(&header));
        }
    }

    /// Keeps what is uploaded, under the name that it gets.
    pub fn keep(&self, name: &str, length: u64, content: &mut dyn Read) -> Result<String, Refusal> {
        if length > self.largest {
            return Err(Refusal::Size);
        }
        let name = self.promise(&[name]).and_then(|names| names.into_iter().next());
        let name = name.ok_or(Refusal::Name)?;
        let path = self.folder.join(&name);
        let written = write_atomically(&path, |out| match io::copy(content, out)? == length {
            true => Ok(()),
            false => Err(io::Error::other("the upload ended early")),
        });
        self.release([&name]);
        match written {
            Ok(()) => Ok(name),
            Err(error) => Err(Refusal::Failed(error.to_string())),
        }
    }

    /// The file of this name, to be read.
    pub fn open(&self, name: &str) -> Option<fs::File> {
        let path = self.path(name)?;
        // No link leads out of the folder.
        let found = fs::symlink_metadata(&path).ok()?;
        match found.is_file() {
            true => OpenOptions::new().read(true).open(path).ok(),
            false => None,
        }
    }
}

/// The name with a number behind its stem, from the second on.
fn with_number(name: &str, number: usize) -> String {
    let (stem, extension) = name.split_at(name.rfind('.').unwrap_or(name.len()));
    match number {
        1 => name.to_owned(),
        number => format!("{stem}-{number}{extension}"),
    }
}

/// The header that an export writes next to a C file.
pub fn header(name: &str) -> Option<String> {
    name.strip_suffix(".c").map(|stem| format!("{stem}.h"))
}

/// Whether a table is a curve or a surface with its band.
fn is_curve(text: &str) -> bool {
    let names = text.lines().next().unwrap_or_default().split(',');
    let mut names = names.map(|name| name.trim().trim_matches('"').split(" [").next().unwrap_or_default());
    names.nth(1).is_some() && names.any(|name| name == "lower") && names.any(|name| name == "upper")
}
