//! Every error names file, line, column, JSON path, what was expected, what was found, and the nearest
//! known name.

mod common;

use common::{FULL, LEAST, decls};
use resolvent_scene::{Error, PluginBlock, Scene, Value};

/// The error that `from` → `to` makes of the full scene.
fn error(from: &str, to: &str) -> String {
    assert_eq!(FULL.matches(from).count(), 1, "{from}");
    Scene::parse(FULL.replace(from, to).as_bytes(), "full.json")
        .expect_err(to)
        .to_string()
}

#[track_caller]
fn expect(from: &str, to: &str, message: &str) {
    assert_eq!(error(from, to), message);
}

#[test]
fn syntax() {
    expect(
        r#""fov_x_deg": 44,"#,
        r#""fov_x_deg": 44"#,
        r#"full.json:7:21: $: expected "," or "}", found "\"""#,
    );
    expect(
        "\"seed\": 18446744073709551615}",
        "\"seed\": 1,}",
        r#"full.json:14:38: $: expected a key (a comma must not end an object), found "}""#,
    );
    expect(
        "\"fov_x_deg\": 44",
        "\"fov_x_deg\": NaN",
        r#"full.json:7:18: $: expected a value, found "NaN""#,
    );
    expect(
        "\"fov_x_deg\": 44",
        "\"fov_x_deg\": 1e999",
        r#"full.json:7:18: $: the number "1e999" is out of range: at most 1.8e308 in magnitude"#,
    );
    expect(
        "\"fov_x_deg\": 44",
        "\"fov_x_deg\": 044",
        "full.json:7:18: $: a number must not start with a zero and go on with digits",
    );
    expect(
        "\"fov_x_deg\": 44",
        "// wide\n",
        r#"full.json:7:5: $: expected a key in double quotes, found "/" (JSON has no comments)"#,
    );
    expect(
        "\"spp\": 128",
        "\"seed\": 1",
        "full.json:14:27: $: the key \"seed\" appears twice in one object",
    );
    expect(
        "\"sky.exr\"",
        "\"sky\n.exr\"",
        "full.json:17:38: $: this text has no closing quote on its line",
    );
    expect(
        "\"sky.exr\"",
        r#""\ud83d.exr""#,
        r"full.json:17:39: $: \ud83d is half a surrogate pair, not a character",
    );
    expect(
        "\"sky.exr\"",
        r#""\q""#,
        r#"full.json:17:39: $: unknown escape: one of \" \\ \/ \b \f \n \r \t \uXXXX"#,
    );
    let empty = Scene::parse(b"", "empty.json").unwrap_err().to_string();
    assert_eq!(
        empty,
        "empty.json:1:1: $: expected a value, found the end of the file"
    );
    let two = Scene::parse(b"{} {}", "two.json").unwrap_err().to_string();
    assert_eq!(
        two,
        r#"two.json:1:4: $: expected the end of the file, found "{""#
    );
}

