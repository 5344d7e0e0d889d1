//! Reads a record in any of the formats.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use crate::error::{Error, Result};
use crate::record_file::RecordFile;
use crate::{mat, parquet_file, text};

/// The longest beginning of a file that shows its format: HDF5's signature may stand at byte 512.
const SIGNATURE_LENGTH: u64 = 520;

/// The first eight bytes of an HDF5 file.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Reads a record: CSV with a header, whitespace-separated columns without one, Parquet or MAT v5.
///
/// The format comes from the first bytes of the file; where these do not show it, the extensions `.parquet` and
/// `.mat` name it, and everything else is text. Nothing is guessed in text:
///
/// - The first line that is neither blank nor a comment (`#`) decides. Numbers with whitespace
///   between them are columns without a header, named `c0`, `c1`, ...; a file called `.csv` or
///   `.tsv` must have a header, though.
/// - Otherwise that line is the header. The separator is the comma or the semicolon, whichever the
///   header has (not both), else the tab; a name on its own is a file of one column. Names may be quoted.
/// - An empty field is a missing sample, which is NaN; so is `nan`. Blank lines may only come last.
///
/// A null of a Parquet file is NaN too. The scalars of a MAT file are kept apart as
/// [`RecordFile::constants`]; its vectors, rows or columns alike, must have equal lengths.
///
/// # Errors
/// Says what is wrong, in which file, and where: see [`Error`].
pub fn read_record(path: impl AsRef<Path>) -> Result<RecordFile> {
    let path = path.as_ref();
    let fail = |source| Error::read(path, source);
    let mut file = File::open(path).map_err(fail)?;
    if file.metadata().map_err(fail)?.is_dir() {
        return Err(fail(std::io::ErrorKind::IsADirectory.into()));
    }
    let mut start = Vec::new();
    file.by_ref()
        .take(SIGNATURE_LENGTH)
        .read_to_end(&mut start)
        .map_err(fail)?;
    if start.is_empty() {
        return Err(Error::Empty { path: path.to_owned() });
    }
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let extension = extension.as_deref().unwrap_or("");
    if start.starts_with(b"PAR1") || start.starts_with(b"PARE") || extension == "parquet" {
        return parquet_file::read(path, file);
    }
    if start.starts_with(HDF5) || start.get(512..).is_some_and(|rest| rest.starts_with(HDF5)) {
        let detail = "it is an HDF5 file, such as MATLAB writes with -v7.3; save it with -v7";
        return Err(Error::content(path, "MAT v5", detail.to_owned()));
    }
    file.seek(SeekFrom::Start(0)).map_err(fail)?;
    if start.starts_with(b"MATLAB 5.0 MAT-file") || extension == "mat" {
        return mat::read(path, file);
    }
    text::read(path, file, matches!(extension, "csv" | "tsv"))
}
