//! Kernel regression of one column from records of any length: one pass, bounded memory, parts that are merged.
//!
//! The points are gathered in bins [k 2^l, (k + 1) 2^l): a bin keeps its count, its means and its second moments ([`Bin`]). The level l is
//! the smallest at which no more than a given number of bins is occupied. More points can only raise it. So it depends neither on the order
//! of the points nor on the parts in which they come.
//!
//! Rows belong to [`FOLDS`] folds, block by block, by their place in the whole record. Every bin keeps the sums of each fold.
//! Cross-validation leaves out one fold at a time. The scatter of the folds' own estimates gives the standard error of their mean (batch
//! means). Both are valid for dependent rows too, if the dependence fades within a block.
//!
//! | file | what |
//! |---|---|
//! | this one | the accumulator: [`StreamedRegression::push`], [`merge`](StreamedRegression::merge) |
//! | [`bytes`] | the accumulator as bytes |
//! | [`fit`] | the bandwidth, the estimate and its band |
//!
//! References: Fan and Marron (1994), binning; Burman, Chow and Nolan (1994), cross-validation by blocks; Schucany and Sommers
//! (1977), the bias correction of the band.

mod bytes;
mod fit;

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

pub use fit::{StreamedBand, StreamedFit};

use super::bin::Bin;
use crate::error::{DataError, Error, Result};

/// The number of folds. With fewer, the standard errors from their scatter are coarse; with more, a bin takes more memory.
pub const FOLDS: usize = 20;
/// The default for the most bins: 31 MiB.
const MOST_BINS: usize = 1 << 15;
/// Rows of a block, by default.
const BLOCK: u64 = 1000;
/// The narrowest and the widest bins are 2^-1000 and 2^1000: their inverses are finite.
const LEVELS: std::ops::RangeInclusive<i32> = -1000..=1000;
/// A bin's number has at most one binary digit more than this, so that it is exact in `f64`.
const LARGEST_PLACE: i32 = 51;

/// One bin: the sums of every fold.
type Folds = [Bin; FOLDS];

/// Sums over the rows of a record, from which a kernel regression of y on x follows.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `most_bins` | bins at most; a bin takes 960 bytes | 64 to 2^24 | 32,768 |
/// | `block` | rows that stay together in cross-validation and in the band; much longer than the rows' dependence | 1 or more | 1000 |
///
/// ```
/// use flexure::nonlinearity::{Kernel, Degree, Regression, StreamedRegression};
/// let x: Vec<f64> = (0..40_000).map(|i| f64::from(i * 37 % 40_000) / 10_000.0).collect();
/// let y: Vec<f64> = x.iter().map(|x| x.sin()).collect();
/// // Two machines, each with a half of the rows.
/// let mut first = StreamedRegression::default();
/// let mut second = StreamedRegression::default();
/// first.push(0, &x[..25_000], &y[..25_000])?;
/// second.push(25_000, &x[25_000..], &y[25_000..])?;
/// first.merge(&second)?;
/// let fit = first.fit(Kernel::Epanechnikov, Degree::Linear, None)?;
/// assert!((fit.predict(&[&[1.0]])?[0] - 1f64.sin()).abs() < 1e-3);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct StreamedRegression {
    most_bins: usize,
    block: u64,
    /// The bins are [k 2^level, (k + 1) 2^level).
    level: i32,
    /// Where the bin number k is in `bins`.
    places: HashMap<i64, usize, BuildHasherDefault<PlaceHasher>>,
    bins: Vec<Folds>,
    count: u64,
}

impl Default for StreamedRegression {
    fn default() -> Self {
        StreamedRegression {
            most_bins: MOST_BINS,
            block: BLOCK,
            level: *LEVELS.start(),
            places: HashMap::default(),
            bins: Vec::new(),
            count: 0,
        }
    }
}

impl StreamedRegression {
    /// Empty sums.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter out of its range.
    pub fn new(most_bins: usize, block: u64) -> Result<Self> {
        if !(64..=1 << 24).contains(&most_bins) {
            return Err(Error::parameter(
                "the largest number of bins",
                most_bins as f64,
                "64 to 2^24",
            ));
        }
        if block == 0 {
            return Err(Error::parameter("the length of a block", 0.0, "at least 1 row"));
        }
        Ok(StreamedRegression {
            most_bins,
            block,
            ..Self::default()
        })
    }

    /// Empty sums with bins as wide as these. They take in rows of the same record faster, as the bins need not become wider again.
    pub fn emptied(&self) -> Self {
        StreamedRegression {
            most_bins: self.most_bins,
            block: self.block,
            level: self.level,
            ..Self::default()
        }
    }

    /// The number of rows that were taken in.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The width of the bins, in the unit of x.
    pub fn bin_width(&self) -> f64 {
        exp2(self.level)
    }