#[test]
fn keys_and_names() {
    expect(
        "\"fov_x_deg\": 44",
        "\"fov\": 44",
        "full.json:7:5: $.camera.fov: perspective has no key \"fov\"; did you mean \"fov_x_deg\"?\n\
        full.json:5:13: $.camera: perspective needs the key \"fov_x_deg\": Full horizontal field of view in degrees",
    );
    expect(
        "\"type\": \"distant\"",
        "\"type\": \"distnat\"",
        r#"full.json:20:14: $.lights[2].type: unknown type "distnat"; did you mean "distant"?"#,
    );
    expect(
        "\"type\": \"distant\"",
        "\"type\": \"sun\"",
        r#"full.json:20:14: $.lights[2].type: unknown type "sun"; did you mean "sun_sky"?"#,
    );
    expect(
        "\"albedo\", \"normal\"",
        "\"albedos\", \"normal\"",
        r#"full.json:12:23: $.film.aovs[1]: unknown name "albedos"; did you mean "albedo"?"#,
    );
    expect(
        "\"samples\", \"orders:4\"",
        "\"samples\", \"orders:4.5\"",
        r#"full.json:12:78: $.film.aovs[6]: "orders:4.5" is no layer; orders are asked for as "orders:N", N from 0 to 99"#,
    );
    expect(
        "\"samples\", \"orders:4\"",
        "\"orders:3\", \"orders:4\"",
        r#"full.json:12:79: $.film.aovs[6]: "orders:4" is named twice"#,
    );
    expect(
        "\"interior\": \"fog\"},\n    {\"type\": \"rectangle\"",
        "\"interior\": \"frog\"},\n    {\"type\": \"rectangle\"",
        r#"full.json:40:70: $.shapes[0].interior: no medium is named "frog"; did you mean "fog"?"#,
    );
    expect(
        "\"material\": \"with a blank\"",
        "\"material\": \"chalk\"",
        r#"full.json:45:18: $.shapes[2].material: no material is named "chalk"; known: "floor", "with a blank""#,
    );
    expect(
        "{\"prototype\": \"stone\"}",
        "{\"prototype\": \"stoone\"}",
        r#"full.json:58:19: $.instances[0].prototype: no prototype is named "stoone"; did you mean "stone"?"#,
    );
    expect(
        "{\"prototype\": \"stone\"}",
        "{\"prototype\": \"stone\", \"transfrom\": []}",
        r#"full.json:58:28: $.instances[0].transfrom: instance has no key "transfrom"; did you mean "transform"?"#,
    );
    expect(
        "[5, 0, 0]}], \"material\": \"floor\"}",
        "[5, 0, 0]}], \"material\": \"foor\"}",
        r#"full.json:59:104: $.instances[1].material: no material is named "foor"; did you mean "floor"?"#,
    );
    expect(
        "\"file\": \"stone.ply\", \"material\": \"floor\"",
        "\"file\": \"stone.ply\", \"material\": \"flor\"",
        r#"full.json:53:56: $.prototypes.stone[0].material: no material is named "flor"; did you mean "floor"?"#,
    );
    expect(
        "\"spp\": 128",
        "\"spp\": 128, \"time\": 3",
        r#"full.json:14:15: $.sampling: sampling has the keys "spp" and "time", of which only one may be given"#,
    );
    expect(
        "\"./my/libglass.so\"",
        "7",
        r#"full.json:26:32: $.materials["with a blank"].plugin: expected a text that is not empty, found 7.0"#,
    );
}

#[test]
fn numbers_and_shapes() {
    expect(
        "\"fov_x_deg\": 44",
        "\"fov_x_deg\": 180",
        "full.json:7:18: $.camera.fov_x_deg: expected a number in (0, 180), found 180.0",
    );
    expect(
        "\"radiance\": 0.1",
        "\"radiance\": -0.1",
        "full.json:19:41: $.lights[1].radiance: expected a number in [0, 1e30], found -0.1",
    );
    expect(
        "\"radiance\": 0.1",
        "\"radiance\": [1, 2]",
        "full.json:19:41: $.lights[1].radiance: expected a number or a list of three (RGB), found a list of 2",
    );
    expect(
        "\"resolution\": [320, 200]",
        "\"resolution\": [320, 0]",
        "full.json:10:25: $.film.resolution[1]: expected a whole number in [1, 65536], found 0.0",
    );
    expect(
        "[10, 20, 300, 180]",
        "[10, 20, 10, 180]",
        "full.json:10:39: $.film.crop: expected x0 < x1 ≤ 320 and y0 < y1 ≤ 200, found [10, 20, 10, 180]",
    );
    expect(
        "[10, 20, 300, 180]",
        "[10, 20, 300, 201]",
        "full.json:10:39: $.film.crop: expected x0 < x1 ≤ 320 and y0 < y1 ≤ 200, found [10, 20, 300, 201]",
    );
    expect(
        "18446744073709551615",
        "18446744073709551616",
        "full.json:14:36: $.sampling.seed: expected a whole number in [0, 18446744073709551615], found 1.8446744073709552e19",
    );
    expect(
        "\"target\": [0, 1, 0]",
        "\"target\": [1.5, 2, 10]",
        "full.json:6:62: $.camera.target: expected a target unequal to the origin",
    );
    expect(
        "\"up\": [0, 1, 0.1]",
        "\"up\": [-1.5, -1, -10]",
        "full.json:6:79: $.camera.up: expected \"up\" not to be parallel to the viewing axis, found [-1.5, -1.0, -10.0]",
    );
    expect(
        "\"to_light\": [0.6, 0.7, 0.4]",
        "\"to_light\": [0, 0, 0]",
        "full.json:20:37: $.lights[2].to_light: expected a direction that is not zero, found [0, 0, 0]",
    );
    expect(
        "\"edge_v\": [0, 0, 2]",
        "\"edge_v\": [4, 0, 0]",
        "full.json:22:5: $.lights[4]: expected two edges that span an area, found [2.0, 0.0, 0.0] and [4.0, 0.0, 0.0]",
    );
    expect(
        "[0, 2, 0, -3]",
        "[4, 0, 0, -3]",
        "full.json:35:20: $.media.cloud.transform: expected a transform that can be inverted, found a matrix that cannot be inverted (determinant 0e0)",
    );
    expect(
        "[0, 0, 2, 0], [0, 0, 0, 1]",
        "[0, 0, 2, 0], [0, 0, 1, 1]",
        "full.json:35:20: $.media.cloud.transform: expected a transform that can be inverted, found a matrix whose last row is [0.0, 0.0, 1.0, 1.0], not [0, 0, 0, 1]",
    );
    expect(
        "{\"scale\": 2}",
        "{\"sclae\": 2}",
        r#"full.json:44:20: $.shapes[2].transform[0]: unknown operation "sclae"; did you mean "scale"?"#,
    );
    expect(
        "{\"rotate_deg\": {\"axis\": [0, 1, 0], \"angle\": 30}}",
        "{\"scale\": 3}",
        "full.json:18:19: $.lights[0].transform: expected a rotation, found a transform that scales or shears",
    );
    expect(
        "[[0, 1, 2]]",
        "[[0, 1, 3]]",
        "full.json:42:85: $.shapes[2].indices[0]: expected indices below 3 (the number of positions), found 3",
    );
    expect(
        "[[0, 1, 2]]",
        "[]",
        "full.json:42:84: $.shapes[2].indices: expected at least one triangle",
    );
    expect(
        "\"scale\": [1, -2, 3]",
        "\"scale\": [1, 0, 3]",
        "full.json:59:41: $.instances[1].transform: expected a transform that can be inverted, found a matrix that cannot be inverted (determinant 0e0)",
    );
    expect(
        "\"priority\": 3",
        "\"priority\": 1.5",
        "full.json:54:93: $.prototypes.stone[1].priority: expected a whole number in [-1000000, 1000000], found 1.5",
    );
    expect(
        "[[0, 0], [1, 0], [0, 1]]",
        "[[0, 0], [1, 0]]",
        "full.json:43:59: $.shapes[2].uvs: expected one per position (3), found 2",
    );
    expect(
        "\"albedo\": 0.99",
        "\"albedo\": null",
        "full.json:32:81: $.media.cloud.params.albedo: expected a value (leave the key out for the default), found null",
    );
}

