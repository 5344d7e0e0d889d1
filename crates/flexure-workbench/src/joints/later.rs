//! An identified joint or arm on another log: the torque that the motion there needs, and the simulated motion.

use anyhow::Result;
use flexure::Error;
use flexure::identify::robot_joint::{AxisDrive, JointMotion, NeededTorque};
use flexure::record::check_values;
use flexure::text::percent;
use flexure_io::RecordFile;
use serde_json::{Value, json};

use super::simulation::Fit;
use super::text::{POOR, Units, nearness};
use super::{AxisLog, Joint, Log, Motion};
use crate::lines::Lines;
use crate::text::number;

/// The torque holds on another log if its error, as a share of the torque's spread, is at most this many times that on the own log, or at
/// most this share. Conventions.
const GROWN: f64 = 1.5;
const SMALL: f64 = 0.05;
/// Velocities outside the range of the fitted log are worth a word from this share of the samples on.
const UNSEEN: f64 = 0.01;

/// An identified joint or arm tried out: simulated, and on another log where there is one.
pub struct Trial {
    /// The motions of its own log, simulated.
    pub motions: Vec<Motion>,
    /// What it does on another log.
    pub later: Option<Later>,
}

/// Another log of a joint, on which it is tried.
pub struct LaterLog<'a> {
    /// The log.
    pub log: Log,
    /// Its file, for messages.
    pub file: &'a RecordFile,
    /// The controller in whose loop it was made.
    pub position_loop: Option<AxisDrive<'a>>,
}

/// What a joint or an arm does on another log.
pub struct Later {
    /// The log.
    pub log: Log,
    /// Whether the joint was identified from these samples.
    seen: bool,
    /// The torque of a single joint.
    pub torque: Option<LaterTorque>,
    /// The simulated motions.
    pub motions: Vec<Motion>,
    /// The fits of the simulated motions of its own log, percent.
    own_motions: Vec<f64>,
}

/// The torque that the motion of another log needs by what was found.
pub struct LaterTorque {
    /// At every sample.
    pub needed: Vec<f64>,
    /// How near it is to the recorded torque, up to the cut-off.
    pub fit: Fit,
    /// How near it is on the log of the fit.
    own: Fit,
    /// The share of samples at velocities that the log of the fit did not visit.
    unseen: f64,
    /// Of this log and of the log of the fit, Hz.
    cut_off: f64,
    own_cut_off: f64,
}

impl Trial {
    /// What it does on another log: how far off it is, and what to do where it does not hold.
    pub(super) fn write_later(&self, own: &Log, units: &Units, lines: &mut Lines) {
        if let Some(later) = &self.later {
            lines.item("other log", later.text(own, units));
            if let Some(advice) = later.advice() {
                lines.note(format!("{}; {advice}", later.outcome()));
            }
        }
    }
}

impl Later {
    /// Tries `joint`, whose own log is simulated by `own_motions`, on another log.
    ///
    /// # Errors
    /// For samples that cannot be used, with the file and its column's name.
    pub(super) fn new(joint: &(impl Joint + ?Sized), own_motions: &[Motion], later: LaterLog) -> Result<Later> {
        let LaterLog {
            log,
            file,
            position_loop,
        } = later;
        let checked = log.check_torques().and_then(|()| joint.needed_torque(&log));
        let rates = checked.map_err(|error| file.locate(log.renamed(error)))?;
        let velocities: Vec<&[f64]> = rates.iter().map(|needed| &needed.velocity[..]).collect();
        let motions = joint.simulate(&log, &velocities, position_loop)?;
        let torque = match (&rates[..], &log.axes[..]) {
            ([needed], [axis]) => {
                let own = joint.needed_torque(joint.log())?;
                Some(LaterTorque {
                    fit: in_band(axis, needed),
                    own: in_band(&joint.log().axes[0], &own[0]),
                    cut_off: needed.cut_off,
                    own_cut_off: own[0].cut_off,
                    needed: needed.torque.clone(),
                    unseen: needed.unseen,
                })
            }
            _ => None,
        };
        Ok(Later {
            seen: log.is_part_of(joint.log()),
            torque,
            own_motions: own_motions.iter().map(|motion| motion.fit.percent).collect(),
            motions,
            log,
        })
    }

    /// Whether what was found holds on this log: its torque if that is known, otherwise its motions. A free run sums up small errors of the
    /// torque, so the motion alone refutes nothing where the torque is known.
    pub fn holds(&self) -> bool {
        match &self.torque {
            Some(torque) => torque.holds(),
            None => {
                let mut both = self.motions.iter().zip(&self.own_motions);
                !self.motions.is_empty() && both.all(|(motion, own)| motion.fit.percent > POOR.min(own - 1.0))
            }
        }
    }

    /// Whether it holds, in a few words.
    pub fn outcome(&self) -> String {
        if self.seen {
            return format!("the samples of {} were fitted: {}", self.log.name, self.distance());
        }
        let holds = if self.holds() { "holds" } else { "does not hold" };
        let name = &self.log.name;
        match &self.torque {
            Some(LaterTorque { fit, own, .. }) => format!(
                "it {holds} on {name}: torque fit {:.1} % there, {:.1} % on the first log",
                fit.percent, own.percent
            ),
            None => format!("it {holds} on {name}"),
        }
    }

    /// How far off it is there and on the first log, in a few words, without a verdict.
    pub fn distance(&self) -> String {
        let name = &self.log.name;
        if let Some(LaterTorque { fit, own, .. }) = &self.torque {
            let [there, first] = [fit, own].map(|fit| fit.percent);
            return format!("torque fit {there:.1} % on {name}, {first:.1} % on the first log");
        }
        let fits = self.motions.iter().map(|motion| format!("{:.2} %", motion.fit.percent));
        format!(
            "fit of the simulated motion on {name}: {}",
            fits.collect::<Vec<_>>().join(" and ")
        )
    }

