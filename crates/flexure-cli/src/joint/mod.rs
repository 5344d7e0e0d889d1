//! `flexure joint`: a joint's friction, stiffness and inertia from its log.

mod axes;
mod chain;
mod counts;
mod log;
mod python;

use std::path::{Path, PathBuf};

use anyhow::Result;
use flexure::identify::robot_joint::{AxisDrive, Extra};
use flexure::text::shown_path;
use flexure_io::arm::Excitation;
use flexure_io::{RecordFile, write_record_with_units};
use flexure_workbench::fleet::{Outcome, joined, single_values};
use flexure_workbench::joints::{Curves, Place, Settings, Units, identify, recorded};
use flexure_workbench::preparation::Conversion;
use serde_json::{Value, json};

use crate::arguments::{self, Usage};
use crate::files::{name_json, prepare, write_text, wrote};
use crate::output::{print, print_result, this_command};
use crate::progress::spinning;
use crate::simulate::read_arm;
use crate::source::Source;
use crate::steps::STEPS;
use axes::AxisNames;
use chain::ChainOptions;
use log::{Columns, Names, Number};

/// Find a joint's friction, stiffness and inertia from its log.
///
/// A rigid axis needs the columns of its position and its torque: --position, --torque. A flexible joint needs the
/// columns of the motor angle, the link angle and the torque: --motor, --link, --torque. A two-link arm needs two
/// columns of each: --motor qm1,qm2 --link q1,q2 --torque tau1,tau2. Velocities and accelerations need not be logged. A
/// record is a text file with columns (such as CSV), a Parquet, MAT or HDF5 file, or a topic of a ROS 2 bag.
///
/// With --axis 1..6, every axis of a log is identified on its own. In the names of columns, {} stands for the axis. The
/// result is a table with one row for each axis. If an axis cannot be identified, its row gives the reason; the other
/// axes are still identified. The exit code is 0 if at least one axis was identified.
///
/// With --chain robot.urdf, the axes are the joints of a robot. The torques from gravity and from the motion of the
/// other joints are computed from the inertias of its links. Friction and the inertia of the drive are identified.
///
/// The curves of friction and stiffness are estimated without an assumed form, with confidence bands. Then forms with
/// physical parameters are fitted. Each parameter has a standard error, or the range that the data support. For several
/// joints, each curve gets one file for each joint, with the joint before the extension: friction-1.csv,
/// friction-2.csv.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    flexure joint axis.csv --position q --torque tau --friction friction.csv --report report.html\n  \
    flexure joint axis.mat --position qm --torque vir --torque-constant gtau --prismatic \\\n    \
      --reference qg --kp kp --kv kv --json\n  \
    flexure joint bag.mcap --joint elbow --report elbow.html\n  \
    flexure joint arm.csv --motor qm1 --link q1 --torque tau1 --arm arm.toml --stiffness k.csv\n  \
    flexure joint arm.csv --motor qm1,qm2 --link q1,q2 --torque tau1,tau2 --arm arm.toml --report arm.html\n  \
    flexure joint axis.csv --position q --torque tau --validate later.csv\n  \
    flexure joint robot.csv --axis 1..6 --motor qm{} --link q{} --torque tau{} --report robot.html\n  \
    flexure joint robot.csv --chain robot.urdf --position q{} --torque tau{} --report robot.html\n  \
    flexure simulate arm.toml -o again.csv")]
