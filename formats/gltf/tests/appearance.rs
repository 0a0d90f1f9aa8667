//! Materials, textures, cameras and lights.

mod common;

use common::{Builder, PIXEL, everything};
use resolvent_scene::{
    ColorSpace, ImageSource, Light, PluginBlock, Pose, Projection, TextureChannel, TextureFilter,
    Value, Wrap,
};
use serde_json::json;

fn number(b: &PluginBlock, name: &str) -> Option<f64> {
    b.params.get(name).and_then(|p| p.value.as_number())
}

fn texture<'b>(b: &'b PluginBlock, name: &str) -> Option<&'b str> {
    b.params.get(name).and_then(|p| p.value.as_texture())
}

fn color(b: &PluginBlock, name: &str) -> Option<[f64; 3]> {
    b.params.get(name).and_then(|p| p.value.as_vec3())
}

#[test]
fn every_parameter_arrives() {
    let model = everything().read();
    let name = "model.glb: material 0 all";
    let m = &model.materials[name];
    assert_eq!(m.block.plugin, "mask");
    assert_eq!(number(&m.block, "cutoff"), Some(0.25));
    let opacity = &model.textures[texture(&m.block, "opacity").unwrap()];
    assert_eq!(
        (opacity.channel, opacity.scale),
        (Some(TextureChannel::Alpha), [0.75; 3])
    );
    let map = m.normal_map.as_ref().unwrap();
    assert_eq!(map.scale, 0.5);
    assert_eq!(model.textures[&map.texture].color_space, ColorSpace::Linear);

    let b = m.block.params["bsdf"].value.as_plugin().unwrap();
    assert_eq!(b.plugin, "principled");
    let base = &model.textures[texture(b, "base_color").unwrap()];
    assert_eq!(
        (base.color_space, base.scale),
        (ColorSpace::Srgb, [0.5, 0.25, 1.0])
    );
    assert_eq!(
        (base.wrap, base.filter),
        ([Wrap::Clamp, Wrap::Mirror], TextureFilter::Nearest)
    );
    let ImageSource::Memory(image) = &base.image else {
        panic!("{base:?}")
    };
    assert_eq!(&*image.bytes, PIXEL);
    for (parameter, channel, scale) in [
        ("metallic", TextureChannel::Blue, 0.5),
        ("roughness", TextureChannel::Green, 0.25),
        ("transmission", TextureChannel::Red, 0.5),
        ("clearcoat", TextureChannel::Red, 0.75),
    ] {
        let t = &model.textures[texture(b, parameter).unwrap_or_else(|| panic!("{parameter}"))];
        assert_eq!(
            (t.channel, t.scale, t.color_space),
            (Some(channel), [scale; 3], ColorSpace::Linear),
            "{parameter}"
        );
    }
    for (parameter, value) in [
        ("ior", 1.25),
        ("clearcoat_roughness", 0.5),
        ("sheen", 1.0),
        ("sheen_roughness", 0.25),
        ("specular", 0.5),
    ] {
        assert_eq!(number(b, parameter), Some(value), "{parameter}");
    }
    // Only the base is bumpy.
    assert_eq!(color(b, "clearcoat_normal"), Some([0.5, 0.5, 1.0]));
    assert_eq!(color(b, "sheen_color"), Some([0.5, 0.0, 1.0]));
    assert_eq!(color(b, "specular_color"), Some([1.0, 2.0, 0.5]));
    assert_eq!(b.params["thin"].value, Value::Bool(false));

    let shape = &model.meshes[0].shapes[0];
    assert_eq!(shape.emission, Some([8.0, 4.0, 0.0]));
    assert!(shape.two_sided);
    let glow = &model.textures[shape.emission_texture.as_deref().unwrap()];
    assert_eq!((glow.color_space, glow.scale), (ColorSpace::Srgb, [1.0; 3]));
    // exp(−σ·4) is the colour.
    let inside = &model.media[shape.interior.as_deref().unwrap()].block;
    let sigma = color(inside, "sigma_a").unwrap();
    for (s, c) in sigma.iter().zip([1.0f64, 0.5, 0.25]) {
        assert!(((-s * 4.0).exp() - c).abs() < 1e-12, "{sigma:?}");
    }
    assert!(
        model
            .warnings
            .iter()
            .any(|w| w.starts_with("occlusionTexture"))
    );
}

