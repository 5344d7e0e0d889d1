//! One model per machine, over a data set of many: the machines are found and identified in parallel, and their results put in a table.
//!
//! Each machine's results are written to a file as soon as they are known, so that a stopped run can be continued. A machine whose record
//! cannot be used gets a row with its error; the others go on.

use std::collections::{BTreeMap, HashSet};
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context as _, Result, bail};
use flexure::Record;
use flexure::simulation::batch;
use flexure::text::shown_path;
use flexure_io::{FORMATS, Format, ReadOptions, RecordFile, Row, make_folder, usual_memory, write_atomically};
use serde_json::{Value, json};

/// A machine of a data set.
#[derive(Debug, Clone)]
pub struct Member {
    /// What distinguishes it from the others.
    pub key: String,
    source: Source,
}

/// Where a machine's record is.
#[derive(Debug, Clone)]
enum Source {
    /// The record is in its own file. The number is the most memory for the record, bytes.
    File(PathBuf, u64),
    /// The record is in some rows of a file with several machines.
    Rows(Arc<RecordFile>, Vec<usize>),
}

impl Member {
    /// Its record.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn read(&self) -> Result<RecordFile> {
        match &self.source {
            Source::File(path, memory) => Ok(reading(Some(*memory)).read(path)?),
            Source::Rows(file, rows) => {
                let part =
                    |(name, samples): (&str, &[f64])| (name.to_owned(), rows.iter().map(|&i| samples[i]).collect());
                let record = Record::new(file.record.columns().map(part))?;
                Ok(RecordFile::in_memory(
                    record,
                    &format!("{} of {}", self.key, file.name()),
                ))
            }
        }
    }

    /// A rough measure of the work.
    fn size(&self) -> u64 {
        match &self.source {
            Source::File(path, _) => fs::metadata(path).map_or(0, |meta| meta.len()),
            Source::Rows(file, rows) => (rows.len() * file.record.names().len() * size_of::<f64>()) as u64,
        }
    }
}

/// The reading options for records that may take `memory` bytes.
fn reading(memory: Option<u64>) -> ReadOptions {
    ReadOptions {
        memory,
        ..ReadOptions::default()
    }
}

/// The machines of a data set, in the order of their keys: a file with a column `by` whose numbers distinguish them; or a folder, searched
/// with its subfolders, with folders `by=KEY` or with one file per machine that has its name. `memory` is the most for a file; by default
/// the threads share the usual memory. The folder of the `results` is not searched.
///
/// # Errors
/// Names the data set where it cannot be read, has no machine, or has two of one key.
pub fn members(dataset: &Path, by: &str, memory: Option<u64>, results: &Path) -> Result<Vec<Member>> {
    let mut members = match dataset.is_dir() {
        true => of_folder(dataset, by, memory, results)?,
        false => of_file(dataset, by, memory)?,
    };
    members.sort_by(|a, b| in_order(&a.key, &b.key));
    let mut keys = HashSet::new();
    if let Some(twice) = members.iter().find(|member| !keys.insert(member.key.as_str())) {
        bail!(
            "{}: there are two records of {by} '{}'; put the files of one machine together, or tell them apart",
            shown_path(dataset),
            twice.key
        );
    }
    if members.is_empty() {
        let extensions: Vec<&str> = FORMATS
            .iter()
            .flat_map(|format| format.extensions.iter().copied())
            .collect();
        bail!(
            "{}: no record is in this folder; looked for are files that end in .{}",
            shown_path(dataset),
            extensions.join(", .")
        );
    }
    Ok(members)
}

/// Orders numbers by size, before texts by their letters.
fn in_order(a: &str, b: &str) -> std::cmp::Ordering {
    match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(x), Ok(y)) => x.total_cmp(&y).then_with(|| a.cmp(b)),
        (x, y) => y.is_ok().cmp(&x.is_ok()).then_with(|| a.cmp(b)),
    }
}

fn of_folder(folder: &Path, by: &str, memory: Option<u64>, results: &Path) -> Result<Vec<Member>> {
    let threads = std::thread::available_parallelism().map_or(1, |threads| threads.get() as u64);
    let memory = memory.unwrap_or_else(|| usual_memory() / threads);
    let mut members = Vec::new();
    let mut open = vec![folder.to_owned()];
    // Links may lead in circles.
    let mut seen: HashSet<PathBuf> = results.canonicalize().into_iter().collect();
    while let Some(folder) = open.pop() {
        if !folder.canonicalize().is_ok_and(|folder| seen.insert(folder)) {
            continue;
        }
        let entries = fs::read_dir(&folder).with_context(|| format!("cannot read {}", shown_path(&folder)))?;
        for entry in entries {
            let path = entry
                .with_context(|| format!("cannot read {}", shown_path(&folder)))?
                .path();
            let name = path
                .file_name()
                .map(|name| name.to_string_lossy().into_owned())
                .unwrap_or_default();
            // By the convention of data sets, such names are no data.
            if name.starts_with(['.', '_']) {
                continue;
            }
            if path.is_dir() {
                open.push(path);
            } else if path.is_file() && Format::of(&path).is_some() {
                let key = key_of(&path, by);
                let source = Source::File(path, memory);
                members.push(Member { key, source });
            }
        }
    }
    Ok(members)
}

