//! The framing of MCAP: a sequence of records; some of them lie in chunks, which may be compressed.
//!
//! Source: "MCAP Format Specification", mcap.dev. Records are read in order, from the first to the last, so that a pipe can be read, and
//! the position of every message is known.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use flate2::Crc;

use super::{Bag, Channel, Each, Message, Place};
use crate::error::{Error, Result};
use crate::memory::Budget;

/// What an MCAP file begins and ends with.
pub(crate) const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";

const FOOTER: u8 = 2;
const DATA_END: u8 = 15;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;

/// An MCAP file; every pass through its messages reads it from its beginning.
pub(super) struct Mcap<'a, F> {
    budget: &'a Budget<'a>,
    path: &'a Path,
    open: F,
    schemas: BTreeMap<u16, (String, String, String)>,
    channels: BTreeMap<u16, Channel>,
    /// The channel of the last message.
    last: Option<u16>,
}

impl<'a, R: Read, F: FnMut() -> Result<R>> Mcap<'a, F> {
    pub(super) fn new(budget: &'a Budget<'a>, path: &'a Path, open: F) -> Self {
        Mcap {
            budget,
            path,
            open,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            last: None,
        }
    }

    fn damaged(&self, what: impl std::fmt::Display, place: Place) -> Error {
        let detail = format!("{what} at {place}, {}; record or copy it again", self.after());
        Error::content(self.path, "MCAP", detail)
    }

    /// What was read last.
    fn after(&self) -> String {
        match self.last.and_then(|id| self.channels.get(&id)) {
            Some(channel) => format!("after a message of topic {}", channel.topic),
            None => "before the first message".to_owned(),
        }
    }

    /// The records of a chunk, unpacked.
    fn unpacked<'b>(&self, chunk: &'b [u8], at: u64) -> Result<Cow<'b, [u8]>> {
        let place = Place::Byte(at);
        let fail = |what: &str| self.damaged(format!("the chunk {what}"), place);
        let mut fields = Fields(chunk);
        let mut head = || {
            fields.bytes(16)?;
            Some((fields.u64()?, fields.u32()?, fields.text()?, fields.u64()?))
        };
        let (size, sum, compression, length) = head().ok_or_else(|| fail("has no head"))?;
        let packed = usize::try_from(length).ok().and_then(|length| fields.bytes(length));
        let packed = packed.ok_or_else(|| fail("is shorter than it says"))?;
        let records = match compression.as_str() {
            "" => Cow::Borrowed(packed),
            "lz4" | "zstd" => {
                self.budget.take(size, "a chunk that is unpacked")?;
                self.budget.give_back(size);
                let unpacked = match compression.as_str() {
                    "lz4" => all_of(lz4_flex::frame::FrameDecoder::new(packed), size),
                    _ => zstd::Decoder::new(packed).and_then(|decoder| all_of(decoder, size)),
                };
                Cow::Owned(unpacked.map_err(|_| fail(&format!("cannot be unpacked ({compression})")))?)
            }
            other => {
                return Err(fail(&format!(
                    "is packed by '{other}', which is not read; lz4 and zstd are,"
                )));
            }
        };
        if records.len() as u64 != size {
            return Err(fail("does not unpack to the size that it says"));
        }
        let mut crc = Crc::new();
        crc.update(&records);
        match sum == 0 || crc.sum() == sum {
            true => Ok(records),
            false => Err(fail("is damaged: its checksum differs")),
        }
    }

    /// A record that is no chunk.
    fn record(&mut self, code: u8, content: &[u8], place: Place, each: &mut Each) -> Result<()> {
        let mut fields = Fields(content);
        let read = match code {
            SCHEMA => (|| {
                let schema = (fields.u16()?, (fields.text()?, fields.text()?, fields.text()?));
                self.schemas.insert(schema.0, schema.1);
                Some(())
            })(),
            CHANNEL => self.channel(&mut fields),
            MESSAGE => {
                let Some((id, logged)) = (|| {
                    let id = fields.u16()?;
                    fields.u32()?;
                    let logged = fields.u64()?;
                    fields.u64()?;
                    Some((id, logged))
                })() else {
                    return Err(self.damaged("a message without its head", place));
                };
                let Some(channel) = self.channels.get(&id) else {
                    return Err(self.damaged(format!("a message of the channel {id}, which is not there,"), place));
                };
                self.last = Some(id);
                let logged = logged.cast_signed();
                return each(
                    channel,
                    &Message {
                        logged,
                        data: fields.0,
                        place,
                    },
                );
            }
            _ => Some(()),
        };
        read.ok_or_else(|| self.damaged("a record that is shorter than it says", place))
    }

    fn channel(&mut self, fields: &mut Fields) -> Option<()> {
        let (id, schema) = (fields.u16()?, fields.u16()?);
        let (topic, encoding) = (fields.text()?, fields.text()?);
        let (kind, language, text) = self.schemas.get(&schema).cloned().unwrap_or_default();
        let definition = (!language.is_empty()).then_some((language, text));
        self.channels.insert(
            id,
            Channel {
                topic,
                kind,
                encoding,
                definition,
            },
        );
        Some(())
    }

    /// All records of a chunk.
    fn chunk(&mut self, content: &[u8], at: u64, each: &mut Each) -> Result<()> {
        let records = self.unpacked(content, at)?;
        let mut rest = Fields(&records);
        while !rest.0.is_empty() {
            let place = Place::Chunk {
                chunk: at,
                at: (records.len() - rest.0.len()) as u64,
            };
            let record = (|| {
                let code = rest.bytes(1)?[0];
                let length = usize::try_from(rest.u64()?).ok()?;
                Some((code, rest.bytes(length)?))
            })();
            let (code, content) =
                record.ok_or_else(|| self.damaged("a record that is longer than its chunk", place))?;
            self.record(code, content, place, each)?;
        }
        Ok(())
    }
}

