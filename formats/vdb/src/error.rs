//! What can go wrong, and where in which file it went wrong.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The result of everything that reads a file.
pub type Result<T> = std::result::Result<T, Error>;

/// The sort of a failure: what a caller can do about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ErrorKind {
    /// The operating system refused: no such file, no permission, a disk error.
    Io,
    /// The file is well formed as far as read, but uses something this reader does not support.
    Unsupported,
    /// The file breaks the format: cut short, damaged, or not an OpenVDB file.
    Invalid,
    /// The caller's [`Parallel`](crate::Parallel) left tasks undone, as it may to give up.
    Cancelled,
    /// The file is fine, but what was asked for is not in it.
    Missing,
}

/// A failure: file, grid, byte offset and reason in one sentence.
///
/// Cheap to clone, because a grid that cannot be read keeps its refusal (see
/// [`GridInfo::refusal`](crate::GridInfo)).
#[derive(Clone, Debug, thiserror::Error)]
pub struct Error {
    /// What sort of failure this is.
    pub kind: ErrorKind,
    /// The file, as its path was given to [`File::open`](crate::File::open).
    pub file: PathBuf,
    /// The unique name of the grid concerned, if one is.
    pub grid: Option<String>,
    /// Where in the file, in bytes from its start, if there is such a place.
    pub offset: Option<u64>,
    /// What is wrong, with the remedy where there is one.
    pub reason: String,
    /// The operating system's error behind [`ErrorKind::Io`].
    #[source]
    pub source: Option<Arc<io::Error>>,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.file.display())?;
        if let Some(grid) = &self.grid {
            write!(f, "grid '{}': ", grid.escape_debug())?;
        }
        f.write_str(&self.reason)?;
        match self.offset {
            Some(offset) => write!(f, " (at byte {offset})"),
            None => Ok(()),
        }
    }
}

/// A failure inside the parsers, which know offsets but neither file nor grid.
#[derive(Clone, Debug)]
pub(crate) struct Fault {
    pub kind: ErrorKind,
    pub offset: Option<u64>,
    pub reason: String,
    pub source: Option<Arc<io::Error>>,
}

/// The result of the parsers.
pub(crate) type Parsed<T> = std::result::Result<T, Fault>;

impl Fault {
    pub fn invalid(offset: u64, reason: impl Into<String>) -> Self {
        Self::new(ErrorKind::Invalid, Some(offset), reason)
    }

    pub fn unsupported(offset: u64, reason: impl Into<String>) -> Self {
        Self::new(ErrorKind::Unsupported, Some(offset), reason)
    }

    pub fn new(kind: ErrorKind, offset: Option<u64>, reason: impl Into<String>) -> Self {
        Self {
            kind,
            offset,
            reason: reason.into(),
            source: None,
        }
    }

    pub fn io(offset: Option<u64>, error: io::Error) -> Self {
        Self {
            kind: ErrorKind::Io,
            offset,
            reason: error.to_string(),
            source: Some(Arc::new(error)),
        }
    }

    /// Names the file, and the grid if there is one.
    pub fn at(self, file: &Path, grid: Option<&str>) -> Error {
        Error {
            kind: self.kind,
            file: file.to_owned(),
            grid: grid.map(str::to_owned),
            offset: self.offset,
            reason: self.reason,
            source: self.source,
        }
    }
}
