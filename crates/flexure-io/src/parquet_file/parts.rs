//! A Parquet file part by part, for computations that need the rows one after the other, not all at once.

use std::fs::File;
use std::io;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, resume_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use flexure::Record;
use flexure::error::DataError;
use parquet::column::reader::{ColumnReader, get_column_reader};
use parquet::errors::ParquetError;
use parquet::file::metadata::{ParquetMetaData, ParquetMetaDataReader};
use parquet::file::serialized_reader::SerializedPageReader;

use super::{Appended, CONTRADICTORY, Kind, aloud, check_ends, content, damaged, next, quietly};
use crate::error::{Error, Result};
use crate::record_file::{Other, RecordFile};
use crate::units::split_units;

/// Some columns of a Parquet file, row group by row group. Memory holds only one page of every column, for files of any length.
///
/// The footer is read once. A page is unpacked whole: the writers of Parquet make pages of about 1 MB, but the format allows 2 GiB.
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
    names: Vec<String>,
    columns: Vec<(usize, Kind)>,
    units: Vec<Option<String>>,
    /// The place of every part's first row in the file, and the number of all rows.
    starts: Vec<u64>,
    metadata: Arc<ParquetMetaData>,
    state: State,
}

/// The length of a file, and when it was last changed.
type State = (u64, Option<SystemTime>);

