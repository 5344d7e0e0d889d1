//! Whether a record is the log of a robot's joint, and the command for it.

use flexure::identify::robot_joint::{Extra, gear_ratio};
use flexure::look::{Column, Look};
use flexure::text::{self, exact, number};
use flexure_io::RecordFile;

use super::Request;
use super::joint_columns::{Joint, integration, is_named, joints};
use super::joint_trial::{Assumed, Failure, trial};
use super::preparations::{Repair, without_gaps};
use super::roles::{
    Role, is_current, is_force_constant, is_prismatic, is_torque, is_torque_constant, role, role_with_unit,
};
use super::suggestion::Suggestion;
use crate::joints::{in_unit, written_ratio};
use crate::text::{grouped, quoted};

/// Of this number of samples, in the middle, the suggested identification is tried. Convention: it takes a few seconds an axis.
const MOST_TRIED: usize = 12_500;

/// A simulated motion with a larger fit, in percent, leaves nothing to gravity or a spring.
const CLOSE: f64 = 80.0;

/// What a look finds about joints.
pub(super) enum Outcome {
    /// `flexure joint` fits; it was tried, on a part of a long record.
    Fits(Suggestion),
    /// The record is that of a joint, but the joint cannot be identified.
    Fails(Failure),
    /// Nothing shows that the record is that of a joint, or saying so would not help.
    None,
}

/// Suggests `flexure joint` if the names say that the record is of a joint, or if a position integrates a torque. The command is tried if
/// the samples are evenly spaced.
pub(super) fn suggestion(file: &RecordFile, request: &Request, look: &Look, sample_time: Option<f64>) -> Outcome {
    let joints = joints(file, request, look);
    let Some(&first) = joints.first() else {
        return Outcome::None;
    };
    let uniform = look.clock.as_ref().is_none_or(|clock| clock.is_uniform);
    let is_long = file.record.len() > MOST_TRIED;
    let step = sample_time.filter(|_| uniform);
    let middle = match is_long {
        true => (file.record.len() - MOST_TRIED) / 2..(file.record.len() + MOST_TRIED) / 2,
        false => 0..file.record.len(),
    };
    let command = |tried: &[Joint]| Command::new(file, request, look, tried, joints.len());
    // What the units alone say is suggested if a trial succeeds.
    let is_sure = is_named(&first) || integration(look, &first);
    let Some(step) = step else {
        if !is_sure {
            return Outcome::None;
        }
        let tried = if is_arm(&joints) { &joints[..] } else { &[first] };
        return Outcome::Fits(command(tried).suggestion(look, tried[0], sample_time));
    };
    // The first candidate that comes close, otherwise the closest.
    let mut chosen: Option<(Joint, f64, Command)> = None;
    let mut reason: Option<Failure> = None;
    // Why a flexible joint is passed over.
    let mut against = None;
    for tried in candidates(&joints) {
        let is_flexible = tried[0].motor.is_some();
        match best(&tried, command, |assumed| trial(file, &middle, &tried, assumed, step)) {
            Err(why) => {
                against = is_flexible.then(|| why.text.clone()).or(against);
                reason.get_or_insert(why);
            }
            Ok((fit, command)) => {
                let is_close = fit > CLOSE;
                if is_flexible {
                    against = Some(format!("its simulated motion fits by only {}", text::fit(fit, 1)));
                }
                if chosen.as_ref().is_none_or(|(_, before, _)| fit > *before) {
                    chosen = Some((tried[0], fit, command));
                }
                if is_close {
                    break;
                }
            }
        }
    }
    if let Some((tried, _, command)) = chosen {
        let mut suggestion = command.suggestion(look, tried, sample_time);
        let flexible = against.filter(|_| tried.motor.is_none());
        suggestion
            .notes
            .extend(flexible.map(|why| format!("A flexible joint was tried, too: {why}.")));
        return Outcome::Fits(suggestion);
    }
    // A part may show too little of the motion.
    if is_long && is_sure && !reason.as_ref().is_some_and(|why| why.is_too_fast) {
        let tried = if is_arm(&joints) { &joints[..] } else { &[first] };
        return Outcome::Fits(command(tried).suggestion(look, tried[0], sample_time));
    }
    let why = reason.unwrap_or_default();
    let torques = if is_arm(&joints) { &joints[..] } else { &[first] };
    let torques = quoted(torques.iter().map(|joint| joint.torque));
    match is_sure && (integration(look, &first) || first.motor.is_some()) {
        true => Outcome::Fails(Failure {
            text: format!(
                "No joint can be identified from the motion under {torques}: {}.",
                why.text
            ),
            ..why
        }),
        false => Outcome::None,
    }
}

