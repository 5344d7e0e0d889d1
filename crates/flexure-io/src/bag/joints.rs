//! `sensor_msgs/JointState`: positions, velocities and efforts of joints by name.

use super::cdr::{Cdr, Decoded};
use crate::record_file::Other;

/// The values of each joint in a message, in this order.
const KINDS: [&str; 3] = ["position", "velocity", "effort"];

/// The most joints of a message: convention.
const MOST_JOINTS: usize = 1000;

/// The number of names in a message.
fn count(message: &mut Cdr) -> Decoded<usize> {
    match message.length()? {
        count if count > MOST_JOINTS => Err(format!("names more than {MOST_JOINTS} joints").into()),
        count => Ok(count),
    }
}

/// Notes the joints of a message that are not known yet.
pub(super) fn note_names(mut message: Cdr, known: &mut Vec<String>) -> Decoded<()> {
    message.instant()?;
    message.text()?;
    for _ in 0..count(&mut message)? {
        let name = message.text()?;
        if known.len() < MOST_JOINTS && !known.iter().any(|own| own.as_bytes() == name) {
            known.push(String::from_utf8_lossy(name).into_owned());
        }
    }
    Ok(())
}

/// The columns of a topic's joints, or of one of them.
#[derive(Default)]
pub(super) struct Joints {
    wanted: Option<String>,
    joints: Vec<Joint>,
    /// The bytes of the names in the last message, and their joints: messages mostly repeat them.
    last: Vec<u8>,
    phase: usize,
    order: Vec<Option<usize>>,
    samples: usize,
}

/// A joint.
struct Joint {
    name: String,
    columns: [Vec<f64>; 3],
    is_there: [bool; 3],
}

impl Joints {
    /// The columns of the joint that is wanted, or of all.
    pub(super) fn new(wanted: Option<&str>) -> Self {
        Joints {
            wanted: wanted.map(str::to_owned),
            ..Joints::default()
        }
    }

    /// The names of the joints.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.joints.iter().map(|joint| joint.name.as_str())
    }

    /// The columns of a message.
    pub(super) fn width(&self) -> usize {
        KINDS.len() * self.joints.len()
    }

    /// Adds a message, and returns its stamp in ns; `None` for one without the joint that is wanted.
    pub(super) fn add(&mut self, mut message: Cdr) -> Decoded<Option<i64>> {
        let stamp = message.instant()?;
        message.text()?;
        self.read_names(&mut message)?;
        if self.wanted.is_some() && self.order.iter().all(Option::is_none) {
            return Ok(None);
        }
        if self.order.iter().flatten().count() != self.joints.len() {
            return Err(self.changed());
        }
        for (k, kind) in KINDS.into_iter().enumerate() {
            let count = message.length()?;
            if count != 0 && count != self.order.len() {
                return Err(format!("has {count} of {kind} for {} joints", self.order.len()).into());
            }
            for (value, joint) in message.f64s(count)?.zip(&self.order) {
                if let Some(joint) = *joint {
                    self.joints[joint].columns[k].push(value);
                }
            }
            for joint in &mut self.joints {
                match count {
                    0 => joint.columns[k].push(f64::NAN),
                    _ => joint.is_there[k] = true,
                }
            }
        }
        message.end()?;
        self.samples += 1;
        Ok(Some(stamp))
    }

    /// Reads the names of a message. All must be known joints, unless it is the first message.
    fn read_names(&mut self, message: &mut Cdr) -> Decoded<()> {
        let before = message.clone();
        // The gap before a text depends on its position.
        let phase = message.phase();
        let mut same = message.clone();
        if self.phase == phase
            && same
                .take(self.last.len())
                .is_ok_and(|names| !names.is_empty() && names == self.last)
        {
            *message = same;
            return Ok(());
        }
        self.order.clear();
        for _ in 0..count(message)? {
            let name = std::str::from_utf8(message.text()?).map_err(|_| "has a name that is not text")?;
            let found = self.joints.iter().position(|joint| joint.name == name);
            let wanted = self.wanted.as_deref().is_none_or(|wanted| wanted == name);
            let index = match found {
                None if wanted && self.samples == 0 => {
                    self.joints.push(Joint {
                        name: name.to_owned(),
                        columns: Default::default(),
                        is_there: [false; 3],
                    });
                    Some(self.joints.len() - 1)
                }
                None if wanted => return Err(self.changed()),
                index => index,
            };
            if index.is_some() && self.order.contains(&index) {
                return Err(format!("names joint '{name}' twice").into());
            }
            self.order.push(index);
        }
        if self.order.is_empty() {
            return Err(
                "names no joint, so it is unclear which joints its values belong to; record it with names".into(),
            );
        }
        self.last = message.since(&before).to_vec();
        self.phase = phase;
        Ok(())
    }

    fn changed(&self) -> super::cdr::Fault {
        let names: Vec<String> = self.names().map(str::to_owned).collect();
        let names = flexure::text::list(&names);
        format!("has other joints than those before ({names}); choose a joint by --joint").into()
    }

    /// The columns, and what no message has.
    pub(super) fn finish(self) -> (Vec<(String, Vec<f64>)>, Vec<Other>) {
        let (mut columns, mut others) = (Vec::new(), Vec::new());
        for joint in self.joints {
            for (k, samples) in joint.columns.into_iter().enumerate() {
                let name = match self.wanted {
                    Some(_) => KINDS[k].to_owned(),
                    None => format!("{}.{}", joint.name, KINDS[k]),
                };
                match joint.is_there[k] {
                    true => columns.push((name, samples)),
                    false => others.push(Other::new(name, "empty in all messages".to_owned())),
                }
            }
        }
        (columns, others)
    }
}