#[test]
fn a_newer_format_says_so() {
    let text = LEAST.replace("\"resolvent\": 1", "\"novelty\": [], \"resolvent\": 2");
    let error = Scene::parse(text.as_bytes(), "new.json").unwrap_err();
    assert!(matches!(error, Error::Unsupported(_)));
    assert_eq!(
        error.to_string(),
        "new.json:1:30: $.resolvent: the scene has format version 2, this program reads up to 1; update the program"
    );
    let none =
        Scene::parse(LEAST.replace("\"resolvent\": 1,", "").as_bytes(), "x.json").unwrap_err();
    assert_eq!(
        none.to_string(),
        "x.json:1:1: $: scene needs the key \"resolvent\": Version of the scene format"
    );
}

#[test]
fn all_problems_are_reported_at_once() {
    let text = FULL
        .replace("\"fov_x_deg\": 44", "\"fov_x_deg\": 0")
        .replace("\"spp\": 128", "\"spp\": 0")
        .replace("\"center\": [0, 1, 0]", "\"centre\": [0, 1, 0]");
    let error = Scene::parse(text.as_bytes(), "x.json").unwrap_err();
    let paths: Vec<_> = error
        .problems()
        .iter()
        .map(|p| p.place.path.as_str())
        .collect();
    assert_eq!(
        paths,
        [
            "$.camera.fov_x_deg",
            "$.sampling.spp",
            "$.shapes[0].centre",
            "$.shapes[0]"
        ]
    );
    let many = format!(
        "{{\"resolvent\": 1, \"lights\": [{}0]}}",
        "0, ".repeat(10_000)
    );
    let error = Scene::parse(many.as_bytes(), "x.json").unwrap_err();
    assert_eq!(error.problems().len(), 50);
}

