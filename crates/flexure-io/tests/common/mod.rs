//! What the tests of this crate share.
#![allow(dead_code)]

use std::path::{Path, PathBuf};

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
