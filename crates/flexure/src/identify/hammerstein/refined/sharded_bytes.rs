//! Sums over shards as bytes, for files and for other machines: little-endian, with a version and a checksum.
//!
//! ```text
//!   "FLXE" version | parameters count cost | -J'e | the upper triangle of J'J, row by row | checksum
//! ```

use super::loss::Equations;
use super::sharded::ShardSums;
use crate::error::{DataError, Error, Result};
use crate::linear::least_squares::NormalEquations;

/// The first bytes.
const NAME: &[u8; 4] = b"FLXE";
const VERSION: u8 = 1;
/// Numbers before those of the parameters.
const HEAD: usize = 3;
/// More parameters than any system has: sizes that were damaged take no memory.
const MOST_PARAMETERS: usize = 1 << 12;

impl ShardSums {
    /// The sums as bytes, from which [`from_bytes`](Self::from_bytes) makes the same sums on any machine.
    pub fn to_bytes(&self) -> Vec<u8> {
        let NormalEquations { cost, descent, normal } = &self.0.normal;
        let n = descent.len();
        let mut bytes = [NAME.as_slice(), &[VERSION]].concat();
        for size in [n, self.0.count] {
            bytes.extend((size as u64).to_le_bytes());
        }
        let upper = (0..n).flat_map(|i| &normal[i * n + i..(i + 1) * n]);
        for value in std::iter::once(cost).chain(descent).chain(upper) {
            bytes.extend(value.to_le_bytes());
        }
        let checksum = checksum(&bytes);
        bytes.extend(checksum.to_le_bytes());
        bytes
    }

    /// The sums that [`to_bytes`](Self::to_bytes) has written.
    ///
    /// # Errors
    /// [`Error::Data`]: `NotSums` for other bytes, those of another version, or damaged ones.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let rest = bytes
            .strip_prefix(NAME)
            .ok_or_else(|| not_sums("they begin otherwise"))?;
        let [version, rest @ ..] = rest else {
            return Err(not_sums("they are cut off"));
        };
        if *version != VERSION {
            return Err(not_sums("they are of another version"));
        }
        let (numbers, odd) = rest.as_chunks::<8>();
        let [parameters, count, numbers @ .., last] = numbers else {
            return Err(not_sums("they are cut off"));
        };
        let parameters = usize::try_from(u64::from_le_bytes(*parameters)).unwrap_or(usize::MAX);
        let is_whole = parameters <= MOST_PARAMETERS
            && odd.is_empty()
            && numbers.len() + 2 == HEAD + parameters + parameters * (parameters + 1) / 2;
        if !is_whole || u64::from_le_bytes(*last) != checksum(&bytes[..bytes.len() - 8]) {
            return Err(not_sums("they are damaged"));
        }
        let mut values = numbers.iter().map(|number| f64::from_le_bytes(*number));
        let mut next = || values.next().unwrap_or(f64::NAN);
        let mut sums = NormalEquations::zero(parameters);
        sums.cost = next();
        sums.descent.iter_mut().for_each(|value| *value = next());
        for i in 0..parameters {
            for j in i..parameters {
                let value = next();
                (sums.normal[i * parameters + j], sums.normal[j * parameters + i]) = (value, value);
            }
        }
        let count = usize::try_from(u64::from_le_bytes(*count)).map_err(|_| not_sums("they are damaged"))?;
        Ok(ShardSums(Equations { count, normal: sums }))
    }
}

fn not_sums(reason: &'static str) -> Error {
    Error::Data(DataError::NotSums { reason })
}

/// The FNV-1a hash (Fowler, Noll and Vo 1991), which every changed byte changes.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}