    /// How far off torque and motions are, as text.
    pub fn text(&self, own: &Log, units: &Units) -> String {
        let mut parts = vec![format!("{} samples of {}", self.log.samples(), self.log.name)];
        if let Some(LaterTorque {
            fit,
            own: on_own,
            unseen,
            cut_off,
            ..
        }) = &self.torque
        {
            let Units { effort, torque, .. } = units;
            parts.push(format!(
                "up to {} Hz, the {effort} that the motion needs differs from the recorded {effort} by {} {torque} RMS (fit {:.1} %); on {} by \
                 {} {torque} RMS (fit {:.1} %)",
                number(*cut_off),
                number(fit.rms),
                fit.percent,
                own.name,
                number(on_own.rms),
                on_own.percent
            ));
            if *unseen > UNSEEN {
                parts.push(format!(
                    "{} of its samples move faster than any of {}",
                    percent(*unseen),
                    own.name
                ));
            }
        }
        parts.extend(self.motions.iter().map(|motion| {
            let near = nearness(motion.fit, units.position);
            format!("simulated motion {}: {near}", motion.drive)
        }));
        parts.join("; ")
    }

    /// What the user can do where it does not hold, or where that says nothing.
    pub fn advice(&self) -> Option<String> {
        if self.seen {
            return Some(
                "fitted samples show nothing new; record another log, or cut this one in two by 'flexure prepare --cut'"
                    .to_owned(),
            );
        }
        (!self.holds()).then(|| {
            format!(
                "friction changes with temperature, load and position; identify the joint from {} too and compare the values, or record one \
                 log that covers both motions",
                self.log.name
            )
        })
    }

    /// All of this as JSON.
    pub fn json(&self) -> Value {
        let torque = self.torque.as_ref().map(|torque| {
            json!({
                "rms": torque.fit.rms,
                "fit_percent": torque.fit.percent,
                "cut_off": torque.cut_off,
                "own_rms": torque.own.rms,
                "own_fit_percent": torque.own.percent,
                "unseen": torque.unseen,
            })
        });
        let motions = self
            .motions
            .iter()
            .map(|m| json!({ "drive": m.drive, "rms": m.fit.rms, "fit_percent": m.fit.percent }));
        json!({
            "log": self.log.name,
            "samples": self.log.samples(),
            "sample_time": self.log.sample_time,
            "torque": torque,
            "motions": motions.collect::<Vec<_>>(),
            "holds": self.holds(),
            "identified_from_this_record": self.seen,
        })
    }
}

impl LaterTorque {
    fn holds(&self) -> bool {
        let [share, own] = [self.fit, self.own].map(|fit| 1.0 - fit.percent / 100.0);
        share <= (GROWN * own).max(SMALL)
    }

    /// The fit that the verdict counts, as a sentence.
    pub fn in_band(&self, units: &Units) -> String {
        band_text(self.cut_off, self.fit, units)
    }

    /// The same on the log of the fit.
    pub fn own_in_band(&self, units: &Units) -> String {
        band_text(self.own_cut_off, self.own, units)
    }
}

fn band_text(cut_off: f64, fit: Fit, units: &Units) -> String {
    format!(
        "The verdict counts only frequencies up to {} Hz, as the motion says nothing of the {} above: fit {:.1} %.",
        number(cut_off),
        units.effort,
        fit.percent
    )
}

/// How near the needed torque of an axis is to the recorded one, up to the cut-off of the motion.
fn in_band(axis: &AxisLog, needed: &NeededTorque) -> Fit {
    Fit::new(&needed.in_band(&axis.torque), &needed.in_band(&needed.torque))
}

impl AxisLog {
    /// The motion, without its torque.
    pub(super) fn motion(&self, sample_time: f64) -> JointMotion<'_> {
        JointMotion {
            position: &self.position,
            motor: self.motor.as_deref(),
            velocity: self.velocity.as_deref(),
            load: self.load(),
            sample_time,
        }
    }
}

impl Log {
    /// The motions of its axes, each with the torque that it needs by this function.
    pub(super) fn needed(
        &self,
        needed: impl Fn(usize, &JointMotion) -> flexure::Result<NeededTorque>,
    ) -> flexure::Result<Vec<NeededTorque>> {
        let axes = self.axes.iter().enumerate();
        axes.map(|(i, axis)| needed(i, &axis.motion(self.sample_time)))
            .collect()
    }

    /// Whether all samples of its torques and positions are in another log, one after the other.
    fn is_part_of(&self, other: &Log) -> bool {
        // Positions are seldom the same for long; torques may be.
        let begins = |first: usize, (own, other): (&AxisLog, &AxisLog)| {
            let is_same = |own: &[f64], other: &[f64]| other.get(first..first + own.len()) == Some(own);
            is_same(&own.position, &other.position) && is_same(&own.torque, &other.torque)
        };
        let both = || self.axes.iter().zip(&other.axes);
        let last = other.samples().checked_sub(self.samples());
        self.axes.len() == other.axes.len()
            && last.is_some_and(|last| (0..=last).any(|first| both().all(|axes| begins(first, axes))))
    }

    /// Refuses torques that are not finite, or are not as long as the positions.
    fn check_torques(&self) -> flexure::Result<()> {
        for AxisLog { torque, position, .. } in &self.axes {
            if torque.len() != position.len() {
                return Err(Error::length("torque", torque.len(), position.len()));
            }
            check_values("torque", torque)?;
        }
        Ok(())
    }
}
