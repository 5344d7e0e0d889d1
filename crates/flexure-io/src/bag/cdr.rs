//! The Common Data Representation of ROS 2's messages.
//!
//! Source: OMG, "Extensible and Dynamic Topic Types for DDS" 1.3, section 7.4 (XCDR version 1): a header of four bytes gives the byte
//! order. Each later value is aligned to its own size, counted from the end of the header.

use std::borrow::Cow;

/// What is wrong within a message, completing the sentence "the message ...".
pub(super) type Fault = Cow<'static, str>;
pub(super) type Decoded<T> = Result<T, Fault>;

const ENDS: Fault = Cow::Borrowed("ends too early");

/// The bytes of a message after its header, and the position of the next value.
#[derive(Clone)]
pub(super) struct Cdr<'a> {
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
}

impl<'a> Cdr<'a> {
    /// Begins to read a message.
    pub(super) fn new(message: &'a [u8]) -> Decoded<Self> {
        let Some((&[kind, order, ..], bytes)) = message.split_first_chunk::<4>() else {
            return Err("is shorter than its header of 4 bytes".into());
        };
        match (kind, order) {
            (0, 0 | 1) => Ok(Cdr {
                bytes,
                at: 0,
                big_endian: order == 0,
            }),
            _ => Err(format!("is encoded as 0x{kind:02x}{order:02x}; plain CDR, 0x0000 and 0x0001, is read").into()),
        }
    }

    /// Checks that the message ends behind its last field. Up to three bytes of padding may follow.
    pub(super) fn end(&self) -> Decoded<()> {
        match self.rest() {
            0..4 => Ok(()),
            surplus => Err(format!("has {surplus} bytes more than its definition").into()),
        }
    }

    /// What is not read yet.
    pub(super) fn rest(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The bytes from a place that was read before.
    pub(super) fn since(&self, from: &Cdr<'a>) -> &'a [u8] {
        &self.bytes[from.at..self.at]
    }

    /// The position modulo the alignment of 8 bytes.
    pub(super) fn phase(&self) -> usize {
        self.at % 8
    }

    /// Passes over the gap before something of this size, which is a power of two.
    fn align(&mut self, size: usize) {
        self.at = self.at.next_multiple_of(size);
    }

    /// Passes over bytes.
    #[inline]
    pub(super) fn take(&mut self, count: usize) -> Decoded<&'a [u8]> {
        let end = self.at.checked_add(count).ok_or(ENDS)?;
        let taken = self.bytes.get(self.at..end).ok_or(ENDS)?;
        self.at = end;
        Ok(taken)
    }

    /// The bytes of a number, the least first.
    #[inline]
    fn little<const N: usize>(&mut self) -> Decoded<[u8; N]> {
        self.align(N);
        let bytes = self.bytes.get(self.at..).and_then(<[u8]>::first_chunk::<N>);
        let mut bytes = *bytes.ok_or(ENDS)?;
        self.at += N;
        if self.big_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    pub(super) fn u8(&mut self) -> Decoded<u8> {
        Ok(self.take(1)?[0])
    }

    pub(super) fn u16(&mut self) -> Decoded<u16> {
        self.little().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Decoded<u32> {
        self.little().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Decoded<u64> {
        self.little().map(u64::from_le_bytes)
    }

    pub(super) fn f32(&mut self) -> Decoded<f32> {
        self.little().map(f32::from_le_bytes)
    }

    #[inline]
    pub(super) fn f64(&mut self) -> Decoded<f64> {
        self.little().map(f64::from_le_bytes)
    }

    /// `count` numbers.
    pub(super) fn f64s(&mut self, count: usize) -> Decoded<impl Iterator<Item = f64>> {
        if count > 0 {
            self.align(size_of::<f64>());
        }
        let (values, _) = self.take(count.saturating_mul(size_of::<f64>()))?.as_chunks();
        let read = if self.big_endian {
            f64::from_be_bytes
        } else {
            f64::from_le_bytes
        };
        Ok(values.iter().map(move |bytes| read(*bytes)))
    }

    /// The length of a sequence, each of whose elements takes at least one byte.
    pub(super) fn length(&mut self) -> Decoded<usize> {
        let length = self.u32()? as usize;
        match length <= self.rest() {
            true => Ok(length),
            false => Err(ENDS),
        }
    }

    /// The bytes of a text, without the zero behind it.
    pub(super) fn text(&mut self) -> Decoded<&'a [u8]> {
        let length = self.length()?;
        let bytes = self.take(length)?;
        match bytes.split_last() {
            None => Ok(&[]),
            Some((0, text)) => Ok(text),
            Some(_) => Err("has a text without the zero at its end".into()),
        }
    }

    /// An instant of two integers, in ns.
    pub(super) fn instant(&mut self) -> Decoded<i64> {
        let seconds = i64::from(self.u32()?.cast_signed());
        Ok(seconds * 1_000_000_000 + i64::from(self.u32()?))
    }
}
