//! Reads a record in any of the formats.

use std::fs::File;
use std::io::{self, BufReader, Cursor, Read, Seek};
use std::path::Path;

use bytes::Bytes;
use flate2::read::MultiGzDecoder;
use flexure::Interrupt;

use crate::error::{Error, Result};
use crate::memory::Budget;
use crate::options::ReadOptions;
use crate::record_file::RecordFile;
use crate::{bag, hdf5, mat, parquet_file, text};

/// The longest beginning of a file that shows its format: HDF5's signature may stand at byte 65,536.
const SIGNATURE_LENGTH: u64 = (1 << 16) + 8;

/// The first bytes of a file packed by gzip.
const GZIP: &[u8] = b"\x1f\x8b\x08";

/// Reads a record with the default [`ReadOptions`].
///
/// # Errors
/// As [`ReadOptions::read`].
pub fn read_record(path: impl AsRef<Path>) -> Result<RecordFile> {
    ReadOptions::default().read(path)
}

/// What a path of `-` is called.
const STANDARD_INPUT: &str = "standard input";

impl ReadOptions {
    /// Reads a record: text with or without a header, Parquet, MAT, HDF5 or a topic of a ROS 2 bag; from standard input if `path` is `-`.
    /// The path may also be a pipe, a file packed by gzip or Zstandard, or the folder of a bag with one file.
    ///
    /// The format comes from the first bytes of the file; if these do not decide, the extensions `.parquet` and `.mat` do, and everything
    /// else is text. Text may have the forms that programs and instruments write:
    ///
    /// - Columns are separated by commas, semicolons, tabs, pipes or spaces, whichever divides all lines into equally many fields.
    ///   Lines that begin with `#` are comments; a spreadsheet's first line `sep=;` is passed over.
    /// - A first line of texts is the header; so is a comment directly above the first row with as many names as there are columns. Units in
    ///   brackets after the names, or in a second line, become [`RecordFile::units`]. Without a header the columns are called `c0`, `c1`, ...
    /// - Numbers have decimal points, or decimal commas where a comma does not separate columns. A unit may follow each, as in `1.5 V`.
    ///   The words false and true, off and on, no and yes are 0 and 1.
    /// - A mark at the beginning says that the text is UTF-16. Otherwise it is UTF-8, or Latin-1.
    /// - A time column stamps (ISO 8601, or dates with slashes where a row says whether the month comes first) becomes seconds from its
    ///   first. A column of texts is no signal; the other columns can still be used.
    /// - Instants that count ms, µs or ns from 1970 are recognised by their size. Where instants decrease and never increase, the newest
    ///   sample comes first: the rows are taken from the last to the first.
    /// - An empty field is a missing sample, which is NaN; so are `nan`, `NA`, `null` and the like. So are dashes of any number. Blank lines may
    ///   only come last, between the header and the samples, or above a header that is repeated: a logger that starts again.
    ///
    /// A file that can be read in two ways is refused; the error names the option that decides. [`RecordFile::notes`] says what was
    /// decided.
    ///
    /// A null of a Parquet file is NaN too. The scalars of a MAT file are kept apart as
    /// [`RecordFile::constants`]; its vectors, rows or columns alike, must have equal lengths. The fields of a structure are read as
    /// variables; vectors there that are shorter than the signals are left out.
    ///
    /// # Errors
    /// Says what is wrong, in which file, and where: see [`Error`].
    pub fn read(&self, path: impl AsRef<Path>) -> Result<RecordFile> {
        let options = ReadOptions {
            time_format: self.time_format.as_deref().map(text::with_fraction),
            ..self.clone()
        };
        options.read_as_written(path.as_ref())?.with_clocks()
    }

    fn read_as_written(&self, path: &Path) -> Result<RecordFile> {
        if let Some(only) = bag::only_file(path)? {
            let mut file = self.read_as_written(&only)?;
            file.notes.insert(0, "the only bag of the folder is read".to_owned());
            return Ok(file);
        }
        let (path, source) = match path.as_os_str() == "-" {
            true => (Path::new(STANDARD_INPUT), Source::Stream(Box::new(io::stdin().lock()))),
            false => (path, Source::open(path).map_err(|cause| Error::read(path, cause))?),
        };
        let unpacked = |(start, source): (Vec<u8>, Source)| match start {
            _ if start.starts_with(bag::ZSTD) => Source::Stream(Box::new(zstd::Decoder::new(source.stream())?)).begun(),
            _ if start.starts_with(GZIP) => Source::Stream(Box::new(MultiGzDecoder::new(source.stream()))).begun(),
            _ => Ok((start, source)),
        };
        let (start, source) = source
            .begun()
            .and_then(unpacked)
            .map_err(|cause| Error::read(path, cause))?;
        if start.is_empty() {
            return Err(Error::Empty { path: path.to_owned() });
        }
        self.read_begun(path, &start, source)
    }