fn state(file: &File) -> io::Result<State> {
    let found = file.metadata()?;
    Ok((found.len(), found.modified().ok()))
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
        let checked = || {
            let state = state(&file).map_err(|cause| Error::read(path, cause))?;
            let metadata = ParquetMetaDataReader::new().parse_and_finish(&file);
            let metadata = metadata.map_err(|error| content(path, error))?;
            Self::checked(path, Arc::new(metadata), state, columns)
        };
        quietly(AssertUnwindSafe(checked)).unwrap_or_else(|_| Err(damaged(path, CONTRADICTORY)))
    }

    /// The first rows of a file with all columns that can be read: names, units and clocks are as in the record that
    /// [`ReadOptions::read`](crate::ReadOptions::read) makes of the file.
    ///
    /// # Errors
    /// As [`ParquetParts::open`], for a file without a column that can be read.
    pub fn head(path: impl AsRef<Path>, rows: u64) -> Result<RecordFile> {
        let path = path.as_ref();
        let parts = ParquetParts::open(path, &[])?;
        let (mut columns, mut units, mut refused) = (Vec::new(), Vec::new(), None);
        for name in &parts.names {
            let only = Self::checked(path, Arc::clone(&parts.metadata), parts.state, &[name]);
            match only.and_then(|only| Ok((only.rows_of(0..rows)?, only.units))) {
                Ok((samples, unit)) => {
                    columns.extend(samples.into_iter().map(|samples| (name.clone(), samples)));
                    units.extend(unit);
                }
                Err(error) => refused = Some(error),
            }
        }
        if let (true, Some(error)) = (columns.is_empty(), refused) {
            return Err(error);
        }
        parts.record(columns, units)?.with_clocks()
    }

    /// The rows of a range as a record, which is held in memory.
    ///
    /// # Errors
    /// As [`ParquetParts::read`].
    pub fn excerpt(&self, rows: Range<u64>) -> Result<RecordFile> {
        let names = self.columns.iter().map(|(i, _)| self.names[*i].clone());
        self.record(names.zip(self.rows_of(rows)?).collect(), self.units.clone())
    }

    fn record(&self, columns: Vec<(String, Vec<f64>)>, units: Vec<Option<String>>) -> Result<RecordFile> {
        let record = Record::new(columns).map_err(|error| self.locate(error))?;
        Ok(RecordFile {
            units,
            ..RecordFile::new(record, &self.path)
        })
    }

    fn rows_of(&self, rows: Range<u64>) -> Result<Vec<Vec<f64>>> {
        let mut all = vec![Vec::new(); self.columns.len()];
        self.read_rows(rows, &mut |_, columns| {
            for (all, samples) in all.iter_mut().zip(columns) {
                all.extend_from_slice(samples);
            }
            Ok(())
        })?;
        Ok(all)
    }

    fn checked(path: &Path, metadata: Arc<ParquetMetaData>, state: State, columns: &[&str]) -> Result<Self> {
        let schema = metadata.file_metadata().schema_descr();
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
        for group in metadata.row_groups() {
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
            names,
            columns,
            starts,
            metadata,
            state,
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

    /// The rows of a part.
    pub fn rows_in(&self, part: usize) -> Range<u64> {
        self.starts[part]..self.starts[part + 1]
    }

    /// Calls `each` with the rows of a part, in order, a batch at a time.
    ///
    /// # Errors
    /// [`Error::Content`] and [`Error::Truncated`] for damaged data; [`Error::Data`] for integers that f64 cannot hold; errors of `each`.
    pub fn read(&self, part: usize, each: &mut TakeRows) -> Result<()> {
        self.read_rows(self.rows_in(part), each)
    }

    /// Calls `each` with the rows of a range, as far as the file has them, in order, a batch at a time.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_rows(&self, rows: Range<u64>, each: &mut TakeRows) -> Result<()> {
        // A panic of `each`, or that work is asked to stop, is not the file's fault.
        let mut leaving = None;
        let mut each = |row: u64, columns: &[Vec<f64>]| {
            aloud(|| each(row, columns)).unwrap_or_else(|panic| {
                leaving = Some(panic);
                Err(damaged(&self.path, CONTRADICTORY))
            })
        };
        let read = || {
            // Opens the file again: several parts may be read at once, and copies of a handle share one position.
            let file = File::open(&self.path).map_err(|cause| Error::read(&self.path, cause))?;
            if state(&file).map_err(|cause| Error::read(&self.path, cause))? != self.state {
                return Err(damaged(&self.path, "it has changed since it was opened; read it again"));
            }
            let file = Arc::new(file);
            for part in 0..self.count() {
                let own = self.rows_in(part);
                let wanted = rows.start.max(own.start)..rows.end.min(own.end);
                if !wanted.is_empty() {
                    self.read_checked(&file, part, wanted, &mut each)?;
                }
            }
            Ok(())
        };
        let result = quietly(AssertUnwindSafe(read)).unwrap_or_else(|_| Err(damaged(&self.path, CONTRADICTORY)));
        match leaving {
            Some(panic) => resume_unwind(panic),
            None => result,
        }
    }

    fn read_checked(&self, file: &Arc<File>, part: usize, rows: Range<u64>, each: &mut TakeRows) -> Result<()> {
        let content = |error| content(&self.path, error);
        let damaged = |detail: &str| damaged(&self.path, detail);
        let group = self.metadata.row_group(part);
        let in_group = usize::try_from(group.num_rows()).unwrap_or(0);
        let before = usize::try_from(rows.start - self.starts[part]).unwrap_or(usize::MAX);
        let readers = self.columns.iter().map(|(i, kind)| {
            let pages = SerializedPageReader::new(Arc::clone(file), group.column(*i), in_group, None)?;
            let mut reader = get_column_reader(group.schema_descr().column(*i), Box::new(pages));
            skip(&mut reader, before)?;
            Ok((reader, *kind))
        });
        let mut readers = readers.collect::<std::result::Result<Vec<_>, _>>().map_err(content)?;
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); readers.len()];
        let mut row = rows.start;
        while row < rows.end {
            for ((reader, kind), samples) in readers.iter_mut().zip(&mut columns) {
                samples.clear();
                let appended = next(reader, *kind, samples, &mut |_, _| Appended::All).map_err(content)?;
                if matches!(appended, Some(Appended::Inexact)) {
                    return Err(damaged(
                        "it has integers beyond 2^53, which cannot be represented exactly",
                    ));
                }
            }
            let read = columns.first().map_or(0, Vec::len);
            if columns.iter().any(|samples| samples.len() != read) {
                return Err(damaged("its columns have different lengths; save it again"));
            }
            if read == 0 || row + read as u64 > self.starts[part + 1] {
                return Err(damaged("it has another number of rows than it declares; save it again"));
            }
            let wanted = usize::try_from(rows.end - row).map_or(read, |left| left.min(read));
            columns.iter_mut().for_each(|samples| samples.truncate(wanted));
            each(row, &columns)?;
            row += read as u64;
        }
        Ok(())
    }
}

/// Passes over the first rows of a column.
fn skip(reader: &mut ColumnReader, rows: usize) -> std::result::Result<usize, ParquetError> {
    match reader {
        ColumnReader::BoolColumnReader(r) => r.skip_records(rows),
        ColumnReader::Int32ColumnReader(r) => r.skip_records(rows),
        ColumnReader::Int64ColumnReader(r) => r.skip_records(rows),
        ColumnReader::FloatColumnReader(r) => r.skip_records(rows),
        ColumnReader::DoubleColumnReader(r) => r.skip_records(rows),
        _ => Err(ParquetError::General("a column's type changed".to_owned())),
    }
}
