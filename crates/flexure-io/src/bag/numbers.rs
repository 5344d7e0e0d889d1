//! Messages of plain numbers: a column for each.

use std::fmt::Write as _;

use super::cdr::{Cdr, Decoded};
use super::definition::{Basic, Count, Definition, Field, HEADER, Kind};
use crate::parquet_file::exact;
use crate::record_file::Other;

/// The most columns of a topic: one with more is a map or an image. Convention.
const MOST_COLUMNS: usize = 1000;

/// The columns of a topic.
pub(super) struct Numbers {
    definition: Definition,
    /// The first field with a header, which has the stamp.
    header: Option<String>,
    pub(super) columns: Vec<(String, Vec<f64>)>,
    /// Columns with an integer that f64 cannot hold.
    inexact: Vec<usize>,
    /// The lengths of the sequences, which must not change.
    lengths: Vec<usize>,
    others: Vec<Other>,
}

impl Numbers {
    pub(super) fn new(definition: Definition) -> Self {
        let is_header = |field: &&Field| field.kind == Kind::Message(HEADER.to_owned()) && field.count == Count::One;
        let header = definition.fields.iter().find(is_header);
        Numbers {
            header: header.map(|field| field.name.clone()),
            definition,
            columns: Vec::new(),
            inexact: Vec::new(),
            lengths: Vec::new(),
            others: Vec::new(),
        }
    }

    /// Adds a message, and returns its stamp in ns, where it has one.
    pub(super) fn add(&mut self, message: Cdr) -> Decoded<Option<i64>> {
        let is_first = self.columns.is_empty();
        let mut walk = Walk {
            definition: &self.definition,
            header: self.header.as_deref(),
            cdr: message,
            stamp: None,
            values: Vec::with_capacity(self.columns.len()),
            lengths: Vec::with_capacity(self.lengths.len()),
            inexact: &mut self.inexact,
            names: is_first.then(|| (String::new(), Vec::new(), &mut self.others)),
        };
        walk.message(&walk.definition.fields, true)?;
        walk.cdr.end()?;
        let (stamp, values, lengths) = (walk.stamp, walk.values, walk.lengths);
        if let Some((_, names, _)) = walk.names {
            if names.is_empty() {
                return Err("has no numbers".into());
            }
            self.columns = names.into_iter().map(|name| (name, Vec::new())).collect();
            self.lengths = lengths;
        } else if lengths != self.lengths {
            let was = self.columns.len();
            return Err(format!(
                "has sequences of other lengths ({} numbers) than those before ({was}), but a record has equally many columns throughout",
                values.len()
            )
            .into());
        }
        for ((_, column), value) in self.columns.iter_mut().zip(values) {
            column.push(value);
        }
        Ok(stamp)
    }

    /// The columns, and the fields that are no columns.
    pub(super) fn finish(mut self) -> (Vec<(String, Vec<f64>)>, Vec<Other>) {
        self.inexact.sort_unstable();
        self.inexact.dedup();
        for i in self.inexact.into_iter().rev() {
            let (name, _) = self.columns.remove(i);
            let what = "a column of integers beyond 2^53, which cannot be represented exactly";
            self.others.push(Other::new(name, what.to_owned()));
        }
        (self.columns, self.others)
    }
}

/// A walk through one message.
struct Walk<'a, 'm> {
    definition: &'a Definition,
    header: Option<&'a str>,
    cdr: Cdr<'m>,
    stamp: Option<i64>,
    values: Vec<f64>,
    lengths: Vec<usize>,
    inexact: &'a mut Vec<usize>,
    /// For the first message: the path to here, the columns' names, and the fields that are no columns.
    names: Option<(String, Vec<String>, &'a mut Vec<Other>)>,
}

impl<'a> Walk<'a, '_> {
    fn message(&mut self, fields: &'a [Field], is_outermost: bool) -> Decoded<()> {
        if fields.is_empty() {
            // A message without fields has one byte.
            return self.cdr.take(1).map(drop);
        }
        for field in fields {
            if is_outermost && self.header == Some(field.name.as_str()) {
                self.stamp = Some(self.cdr.instant()?);
                self.cdr.text()?;
                continue;
            }
            let length = self.path(|path| {
                let length = path.len();
                let dot = if path.is_empty() { "" } else { "." };
                let _ = write!(path, "{dot}{}", field.name);
                length
            });
            self.field(field)?;
            self.path(|path| path.truncate(length.unwrap_or(0)));
        }
        Ok(())
    }

    /// Changes the path of the first message.
    fn path<T>(&mut self, change: impl FnOnce(&mut String) -> T) -> Option<T> {
        self.names.as_mut().map(|(path, ..)| change(path))
    }

    fn field(&mut self, field: &'a Field) -> Decoded<()> {
        let count = match field.count {
            Count::One => return self.once(&field.kind),
            Count::Fixed(count) => count,
            Count::Any => self.cdr.length()?,
        };
        // Bytes, such as those of images; their lengths may change.
        if field.kind == Kind::Basic(Basic::U8) {
            self.cdr.take(count)?;
            self.other("bytes");
            return Ok(());
        }
        if field.kind == Kind::Basic(Basic::Text) {
            for _ in 0..count {
                self.cdr.text()?;
            }
            self.other("text");
            return Ok(());
        }
        if field.count == Count::Any {
            self.lengths.push(count);
        }
        for i in 0..count {
            let length = self.path(|path| {
                let length = path.len();
                let _ = write!(path, "[{i}]");
                length
            });
            self.once(&field.kind)?;
            self.path(|path| path.truncate(length.unwrap_or(0)));
        }
        Ok(())
    }

    fn once(&mut self, kind: &'a Kind) -> Decoded<()> {
        let basic = match kind {
            Kind::Message(name) => return self.message(self.definition.part(name), false),
            Kind::Basic(basic) => basic,
        };
        let cdr = &mut self.cdr;
        let value = match basic {
            Basic::Text => {
                cdr.text()?;
                self.other("text");
                return Ok(());
            }
            Basic::Bool | Basic::U8 => f64::from(cdr.u8()?),
            Basic::I8 => f64::from(cdr.u8()?.cast_signed()),
            Basic::I16 => f64::from(cdr.u16()?.cast_signed()),
            Basic::U16 => f64::from(cdr.u16()?),
            Basic::I32 => f64::from(cdr.u32()?.cast_signed()),
            Basic::U32 => f64::from(cdr.u32()?),
            Basic::F32 => f64::from(cdr.f32()?),
            Basic::F64 => cdr.f64()?,
            Basic::I64 => self.integer(|cdr| Ok(i128::from(cdr.u64()?.cast_signed())))?,
            Basic::U64 => self.integer(|cdr| Ok(i128::from(cdr.u64()?)))?,
        };
        if self.values.len() == MOST_COLUMNS {
            return Err(format!("has more than {MOST_COLUMNS} numbers").into());
        }
        if let Some((path, names, _)) = &mut self.names {
            names.push(path.clone());
        }
        self.values.push(value);
        Ok(())
    }

    /// An integer that f64 may not hold.
    fn integer(&mut self, read: impl FnOnce(&mut Cdr) -> Decoded<i128>) -> Decoded<f64> {
        Ok(exact(read(&mut self.cdr)?).unwrap_or_else(|| {
            self.inexact.push(self.values.len());
            f64::NAN
        }))
    }

    /// Notes a field that is no number.
    fn other(&mut self, what: &str) {
        if let Some((path, _, others)) = &mut self.names {
            others.push(Other::new(path.clone(), what.to_owned()));
        }
    }
}