pub struct Arguments {
    /// The record.
    record: PathBuf,
    /// The column of the torque, or of a force, current or voltage (see --torque-constant). For a two-link arm, both
    /// columns: tau1,tau2. For a joint of a bag, the default is effort.
    #[arg(long, value_name = "COLUMN", required_unless_present = "joint")]
    torque: Option<String>,
    /// The column of a rigid axis's position behind its gear. For a joint of a bag, the default is position.
    #[arg(long, value_name = "COLUMN", conflicts_with_all = ["motor", "link"], required_unless_present_any = ["motor", "joint"])]
    position: Option<String>,
    /// The column of the motor angle of a flexible joint. For a two-link arm, both columns: qm1,qm2. Without --link,
    /// the axis is rigid, and its only encoder is at its motor.
    #[arg(long, value_name = "COLUMN")]
    motor: Option<String>,
    /// The column of the link angle of a flexible joint. For a two-link arm, both columns: q1,q2.
    #[arg(long, value_name = "COLUMN", requires = "motor")]
    link: Option<String>,
    /// The column of the velocity of a rigid axis. By default, the velocity is derived from the position.
    #[arg(long, value_name = "COLUMN", conflicts_with = "link")]
    velocity: Option<String>,
    /// Identify several axes, each on its own: 1..6, or 1,3, or names. In the names of columns, {} stands for the axis.
    /// If an axis has no column of its link angle, it is taken as a rigid axis at its motor.
    #[arg(long, value_name = "AXES", value_parser = axes::names, conflicts_with_all = ["arm", "motor_inertia", "joint"])]
    axis: Option<AxisNames>,
    #[command(flatten)]
    chain: ChainOptions,
    /// The torque for each unit of the torque column: a number, or the name of a constant in a MAT file.
    #[arg(long, value_name = "K", default_value = "1", allow_hyphen_values = true, value_parser = log::number)]
    torque_constant: Number,
    /// The gear ratio. Angles and velocities at the motor (--motor) are divided by it, and torques are multiplied by
    /// it. All results are seen from the link.
    #[arg(long, value_name = "N", default_value = "1", value_parser = arguments::positive)]
    gear_ratio: f64,
    /// The sample time in s. By default, it is taken from the time column. Without this column, give this option.
    #[arg(long, value_name = "S", value_parser = arguments::positive)]
    sample_time: Option<f64>,
    /// The axis is prismatic: its positions are in m, its forces in N.
    #[arg(long, conflicts_with = "link")]
    prismatic: bool,
    /// Gravity acts on the axis: add the terms cos q and sin q to the equation of motion.
    #[arg(long, conflicts_with_all = ["link", "prismatic"])]
    gravity: bool,
    /// A spring acts on the axis: add the term q to the equation of motion.
    #[arg(long, conflicts_with = "link")]
    spring: bool,
    /// The level of the confidence bands.
    #[arg(long, value_name = "LEVEL", default_value = "0.95", allow_hyphen_values = true, value_parser = arguments::level)]
    band: f64,
    /// The column of the reference that a position controller followed. The motion is then also simulated in the loop
    /// of this controller: torque column = KV (KP (reference - position) - velocity).
    #[arg(long, value_name = "COLUMN", requires_all = ["kp", "kv"], conflicts_with = "motor")]
    reference: Option<String>,
    /// The position gain KP of the controller of --reference: a number, or the name of a constant in a MAT file.
    #[arg(long, value_name = "KP", requires = "reference", value_parser = log::number)]
    kp: Option<Number>,
    /// The velocity gain KV of the controller of --reference: a number, or the name of a constant in a MAT file.
    #[arg(long, value_name = "KV", requires = "reference", value_parser = log::number)]
    kv: Option<Number>,
    /// Judge the result on this log of the same joint, which is not used for the fit. The command judges the torque
    /// that the motion in this log needs, and the simulated motion. The columns of both logs have the same names.
    #[arg(long, value_name = "LATER.csv")]
    validate: Option<PathBuf>,
    /// Write the friction curve to this file: .csv or .parquet.
    #[arg(long, value_name = "CURVE.csv")]
    friction: Option<PathBuf>,
    /// Write the friction curve at the motor of a flexible joint to this file, if the data show it: .csv or .parquet.
    #[arg(long, value_name = "CURVE.csv", requires = "link", conflicts_with = "position")]
    motor_friction: Option<PathBuf>,
    /// The known inertia of the motor in kg m^2, on the link's side. Only for a single flexible joint.
    #[arg(long, value_name = "JM", requires = "link", conflicts_with = "position", value_parser = arguments::positive)]
    motor_inertia: Option<f64>,
    /// Write the stiffness curve to this file, as torque and as stiffness over the deflection: .csv or .parquet.
    #[arg(long, value_name = "CURVE.csv", requires = "link", conflicts_with = "position")]
    stiffness: Option<PathBuf>,
    /// Write the joint or the arm to this arm file, for `flexure simulate`. For a single joint, the other joint of the
    /// arm is locked. An arm file cannot contain gravity or a spring. It contains a constant torque on a rigid axis
    /// only as a comment.
    #[arg(long, value_name = "ARM.toml")]
    arm: Option<PathBuf>,
    /// For --arm: which joint of the arm was logged. 1 is the shoulder, 2 is the elbow.
    #[arg(long, value_name = "1|2", default_value = "1", value_parser = clap::value_parser!(u8).range(1..=2))]
    arm_joint: u8,
    /// For --arm: take the links from this arm file. For a single joint, the moment of inertia of the moving link
    /// follows from what was identified. For a two-link arm, only the lengths, the centres of mass and the mass of link
    /// 1 are taken.
    #[arg(long, value_name = "ARM.toml", requires_all = ["arm", "link"])]
    template: Option<PathBuf>,
    /// Write a page with all results to this file.
    #[arg(long, value_name = "REPORT.html")]
    report: Option<PathBuf>,
    /// Convert the unit of a column, for example q=deg:rad, or q=rev/4096:rad for an encoder with 4096 counts per
    /// revolution. This option may be given several times.
    #[arg(long, help_heading = STEPS, value_name = "COLUMN=UNIT", value_parser = crate::prepare::conversion)]
    convert: Vec<Conversion>,
    #[command(flatten)]
    source: Source,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    arguments.refuse_arm_with_extras()?;
    arguments.source.check()?;
    arguments.check_files()?;
    if arguments.axis.is_some() || arguments.chain.given().is_some() {
        return axes::run(arguments);
    }
    let file = arguments.read(&arguments.record)?;
    let names = arguments.names();
    let columns = Columns::new(&file, &names)?;
    if columns.joints() == 2 {
        arguments.check_two_joints()?;
    }
    let log = columns.log(&file, arguments)?;
    let (samples, sample_time) = (log.samples(), log.sample_time);
    let later_file = arguments.later_file()?;
    let later = arguments.later(later_file.as_ref(), &names)?;
    let joint = spinning("identifying", || {
        identify(log, &arguments.settings(arguments.prismatic), &file, arguments::option)
    })?;
    let position_loop = arguments.position_loop(&file, &names)?;
    let trial = spinning("simulating", || joint.try_out(position_loop, later))?;

