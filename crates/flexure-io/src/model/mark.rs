//! Marks of the records that a model was identified from, so that its own data are not taken for fresh data.

use flate2::Crc;
use flexure::Record;
use serde::{Deserialize, Serialize};

/// A record's mark: its file's name, its length, and a checksum of the samples that the model connects.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordMark {
    /// The file's name without its folder.
    pub name: String,
    /// The samples.
    pub samples: usize,
    /// CRC-32 of the samples of the inputs and the output, one column after the other, as little-endian 64-bit floats.
    pub crc32: u32,
}

/// The checksum of a column that is read part by part.
#[derive(Debug, Default)]
pub struct ColumnChecksum(Crc);

impl ColumnChecksum {
    /// Adds the samples that follow.
    pub fn push(&mut self, samples: &[f64]) {
        for value in samples {
            self.0.update(&value.to_le_bytes());
        }
    }

    /// Adds the part that follows.
    pub fn append(&mut self, part: &ColumnChecksum) {
        self.0.combine(&part.0);
    }
}

impl RecordMark {
    /// The mark of these columns of a record.
    ///
    /// # Errors
    /// For columns that the record lacks.
    pub fn new(name: &str, record: &Record, columns: &[&str]) -> flexure::Result<Self> {
        let mut checksum = ColumnChecksum::default();
        for column in columns {
            checksum.push(record.column(column)?);
        }
        Ok(RecordMark::of_columns(name, record.len(), &[checksum]))
    }

    /// The mark of a record of so many samples whose columns have these checksums.
    pub fn of_columns(name: &str, samples: usize, columns: &[ColumnChecksum]) -> Self {
        let mut checksum = ColumnChecksum::default();
        columns.iter().for_each(|column| checksum.append(column));
        RecordMark {
            name: name.to_owned(),
            samples,
            crc32: checksum.0.sum(),
        }
    }

    /// Whether both mark the same samples. The names of the files do not matter.
    pub fn same_samples(&self, other: &RecordMark) -> bool {
        (self.samples, self.crc32) == (other.samples, other.crc32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_crc_32_of_the_bytes() {
        let record = Record::new([("u", vec![1.0, -2.5]), ("y", vec![0.0, 3.0])]).unwrap();
        // Python: zlib.crc32(struct.pack("<4d", 1.0, -2.5, 0.0, 3.0))
        let mark = RecordMark::new("r.csv", &record, &["u", "y"]).unwrap();
        assert_eq!((mark.samples, mark.crc32), (2, 4070024559));
        let other = RecordMark::new("other.csv", &record, &["u", "y"]).unwrap();
        assert!(mark.same_samples(&other));
        // The same samples part by part.
        let parts = [[[1.0].as_slice(), &[-2.5]], [&[0.0], &[3.0]]].map(|parts| {
            let mut column = ColumnChecksum::default();
            for samples in parts {
                let mut part = ColumnChecksum::default();
                part.push(samples);
                column.append(&part);
            }
            column
        });
        assert!(mark.same_samples(&RecordMark::of_columns("r.csv", 2, &parts)));
        let swapped = RecordMark::new("r.csv", &record, &["y", "u"]).unwrap();
        assert!(!mark.same_samples(&swapped));
    }
}