#[test]
fn columns_count_characters_in_any_line() {
    let shift = "☁".repeat(3000);
    let text = format!("\u{feff}{{\"resolvent\": 1, \"{shift}\": 1, \"camera\": 7}}");
    let error = Scene::parse(text.as_bytes(), "x.json").unwrap_err();
    let places: Vec<_> = error
        .problems()
        .iter()
        .map(|p| (p.place.line, p.place.column))
        .collect();
    assert_eq!(places, [(1, 18), (1, 3035)]);
    let invalid = [&b"{\n \"\xe2\x98\x81"[..], &b"\xff\"}"[..]].concat();
    let error = Scene::parse(&invalid, "x.json").unwrap_err();
    assert_eq!(
        error.to_string(),
        "x.json:2:4: $: byte 0xff is not UTF-8 text"
    );
}

#[track_caller]
fn vdb(edit: impl FnOnce(PluginBlock) -> PluginBlock, message: &str) {
    let scene = Scene::parse(FULL.as_bytes(), "full.json").unwrap();
    let block = edit(scene.media["cloud"].block.clone());
    let decl = decls().into_iter().find(|d| d.name == "vdb").unwrap();
    let problems = decl.check(&block, "full.json".as_ref()).expect_err(message);
    assert_eq!(
        problems
            .iter()
            .map(|p| p.to_string())
            .collect::<Vec<_>>()
            .join("\n"),
        message
    );
}

/// The same block with another value under a key, where it was.
fn set(mut block: PluginBlock, key: &str, value: impl Into<Value>) -> PluginBlock {
    block.params[key].value = value.into();
    block
}

#[test]
fn parameters_against_declarations() {
    vdb(
        |b| set(b, "density_scale", -1.0),
        r#"full.json:32:66: $.media.cloud.params.density_scale: "density_scale" of medium vdb: expected a number ≥ 0 (1/m), found -1.0"#,
    );
    vdb(
        |b| set(b, "albedo", [0.5, 0.5, 1.5]),
        r#"full.json:32:81: $.media.cloud.params.albedo: "albedo" of medium vdb: expected a number in [0, 1] or three of them (RGB), found a list of 3"#,
    );
    vdb(
        |b| set(b, "grid", 3.0),
        r#"full.json:32:38: $.media.cloud.params.grid: "grid" of medium vdb: expected a text, found 3.0"#,
    );
    vdb(
        |b| set(b, "phase", true),
        r#"full.json:33:18: $.media.cloud.params.phase: "phase" of medium vdb: expected a phase plugin: its name, or an object with "plugin" and "params", found true"#,
    );
    vdb(
        |b| b.with("densty_scale", 1.0),
        r#"full.json: medium vdb has no parameter "densty_scale"; did you mean "density_scale"?"#,
    );
    vdb(
        |mut b| {
            b.params.shift_remove("file");
            b
        },
        r#"full.json:29:14: $.media.cloud: medium vdb needs the parameter "file""#,
    );
    let pt = decls().into_iter().find(|d| d.name == "pt").unwrap();
    let depth = pt
        .check(
            &PluginBlock::new("pt").with("max_depth", 2.5),
            "x.json".as_ref(),
        )
        .unwrap_err();
    assert_eq!(
        depth[0].what,
        "\"max_depth\" of integrator pt: expected a whole number ≥ -1, found 2.5"
    );
    let choice = pt
        .check(
            &PluginBlock::new("pt").with("strategy", "nes"),
            "x.json".as_ref(),
        )
        .unwrap_err();
    assert_eq!(
        choice[0].what,
        r#""strategy" of integrator pt: expected one of "nee", "unidirectional" (did you mean "nee"?), found "nes""#
    );
}

#[test]
fn defaults_are_filled_in() {
    let scene = Scene::parse(FULL.as_bytes(), "full.json").unwrap();
    let decls = decls();
    let vdb = decls.iter().find(|d| d.name == "vdb").unwrap();
    let checked = vdb
        .check(&scene.media["cloud"].block, "full.json".as_ref())
        .unwrap();
    assert_eq!(checked.params["interpolate"].value, Value::Bool(true));
    assert_eq!(checked.params["density_scale"].value, Value::Number(2.5));
    assert!(!checked.params.contains_key("table"));
    let fog = decls.iter().find(|d| d.name == "homogeneous").unwrap();
    let checked = fog
        .check(&scene.media["fog"].block, "full.json".as_ref())
        .unwrap();
    let phase = checked.params["phase"]
        .value
        .as_plugin()
        .expect("a name alone becomes a block");
    assert_eq!((phase.plugin.as_str(), phase.place.line), ("isotropic", 37));
}
