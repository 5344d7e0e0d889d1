//! `flexure fleet`: one model a machine, over a data set of many.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args as _;
use flexure::text::shown_path;
use flexure_io::{check_record_writable, write_table};
use flexure_workbench::fleet::{Fleet, Outcome, members};
use serde_json::json;

use crate::arguments::{self, Usage};
use crate::output::print;
use crate::progress::measured;
use crate::{identify, joint};

/// Identify every machine of a data set on all processor cores, and put the results in a table.
///
/// The data set is a file or a folder. In a file, the column --by tells the machines apart. In a folder, each machine
/// has a folder KEY=VALUE, or each machine has one file. With --torque, every machine is a joint (see flexure joint).
/// Without it, every machine is a system (see flexure identify). The options of these commands have the same meaning
/// here.
///
/// The folder RESULTS gets table.parquet, with one row for each machine, and the models as models/VALUE.json. VALUE is
/// the number or the name of the machine. If the record of a machine cannot be used, its row contains the error. If a
/// run was stopped, give the same command again: it goes on with the machines that are left.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    flexure fleet logs.parquet --by joint --position q --torque tau -o results\n  \
    flexure fleet records/ --by plant --input u --output y --structure auto -o results")]
pub struct Arguments {
    /// The data set: a file or a folder.
    dataset: PathBuf,
    /// What tells the machines apart. In a file: a column of numbers. With folders KEY=VALUE: their KEY. With one file
    /// for each machine: a name, which becomes a column of the table.
    #[arg(long, value_name = "KEY")]
    by: String,
    /// The folder for the results.
    #[arg(short = 'o', long = "out", value_name = "RESULTS")]
    out: PathBuf,
    /// The format of the table.
    #[arg(long, value_name = "FORMAT", value_parser = ["parquet", "csv"], default_value = "parquet")]
    table: String,
    /// The most memory that a file may take, for example 8GiB. The default is that of the other commands. If each
    /// machine has a file, this default is divided by the number of cores.
    #[arg(long, value_name = "SIZE", value_parser = arguments::memory)]
    memory: Option<u64>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    of_command: OfCommand,
}

/// Options that `identify` and `joint` define.
#[derive(clap::Args)]
#[command(next_help_heading = "For every machine (as in flexure identify and flexure joint)")]
struct OfCommand {
    /// The column of the input, or A,B for several inputs.
    #[arg(long, value_name = "COLUMN")]
    input: Option<String>,
    /// The column of the output.
    #[arg(long, value_name = "COLUMN")]
    output: Option<String>,
    /// The structure of the model.
    #[arg(long, value_name = "STRUCTURE")]
    structure: Option<String>,
    /// The method for a Hammerstein model.
    #[arg(long, value_name = "METHOD")]
    method: Option<String>,
    /// The order of the linear part of a Hammerstein model.
    #[arg(long, value_name = "auto|N")]
    order: Option<String>,
    /// The delay of a Hammerstein model, in samples.
    #[arg(long, value_name = "auto|N")]
    delay: Option<String>,
    /// The share of the record that is not used for the fit. It is taken from the end of the record.
    #[arg(long, value_name = "SHARE")]
    fresh: Option<String>,
    /// The column of the torque. With this option, every machine is a joint.
    #[arg(long, value_name = "COLUMN")]
    torque: Option<String>,
    /// The column of the position of a rigid axis.
    #[arg(long, value_name = "COLUMN")]
    position: Option<String>,
    /// The column of the motor angle of a flexible joint. Without --link, the axis is rigid, and its only encoder is at
    /// its motor.
    #[arg(long, value_name = "COLUMN")]
    motor: Option<String>,
    /// The column of the link angle of a flexible joint.
    #[arg(long, value_name = "COLUMN")]
    link: Option<String>,
    /// The torque for each unit of the torque column.
    #[arg(long, value_name = "K", allow_hyphen_values = true)]
    torque_constant: Option<String>,
    /// The gear ratio. Motor angles are divided by it, and torques are multiplied by it.
    #[arg(long, value_name = "N")]
    gear_ratio: Option<String>,
    /// The known inertia of the motor in kg m^2, on the link's side.
    #[arg(long, value_name = "JM")]
    motor_inertia: Option<String>,
    /// The level of the confidence bands.
    #[arg(long, value_name = "LEVEL")]
    band: Option<String>,
    /// The axes are prismatic: their positions are in m, their forces in N.
    #[arg(long)]
    prismatic: bool,
    /// Gravity acts on the axes: add the terms cos q and sin q to the equation of motion.
    #[arg(long)]
    gravity: bool,
    /// A spring acts on the axes: add the term q to the equation of motion.
    #[arg(long)]
    spring: bool,
    /// The sample time in s. By default, it is taken from the time column.
    #[arg(long, value_name = "S")]
    sample_time: Option<String>,
}

