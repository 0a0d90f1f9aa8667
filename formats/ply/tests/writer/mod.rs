//! Writes PLY for the tests.
#![allow(dead_code)] // Each test file uses its part.

use resolvent_ply::Mesh;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoding {
    Ascii,
    Little,
    Big,
}

/// Type names: of numbers, of list counts, of indices.
#[derive(Clone, Copy, Debug)]
pub struct Types(&'static str, &'static str, &'static str);

impl Types {
    pub const SMALL: Self = Self("float", "uchar", "uint");
    pub const LARGE: Self = Self("double", "uint32", "ushort");
    pub const SIGNED: Self = Self("float64", "char", "int8");
}

struct Out {
    bytes: Vec<u8>,
    encoding: Encoding,
}

impl Out {
    fn put(&mut self, kind: &str, value: f64) {
        let swap = self.encoding == Encoding::Big;
        let mut bytes = match kind {
            _ if self.encoding == Encoding::Ascii => {
                return self.bytes.extend(format!("{value} ").bytes());
            }
            "float" => (value as f32).to_le_bytes().to_vec(),
            "double" | "float64" => value.to_le_bytes().to_vec(),
            "uchar" => vec![value as u8],
            "char" | "int8" => vec![value as i8 as u8],
            "ushort" => (value as u16).to_le_bytes().to_vec(),
            "uint" | "uint32" => (value as u32).to_le_bytes().to_vec(),
            _ => panic!("{kind}"),
        };
        if swap {
            bytes.reverse();
        }
        self.bytes.extend(bytes);
    }

    fn end_line(&mut self) {
        if self.encoding == Encoding::Ascii {
            self.bytes.push(b'\n');
        }
    }
}

pub fn write(mesh: &Mesh, encoding: Encoding, Types(number, count, index): Types) -> Vec<u8> {
    let format = match encoding {
        Encoding::Ascii => "ascii",
        Encoding::Little => "binary_little_endian",
        Encoding::Big => "binary_big_endian",
    };
    let mut header = format!(
        "ply\nformat {format} 1.0\nelement vertex {}\n",
        mesh.positions.len()
    );
    let mut names = vec!["x", "y", "z"];
    if mesh.normals.is_some() {
        names.extend(["nx", "ny", "nz"]);
    }
    if mesh.uvs.is_some() {
        names.extend(["u", "v"]);
    }
    for name in names {
        header += &format!("property {number} {name}\n");
    }
    header += &format!(
        "element face {}\nproperty list {count} {index} vertex_indices\nend_header\n",
        mesh.indices.len()
    );
    let mut out = Out {
        bytes: header.into_bytes(),
        encoding,
    };
    for i in 0..mesh.positions.len() {
        let normal = mesh.normals.iter().flat_map(|n| n[i]);
        let uv = mesh.uvs.iter().flat_map(|n| n[i]);
        for x in mesh.positions[i].into_iter().chain(normal).chain(uv) {
            out.put(number, f64::from(x));
        }
        out.end_line();
    }
    for triangle in &mesh.indices {
        out.put(count, 3.0);
        for &i in triangle {
            out.put(index, f64::from(i));
        }
        out.end_line();
    }
    out.bytes
}
