//! Damaged and hostile files: an error with the right place, never a panic or a hang.

mod writer;

use resolvent_ply::{Mesh, Place, parse};
use writer::{Encoding, Types, write};

/// Parses and checks what holds for every file.
fn check(bytes: &[u8]) -> Result<Mesh, resolvent_ply::Fault> {
    let result = parse(bytes);
    match &result {
        Ok(mesh) => {
            let n = mesh.positions.len();
            let capacity = 12 * (mesh.positions.capacity() + mesh.indices.capacity());
            assert!(
                capacity <= 30 * bytes.len(),
                "{capacity} bytes for a file of {}",
                bytes.len()
            );
            assert!(mesh.indices.iter().flatten().all(|&i| (i as usize) < n));
            assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()));
            assert!(
                mesh.normals
                    .iter()
                    .all(|v| v.len() == n && v.iter().flatten().all(|x| x.is_finite()))
            );
            assert!(
                mesh.uvs
                    .iter()
                    .all(|v| v.len() == n && v.iter().flatten().all(|x| x.is_finite()))
            );
        }
        Err(fault) => match fault.place {
            Place::Line(line) => {
                let lines = bytes.iter().filter(|&&b| b == b'\n').count() as u64 + 1;
                assert!((1..=lines).contains(&line), "{fault}");
            }
            Place::Byte(byte) => assert!(byte <= bytes.len() as u64, "{fault}"),
        },
    }
    result
}

fn file(vertices: &str, faces: &str, data: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n{data}"
    )
}

