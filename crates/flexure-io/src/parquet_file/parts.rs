//! A Parquet file part by part, for computations that need the rows one after the other, not all at once.

use std::fs::File;
use std::panic::{AssertUnwindSafe, resume_unwind};
use std::path::{Path, PathBuf};

use flexure::error::DataError;
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::{Appended, CONTRADICTORY, Kind, check_ends, content, damaged, next, quietly};
use crate::error::{Error, Result};
use crate::record_file::Other;
use crate::units::split_units;

/// Some columns of a Parquet file, row group by row group. Memory holds only one page of every column, for files of any length.
///
/// ```
/// # let folder = std::env::temp_dir().join(format!("flexure-parts-{}", std::process::id()));
/// # std::fs::create_dir_all(&folder)?;
/// # let path = folder.join("log.parquet");
/// use flexure::record::Record;
/// use flexure_io::{ParquetParts, write_record};
/// write_record(&path, &Record::new([("u", vec![1.0, 2.0]), ("y", vec![3.0, 4.0])])?)?;
/// let parts = ParquetParts::open(&path, &["y"])?;
/// let mut sum = 0.0;
/// for part in 0..parts.count() {
///     parts.read(part, &mut |_, columns| {
///         sum += columns[0].iter().sum::<f64>();
///         Ok(())
///     })?;
/// }
/// assert_eq!((parts.rows(), sum), (2, 7.0));
/// # std::fs::remove_dir_all(folder)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct ParquetParts {
    path: PathBuf,
    columns: Vec<(usize, Kind)>,
    units: Vec<Option<String>>,
    /// The place of every part's first row in the file, and the number of all rows.
    starts: Vec<u64>,
}

/// Takes consecutive rows: the place of the first one in the file, and the columns. Missing samples are NaN.
pub type TakeRows<'a> = dyn FnMut(u64, &[Vec<f64>]) -> Result<()> + 'a;

impl ParquetParts {
    /// Opens these columns of a file.
    ///
    /// # Errors
    /// [`Error::Read`]; [`Error::Content`] and [`Error::Truncated`] for a file that is damaged or no Parquet file;
    /// [`Error::Data`] for a column that the file does not have; [`Error::NoSamples`].
    pub fn open(path: impl AsRef<Path>, columns: &[&str]) -> Result<Self> {
        let path = path.as_ref();
        let file = File::open(path).map_err(|cause| Error::read(path, cause))?;
        check_ends(path, &file)?;
        quietly(AssertUnwindSafe(|| Self::checked(path, file, columns)))
            .unwrap_or_else(|_| Err(damaged(path, CONTRADICTORY)))
    }

    fn checked(path: &Path, file: File, columns: &[&str]) -> Result<Self> {
        let reader = SerializedFileReader::new(file).map_err(|error| content(path, error))?;
        let schema = reader.metadata().file_metadata().schema_descr();
        let mut names: Vec<String> = schema.columns().iter().map(|column| column.name().to_owned()).collect();
        let all_units = split_units(&mut names);
        let found = |name: &&str| {
            let Some(i) = names.iter().position(|own| own == name) else {
                let (name, available) = ((*name).to_owned(), names.clone());
                return Err(Error::data(path, DataError::MissingColumn { name, available }.into()));
            };
            match Kind::of(&schema.column(i)) {
                Ok(kind) => Ok((i, kind)),
                Err(what) => Err(Other::new((*name).to_owned(), what).error(path)),
            }
        };
        let columns = columns.iter().map(found).collect::<Result<Vec<_>>>()?;
        let mut starts = vec![0_u64];
        for group in reader.metadata().row_groups() {
            let rows = u64::try_from(group.num_rows()).unwrap_or(0);
            starts.push(starts[starts.len() - 1].saturating_add(rows));
        }
        if starts.last() == Some(&0) {
            return Err(Error::NoSamples {
                path: path.to_owned(),
                names,
            });
        }
        Ok(ParquetParts {
            path: path.to_owned(),
            units: columns.iter().map(|(i, _)| all_units[*i].clone()).collect(),
            columns,
            starts,
        })
    }

    /// The number of parts.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The number of rows of all parts.
    pub fn rows(&self) -> u64 {
        self.starts[self.count()]
    }

    /// The columns' units, where the file has them.
    pub fn units(&self) -> &[Option<String>] {
        &self.units
    }

    /// The error with the file's name.
    pub fn locate(&self, error: flexure::Error) -> Error {
        Error::data(&self.path, error)
    }

    /// Calls `each` with the rows of a part, in order, a batch at a time.
    ///
    /// # Errors
    /// [`Error::Content`] and [`Error::Truncated`] for damaged data; [`Error::Data`] for integers that f64 cannot hold; errors of `each`.
    pub fn read(&self, part: usize, each: &mut TakeRows) -> Result<()> {
        match quietly(AssertUnwindSafe(|| self.read_checked(part, each))) {
            Ok(result) => result,
            Err(panic) if panic.is::<&str>() || panic.is::<String>() => Err(damaged(&self.path, CONTRADICTORY)),
            // Work that is asked to stop unwinds in this way.
            Err(leaving) => resume_unwind(leaving),
        }
    }

    fn read_checked(&self, part: usize, each: &mut TakeRows) -> Result<()> {
        let content = |error| content(&self.path, error);
        // Opens the file again: several parts may be read at once, and copies of a handle share one position.
        let file = File::open(&self.path).map_err(|cause| Error::read(&self.path, cause))?;
        let reader = SerializedFileReader::new(file).map_err(content)?;
        let group = reader.get_row_group(part).map_err(content)?;
        let readers = self
            .columns
            .iter()
            .map(|(i, kind)| Ok((group.get_column_reader(*i)?, *kind)));
        let mut readers = readers.collect::<std::result::Result<Vec<_>, _>>().map_err(content)?;
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); readers.len()];
        let mut row = self.starts[part];
        loop {
            for ((reader, kind), samples) in readers.iter_mut().zip(&mut columns) {
                samples.clear();
                let appended = next(reader, *kind, samples, &mut |_, _| Appended::All).map_err(content)?;
                if matches!(appended, Some(Appended::Inexact)) {
                    return Err(damaged(
                        &self.path,
                        "it has integers beyond 2^53, which cannot be represented exactly",
                    ));
                }
            }
            let rows = columns.first().map_or(0, Vec::len);
            if columns.iter().any(|samples| samples.len() != rows) {
                return Err(damaged(&self.path, "its columns have different lengths; save it again"));
            }
            if rows == 0 {
                return match row == self.starts[part + 1] {
                    true => Ok(()),
                    false => Err(damaged(
                        &self.path,
                        "it has another number of rows than it declares; save it again",
                    )),
                };
            }
            each(row, &columns)?;
            row = row.saturating_add(rows as u64);
        }
    }
}
