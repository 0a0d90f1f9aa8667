//! Plugins compiled outside the workspace, against `core/api` only, loaded by path.

use crate::build;
use crate::drive::{self, Picture, picture, registry, says};
use resolvent_tests::Suite;
use serde_json::{Value, json};
use std::path::Path;

/// A scene whose pixels all see the same ray through the medium, before an environment of radiance 1.
fn ray(plugin: &Path, params: Value, origin: [f64; 3], target: [f64; 3]) -> Value {
    let mut s = drive::scene();
    let up = if origin[0] == target[0] {
        [1, 0, 0]
    } else {
        [0, 1, 0]
    };
    s["camera"] = json!({
        "type": "perspective", "origin": origin, "target": target, "up": up, "fov_x_deg": 1e-4
    });
    s["lights"] = json!([{ "type": "environment", "radiance": 1 }]);
    s["media"]["medium"] = json!({ "plugin": plugin, "params": params });
    s
}

fn rendered(scene: &Value) -> Picture {
    match picture(scene, &registry(), 256) {
        Ok(p) => {
            assert_eq!(p.counters.violations, 0);
            assert!(p.counters.flights + p.counters.transmittances > 0);
            p
        }
        Err(e) => panic!("{}", e.text),
    }
}

/// The optical depth of the wedge is σ along x and 2 σ x across it.
#[test]
fn a_plugin_compiled_apart_renders_its_closed_form() {
    let mut suite = Suite::new();
    let sigma: f64 = 1.7;
    for (origin, target, tau) in [
        ([-2.0, 0.5, 0.5], [0.0, 0.5, 0.5], sigma),
        ([3.0, 0.2, 0.5], [0.0, 0.2, 0.5], sigma),
        ([0.1, 0.5, -2.0], [0.1, 0.5, 0.0], 0.2 * sigma),
        ([0.9, 0.5, -2.0], [0.9, 0.5, 0.0], 1.8 * sigma),
    ] {
        let p = rendered(&ray(
            build::wedge(),
            json!({ "sigma_t": sigma }),
            origin,
            target,
        ));
        suite.mean(format!("{origin:?}"), &p.flat(0), (-tau).exp(), 1e-6);
    }
    suite.assert();
}

/// Absorption differs between lanes through the albedo only, and without any the cube is invisible.
#[test]
fn a_plugin_compiled_apart_conserves_energy() {
    let mut s = ray(
        build::wedge(),
        json!({ "sigma_t": 3, "albedo": 1 }),
        [0.3, 0.5, -2.0],
        [0.3, 0.5, 0.0],
    );
    s["media"]["medium"]["transform"] =
        json!([{ "rotate_deg": { "axis": [1, 2, 3], "angle": 40 } }]);
    let p = rendered(&s);
    assert!(p.counters.collisions > 100_000);
    let mut suite = Suite::new();
    suite.mean("furnace", &p.flat(0), 1.0, 1e-6);
    suite.assert();
}

/// The template, copied and built as its page says. The depth along a ray that passes the centre at b is
/// 4/3 σ R (1 − (b/R)²)^(3/2).
#[test]
fn the_template_renders_its_closed_form() {
    let (sigma, radius): (f64, f64) = (1.5, 2.0);
    let params = json!({ "sigma_t": sigma, "radius": radius, "albedo": 0 });
    let mut suite = Suite::new();
    for b in [0.0, 1.2] {
        let p = rendered(&ray(
            build::template(),
            params.clone(),
            [b, 0.0, -5.0],
            [b, 0.0, 0.0],
        ));
        let depth = 4.0 / 3.0 * sigma * radius * (1.0 - (b / radius).powi(2)).powf(1.5);
        suite.mean(format!("at {b}"), &p.flat(0), (-depth).exp(), 1e-6);
    }
    suite.assert();
}

/// What the library says about itself arrives.
#[test]
fn a_plugin_compiled_apart_is_described() {
    let plugin = registry()
        .open(build::wedge())
        .unwrap_or_else(|e| panic!("{e}"));
    let d = &plugin.decl;
    assert_eq!(
        (d.name.as_str(), d.version.as_str(), d.kind.as_str()),
        ("wedge", "3.1.4", "medium")
    );
    assert_eq!(d.summary, "A unit cube that gets denser along x.");
    let [sigma, albedo] = &d.params[..] else {
        panic!("{:?}", d.params);
    };
    assert!(sigma.required && sigma.min == Some(0.0) && sigma.unit == "1/length");
    assert_eq!((albedo.min, albedo.max), (Some(0.0), Some(1.0)));
}

/// A path is relative to the scene file; one that leads nowhere is named in full.
#[test]
fn a_path_that_leads_nowhere() {
    let s = ray(
        Path::new("./nowhere/fog.so"),
        json!({}),
        [0.0, 0.0, -2.0],
        [0.0; 3],
    );
    let fault = drive::fault(&s);
    says(
        &fault.text,
        &[
            "fixtures/test.json:",
            "$.media.medium",
            "/nowhere/fog.so",
            "No such file",
        ],
    );
}

/// A panic that aborts would take the program with it, so such a plugin is not even compiled.
#[test]
fn a_plugin_whose_panics_abort_does_not_compile() {
    match build::wedge_that_aborts() {
        Some(why) => assert!(
            why.contains("must be built with panic = \"unwind\""),
            "{why}"
        ),
        None => panic!("it compiles"),
    }
}
