//! Well-formed files: round trips through every encoding, and what real exporters write.

mod writer;

use resolvent_ply::{Mesh, parse};
use writer::{Encoding, Types, write};

fn sample() -> Mesh {
    Mesh {
        positions: vec![
            [0.0, 0.5, -1.25],
            [1e-30, 3e8, 0.1],
            [7.0, 8.0, 9.0],
            [-0.0, 1.0, f32::MIN_POSITIVE],
        ],
        normals: Some(vec![
            [0.0, 0.0, 1.0],
            [0.6, 0.8, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, -3.0, 4.0],
        ]),
        uvs: Some(vec![[0.0, 1.0], [0.25, 0.75], [-2.0, 3.5], [1.0, 0.0]]),
        colors: None,
        indices: vec![[0, 1, 2], [2, 1, 3], [3, 0, 2]],
    }
}

const ENCODINGS: [Encoding; 3] = [Encoding::Ascii, Encoding::Little, Encoding::Big];

#[test]
fn round_trips() {
    for encoding in ENCODINGS {
        for types in [Types::SMALL, Types::LARGE, Types::SIGNED] {
            for (normals, uvs) in [(true, true), (true, false), (false, true), (false, false)] {
                let mut mesh = sample();
                mesh.normals = mesh.normals.filter(|_| normals);
                mesh.uvs = mesh.uvs.filter(|_| uvs);
                let bytes = write(&mesh, encoding, types);
                assert_eq!(parse(&bytes), Ok(mesh), "{encoding:?} {types:?}");
            }
        }
    }
}

/// Integers are encoded fractions, floating-point numbers linear as they are.
#[test]
fn colours_of_vertices() {
    let file = |kind: &str, names: [&str; 4], values: &str| {
        let [r, g, b, a] = names;
        let alpha = if a.is_empty() {
            String::new()
        } else {
            format!("property {kind} {a}\n")
        };
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty {kind} {r}\nproperty {kind} {g}\n\
             property float y\nproperty {kind} {b}\n{alpha}property float z\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n{values}3 0 1 2\n"
        )
    };
    let names = ["red", "green", "blue", "alpha"];
    let text = file(
        "uchar",
        names,
        "0 0 255 0 188 51 0\n1 255 0 0 0 255 0\n0 0 0 1 0 0 0\n",
    );
    let mesh = parse(text.as_bytes()).unwrap();
    let colors = mesh.colors.unwrap();
    assert_eq!(colors[1], [1.0, 0.0, 0.0, 1.0]);
    let [r, g, b, a] = colors[0];
    assert!((r, g) == (0.0, 1.0) && (a - 0.2).abs() < 1e-7);
    // 188 is encoded one half, as IEC 61966-2-1's table has it.
    assert!((b - 0.502_886_5).abs() < 1e-6, "{b}");
    assert_eq!(mesh.positions[2], [0.0, 1.0, 0.0]);
    let text = file(
        "float",
        ["r", "g", "b", ""],
        "0 0.25 2 0 0.5 0\n1 0 0 0 0 0\n0 0 0 1 0 0\n",
    );
    let colors = parse(text.as_bytes()).unwrap().colors.unwrap();
    assert_eq!(colors[0], [0.25, 2.0, 0.5, 1.0]);
    let error = parse(text.replace("0.25", "-1").as_bytes()).unwrap_err();
    assert!(
        error.to_string().contains("a colour is at least 0"),
        "{error}"
    );
    // Two of the three are none.
    let text = text.replace("float b\n", "float w\n");
    assert_eq!(parse(text.as_bytes()).unwrap().colors, None);
}

#[test]
fn names_of_texture_coordinates() {
    let text = String::from_utf8(write(&sample(), Encoding::Ascii, Types::SMALL)).unwrap();
    for (a, b) in [
        ("s", "t"),
        ("texture_u", "texture_v"),
        ("texture_s", "texture_t"),
    ] {
        let renamed = text
            .replace("float u\n", &format!("float {a}\n"))
            .replace("float v\n", &format!("float {b}\n"));
        assert_eq!(parse(renamed.as_bytes()), Ok(sample()));
    }
    // One of the two is none.
    let half = text.replace("float v\n", "float w\n");
    assert_eq!(parse(half.as_bytes()).unwrap().uvs, None);
}