/// The key of a file: from a folder `by=KEY` above it, or the file's name.
fn key_of(path: &Path, by: &str) -> String {
    let parts = path.iter().map(|part| part.to_string_lossy().into_owned());
    let of_part = |part: String| Some(part.strip_prefix(by)?.strip_prefix('=')?.to_owned());
    let stem = || path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let folders: Vec<String> = parts.filter_map(of_part).collect();
    folders.into_iter().next_back().or_else(stem).unwrap_or_default()
}

fn of_file(path: &Path, by: &str, memory: Option<u64>) -> Result<Vec<Member>> {
    let file = reading(memory).read(path)?;
    let keys = file.finite(by).with_context(|| {
        format!("--by {by} must be a column of numbers; keys that are text are folders {by}=KEY, or the names of files in a folder")
    })?;
    let mut rows: BTreeMap<u64, (f64, Vec<usize>)> = BTreeMap::new();
    for (i, &key) in keys.iter().enumerate() {
        rows.entry(key.to_bits()).or_insert_with(|| (key, Vec::new())).1.push(i);
    }
    let file = Arc::new(file);
    let member = |(key, rows): (f64, Vec<usize>)| Member {
        key: key.to_string(),
        source: Source::Rows(Arc::clone(&file), rows),
    };
    Ok(rows.into_values().map(member).collect())
}

/// The result for a machine: its row in the table, and the text of its model file.
pub struct Outcome {
    /// Values by their names.
    pub row: Row,
    /// The model.
    pub model: String,
}

/// A folder of results, and what was asked for.
pub struct Fleet<'a> {
    /// The folder.
    pub results: &'a Path,
    /// What distinguishes machines.
    pub by: &'a str,
    /// Everything except the records on which the results depend.
    pub asked: &'a [String],
}

/// The counts of a run over the machines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// The machines.
    pub members: usize,
    /// Those that were done in an earlier run.
    pub kept: usize,
    /// Those that have no model.
    pub failed: usize,
}

impl Fleet<'_> {
    /// Makes the folder, or continues with one that was begun with the same choices.
    ///
    /// # Errors
    /// For a folder begun with other choices, or one with other content.
    pub fn open(&self) -> Result<()> {
        let asked = json!({ "by": self.by, "asked": self.asked, "version": env!("CARGO_PKG_VERSION") });
        let path = self.results.join(BEGUN);
        match fs::read_to_string(&path) {
            Ok(text) if serde_json::from_str::<Value>(&text).is_ok_and(|begun| begun == asked) => Ok(()),
            Ok(_) => bail!(
                "{}: these results were begun with other choices, or by another version; write to another folder, or remove this one",
                shown_path(self.results)
            ),
            Err(_) => {
                let mut there = fs::read_dir(self.results).into_iter().flatten();
                if there.next().is_some() {
                    bail!(
                        "{}: this folder has other files; write to one that is new or empty",
                        shown_path(self.results)
                    );
                }
                make_folder(self.results.join(ROWS))?;
                make_folder(self.results.join(MODELS))?;
                Ok(write_atomically(&path, |out| writeln!(out, "{asked:#}"))?)
            }
        }
    }

    /// Identifies every machine that has no model yet, in parallel, the largest first. `done` is called with the numbers of done machines
    /// and of all. Returns all rows in the order of `members`, for any number of threads.
    ///
    /// # Errors
    /// Only if results cannot be written or read.
    pub fn run(
        &self,
        members: &[Member],
        identify: impl Fn(RecordFile) -> Result<Outcome> + Sync,
        done: impl Fn(usize, usize) + Sync,
    ) -> Result<(Vec<Row>, Counts)> {
        let kept: Vec<bool> = members.iter().map(|member| self.kept(member).is_some()).collect();
        let mut jobs: Vec<&Member> = members
            .iter()
            .zip(&kept)
            .filter(|(_, kept)| !**kept)
            .map(|(m, _)| m)
            .collect();
        jobs.sort_by_key(|member| std::cmp::Reverse(member.size()));
        let count = std::sync::atomic::AtomicUsize::new(0);
        let ran: Vec<Result<()>> = batch(&jobs, |member| {
            let written = self.one(member, &identify);
            done(1 + count.fetch_add(1, std::sync::atomic::Ordering::Relaxed), jobs.len());
            written
        });
        ran.into_iter().collect::<Result<()>>()?;
        let rows: Vec<Row> = members.iter().map(|member| self.row(member)).collect::<Result<_>>()?;
        let counts = Counts {
            members: members.len(),
            kept: kept.iter().filter(|kept| **kept).count(),
            failed: rows.iter().filter(|row| is_failed(row)).count(),
        };
        Ok((rows, counts))
    }

    /// Identifies a machine, and writes its results.
    fn one(&self, member: &Member, identify: &impl Fn(RecordFile) -> Result<Outcome>) -> Result<()> {
        let mut row: Row = vec![(self.by.to_owned(), json!(member.key))];
        match member.read().and_then(identify) {
            Ok(outcome) => {
                let name = format!("{}.json", file_name(&member.key));
                let model = self.results.join(MODELS).join(&name);
                write_atomically(&model, |out| out.write_all(outcome.model.as_bytes()))?;
                row.push(("status".to_owned(), json!("done")));
                row.push(("error".to_owned(), Value::Null));
                row.extend(outcome.row);
                row.push(("model".to_owned(), json!(format!("{MODELS}/{name}"))));
            }
            Err(error) => {
                row.push(("status".to_owned(), json!("failed")));
                row.push(("error".to_owned(), json!(format!("{error:#}"))));
            }
        }
        let text = serde_json::to_string(&row)?;
        Ok(write_atomically(self.path(member), |out| {
            out.write_all(text.as_bytes())
        })?)
    }

    /// The row of an earlier run, if it has a model: failed machines are tried again.
    fn kept(&self, member: &Member) -> Option<Row> {
        self.row(member).ok().filter(|row| !is_failed(row))
    }

    fn row(&self, member: &Member) -> Result<Row> {
        let path = self.path(member);
        let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", shown_path(&path)))?;
        serde_json::from_str(&text).with_context(|| format!("{}: this is no row; remove the file", shown_path(&path)))
    }

    fn path(&self, member: &Member) -> PathBuf {
        self.results.join(ROWS).join(format!("{}.json", file_name(&member.key)))
    }
}