    /// Takes in consecutive rows of the record. The first is at place `first_row`, counted from 0.
    ///
    /// # Errors
    /// [`Error::Data`]: `LengthMismatch`, and `NonFinite` with the place in the record; then none of the rows was taken in.
    pub fn push(&mut self, first_row: u64, x: &[f64], y: &[f64]) -> Result<()> {
        if x.len() != y.len() {
            return Err(Error::length("y", y.len(), x.len()));
        }
        for (name, values) in [("x", x), ("y", y)] {
            if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                let row = first_row.saturating_add(i as u64);
                return Err(Error::not_finite(
                    name,
                    usize::try_from(row).unwrap_or(usize::MAX),
                    values[i],
                ));
            }
        }
        let largest = x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        if largest > 0.0 {
            self.widen_to(largest.log2() as i32 + 1 - LARGEST_PLACE);
        }
        let mut row = first_row;
        for (&x, &y) in x.iter().zip(y) {
            self.add(place(x, self.level), self.fold(row), Bin::of_point(x, y));
            row = row.saturating_add(1);
        }
        self.count += x.len() as u64;
        Ok(())
    }

    /// Takes in the rows of `other`. A row that both have counts twice.
    ///
    /// # Errors
    /// [`Error::Data`]: `Unmergeable` where the two have other parameters.
    pub fn merge(&mut self, other: &Self) -> Result<()> {
        let differ = |what| Err(Error::Data(DataError::Unmergeable { what }));
        if other.most_bins != self.most_bins {
            return differ("largest numbers of bins");
        }
        if other.block != self.block {
            return differ("lengths of a block");
        }
        self.widen_to(other.level);
        for (at, folds) in other.in_order() {
            for (fold, &bin) in folds.iter().enumerate().filter(|(_, bin)| bin.count > 0.0) {
                // These bins may have become wider in the meantime.
                self.add(wider(at, self.level - other.level), fold, bin);
            }
        }
        self.count += other.count;
        Ok(())
    }

    /// The fold of a row.
    fn fold(&self, row: u64) -> usize {
        ((row / self.block) % FOLDS as u64) as usize
    }

    fn add(&mut self, at: i64, fold: usize, bin: Bin) {
        let folds = self.folds_at(at);
        folds[fold] = folds[fold].plus(bin);
        if self.bins.len() > self.most_bins {
            self.widen_to(self.level + self.levels_to_widen());
        }
    }

    /// The sums of the bin at this place. If there is none, it is made.
    fn folds_at(&mut self, at: i64) -> &mut Folds {
        let next = self.bins.len();
        let index = *self.places.entry(at).or_insert(next);
        if index == next {
            self.bins.push([Bin::EMPTY; FOLDS]);
        }
        &mut self.bins[index]
    }

    /// How often the bins have to become twice as wide until there are no more than `most_bins`. Two neighbours become one bin when their
    /// widening drops all the last digits in which their numbers differ.
    fn levels_to_widen(&self) -> i32 {
        let places: Vec<i64> = self.in_order().iter().map(|(at, _)| *at).collect();
        let differing = |pair: &[i64]| 64 - (pair[0] ^ pair[1]).leading_zeros();
        let mut pairs_by_digits = [0; 65];
        places
            .windows(2)
            .for_each(|pair| pairs_by_digits[differing(pair) as usize] += 1);
        let mut bins = places.len();
        for (digits, pairs) in (1..).zip(&pairs_by_digits[1..]) {
            bins -= pairs;
            if bins <= self.most_bins {
                return digits;
            }
        }
        64
    }

    /// Makes the bins as wide as those of `level`, where they are narrower.
    fn widen_to(&mut self, level: i32) {
        let by = level.min(*LEVELS.end()) - self.level;
        if by <= 0 {
            return;
        }
        let narrow: Vec<(i64, Folds)> = self.in_order().into_iter().map(|(at, folds)| (at, *folds)).collect();
        self.level += by;
        self.places.clear();
        self.bins.clear();
        for (at, folds) in narrow {
            let wide = self.folds_at(wider(at, by));
            for (wide, bin) in wide.iter_mut().zip(folds).filter(|(_, bin)| bin.count > 0.0) {
                *wide = wide.plus(bin);
            }
        }
    }

    /// The bins in the order of their places.
    fn in_order(&self) -> Vec<(i64, &Folds)> {
        let mut bins: Vec<(i64, &Folds)> = self.places.iter().map(|(at, i)| (*at, &self.bins[*i])).collect();
        bins.sort_unstable_by_key(|(at, _)| *at);
        bins
    }
}

/// 2^exponent, for exponents between -1000 and 1000.
fn exp2(exponent: i32) -> f64 {
    f64::from(exponent).exp2()
}

/// The number of the bin of this level that contains x.
fn place(x: f64, level: i32) -> i64 {
    (x * exp2(-level)).floor() as i64
}

/// The number of the bin that contains this one, among bins 2^by times as wide.
fn wider(at: i64, by: i32) -> i64 {
    at >> by.clamp(0, 63)
}

/// A hash of bins' numbers. It moves neighbours far apart. Data made to collide do no harm, as there are not many bins.
#[derive(Debug, Default, Clone)]
struct PlaceHasher(u64);

impl Hasher for PlaceHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.write_i64(i64::from(*byte)));
    }

    fn write_i64(&mut self, place: i64) {
        // Fibonacci hashing (Knuth 1998, 6.4); the high digits are the well-mixed ones.
        let product = (self.0 ^ place as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        self.0 = product ^ (product >> 32);
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
