//! Files that are written completely or not at all.

use std::cell::RefCell;
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

/// A file that gets its name when all others are written. It is kept open and so locked, so that no other process takes it for a dead
/// process's file.
struct Waiting {
    temporary: Temporary,
    target: PathBuf,
    _locked: File,
}

thread_local! {
    /// The files that this thread writes [`together`].
    static WAITING: RefCell<Option<Vec<Waiting>>> = const { RefCell::new(None) };
}

/// Runs `work`, whose writes on this thread by [`write_atomically`] take effect together once it has succeeded; if it fails, every file is
/// as it was before. Devices and pipes are written at once. All content is on the disk before the first file gets its name. If the system
/// then refuses a name, the files before it keep theirs.
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("first.txt");
/// use std::io::Write;
///
/// let failed = flexure_io::together(|| {
///     flexure_io::write_atomically(&path, |out| writeln!(out, "one"))?;
///     flexure_io::write_atomically(folder.path(), |out| writeln!(out, "a folder is no file"))
/// });
/// assert!(failed.is_err() && !path.exists());
/// # Ok::<(), std::io::Error>(())
/// ```
///
/// # Errors
/// Those of `work`; [`Error::Write`] where a file cannot get its name.
pub fn together<T, E: From<Error>>(work: impl FnOnce() -> std::result::Result<T, E>) -> std::result::Result<T, E> {
    if WAITING.with_borrow(Option::is_some) {
        return work();
    }
    WAITING.set(Some(Vec::new()));
    let result = work();
    // After a failure the files are dropped, and with them the temporary files.
    let waiting = WAITING.take().unwrap_or_default();
    let result = result?;
    // Each stays locked until it has its name.
    for Waiting {
        temporary,
        target,
        _locked,
    } in waiting
    {
        temporary.put(&target).map_err(|cause| Error::write(&target, cause))?;
    }
    Ok(result)
}

/// Refuses `path` where [`write_atomically`] would, without writing anything.
///
/// For use before long work whose result goes to `path`. A full disk is noticed only at the end.
///
/// # Errors
/// [`Error::Write`] if `path` is a directory, is read-only or lies in a directory that does not exist or takes no files.
pub fn check_writable(path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    check(path).map_err(|cause| Error::write(path, cause))
}

fn check(path: &Path) -> io::Result<()> {
    if let Some(standard) = standard(path) {
        return standard.map(drop);
    }
    let target = destination(path)?;
    match fs::metadata(&target) {
        Ok(found) if found.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(found) if found.permissions().readonly() => Err(io::ErrorKind::PermissionDenied.into()),
        Ok(found) if !found.is_file() => Ok(()),
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        found => match target.parent() {
            // Making a file is the test whether the folder takes one.
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

/// The file that a path means, after following symbolic links; the file need not exist.
///
/// # Errors
/// For links that lead in a circle.
pub fn destination(path: &Path) -> io::Result<PathBuf> {
    let mut target = path.to_owned();
    // A link of the system's to a pipe or a device names no file.
    if is_device(path) {
        return Ok(target);
    }
    for _ in 0..MOST_LINKS {
        let Ok(next) = fs::read_link(&target) else {
            return Ok(target);
        };
        target = target.parent().unwrap_or(Path::new("")).join(next);
    }
    Err(io::Error::other("its symbolic links lead in a circle"))
}

fn is_device(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// The standard output or error stream, where the path means one of them. A write to it is appended to the earlier output of the process.
fn standard(path: &Path) -> Option<io::Result<File>> {
    #[cfg(unix)]
    {
        use std::os::fd::AsFd;

        let name = path.to_str()?;
        let is = |stream: &str, number: u8| {
            name == format!("/dev/{stream}")
                || name == format!("/dev/fd/{number}")
                || name == format!("/proc/self/fd/{number}")
        };
        let owned = match name {
            _ if is("stdout", 1) => io::stdout().as_fd().try_clone_to_owned(),
            _ if is("stderr", 2) => io::stderr().as_fd().try_clone_to_owned(),
            _ => return None,
        };
        Some(owned.map(File::from))
    }
    #[cfg(not(unix))]
    {
        let _ = path;
        None
    }
}

fn into_place(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
    let direct = match standard(path) {
        Some(stream) => Some(stream?),
        None if is_device(path) => Some(OpenOptions::new().write(true).open(path)?),
        None => None,
    };
    if let Some(direct) = direct {
        let mut out = BufWriter::new(direct);
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
    WAITING.with_borrow_mut(|waiting| match waiting {
        Some(waiting) => {
            waiting.push(Waiting {
                temporary,
                target,
                _locked: file,
            });
            Ok(())
        }
        None => temporary.put(&target),
    })
}
