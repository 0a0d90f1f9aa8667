//! The generated JSON Schema accepts what the reader accepts, and refuses what it refuses wherever a
//! schema can tell.

mod common;

use common::{FULL, LEAST, decls};
use resolvent_scene::{Scene, schema};
use serde_json::{Value, json};

fn validator() -> jsonschema::Validator {
    let schema = schema(&decls());
    jsonschema::meta::validate(&schema).unwrap_or_else(|e| panic!("{e}"));
    jsonschema::draft202012::new(&schema).unwrap()
}

fn errors(validator: &jsonschema::Validator, text: &str) -> Vec<String> {
    let value: Value = serde_json::from_str(text).unwrap();
    validator
        .iter_errors(&value)
        .map(|e| format!("{}: {e}", e.instance_path()))
        .collect()
}

#[test]
fn valid_scenes_are_valid() {
    let validator = validator();
    for text in [FULL, LEAST] {
        assert_eq!(errors(&validator, text), Vec::<String>::new());
        let written = Scene::parse(text.as_bytes(), "x.json")
            .unwrap()
            .to_text()
            .unwrap();
        assert_eq!(errors(&validator, &written), Vec::<String>::new());
    }
}

/// Edits of [`FULL`] at a JSON pointer: what neither the reader nor the schema may accept.
fn edits() -> Vec<(&'static str, Value)> {
    vec![
        ("/resolvent", json!("1")),
        ("/camera/type", json!("perspectiv")),
        ("/camera/fov_x_deg", json!(180)),
        ("/camera/fov_x_deg", json!(0)),
        ("/camera/origin", json!([1, 2])),
        ("/camera/lens_radius", json!(-1)),
        ("/camera/fov", json!(44)),
        (
            "/camera/transform",
            json!([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]),
        ),
        ("/film/resolution", json!([0, 10])),
        ("/film/resolution", json!([1.5, 10])),
        ("/film/aovs", json!(["dept"])),
        ("/film/aovs", json!(["depth", "depth"])),
        ("/film/aovs", json!(["orders"])),
        ("/film/aovs", json!(["orders:"])),
        ("/film/aovs", json!(["orders:100"])),
        ("/film/aovs", json!(["orders:-1"])),
        ("/film/filter", json!({"radius": 1})),
        ("/film/filter", json!({"type": "box", "sigma": 1})),
        ("/sampling/time", json!(3)),
        ("/sampling/seed", json!(-1)),
        ("/lights", json!({})),
        ("/lights/0/radiance", json!(1)),
        ("/lights/1/radiance", json!([1, -1, 0])),
        ("/lights/1", json!({"type": "environment"})),
        ("/lights/1/scale", json!(2)),
        ("/lights/2/angle_deg", json!(181)),
        ("/lights/4/two_sided", json!(1)),
        ("/lights/5/angle_deg", json!(0)),
        ("/lights/6/elevation_deg", json!(20)),
        ("/lights/6/azimuth_deg", json!(20)),
        ("/lights/6/ground_albedo", json!(1.5)),
        ("/lights/6/ground_albedo", json!([0, 0, 2])),
        ("/lights/6/turbidity", json!(1)),
        ("/lights/5/inner_angle_deg", json!(-1)),
        ("/lights/5/direction", json!(1)),
        ("/materials/floor", json!({"params": {}})),
        ("/materials/floor/transform", json!([{"scale": 1}])),
        ("/media/cloud/transform", json!([{"scael": 1}])),
        ("/media/cloud/params/file", json!("")),
        ("/media/cloud/params/albedo", json!(1.01)),
        ("/media/cloud/params/albdo", json!(1)),
        ("/media/cloud/params/interpolate", json!("yes")),
        ("/media/cloud/params/offset", json!([1, 2])),
        ("/media/cloud/params/table", json!([1, "a"])),
        ("/media/cloud/params/phase/params/g", json!(1)),
        ("/media/cloud/params/phase", json!({"params": {}})),
        ("/media/fog", json!({"plugin": "vdb"})),
        ("/integrator/params/max_depth", json!(1.5)),
        ("/integrator/params/strategy", json!("neee")),
        (
            "/shapes/0",
            json!({"type": "sphere", "center": [0, 0, 0], "radius": 1}),
        ),
        ("/shapes/0/radius", json!(0)),
        ("/shapes/1/interior", json!("fog")),
        ("/shapes/2/indices", json!([[0, 1]])),
        ("/shapes/2/uvs", json!([[0, 1, 2]])),
        ("/shapes/3/file", json!(7)),
        ("/shapes/3/priority", json!(0.5)),
        ("/prototypes/stone/0/file", json!(7)),
        ("/prototypes/stone", json!({})),
        ("/instances/0", json!({})),
        ("/instances/0/prototype", json!("")),
        ("/instances/1/transform", json!([{"scael": 1}])),
        ("/instances/1/interior", json!("fog")),
        ("/shapes/3/two_sided", json!(true)),
        ("/shapes/4/radius", json!(-1)),
        ("/shapes/4/two_sided", json!(1)),
        ("/shapes/5/axis", json!([0, 1])),
        ("/nothing", json!(7)),
    ]
}

/// Reads a scene and checks its blocks against the declarations, nested ones too.
fn reads(text: &str) -> bool {
    let Ok(scene) = Scene::parse(text.as_bytes(), "x.json") else {
        return false;
    };
    let mut blocks = vec![("integrator", scene.integrator.clone())];
    blocks.extend(scene.materials.values().map(|m| ("bsdf", m.block.clone())));
    blocks.extend(scene.media.values().map(|m| ("medium", m.block.clone())));
    while let Some((kind, block)) = blocks.pop() {
        if let Some(decl) = decls()
            .iter()
            .find(|d| d.kind == kind && d.name == block.plugin)
        {
            let Ok(checked) = decl.check(&block, "x.json".as_ref()) else {
                return false;
            };
            let nested = checked.params.values().filter_map(|p| p.value.as_plugin());
            blocks.extend(nested.map(|b| ("phase", b.clone())));
        }
    }
    true
}

#[test]
fn schema_and_reader_refuse_the_same() {
    let validator = validator();
    assert!(reads(FULL));
    for (pointer, replacement) in edits() {
        let mut value: Value = serde_json::from_str(FULL).unwrap();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        match value.pointer_mut(parent).unwrap() {
            Value::Array(items) => items[key.parse::<usize>().unwrap()] = replacement.clone(),
            other => other[key] = replacement.clone(),
        }
        let text = value.to_string();
        assert!(
            !errors(&validator, &text).is_empty(),
            "the schema accepts {pointer} = {replacement}"
        );
        assert!(
            !reads(&text),
            "the reader accepts {pointer} = {replacement}"
        );
    }
}

#[test]
fn a_plugin_that_is_not_known_may_have_any_parameters() {
    let text = FULL
        .replace("\"diffuse\"", "\"velvet\"")
        .replace("\"reflectance\"", "\"fuzz\"");
    assert_eq!(errors(&validator(), &text), Vec::<String>::new());
    assert!(reads(&text));
}
