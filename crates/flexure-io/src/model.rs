//! Model files: JSON that carries everything needed to predict.

mod mark;
mod version1;

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use flexure::Block;
use flexure::validation::Estimated;
use serde::{Deserialize, Serialize};
use serde_json::error::Category;

use crate::atomic::write_atomically;
use crate::error::{Error, Result};
use crate::memory::{LONGEST_MODEL, small_file};
pub use mark::{ColumnChecksum, RecordMark};

/// What `format` says in every model file.
pub(crate) const FORMAT: &str = "flexure-model";
/// The version of the format that is written; [`version1`] is read too.
const VERSION: u64 = 2;

/// An identified model, as kept in a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelFile {
    /// The version of Flexure that wrote the model; see [`ModelFile::CURRENT`].
    pub flexure: String,
    /// The structure's name, for example "hammerstein".
    pub structure: String,
    /// The identification method's name, for example "plain".
    pub method: String,
    /// The names of the input columns.
    pub inputs: Vec<String>,
    /// The name of the output column.
    pub output: String,
    /// The units of inputs and output by their columns' names, where they are known.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub units: BTreeMap<String, String>,
    /// The sample time, s; positive. `None` where it is not known: one sample is the unit of time.
    #[serde(default)]
    pub sample_time: Option<f64>,
    /// The delay, samples.
    pub delay: usize,
    /// The order of the linear part.
    pub order: usize,
    /// The model itself.
    pub block: Block,
    /// The names of the model's blocks, path by path, each path in the order in which its blocks stand in the model. Offsets have no
    /// names.
    #[serde(default)]
    pub paths: Vec<ModelPath>,
    /// Whether the structure is a sum of paths, even where it has only one.
    #[serde(default)]
    pub is_sum: bool,
    /// The samples after which a prediction no longer depends on the unknown state at its start.
    #[serde(default)]
    pub settling: Option<usize>,
    /// The autoregression 1, r_1, r_2, ... that whitens the output error, for predictions from the measured output. `None` without
    /// a model of the noise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_model: Option<Vec<f64>>,
    /// What the model was estimated from, for the limits of its residual tests. `None` where they do not allow for its own error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimated: Option<Estimated>,
    /// The reading options that the record needed, by the names of the program's options. Similar records are read with them by default.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub reading: BTreeMap<String, String>,
    /// Whether outputs could be missing, as NaN, in the record. They may then be missing in records like it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub missing: bool,
    /// Whether outliers of the output were left out. They may then be left out in records like it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub robust: bool,
    /// The records that the model was identified from, one an experiment; empty where that is not known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub records: Vec<RecordMark>,
    /// How the model was identified, for readers; nothing that predicting needs.
    #[serde(default)]
    pub identification: serde_json::Value,
}

/// The names of blocks in series.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelPath {
    /// The columns that enter the first block.
    pub inputs: Vec<String>,
    /// The blocks.
    pub blocks: Vec<BlockLabel>,
}

/// The name of a block, and further facts about it that the block itself does not hold.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct BlockLabel {
    /// Its role, for example "front".
    pub role: String,
    /// Its heading, for example "Front linear part"; empty in files of earlier versions.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub title: String,
    /// The ends of the pieces of a spline, increasing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub breakpoints: Vec<f64>,
    /// Points at which the slope of a spline changes at once, increasing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kinks: Vec<f64>,
    /// Standard errors of a linear block's numerator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub b_errors: Option<Vec<f64>>,
    /// Standard errors of its denominator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub a_errors: Option<Vec<f64>>,
    /// The covariance of its coefficients, row by row: first those of b after the delay, then those of a from the second on. Empty where it is
    /// not known, as in files of earlier versions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub covariance: Vec<f64>,
}

impl ModelFile {
    /// Whether the model was identified from these samples: they are its record, or a whole experiment of it.
    pub fn was_identified_from(&self, mark: &RecordMark) -> bool {
        self.records.iter().any(|own| own.same_samples(mark))
    }

    /// This version of Flexure, for [`ModelFile::flexure`].
    pub const CURRENT: &str = env!("CARGO_PKG_VERSION");

    /// What is wrong with the values, beyond what their types exclude.
    fn problem(&self) -> Option<String> {
        if let Some(h) = self.sample_time
            && !(h > 0.0 && h.is_finite())
        {
            return Some(format!("sample_time is {h}, but must be positive and finite, or null"));
        }
        if let Some(noise) = &self.noise_model
            && noise.first() != Some(&1.0)
        {
            return Some(format!("noise_model is {noise:?}, but must start with 1, or be null"));
        }
        if let Some(problem) = block_problem(&self.block) {
            return Some(problem);
        }
        let names = self.inputs.iter().map(|name| ("an input", name));
        let empty = names
            .chain([("output", &self.output)])
            .find(|(_, name)| name.is_empty());
        if let Some((which, _)) = empty {
            return Some(format!("{which} is empty, but must be a column's name"));
        }
        let (names, needed) = (self.inputs.len(), self.block.inputs());
        (names != needed).then(|| format!("inputs has {names} names, but the model has {needed} inputs"))
    }
}

