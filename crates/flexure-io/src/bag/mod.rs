//! Records from the bags of ROS 2: MCAP and SQLite (`.db3`).
//!
//! A record is one topic: of `sensor_msgs/JointState`, whose joints have names, or of a message of plain numbers. A message that cannot be
//! read is an error with its topic and its place, never a missing sample.

mod cdr;
mod db3;
mod definition;
mod joints;
mod mcap;
mod numbers;
mod table;

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::memory::Budget;
use crate::options::ReadOptions;
use crate::record_file::RecordFile;
use crate::topic::Topic;
use cdr::{Cdr, Decoded};
use definition::{Definition, short};
use table::Table;

pub(crate) use db3::MAGIC as DB3;
pub(crate) use mcap::MAGIC as MCAP;

/// The first bytes of a text or message that Zstandard has packed.
pub(crate) const ZSTD: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];
/// The message whose joints have names.
const JOINT_STATE: &str = "sensor_msgs/JointState";

/// Where a message stands.
#[derive(Debug, Clone, Copy)]
enum Place {
    Byte(u64),
    Chunk { chunk: u64, at: u64 },
    Row(i64),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::Byte(byte) => write!(f, "byte {byte}"),
            Place::Chunk { chunk, at } => write!(f, "byte {at} of the chunk at byte {chunk}"),
            Place::Row(row) => write!(f, "row {row} of the messages"),
        }
    }
}

/// What a bag says about a topic's messages.
#[derive(Debug, Clone)]
struct Channel {
    topic: String,
    kind: String,
    encoding: String,
    /// The language of the definition and its text, where there is one.
    definition: Option<(String, String)>,
}

/// The language of definitions that is read.
const LANGUAGE: &str = "ros2msg";

impl Channel {
    /// The definition of its messages.
    ///
    /// # Errors
    /// Why they cannot be read.
    fn definition(&self) -> Decoded<Definition> {
        if self.encoding != "cdr" {
            return Err(format!("its messages are encoded as '{}', not as cdr", self.encoding).into());
        }
        let text = self.definition.as_ref().filter(|(language, _)| language == LANGUAGE);
        let definition = Definition::new(&self.kind, text.map(|(_, text)| text.as_str()));
        let definition = definition.map_err(|problem| match &self.definition {
            Some((language, _)) if language != LANGUAGE => {
                format!("its definition is in the language '{language}', but only {LANGUAGE} can be read")
            }
            _ => format!("its definition {problem}"),
        })?;
        match definition.has_numbers(&definition.fields) {
            true => Ok(definition),
            false => Err("its messages have no numbers".into()),
        }
    }

    fn has_joints(&self, definition: &Definition) -> bool {
        short(&self.kind) == JOINT_STATE && definition.is_known(JOINT_STATE)
    }
}

/// A message of a topic.
struct Message<'a> {
    /// When it was logged, in ns.
    logged: i64,
    data: &'a [u8],
    place: Place,
}

impl Message<'_> {
    /// Its content, unpacked where messages are packed one by one.
    fn content(&self, budget: &Budget) -> Result<Decoded<Cow<'_, [u8]>>> {
        if !self.data.starts_with(ZSTD) {
            return Ok(Ok(Cow::Borrowed(self.data)));
        }
        let Ok(decoder) = zstd::Decoder::new(self.data) else {
            return Ok(Err("cannot be unpacked (zstd)".into()));
        };
        let mut content = Vec::new();
        let unpacked = decoder.take(budget.left().saturating_add(1)).read_to_end(&mut content);
        budget.take(content.len() as u64, "a message that is unpacked")?;
        budget.give_back(content.len() as u64);
        Ok(match unpacked {
            Ok(_) => Ok(Cow::Owned(content)),
            Err(_) => Err("cannot be unpacked (zstd)".into()),
        })
    }
}

/// What is done with each message.
type Each<'e> = dyn FnMut(&Channel, &Message) -> Result<()> + 'e;

/// A file of messages.
trait Bag {
    /// Goes through the messages; those of one topic come in their order in the file. With a `wanted` topic, messages of others may be left
    /// out.
    fn each(&mut self, wanted: Option<&str>, each: &mut Each) -> Result<()>;

    /// The topics of the file, after a pass through it.
    fn channels(&mut self) -> Result<Vec<Channel>>;
}

/// The only file of a bag's folder; `None` if `path` is no folder with files of bags.
///
/// # Errors
/// For a folder with several.
pub(crate) fn only_file(path: &Path) -> Result<Option<PathBuf>> {
    let Ok(entries) = std::fs::read_dir(path) else {
        return Ok(None);
    };
    let is_bag = |path: &PathBuf| {
        let packed = path.extension().is_some_and(|extension| extension == "zstd");
        let inner = if packed { path.with_extension("") } else { path.clone() };
        inner
            .extension()
            .is_some_and(|extension| extension == "mcap" || extension == "db3")
    };
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_bag).collect();
    files.sort();
    if files.len() > 1 {
        let names = files
            .iter()
            .filter_map(|file| file.file_name())
            .map(|name| name.to_string_lossy().into_owned());
        let names = flexure::text::list(&names.collect::<Vec<_>>());
        let detail = format!("the folder has several files of bags ({names}); give one of them");
        return Err(Error::content(path, "a ROS 2 bag", detail));
    }
    Ok(files.pop())
}

