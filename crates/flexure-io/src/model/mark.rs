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

impl RecordMark {
    /// The mark of these columns of a record.
    ///
    /// # Errors
    /// For columns that the record lacks.
    pub fn new(name: &str, record: &Record, columns: &[&str]) -> flexure::Result<Self> {
        let mut checksum = Crc::new();
        for column in columns {
            for value in record.column(column)? {
                checksum.update(&value.to_le_bytes());
            }
        }
        Ok(RecordMark {
            name: name.to_owned(),
            samples: record.len(),
            crc32: checksum.sum(),
        })
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
        let swapped = RecordMark::new("r.csv", &record, &["y", "u"]).unwrap();
        assert!(!mark.same_samples(&swapped));
    }
}
