//! Textures in scene files: read, written, moved, refused, and described by the schema.

mod common;

use common::decls;
use resolvent_scene::{
    ColorSpace, ImageSource, Scene, TextureChannel, TextureFilter, Value, Wrap, schema,
};
use serde_json::{Value as Json, json};

/// Every key of a texture, and every use of one.
const TEXTURED: &str = r#"{
  "resolvent": 1,
  "camera": {"type": "perspective", "origin": [0, 0, 5], "target": [0, 0, 0], "fov_x_deg": 40},
  "textures": {
    "wood": {
      "file": "maps/wood.png", "color_space": "srgb", "wrap": "mirror", "filter": "nearest", "channel": "g",
      "scale": [0.9, 0.8, -0.7], "bias": 0.1,
      "uv_transform": {"scale": [2, 3], "rotation_deg": 30, "offset": [0.1, -0.2]}
    },
    "bumps": {"data": "iVBORw0KGgo=", "color_space": "raw", "wrap_u": "clamp"}
  },
  "materials": {
    "planks": {
      "plugin": "diffuse", "params": {"reflectance": {"texture": "wood"}},
      "normal_map": {"texture": "bumps", "scale": 0.5}
    },
    "unknown": {"plugin": "layers", "params": {"base": {"plugin": "x", "params": {"color": {"texture": "wood"}}}}}
  }
}"#;

