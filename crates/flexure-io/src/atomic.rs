//! Files that are written whole or not at all.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::temporary::Temporary;

/// Symbolic links that are followed one after the other, as the system does.
const MOST_LINKS: usize = 40;

/// Writes `path` through `write`, whole or not at all.
///
/// The content goes to a temporary file in the same directory, which replaces `path` once `write`
/// has succeeded and everything is on the disk. If anything fails, `path` is as it was before and
/// the temporary file is removed. A file that is replaced keeps its mode, and its owner where the system allows it. A symbolic link
/// is followed, also to a file that does not exist yet. Devices and pipes are written directly.
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
/// [`Error::Write`] if `path` is a directory, is read-only or lies in a directory that does not exist or takes no files.
pub fn check_writable(path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    check(path).map_err(|cause| Error::write(path, cause))
}

fn check(path: &Path) -> io::Result<()> {
    let target = destination(path)?;
    match fs::metadata(&target) {
        Ok(found) if found.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(found) if found.permissions().readonly() => Err(io::ErrorKind::PermissionDenied.into()),
        Ok(found) if !found.is_file() => Ok(()),
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        found => match target.parent() {
            // Whether the folder takes a file is seen by making one.
            Some(folder) if folder.as_os_str().is_empty() || folder.is_dir() => {
                Temporary::beside(&target, found.ok().as_ref()).map(drop)
            }
            _ => Err(io::ErrorKind::NotFound.into()),
        },
    }
}

/// Makes a folder, and those above it, where it is not there yet.
///
/// # Errors
/// [`Error::Folder`].
pub fn make_folder(path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    fs::create_dir_all(path).map_err(|cause| Error::Folder {
        path: path.to_owned(),
        cause,
    })
}

/// The file that a path means: that to which symbolic links lead, be it there or not.
///
/// # Errors
/// For links that lead in a circle.
pub fn destination(path: &Path) -> io::Result<PathBuf> {
    let mut target = path.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(next) = fs::read_link(&target) else {
            return Ok(target);
        };
        target = target.parent().unwrap_or(Path::new("")).join(next);
    }
    Err(io::Error::other("its symbolic links lead in a circle"))
}

fn into_place(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
    // A device such as /dev/stdout may be a link to what has no name.
    if fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        let mut out = BufWriter::new(OpenOptions::new().write(true).open(path)?);
        write(&mut out)?;
        return out.flush();
    }
    let target = destination(path)?;
    let replaced = fs::metadata(&target).ok();
    if replaced.as_ref().is_some_and(Metadata::is_dir) {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if replaced.as_ref().is_some_and(|found| found.permissions().readonly()) {
        return Err(io::ErrorKind::PermissionDenied.into());
    }
    let (temporary, file) = Temporary::beside(&target, replaced.as_ref())?;
    let mut out = BufWriter::new(file);
    write(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.sync_all()?;
    temporary.put(&target)
}
