//! The `.db3` files of ROS 2: SQLite with a table of topics and one of messages.
//!
//! Source: rosbag2_storage_sqlite3, `sqlite_storage.cpp`, schema versions 1 to 4.

use std::cell::Cell;
use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, MAIN_DB, OpenFlags};

use super::{Bag, Channel, Each, LANGUAGE, Message, Place};
use crate::error::{Error, Result};
use crate::memory::Budget;

/// What an SQLite file begins with.
pub(crate) const MAGIC: &[u8] = b"SQLite format 3\0";
/// The least limit of a value's length, bytes: the statements themselves need it.
const SHORTEST_LIMIT: i32 = 1 << 20;
/// The bytes of its head.
const HEAD: u64 = 100;

/// A `.db3` file.
pub(super) struct Db3<'a> {
    path: &'a Path,
    database: Connection,
    topics: Vec<(i64, Channel)>,
}

impl<'a> Db3<'a> {
    /// Opens the file at this path, without a change to it or its folder.
    pub(super) fn open(budget: &Budget, path: &'a Path) -> Result<Self> {
        let mut name = path.as_os_str().to_owned();
        name.push("-wal");
        let waiting = std::fs::metadata(&name).is_ok_and(|found| found.len() > 0);
        if waiting {
            return Err(Error::content(
                path,
                "a ROS 2 bag",
                format!(
                    "the file {} next to it has messages that are not in it yet; close the bag, or open and close it with sqlite3",
                    Path::new(&name).display()
                ),
            ));
        }
        let cannot = |cause| Error::read(path, cause);
        let file = File::open(path).map_err(cannot)?;
        let length = file.metadata().map_err(cannot)?.len();
        let mut head = Vec::new();
        file.take(HEAD).read_to_end(&mut head).map_err(cannot)?;
        check_length(path, &head, length)?;
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let absolute = std::path::absolute(path).map_err(|cause| Error::read(path, cause))?;
        let escaped = absolute
            .to_string_lossy()
            .replace('%', "%25")
            .replace('?', "%3f")
            .replace('#', "%23");
        let database = Connection::open_with_flags(format!("file:{escaped}?immutable=1"), flags);
        Db3::new(budget, path, database.map_err(|error| damaged(path, error))?)
    }

    /// Takes a file that comes from a pipe into memory.
    pub(super) fn load(budget: &Budget, path: &'a Path, input: impl Read) -> Result<Self> {
        let bytes = budget.all(input)?;
        let fail = |error: rusqlite::Error| damaged(path, error);
        let mut database = Connection::open_in_memory().map_err(fail)?;
        let length = bytes.len();
        check_length(path, &bytes, length as u64)?;
        let loaded = database.deserialize_read_exact(MAIN_DB, bytes.as_slice(), length, true);
        loaded.map_err(fail)?;
        Db3::new(budget, path, database)
    }

    fn new(budget: &Budget, path: &'a Path, database: Connection) -> Result<Self> {
        let fail = |error: rusqlite::Error| damaged(path, error);
        // A computed column can make any number of bytes, even from an empty file.
        let longest = i32::try_from(budget.left()).unwrap_or(i32::MAX);
        database
            .set_limit(Limit::SQLITE_LIMIT_LENGTH, longest.max(SHORTEST_LIMIT))
            .map_err(fail)?;
        let has = |table: &str| {
            let query = "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name = ?1";
            database
                .query_row(query, [table], |row| row.get::<_, i64>(0))
                .map(|count| count > 0)
        };
        if !(has("topics").map_err(fail)? && has("messages").map_err(fail)?) {
            let detail = "it is an SQLite file without the tables 'topics' and 'messages'".to_owned();
            return Err(Error::content(path, "a ROS 2 bag", detail));
        }
        let mut definitions: HashMap<String, String> = HashMap::new();
        if has("message_definitions").map_err(fail)? {
            let query =
                "SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = 'ros2msg'";
            let mut query = database.prepare(query).map_err(fail)?;
            let rows = query
                .query_map([], |row| Ok((row.get(0)?, row.get(1)?)))
                .map_err(fail)?;
            for row in rows {
                let (kind, text) = row.map_err(fail)?;
                definitions.insert(kind, text);
            }
        }
        let topics = {
            let query = "SELECT id, name, type, serialization_format FROM topics ORDER BY id";
            let mut query = database.prepare(query).map_err(fail)?;
            let rows = query.query_map([], |row| {
                let kind: String = row.get(2)?;
                let channel = Channel {
                    topic: row.get(1)?,
                    definition: (definitions.get(&kind)).map(|text| (LANGUAGE.to_owned(), text.clone())),
                    kind,
                    encoding: row.get(3)?,
                };
                Ok((row.get(0)?, channel))
            });
            rows.and_then(Iterator::collect).map_err(fail)?
        };
        Ok(Db3 { path, database, topics })
    }
}

