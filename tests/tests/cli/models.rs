//! glTF models through the whole program.

use crate::program::{Run, folder, json, mean, picture, render};
use resolvent_image::Image;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// A model of squares from −1 to 1 that face +z, one for each material and translation given; the first image is `png`.
fn squares(parts: &[(Value, [f32; 3])], png: Option<&[u8]>) -> (Value, Vec<u8>) {
    let floats = |all: &[f32]| {
        all.iter()
            .flat_map(|x| x.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let mut bin = floats(&[-1., -1., 0., 1., -1., 0., 1., 1., 0., -1., 1., 0.]);
    bin.extend(floats(&[0., 1., 1., 1., 1., 0., 0., 0.]));
    bin.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|x| x.to_le_bytes()));
    let mut model = json!({
        "asset": {"version": "2.0"}, "scene": 0,
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 32},
            {"buffer": 0, "byteOffset": 80, "byteLength": 12},
        ],
        "materials": parts.iter().map(|p| p.0.clone()).collect::<Vec<_>>(),
        "meshes": (0..parts.len()).map(|i| json!({"primitives": [{
            "attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": i
        }]})).collect::<Vec<_>>(),
        "nodes": parts.iter().enumerate().map(|(i, p)| json!({"mesh": i, "translation": p.1})).collect::<Vec<_>>(),
        "scenes": [{"nodes": (0..parts.len()).collect::<Vec<_>>()}],
    });
    if let Some(png) = png {
        let view = json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": png.len()});
        let views = model["bufferViews"].as_array_mut();
        views.unwrap_or_else(|| panic!("no views")).push(view);
        bin.extend(png);
        model["images"] = json!([{"bufferView": 3, "mimeType": "image/png"}]);
        model["textures"] = json!([{"source": 0, "sampler": 0}]);
        model["samplers"] = json!([{"magFilter": 9728}]);
    }
    model["buffers"] = json!([{"byteLength": bin.len()}]);
    (model, bin)
}

/// Adds a node; the scene shows it.
fn add_node(model: &mut Value, node: Value) {
    let nodes = model["nodes"]
        .as_array_mut()
        .unwrap_or_else(|| panic!("no nodes"));
    nodes.push(node);
    let last = nodes.len() - 1;
    let shown = model["scenes"][0]["nodes"].as_array_mut();
    shown
        .unwrap_or_else(|| panic!("no scene"))
        .push(json!(last));
}

fn write_glb(path: &Path, (model, bin): &(Value, Vec<u8>)) {
    let mut text = model.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bin = bin.clone();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((28 + text.len() as u32 + bin.len() as u32).to_le_bytes());
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(text);
    out.extend((bin.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(bin);
    std::fs::write(path, out).unwrap_or_else(|e| panic!("{e}"));
}

/// 2 × 2 texels: red and green above, blue and grey below.
fn png() -> Vec<u8> {
    use image::ImageEncoder;
    let mut out = Vec::new();
    let rgb = [255, 0, 0, 0, 255, 0, 0, 0, 255, 128, 128, 128];
    image::codecs::png::PngEncoder::new(&mut out)
        .write_image(&rgb, 2, 2, image::ExtendedColorType::Rgb8)
        .unwrap_or_else(|e| panic!("{e}"));
    out
}

/// A camera that sees a square at the origin from edge to edge, from 4 away.
fn add_camera(model: &mut Value) {
    let yfov = 2.0 * 0.25f64.atan();
    model["cameras"] = json!([{"name": "front", "type": "perspective", "perspective": {
        "yfov": yfov, "aspectRatio": 1.0, "znear": 0.1
    }}]);
    add_node(model, json!({"camera": 0, "translation": [0, 0, 4]}));
}

fn quarters(image: &Image) -> [[f32; 3]; 4] {
    let rgb = image.color().unwrap_or_else(|| panic!("no colour"));
    let (w, h) = (image.width, image.height);
    [(1, 1), (3, 1), (1, 3), (3, 3)].map(|(x, y)| {
        let pixel = y * h / 4 * w + x * w / 4;
        [0, 1, 2].map(|c| rgb[c][pixel])
    })
}

/// An unlit square shows its texture as it is, upright; the model's camera is taken, and no light is added.
#[test]
fn an_unlit_model_shows_its_texture() {
    let at = folder("models-unlit");
    let unlit = json!({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 1, 0.5, 1]},
        "extensions": {"KHR_materials_unlit": {}}
    });
    let png = png();
    let mut model = squares(&[(unlit, [0.0; 3])], Some(&png));
    add_camera(&mut model.0);
    write_glb(&at.join("card.glb"), &model);
    let run = Run::new(
        &at,
        [
            "render",
            "card.glb",
            "-o",
            "out.exr",
            "--resolution",
            "16x16",
            "--spp",
            "4",
        ],
    )
    .done();
    assert!(
        run.stderr.contains("the camera is the model's 'front'"),
        "{run:?}"
    );
    assert!(!run.stderr.contains("--sun"), "{run:?}");
    let grey = 0.215_860_5;
    let expected = [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 0.5],
        [grey, grey, 0.5 * grey],
    ];
    let found = quarters(&picture(&at.join("out.exr")));
    for (f, e) in found.iter().flatten().zip(expected.iter().flatten()) {
        assert!((f - e).abs() < 1e-4, "{found:?}");
    }
}

