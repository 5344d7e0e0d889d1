//! The sums as bytes, for files and for other machines: little-endian, with a version.
//!
//! ```text
//!   "FLXS" version | most_bins block level count bins | bin, bin, ...
//!   bin: place, the folds that have points as the bits of a number, six values of each of these folds
//! ```

use super::{FOLDS, LEVELS, StreamedRegression, exp2};
use crate::error::{DataError, Error, Result};
use crate::nonlinearity::kernel::bin::Bin;

/// The first bytes: a name and a version.
const MAGIC: &[u8; 5] = b"FLXS\x01";

/// How far rounding may move a mean beyond its bin, in widths of the bin. If the bins are narrow in comparison with x, the last digits of x
/// count instead.
const ROUNDING: f64 = 1e-3;

impl StreamedRegression {
    /// The sums as bytes, from which [`from_bytes`](Self::from_bytes) makes the same sums on any machine.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        let mut put = |value: [u8; 8]| bytes.extend(value);
        for value in [
            self.most_bins as u64,
            self.block,
            self.level as u64,
            self.count,
            self.bins.len() as u64,
        ] {
            put(value.to_le_bytes());
        }
        for (at, folds) in self.in_order() {
            put(at.to_le_bytes());
            let used = (0..FOLDS).filter(|&fold| folds[fold].count > 0.0);
            put(used.clone().fold(0_u64, |bits, fold| bits | 1 << fold).to_le_bytes());
            for fold in used {
                let Bin {
                    count,
                    x,
                    y,
                    xx,
                    xy,
                    yy,
                } = folds[fold];
                [count, x, y, xx, xy, yy].iter().for_each(|v| put(v.to_le_bytes()));
            }
        }
        bytes
    }

    /// The sums that [`to_bytes`](Self::to_bytes) has written.
    ///
    /// # Errors
    /// [`Error::Data`]: `NotSums` for other bytes, or damaged ones.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let mut numbers = Numbers(
            bytes
                .strip_prefix(MAGIC)
                .ok_or_else(|| damaged("they begin otherwise"))?,
        );
        let [most_bins, block, level, count, bins] = [(); 5].map(|()| numbers.next());
        let most_bins = usize::try_from(most_bins?).map_err(|_| damaged("their number of bins is too large"))?;
        let mut sums =
            StreamedRegression::new(most_bins, block?).map_err(|_| damaged("a parameter is out of range"))?;
        sums.level = i32::try_from(level? as i64)
            .ok()
            .filter(|l| LEVELS.contains(l))
            .ok_or_else(|| damaged("their bins have no width"))?;
        sums.count = count?;
        let level = sums.level;
        let (bins, mut last, mut total) = (bins?, None, 0.0);
        if bins > most_bins as u64 {
            return Err(damaged("they have more bins than they say"));
        }
        for _ in 0..bins {
            let (at, used) = (numbers.next()? as i64, numbers.next()?);
            if last.is_some_and(|last| at <= last) || used == 0 || used >> FOLDS != 0 {
                return Err(damaged("a bin is out of order"));
            }
            last = Some(at);
            let folds = sums.folds_at(at);
            for fold in (0..FOLDS).filter(|fold| used >> fold & 1 == 1) {
                folds[fold] = numbers.bin(at, level)?;
                total += folds[fold].count;
            }
        }
        if total != sums.count as f64 || !numbers.0.is_empty() {
            return Err(damaged("they do not end where they should"));
        }
        Ok(sums)
    }
}

fn damaged(reason: &'static str) -> Error {
    Error::Data(DataError::NotSums { reason })
}

/// Bytes that are read as numbers one after the other.
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    fn next(&mut self) -> Result<u64> {
        let (number, rest) = self.0.split_first_chunk().ok_or_else(|| damaged("they are cut off"))?;
        self.0 = rest;
        Ok(u64::from_le_bytes(*number))
    }

    /// Reads a bin: it must have points and finite sums, and its mean of x must lie in it.
    fn bin(&mut self, at: i64, level: i32) -> Result<Bin> {
        let mut values = [0.0; 6];
        for value in &mut values {
            *value = f64::from_bits(self.next()?);
        }
        let [count, x, y, xx, xy, yy] = values;
        let inside = x * exp2(-level) - at as f64;
        let rounding = ROUNDING.max(2.0 * f64::EPSILON * (at as f64).abs());
        let lies_in_it = (-rounding..=1.0 + rounding).contains(&inside);
        if !(values.iter().all(|v| v.is_finite()) && lies_in_it && count >= 1.0 && xx >= 0.0 && yy >= 0.0) {
            return Err(damaged("a bin's sums are impossible"));
        }
        Ok(Bin {
            count,
            x,
            y,
            xx,
            xy,
            yy,
        })
    }
}
