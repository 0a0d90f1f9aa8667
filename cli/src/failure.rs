//! How the program ends.

use std::fmt::Display;
use std::process::ExitCode;

/// Exit codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// Everything was done.
    Done = 0,
    /// Something failed that is not the input's fault.
    Failed = 1,
    /// Wrong usage, or wrong input: a file, a scene, a plugin.
    Input = 2,
    /// Interrupted; what was finished is saved.
    Interrupted = 3,
}

impl From<Code> for ExitCode {
    fn from(code: Code) -> Self {
        ExitCode::from(code as u8)
    }
}

/// An end before the work was done, with its message.
#[derive(Debug)]
pub struct Failure {
    /// With which code.
    pub code: Code,
    /// What to tell, without the word "error".
    pub message: String,
}

/// The outcome of a command.
pub type Outcome<T = Code> = Result<T, Failure>;

/// Wrong usage or input.
pub fn input(message: impl Display) -> Failure {
    Failure {
        code: Code::Input,
        message: message.to_string(),
    }
}

/// Anything else.
pub fn failed(message: impl Display) -> Failure {
    Failure {
        code: Code::Failed,
        message: message.to_string(),
    }
}
