//! Tables of transforms for many copies of a prototype: NumPy files (`.npy`).
//!
//! The array is f32 or f64, little-endian, in C order, of shape (n, 3, 4) or (n, 4, 4): for each copy the rows of a matrix that acts
//! on column vectors, as in [`Transform`]. `numpy.save("trees.npy", matrices)` writes one. The format is that of NumPy's
//! documentation, "numpy.lib.format", versions 1 to 3.

use std::io::Read;
use std::path::{Path, PathBuf};

use crate::transform::Transform;

/// The largest table, in copies: about 20 GiB in the renderer.
pub const MAX_COPIES: usize = 100_000_000;

/// Longest header that is read; NumPy's own are below 200 bytes.
const MAX_HEADER: usize = 1 << 16;

/// Why a table can't be used.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file can't be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is no table of transforms.
    #[error("{}: {what}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
}

/// Reads a table.
///
/// # Errors
/// If the file can't be read, is no such array, or holds what is no transform: numbers that are not finite, or a matrix that
/// can't be inverted.
pub fn read(path: &Path) -> Result<Vec<Transform>, Error> {
    let io = |source| Error::Io {
        path: path.to_path_buf(),
        source,
    };
    let file = std::fs::File::open(path).map_err(io)?;
    // More than the largest table is not read, whatever the file's size says.
    let mut bytes = Vec::new();
    file.take((MAX_COPIES * 128 + MAX_HEADER + 12) as u64 + 1)
        .read_to_end(&mut bytes)
        .map_err(io)?;
    parse(&bytes).map_err(|what| Error::Invalid {
        path: path.to_path_buf(),
        what,
    })
}

