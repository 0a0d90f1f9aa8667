//! Meshes and their places.

mod common;

use common::{Builder, mesh, parse_error};
use resolvent_gltf::{Model, expand};
use resolvent_scene::{Geometry, Scene};
use serde_json::json;

fn close(a: [f64; 3], b: [f64; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6)
}

/// Scale, then rotation, then translation, then the parent's.
#[test]
fn nodes_place_meshes() {
    let mut b = Builder::new();
    let cube = b.cube();
    let half = 0.5f64.sqrt();
    b.push(
        "nodes",
        json!({"children": [1, 2], "translation": [10, 0, 0], "scale": [2, 2, 2]}),
    );
    // A quarter turn around y takes x to −z and z to x.
    b.push("nodes", json!({
        "mesh": cube, "rotation": [0, half, 0, half], "scale": [1, 3, 1], "translation": [0, 0, 1]
    }));
    // The same as a matrix, column by column.
    b.push(
        "nodes",
        json!({"mesh": cube, "matrix": [0,0,-1,0, 0,3,0,0, 1,0,0,0, 0,0,1,1]}),
    );
    let model = b.read();
    assert_eq!(model.meshes.len(), 1);
    assert_eq!((model.meshes[0].places.len(), model.triangles()), (2, 24));
    for place in &model.meshes[0].places {
        // (1, 1, 0.5) → (1, 3, 0.5) → (0.5, 3, −1) → (0.5, 3, 0) → (11, 6, 0)
        assert!(
            close(place.point([1.0, 1.0, 0.5]), [11.0, 6.0, 0.0]),
            "{place:?}"
        );
    }
    let [lo, hi] = model.bounds().unwrap();
    assert!(
        close(lo, [8.0, -6.0, 0.0]) && close(hi, [12.0, 6.0, 4.0]),
        "{lo:?} {hi:?}"
    );
}

#[test]
fn a_box_has_its_faces_outside() {
    let mut b = Builder::new();
    let cube = b.cube();
    b.push("nodes", json!({"mesh": cube}));
    let model = b.read();
    let m = mesh(&model.meshes[0].shapes[0]);
    assert_eq!(
        (m.positions.len(), m.indices.len(), m.normals.len()),
        (24, 12, 24)
    );
    for t in &m.indices {
        let [a, b, c] = t.map(|i| m.positions[i as usize]);
        let (u, v) = (
            [0, 1, 2].map(|k| b[k] - a[k]),
            [0, 1, 2].map(|k| c[k] - a[k]),
        );
        let n = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        let stated = m.normals[t[0] as usize];
        assert!(close(n.map(|x| x / 4.0), stated), "{n:?} {stated:?}");
    }
}

/// Strips turn every second triangle round; fans go round their first vertex. All faces look the same way.
#[test]
fn strips_and_fans() {
    let strip = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0., 0., 2., 0.];
    let fan = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., -1., 1., 0.];
    for (mode, points, area) in [(5, strip, 1.5), (6, fan, 1.5), (4, strip, 0.5)] {
        let mut b = Builder::new();
        let p = b.floats(&points, 3);
        let mesh_index = b.push(
            "meshes",
            json!({"primitives": [{"attributes": {"POSITION": p}, "mode": mode}]}),
        );
        b.push("nodes", json!({"mesh": mesh_index}));
        let model = b.read();
        let m = mesh(&model.meshes[0].shapes[0]);
        let mut sum = 0.0;
        for t in &m.indices {
            let [a, b, c] = t.map(|i| m.positions[i as usize]);
            let twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            assert!(twice > 0.0, "mode {mode}: {t:?}");
            sum += 0.5 * twice;
        }
        assert_eq!(sum, area, "mode {mode}");
    }
}

#[test]
fn points_and_lines_are_listed() {
    let mut b = Builder::new();
    let cube = b.cube();
    let p = b.floats(&[0.0; 9], 3);
    b.push(
        "meshes",
        json!({"primitives": [
            {"attributes": {"POSITION": p}, "mode": 1}, {"attributes": {"POSITION": p}, "mode": 0}
        ]}),
    );
    b.push("nodes", json!({"mesh": cube, "children": [1]}));
    b.push("nodes", json!({"mesh": 1}));
    let model = b.read();
    assert_eq!(model.meshes.len(), 1);
    let text = model.warnings.join("\n");
    for part in ["meshes[1].primitives[0]: Lines", "primitives[1]: Points"] {
        assert!(text.contains(part), "{text}");
    }
}

