//! How much memory reading a file may take.
//!
//! What a file declares is not trusted: a few kilobytes can claim, or unpack to, any number of samples. Before memory is taken, every
//! length is checked here.

use std::cell::Cell;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::error::{Error, NoMemory, Result};

/// The most memory for a record where [`ReadOptions::memory`](crate::ReadOptions::memory) does not say it, bytes.
const MOST: u64 = 4 << 30;
/// The share of the free memory that a record may take: a comparison of all structures needs sixteen times the record in addition (measured).
const RECORD_OF_FREE: u64 = 20;
/// The share of the free memory for a computed record together with its sources.
const COMPUTED_OF_FREE: u64 = 2;
/// The longest text of an arm or another small file, bytes.
pub(crate) const LONGEST_TEXT: u64 = 16 << 20;
/// The longest model file, bytes.
pub(crate) const LONGEST_MODEL: u64 = 256 << 20;

/// What is left of the memory for one file.
#[derive(Debug)]
pub(crate) struct Budget<'a> {
    path: &'a Path,
    limit: u64,
    left: Cell<u64>,
}

impl<'a> Budget<'a> {
    /// The budget for the record at `path`: the given memory, or the usual amount.
    pub(crate) fn new(path: &'a Path, given: Option<u64>) -> Self {
        let limit = given.unwrap_or_else(usual_memory);
        Budget {
            path,
            limit,
            left: Cell::new(limit),
        }
    }

    /// Takes `bytes`; `what` needs them.
    ///
    /// # Errors
    /// [`Error::TooLarge`] if fewer are left.
    pub(crate) fn take(&self, bytes: u64, what: &str) -> Result<()> {
        match self.left.get().checked_sub(bytes) {
            Some(left) => {
                self.left.set(left);
                Ok(())
            }
            None => Err(self.too_large(what)),
        }
    }

    /// What is left, bytes.
    pub(crate) fn left(&self) -> u64 {
        self.left.get()
    }

    /// Gives back memory that is free again.
    pub(crate) fn give_back(&self, bytes: u64) {
        self.left.set(self.left.get().saturating_add(bytes).min(self.limit));
    }

    /// Takes the memory for `count` numbers.
    ///
    /// # Errors
    /// As [`take`](Self::take).
    pub(crate) fn numbers(&self, count: usize, what: &str) -> Result<()> {
        self.take((count as u64).saturating_mul(size_of::<f64>() as u64), what)
    }

    /// Everything that `input` has.
    ///
    /// # Errors
    /// As [`take`](Self::take), and [`Error::Read`].
    pub(crate) fn all(&self, input: impl Read) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let read = input.take(self.left.get().saturating_add(1)).read_to_end(&mut bytes);
        match read {
            Err(error) if error.kind() == io::ErrorKind::OutOfMemory => return Err(self.too_large("the file")),
            other => other.map_err(|cause| Error::read(self.path, cause))?,
        };
        self.take(bytes.len() as u64, "the file")?;
        Ok(bytes)
    }

    pub(crate) fn too_large(&self, what: &str) -> Error {
        Error::TooLarge {
            path: self.path.to_owned(),
            what: what.to_owned(),
            limit: self.limit,
            remedy: "; --memory SIZE (such as 8GiB) allows more",
        }
    }
}

/// The bytes of a file, or of the standard input for `-`: at most `limit`.
///
/// # Errors
/// [`Error::Read`], [`Error::TooLarge`].
pub(crate) fn small_file(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let fail = |cause| Error::read(path, cause);
    let input: Box<dyn Read> = match path.as_os_str() == "-" {
        true => Box::new(io::stdin().lock()),
        false => Box::new(std::fs::File::open(path).map_err(fail)?),
    };
    let mut bytes = Vec::new();
    input.take(limit + 1).read_to_end(&mut bytes).map_err(fail)?;
    match bytes.len() as u64 > limit {
        false => Ok(bytes),
        true => Err(Error::TooLarge {
            path: path.to_owned(),
            what: "the file".to_owned(),
            limit,
            remedy: "; is it the right file?",
        }),
    }
}

/// The most memory for a record where it is not given, bytes: 4 GiB, or a twentieth of the free memory where that is less.
pub fn usual_memory() -> u64 {
    free().map_or(MOST, |free| MOST.min(free / RECORD_OF_FREE))
}

/// Refuses to compute a record of this size if half of the free memory cannot hold both it and its sources, which take as much again.
///
/// # Errors
/// [`NoMemory`].
pub fn check_computed(rows: usize, columns: usize) -> std::result::Result<(), NoMemory> {
    fits(rows, columns, free())
}

