//! The samples of one topic, and the record that they become.

use std::path::Path;

use flexure::Record;

use super::Channel;
use super::cdr::{Cdr, Decoded};
use super::joints::Joints;
use super::numbers::Numbers;
use crate::error::{Error, Result};
use crate::record_file::RecordFile;

/// The column of the instants; a message's own number of this name is called `message.t`.
const TIME: &str = "t";

/// The samples of a topic.
pub(super) struct Table {
    /// The channel of the topic's first message.
    channel: Channel,
    columns: Columns,
    logged: Vec<i64>,
    stamps: Vec<Option<i64>>,
    /// Messages without the joint that is wanted.
    passed: usize,
}

enum Columns {
    Joints(Joints),
    Numbers(Numbers),
}

impl Table {
    /// An empty table for a topic whose messages are like those of `channel`.
    ///
    /// # Errors
    /// Why it cannot be read.
    pub(super) fn new(channel: &Channel, joint: Option<&str>) -> Decoded<Self> {
        let definition = channel.definition()?;
        let columns = match (channel.has_joints(&definition), joint) {
            (true, joint) => Columns::Joints(Joints::new(joint)),
            (false, None) => Columns::Numbers(Numbers::new(definition)),
            (false, Some(_)) => {
                let why = format!(
                    "--joint is for sensor_msgs/msg/JointState, but its type is {}",
                    channel.kind
                );
                return Err(why.into());
            }
        };
        Ok(Table {
            channel: channel.clone(),
            columns,
            logged: Vec::new(),
            stamps: Vec::new(),
            passed: 0,
        })
    }

    /// Whether the messages of a channel are like the earlier ones.
    ///
    /// # Errors
    /// What differs; it completes the sentence "the message ...".
    pub(super) fn accepts(&self, channel: &Channel) -> Decoded<()> {
        let own = &self.channel;
        if own.kind != channel.kind {
            return Err(format!("is of type {}, those before of {}", channel.kind, own.kind).into());
        }
        if own.encoding != channel.encoding || own.definition != channel.definition {
            return Err("has a different definition or encoding from the earlier messages of its topic".into());
        }
        Ok(())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.logged.is_empty()
    }

    /// The memory that the next message takes.
    pub(super) fn bytes(&self) -> u64 {
        let columns = match &self.columns {
            Columns::Joints(joints) => joints.width(),
            Columns::Numbers(numbers) => numbers.columns.len(),
        };
        ((columns + 4) * size_of::<f64>()) as u64
    }

    pub(super) fn add(&mut self, message: Cdr, logged: i64) -> Decoded<()> {
        let stamp = match &mut self.columns {
            Columns::Numbers(numbers) => numbers.add(message)?,
            Columns::Joints(joints) => match joints.add(message)? {
                None => {
                    self.passed += 1;
                    return Ok(());
                }
                stamp => stamp,
            },
        };
        self.logged.push(logged);
        self.stamps.push(stamp);
        Ok(())
    }

    /// The record with its notes; with `note_topic`, the chosen topic is noted too.
    pub(super) fn finish(self, path: &Path, topic: &str, note_topic: bool) -> Result<RecordFile> {
        let (mut columns, others) = match self.columns {
            Columns::Joints(joints) => joints.finish(),
            Columns::Numbers(numbers) => numbers.finish(),
        };
        let mut notes = Vec::new();
        if note_topic {
            notes.push(format!("topic {topic} is read"));
        }
        if self.passed > 0 {
            notes.push(format!("{} messages without this joint are skipped", self.passed));
        }
        // A stamp that was never set is zero.
        let stamped = self.stamps.iter().any(|stamp| stamp.is_some_and(|stamp| stamp != 0));
        let mut instants: Vec<i64> = match stamped {
            true => self.stamps.into_iter().map(Option::unwrap_or_default).collect(),
            false => {
                notes.push("t is when the messages were logged, as they have no stamps".to_owned());
                self.logged.clone()
            }
        };
        if !self.logged.is_sorted() {
            notes.push("the messages are put in the order in which they were logged".to_owned());
            let mut order: Vec<usize> = (0..self.logged.len()).collect();
            order.sort_by_key(|&i| self.logged[i]);
            instants = order.iter().map(|&i| instants[i]).collect();
            for (_, samples) in &mut columns {
                *samples = order.iter().map(|&i| samples[i]).collect();
            }
        }
        for (name, _) in columns.iter_mut().filter(|(name, _)| name == TIME) {
            *name = format!("message.{name}");
        }
        let first = instants[0];
        let seconds = |&instant: &i64| (i128::from(instant) - i128::from(first)) as f64 / 1e9;
        let samples = instants.iter().map(seconds).collect();
        let all = [(TIME.to_owned(), samples)].into_iter().chain(columns);
        let record = Record::new(all).map_err(|error| Error::data(path, error))?;
        let mut file = RecordFile::new(record, path);
        file.origins.push((TIME.to_owned(), first));
        file.units[0] = Some("s".to_owned());
        Ok(RecordFile { others, notes, ..file })
    }
}