#[test]
fn defaults_are_the_specifications() {
    let mut b = Builder::new();
    let plain = b.push("materials", json!({}));
    let (with, without) = (b.square(Some(plain)), b.cube());
    b.push("nodes", json!({"mesh": with, "children": [1]}));
    b.push("nodes", json!({"mesh": without}));
    let model = b.read();
    assert_eq!(model.materials.len(), 2);
    for m in model.materials.values() {
        assert_eq!(m.block.plugin, "principled");
        assert_eq!(color(&m.block, "base_color"), Some([1.0; 3]));
        assert_eq!(number(&m.block, "metallic"), Some(1.0));
        assert_eq!(number(&m.block, "roughness"), Some(1.0));
        assert_eq!(m.block.params.len(), 3);
    }
    assert!(model.textures.is_empty() && model.media.is_empty() && model.warnings.is_empty());
}

/// The coat's normal map is linear, has a scale, and makes tangents count.
#[test]
fn a_coat_has_its_own_normal_map() {
    let mut b = Builder::new();
    let image = b.push("images", json!({"uri": "n.png"}));
    let index = b.push("textures", json!({"source": image}));
    let coat =
        json!({"clearcoatFactor": 1, "clearcoatNormalTexture": {"index": index, "scale": 0.25}});
    let m = b.push(
        "materials",
        json!({"extensions": {"KHR_materials_clearcoat": coat}}),
    );
    let mesh = b.square(Some(m));
    b.push("nodes", json!({"mesh": mesh}));
    let model = b.read();
    let m = &model.materials[0];
    assert!(m.normal_map.is_none());
    let map = &model.textures[texture(&m.block, "clearcoat_normal").unwrap()];
    assert_eq!((map.color_space, map.scale), (ColorSpace::Linear, [1.0; 3]));
    assert_eq!(number(&m.block, "clearcoat_normal_scale"), Some(0.25));
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
}

/// Iridescence is a thin film: red is how much of it there is, green the way from the least thickness to the largest, which holds without a
/// texture.
#[test]
fn iridescence_is_a_thin_film() {
    let convert = |film: serde_json::Value| {
        let mut b = Builder::new();
        let image = b.push("images", json!({"uri": "film.png"}));
        b.push("textures", json!({"source": image}));
        let m = b.push(
            "materials",
            json!({"extensions": {"KHR_materials_iridescence": film}}),
        );
        b.json["extensionsRequired"] = json!(["KHR_materials_iridescence"]);
        let mesh = b.square(Some(m));
        b.push("nodes", json!({"mesh": mesh}));
        b.read()
    };
    let all = convert(json!({
        "iridescenceFactor": 0.75, "iridescenceTexture": {"index": 0}, "iridescenceIor": 1.8,
        "iridescenceThicknessMinimum": 200, "iridescenceThicknessMaximum": 650,
        "iridescenceThicknessTexture": {"index": 0}
    }));
    let block = &all.materials[0].block;
    let weight = &all.textures[texture(block, "thin_film").unwrap()];
    assert_eq!(
        (weight.channel, weight.scale, weight.bias),
        (Some(TextureChannel::Red), [0.75; 3], [0.0; 3])
    );
    let thickness = &all.textures[texture(block, "thin_film_thickness").unwrap()];
    assert_eq!(
        (thickness.channel, thickness.scale, thickness.bias),
        (Some(TextureChannel::Green), [450.0; 3], [200.0; 3])
    );
    assert_eq!(thickness.color_space, ColorSpace::Linear);
    assert_eq!(number(block, "thin_film_ior"), Some(1.8));
    assert!(all.warnings.is_empty(), "{:?}", all.warnings);

    let plain = convert(json!({"iridescenceFactor": 1}));
    let block = &plain.materials[0].block;
    for (name, value) in [
        ("thin_film", 1.0),
        ("thin_film_thickness", 400.0),
        ("thin_film_ior", 1.3),
    ] {
        assert_eq!(number(block, name), Some(value), "{name}");
    }
    let none = convert(json!({"iridescenceThicknessMaximum": 300}));
    assert!(!none.materials[0].block.params.contains_key("thin_film"));
    let dense = convert(json!({"iridescenceFactor": 1, "iridescenceIor": 7}));
    assert_eq!(
        number(&dense.materials[0].block, "thin_film_ior"),
        Some(5.0)
    );
    assert!(dense.warnings[0].starts_with("KHR_materials_iridescence: "));
}

