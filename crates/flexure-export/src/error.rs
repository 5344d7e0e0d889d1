//! What can go wrong in an export.

use std::path::PathBuf;

use flexure::text::shown_path;

/// Why a model was not exported.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The name is no identifier.
    #[error("the exported model's name is {name:?}, but {problem}; give another name")]
    Name {
        /// The name.
        name: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// The model cannot be simulated.
    #[error("the model cannot be exported: {0}")]
    Model(String),
    /// The output's file name cannot be used.
    #[error("{path}: {problem}", path = shown_path(path))]
    Path {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// No compiler, or one that failed.
    #[error("the FMU could not be compiled: {0}")]
    Compile(String),
    /// A template or an archive could not be made.
    #[error("the export could not be made: {0}")]
    Internal(String),
}

impl From<minijinja::Error> for Error {
    fn from(error: minijinja::Error) -> Self {
        Error::Internal(format!("{error:#}"))
    }
}

impl From<zip::result::ZipError> for Error {
    fn from(error: zip::result::ZipError) -> Self {
        Error::Internal(error.to_string())
    }
}

impl From<std::io::Error> for Error {
    fn from(error: std::io::Error) -> Self {
        Error::Internal(error.to_string())
    }
}

/// The result of an export.
pub type Result<T> = std::result::Result<T, Error>;
