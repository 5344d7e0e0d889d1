//! Checkpoints: numbers of eight bytes, little-endian, one after the other.

use crate::error::{Error, Result};

/// The part of a checkpoint that is still to be read.
pub(super) struct Checkpoint<'a> {
    rest: &'a [u8],
    /// The length of the whole checkpoint.
    length: usize,
}

impl<'a> Checkpoint<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Checkpoint {
            rest: bytes,
            length: bytes.len(),
        }
    }

    /// The next eight bytes.
    pub fn word(&mut self) -> Result<[u8; 8]> {
        let (word, rest) = self.rest.split_first_chunk().ok_or_else(|| self.wrong())?;
        self.rest = rest;
        Ok(*word)
    }

    pub fn whole(&mut self) -> Result<u64> {
        self.word().map(u64::from_le_bytes)
    }

    /// A whole number: a count or an index.
    pub fn count(&mut self) -> Result<usize> {
        usize::try_from(self.whole()?).map_err(|_| self.wrong())
    }

    pub fn number(&mut self) -> Result<f64> {
        self.word().map(f64::from_le_bytes)
    }

    pub fn finite(&mut self) -> Result<f64> {
        let number = self.number()?;
        self.check(number.is_finite()).map(|()| number)
    }

    /// All that is left.
    pub fn rest(&mut self) -> &'a [u8] {
        std::mem::take(&mut self.rest)
    }

    /// Refuses the checkpoint if something is left.
    pub fn end(&self) -> Result<()> {
        self.check(self.rest.is_empty())
    }

    /// Refuses the checkpoint unless a part of it is right.
    pub fn check(&self, is_right: bool) -> Result<()> {
        if is_right { Ok(()) } else { Err(self.wrong()) }
    }

    fn wrong(&self) -> Error {
        Error::parameter(
            "the number of bytes",
            self.length as f64,
            "those of a checkpoint, whole and unchanged",
        )
    }
}