/// The file with the choices with which the results were begun.
const BEGUN: &str = "fleet.json";
/// The folder of rows, and that of models.
const ROWS: &str = "rows";
const MODELS: &str = "models";

fn is_failed(row: &Row) -> bool {
    row.iter().any(|(name, value)| name == "status" && value == "failed")
}

/// A key as a file's name: letters, digits and `_-.` as they are, all other bytes as numbers.
fn file_name(key: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"_-".contains(&b);
    let first_dot = key.starts_with('.');
    let part = |(i, b): (usize, u8)| match plain(b) || (b == b'.' && !(i == 0 && first_dot)) {
        true => char::from(b).to_string(),
        false => format!("%{b:02X}"),
    };
    key.bytes().enumerate().map(part).collect()
}

/// The single values of an object: numbers, text and truth values, values of inner objects have their names after a dot.
pub fn single_values(object: &Value) -> Row {
    let mut row = Row::new();
    let mut open: Vec<(String, &Value)> = vec![(String::new(), object)];
    while let Some((name, value)) = open.pop() {
        match value {
            Value::Object(inner) => {
                let named = |own: &String| {
                    if name.is_empty() {
                        own.clone()
                    } else {
                        format!("{name}.{own}")
                    }
                };
                open.extend(inner.iter().rev().map(|(own, value)| (named(own), value)));
            }
            Value::Number(_) | Value::String(_) | Value::Bool(_) => row.push((name, value.clone())),
            Value::Array(_) | Value::Null => {}
        }
    }
    row
}

/// A list of texts, joined to one text.
pub fn joined(list: &Value) -> Value {
    let texts = list.as_array().into_iter().flatten().filter_map(Value::as_str);
    json!(texts.collect::<Vec<_>>().join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_files_that_differ_and_stay_in_their_folder() {
        assert_eq!(file_name("3"), "3");
        assert_eq!(file_name("a.b-c_D"), "a.b-c_D");
        assert_eq!(file_name("../up"), "%2E.%2Fup");
        assert_eq!(file_name("ä b"), "%C3%A4%20b");
        let mut keys = ["b", "10", "9", "-1", "a"];
        keys.sort_by(|a, b| in_order(a, b));
        assert_eq!(keys, ["-1", "9", "10", "a", "b"]);
    }

    #[test]
    fn single_values_have_the_names_of_what_they_are_in() {
        let object = json!({ "a": 1, "b": { "c": "x", "d": [1, 2], "e": { "f": true } }, "g": null });
        let want = [("a", json!(1)), ("b.c", json!("x")), ("b.e.f", json!(true))];
        assert_eq!(
            single_values(&object),
            want.map(|(name, value)| (name.to_owned(), value))
        );
    }
}
