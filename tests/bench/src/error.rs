//! What can go wrong.

use std::path::{Path, PathBuf};

/// Why a benchmark could not be made.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Something in the request or in a file is wrong.
    #[error("{what}")]
    Invalid {
        /// What, and where.
        what: String,
    },
    /// A file cannot be read or written.
    #[error("{}: {source}", file.display())]
    Io {
        /// Which.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A picture cannot be read or written.
    #[error(transparent)]
    Image(#[from] resolvent_image::Error),
    /// A volume cannot be read.
    #[error(transparent)]
    Volume(#[from] resolvent_vdb::Error),
    /// A renderer failed.
    #[error("{renderer} on {scene}: {why}")]
    Renderer {
        /// Which.
        renderer: String,
        /// On what.
        scene: String,
        /// What it said.
        why: String,
    },
}

/// A result with our error.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Adds a file's name to an error of the system.
    pub fn io(file: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |source| Self::Io {
            file: file.into(),
            source,
        }
    }

    /// Something is wrong.
    pub fn invalid(what: impl Into<String>) -> Self {
        Self::Invalid { what: what.into() }
    }
}
