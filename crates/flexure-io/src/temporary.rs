//! Temporary files: content is written to them before it gets its final name.
//!
//! A temporary file is locked as long as its writer lives, even on another machine or in a container. One that is not locked was left by a
//! process that was killed: the next write to the same name removes it. A process that is ended by a signal can still call
//! [`remove_temporaries`].

use std::collections::HashMap;
use std::ffi::OsString;
use std::fs::{self, File, Metadata, OpenOptions};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{LazyLock, Mutex, PoisonError};

/// A temporary file's name contains up to this many bytes of the file's name: file systems allow 255, and a number and marks are added.
const LONGEST_NAME: usize = 180;
/// How many temporary names are tried.
const TRIES: usize = 100;

/// Distinguishes the temporary files of one process.
static COUNTER: AtomicU64 = AtomicU64::new(0);
/// The existing temporary files of this process, by their numbers.
static PRESENT: LazyLock<Mutex<HashMap<u64, PathBuf>>> = LazyLock::new(Mutex::default);

/// A temporary file. Dropping it removes it, unless it was put into its place.
pub(crate) struct Temporary {
    number: u64,
    path: PathBuf,
}

impl Temporary {
    /// A new one in the folder of `target`, with the mode and owner of the file that is `replaced`. Files of dead processes are removed.
    pub(crate) fn beside(target: &Path, replaced: Option<&Metadata>) -> io::Result<(Temporary, File)> {
        let Some(name) = target.file_name() else {
            return Err(io::ErrorKind::IsADirectory.into());
        };
        let mark = mark(name);
        remove_abandoned(target, &mark);
        for _ in 0..TRIES {
            let number = COUNTER.fetch_add(1, Ordering::Relaxed);
            let mut own = mark.clone();
            own.push(format!("{}-{number}.tmp", std::process::id()));
            let temporary = Temporary {
                number,
                path: target.with_file_name(own),
            };
            let mut options = OpenOptions::new();
            options.write(true).create_new(true);
            #[cfg(unix)]
            if replaced.is_some() {
                // Nobody else may read the file before it has its final mode.
                std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
            }
            // The lock ensures that a signal finds every existing file in the list.
            let mut present = PRESENT.lock().unwrap_or_else(PoisonError::into_inner);
            let file = match options.open(&temporary.path) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                other => other?,
            };
            present.insert(number, temporary.path.clone());
            drop(present);
            // Before the lock is taken, another process may have removed the file as abandoned.
            if matches!(file.try_lock(), Err(fs::TryLockError::WouldBlock)) || !temporary.path.exists() {
                continue;
            }
            if let Some(replaced) = replaced {
                keep_owner(&file, replaced)?;
            }
            return Ok((temporary, file));
        }
        Err(io::Error::other("no temporary file can be made next to it"))
    }

    /// Gives the file its name.
    pub(crate) fn put(mut self, target: &Path) -> io::Result<()> {
        fs::rename(&self.path, target)?;
        // There is nothing left to remove.
        self.path = PathBuf::new();
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let mut present = PRESENT.lock().unwrap_or_else(PoisonError::into_inner);
        // If even removing fails, nothing more can be done.
        let _ = fs::remove_file(&self.path);
        present.remove(&self.number);
    }
}

/// A folder that is removed when it is dropped, or before a signal ends the process.
pub struct TemporaryFolder {
    number: u64,
    folder: tempfile::TempDir,
}

impl TemporaryFolder {
    /// A new folder in the system's place for temporary folders.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn new() -> io::Result<Self> {
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        // The lock ensures that a signal finds every existing folder in the list.
        let mut present = PRESENT.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = tempfile::tempdir()?;
        present.insert(number, folder.path().to_owned());
        Ok(TemporaryFolder { number, folder })
    }

    /// The folder's path.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        let mut present = PRESENT.lock().unwrap_or_else(PoisonError::into_inner);
        present.remove(&self.number);
    }
}

/// Removes the temporary files and folders of this process and prevents new ones. For a process that a signal is about to end.
pub fn remove_temporaries() {
    let present = PRESENT.lock().unwrap_or_else(PoisonError::into_inner);
    for path in present.values() {
        let _ = fs::remove_file(path).or_else(|_| fs::remove_dir_all(path));
    }
    std::mem::forget(present);
}

/// How the names of the temporary files of a file begin.
fn mark(name: &std::ffi::OsStr) -> OsString {
    let mut mark = OsString::from(".");
    if name.len() <= LONGEST_NAME {
        mark.push(name);
    } else {
        let mut hasher = DefaultHasher::new();
        name.hash(&mut hasher);
        mark.push(format!("{:016x}", hasher.finish()));
    }
    mark.push(".");
    mark
}

/// Removes the temporary files of `target` whose writers are dead.
fn remove_abandoned(target: &Path, mark: &OsString) {
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty());
    let Ok(entries) = fs::read_dir(folder.unwrap_or(Path::new("."))) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let rest = name.as_encoded_bytes().strip_prefix(mark.as_encoded_bytes());
        let rest = rest.and_then(|rest| rest.strip_suffix(b".tmp"));
        let is_temporary =
            rest.is_some_and(|rest| rest.contains(&b'-') && rest.iter().all(|b| b.is_ascii_digit() || *b == b'-'));
        if !is_temporary || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        let path = target.with_file_name(name);
        // The lock is held until the file is gone.
        if let Ok(file) = OpenOptions::new().write(true).open(&path)
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(&path);
        }
    }
}

/// Gives a file the mode of another, and its owner where the system allows it.
#[cfg(unix)]
fn keep_owner(file: &File, other: &Metadata) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, fchown};
    let own = file.metadata()?;
    let [user, group] =
        [(own.uid(), other.uid()), (own.gid(), other.gid())].map(|(own, new)| (own != new).then_some(new));
    if user.is_some() || group.is_some() {
        // Only the superuser may give files away; the group can sometimes be kept even if the owner cannot.
        let _ = fchown(file, user, group).or_else(|_| fchown(file, None, group));
    }
    file.set_permissions(other.permissions())
}

#[cfg(not(unix))]
fn keep_owner(file: &File, other: &Metadata) -> io::Result<()> {
    file.set_permissions(other.permissions())
}