/// Reads a table from the bytes of its file.
fn parse(bytes: &[u8]) -> Result<Vec<Transform>, String> {
    let (header, data) = split(bytes)?;
    let descr = value(header, "descr").ok_or("the header has no 'descr'")?;
    let size = match descr.trim_matches(['\'', '"']) {
        "<f4" => 4,
        "<f8" => 8,
        other => {
            return Err(format!(
                "expected little-endian floats ('<f4' or '<f8'), found '{other}'"
            ));
        }
    };
    if value(header, "fortran_order") != Some("False") {
        return Err("expected rows before columns (C order)".into());
    }
    let shape = value(header, "shape").ok_or("the header has no 'shape'")?;
    let extents: Vec<usize> = shape
        .trim_matches(['(', ')'])
        .split(',')
        .map(str::trim)
        .filter(|s| !s.is_empty())
        .map(|s| s.parse().map_err(|_| format!("unreadable shape {shape}")))
        .collect::<Result<_, _>>()?;
    let (count, rows) = match extents[..] {
        [n, rows @ (3 | 4), 4] => (n, rows),
        _ => {
            return Err(format!(
                "expected the shape (n, 3, 4) or (n, 4, 4), found {shape}"
            ));
        }
    };
    if count > MAX_COPIES {
        return Err(format!("{count} copies are more than {MAX_COPIES}"));
    }
    let each = rows * 4 * size;
    if data.len() != count * each {
        return Err(format!(
            "expected {} bytes for the shape {shape}, found {}",
            count * each,
            data.len()
        ));
    }
    data.chunks_exact(each)
        .enumerate()
        .map(|(i, chunk)| {
            let mut m = Transform::IDENTITY;
            for (x, raw) in m.0.iter_mut().flatten().zip(chunk.chunks_exact(size)) {
                *x = match *raw {
                    [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
                    [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
                    _ => unreachable!("chunks of 4 or 8 bytes"),
                };
            }
            match m.fault() {
                Some(fault) => Err(format!("copy {i} has {fault}")),
                None => Ok(m),
            }
        })
        .collect()
}

/// The header's text and the array's bytes.
fn split(bytes: &[u8]) -> Result<(&str, &[u8]), String> {
    let rest = bytes
        .strip_prefix(b"\x93NUMPY")
        .ok_or("is no NumPy file (.npy)")?;
    let cut = "ends within its header";
    let (length, rest) = match *rest {
        [1, _, a, b, ref rest @ ..] => (usize::from(u16::from_le_bytes([a, b])), rest),
        [2 | 3, _, a, b, c, d, ref rest @ ..] => (u32::from_le_bytes([a, b, c, d]) as usize, rest),
        [version, _, ..] if version > 3 => {
            return Err(format!("has NumPy's format version {version}, not 1 to 3"));
        }
        _ => return Err(cut.into()),
    };
    if length > MAX_HEADER {
        return Err(format!("has a header of {length} bytes"));
    }
    let (header, data) = rest.split_at_checked(length).ok_or(cut)?;
    let header = std::str::from_utf8(header).map_err(|_| "has a header that is no text")?;
    Ok((header, data))
}

/// The value under a key of the header, a Python dictionary of plain values.
fn value<'h>(header: &'h str, key: &str) -> Option<&'h str> {
    let at = header.find(&format!("'{key}'"))?;
    let rest = header[at..].split_once(':')?.1.trim_start();
    let end = if rest.starts_with('(') {
        rest.find(')')? + 1
    } else {
        rest.find([',', '}'])?
    };
    Some(rest[..end].trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file as `numpy.save` writes it.
    fn file(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let mut header =
            format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
        while (header.len() + 11) % 64 != 0 {
            header.push(' ');
        }
        header.push('\n');
        let mut out = b"\x93NUMPY\x01\x00".to_vec();
        out.extend((header.len() as u16).to_le_bytes());
        out.extend(header.as_bytes());
        out.extend(data);
        out
    }

    const ROWS: [[f64; 4]; 3] = [
        [2.0, 0.0, 0.0, 5.0],
        [0.0, 3.0, 0.5, 6.0],
        [0.0, 0.0, 1.0, 7.0],
    ];

    #[test]
    fn both_precisions_and_shapes() {
        let singles: Vec<u8> = ROWS
            .iter()
            .flatten()
            .flat_map(|x| (*x as f32).to_le_bytes())
            .collect();
        let doubles: Vec<u8> = ROWS
            .iter()
            .chain(&[[0.0, 0.0, 0.0, 1.0]])
            .flatten()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        let twice = [&singles[..], &singles[..]].concat();
        for (bytes, n) in [
            (file("<f4", "(2, 3, 4)", &twice), 2),
            (file("<f8", "(1, 4, 4)", &doubles), 1),
            (file("<f4", "(0, 3, 4)", &[]), 0),
        ] {
            let table = parse(&bytes).unwrap();
            assert_eq!(table.len(), n);
            for t in &table {
                assert_eq!(t.0[..3], ROWS);
                assert_eq!(t.0[3], [0.0, 0.0, 0.0, 1.0]);
            }
        }
    }

    #[test]
    fn what_is_no_table_is_refused_with_the_reason() {
        let data = [0u8; 48];
        for (bytes, reason) in [
            (b"PNG".to_vec(), "no NumPy file"),
            (file("<i4", "(1, 3, 4)", &data), "'<i4'"),
            (file(">f4", "(1, 3, 4)", &data), "'>f4'"),
            (file("<f4", "(12,)", &data), "(12,)"),
            (file("<f4", "(2, 3, 4)", &data), "96 bytes"),
            (file("<f4", "(99999999999, 3, 4)", &data), "more than"),
            (
                file("<f4", "(99999999999999999999999, 3, 4)", &data),
                "unreadable",
            ),
            (file("<f4", "(1, 3, 4)", &data), "copy 0 has"),
            (
                file("<f4", "(1, 3, 4)", &f32::NAN.to_le_bytes().repeat(12)),
                "not finite",
            ),
        ] {
            let error = parse(&bytes).unwrap_err();
            assert!(error.contains(reason), "{error}");
        }
        // Cut anywhere.
        let whole = file("<f4", "(1, 3, 4)", &data);
        for end in 0..whole.len() {
            assert!(parse(&whole[..end]).is_err());
        }
    }
}
