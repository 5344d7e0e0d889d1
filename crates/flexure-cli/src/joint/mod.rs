//! `flexure joint`: a joint's friction, stiffness and inertia from its log.

mod arm;
mod data;
mod flexible;
pub mod memory;
mod page;
mod rigid;
mod two_link;
pub mod words;

use std::path::PathBuf;

use anyhow::Result;
use flexure_io::{check_record_writable, check_writable, read_record};

use crate::arguments::{self, Usage};
use crate::files::keep_apart;
use crate::progress::spinning;
use data::{Log, Number};

/// Find a joint's friction, stiffness and inertia from its log.
///
/// A rigid axis needs its position and torque (--position, --torque), a flexible joint the angles of motor and link and the
/// torque (--motor, --link, --torque), a two-link arm with its coupling two columns of each (--motor qm1,qm2 --link q1,q2
/// --torque tau1,tau2; the curves of joint 1 are then written to files with -1 before their extension, of joint 2 with -2). Velocities and accelerations need not be logged. The curves of friction and stiffness are
/// estimated without assuming a form, with confidence bands; then their physical parameters, each with a standard error, or
/// with the range that the data support where they do not tell it. A record is CSV with a header, whitespace-separated
/// columns without one (named c0, c1, ...), Parquet, or MAT v5.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    flexure joint axis.csv --position q --torque tau --friction friction.csv --report report.html\n  \
    flexure joint axis.mat --position qm --torque vir --torque-constant gtau --prismatic \\\n    \
      --reference qg --kp kp --kv kv --json\n  \
    flexure joint arm.csv --motor qm1 --link q1 --torque tau1 --arm arm.toml --stiffness k.csv\n  \
    flexure joint arm.csv --motor qm1,qm2 --link q1,q2 --torque tau1,tau2 --arm arm.toml --report arm.html\n  \
    flexure simulate arm.toml -o again.csv")]
pub struct Arguments {
    /// The record.
    record: PathBuf,
    /// The column of the torque (or force, current, voltage: see --torque-constant), or of those of both joints: tau1,tau2.
    #[arg(long, value_name = "COLUMN")]
    torque: String,
    /// The column of a rigid axis's position.
    #[arg(long, value_name = "COLUMN", conflicts_with_all = ["motor", "link"], required_unless_present_all = ["motor", "link"])]
    position: Option<String>,
    /// The column of a flexible joint's motor angle, or of those of both joints: qm1,qm2.
    #[arg(long, value_name = "COLUMN", requires = "link")]
    motor: Option<String>,
    /// The column of a flexible joint's link angle, or of those of both joints: q1,q2.
    #[arg(long, value_name = "COLUMN", requires = "motor")]
    link: Option<String>,
    /// The column of a rigid axis's velocity; by default it is derived from the position.
    #[arg(long, value_name = "COLUMN", conflicts_with = "motor")]
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
    #[arg(long, conflicts_with_all = ["motor", "prismatic"])]
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
    /// The motor's inertia in kg m^2 on the link's side, where it is known; of a single flexible joint.
    #[arg(long, value_name = "JM", requires = "motor", conflicts_with = "position", value_parser = arguments::positive)]
    motor_inertia: Option<f64>,
    /// Write the stiffness curve here, as torque and as stiffness over the deflection: .csv or .parquet.
    #[arg(long, value_name = "CURVE.csv", requires = "motor", conflicts_with = "position")]
    stiffness: Option<PathBuf>,
    /// Write the joint or arm as an arm file here, for `flexure simulate`; a single joint's other one is locked. An arm file has no
    /// gravity and no spring, and of a rigid axis's constant torque it only says how large it is.
    #[arg(long, value_name = "ARM.toml")]
    arm: Option<PathBuf>,
    /// Which joint of that arm it is: 1, the shoulder, or 2, the elbow.
    #[arg(long, value_name = "1|2", default_value = "1", value_parser = clap::value_parser!(u8).range(1..=2))]
    joint: u8,
    /// Take the links of that arm from this arm file; the moving link's moment of inertia becomes what was identified (of a
    /// two-link arm lengths, centres of mass and the mass of link 1 are taken).
    #[arg(long, value_name = "ARM.toml", requires = "arm", conflicts_with = "position")]
    template: Option<PathBuf>,
    /// Write a page that shows everything here.
    #[arg(long, value_name = "REPORT.html")]
    report: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let curves = arguments.friction.iter().chain(&arguments.stiffness);
    let outputs = curves.chain(&arguments.arm).chain(&arguments.report);
    keep_apart([&arguments.record].into_iter().chain(&arguments.template), outputs)?;
    for path in [&arguments.friction, &arguments.stiffness].into_iter().flatten() {
        check_record_writable(path)?;
    }
    for path in [&arguments.arm, &arguments.report].into_iter().flatten() {
        check_writable(path)?;
    }
    let file = spinning("reading", || read_record(&arguments.record))?;
    if let Some(columns) = data::pairs(&file, arguments)? {
        if arguments.motor_inertia.is_some() {
            let message = "--motor-inertia is of a single flexible joint; leave it out for a two-link arm, whose motors are identified";
            return Err(Usage(message.to_owned()).into());
        }
        return two_link::run(&file, &columns, arguments);
    }
    let log = Log::read(&file, arguments)?;
    match arguments.motor {
        Some(_) => flexible::run(&file, &log, arguments),
        None => rigid::run(&file, &log, arguments),
    }
}
