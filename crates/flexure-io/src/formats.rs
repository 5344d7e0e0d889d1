//! The formats of records by the names of their files.
//!
//! [`ReadOptions::read`](crate::ReadOptions::read) goes by a file's first bytes where it can. These names serve searches of folders and lists of files.

use std::path::Path;

/// A format of records.
#[derive(Debug)]
pub struct Format {
    /// What it is called.
    pub title: &'static str,
    /// The extensions of its files, in lower case.
    pub extensions: &'static [&'static str],
    /// Whether a file may have several parts, one of which is read: `topic` and `joint` name it.
    pub has_parts: bool,
}

/// All formats.
pub const FORMATS: [Format; 6] = [
    Format {
        title: "text",
        extensions: &["csv", "txt", "tsv", "dat", "log", "asc"],
        has_parts: false,
    },
    Format {
        title: "Parquet",
        extensions: &["parquet"],
        has_parts: false,
    },
    Format {
        title: "MAT",
        extensions: &["mat"],
        has_parts: true,
    },
    Format {
        title: "HDF5",
        extensions: &["h5", "hdf5"],
        has_parts: true,
    },
    Format {
        title: "ROS 2 bag",
        extensions: &["mcap", "db3"],
        has_parts: true,
    },
    Format {
        title: "packed by Zstandard",
        extensions: &["zst", "zstd"],
        has_parts: true,
    },
];

impl Format {
    /// The format that a file's name promises; `None` for the names of other files.
    ///
    /// ```
    /// assert_eq!(flexure_io::Format::of("log.CSV").unwrap().title, "text");
    /// assert!(flexure_io::Format::of("page.html").is_none());
    /// ```
    pub fn of(name: impl AsRef<Path>) -> Option<&'static Format> {
        let extension = name.as_ref().extension()?.to_str()?.to_ascii_lowercase();
        FORMATS
            .iter()
            .find(|format| format.extensions.contains(&extension.as_str()))
    }
}