#[test]
fn errors_say_where_and_why() {
    let good = file("3", "1", "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    assert!(check(good.as_bytes()).is_ok());
    let cases = [
        (
            String::new(),
            "line 1: not a PLY file: it starts with \"\" instead of \"ply\"",
        ),
        (
            "ply".into(),
            "line 1: not a PLY file: it starts with \"ply\" instead of \"ply\"",
        ),
        (
            "\u{1b}[2J\nply".into(),
            "line 1: not a PLY file: it starts with \"\\u{1b}[2J\" instead of \"ply\"",
        ),
        (
            "ply\nformat ascii 1.0\n".into(),
            "line 3: the file ends within the header, before \"end_header\"",
        ),
        (
            "ply\nend_header\n".into(),
            "line 2: the header has no \"format\" line",
        ),
        (
            "ply\nformat ascii 2.0\n".into(),
            "line 2: format version \"2.0\" instead of 1.0",
        ),
        (
            "ply\nformat text 1.0\n".into(),
            "line 2: format \"text\" instead of ascii, binary_little_endian or binary_big_endian",
        ),
        (
            "ply\nproperty float x\n".into(),
            "line 2: a property before the first element",
        ),
        (
            "ply\nelement vertex -1\n".into(),
            "line 2: element \"vertex\" has count \"-1\"",
        ),
        (
            "ply\nelement a 1\nelement a 1\n".into(),
            "line 3: a second element \"a\"",
        ),
        (
            "ply\nelement a 1\nproperty half x\n".into(),
            "line 3: unknown property type \"half\"",
        ),
        (
            "ply\nelement a 1\nproperty list float int x\n".into(),
            "line 3: the count of a list property is not of an integer type",
        ),
        (
            "ply\nelement a 1\nproperty int\n".into(),
            "line 3: a property without a name",
        ),
        (
            "ply\nelements\n".into(),
            "line 2: \"elements\" instead of format, element, property, comment, obj_info or end_header",
        ),
        (
            good.replace("float z", "float w"),
            "line 3: element \"vertex\" lacks the scalar properties x, y and z",
        ),
        (
            good.replace("float z", "list uchar float z"),
            "line 3: element \"vertex\" lacks the scalar properties x, y and z",
        ),
        (
            good.replace("vertex_indices", "indices"),
            "line 7: element \"face\" lacks the list property vertex_indices or vertex_index",
        ),
        (
            good.replace("uchar int", "uchar float"),
            "line 7: the vertex indices of faces are not of an integer type",
        ),
        (
            good.replace("element face", "element tristrips"),
            "line 7: triangle strips are not supported; convert them to faces",
        ),
        (
            good.replace("element face", "element mesh"),
            "line 9: the header declares no element \"face\"",
        ),
        (
            good.replace("element vertex", "element point"),
            "line 9: the header declares no element \"vertex\"",
        ),
        (
            good.replace("1 0 0", "1 zero 0"),
            "line 11: \"zero\" where a value of type float is due",
        ),
        (
            good.replace("1 0 0", "1 nan 0"),
            "line 11: \"y\" of vertex 1 is NaN; not a finite f32",
        ),
        (
            good.replace("1 0 0", "1 0 1e39"),
            "line 11: \"z\" of vertex 1 is 1000000000000000000000000000000000000000; not a finite f32",
        ),
        (
            good.replace("3 0 1 2", "3 0 1 3"),
            "line 13: face 0 refers to vertex 3, but there are 3 vertices",
        ),
        (
            good.replace("3 0 1 2", "3 0 1 -1"),
            "line 13: face 0 refers to vertex -1, but there are 3 vertices",
        ),
        (
            good.replace("3 0 1 2", "3 0 1 2.0"),
            "line 13: \"2.0\" where a value of type int is due",
        ),
        (
            good.replace("3 0 1 2", "2 0 1"),
            "line 13: face 0 has 2 vertices; at least 3 are needed",
        ),
        (
            good.replace("3 0 1 2", "200 0 1 2"),
            "line 13: a list of 200 values in the last 7 bytes of the file",
        ),
        (
            good.replace("3 0 1 2", "3 0 1"),
            "line 14: the file ends within the data",
        ),
        (
            good.replace("vertex 3", "vertex 1000000000000000000"),
            "line 14: the file ends within the data",
        ),
        (
            good.replace("face 1", "face 99999999999999999999"),
            "line 7: element \"face\" has count \"99999999999999999999\"",
        ),
    ];
    for (text, expected) in cases {
        let error = check(text.as_bytes()).unwrap_err().to_string();
        assert_eq!(error, expected, "{text}");
    }
    let long = format!("ply\n{}\n", "x".repeat(100_000));
    assert!(check(long.as_bytes()).unwrap_err().to_string().len() < 200);
}

#[test]
fn binary_errors_name_bytes() {
    let mesh = Mesh {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        colors: None,
        indices: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    for encoding in [Encoding::Little, Encoding::Big] {
        let good = write(&mesh, encoding, Types::SMALL);
        let data = good.len() - 3 * 12 - 13;
        let mut bad = good.clone();
        bad[data + 12..data + 16].fill(0xff);
        assert_eq!(
            check(&bad).unwrap_err().to_string(),
            format!(
                "byte {}: \"x\" of vertex 1 is NaN; not a finite f32",
                data + 12
            )
        );
        let mut bad = good.clone();
        bad[data + 36] = 255;
        let expected = format!(
            "byte {}: a list of 255 values in the last 12 bytes of the file",
            data + 36
        );
        assert_eq!(check(&bad).unwrap_err().to_string(), expected);
        let mut bad = good.clone();
        bad[data + 37..data + 41].fill(9);
        let expected = format!(
            "byte {}: face 0 refers to vertex 151587081, but there are 3 vertices",
            data + 37
        );
        assert_eq!(check(&bad).unwrap_err().to_string(), expected);
        for end in data..good.len() {
            let fault = check(&good[..end]).unwrap_err();
            assert!(
                matches!(fault.place, Place::Byte(b) if b >= data as u64),
                "{fault}"
            );
        }
    }
}

/// Counts that promise more than the file holds are refused in no time. (Reserving what they promise would abort.)
#[test]
fn lying_counts() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for count in ["4000000000", "18446744073709551615", "1000000000000000000"] {
            for element in [
                "vertex N\nproperty float x\nproperty float y\nproperty float z\nelement face 0",
                "vertex 0\nproperty char x\nproperty char y\nproperty char z\nelement face N\nproperty list uchar uchar vertex_indices",
                "junk N\nproperty double a\nelement vertex 0\nproperty char x\nproperty char y\nproperty char z\nelement face 0",
                "junk N\nproperty list uint double a\nelement vertex 0\nproperty char x\nproperty char y\nproperty char z\nelement face 0",
            ] {
                let text = format!(
                    "ply\nformat {format} 1.0\nelement {}\nend_header\n1 1 1 1",
                    element.replace('N', count)
                );
                assert!(check(text.as_bytes()).is_err(), "{text}");
            }
        }
    }
}

