//! Errors of glTF files.

use std::path::{Path, PathBuf};

/// Why a model was not read. Every variant names the file.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The system refused.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is damaged.
    #[error("{}: {what}", file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// Where and what is wrong.
        what: String,
    },
    /// The file says that it cannot be shown without something that is not known here.
    #[error("{}: {what}", file.display())]
    Unsupported {
        /// The file.
        file: PathBuf,
        /// What is not known.
        what: String,
    },
}

impl Error {
    pub(crate) fn invalid(file: &Path, what: impl Into<String>) -> Error {
        Error::Invalid {
            file: file.to_path_buf(),
            what: what.into(),
        }
    }
}

/// What is wrong, without the file.
pub(crate) type Fallible<T> = Result<T, String>;