    // Everything is made before anything is written.
    let page = match &arguments.report {
        None => None,
        Some(path) => {
            let python = arguments.python(&file, columns.joints(), sample_time);
            Some((path, joint.html(&trial, Some(this_command()), python)?))
        }
    };
    let arm = match &arguments.arm {
        None => None,
        Some(path) => Some((path, joint.arm_file(arguments.place(&columns, &file)?)?)),
    };
    let curves = joint.curves()?;
    let numbers = (1..=curves.len()).map(|i| (curves.len() > 1).then(|| i.to_string()));
    let mut written = arguments.write_curves(numbers.zip(&curves))?;
    for (path, text) in [arm, page].into_iter().flatten() {
        write_text(path, &text)?;
        written.push(path.clone());
    }
    if arguments.json {
        let mut object = joint.tried_json(&trial);
        object["samples"] = json!(samples);
        object["sample_time"] = json!(sample_time);
        arguments.add_files(&mut object, &written);
        return print(&object.to_string());
    }
    let mut lines = joint.summary(&trial);
    let missing = |path: &&PathBuf| columns.joints() == 1 && !written.contains(path);
    let wanted = [
        (&arguments.stiffness, "stiffness"),
        (&arguments.motor_friction, "friction at the motor"),
    ];
    for (path, what) in wanted {
        if let Some(path) = path.as_ref().filter(missing) {
            lines.note(format!("{} is not written: no {what} was seen", shown_path(path)));
        }
    }
    let next = arguments.validate.is_none().then(|| {
        let text = "next: add --validate LATER.csv, another log of this joint, to the same command: does the result hold there? \
                    (One log is cut in two by 'flexure prepare --cut'.)";
        [String::new(), text.to_owned()]
    });
    print_result(&lines, wrote(&written).chain(next.into_iter().flatten()))
}