impl OfCommand {
    /// The command's arguments, as they would be typed; the record's name stands for no file.
    fn typed(&self) -> Vec<String> {
        let valued = [
            ("input", &self.input),
            ("output", &self.output),
            ("structure", &self.structure),
            ("method", &self.method),
            ("order", &self.order),
            ("delay", &self.delay),
            ("fresh", &self.fresh),
            ("torque", &self.torque),
            ("position", &self.position),
            ("motor", &self.motor),
            ("link", &self.link),
            ("torque-constant", &self.torque_constant),
            ("gear-ratio", &self.gear_ratio),
            ("motor-inertia", &self.motor_inertia),
            ("band", &self.band),
            ("sample-time", &self.sample_time),
        ];
        let flags = [
            ("prismatic", self.prismatic),
            ("gravity", self.gravity),
            ("spring", self.spring),
        ];
        let name = if self.torque.is_some() { "joint" } else { "identify" };
        let valued = valued
            .into_iter()
            .filter_map(|(option, value)| Some(format!("--{option}={}", value.as_ref()?)));
        let flags = flags
            .into_iter()
            .filter(|(_, given)| *given)
            .map(|(option, _)| format!("--{option}"));
        [name.to_owned(), "record".to_owned()]
            .into_iter()
            .chain(valued)
            .chain(flags)
            .collect()
    }
}

/// What is done with every machine.
enum Work {
    Identify(Box<identify::Arguments>),
    Joint(Box<joint::Arguments>),
}

impl Work {
    fn new(typed: &[String]) -> Result<Work> {
        let parse = |command: clap::Command| {
            let matches = command.no_binary_name(false).try_get_matches_from(typed);
            matches.map_err(|error| {
                let text = error.to_string();
                let text = text.trim_start_matches("error: ");
                Usage(text.split("\n\nUsage").next().unwrap_or(text).to_owned())
            })
        };
        let read = |error: clap::Error| Usage(error.to_string());
        Ok(match typed[0].as_str() {
            "joint" => {
                let matches = parse(joint::Arguments::augment_args(clap::Command::new("joint")))?;
                Work::Joint(Box::new(
                    clap::FromArgMatches::from_arg_matches(&matches).map_err(read)?,
                ))
            }
            _ => {
                let matches = parse(identify::Arguments::augment_args(clap::Command::new("identify")))?;
                let arguments: identify::Arguments = clap::FromArgMatches::from_arg_matches(&matches).map_err(read)?;
                arguments.check()?;
                Work::Identify(Box::new(arguments))
            }
        })
    }

    fn of(&self, file: flexure_io::RecordFile) -> Result<Outcome> {
        match self {
            Work::Identify(arguments) => arguments.of_file(file),
            Work::Joint(arguments) => arguments.of_file(&file),
        }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let typed = arguments.of_command.typed();
    let work = Work::new(&typed)?;
    let members = members(&arguments.dataset, &arguments.by, arguments.memory, &arguments.out)?;
    let fleet = Fleet {
        results: &arguments.out,
        by: &arguments.by,
        asked: &typed,
    };
    fleet.open()?;
    let table = arguments.out.join(format!("table.{}", arguments.table));
    check_record_writable(&table)?;
    let (rows, counts) = measured("identifying", |reported| {
        fleet.run(&members, |file| work.of(file), |done, all| reported.at(done, all))
    })?;
    write_table(&table, &rows)?;
    if counts.failed == counts.members {
        let first = rows[0]
            .iter()
            .find_map(|(name, value)| (name == "error").then(|| value.as_str())?);
        bail!(
            "none of {} machines could be identified; the first: {}",
            counts.members,
            first.unwrap_or_default()
        );
    }
    if arguments.json {
        let object = json!({
            "machines": counts.members,
            "kept": counts.kept,
            "failed": counts.failed,
            "table": table.display().to_string(),
        });
        return print(&object.to_string());
    }
    let mut text = format!("wrote {} ({} machines", shown_path(&table), counts.members);
    for (count, what) in [
        (counts.kept, "from an earlier run"),
        (counts.failed, "failed: see the column error"),
    ] {
        if count > 0 {
            text.push_str(&format!(", {count} {what}"));
        }
    }
    print(&(text + ")"))
}