impl Bag for Db3<'_> {
    fn each(&mut self, wanted: Option<&str>, each: &mut Each) -> Result<()> {
        let is_wanted = |channel: &Channel| wanted.is_none_or(|wanted| wanted == channel.topic);
        for (id, channel) in self.topics.iter().filter(|(_, channel)| is_wanted(channel)) {
            let query = "SELECT id, timestamp, data FROM messages WHERE topic_id = ?1 ORDER BY id";
            let last = Cell::new(None);
            let fail = |error: rusqlite::Error| {
                let place = match last.get() {
                    Some(place) => format!("after the message at {place}"),
                    None => "before its first message".to_owned(),
                };
                damaged(self.path, format!("topic {}, {place}: {error}", channel.topic))
            };
            let mut query = self.database.prepare(query).map_err(fail)?;
            let mut rows = query.query([id]).map_err(fail)?;
            while let Some(row) = rows.next().map_err(fail)? {
                let place = Place::Row(row.get(0).map_err(fail)?);
                last.set(Some(place));
                let logged = row.get(1).map_err(fail)?;
                let ValueRef::Blob(data) = row.get_ref(2).map_err(fail)? else {
                    let detail = format!("topic {}: the message at {place} is no bytes", channel.topic);
                    return Err(Error::content(self.path, "a ROS 2 bag", detail));
                };
                each(channel, &Message { logged, data, place })?;
            }
        }
        Ok(())
    }

    fn channels(&mut self) -> Result<Vec<Channel>> {
        Ok(self.topics.iter().map(|(_, channel)| channel.clone()).collect())
    }
}

fn damaged(path: &Path, what: impl std::fmt::Display) -> Error {
    let detail = format!("{what}; copy it again, or recover it by `sqlite3 FILE .recover`");
    Error::content(path, "a ROS 2 bag", detail)
}

/// Refuses a file that is shorter than its head says ("Database File Format", sqlite.org, section 1.3).
fn check_length(path: &Path, head: &[u8], length: u64) -> Result<()> {
    let word = |at: usize| head.get(at..at + 4)?.try_into().ok().map(u32::from_be_bytes);
    let (Some(sizes), Some(pages), Some(changes), Some(valid)) = (word(16), word(28), word(24), word(92)) else {
        let detail = format!("it ends at byte {length}, within its head");
        return Err(Error::Truncated {
            path: path.to_owned(),
            detail,
        });
    };
    // A page of 65,536 bytes is written as 1.
    let page = match sizes >> 16 {
        1 => 1 << 16,
        size => u64::from(size),
    };
    let declared = page * u64::from(pages);
    // The count of pages is valid only if the program of the last change has written it.
    match changes == valid && length < declared {
        false => Ok(()),
        true => {
            let detail = format!(
                "it ends at byte {length} of {declared}, so that none of its topics can be told; `sqlite3 FILE .recover` saves what is there"
            );
            Err(Error::Truncated {
                path: path.to_owned(),
                detail,
            })
        }
    }
}
