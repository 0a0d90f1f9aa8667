//! What kind of file the user gave, and which options go with it.

use crate::args::Render;
use crate::failure::{Outcome, input};
use std::io::Read;
use std::path::Path;

/// Kinds of files that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A scene, JSON.
    Scene,
    /// An OpenVDB file.
    Vdb,
    /// An OpenEXR image.
    Exr,
    /// A glTF model.
    Gltf,
    /// A USD stage.
    Usd,
}

/// First bytes of OpenVDB files.
const VDB_MAGIC: [u8; 4] = [0x20, 0x42, 0x44, 0x56];
/// First bytes of OpenEXR files.
const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// True if a file begins like an OpenEXR image.
pub fn is_exr(path: &Path) -> bool {
    let mut first = [0; 4];
    let read = std::fs::File::open(path).and_then(|mut f| f.read_exact(&mut first));
    read.is_ok() && first == EXR_MAGIC
}

/// Tells the kind of a file by its name, or else by its first bytes.
pub fn kind(path: &Path) -> Outcome<Kind> {
    let named = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .and_then(|e| match e.as_str() {
            "json" => Some(Kind::Scene),
            "vdb" => Some(Kind::Vdb),
            "exr" => Some(Kind::Exr),
            "gltf" | "glb" => Some(Kind::Gltf),
            "usd" | "usda" | "usdc" | "usdz" => Some(Kind::Usd),
            _ => None,
        });
    let failed = |e: std::io::Error| input(format!("{}: {e}", path.display()));
    if path.is_dir() {
        return Err(input(format!("{}: is a folder", path.display())));
    }
    let mut file = std::fs::File::open(path).map_err(failed)?;
    if let Some(kind) = named {
        return Ok(kind);
    }
    let mut first = Vec::new();
    file.by_ref()
        .take(4)
        .read_to_end(&mut first)
        .map_err(failed)?;
    if first == VDB_MAGIC {
        Ok(Kind::Vdb)
    } else if first == EXR_MAGIC {
        Ok(Kind::Exr)
    } else if first == *b"glTF" {
        Ok(Kind::Gltf)
    } else if first == *b"PXR-" || first == *b"#usd" {
        Ok(Kind::Usd)
    } else if first.iter().find(|b| !b.is_ascii_whitespace()) == Some(&b'{') {
        Ok(Kind::Scene)
    } else if first == resolvent_engine::checkpoint::MAGIC[..4] {
        Err(input(format!(
            "{0}: is a checkpoint; `resolvent merge {0} -o FILE.exr` makes a picture of it",
            path.display()
        )))
    } else {
        Err(input(format!(
            "{}: is neither a scene (.json) nor an OpenVDB file (.vdb) nor a glTF model (.gltf, .glb) nor a USD stage (.usd, .usda, .usdc, .usdz) nor an OpenEXR image (.exr)",
            path.display()
        )))
    }
}

/// What is to be rendered, with no options that are for other inputs.
pub fn of(a: &Render) -> Outcome<Kind> {
    let kind = kind(&a.input)?;
    refuse(a, kind)?;
    Ok(kind)
}

/// Refuses options that are for other inputs.
fn refuse(a: &Render, kind: Kind) -> Outcome<()> {
    if let (Kind::Scene | Kind::Usd, Some(option)) = (kind, a.guesses.given()) {
        let what = if kind == Kind::Usd {
            "USD stage"
        } else {
            "scene"
        };
        return Err(input(format!(
            "{option} is for VDB files and models; {} is a {what}, which says this itself",
            a.input.display()
        )));
    }
    if let (true, Some(option)) = (kind != Kind::Usd, a.stage.given()) {
        return Err(input(format!(
            "{option} is for USD stages; {} is none",
            a.input.display()
        )));
    }
    Ok(())
}