#[test]
fn special_materials() {
    let convert = |material| {
        let mut b = Builder::new();
        let m = b.push("materials", material);
        let mesh = b.square(Some(m));
        b.push("nodes", json!({"mesh": mesh}));
        b.read()
    };
    let unlit = convert(json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0.125, 1]}, "doubleSided": true,
        "extensions": {"KHR_materials_unlit": {}}
    }));
    assert_eq!(unlit.materials[0].block.plugin, "diffuse");
    let shape = &unlit.meshes[0].shapes[0];
    assert_eq!(
        (shape.emission, shape.two_sided),
        (Some([0.5, 0.25, 0.125]), true)
    );

    let thin =
        convert(json!({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}));
    assert_eq!(
        thin.materials[0].block.params["thin"].value,
        Value::Bool(true)
    );
    assert_eq!(thin.meshes[0].shapes[0].interior, None);

    let mirror = convert(json!({"extensions": {
        "KHR_materials_ior": {"ior": 0}, "KHR_materials_specular": {"specularColorFactor": [0.5, 0.5, 0.25]}
    }}));
    assert_eq!(
        color(&mirror.materials[0].block, "f0"),
        Some([0.5, 0.5, 0.25])
    );

    let blend = convert(json!({
        "alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}
    }));
    assert_eq!(number(&blend.materials[0].block, "opacity"), Some(0.5));
    assert!(!blend.materials[0].block.params.contains_key("cutoff"));
    let opaque = convert(json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}}));
    assert_eq!(opaque.materials[0].block.plugin, "principled");
    // A texture of a factor 0 is not needed.
    let mut b = Builder::new();
    b.push("images", json!({"uri": "mr.png"}));
    b.push("textures", json!({"source": 0}));
    b.push(
        "materials",
        json!({"pbrMetallicRoughness": {
            "metallicFactor": 0, "metallicRoughnessTexture": {"index": 0}
        }}),
    );
    let mesh = b.square(Some(0));
    b.push("nodes", json!({"mesh": mesh}));
    let model = b.read();
    assert_eq!(number(&model.materials[0].block, "metallic"), Some(0.0));
    assert_eq!(
        model.textures.keys().collect::<Vec<_>>(),
        ["model.glb: material 0 roughness"]
    );
    assert_eq!(model.textures[0].image, ImageSource::File("mr.png".into()));
}

#[test]
fn wrong_values_are_errors() {
    for (material, expected) in [
        (
            json!({"extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 2}}}),
            "clearcoatFactor: expected",
        ),
        (
            json!({"extensions": {"KHR_materials_sheen": {"sheenColorFactor": [1, 2]}}}),
            "sheenColorFactor: expected 3",
        ),
        (
            json!({"extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatTexture": {"index": 9}}}}),
            "textures[9]",
        ),
    ] {
        let mut b = Builder::new();
        b.push("materials", material);
        let mesh = b.square(Some(0));
        b.push("nodes", json!({"mesh": mesh}));
        let text = b.error();
        assert!(
            text.contains("materials[0].") && text.contains(expected),
            "{text}"
        );
    }
}

#[test]
fn extensions_that_are_not_known_are_named() {
    let mut b = Builder::new();
    let cube = b.cube();
    b.push("nodes", json!({"mesh": cube}));
    b.json["extensionsUsed"] = json!([
        "KHR_materials_dispersion",
        "KHR_materials_sheen",
        "VENDOR_x"
    ]);
    let model = b.read();
    assert_eq!(model.warnings.len(), 2, "{:?}", model.warnings);
    assert!(model.warnings[0].starts_with("KHR_materials_dispersion: "));
    b.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression", "KHR_materials_sheen"]);
    let text = b.error();
    assert!(
        text.contains("requires the extension KHR_draco_mesh_compression, which is not supported"),
        "{text}"
    );
    b.json["extensionsRequired"] = json!(["KHR_materials_sheen", "KHR_materials_volume"]);
    b.read();
}