fn fits(rows: usize, columns: usize, free: Option<u64>) -> std::result::Result<(), NoMemory> {
    let bytes = [rows, columns, 2 * size_of::<f64>()]
        .into_iter()
        .fold(1, |product: u64, n| product.saturating_mul(n as u64));
    match free.map(|free| free / COMPUTED_OF_FREE) {
        Some(limit) if bytes > limit => Err(NoMemory {
            rows,
            columns,
            bytes,
            limit,
        }),
        _ => Ok(()),
    }
}

/// The memory that is free for use, bytes; `None` if the system does not report it.
fn free() -> Option<u64> {
    let available = kibibytes_or_bytes(Path::new("/proc/meminfo"), "MemAvailable:");
    // The process may have its own limit (ulimit -v).
    let limits = std::fs::read_to_string("/proc/self/limits").unwrap_or_default();
    let limit = limits.lines().find_map(|line| line.strip_prefix("Max address space"));
    let limit = limit.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
    let taken = kibibytes_or_bytes(Path::new("/proc/self/status"), "VmSize:").unwrap_or(0);
    let own = limit.map(|limit| limit.saturating_sub(taken));
    [available, own, of_group()].into_iter().flatten().min()
}

/// The memory that the process's control group (cgroup), such as a container, has left, bytes. Cached pages of files count as free.
fn of_group() -> Option<u64> {
    let groups = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    let number = |file: PathBuf| std::fs::read_to_string(file).ok()?.trim().parse::<u64>().ok();
    let left = |folder: &Path, limit: &str, used: &str, kept: &str| {
        let kept = kibibytes_or_bytes(&folder.join("memory.stat"), kept).unwrap_or(0);
        let used = number(folder.join(used))?.saturating_sub(kept);
        Some(number(folder.join(limit))?.saturating_sub(used))
    };
    let each = groups.lines().filter_map(|line| {
        let mut parts = line.splitn(3, ':');
        let (_, controllers, path) = (parts.next()?, parts.next()?, parts.next()?);
        let (root, names) = match controllers {
            "" => ("/sys/fs/cgroup", ["memory.max", "memory.current", "inactive_file "]),
            "memory" => (
                "/sys/fs/cgroup/memory",
                ["memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file "],
            ),
            _ => return None,
        };
        // The limits of the groups above hold too. Within a container, the path may be the one outside it.
        let within = Path::new(root).join(path.trim_start_matches('/'));
        let folders = within.ancestors().filter(|folder| folder.starts_with(root));
        folders
            .filter_map(|folder| left(folder, names[0], names[1], names[2]))
            .min()
    });
    each.min()
}

/// The bytes of a line such as `MemAvailable: 1024 kB` or `inactive_file 4096`.
fn kibibytes_or_bytes(file: &Path, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let mut line = text
        .lines()
        .find_map(|line| line.strip_prefix(name))?
        .split_whitespace();
    let count: u64 = line.next()?.parse().ok()?;
    Some(if line.next() == Some("kB") { count << 10 } else { count })
}

/// A size as people write it: `4 GiB`.
pub(crate) fn size(bytes: u64) -> String {
    let (divisor, unit) = match bytes {
        b if b >= 1 << 30 => (1_u64 << 30, "GiB"),
        b if b >= 1 << 20 => (1 << 20, "MiB"),
        b if b >= 1 << 10 => (1 << 10, "KiB"),
        _ => (1, "bytes"),
    };
    match bytes % divisor {
        0 => format!("{} {unit}", bytes / divisor),
        _ => format!("{:.1} {unit}", bytes as f64 / divisor as f64),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_computed_record_takes_at_most_half_of_the_free_memory() {
        let gibibyte = 1 << 30;
        // 2^20 rows of 4 columns and as much again are 64 MiB.
        assert!(fits(1 << 20, 4, Some(gibibyte)).is_ok());
        assert!(fits(1 << 20, 32, Some(gibibyte)).is_ok());
        let refused = fits(1 << 20, 33, Some(gibibyte)).unwrap_err().to_string();
        assert!(refused.contains("528 MiB") && refused.contains("512 MiB"), "{refused}");
        assert!(fits(usize::MAX, usize::MAX, Some(u64::MAX)).is_err());
        // If the free memory is unknown, nothing is refused.
        assert!(fits(usize::MAX, 2, None).is_ok());
    }
}
