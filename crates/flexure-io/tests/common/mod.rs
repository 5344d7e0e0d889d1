//! What the tests of this crate share.
#![allow(dead_code)]

use std::path::{Path, PathBuf};

use flexure_io::{ReadOptions, RecordFile};

/// A fresh, empty directory for one test.
pub fn directory(test: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// A fixture made by SciPy or PyArrow (`scripts/reference`).
pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// The message of `error`, with the file's directory left out.
pub fn message(error: &impl std::fmt::Display, directory: &Path) -> String {
    error.to_string().replace(&format!("{}/", directory.display()), "")
}

/// The record of a text file with this content, or the message of the error.
pub fn read_with(options: &ReadOptions, test: &str, content: impl AsRef<[u8]>) -> Result<RecordFile, String> {
    let dir = directory(test);
    std::fs::write(dir.join("log.csv"), content).unwrap();
    options.read(dir.join("log.csv")).map_err(|e| message(&e, &dir))
}

/// The record of a text file with this content.
pub fn read(test: &str, content: impl AsRef<[u8]>) -> RecordFile {
    read_with(&ReadOptions::default(), test, content).unwrap()
}

/// The message about a text file with this content.
pub fn refused(test: &str, content: impl AsRef<[u8]>) -> String {
    read_with(&ReadOptions::default(), test, content).unwrap_err()
}

/// Columns, units and sample time of a log of three samples: u = 1.5, 2.5, 3.5 every 10 ms.
pub fn assert_log(file: &RecordFile, names: &[&str]) {
    assert_eq!(file.record.names(), names);
    assert_eq!(file.column("u").unwrap(), [1.5, 2.5, 3.5]);
    let time = file.time(None, &["u", "y"]).unwrap().expect("a time column");
    assert!((time.clock.step - 0.01).abs() < 1e-9, "{time:?}");
}