/// Strided, normalized and sparse accessors.
#[test]
fn accessors_of_all_kinds() {
    let mut b = Builder::new();
    // Positions 20 bytes apart with junk between, and one replaced.
    let mut bytes = Vec::new();
    for p in [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [9.0, 9.0, 9.0]] {
        bytes.extend(p.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0xff; 8]);
    }
    let view = b.view(&bytes);
    b.json["bufferViews"][view]["byteStride"] = json!(20);
    let at = b.view(&[2, 0, 0, 0]);
    let values: Vec<u8> = [0.0f32, 1.0, 0.0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let new = b.view(&values);
    let positions = b.push("accessors", json!({
        "bufferView": view, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0,0,0], "max": [9,9,9],
        "sparse": {
            "count": 1, "indices": {"bufferView": at, "componentType": 5121}, "values": {"bufferView": new}
        }
    }));
    // Coordinates of 16 bits: 0, 1 and 0.5 up to half a step.
    let uvs: Vec<u8> = [0u16, 0, 65_535, 0, 32_768, 65_535]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let uvs = b.view(&uvs);
    let uvs = b.push(
        "accessors",
        json!({
            "bufferView": uvs, "componentType": 5123, "normalized": true, "count": 3, "type": "VEC2"
        }),
    );
    // Normals of 8 bits, signed: −128 is −1, too; every element on its own four bytes.
    let normals = b.view(&[0, 0, 127, 0, 0, 0, 127, 0, 0x80, 0, 0, 0]);
    b.json["bufferViews"][normals]["byteStride"] = json!(4);
    let normals = b.push("accessors", json!({
        "bufferView": normals, "componentType": 5120, "normalized": true, "count": 3, "type": "VEC3"
    }));
    let m = b.push(
        "meshes",
        json!({"primitives": [{"attributes": {
            "POSITION": positions, "TEXCOORD_0": uvs, "NORMAL": normals
        }}]}),
    );
    b.push("nodes", json!({"mesh": m}));
    let model = b.read();
    let m = mesh(&model.meshes[0].shapes[0]);
    assert_eq!(
        m.positions,
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    );
    assert_eq!(
        m.normals,
        [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]
    );
    // v is turned upwards.
    assert_eq!(m.uvs, [[0.0, 1.0], [1.0, 1.0], [32_768.0 / 65_535.0, 0.0]]);
}

/// A primitive takes the vertices it uses out of a large set.
#[test]
fn vertices_that_are_not_used_are_left_out() {
    let mut b = Builder::new();
    let points: Vec<f32> = (0..3000u16).map(f32::from).collect();
    let p = b.floats(&points, 3);
    let i = b.indices(&[7, 500, 999]);
    let m = b.push(
        "meshes",
        json!({"primitives": [{"attributes": {"POSITION": p}, "indices": i}]}),
    );
    b.push("nodes", json!({"mesh": m}));
    let model = b.read();
    let m = mesh(&model.meshes[0].shapes[0]);
    assert_eq!(
        m.positions,
        [
            [21.0, 22.0, 23.0],
            [1500.0, 1501.0, 1502.0],
            [2997.0, 2998.0, 2999.0]
        ]
    );
    assert_eq!(m.indices, [[0, 1, 2]]);
}

const SCENE: &str = r#"{"resolvent": 1,
  "camera": {"type": "perspective", "origin": [0, 0, 5], "target": [0, 0, 0], "fov_x_deg": 40},
  "materials": {"clay": {"plugin": "diffuse"}},
  "shapes": [
    {"type": "gltf", "file": "models/a.glb", "transform": [{"translate": [0, 0, -100]}]},
    {"type": "gltf", "file": "models/a.glb", "material": "clay"},
    {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "clay"}
  ]}"#;