/// uv_image = T R S uv with R = (cos, sin; −sin, cos), v down in both (the extension's own example: its quadrant is the
/// lower left one).
#[test]
fn texture_transforms_are_those_of_the_extension() {
    let rotation = std::f64::consts::FRAC_PI_2;
    for (offset, rotation, scale) in [
        ([0.0, 1.0], rotation, [0.5, 0.5]),
        ([0.25, -0.5], 0.7, [2.0, 3.0]),
        ([0.0, 0.0], 0.0, [1.0, -1.0]),
    ] {
        let mut b = Builder::new();
        b.push("images", json!({"uri": "a.png"}));
        b.push("textures", json!({"source": 0}));
        b.push(
            "materials",
            json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {
                "KHR_texture_transform": {"offset": offset, "rotation": rotation, "scale": scale}
            }}}}),
        );
        let mesh = b.square(Some(0));
        b.push("nodes", json!({"mesh": mesh}));
        let model = b.read();
        let rows = model.textures[0].uv.rows();
        for [u, v] in [[0.0, 0.0], [1.0, 0.0], [0.3, 0.8]] {
            let (x, y) = (scale[0] * u, scale[1] * v);
            let (sin, cos) = f64::sin_cos(rotation);
            let expected = [offset[0] + cos * x + sin * y, offset[1] - sin * x + cos * y];
            let found = rows.map(|r| r[0] * u + r[1] * (1.0 - v) + r[2]);
            let found = [found[0], 1.0 - found[1]];
            for a in 0..2 {
                assert!(
                    (found[a] - expected[a]).abs() < 1e-12,
                    "{found:?} {expected:?}"
                );
            }
            if rotation == std::f64::consts::FRAC_PI_2 {
                assert!(
                    expected[0] > -1e-9 && expected[0] < 0.5 + 1e-9 && expected[1] > 0.5 - 1e-9
                );
            }
        }
    }
}

