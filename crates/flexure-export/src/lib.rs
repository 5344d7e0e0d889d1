//! Writes an identified model as C, FMU, ONNX, Python or MATLAB.
//!
//! `Program` is the one walk over the model's blocks: steps over registers. Every format is written from it. What is exported
//! computes what [`Block::simulate_from_first`](flexure::Block::simulate_from_first) computes: the same interpolation, the same values beyond the
//! tables, the same start.
//!
//! | format | what it is |
//! |---|---|
//! | [`Format::C`] | `NAME.c` and `NAME.h`: C99 without heap and dependencies |
//! | [`Format::Fmu`] | a co-simulation FMU of FMI 2.0 or 3.0 with its C source |
//! | [`Format::Onnx`] | a graph in float64 that takes a whole sequence |
//! | [`Format::Python`] | a module without dependencies |
//! | [`Format::Matlab`] | a function file, for Octave too |

mod arm;
mod error;
mod fmu;
mod name;
mod onnx;
mod program;
mod text;
mod view;

use std::path::{Path, PathBuf};

use flexure_io::ModelFile;
use minijinja::{Value, context};

pub use arm::{export_arm, to_be_compared};
pub use error::{Error, Result};

use program::Program;

/// What a model is exported to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// C99.
    C,
    /// A functional mock-up unit.
    Fmu,
    /// An ONNX graph.
    Onnx,
    /// A Python module.
    Python,
    /// A MATLAB function file.
    Matlab,
}

impl Format {
    /// The extension of its files.
    pub fn extension(self) -> &'static str {
        match self {
            Format::C => "c",
            Format::Fmu => "fmu",
            Format::Onnx => "onnx",
            Format::Python => "py",
            Format::Matlab => "m",
        }
    }

    /// Whether arms can be exported to it.
    pub fn takes_arms(self) -> bool {
        matches!(self, Format::C | Format::Fmu)
    }
}

/// The version of the functional mock-up interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fmi {
    /// 2.0.
    #[default]
    Two,
    /// 3.0.
    Three,
}

/// How a model is exported.
#[derive(Debug, Clone, Copy)]
pub struct Options<'a> {
    /// The format.
    pub format: Format,
    /// The exported model's name, an identifier; `None`: like the file.
    pub name: Option<&'a str>,
    /// The version of an FMU.
    pub fmi: Fmi,
    /// Whether an FMU has a library for this machine too, made by the local C compiler.
    pub compile: bool,
}

/// A file of an export.
#[derive(Debug, Clone, PartialEq)]
pub struct Artefact {
    /// Where it is to be written.
    pub path: PathBuf,
    /// What is in it.
    pub bytes: Vec<u8>,
}

/// A model with its name, and what every format says about it.
struct Described<'a> {
    model: &'a ModelFile,
    name: &'a str,
    about: Vec<String>,
}

/// The files of an export to `out`: a file with the format's extension, or a folder that is there.
///
/// # Errors
/// [`Error::Path`] for another extension, and for the names that C cannot include; [`Error::Name`] for a name that is no identifier;
/// [`Error::Model`] for a model that cannot be simulated; [`Error::Compile`].
pub fn export(model: &ModelFile, out: &Path, options: Options<'_>) -> Result<Vec<Artefact>> {
    let extension = options.format.extension();
    let (path, name) = destination(out, extension, options.name)?;
    name::check(&name)?;
    let program = Program::new(&model.block)?;
    let described = Described {
        model,
        name: &name,
        about: about(model, &program),
    };
    let single = |bytes| Artefact {
        path: path.clone(),
        bytes,
    };
    let plain = |more: Value| text::text(extension, &program, &described, more).map(String::into_bytes);
    Ok(match options.format {
        Format::C => {
            let (header, file) = header_name(&path)?;
            let declarations = text::text("h", &program, &described, Value::UNDEFINED)?.into_bytes();
            let source = single(plain(context! { header => file })?);
            vec![
                source,
                Artefact {
                    path: header,
                    bytes: declarations,
                },
            ]
        }
        Format::Python | Format::Matlab => vec![single(plain(Value::UNDEFINED)?)],
        Format::Onnx => vec![single(onnx::graph(&program, &described))],
        Format::Fmu => vec![single(fmu::of_model(
            &program,
            &described,
            options.fmi,
            options.compile,
        )?)],
    })
}

/// The header of a C file, and the name under which the file includes it.
fn header_name(path: &Path) -> Result<(PathBuf, String)> {
    let header = path.with_extension("h");
    let file = header.file_name().unwrap_or_default().to_string_lossy().into_owned();
    match file.chars().all(|c| c.is_ascii_alphanumeric() || "_-.".contains(c)) {
        true => Ok((header, file)),
        false => Err(Error::Path {
            path: path.to_owned(),
            problem: "the name of a C file may have only letters from a to z, digits, '_', '-' and '.'".to_owned(),
        }),
    }
}

/// The file, and the exported model's name.
fn destination(out: &Path, extension: &str, name: Option<&str>) -> Result<(PathBuf, String)> {
    let name = name.map(str::to_owned);
    if out.is_dir() {
        let name = name.unwrap_or_else(|| "model".to_owned());
        return Ok((out.join(format!("{name}.{extension}")), name));
    }
    if out.extension().and_then(|e| e.to_str()) != Some(extension) {
        return Err(Error::Path {
            path: out.to_owned(),
            problem: format!("the file's name must end in .{extension}, or be that of a folder"),
        });
    }
    let name = name.unwrap_or_else(|| name::of_file(out));
    Ok((out.to_owned(), name))
}

/// What every format says about a model: plain text that ends no comment and no string.
fn about(model: &ModelFile, program: &Program<'_>) -> Vec<String> {
    let rate = match model.sample_time {
        _ if program.is_static() => {
            "The output depends on the present input alone: call the step at any rate.".to_owned()
        }
        Some(h) => format!("One step is one sample of {h:?} s. Call it at this rate."),
        None => "One step is one sample. The sample time was not known: call it at the rate of the record.".to_owned(),
    };
    let inputs = model.inputs.iter().enumerate();
    let named = |name: &String| match model.units.get(name) {
        Some(unit) => format!("{name}, in {unit}"),
        None => name.clone(),
    };
    let inputs = inputs.map(|(i, name)| format!("Input {i}: {}.", named(name)));
    let mut lines = vec![format!(
        "A model of the structure {}, written by Flexure {}.",
        model.structure,
        ModelFile::CURRENT
    )];
    lines.extend(inputs);
    lines.push(format!("Output: {}.", named(&model.output)));
    lines.push(rate);
    lines.push(
        "Start: the steady state that belongs to the first input, as flexure predict without a measured output."
            .to_owned(),
    );
    lines.extend(program.ranges());
    lines.push(
        "An input that is NaN makes the output NaN. Linear parts and loops stay NaN until the next reset. A NARX model uses the mean in place of NaN."
            .to_owned(),
    );
    lines.iter().map(|line| name::plain(line)).collect()
}