/// Why a block cannot be simulated.
fn block_problem(block: &Block) -> Option<String> {
    match block {
        Block::Static(_) | Block::Surface(_) => None,
        Block::Offset(offset) if offset.is_finite() => None,
        Block::Offset(offset) => Some(format!(
            "its offset is {offset}, but must be finite; identify the model again"
        )),
        Block::Feedback(model) => model.problem(),
        Block::Narx(model) => model.problem(),
        Block::Volterra(model) => model.problem(),
        Block::Linear(system) if system.is_stable_or_integrates() => None,
        Block::Linear(system) => Some(format!(
            "its linear part with a = {:?} is unstable, so its output would grow without bound; identify the model again",
            system.a()
        )),
        Block::Series(blocks) | Block::Parallel(blocks) | Block::Inputs(blocks) if blocks.is_empty() => {
            Some("it contains no block; identify the model again".to_owned())
        }
        Block::Series(blocks) | Block::Parallel(blocks) | Block::Inputs(blocks) => {
            blocks.iter().find_map(block_problem)
        }
    }
}

/// A model file as it stands in the file.
#[derive(Serialize)]
struct OnDisk<'a> {
    format: &'static str,
    version: u64,
    #[serde(flatten)]
    model: &'a ModelFile,
}

/// The fields that show whether the rest can be understood.
#[derive(Deserialize)]
struct Head {
    #[serde(default)]
    format: serde_json::Value,
    #[serde(default)]
    version: serde_json::Value,
}

/// Reads a model file of at most 256 MiB; from the standard input if `path` is `-`.
///
/// # Errors
/// [`Error::Read`]; [`Error::TooLarge`]; [`Error::Json`] for text that is not JSON, fields that are missing or of the wrong
/// kind, and numbers that are not finite; [`Error::Model`] for another format, an unknown version and
/// values out of range.
pub fn read_model(path: impl AsRef<Path>) -> Result<ModelFile> {
    let path = path.as_ref();
    let bytes = small_file(path, LONGEST_MODEL)?;
    parse_model(&bytes, path)
}

/// Reads the text of a model file; `path` stands for it in messages.
///
/// # Errors
/// Those of [`read_model`] but [`Error::Read`].
pub fn parse_model(bytes: &[u8], path: &Path) -> Result<ModelFile> {
    let json = |error: serde_json::Error| json_error(path, &error);
    let wrong = |problem| Error::Model {
        path: path.to_owned(),
        problem,
    };
    let content = bytes.trim_ascii_start();
    if !content.is_empty() && !content.starts_with(b"{") {
        return Err(wrong(
            "not a model file; a command takes the model first, then the record".to_owned(),
        ));
    }
    let head: Head = serde_json::from_slice(bytes).map_err(json)?;
    if head.format != FORMAT {
        return Err(wrong(format!(
            "not a model file: its \"format\" is {}, not \"{FORMAT}\"; models are written by `flexure identify -o`",
            head.format
        )));
    }
    let model: ModelFile = if head.version == VERSION {
        serde_json::from_slice(bytes).map_err(json)?
    } else if head.version == version1::VERSION {
        version1::parse(bytes).map_err(json)?
    } else {
        return Err(wrong(format!(
            "the model's format version is {}, but Flexure {} reads versions {} to {VERSION}; identify the model again or update Flexure",
            head.version,
            ModelFile::CURRENT,
            version1::VERSION
        )));
    };
    match model.problem() {
        Some(problem) => Err(wrong(problem)),
        None => Ok(model),
    }
}

/// Writes a model file, whole or not at all; numbers read back as the same `f64`.
///
/// # Errors
/// [`Error::Model`] for values out of range, [`Error::Write`].
pub fn write_model(path: impl AsRef<Path>, model: &ModelFile) -> Result<()> {
    let path = path.as_ref();
    let text = model_text(model, path)?;
    write_atomically(path, |out| out.write_all(text.as_bytes()))
}

/// The text of a model file, with a line break at its end; `path` stands for the file in messages.
///
/// # Errors
/// [`Error::Model`] for values out of range.
pub fn model_text(model: &ModelFile, path: &Path) -> Result<String> {
    let wrong = |problem| Error::Model {
        path: path.to_owned(),
        problem,
    };
    if let Some(problem) = model.problem() {
        return Err(wrong(problem));
    }
    let on_disk = OnDisk {
        format: FORMAT,
        version: VERSION,
        model,
    };
    let text = serde_json::to_string_pretty(&on_disk).map_err(|error| wrong(error.to_string()))?;
    Ok(text + "\n")
}

fn json_error(path: &Path, error: &serde_json::Error) -> Error {
    let (line, column) = (error.line(), error.column());
    let text = error.to_string();
    let problem = text
        .strip_suffix(&format!(" at line {line} column {column}"))
        .unwrap_or(&text);
    let problem = match error.classify() {
        Category::Eof => "the file is empty or was cut off".to_owned(),
        Category::Syntax => format!("the text is not JSON ({problem})"),
        Category::Data | Category::Io => problem.to_owned(),
    };
    Error::Json {
        path: path.to_owned(),
        line,
        column,
        problem,
    }
}