/// What a record needs before `flexure joint` where the joints' columns miss samples, but time none; otherwise `None`.
pub(super) fn gaps(file: &RecordFile, request: &Request, look: &Look) -> Option<Repair> {
    let joints = joints(file, request, look);
    let is_used = |name: &str| {
        let of = |joint: &Joint| [Some(joint.torque), Some(joint.position), joint.motor].contains(&Some(name));
        joints.iter().any(of)
    };
    let incomplete = |i: &usize| is_used(&look.columns[*i].name) && look.columns[*i].samples < file.record.len();
    let columns: Vec<usize> = (0..look.columns.len()).filter(incomplete).collect();
    let is_even = look.clock.as_ref().is_none_or(|clock| clock.is_uniform);
    (is_even && !columns.is_empty()).then(|| without_gaps(look, file, &columns))
}

/// The command for a candidate with what may act on it in addition to the torque, and its fit: the first that comes close, otherwise the closest.
fn best<'a>(
    tried: &[Joint],
    command: impl Fn(&[Joint]) -> Command<'a>,
    trial: impl Fn(Assumed) -> Result<f64, Failure>,
) -> Result<(f64, Command<'a>), Failure> {
    let mut best: Option<(f64, Command)> = None;
    let mut reason = None;
    for extra in extras(tried) {
        let command = command(tried).with(extra);
        if command.extra != extra {
            continue;
        }
        match trial(command.assumed()) {
            Err(why) => _ = reason.get_or_insert(why),
            Ok(fit) if best.as_ref().is_none_or(|(before, _)| fit > *before) => best = Some((fit, command)),
            Ok(_) => {}
        }
        if best.as_ref().is_some_and(|(fit, _)| *fit > CLOSE) {
            break;
        }
    }
    best.ok_or_else(|| reason.unwrap_or_default())
}

/// Whether a position is counts of an encoder, by its whole numbers and since no unit says otherwise.
fn are_counts(file: &RecordFile, look: &Look, position: &str) -> bool {
    let is_position = |c: &&Column| c.name == position && file.unit(position).is_none();
    let quantised = (look.columns.iter().find(is_position)).and_then(|c| c.quantisation);
    quantised.is_some_and(|q| q.step == 1.0)
}

/// Two flexible joints are a two-link arm.
fn is_arm(joints: &[Joint]) -> bool {
    joints.len() == 2 && joints.iter().all(|j| j.motor.is_some())
}

/// The candidates for identification, the best first: an arm; otherwise the first joint, as a flexible one, or as a rigid one at either of
/// its encoders.
fn candidates<'a>(joints: &[Joint<'a>]) -> Vec<Vec<Joint<'a>>> {
    if is_arm(joints) {
        return vec![joints.to_vec()];
    }
    let first = joints[0];
    let positions = first.motor.into_iter().chain([first.position]);
    let rigid = positions.map(|position| Joint {
        position,
        motor: None,
        ..first
    });
    let flexible = first.motor.map(|_| first);
    flexible.into_iter().chain(rigid).map(|joint| vec![joint]).collect()
}

/// What may act on a rigid axis in addition to the torque: nothing, gravity or a spring.
fn extras(joints: &[Joint]) -> Vec<Option<Extra>> {
    match joints[0].motor {
        Some(_) => vec![None],
        None => vec![None, Some(Extra::Gravity), Some(Extra::Spring)],
    }
}