impl<R: Read, F: FnMut() -> Result<R>> Bag for Mcap<'_, F> {
    fn each(&mut self, _: Option<&str>, each: &mut Each) -> Result<()> {
        let mut input = (self.open)()?;
        self.last = None;
        let mut at = 0;
        let mut content = Vec::new();
        let mut sum = Crc::new();
        if !fill(self.path, &mut input, &mut content, 8)? || content != MAGIC {
            return Err(Error::content(
                self.path,
                "MCAP",
                "it does not begin as MCAP does; give it the extension of its true format".to_owned(),
            ));
        }
        at += 8;
        sum.update(&content);
        loop {
            let begin = at;
            let ended = |detail: &str| Error::Truncated {
                path: self.path.to_owned(),
                detail: format!(
                    "it ends {detail} that begins at byte {begin}, {}; `mcap recover` saves what is there",
                    self.after()
                ),
            };
            if !fill(self.path, &mut input, &mut content, 9)? {
                return Err(ended("within or before the record"));
            }
            let code = content[0];
            let head = content.clone();
            let length = Fields(&content[1..]).u64().unwrap_or(u64::MAX);
            self.budget.take(length, &format!("the record at byte {begin}"))?;
            self.budget.give_back(length);
            if !fill(self.path, &mut input, &mut content, length)? {
                return Err(ended("within the record"));
            }
            at += 9 + length;
            if code == DATA_END {
                let stored = Fields(&content).u32().unwrap_or(0);
                if stored != 0 && stored != sum.sum() {
                    return Err(self.damaged("the checksum of all data differs", Place::Byte(begin)));
                }
            }
            sum.update(&head);
            sum.update(&content);
            match code {
                FOOTER => break,
                CHUNK => self.chunk(&content, begin, each)?,
                _ => self.record(code, &content, Place::Byte(begin), each)?,
            }
        }
        match fill(self.path, &mut input, &mut content, 8)? && content == MAGIC {
            true => Ok(()),
            false => Err(self.damaged("its end is missing", Place::Byte(at))),
        }
    }

    fn channels(&mut self) -> Result<Vec<Channel>> {
        Ok(self.channels.values().cloned().collect())
    }
}

/// Reads `count` bytes, and returns whether there were as many. Memory is taken as they come.
fn fill(path: &Path, input: &mut impl Read, bytes: &mut Vec<u8>, count: u64) -> Result<bool> {
    bytes.clear();
    let read = input.take(count).read_to_end(bytes);
    read.map_err(|cause| Error::read(path, cause))?;
    Ok(bytes.len() as u64 == count)
}

/// All bytes of a decoder, but at most one more than `size`.
fn all_of(decoder: impl Read, size: u64) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    decoder.take(size.saturating_add(1)).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The fields of a record that are still to be read.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn bytes(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.bytes(N)?.try_into().ok()
    }

    fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    /// A text, or the bytes of a schema; these are text in the languages that are read.
    fn text(&mut self) -> Option<String> {
        let length = self.u32()? as usize;
        Some(String::from_utf8_lossy(self.bytes(length)?).into_owned())
    }
}
