//! Errors of scene files: which file, where in it, what was expected, what was found.

use std::fmt;
use std::path::{Path, PathBuf};

/// Where in a scene file something stands.
///
/// Two places are always equal: a description read from a file equals the same description built
/// in memory or read from another layout of the text.
#[derive(Debug, Clone, Default)]
pub struct Place {
    /// JSON path from the root, such as `$.lights[0].radiance`; empty if it comes from no file.
    pub path: String,
    /// Line, counted from 1; 0 if it comes from no file.
    pub line: usize,
    /// Column in characters, counted from 1; 0 if it comes from no file.
    pub column: usize,
}

impl Place {
    /// A place in a file.
    pub fn new(path: String, line: usize, column: usize) -> Place {
        Place { path, line, column }
    }

    /// True if it names a place in a file, false if the description was built in memory.
    pub fn is_known(&self) -> bool {
        self.line > 0
    }
}

impl PartialEq for Place {
    fn eq(&self, _: &Place) -> bool {
        true
    }
}

/// One thing wrong in a scene file. Shown as `file:line:column: path: message`.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// The scene file; empty for a description built in memory.
    pub file: PathBuf,
    /// Where in it.
    pub place: Place,
    /// What was expected and what was found, in one sentence.
    pub what: String,
}

impl Problem {
    /// A problem at a place of a file.
    pub fn new(file: &Path, place: Place, what: impl Into<String>) -> Problem {
        Problem {
            file: file.to_path_buf(),
            place,
            what: what.into(),
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = !self.file.as_os_str().is_empty();
        if named {
            write!(f, "{}:", self.file.display())?;
        }
        if self.place.is_known() {
            write!(
                f,
                "{}:{}: {}: ",
                self.place.line, self.place.column, self.place.path
            )?;
        } else if named {
            f.write_str(" ")?;
        }
        f.write_str(&self.what)
    }
}

impl std::error::Error for Problem {}

/// Why a scene was not read or written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file cannot be read or written.
    #[error("{}: {source}", file.display())]
    Io {
        /// The scene file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The text is not JSON.
    #[error("{0}")]
    Syntax(Problem),
    /// The file needs a newer program.
    #[error("{0}")]
    Unsupported(Problem),
    /// The JSON is not a valid scene: everything that is wrong with it, at least one problem.
    #[error("{}", lines(.0))]
    Invalid(Vec<Problem>),
}

fn lines(problems: &[Problem]) -> String {
    problems
        .iter()
        .map(Problem::to_string)
        .collect::<Vec<_>>()
        .join("\n")
}

impl Error {
    /// The problems with their places; none for [`Error::Io`].
    pub fn problems(&self) -> &[Problem] {
        match self {
            Error::Io { .. } => &[],
            Error::Syntax(p) | Error::Unsupported(p) => std::slice::from_ref(p),
            Error::Invalid(all) => all,
        }
    }
}