/// Comments, carriage returns, other elements and properties before, between and after, values over several lines.
#[test]
fn what_exporters_write() {
    let text = "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nobj_info none\r\n\
        element camera 2\r\nproperty float fov\r\nproperty list uchar float matrix\r\n\
        element vertex 5\r\nproperty uchar red\r\nproperty double y\r\nproperty list uchar int tags\r\nproperty float x\r\n\
        property int z\r\nproperty float confidence\r\n\
        element face 2\r\nproperty uchar flags\r\nproperty list uchar uint vertex_index\r\nproperty list uchar float texcoord\r\n\
        element nothing 1000000000000000000\r\n\
        element edge 1\r\nproperty int a\r\nproperty int b\r\nend_header\r\n\
        45 3 1 2 3\r\n30 0\r\n\
        255 0 2 7 8 0 0 1\r\n0 0.5 0 1e0 0 1\r\n0 1 1 9 1 0 1 0 1.5 0 -0.5 1 1\r\n  0 0 0 -1\n 3 1\r\n\r\n\
        1 5 0 1 2 3 4 6 0 0 1 1 0 1\r\n0 3 2 1 0 0\r\n\
        1 2\r\n";
    let mesh = parse(text.as_bytes()).unwrap();
    let expected = [
        [0.0, 0.0, 0.0],
        [1.0, 0.5, 0.0],
        [1.0, 1.0, 0.0],
        [-0.5, 1.5, 1.0],
        [-1.0, 0.0, 3.0],
    ];
    assert_eq!(mesh.positions, expected);
    assert_eq!(mesh.indices, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [2, 1, 0]]);
    assert_eq!((mesh.normals, mesh.uvs), (None, None));
}

#[test]
fn binary_elements_are_passed_over() {
    let mut bytes = b"ply\nformat binary_little_endian 1.0\n\
        element blob 3\nproperty double a\nproperty char b\n\
        element lists 2\nproperty list ushort short c\n\
        element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list int int vertex_indices\nend_header\n"
        .to_vec();
    bytes.extend([0xff; 27]);
    bytes.extend([2, 0, 1, 1, 2, 2, 0, 0]);
    for x in [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        bytes.extend(x.to_le_bytes());
    }
    for i in [3i32, 0, 1, 2] {
        bytes.extend(i.to_le_bytes());
    }
    let mesh = parse(&bytes).unwrap();
    assert_eq!(
        mesh.positions,
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    );
    assert_eq!(mesh.indices, [[0, 1, 2]]);
    // Bytes after the last element do not matter.
    bytes.extend([1, 2, 3]);
    assert_eq!(parse(&bytes).unwrap(), mesh);
}

#[test]
fn faces_before_vertices() {
    let text = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\n\
        element vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n3 0 1 2\n0 0 0 1 0 0 0 1 0";
    assert_eq!(parse(text.as_bytes()).unwrap().indices, [[0, 1, 2]]);
    let error = parse(text.replace("3 0 1 2", "3 0 1 3").as_bytes()).unwrap_err();
    assert_eq!(
        error.reason,
        "a face refers to vertex 3, but there are 3 vertices"
    );
}

#[test]
fn empty_meshes() {
    for encoding in ENCODINGS {
        let mesh = Mesh::default();
        assert_eq!(parse(&write(&mesh, encoding, Types::SMALL)), Ok(mesh));
    }
}

#[test]
fn reads_files_and_names_them() {
    let path = std::env::temp_dir().join(format!("resolvent-ply-{}.ply", std::process::id()));
    std::fs::write(&path, write(&sample(), Encoding::Little, Types::SMALL)).unwrap();
    assert_eq!(resolvent_ply::read(&path).unwrap(), sample());
    std::fs::write(&path, "solid").unwrap();
    let error = resolvent_ply::read(&path).unwrap_err().to_string();
    let expected = ": line 1: not a PLY file: it starts with \"solid\" instead of \"ply\"";
    assert_eq!(error, format!("{}{expected}", path.display()));
    std::fs::remove_file(&path).unwrap();
    let error = resolvent_ply::read(&path).unwrap_err().to_string();
    assert!(error.starts_with(&path.display().to_string()), "{error}");
    let endless = resolvent_ply::read("/dev/zero").unwrap_err().to_string();
    assert!(endless.contains("not a regular file"), "{endless}");
}