    /// Reads a source that begins with these bytes. They and the file's name decide the format.
    fn read_begun(&self, path: &Path, start: &[u8], source: Source) -> Result<RecordFile> {
        let budget = Budget::new(path, self.memory);
        if start.starts_with(bag::MCAP) {
            return match source {
                Source::File(file) => bag::read_mcap(&budget, path, self, || {
                    let mut file = file.try_clone().map_err(|cause| Error::read(path, cause))?;
                    file.rewind().map_err(|cause| Error::read(path, cause))?;
                    Ok(BufReader::with_capacity(1 << 16, Reported::new(file)))
                }),
                Source::Stream(stream) => {
                    let bytes = budget.all(stream)?;
                    bag::read_mcap(&budget, path, self, || Ok(bytes.as_slice()))
                }
            };
        }
        if start.starts_with(bag::DB3) {
            let stream = match source {
                Source::File(_) => None,
                Source::Stream(stream) => Some(stream),
            };
            return bag::read_db3(&budget, path, self, stream);
        }
        let is_hdf5 = hdf5::is_begun(start);
        if self.joint.is_some() || (self.topic.is_some() && !is_hdf5) {
            return Err(Error::NoBag { path: path.to_owned() });
        }
        if is_hdf5 {
            let source = match source {
                Source::File(file) => hdf5::Source::File(file),
                Source::Stream(stream) => hdf5::Source::Bytes(budget.all(stream)?),
            };
            return hdf5::read(&budget, path, source, self.topic.as_deref());
        }
        let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        let extension = extension.as_deref().unwrap_or("");
        if let Some(format) = [("mcap", "MCAP"), ("db3", "SQLite")]
            .into_iter()
            .find(|(own, _)| *own == extension)
        {
            let detail = "it does not begin as one; the file is cut off, damaged or something else".to_owned();
            return Err(Error::content(path, format.1, detail));
        }
        if start.starts_with(b"PAR1") || start.starts_with(b"PARE") || extension == "parquet" {
            return match source {
                Source::File(file) => parquet_file::read(&budget, path, file),
                Source::Stream(stream) => parquet_file::read(&budget, path, Bytes::from(budget.all(stream)?)),
            };
        }
        let stream = source.stream();
        if start.starts_with(b"MATLAB 5.0 MAT-file") || extension == "mat" {
            return mat::read(&budget, path, stream);
        }
        text::read(&budget, path, stream, self)
    }
}

/// A file that reports how much of it was read to the watcher of this thread.
struct Reported {
    file: File,
    read: u64,
    all: u64,
}

impl Reported {
    fn new(file: File) -> Self {
        let all = file.metadata().map_or(0, |found| found.len());
        Reported { file, read: 0, all }
    }
}

impl Read for Reported {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        self.read += count as u64;
        Interrupt::report(self.read, self.all);
        Ok(count)
    }
}

/// Where a record comes from.
enum Source {
    /// A file on a disk: any part of it can be read.
    File(File),
    /// A pipe or a device: it can be read only once, from its beginning.
    Stream(Box<dyn Read>),
}

impl Source {
    fn open(path: &Path) -> io::Result<Source> {
        let file = File::open(path)?;
        let kind = file.metadata()?.file_type();
        match (kind.is_dir(), kind.is_file()) {
            (true, _) => Err(io::ErrorKind::IsADirectory.into()),
            (_, true) => Ok(Source::File(file)),
            _ => Ok(Source::Stream(Box::new(file))),
        }
    }

    /// All bytes from here on.
    fn stream(self) -> Box<dyn Read> {
        match self {
            Source::File(file) => Box::new(Reported::new(file)),
            Source::Stream(stream) => stream,
        }
    }

    /// The first bytes, which show the format, and the source, which still has them.
    fn begun(self) -> io::Result<(Vec<u8>, Source)> {
        let mut start = Vec::new();
        let source = match self {
            Source::File(mut file) => {
                file.by_ref().take(SIGNATURE_LENGTH).read_to_end(&mut start)?;
                file.rewind()?;
                Source::File(file)
            }
            Source::Stream(mut stream) => {
                stream.by_ref().take(SIGNATURE_LENGTH).read_to_end(&mut start)?;
                Source::Stream(Box::new(Cursor::new(start.clone()).chain(stream)))
            }
        };
        Ok((start, source))
    }
}