/// Reads an MCAP file, which is opened once or twice.
pub(crate) fn read_mcap<R: Read>(
    budget: &Budget,
    path: &Path,
    options: &ReadOptions,
    open: impl FnMut() -> Result<R>,
) -> Result<RecordFile> {
    read(budget, path, options, &mut mcap::Mcap::new(budget, path, open))
}

/// Reads a `.db3` file; from memory where it comes as a stream.
pub(crate) fn read_db3(
    budget: &Budget,
    path: &Path,
    options: &ReadOptions,
    stream: Option<impl Read>,
) -> Result<RecordFile> {
    let mut bag = match stream {
        None => db3::Db3::open(budget, path)?,
        Some(stream) => db3::Db3::load(budget, path, stream)?,
    };
    read(budget, path, options, &mut bag)
}

fn read(budget: &Budget, path: &Path, options: &ReadOptions, bag: &mut dyn Bag) -> Result<RecordFile> {
    let joint = options.joint.as_deref();
    let topic = match &options.topic {
        Some(topic) => topic.clone(),
        None => the_only_topic(path, joint, survey(budget, path, bag)?)?,
    };
    let at = |place: Place, fault: cdr::Fault| {
        let detail = format!("topic {topic}: the message at {place} {fault}");
        Error::content(path, "a ROS 2 bag", detail)
    };
    let mut table: Option<Table> = None;
    bag.each(Some(&topic), &mut |channel, message| {
        if channel.topic != topic {
            return Ok(());
        }
        let table = match &mut table {
            Some(table) => {
                table.accepts(channel).map_err(|fault| at(message.place, fault))?;
                table
            }
            none => {
                let new = Table::new(channel, joint);
                none.insert(new.map_err(|why| Error::content(path, "a ROS 2 bag", format!("topic {topic}: {why}")))?)
            }
        };
        budget.take(table.bytes(), "the topic")?;
        let content = message.content(budget)?;
        let added = content.and_then(|content| table.add(Cdr::new(&content)?, message.logged));
        added.map_err(|fault| at(message.place, fault))
    })?;
    match table.filter(|table| !table.is_empty()) {
        Some(table) => table.finish(path, &topic, options.topic.is_none()),
        None => Err(nothing_of(path, &topic, joint, survey(budget, path, bag)?)),
    }
}

/// The name of the only topic that has messages of numbers and, if a joint is given, this joint.
fn the_only_topic(path: &Path, joint: Option<&str>, topics: Vec<Topic>) -> Result<String> {
    let fits = |topic: &&Topic| {
        let has = joint.is_none_or(|joint| topic.joints.iter().any(|own| own == joint));
        topic.problem.is_none() && topic.messages > 0 && has
    };
    let mut fitting = topics.iter().filter(fits).map(|topic| topic.name.clone());
    let (choose, problem) = match (fitting.next(), fitting.next(), joint) {
        (Some(topic), None, _) => return Ok(topic),
        (Some(_), Some(_), _) => (true, "choose a topic by --topic".to_owned()),
        (None, _, Some(joint)) => (false, format!("no topic has a joint '{joint}'")),
        (None, _, None) => (false, "no topic has messages of numbers".to_owned()),
    };
    Err(refused(path, choose, problem, topics))
}

/// Why no messages of a topic were read.
fn nothing_of(path: &Path, topic: &str, joint: Option<&str>, topics: Vec<Topic>) -> Error {
    let there = topics.iter().find(|own| own.name == topic);
    let problem = match (there, joint) {
        (None, _) => format!("there is no topic '{topic}'"),
        (Some(own), Some(joint)) if own.messages > 0 => format!("topic {topic} has no joint '{joint}'"),
        _ => format!("topic {topic} has no messages"),
    };
    refused(path, false, problem, topics)
}

fn refused(path: &Path, choose: bool, problem: String, topics: Vec<Topic>) -> Error {
    Error::Topics {
        path: path.to_owned(),
        problem,
        choose,
        topics,
    }
}

/// What is in a bag, in the order of the names.
fn survey(budget: &Budget, path: &Path, bag: &mut dyn Bag) -> Result<Vec<Topic>> {
    let mut found: HashMap<String, Topic> = HashMap::new();
    let mut has_joints: HashMap<String, bool> = HashMap::new();
    let begun = |channel: &Channel| Topic {
        name: channel.topic.clone(),
        kind: channel.kind.clone(),
        messages: 0,
        joints: Vec::new(),
        problem: channel.definition().err().map(Cow::into_owned),
    };
    bag.each(None, &mut |channel, message| {
        if !found.contains_key(&channel.topic) {
            let joints = channel
                .definition()
                .is_ok_and(|definition| channel.has_joints(&definition));
            has_joints.insert(channel.topic.clone(), joints);
            found.insert(channel.topic.clone(), begun(channel));
        }
        let Some(topic) = found.get_mut(&channel.topic) else {
            return Ok(());
        };
        topic.messages += 1;
        if has_joints[&channel.topic] {
            let content = message.content(budget)?;
            let noted = content.and_then(|content| joints::note_names(Cdr::new(&content)?, &mut topic.joints));
            noted.map_err(|fault| {
                let detail = format!("topic {}: the message at {} {fault}", channel.topic, message.place);
                Error::content(path, "a ROS 2 bag", detail)
            })?;
        }
        Ok(())
    })?;
    for channel in bag.channels()? {
        found.entry(channel.topic.clone()).or_insert_with(|| begun(&channel));
    }
    let mut topics: Vec<Topic> = found.into_values().collect();
    topics.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(topics)
}