fn parse(text: &str) -> Scene {
    Scene::parse(text.as_bytes(), "shop/wood.json").unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn every_key_arrives() {
    let s = parse(TEXTURED);
    let planks = &s.materials["planks"];
    let reflectance = &planks.block.params["reflectance"].value;
    assert_eq!(reflectance.as_texture(), Some("wood"));
    let map = planks.normal_map.as_ref().unwrap();
    assert_eq!((map.texture.as_str(), map.scale), ("bumps", 0.5));
    let wood = &s.textures["wood"];
    assert_eq!(wood.image, ImageSource::File("maps/wood.png".into()));
    assert_eq!(
        (wood.color_space, wood.wrap, wood.filter, wood.channel),
        (
            ColorSpace::Srgb,
            [Wrap::Mirror; 2],
            TextureFilter::Nearest,
            Some(TextureChannel::Green)
        )
    );
    assert_eq!((wood.scale, wood.bias), ([0.9, 0.8, -0.7], [0.1; 3]));
    let (sin, cos) = 30f64.to_radians().sin_cos();
    let expected = [2.0 * cos, -3.0 * sin, 0.1, 2.0 * sin, 3.0 * cos, -0.2];
    let rows = wood.uv.rows();
    for (found, expected) in rows.iter().flatten().zip(expected) {
        assert!((found - expected).abs() < 1e-15, "{rows:?}");
    }
    let bumps = &s.textures["bumps"];
    let ImageSource::Memory(image) = &bumps.image else {
        panic!("{bumps:?}")
    };
    assert_eq!(&*image.bytes, b"\x89PNG\r\n\x1a\n");
    assert_eq!(
        (bumps.color_space, bumps.wrap),
        (ColorSpace::Linear, [Wrap::Clamp, Wrap::Repeat])
    );
    let nested: Vec<_> = s.materials["unknown"].block.textures();
    assert_eq!(nested.len(), 1);
    assert_eq!(nested[0].0, "wood");
    assert_eq!(
        nested[0].1.path,
        "$.materials.unknown.params.base.params.color"
    );
}

#[test]
fn what_is_written_reads_as_the_same() {
    let mut s = parse(TEXTURED);
    let text = s.to_text().unwrap();
    assert_eq!(parse(&text), s);
    s.rebase("wood.json", &[]).unwrap();
    assert_eq!(
        s.textures["wood"].image,
        ImageSource::File("shop/maps/wood.png".into())
    );
}

/// Pairs of an edit and the error it makes.
#[test]
fn mistakes_are_named_with_their_place() {
    for (from, to, expected) in [
        (
            r#"{"reflectance": {"texture": "wood"}}"#,
            r#"{"reflectance": {"texture": "wod"}}"#,
            r#"wood.json:14:54: $.materials.planks.params.reflectance: no texture is named "wod"; did you mean "wood"?"#,
        ),
        (
            r#"{"color": {"texture": "wood"}}"#,
            r#"{"color": {"texture": "steel"}}"#,
            r#"$.materials.unknown.params.base.params.color: no texture is named "steel""#,
        ),
        (
            r#"{"texture": "bumps", "scale": 0.5}"#,
            r#"{"texture": "bump"}"#,
            r#"$.materials.planks.normal_map: no texture is named "bump"; did you mean "bumps"?"#,
        ),
        (
            r#""filter": "nearest""#,
            r#""filter": "linear""#,
            r#"$.textures.wood.filter: unknown name "linear""#,
        ),
        (
            r#""iVBORw0KGgo=""#,
            r#""no*base64""#,
            "$.textures.bumps.data: expected bytes in base64",
        ),
        (
            r#""data": "iVBORw0KGgo=""#,
            r#""data": "AAAA", "file": "a.png""#,
            r#"$.textures.bumps: texture has the keys "file" and "data", of which only one may be given"#,
        ),
        (
            r#"{"texture": "wood"}},"#,
            r#"{"texture": "wood", "channel": "r"}},"#,
            r#"a texture's use has no key "channel""#,
        ),
    ] {
        assert_eq!(TEXTURED.matches(from).count(), 1, "{from}");
        let text = TEXTURED.replace(from, to);
        let error = Scene::parse(text.as_bytes(), "wood.json").expect_err(to);
        let error = error.to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn only_texturable_parameters_take_textures() {
    let decls = decls();
    let decl = |name: &str| decls.iter().find(|d| d.name == name).unwrap();
    let texture = || Value::Texture("wood".into());
    let block = resolvent_scene::PluginBlock::new("diffuse").with("reflectance", texture());
    let checked = decl("diffuse").check(&block, "x.json".as_ref()).unwrap();
    assert_eq!(checked.params["reflectance"].value, texture());
    let block = resolvent_scene::PluginBlock::new("homogeneous").with("sigma_t", texture());
    let error = decl("homogeneous").check(&block, "x.json".as_ref());
    let error = error.unwrap_err()[0].to_string();
    assert!(
        error.contains("expected a number ≥ 0 or three of them (RGB), found the texture \"wood\""),
        "{error}"
    );
    let block = resolvent_scene::PluginBlock::new("diffuse").with("reflectance", 2.0);
    let error = decl("diffuse").check(&block, "x.json".as_ref());
    assert!(
        error.unwrap_err()[0]
            .to_string()
            .contains("(RGB) or a texture, found")
    );
}

#[test]
fn schema_and_reader_agree() {
    let validator = jsonschema::validator_for(&schema(&decls())).unwrap();
    let value: Json = serde_json::from_str(TEXTURED).unwrap();
    assert!(validator.is_valid(&value));
    for (pointer, replacement) in [
        ("/textures/wood/file", json!("")),
        ("/textures/wood/wrap", json!("mirrored")),
        ("/textures/wood/wrap_u", json!("clamp")),
        ("/textures/wood/channel", json!("red")),
        ("/textures/wood/scale", json!([1, 2])),
        ("/textures/wood/data", json!("AAAA")),
        ("/textures/wood/uv_transform/offset", json!(1)),
        ("/textures/wood/uv_transform/rotation", json!(1)),
        ("/textures/bumps", json!({"color_space": "srgb"})),
        ("/materials/planks/normal_map", json!({"scale": 1})),
        ("/materials/planks/normal_map/texture", json!(1)),
        (
            "/materials/planks/params/reflectance",
            json!({"texture": "wood", "channel": "r"}),
        ),
    ] {
        let mut value = value.clone();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        value.pointer_mut(parent).unwrap()[key] = replacement.clone();
        assert!(
            !validator.is_valid(&value),
            "the schema accepts {pointer} = {replacement}"
        );
        let text = value.to_string();
        assert!(
            Scene::parse(text.as_bytes(), "x.json").is_err(),
            "the reader accepts {pointer} = {replacement}"
        );
    }
}