impl Arguments {
    /// The joint of one record of many: the output of `--json` without lists but with the parameters of the best forms;
    /// and the whole output.
    pub fn of_file(&self, file: &RecordFile) -> Result<Outcome> {
        let names = self.names();
        let log = Columns::new(file, &names)?.log(file, self)?;
        let samples = log.samples();
        let joint = identify(log, &self.settings(self.prismatic), file, arguments::option)?;
        let trial = joint.try_out(self.position_loop(file, &names)?, None)?;
        let mut object = joint.json();
        let (name, motions) = joint.motions_json(&trial.motions);
        let replay = if motions.is_array() { &motions[0] } else { &motions };
        let mut row = vec![("samples".to_owned(), json!(samples))];
        row.push(("replay_fit_percent".to_owned(), replay["fit_percent"].clone()));
        row.extend(single_values(&object));
        for (forms, best) in [
            ("forms", "best_form"),
            ("friction_forms", "best_friction_form"),
            ("stiffness_forms", "best_stiffness_form"),
        ] {
            let all = object[forms].as_array().into_iter().flatten();
            let parameters = all
                .filter(|form| form["form"] == object[best])
                .map(|form| &form["parameters"]);
            for (symbol, value) in parameters.filter_map(Value::as_object).flatten() {
                row.push((symbol.clone(), value["value"].clone()));
                row.push((format!("{symbol}.standard_error"), value["standard_error"].clone()));
                row.push((format!("{symbol}.identifiable"), value["identifiable"].clone()));
            }
        }
        row.push(("warnings".to_owned(), joined(&object["findings"])));
        object[name] = motions;
        Ok(Outcome {
            row,
            model: object.to_string(),
        })
    }

    /// Refuses to write an arm file for a rigid axis with effects that an arm file cannot hold.
    fn refuse_arm_with_extras(&self) -> Result<(), Usage> {
        let term = match (self.gravity, self.spring) {
            (true, _) => "gravity",
            (_, true) => "spring",
            _ => return Ok(()),
        };
        if self.arm.is_none() {
            return Ok(());
        }
        Err(Usage(format!(
            "--arm: an arm file has no {term}, and without it the arm would not move as the axis does; leave --arm out: the motion with the \
             {term} is simulated under the recorded torque, and --report shows it"
        )))
    }

    /// Refuses options of a single joint, and files of curves that cannot be written.
    fn check_two_joints(&self) -> Result<()> {
        if self.motor_inertia.is_some() {
            let message = "--motor-inertia is of a single flexible joint; leave it out for a two-link arm, whose motors are identified";
            return Err(Usage(message.to_owned()).into());
        }
        self.check_numbered(&["1", "2"])
    }

    /// Refuses files of these joints that would overwrite others, and those that cannot be written.
    fn check_numbered(&self, joints: &[impl AsRef<str>]) -> Result<()> {
        let pairs = self
            .curve_files()
            .flat_map(|path| joints.iter().map(move |joint| (path, joint)));
        let curves: Vec<PathBuf> = pairs.map(|(path, joint)| numbered(path, joint.as_ref())).collect();
        self.check_outputs(&curves)
    }

    /// The column of the torque: of a bag's joint the effort, if nothing else is said.
    fn torque(&self) -> &str {
        self.torque.as_deref().unwrap_or("effort")
    }

    /// The column of a rigid axis's position.
    fn position(&self) -> Option<&str> {
        let of_joint = self.motor.is_none().then_some("position");
        self.position.as_deref().or(of_joint)
    }

    /// The files of curves.
    fn curve_files(&self) -> impl Iterator<Item = &PathBuf> {
        let files = [&self.friction, &self.motor_friction, &self.stiffness];
        files.into_iter().flatten()
    }

    fn check_files(&self) -> Result<()> {
        self.check_outputs(self.curve_files())
    }