/// A square with nothing but diffuse reflection left (no specular, not metal) under the model's own directional light: radiance
/// is colour/π · lux · cos θ.
#[test]
fn lights_of_the_model_have_their_strength() {
    let at = folder("models-lights");
    let paint = json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.4, 0.2, 1], "metallicFactor": 0},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0}}
    });
    let mut model = squares(&[(paint, [0.0; 3])], None);
    add_camera(&mut model.0);
    model.0["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "directional", "intensity": 3, "color": [1, 1, 0.5]}
    ]}});
    // Turned by 60° around x: it shines along −z turned, so its light comes from 60° below the normal.
    add_node(
        &mut model.0,
        json!({
            "rotation": [0.5, 0, 0, 0.75f64.sqrt()], "extensions": {"KHR_lights_punctual": {"light": 0}}
        }),
    );
    write_glb(&at.join("paint.glb"), &model);
    let image = render(
        &at,
        &at.join("paint.glb"),
        "out.exr",
        &["--resolution", "8x8", "--spp", "16"],
    );
    let rgb = image.color().unwrap_or_else(|| panic!("no colour"));
    for (c, expected) in [0.8 * 3.0, 0.4 * 3.0, 0.2 * 1.5].into_iter().enumerate() {
        let expected = expected / std::f64::consts::PI * 0.5;
        for v in rgb[c] {
            assert!(
                (f64::from(*v) / expected - 1.0).abs() < 2e-3,
                "{c}: {v} {expected}"
            );
        }
    }
}