/// In a scene a mesh shown once is a mesh, one shown more often a prototype and its instances, with the shape's transform
/// after the node's; materials come along once.
#[test]
fn models_expand_in_scenes() {
    let folder = std::env::temp_dir().join(format!("resolvent-gltf-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("models")).unwrap();
    let mut b = Builder::new();
    let image = b.push("images", json!({"uri": "maps/a%20b.png"}));
    let texture = b.push("textures", json!({"source": image}));
    let paint = b.push(
        "materials",
        json!({
            "name": "paint", "pbrMetallicRoughness": {"baseColorTexture": {"index": texture}}
        }),
    );
    let (square, cube) = (b.square(Some(paint)), b.cube());
    b.push("nodes", json!({"mesh": square, "children": [1, 2]}));
    b.push("nodes", json!({"mesh": cube, "translation": [1, 0, 0]}));
    b.push("nodes", json!({"mesh": cube, "translation": [2, 0, 0]}));
    std::fs::write(folder.join("models/a.glb"), b.glb()).unwrap();
    let mut scene = Scene::parse(SCENE.as_bytes(), folder.join("scene.json")).unwrap();
    assert!(resolvent_gltf::has_models(&scene));
    let warnings = expand(&mut scene).unwrap_or_else(|e| panic!("{e}"));
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(warnings, Vec::<String>::new());
    assert!(!resolvent_gltf::has_models(&scene));
    // Two squares and the sphere; two times two boxes.
    assert_eq!(
        (
            scene.shapes.len(),
            scene.prototypes.len(),
            scene.instances.len()
        ),
        (3, 2, 4)
    );
    let Geometry::Mesh(first) = &scene.shapes[0].geometry else {
        panic!()
    };
    assert_eq!(first.transform.point([0.0; 3]), [0.0, 0.0, -100.0]);
    assert_eq!(
        scene.instances[1].transform.point([0.0; 3]),
        [2.0, 0.0, -100.0]
    );
    assert_eq!(
        scene.instances[3].transform.point([0.0; 3]),
        [2.0, 0.0, 0.0]
    );
    assert_eq!(
        scene.shapes[0].material.as_deref(),
        Some("a.glb: material 0 paint")
    );
    assert_eq!(scene.shapes[1].material.as_deref(), Some("clay"));
    assert_eq!(scene.instances[3].material.as_deref(), Some("clay"));
    assert_eq!(
        scene.materials.len(),
        3,
        "clay, paint and the boxes' default: {:?}",
        scene.materials
    );
    // Images are named from the scene's folder.
    let image = &scene.textures["a.glb: material 0 paint base color"].image;
    assert_eq!(
        *image,
        resolvent_scene::ImageSource::File("models/maps/a b.png".into())
    );
    // What came out is a scene by the format's own rules.
    scene.to_text().unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn damage_is_named_with_its_place() {
    let with = |edit: &dyn Fn(&mut Builder)| {
        let mut b = Builder::new();
        let cube = b.cube();
        b.push("nodes", json!({"mesh": cube}));
        b.read();
        edit(&mut b);
        b.error()
    };
    for (edit, expected) in [
        (
            &(|b: &mut Builder| b.json["accessors"][0]["count"] = json!(25))
                as &dyn Fn(&mut Builder),
            "accessors[0]",
        ),
        (
            &|b| b.json["accessors"][0]["count"] = json!(u64::MAX),
            "accessors[0]",
        ),
        (
            &|b| b.json["accessors"][0]["byteOffset"] = json!(4),
            "beyond the end of its buffer view",
        ),
        (
            &|b| b.json["bufferViews"][1]["byteLength"] = json!(1_000_000),
            "bufferViews[1]",
        ),
        (
            &|b| b.json["bufferViews"][1]["byteOffset"] = json!(u64::MAX),
            "bufferViews[1]",
        ),
        (
            &|b| b.json["accessors"][2]["componentType"] = json!(5126),
            "accessors[2]",
        ),
        (
            &|b| b.json["accessors"][0]["type"] = json!("VEC2"),
            "accessors[0]",
        ),
        (&|b| b.json["nodes"][0]["mesh"] = json!(7), "damaged"),
        (
            &|b| b.json["nodes"][0]["children"] = json!([0]),
            "its own ancestor",
        ),
        (
            &|b| b.bin[4..8].copy_from_slice(&f32::NAN.to_le_bytes()),
            "no number",
        ),
        (
            &|b| {
                let end = b.bin.len() - 2;
                b.bin[end..].copy_from_slice(&[24, 0])
            },
            "names vertex 24 of 24",
        ),
        (
            &|b| b.json["buffers"][0]["uri"] = json!("none.bin"),
            "folder/none.bin: ",
        ),
        (
            &|b| b.json["buffers"][0]["uri"] = json!("https://example.org/a.bin"),
            "only files and data URIs",
        ),
        (
            &|b| b.json["buffers"][0]["uri"] = json!("data:;base64,*"),
            "damaged data URI",
        ),
        (
            &|b| b.json["accessors"][0]["bufferView"] = json!(null),
            "accessors[0]",
        ),
    ] {
        let text = with(edit);
        assert!(text.contains(expected), "{expected}: {text}");
    }
    assert!(parse_error(b"glTF\x01\0\0\0\0\0\0\0").contains("GLB version 1"));
    assert!(parse_error(b"glTF\x02\0\0\0\x0c\0\0\0").contains("ends at byte 12"));
    assert!(parse_error(b"{\"asset\": 1}").contains("no glTF 2.0"));
    assert!(parse_error(b"[").contains("no JSON"));
}

/// Many primitives that share one large accessor must not make a huge scene of a small file.
#[test]
fn shared_data_is_bounded() {
    let mut b = Builder::new();
    let points = vec![1.0f32; 3 * 30_000];
    let p = b.floats(&points, 3);
    let primitive = json!({"attributes": {"POSITION": p}});
    b.push("meshes", json!({"primitives": vec![primitive; 2000]}));
    b.push("nodes", json!({"mesh": 0}));
    assert!(b.error().contains("more triangles than a file of its size"));
}

#[test]
fn buffers_in_data_uris_and_plain_json() {
    let mut b = Builder::new();
    let cube = b.cube();
    b.push("nodes", json!({"mesh": cube}));
    use base64::Engine;
    let data = base64::engine::general_purpose::STANDARD.encode(&b.bin);
    let mut json = b.json.clone();
    json["buffers"] = json!([{
        "byteLength": b.bin.len(), "uri": format!("data:application/octet-stream;base64,{data}")
    }]);
    let model = Model::parse(json.to_string().as_bytes(), "box.gltf").unwrap();
    assert_eq!(model.bounds(), Some([[-1.0; 3], [1.0; 3]]));
    // Without a scene, nodes that are nobody's children are shown.
    let object = json.as_object_mut().unwrap();
    object.remove("scenes");
    object.remove("scene");
    let model = Model::parse(json.to_string().as_bytes(), "box.gltf").unwrap();
    assert_eq!(model.triangles(), 12);
}
