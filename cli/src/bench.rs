//! `resolvent bench`.

use crate::failure::{Code, Outcome, failed, input};
use resolvent_bench::{Error, Options};

/// Runs the command.
pub fn run(a: &Options) -> Outcome {
    match resolvent_bench::run(a) {
        Ok(true) => Ok(Code::Done),
        Ok(false) => Ok(Code::Failed),
        Err(e @ (Error::Renderer { .. } | Error::Io { .. })) => Err(failed(e)),
        Err(e) => Err(input(e)),
    }
}
