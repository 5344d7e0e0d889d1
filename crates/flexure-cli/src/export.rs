//! `flexure export`: a model as code for other programs.

use std::io::Write as _;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::Result;
use flexure_export::{Artefact, Fmi, Format, Options, export_arm, to_be_compared};
use flexure_io::arm::{ArmError, DriveKind, Paths, run_driven};
use flexure_io::write_atomically;
use flexure_workbench::export::exportable;
use serde_json::json;

use crate::arguments;
use crate::files::{prepare, wrote};
use crate::output::print;
use crate::simulate::{Source, simulate};

/// Write a model as code for other programs.
///
/// The code computes the same values as `flexure predict --initial-state steady`, sample by sample. It uses the same
/// interpolation, and the same values beyond the range of the data. It also starts in the same state: the steady state
/// that belongs to the first input.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    flexure export model.json --to c -o motor.c\n  \
    flexure export friction.csv --to c -o friction.c\n  \
    flexure export arm.toml --to c -o arm.c\n  \
    flexure export model.json --to fmu --fmi 3 --compile -o motor.fmu")]
pub struct Arguments {
    /// What is exported. It is a model from `flexure identify -o`, a table of a curve from `flexure joint --friction`
    /// or `flexure regress -o`, or an arm file. An arm file is exported to C or FMU, with an integrator inside.
    model: PathBuf,
    /// The format of the code.
    #[arg(long, value_name = "FORMAT", value_parser = arguments::named::<Format>())]
    to: Format,
    /// Write the code to this file, or into this folder. In a folder, the name of the file is that of --name. C also
    /// gets a header file.
    #[arg(short = 'o', long = "out", value_name = "OUT")]
    out: PathBuf,
    /// The name of the functions, the class or the FMU. It must be an identifier. By default, it is the name of the
    /// file. In a folder, the default is model.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// The version of the Functional Mock-up Interface (FMI): 2 or 3. The default is 2.
    #[arg(long, value_name = "VERSION", value_parser = arguments::named::<Fmi>())]
    fmi: Option<Fmi>,
    /// Put a library for this machine into the FMU. The local C compiler makes it.
    #[arg(long)]
    compile: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// An arm's files, compared with its simulation.
fn arm(arguments: &Arguments, options: Options<'_>) -> Result<Vec<Artefact>> {
    if !options.format.takes_arms() {
        return Err(arguments::Usage("an arm file goes to c and fmu alone".to_owned()).into());
    }
    let source = Source::new(&Some(arguments.model.clone()), &None)?;
    let file = source.arm()?;
    let mut exact = to_be_compared(&file);
    let folder = arguments.model.parent().unwrap_or(Path::new(""));
    let mut run = || {
        let record = simulate(&exact, folder, Paths::Below)?;
        if exact.excitation.drive == DriveKind::Torque {
            return Ok(record);
        }
        // The exported arm takes torques: those that the deflections need.
        let torque = [record.column("tau1")?, record.column("tau2")?];
        exact.excitation.drive = DriveKind::Torque;
        run_driven(&exact, torque, &mut |_| ControlFlow::Continue(()))
    };
    let record = run().map_err(|error: ArmError| error.located(&source.text, &source.name))?;
    Ok(export_arm(&file, &record, &arguments.out, options)?)
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let fmu = arguments.to == Format::Fmu;
    for (given, option) in [(arguments.fmi.is_some(), "--fmi"), (arguments.compile, "--compile")] {
        if given && !fmu {
            return Err(arguments::Usage(format!("{option} is for --to fmu")).into());
        }
    }
    let is_arm = arguments.model.extension().is_some_and(|extension| extension == "toml");
    let options = Options {
        format: arguments.to,
        name: arguments.name.as_deref(),
        fmi: arguments.fmi.unwrap_or_default(),
        compile: arguments.compile,
    };
    let artefacts = match is_arm {
        true => arm(arguments, options)?,
        false => flexure_export::export(&exportable(&arguments.model)?, &arguments.out, options)?,
    };
    let paths: Vec<PathBuf> = artefacts.iter().map(|artefact| artefact.path.clone()).collect();
    prepare([&arguments.model], [], &paths)?;
    for artefact in &artefacts {
        write_atomically(&artefact.path, |out| out.write_all(&artefact.bytes))?;
    }
    if arguments.json {
        let out: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
        return print(&json!({ "out": out }).to_string());
    }
    let lines: Vec<String> = wrote(&paths).collect();
    print(&lines.join("\n"))
}
