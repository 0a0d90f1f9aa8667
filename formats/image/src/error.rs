//! Errors of image files.

use std::path::{Path, PathBuf};

/// Why an image was not read or written. Every variant names the file.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The system refused.
    #[error("{}: {what}{source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What was being done, ending in a colon and a blank, or nothing.
        what: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is damaged, or the image cannot be written as it is.
    #[error("{}: {what}", file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// The file may be fine, but holds something that is not read.
    #[error("{}: {what}", file.display())]
    Unsupported {
        /// The file.
        file: PathBuf,
        /// What is not read.
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

    pub(crate) fn unsupported(file: &Path, what: impl Into<String>) -> Error {
        Error::Unsupported {
            file: file.to_path_buf(),
            what: what.into(),
        }
    }

    pub(crate) fn io(file: &Path, what: &'static str, source: std::io::Error) -> Error {
        Error::Io {
            file: file.to_path_buf(),
            what,
            source,
        }
    }

    pub(crate) fn exr(file: &Path, error: exr::error::Error) -> Error {
        match error {
            exr::error::Error::Io(source) => Error::io(file, "", source),
            exr::error::Error::NotSupported(what) => {
                Error::unsupported(file, format!("EXR feature not read: {what}"))
            }
            exr::error::Error::Invalid(what) => {
                Error::invalid(file, format!("damaged EXR file: {what}"))
            }
            exr::error::Error::Aborted => Error::invalid(file, "reading was aborted"),
        }
    }
}
