//! `resolvent info`.

mod exr;
mod gltf;
mod scene;
mod vdb;

pub use scene::{files_of_parts, named_files};
pub use vdb::short;

use crate::args::Info;
use crate::failure::{Code, Outcome, input};
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
        Kind::Usd => {
            return Err(input(format!(
                "{0}: is a USD stage; `resolvent convert {0} -o scene.json` makes a scene of it, which info describes",
                a.file.display()
            )));
        }
    };
    if a.json {
        println!("{:#}", report.json);
    } else {
        print!("{}", report.text);
    }
    Ok(Code::Done)
}