#[test]
fn cameras_look_along_their_nodes() {
    let model = everything().read();
    let camera = &model.cameras[0];
    assert_eq!(camera.aspect, Some(1.5));
    let expected = 2.0 * ((0.25f64).tan() * 1.5).atan().to_degrees();
    let Projection::Perspective { fov_x_deg } = camera.camera.projection else {
        panic!()
    };
    assert!((fov_x_deg - expected).abs() < 1e-5, "{fov_x_deg}");
    let Pose::Transform(t) = &camera.camera.pose else {
        panic!()
    };
    assert_eq!(t.point([0.0; 3]), [1.0, 2.0, 3.0]);
    let mut b = Builder::new();
    let cube = b.cube();
    b.push("cameras", json!({"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}}));
    b.push("nodes", json!({"mesh": cube, "camera": 0}));
    let model = b.read();
    assert!(model.cameras.is_empty() && model.warnings[0].contains("only perspective"));
}

/// Candela are W/sr and lux are W/m², times the colour; distant light comes from where its node's +z points.
#[test]
fn lights_keep_their_numbers() {
    let mut b = everything();
    let half = 0.5f64.sqrt();
    // A quarter turn around x takes z to −y: light from below.
    b.json["nodes"][5]["rotation"] = json!([half, 0, 0, half]);
    b.json["nodes"][5]["scale"] = json!([3, 3, 3]);
    let model = b.read();
    let Light::Point {
        position,
        intensity,
    } = &model.lights[0]
    else {
        panic!("{:?}", model.lights)
    };
    assert_eq!((*position, *intensity), ([1.0, 2.0, 3.0], [10.0, 5.0, 2.5]));
    let Light::Distant {
        to_light,
        irradiance,
        angle_deg,
    } = &model.lights[1]
    else {
        panic!("{:?}", model.lights)
    };
    assert_eq!((*irradiance, *angle_deg), ([3.0; 3], 0.0));
    assert!(
        (to_light[1] + 1.0).abs() < 1e-6 && to_light[0].abs() < 1e-6,
        "{to_light:?}"
    );
    let Light::Spot {
        position,
        direction,
        intensity,
        angle_deg,
        inner_angle_deg,
    } = &model.lights[2]
    else {
        panic!("{:?}", model.lights)
    };
    // It is the child of the turned node and shines along its −z: upwards.
    assert_eq!((*position, *intensity), ([1.0, 2.0, 3.0], [5.0; 3]));
    assert!((direction[1] - 1.0).abs() < 1e-6, "{direction:?}");
    assert!((angle_deg - 1f64.to_degrees()).abs() < 1e-6, "{angle_deg}");
    assert!((inner_angle_deg - 0.2f64.to_degrees()).abs() < 1e-6);
    assert_eq!(model.lights.len(), 3);
}

/// COLOR_0 is a factor of base colour and opacity, tangents are there for normal maps, and what has no effect is named.
#[test]
fn colours_and_tangents_of_vertices() {
    let mut b = Builder::new();
    let view = b.view(PIXEL);
    b.push(
        "images",
        json!({"bufferView": view, "mimeType": "image/png"}),
    );
    b.push("textures", json!({"source": 0}));
    let textured = b.push(
        "materials",
        json!({
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 1.0, 1.0, 0.5]},
            "normalTexture": {"index": 0}, "alphaMode": "BLEND"
        }),
    );
    let unlit = b.push(
        "materials",
        json!({"extensions": {"KHR_materials_unlit": {}}}),
    );
    b.json["extensionsUsed"] = json!(["KHR_materials_unlit"]);
    let mesh = b.square(Some(textured));
    let colors = b.floats(&[1., 0., 0., 0., 1., 0., 0., 0., 1., 1., 1., 1.], 3);
    let tangents = b.floats(
        &[
            1., 0., 0., 1., 1., 0., 0., 1., 1., 0., 0., 1., 1., 0., 0., -1.,
        ],
        4,
    );
    let normals = b.floats(&[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.], 3);
    let bytes = b.view(&[255, 0, 0, 51, 0, 255, 0, 255, 0, 0, 255, 255, 0, 0, 0, 0]);
    let rgba = b.push(
        "accessors",
        json!({"bufferView": bytes, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC4"}),
    );
    let mut primitives = b.json["meshes"][mesh]["primitives"].clone();
    let mut second = primitives[0].clone();
    primitives[0]["attributes"]["COLOR_0"] = json!(colors);
    primitives[0]["attributes"]["TANGENT"] = json!(tangents);
    primitives[0]["attributes"]["NORMAL"] = json!(normals);
    primitives[0]["targets"] = json!([{"POSITION": primitives[0]["attributes"]["POSITION"]}]);
    second["attributes"]["COLOR_0"] = json!(rgba);
    second["attributes"]["TANGENT"] = json!(tangents);
    let mut third = second.clone();
    second.as_object_mut().unwrap().remove("material");
    third["material"] = json!(unlit);
    primitives.as_array_mut().unwrap().extend([second, third]);
    b.json["meshes"][mesh]["primitives"] = primitives;
    b.push("nodes", json!({"mesh": mesh, "skin": 0}));
    b.push("skins", json!({"name": "bones", "joints": [0]}));
    let model = b.read();
    let shapes = &model.meshes[0].shapes;

    let first = common::mesh(&shapes[0]);
    assert_eq!(first.colors[1], [0.0, 1.0, 0.0, 1.0]);
    assert_eq!(first.tangents[3], [1.0, 0.0, 0.0, -1.0]);
    let m = &model.materials[shapes[0].material.as_ref().unwrap()].block;
    let opacity = &model.textures[texture(m, "opacity").unwrap()];
    assert!(opacity.vertex_color && opacity.channel == Some(TextureChannel::Alpha));
    let inner = m.params["bsdf"].value.as_plugin().unwrap();
    let base = &model.textures[texture(inner, "base_color").unwrap()];
    assert!(base.vertex_color && base.scale == [0.5, 1.0, 1.0]);
    assert!(matches!(base.image, ImageSource::Memory(_)));

    // Without an image they stand alone; without a normal map tangents are not kept.
    let second = common::mesh(&shapes[1]);
    assert_eq!(second.colors[0], [1.0, 0.0, 0.0, 0.2]);
    assert!(second.tangents.is_empty());
    let m = &model.materials[shapes[1].material.as_ref().unwrap()].block;
    let base = &model.textures[texture(m, "base_color").unwrap()];
    assert!(base.vertex_color && base.image == ImageSource::White);
    let glow = shapes[2].emission_texture.as_ref().unwrap();
    assert!(model.textures[glow].vertex_color && shapes[2].emission == Some([1.0; 3]));

    let warned = |what: &str| model.warnings.iter().any(|w| w.starts_with(what));
    assert!(warned("skin 'bones': "), "{:?}", model.warnings);
    assert!(
        warned("morph targets of meshes[0]: "),
        "{:?}",
        model.warnings
    );
    assert!(!warned("COLOR_0"));
}