/// The options of `flexure joint` for the columns of a joint or of an arm.
struct Command<'a> {
    options: Vec<String>,
    /// The name and the value of the torque for each unit of the torque column.
    constant: Option<(&'a str, f64)>,
    /// Of a gear between motor and link.
    gear_ratio: f64,
    extra: Option<Extra>,
    notes: Vec<String>,
    given: Option<f64>,
    /// A constant that seems to be the sample time, and that.
    stated: Option<(&'a str, f64)>,
    /// The torques of the other joints.
    others: Vec<String>,
    /// The unit of the torque's column if it is a current, otherwise empty.
    current: &'a str,
}

impl<'a> Command<'a> {
    fn new(file: &'a RecordFile, request: &Request, look: &Look, tried: &[Joint], found: usize) -> Self {
        let joined = |column: fn(&Joint) -> Option<String>| -> String {
            tried.iter().filter_map(column).collect::<Vec<_>>().join(",")
        };
        let (first, position) = (tried[0], joined(|j| Some(j.position.to_owned())));
        let mut options = match first.motor {
            Some(_) => vec![
                "--motor".to_owned(),
                joined(|j| j.motor.map(str::to_owned)),
                "--link".to_owned(),
                position,
            ],
            None => vec!["--position".to_owned(), position],
        };
        options.extend(["--torque".to_owned(), joined(|j| Some(j.torque.to_owned()))]);
        let named = |wanted: &dyn Fn(&str) -> bool| file.constants.iter().find(|c| wanted(&c.0));
        let constant = named(&is_torque_constant).map(|(name, value)| (name.as_str(), *value));
        options.extend(
            constant
                .iter()
                .flat_map(|(name, _)| ["--torque-constant".to_owned(), (*name).to_owned()]),
        );
        let mut command = Command {
            options,
            constant,
            gear_ratio: 1.0,
            extra: None,
            notes: Vec::new(),
            given: request.sample_time,
            stated: file.stated_sample_time(),
            others: Vec::new(),
            current: match is_current(first.torque, file.unit(first.torque)) {
                true => file.unit(first.torque).unwrap_or("A"),
                false => "",
            },
        };
        match first.motor {
            Some(motor) => command.complete_flexible(file, look, [motor, first.position, first.torque]),
            None => command.complete_rigid(file, look, first),
        }
        if tried.len() == 1 && found > 1 {
            let joints = joints(file, request, look);
            let others = joints.iter().map(|j| j.torque).filter(|torque| *torque != first.torque);
            command.others = others.map(str::to_owned).collect();
        }
        command
    }

    /// The gear between motor and link.
    fn complete_flexible(&mut self, file: &RecordFile, look: &Look, [motor, link, torque]: [&str; 3]) {
        let of = |name: &str, unit: &str| in_unit(file, name, unit).ok().map(|(samples, _)| samples);
        let (Some(at_motor), Some(at_link), Some(driving)) = (of(motor, "rad"), of(link, "rad"), of(torque, "Nm"))
        else {
            return;
        };
        let ratio = gear_ratio(&at_motor, &at_link, &driving);
        let is_counted = are_counts(file, look, motor) && !are_counts(file, look, link);
        if let Some(ratio) = ratio.filter(|_| is_counted) {
            let turns = if ratio < 0.0 { "; R is negative" } else { "" };
            self.gear_ratio = ratio;
            self.options.extend(["--gear-ratio".to_owned(), "R".to_owned()]);
            self.options
                .extend(["--convert".to_owned(), format!("{motor}=rev/N:rad")]);
            self.notes.push(format!(
                "'{motor}' has whole numbers, as counts of an encoder: put the counts of one revolution in place of N, and the gear ratio in place of R. N times R is about \
                 {} here{turns}.",
                grouped((ratio * std::f64::consts::TAU).abs().round() as usize)
            ));
        } else if let Some(ratio) = ratio {
            let option = written_ratio(ratio);
            self.gear_ratio = option.parse().unwrap_or(ratio);
            self.options.extend(["--gear-ratio".to_owned(), option]);
            self.notes.push(format!(
                "'{motor}' goes {} times as far as '{link}', as an angle before the gear does. Take the gear ratio of the data sheet; the torque is \
                 multiplied by it.",
                number(ratio)
            ));
        }
    }

    /// Whether it moves along a line, its position loop, and whether a gear may follow.
    fn complete_rigid(&mut self, file: &RecordFile, look: &Look, joint: Joint) {
        let is_line = |name: &str| file.unit(name).is_some_and(is_prismatic);
        if is_line(joint.position) || is_line(joint.torque) {
            self.options.push("--prismatic".to_owned());
        } else if let Some((constant, _)) = self.constant.filter(|(name, _)| is_force_constant(name)) {
            self.options.push("--prismatic".to_owned());
            self.notes.push(
                format!(
                    "The name of the constant '{constant}' in the file suggests an axis that moves along a line. Leave out --prismatic if it turns."
                ),
            );
        } else if file.unit(joint.position).is_none() && !is_torque(joint.torque) {
            self.notes
                .push("Add --prismatic if the axis moves along a line: positions in m, forces in N.".to_owned());
        }
        if are_counts(file, look, joint.position) && !self.is_prismatic() {
            self.options
                .extend(["--convert".to_owned(), format!("{}=rev/N:rad", joint.position)]);
            self.notes.push(format!(
                "'{}' has whole numbers, as counts of an encoder: put the counts of one revolution in place of N. Where the encoder is before a gear, write --motor in \
                 place of --position, and add --gear-ratio.",
                joint.position
            ));
        }
        let constants = || file.constants.iter().map(|c| c.0.as_str());
        let gains = ["kp", "kv"].map(|gain| constants().find(|name| name.eq_ignore_ascii_case(gain)));
        let is_reference = |name: &&str| matches!(role(name), Some((Role::Reference, _)));
        let reference = look.columns.iter().map(|c| c.name.as_str()).find(is_reference);
        if let (Some(reference), [Some(kp), Some(kv)]) = (reference, gains) {
            let options = ["--reference", reference, "--kp", kp, "--kv", kv];
            self.options.extend(options.map(str::to_owned));
        } else if !self.is_prismatic()
            && !self.options.iter().any(|option| option == "--convert")
            && let Some((Role::MotorPosition, _)) = role_with_unit(joint.position, file.unit(joint.position))
        {
            self.notes.push(format!(
                "'{}' is by its name the angle of a motor: where a gear follows it, write --motor in place of --position, and add --gear-ratio N.",
                joint.position
            ));
        }
    }

    /// What it says of the joints.
    fn assumed(&self) -> Assumed {
        Assumed {
            constant: self.constant.map_or(1.0, |(_, value)| value),
            gear_ratio: self.gear_ratio,
            extra: self.extra,
            is_prismatic: self.is_prismatic(),
        }
    }

    /// With gravity or a spring; gravity does not act along a line.
    fn with(mut self, extra: Option<Extra>) -> Self {
        let option = match extra {
            Some(Extra::Gravity) if !self.is_prismatic() => "--gravity",
            Some(Extra::Spring) => "--spring",
            _ => return self,
        };
        self.options.push(option.to_owned());
        Command { extra, ..self }
    }

    fn is_prismatic(&self) -> bool {
        self.options.iter().any(|option| option == "--prismatic")
    }

    /// The command with its reasons.
    fn suggestion(mut self, look: &Look, joint: Joint, sample_time: Option<f64>) -> Suggestion {
        let stated = self.stated.filter(|_| sample_time.is_none());
        if let Some(step) = self.given.or(stated.map(|(_, step)| step)) {
            self.options.extend(["--sample-time".to_owned(), exact(step)]);
        }
        if let Some((name, _)) = stated {
            self.notes.push(format!(
                "The record has no column of instants. By its name, the constant '{name}' says the sample time."
            ));
        } else if sample_time.is_none() {
            self.notes.push(
                "The record has no column of instants, and a joint needs the sample time: add --sample-time S, in s."
                    .to_owned(),
            );
        }
        self.options.extend(["--report".to_owned(), "report.html".to_owned()]);
        let integrates = integration(look, &joint);
        let why = match integrates {
            true => format!(
                "'{}' integrates '{}', as a position integrates a force: a joint's friction and inertia explain it, a block model does not.",
                joint.position, joint.torque
            ),
            false => "The columns are named as those of a joint.".to_owned(),
        };
        if self.constant.is_none() && !self.current.is_empty() {
            let (unit, what) = match self.is_prismatic() {
                true => ("N", "force"),
                false => ("N m", "torque"),
            };
            self.notes.push(format!(
                "'{}' is a current: add --torque-constant KT, in {unit} for each {}, which makes it a {what}.",
                joint.torque, self.current
            ));
        }
        if joint.motor.is_none() && !integrates && self.extra.is_none() {
            self.notes.push("The data do not show that the position integrates the torque: if gravity or a spring acts, add --gravity or --spring.".to_owned());
        }
        if !self.others.is_empty() {
            self.notes.push(format!(
                "The joints of {} may be identified in the same way, one at a time.",
                self.others.join(", ")
            ));
        }
        let options: Vec<&str> = self.options.iter().map(String::as_str).collect();
        let mut suggestion = Suggestion::new("joint", &options, why);
        suggestion.notes = self.notes;
        suggestion
    }
}
