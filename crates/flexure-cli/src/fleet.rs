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

/// Identify every machine of a data set, over all cores, and put the results in a table.
///
/// The data set is a file whose column --by tells the machines apart, or a folder: with folders KEY=VALUE, or with one file a machine. With
/// --torque every machine is a joint (see flexure joint), without it a system (see flexure identify); the options of these commands mean the same
/// here. RESULTS gets table.parquet, a row per machine, and models/VALUE.json. A machine whose record cannot be used has its error in its
/// row. Where a run was stopped, the same command goes on with it.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    flexure fleet logs.parquet --by joint --position q --torque tau -o results\n  \
    flexure fleet records/ --by plant --input u --output y --structure auto -o results")]
pub struct Arguments {
    /// The data set: a file or a folder.
    dataset: PathBuf,
    /// What identifies the machines: a column of numbers, or the name in folders KEY=VALUE.
    #[arg(long, value_name = "KEY")]
    by: String,
    /// The folder of the results.
    #[arg(short = 'o', long = "out", value_name = "RESULTS")]
    out: PathBuf,
    /// The format of the table.
    #[arg(long, value_name = "FORMAT", value_parser = ["parquet", "csv"], default_value = "parquet")]
    table: String,
    /// The most memory that a file may take, for example 8GiB; by default as in the other commands, divided by the number of cores if each
    /// machine has a file.
    #[arg(long, value_name = "SIZE", value_parser = arguments::memory)]
    memory: Option<u64>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    of_command: OfCommand,
}

/// Options that `identify` and `joint` define.
#[derive(clap::Args)]
#[command(next_help_heading = "Of every machine (see flexure identify and flexure joint)")]
struct OfCommand {
    /// The input's column; A,B for several inputs.
    #[arg(long, value_name = "COLUMN")]
    input: Option<String>,
    /// The output's column.
    #[arg(long, value_name = "COLUMN")]
    output: Option<String>,
    /// The structure of the model.
    #[arg(long, value_name = "STRUCTURE")]
    structure: Option<String>,
    /// The method for a Hammerstein model.
    #[arg(long, value_name = "METHOD")]
    method: Option<String>,
    /// Order of a Hammerstein model's linear part.
    #[arg(long, value_name = "auto|N")]
    order: Option<String>,
    /// Delay of a Hammerstein model in samples.
    #[arg(long, value_name = "auto|N")]
    delay: Option<String>,
    /// Share of the record, at its end, that is not fitted.
    #[arg(long, value_name = "SHARE")]
    fresh: Option<String>,
    /// The column of the torque; every machine is then a joint.
    #[arg(long, value_name = "COLUMN")]
    torque: Option<String>,
    /// The column of a rigid axis's position.
    #[arg(long, value_name = "COLUMN")]
    position: Option<String>,
    /// The column of a flexible joint's motor angle, or without --link of a rigid axis's.
    #[arg(long, value_name = "COLUMN")]
    motor: Option<String>,
    /// The column of a flexible joint's link angle.
    #[arg(long, value_name = "COLUMN")]
    link: Option<String>,
    /// Torque for each unit of the torque column.
    #[arg(long, value_name = "K", allow_hyphen_values = true)]
    torque_constant: Option<String>,
    /// Gear ratio: motor angles are divided by it, torques multiplied.
    #[arg(long, value_name = "N")]
    gear_ratio: Option<String>,
    /// The motor's inertia in kg m^2 on the link's side, where it is known.
    #[arg(long, value_name = "JM")]
    motor_inertia: Option<String>,
    /// Level of the confidence bands.
    #[arg(long, value_name = "LEVEL")]
    band: Option<String>,
    /// The axes are prismatic: positions in m, forces in N.
    #[arg(long)]
    prismatic: bool,
    /// Gravity acts on the axes: terms cos q and sin q.
    #[arg(long)]
    gravity: bool,
    /// A spring acts on the axes: a term q.
    #[arg(long)]
    spring: bool,
    /// Sample time in s; by default that of the column of time.
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