fn random(state: &mut u64) -> usize {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z >> 33) as usize
}

/// Cut, overwritten, copied and deleted pieces of good files.
#[test]
fn mutations() {
    let mut mesh = Mesh::default();
    for i in 0..40u32 {
        mesh.positions.push([i as f32, (i * i) as f32 * 0.1, -1.5]);
        mesh.indices.push([i, (i + 1) % 40, (i + 7) % 40]);
    }
    mesh.normals = Some(mesh.positions.clone());
    mesh.uvs = Some(mesh.positions.iter().map(|p| [p[0], p[1]]).collect());
    let words: [&[u8]; 12] = [
        b"list uchar int",
        b"4294967295",
        b"-1",
        b"1e400",
        b"nan",
        b"element face 9\n",
        b"property list int double v\n",
        b"end_header\n",
        b"\xff\xff\xff\xff",
        b"\0\0\0\0",
        b"binary_big_endian",
        b"18446744073709551615",
    ];
    let mut state = 1;
    let (mut read, mut refused) = (0, 0);
    for encoding in [Encoding::Ascii, Encoding::Little, Encoding::Big] {
        for types in [Types::SMALL, Types::LARGE, Types::SIGNED] {
            let good = write(&mesh, encoding, types);
            for length in 0..good.len().min(600) {
                let _ = check(&good[..length]);
            }
            for _ in 0..3000 {
                let mut bytes = good.clone();
                for _ in 0..=random(&mut state) % 3 {
                    // Half of the changes go to the header.
                    let span = if random(&mut state).is_multiple_of(2) {
                        bytes.len().min(250)
                    } else {
                        bytes.len()
                    };
                    let at = random(&mut state) % span.max(1);
                    let end = (at + random(&mut state) % 12).min(bytes.len());
                    match random(&mut state) % 5 {
                        0 => bytes.truncate(at),
                        1 if at < bytes.len() => bytes[at] ^= 1 << (random(&mut state) % 8),
                        2 => drop(bytes.drain(at.min(end)..end)),
                        3 => {
                            let piece = bytes[at.min(end)..end].to_vec();
                            bytes.splice(at.min(end)..at.min(end), piece);
                        }
                        _ => {
                            let word = words[random(&mut state) % words.len()];
                            bytes.splice(at.min(end)..end, word.iter().copied());
                        }
                    }
                }
                match check(&bytes) {
                    Ok(_) => read += 1,
                    Err(_) => refused += 1,
                }
            }
        }
    }
    assert!(
        read > 1000 && refused > 10_000,
        "{read} read, {refused} refused"
    );
}

/// More elements than anybody has time to compare with each other.
#[test]
fn many_elements() {
    const ELEMENTS: usize = 400_000;
    let good = file("3", "1", "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    let more: String = (0..ELEMENTS)
        .map(|i| format!("element e{i:06} 0\n"))
        .collect();
    let with = |last: &str| good.replace("end_header", &format!("{more}{last}end_header"));
    assert_eq!(check(with("").as_bytes()).unwrap().indices.len(), 1);
    let fault = check(with("element e000007 0\n").as_bytes()).unwrap_err();
    assert!(
        fault.to_string().contains("a second element \"e000007\""),
        "{fault}"
    );
}