/// A textured glowing square lights a white one beside it; bidirectional and unidirectional estimates agree.
#[test]
fn textured_emission_is_light() {
    let at = folder("models-glow");
    let glow = json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
        "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0},
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 10}, "KHR_materials_specular": {"specularFactor": 0}}
    });
    let white = json!({
        "pbrMetallicRoughness": {"metallicFactor": 0}, "extensions": {"KHR_materials_specular": {"specularFactor": 0}}
    });
    let png = png();
    // The glowing one faces +z, and the white one, 2 away, is turned to face it.
    let mut model = squares(&[(glow, [0.0; 3]), (white, [0.0, 0.0, 2.0])], Some(&png));
    model.0["nodes"][1]["rotation"] = json!([0, 1, 0, 0]);
    model.0["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 1.2, "aspectRatio": 1.0, "znear": 0.1}}]);
    // The camera stands before the glowing one with its back to it.
    add_node(
        &mut model.0,
        json!({"camera": 0, "translation": [0, 0, 0.25], "rotation": [0, 1, 0, 0]}),
    );
    write_glb(&at.join("glow.glb"), &model);
    let path = at.join("glow.glb");
    let options =
        |extra: &[&'static str]| [&["--resolution", "8x8", "--aov", "variance"], extra].concat();
    let one = render(
        &at,
        &path,
        "pt.exr",
        &options(&["--spp", "512", "--seed", "1"]),
    );
    let two = render(
        &at,
        &path,
        "bdpt.exr",
        &options(&["--spp", "512", "--seed", "2", "--integrator", "bdpt"]),
    );
    assert!(mean(&one) > 0.1, "{}", mean(&one));
    let c = resolvent_image::compare(&two, &one, [2, 2]).unwrap_or_else(|e| panic!("{e}"));
    let regions = c.regions.unwrap_or_else(|| panic!("no variance"));
    assert!(
        regions.passed(),
        "{:?} {}",
        regions.worst(),
        regions.p_value
    );
    // The texture has as much red as blue.
    let rgb = one.color().unwrap_or_else(|| panic!("no colour"));
    let sums = rgb.map(|c| c.iter().sum::<f32>());
    let grey = 0.215_860_5;
    assert!(
        (sums[0] / sums[2] - 1.0).abs() < 0.05,
        "{sums:?}, each (1 + {grey})/4 of white"
    );
}

/// Without camera and light: guesses are printed and saved as a scene, which shows the same picture.
#[test]
fn a_bare_model_is_framed_and_lit() {
    let at = folder("models-bare");
    let model = squares(
        &[(
            json!({"pbrMetallicRoughness": {"metallicFactor": 0}}),
            [5.0, -3.0, 8.0],
        )],
        None,
    );
    write_glb(&at.join("bare.glb"), &model);
    let run = Run::new(
        &at,
        [
            "render",
            "bare.glb",
            "-o",
            "a.exr",
            "--spp",
            "8",
            "--save-scene",
            "bare.json",
            "--resolution",
            "32x32",
            "--stats",
            "s.json",
            "--aov",
            "depth",
        ],
    )
    .done();
    for option in ["--camera", "--fov", "--sun", "--sky"] {
        assert!(run.stderr.contains(option), "{option}: {run:?}");
    }
    let image = picture(&at.join("a.exr"));
    let depth = image
        .channel("depth", "Z")
        .or_else(|| image.layer("depth").map(|l| l.channels[0].data.as_slice()));
    let hits = depth
        .unwrap_or_else(|| panic!("no depth"))
        .iter()
        .filter(|d| **d > 0.0)
        .count();
    assert!(
        hits > 300 && hits < 1024,
        "{hits} of 1024 pixels show the square"
    );
    let saved = json(&at.join("bare.json"));
    assert_eq!(
        saved["shapes"][0],
        json!({"type": "gltf", "file": "bare.glb"})
    );
    let again = render(&at, &at.join("bare.json"), "b.exr", &["--spp", "8"]);
    assert_eq!(crate::program::bits(&again), crate::program::bits(&image));
    let stats = json(&at.join("s.json"));
    assert_eq!(stats["geometry"]["triangles"], 2);
    assert_eq!(stats["textures"]["read"], 0);
}

/// In a scene of its own: placed, with another material, and said what is not shown.
#[test]
fn models_stand_in_scenes() {
    let at = folder("models-scene");
    let mut model = squares(&[(json!({}), [0.0; 3])], None);
    model.0["extensionsUsed"] = json!(["KHR_materials_dispersion"]);
    write_glb(&at.join("tile.glb"), &model);
    let scene = json!({
        "resolvent": 1,
        "camera": {"type": "perspective", "origin": [0, 0, 4], "target": [0, 0, 0], "fov_x_deg": 28.072_486_935_852_957},
        "film": {"resolution": [8, 8]},
        "lights": [{"type": "environment", "radiance": 1}],
        "materials": {"half": {"plugin": "diffuse", "params": {"reflectance": 0.5}}},
        "shapes": [{"type": "gltf", "file": "tile.glb", "material": "half"}]
    });
    let path: PathBuf = at.join("scene.json");
    std::fs::write(&path, scene.to_string()).unwrap_or_else(|e| panic!("{e}"));
    let run = Run::new(
        &at,
        ["render", "scene.json", "-o", "out.exr", "--spp", "64"],
    )
    .done();
    assert!(
        run.stderr.contains("tile.glb: KHR_materials_dispersion"),
        "{run:?}"
    );
    assert!((mean(&picture(&at.join("out.exr"))) - 0.5).abs() < 0.01);
}

#[test]
fn info_and_errors() {
    let at = folder("models-info");
    let png = png();
    let paint =
        json!({"name": "paint", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}});
    let mut model = squares(&[(paint, [1.0, 0.0, 0.0])], Some(&png));
    add_camera(&mut model.0);
    write_glb(&at.join("m.glb"), &model);
    let info = Run::new(&at, ["info", "m.glb", "--json"]).done().json();
    assert_eq!(
        (&info["kind"], &info["triangles"]),
        (&json!("gltf"), &json!(2))
    );
    assert_eq!(info["bounds"], json!([[0.0, -1.0, 0.0], [2.0, 1.0, 0.0]]));
    assert_eq!(
        info["materials"][0],
        json!({"name": "m.glb: material 0 paint", "plugin": "principled"})
    );
    assert_eq!(info["cameras"][0]["name"], "front");
    let text = Run::new(&at, ["info", "m.glb"]).done().stdout;
    assert!(
        text.contains("glTF model, 2 triangles") && text.contains("material 0 paint"),
        "{text}"
    );

    let refused = |args: &[&str], words: &[&str]| {
        let run = Run::new(&at, args);
        assert_eq!(run.code, Some(2), "{run:?}");
        for word in words {
            assert!(run.stderr.contains(word), "{word}: {run:?}");
        }
    };
    refused(
        &["render", "m.glb", "-o", "x.exr", "--grid", "density"],
        &["--grid", "is for VDB files"],
    );
    model.0["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    write_glb(&at.join("draco.glb"), &model);
    refused(
        &["render", "draco.glb", "-o", "x.exr"],
        &["draco.glb: requires the extension KHR_draco_mesh_compression"],
    );
    let bytes = std::fs::read(at.join("m.glb")).unwrap_or_else(|e| panic!("{e}"));
    std::fs::write(at.join("cut.glb"), &bytes[..bytes.len() / 2]).unwrap_or_else(|e| panic!("{e}"));
    refused(&["info", "cut.glb"], &["cut.glb: "]);
    std::fs::write(at.join("empty.gltf"), "{\"asset\": {\"version\": \"2.0\"}}")
        .unwrap_or_else(|e| panic!("{e}"));
    refused(
        &["render", "empty.gltf", "-o", "x.exr"],
        &["empty.gltf: has no triangles"],
    );
}