    fn check_outputs<'a>(&'a self, curves: impl IntoIterator<Item = &'a PathBuf>) -> Result<()> {
        let others = self.arm.iter().chain(&self.report);
        let inputs = [&self.record].into_iter().chain(&self.template).chain(&self.validate);
        prepare(inputs.chain(self.chain.given()), curves, others)
    }

    /// The names of columns.
    fn names(&self) -> Names {
        let at_motor = self.motor.is_some() && self.link.is_none();
        Names {
            torque: self.torque().to_owned(),
            position: match at_motor {
                true => self.motor.clone(),
                false => self.position().map(str::to_owned),
            },
            motor: self.motor.clone().filter(|_| !at_motor),
            link: self.link.clone(),
            velocity: self.velocity.clone(),
            reference: self.reference.clone(),
            at_motor,
            prismatic: self.prismatic,
        }
    }

    /// Writes the curves of every joint to its files, with its name before their extension if it has one, and returns
    /// those that were written.
    fn write_curves<'c>(&self, joints: impl Iterator<Item = (Option<String>, &'c Curves)>) -> Result<Vec<PathBuf>> {
        let units = Units::of(self.prismatic);
        let mut written = Vec::new();
        for (name, curves) in joints {
            let both = [
                (&self.friction, Some(&curves.friction)),
                (&self.motor_friction, curves.motor_friction.as_ref()),
                (&self.stiffness, curves.stiffness.as_ref()),
            ];
            for (path, record) in both {
                if let (Some(path), Some(record)) = (path, record) {
                    let path = name.as_ref().map_or_else(|| path.clone(), |name| numbered(path, name));
                    write_record_with_units(&path, record, &units.of_columns(record))?;
                    written.push(path);
                }
            }
        }
        Ok(written)
    }

    fn settings(&self, prismatic: bool) -> Settings {
        let mut extras = Vec::new();
        extras.extend(self.gravity.then_some(Extra::Gravity));
        extras.extend(self.spring.then_some(Extra::Spring));
        Settings {
            extras,
            prismatic,
            motor_inertia: self.motor_inertia,
            level: self.band,
        }
    }

    /// The controller in whose loop the record was made.
    fn position_loop<'a>(&self, file: &'a RecordFile, names: &Names) -> Result<Option<AxisDrive<'a>>> {
        let (Some(reference), Some(kp), Some(kv)) = (&names.reference, &self.kp, &self.kv) else {
            return Ok(None);
        };
        Ok(Some(AxisDrive::Loop {
            reference: file.finite(reference)?,
            kp: kp.value(file, "kp")?,
            kv: kv.value(file, "kv")?,
            torque_constant: self.torque_on_link(file)?,
        }))
    }

    /// The torque on the link's side for each unit of the torque column.
    fn torque_on_link(&self, file: &RecordFile) -> Result<f64> {
        Ok(self.torque_constant.value(file, "torque-constant")? * self.gear_ratio)
    }

    /// What the arm file needs in addition to the log; the record drives the arm if an arm file can name it.
    fn place(&self, columns: &Columns, file: &RecordFile) -> Result<Place> {
        let joint = usize::from(self.arm_joint) - 1;
        let template = self.template.as_ref().map(|path| read_arm(path)).transpose()?;
        let folder = |path: &Path| path.parent().map(Path::to_owned).unwrap_or_default();
        let beside = (self.arm.as_ref()).is_some_and(|arm| folder(arm) == folder(&self.record));
        let named = beside && columns.are_torques_of(file, joint) && self.torque_on_link(file)? == 1.0;
        // The arm would be driven by the log as it is.
        let named = named && !self.source.prepares() && self.convert.is_empty();
        Ok(Place {
            joint,
            template: template.map(|file| file.arm),
            excitation: match named {
                true => recorded(&file.name()),
                false => Excitation::default(),
            },
        })
    }

    /// Adds the names of the files: a list for an arm, single names for a single joint.
    fn add_files(&self, object: &mut Value, written: &[PathBuf]) {
        if object["joint"] == "two_link_arm" {
            let written = written.iter().map(|path| path.display().to_string());
            object["written"] = written.collect();
            return;
        }
        let files = [
            ("friction_file", &self.friction),
            ("motor_friction_file", &self.motor_friction),
            ("stiffness_file", &self.stiffness),
            ("arm", &self.arm),
            ("report", &self.report),
        ];
        let rigid = object["joint"] == "rigid";
        for (name, path) in files
            .into_iter()
            .filter(|(name, _)| !(rigid && ["stiffness_file", "motor_friction_file"].contains(name)))
        {
            object[name] = name_json(path);
        }
    }
}

/// The path with the joint's number or name before its extension.
fn numbered(path: &Path, joint: &str) -> PathBuf {
    let text = |part: Option<&std::ffi::OsStr>| part.map(|s| s.to_string_lossy().into_owned());
    let stem = text(path.file_stem()).unwrap_or_default();
    let extension = text(path.extension()).map(|e| format!(".{e}")).unwrap_or_default();
    path.with_file_name(format!("{stem}-{joint}{extension}"))
}
