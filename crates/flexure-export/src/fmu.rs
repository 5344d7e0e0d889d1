//! Functional mock-up units for co-simulation (FMI 2.0 and 3.0): a zip archive of the description, the C source and, if asked for, a library.

use std::collections::BTreeSet;
use std::io::{Cursor, Write as _};
use std::path::Path;
use std::process::Command;

use flexure_io::{ModelFile, TemporaryFolder};
use minijinja::{Value, context};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::error::{Error, Result};
use crate::program::{Kind, Program};
use crate::text::{rendered, text};
use crate::{Described, Fmi};

/// Names that the description uses itself.
const OWN: [&str; 2] = ["sample_time", "time"];

/// Units by their names, in base units of the SI, as the description has them.
const BASES: [(&[&str], &str); 30] = [
    (&["s"], r#"s="1""#),
    (&["ms"], r#"s="1" factor="0.001""#),
    (&["m"], r#"m="1""#),
    (&["mm"], r#"m="1" factor="0.001""#),
    (&["rad"], r#"rad="1""#),
    (&["deg", "°"], r#"rad="1" factor="0.017453292519943295""#),
    (&["m/s"], r#"m="1" s="-1""#),
    (&["m/s2", "m/s^2", "m/s²"], r#"m="1" s="-2""#),
    (&["rad/s"], r#"rad="1" s="-1""#),
    (&["deg/s", "°/s"], r#"rad="1" s="-1" factor="0.017453292519943295""#),
    (
        &["rpm", "1/min", "r/min"],
        r#"rad="1" s="-1" factor="0.10471975511965977""#,
    ),
    (&["rad/s2", "rad/s^2", "rad/s²"], r#"rad="1" s="-2""#),
    (&["Hz"], r#"s="-1""#),
    (&["N"], r#"kg="1" m="1" s="-2""#),
    (&["N.m", "N m", "Nm", "N·m", "N*m"], r#"kg="1" m="2" s="-2""#),
    (&["N.m/rad", "N m/rad"], r#"kg="1" m="2" s="-2" rad="-1""#),
    (&["N.m/rad3"], r#"kg="1" m="2" s="-2" rad="-3""#),
    (&["N.m.s/rad", "N m s/rad"], r#"kg="1" m="2" s="-1" rad="-1""#),
    (&["s/rad"], r#"s="1" rad="-1""#),
    (&["1/rad"], r#"rad="-1""#),
    (&["kg.m2", "kg m^2", "kg m2"], r#"kg="1" m="2""#),
    (&["kg"], r#"kg="1""#),
    (&["A"], r#"A="1""#),
    (&["mA"], r#"A="1" factor="0.001""#),
    (&["V"], r#"kg="1" m="2" s="-3" A="-1""#),
    (&["mV"], r#"kg="1" m="2" s="-3" A="-1" factor="0.001""#),
    (&["W"], r#"kg="1" m="2" s="-3""#),
    (&["Pa"], r#"kg="1" m="-1" s="-2""#),
    (&["K"], r#"K="1""#),
    (&["degC", "°C"], r#"K="1" offset="273.15""#),
];

/// What an archive is made of.
pub struct Content {
    /// The C source and its header.
    pub source: String,
    pub header: String,
    /// The inputs and the outputs.
    pub inputs: Vec<Variable>,
    pub outputs: Vec<Variable>,
    /// The numbers of the model that have their own meaning.
    pub parameters: Vec<Parameter>,
    /// The seconds of a sample.
    pub sample_time: Option<f64>,
    /// What the outputs depend on.
    pub nature: Nature,
}

/// An input or an output.
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Its unit, where that is known.
    pub unit: Option<String>,
}

/// A number of the model.
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its unit, where that is known.
    pub unit: Option<&'static str>,
    /// What it is.
    pub about: &'static str,
}

/// What the outputs of a unit depend on.
#[derive(Clone, Copy, PartialEq)]
pub enum Nature {
    /// The present inputs alone.
    Static,
    /// The inputs up to the present sample.
    Sampled,
    /// The outputs are the state of an arm.
    Arm,
}

/// The archive of a model.
pub fn of_model(program: &Program<'_>, described: &Described<'_>, fmi: Fmi, compile: bool) -> Result<Vec<u8>> {
    let header = format!("{}.h", described.name);
    let parameters = coefficients(program);
    let mut inputs = variables(described.model, &parameters);
    let outputs = inputs.split_off(inputs.len() - 1);
    let content = Content {
        source: text("c", program, described, context! { header })?,
        header: text("h", program, described, Value::UNDEFINED)?,
        inputs,
        outputs,
        parameters,
        sample_time: described.model.sample_time,
        nature: if program.is_static() {
            Nature::Static
        } else {
            Nature::Sampled
        },
    };
    archive(content, described.name, &described.about, fmi, compile)
}

/// The archive.
pub fn archive(content: Content, name: &str, about: &[String], fmi: Fmi, compile: bool) -> Result<Vec<u8>> {
    let names: Vec<&str> = content.inputs.iter().map(|v| v.name.as_str()).collect();
    let values = |variables: &[Variable]| -> Vec<Value> {
        let each = variables.iter();
        each.map(|v| context! { name => &v.name, unit => &v.unit }).collect()
    };
    let is_static = content.nature == Nature::Static;
    let described = context! {
        name,
        about => about.to_vec(),
        sample_time => content.sample_time.map(|h| format!("{h:?}")),
        inputs => content.inputs.len(),
        variables => values(&content.inputs),
        results => values(&content.outputs),
        parameters => content.parameters.iter().map(parameter).collect::<Vec<_>>(),
        units => units(&content),
        is_arm => content.nature == Nature::Arm,
        is_static,
        variability => if is_static { "continuous" } else { "discrete" },
        meaning => match content.nature {
            Nature::Static => "The output for the present inputs",
            Nature::Sampled => "After a step: the output for the inputs at the step's beginning",
            Nature::Arm => "The state at the end of the step",
        },
        token => token(&content.source, &names.join("\n")),
        flexure => ModelFile::CURRENT,
    };
    let text = |template: &str| Ok::<_, Error>(rendered(template, described.clone())?.into_bytes());
    let (description, interface) = match fmi {
        Fmi::Two => ("fmi2.xml", "fmi2.c"),
        Fmi::Three => ("fmi3.xml", "fmi3.c"),
    };
    let mut files = vec![
        ("modelDescription.xml".to_owned(), text(description)?),
        (format!("sources/{name}.c"), content.source.into_bytes()),
        (format!("sources/{name}.h"), content.header.into_bytes()),
        ("sources/fmi.c".to_owned(), text(interface)?),
    ];
    if fmi == Fmi::Three {
        files.push(("sources/buildDescription.xml".to_owned(), text("build.xml")?));
    }
    if compile {
        files.push(library(name, fmi, &files)?);
    }
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    // No date: the same model gives the same archive.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::default());
    for (path, bytes) in files {
        archive.start_file(path, options)?;
        archive.write_all(&bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}

/// The units of an archive, each once, with their SI base units if these are known.
fn units(content: &Content) -> Vec<Value> {
    let variables = content.inputs.iter().chain(&content.outputs);
    let time = (content.nature != Nature::Static && content.sample_time.is_some()).then_some("s");
    let names: BTreeSet<&str> = time
        .into_iter()
        .chain(variables.filter_map(|v| v.unit.as_deref()))
        .chain(content.parameters.iter().filter_map(|p| p.unit))
        .collect();
    let base = |name: &str| {
        BASES
            .iter()
            .find(|(names, _)| names.contains(&name))
            .map(|(_, base)| *base)
    };
    names
        .into_iter()
        .map(|name| context! { name, base => base(name) })
        .collect()
}

/// The coefficients of the linear blocks, and the offsets.
fn coefficients(program: &Program<'_>) -> Vec<Parameter> {
    let parameter = |name: String, value: f64, about: &'static str| Parameter {
        name,
        value,
        unit: None,
        about,
    };
    let mut found = Vec::new();
    for (k, step) in program.steps.iter().enumerate() {
        match &step.kind {
            Kind::Linear(system) => {
                for (side, values) in [("b", system.b()), ("a", system.a())] {
                    let each = values.iter().enumerate();
                    found.extend(each.map(|(j, v)| {
                        parameter(
                            format!("block{k}_{side}{j}"),
                            *v,
                            "Coefficient of a linear block, of the power of 1/z that its name ends with",
                        )
                    }));
                }
            }
            Kind::Offset(offset) => {
                found.push(parameter(format!("block{k}_offset"), *offset, "A number that is added"))
            }
            _ => {}
        }
    }
    found
}

fn parameter(p: &Parameter) -> Value {
    context! { name => &p.name, unit => p.unit, about => p.about, value => format!("{:?}", p.value) }
}

/// Inputs and output: their names all different, printable, and none of the description's own.
fn variables(model: &ModelFile, parameters: &[Parameter]) -> Vec<Variable> {
    let mut names: Vec<String> = Vec::new();
    let variable = |column: &String| {
        let visible = visible(column);
        let free = |name: &String| {
            !names.contains(name) && !OWN.contains(&name.as_str()) && parameters.iter().all(|p| p.name != *name)
        };
        let numbered = (2..).map(|k| format!("{visible}_{k}"));
        let name = std::iter::once(visible.clone())
            .chain(numbered)
            .find(free)
            .unwrap_or_default();
        names.push(name.clone());
        let unit = model.units.get(column).map(|unit| self::visible(unit));
        Variable { name, unit }
    };
    model.inputs.iter().chain([&model.output]).map(variable).collect()
}

/// Text without the characters that XML does not allow.
fn visible(text: &str) -> String {
    let allowed = |c: char| !c.is_control() && !"\u{fffe}\u{ffff}".contains(c);
    text.chars().map(|c| if allowed(c) { c } else { '_' }).collect()
}

/// The token that ties a library to its description: a hash of the model (FNV-1a).
fn token(source: &str, names: &str) -> String {
    let hash = |seed: u64| {
        let bytes = source.bytes().chain(names.bytes());
        bytes.fold(0xcbf2_9ce4_8422_2325 ^ seed, |h, b| {
            (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
        })
    };
    let (a, b) = (hash(0), hash(0x9e37_79b9_7f4a_7c15));
    format!(
        "{{{:08x}-{:04x}-{:04x}-{:04x}-{:012x}}}",
        a >> 32,
        (a >> 16) & 0xffff,
        a & 0xffff,
        b >> 48,
        b & 0xffff_ffff_ffff
    )
}

/// The library for this machine, and where it stands in the archive.
fn library(name: &str, fmi: Fmi, files: &[(String, Vec<u8>)]) -> Result<(String, Vec<u8>)> {
    let (arch, os) = (std::env::consts::ARCH, std::env::consts::OS);
    let folder = match (fmi, os, arch) {
        (Fmi::Two, "linux", "x86_64") => "linux64".to_owned(),
        (Fmi::Two, "macos", "x86_64") => "darwin64".to_owned(),
        (Fmi::Three, "linux", "x86_64" | "aarch64") => format!("{arch}-linux"),
        (Fmi::Three, "macos", "x86_64" | "aarch64") => format!("{arch}-darwin"),
        _ => {
            let problem = format!(
                "FMI has no folder for {os} on {arch} that Flexure knows; leave the library out, and compile the sources"
            );
            return Err(Error::Compile(problem));
        }
    };
    let extension = if os == "macos" { "dylib" } else { "so" };
    let place = TemporaryFolder::new()?;
    for (path, bytes) in files {
        if let Some(file) = path.strip_prefix("sources/") {
            std::fs::write(place.path().join(file), bytes)?;
        }
    }
    let built = place.path().join("library");
    let compiler = std::env::var("CC")
        .ok()
        .filter(|cc| !cc.trim().is_empty())
        .unwrap_or_else(|| "cc".to_owned());
    compile(&compiler, name, place.path(), &built)?;
    Ok((format!("binaries/{folder}/{name}.{extension}"), std::fs::read(built)?))
}

fn compile(compiler: &str, name: &str, folder: &Path, built: &Path) -> Result<()> {
    let mut parts = compiler.split_whitespace();
    let mut command = Command::new(parts.next().unwrap_or("cc"));
    command
        .args(parts)
        .args(["-std=c99", "-O2", "-shared", "-fPIC", "-fvisibility=hidden", "-o"]);
    command
        .arg(built)
        .args([&format!("{name}.c"), "fmi.c", "-lm"])
        .current_dir(folder);
    let done = command.output().map_err(|error| {
        Error::Compile(format!(
            "'{compiler}' did not start ({error}); install a C compiler, or name one by the environment variable CC"
        ))
    })?;
    match done.status.success() {
        true => Ok(()),
        false => Err(Error::Compile(format!(
            "{compiler}: {}",
            String::from_utf8_lossy(&done.stderr).trim()
        ))),
    }
}
