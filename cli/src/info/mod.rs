//! `resolvent info`.

mod exr;
mod gltf;
mod scene;
mod vdb;

pub use scene::named_files;
pub use vdb::short;

use crate::args::Info;
use crate::failure::{Code, Outcome};
use crate::input::{Kind, kind};
use serde_json::Value;

/// What a file holds: for machines and for people.
pub struct Report {
    json: Value,
    text: String,
}

/// Runs the command.
pub fn run(a: &Info) -> Outcome {
    let report = match kind(&a.file)? {
        Kind::Vdb => vdb::report(&a.file)?,
        Kind::Scene => scene::report(&a.file)?,
        Kind::Exr => exr::report(&a.file)?,
        Kind::Gltf => gltf::report(&a.file)?,
    };
    if a.json {
        println!("{:#}", report.json);
    } else {
        print!("{}", report.text);
    }
    Ok(Code::Done)
}
