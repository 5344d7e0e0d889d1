//! `flexure joint`: a joint's friction, stiffness and inertia from its log.

mod data;
mod rigid;
mod words;

use std::path::PathBuf;

use anyhow::Result;
use flexure_io::{check_record_writable, read_record};

use crate::arguments;
use crate::progress::spinning;
use data::{Log, Number};

/// Find a joint's friction, stiffness and inertia from its log.
///
/// A rigid axis needs its position and torque (--position, --torque), a flexible joint the angles of motor and link and the
/// torque (--motor, --link, --torque). Velocities and accelerations need not be logged. The curves of friction and stiffness are
/// estimated without assuming a form, with confidence bands; then their physical parameters, each with a standard error, or
/// with the range that the data support where they do not tell it. A record is CSV with a header, whitespace-separated
/// columns without one (named c0, c1, ...), Parquet, or MAT v5.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    flexure joint axis.csv --position q --torque tau --friction friction.csv --report report.html\n  \
    flexure joint axis.mat --position qm --torque vir --torque-constant gtau --prismatic \\\n    \
      --reference qg --kp kp --kv kv --json\n  \
    flexure joint arm.csv --motor qm1 --link q1 --torque tau1 --arm arm.toml --stiffness k.csv")]
pub struct Arguments {
    /// The record.
    record: PathBuf,
    /// The column of the torque (or force, current, voltage: see --torque-constant).
    #[arg(long, value_name = "COLUMN")]
    torque: String,
    /// The column of a rigid axis's position.
    #[arg(long, value_name = "COLUMN", conflicts_with_all = ["motor", "link"], required_unless_present_all = ["motor", "link"])]
    position: Option<String>,
    /// The column of a flexible joint's motor angle.
    #[arg(long, value_name = "COLUMN", requires = "link")]
    motor: Option<String>,
    /// The column of a flexible joint's link angle.
    #[arg(long, value_name = "COLUMN", requires = "motor")]
    link: Option<String>,
    /// The column of the (link's) velocity; by default it is derived from the position.
    #[arg(long, value_name = "COLUMN")]
    velocity: Option<String>,
    /// Torque a unit of the torque column: a number, or the name of a constant of a MAT file.
    #[arg(long, value_name = "K", default_value = "1", allow_hyphen_values = true, value_parser = data::number)]
    torque_constant: Number,
    /// Gear ratio: motor angles are divided by it, torques multiplied, so that all is seen from the link.
    #[arg(long, value_name = "N", default_value = "1", value_parser = arguments::positive)]
    gear_ratio: f64,
    /// Sample time in s; by default that of column t.
    #[arg(long, value_name = "S", value_parser = arguments::positive)]
    sample_time: Option<f64>,
    /// The axis is prismatic: positions in m, forces in N.
    #[arg(long, conflicts_with = "motor")]
    prismatic: bool,
    /// Gravity acts on the axis: terms cos q and sin q.
    #[arg(long, conflicts_with = "motor")]
    gravity: bool,
    /// A spring acts on the axis: a term q.
    #[arg(long, conflicts_with = "motor")]
    spring: bool,
    /// Level of the confidence bands.
    #[arg(long, value_name = "LEVEL", default_value = "0.95", allow_hyphen_values = true, value_parser = arguments::level)]
    band: f64,
    /// The column of the reference that a position controller followed: the motion is simulated in its loop,
    /// torque column = KV (KP (reference - position) - velocity).
    #[arg(long, value_name = "COLUMN", requires_all = ["kp", "kv"], conflicts_with = "motor")]
    reference: Option<String>,
    /// The position gain KP of that controller: a number, or the name of a constant of a MAT file.
    #[arg(long, value_name = "KP", requires = "reference", value_parser = data::number)]
    kp: Option<Number>,
    /// The velocity gain KV of that controller: a number, or the name of a constant of a MAT file.
    #[arg(long, value_name = "KV", requires = "reference", value_parser = data::number)]
    kv: Option<Number>,
    /// Write the friction curve here: .csv or .parquet.
    #[arg(long, value_name = "CURVE.csv")]
    friction: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    if let Some(path) = &arguments.friction {
        check_record_writable(path)?;
    }
    let file = spinning("reading", || read_record(&arguments.record))?;
    let log = Log::read(&file, arguments)?;
    rigid::run(&file, &log, arguments)
}
