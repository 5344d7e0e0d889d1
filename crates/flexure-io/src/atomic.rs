//! Files that are written whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

/// Distinguishes the temporary files of one process.
static COUNTER: AtomicU64 = AtomicU64::new(0);

/// A temporary file that is gone when dropped, unless it was renamed.
struct Temporary {
    path: PathBuf,
    keep: bool,
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.keep {
            // Nothing more can be done where even removing fails.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Writes `path` through `write`, whole or not at all.
///
/// The content goes to a temporary file in the same directory, which replaces `path` once `write`
/// has succeeded and everything is on the disk. If anything fails, `path` is as it was before and
/// the temporary file is removed. A symbolic link is followed. Devices and pipes are written directly.
///
/// # Errors
/// Whatever `write` returns; [`Error::Write`] if `path` is a directory or cannot be created.
pub fn write_atomically(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<()> {
    let path = path.as_ref();
    into_place(path, write).map_err(|source| Error::write(path, source))
}

/// Refuses `path` where [`write_atomically`] would, without writing anything.
///
/// For use before long work whose result goes to `path`; that the disk is full shows only in the end.
///
/// # Errors
/// [`Error::Write`] if `path` is a directory, is read-only or lies in a directory that does not exist.
pub fn check_writable(path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    let fail = |kind: io::ErrorKind| Err(Error::write(path, kind.into()));
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => fail(io::ErrorKind::IsADirectory),
        Ok(found) if found.permissions().readonly() => fail(io::ErrorKind::PermissionDenied),
        Ok(_) => Ok(()),
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::write(path, error)),
        Err(_) => match path.parent() {
            Some(folder) if folder.as_os_str().is_empty() || folder.is_dir() => Ok(()),
            _ => fail(io::ErrorKind::NotFound),
        },
    }
}

fn into_place(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
    let target = match fs::metadata(path) {
        Ok(found) if found.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        Ok(found) if !found.is_file() => {
            let mut out = BufWriter::new(OpenOptions::new().write(true).open(path)?);
            write(&mut out)?;
            return out.flush();
        }
        Ok(found) if found.permissions().readonly() => return Err(io::ErrorKind::PermissionDenied.into()),
        Ok(_) => fs::canonicalize(path)?,
        Err(error) if error.kind() == io::ErrorKind::NotFound => path.to_owned(),
        Err(error) => return Err(error),
    };
    let Some(name) = target.file_name() else {
        return Err(io::ErrorKind::IsADirectory.into());
    };
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(name);
    hidden.push(format!(
        ".{}-{}.tmp",
        std::process::id(),
        COUNTER.fetch_add(1, Ordering::Relaxed)
    ));
    let temporary_path = target.with_file_name(hidden);
    let file = OpenOptions::new().write(true).create_new(true).open(&temporary_path)?;
    let mut temporary = Temporary {
        path: temporary_path,
        keep: false,
    };
    let mut out = BufWriter::new(file);
    write(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.sync_all()?;
    drop(file);
    fs::rename(&temporary.path, &target)?;
    temporary.keep = true;
    Ok(())
}
