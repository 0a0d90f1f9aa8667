//! PLY triangle meshes: ASCII and binary of either byte order; positions, normals, texture coordinates, colours and faces.
//!
//! ```no_run
//! let mesh = resolvent_ply::read("bunny.ply")?;
//! println!("{} triangles", mesh.indices.len());
//! # Ok::<(), resolvent_ply::PlyError>(())
//! ```
//!
//! - Element `vertex`: `x y z`; if present `nx ny nz`; texture coordinates as `u v`, `s t`, `texture_u texture_v` or
//!   `texture_s texture_t`; colours as `red green blue` or `r g b`, with `alpha` or `a` if there. Any scalar type; other properties
//!   and elements are passed over. Colours of integer types are taken as fractions of the type's largest value, encoded by the curve
//!   of sRGB, as programs write them; floating-point ones are linear as they are. Negative ones are an error.
//! - Element `face`: the list `vertex_indices` or `vertex_index`. Polygons become a fan around their first vertex, which is right
//!   for convex ones; **a concave polygon is not triangulated properly**. A face with fewer than three vertices is an error.
//! - Per-face texture coordinates (MeshLab's `texcoord` lists) are passed over. Triangle strips are refused by name.
//!
//! Foreign files are not trusted: whatever the bytes, the result is a mesh with finite numbers and indices in range or an error
//! with file, line or byte, and reason. Memory stays within some thirty times the file's size: a header's counts are never
//! believed before the data is there. (The crate ply-rs-bw 4.0.1 was tried: an 80-byte file that declares 10¹⁸ elements without
//! properties makes it abort out of memory, and its errors carry no byte offsets.)

mod body;
mod header;
mod mesh;

use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// A triangle mesh. All numbers are finite, all indices refer to positions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, in the file's unit.
    pub positions: Vec<[f32; 3]>,
    /// One normal a vertex, of whatever length the file gives.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Texture coordinates, one pair a vertex.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Linear red, green, blue and opacity, one a vertex.
    pub colors: Option<Vec<[f32; 4]>>,
    /// Triangles, in the faces' winding.
    pub indices: Vec<[u32; 3]>,
}

/// Where in a file something is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line of the header or of ASCII data, from 1.
    Line(u64),
    /// Byte of binary data, from 0.
    Byte(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(n) => write!(f, "line {n}"),
            Self::Byte(n) => write!(f, "byte {n}"),
        }
    }
}

/// What is wrong with the contents of a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {reason}")]
pub struct Fault {
    /// Where it was noticed.
    pub place: Place,
    /// What was found and what was expected.
    pub reason: String,
}

/// Why a file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum PlyError {
    /// The file could not be opened or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The contents are not a mesh this reader takes.
    #[error("{}: {fault}", path.display())]
    Contents {
        /// The file.
        path: PathBuf,
        /// Place and reason.
        fault: Fault,
    },
}

/// Reads a PLY file.
pub fn read(path: impl AsRef<Path>) -> Result<Mesh, PlyError> {
    let path = path.as_ref();
    let bytes = read_bytes(path).map_err(|source| PlyError::Io {
        path: path.into(),
        source,
    })?;
    parse(&bytes).map_err(|fault| PlyError::Contents {
        path: path.into(),
        fault,
    })
}

/// The bytes of a file; of what is no PLY only the first ones.
fn read_bytes(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    if !file.metadata()?.is_file() {
        return Err(std::io::Error::other("is not a regular file"));
    }
    let mut bytes = Vec::new();
    file.by_ref().take(64).read_to_end(&mut bytes)?;
    if bytes.starts_with(b"ply") {
        file.read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}

/// Reads PLY from memory.
pub fn parse(bytes: &[u8]) -> Result<Mesh, Fault> {
    let header = header::parse(bytes)?;
    mesh::assemble(&header, bytes)
}

/// A piece of foreign text, fit for a message: escaped and not too long.
fn quoted(text: &[u8]) -> String {
    const MOST: usize = 40;
    let shown = String::from_utf8_lossy(&text[..text.len().min(MOST)]);
    let more = if text.len() > MOST { "…" } else { "" };
    format!("\"{}{more}\"", shown.escape_debug())
}
