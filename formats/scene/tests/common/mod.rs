//! Scenes and declarations that several tests use.
#![allow(dead_code)]

use resolvent_scene::{ParamDecl, ParamKind, PluginDecl, Value};

/// Every key of the format at least once.
pub const FULL: &str = r#"{
  "$schema": "scene.schema.json",
  "resolvent": 1,
  "units": {"meters_per_unit": 0.01},
  "camera": {
    "type": "perspective", "origin": [1.5, 2, 10], "target": [0, 1, 0], "up": [0, 1, 0.1],
    "fov_x_deg": 44, "lens_radius": 0.05, "focus_distance": 9.5, "shift": [0.25, -0.1], "exposure": -1.5
  },
  "film": {
    "resolution": [320, 200], "crop": [10, 20, 300, 180],
    "filter": {"type": "gaussian", "radius": 2, "sigma": 0.6},
    "aovs": ["depth", "albedo", "normal", "variance", "error_95", "samples", "orders:4"], "pixel_aspect": 1.5
  },
  "sampling": {"spp": 128, "seed": 18446744073709551615},
  "integrator": {"plugin": "pt", "params": {"max_depth": 12}},
  "lights": [
    {"type": "environment", "image": "sky.exr", "mapping": "angular", "scale": [1, 0.9, 0.8],
     "transform": [{"rotate_deg": {"axis": [0, 1, 0], "angle": 30}}]},
    {"type": "environment", "radiance": 0.1},
    {"type": "distant", "to_light": [0.6, 0.7, 0.4], "irradiance": [3, 3, 2.5], "angle_deg": 0.53},
    {"type": "point", "position": [0, 5, 0], "intensity": 40},
    {"type": "rectangle", "corner": [-1, 4, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2], "radiance": [5, 4, 3], "two_sided": true}, {"type": "spot", "position": [1, 6, 0], "direction": [0, -2, 0], "intensity": [9, 8, 7], "angle_deg": 50, "inner_angle_deg": 20}, {"type": "sun_sky", "to_sun": [1, 2, 3], "turbidity": 4, "ground_albedo": [0.1, 0.2, 0.3], "scale": 2, "sun": false, "sun_angle_deg": 1, "transform": [{"rotate_deg": {"axis": [1, 0, 0], "angle": 90}}]}
  ],
  "materials": {
    "floor": {"plugin": "diffuse", "params": {"reflectance": [0.6, 0.55, 0.5]}},
    "with a blank": {"plugin": "./my/libglass.so", "params": {"anything": [true, "text", [1, 2], {"plugin": "x"}]}}
  },
  "media": {
    "cloud": {
      "plugin": "vdb",
      "params": {
        "file": "cloud.vdb", "grid": "density", "density_scale": 2.5, "albedo": 0.99,
        "phase": {"plugin": "hg", "params": {"g": 0.85}}
      },
      "transform": [[2, 0, 0, 1], [0, 2, 0, -3], [0, 0, 2, 0], [0, 0, 0, 1]]
    },
    "fog": {"plugin": "homogeneous", "params": {"sigma_t": [1, 2, 3], "phase": "isotropic"}}
  },
  "shapes": [
    {"type": "sphere", "center": [0, 1, 0], "radius": 1, "interior": "fog"},
    {"type": "rectangle", "corner": [-5, 0, 5], "edge_u": [10, 0, 0], "edge_v": [0, 0, -10], "material": "floor", "emission": [0.1, 0, 0]},
    {"type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [0, 1e-3, 0]], "indices": [[0, 1, 2]],
     "normals": [[0, 0, 1], [0, 0, 1], [0, 0, 1]], "uvs": [[0, 0], [1, 0], [0, 1]],
     "transform": [{"scale": 2}, {"rotate_deg": {"axis": [1, 1, 0], "angle": 90}}, {"translate": [0, 0, 5]}],
     "material": "with a blank"},
    {"type": "ply", "file": "bunny.ply", "material": "floor", "interior": "fog", "priority": -2},
    {"type": "disk", "center": [0, 4, 0], "normal": [0, -2, 0], "radius": 0.5, "emission": 3, "two_sided": true,
     "shaping": {"axis": [0, -1, 0.1], "angle_deg": 70, "softness": 0.2, "focus": 4, "focus_tint": [0.1, 0, 0.2]}},
    {"type": "cylinder", "base": [1, 0, 0], "axis": [0, 2, 0], "radius": 0.25, "material": "floor", "interior": "fog"}
  ],
  "prototypes": {
    "stone": [
      {"type": "ply", "file": "stone.ply", "material": "floor"},
      {"type": "sphere", "center": [0, 0, 0], "radius": 0.1, "interior": "fog", "priority": 3}
    ]
  },
  "instances": [
    {"prototype": "stone"},
    {"prototype": "stone", "transform": [{"scale": [1, -2, 3]}, {"translate": [5, 0, 0]}], "material": "floor"},
    {"prototype": "stone", "transforms": "stones.npy", "transform": [{"translate": [0, 1, 0]}]}
  ]
}
"#;

/// The least that is a scene.
pub const LEAST: &str = r#"{"resolvent": 1, "camera": {"type": "perspective",
  "transform": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]], "fov_x_deg": 40}}"#;

fn param(name: &str, kind: ParamKind, edit: impl FnOnce(&mut ParamDecl)) -> ParamDecl {
    let mut decl = ParamDecl::new(name, kind);
    edit(&mut decl);
    decl
}

fn plugin(kind: &str, name: &str, params: Vec<ParamDecl>) -> PluginDecl {
    PluginDecl {
        name: name.into(),
        kind: kind.into(),
        version: "0.1.0".into(),
        summary: format!("The {name} plugin"),
        params,
    }
}

/// Declarations for the plugins of [`FULL`].
pub fn decls() -> Vec<PluginDecl> {
    let unit = |p: &mut ParamDecl| (p.min, p.max) = (Some(0.0), Some(1.0));
    let positive = |p: &mut ParamDecl| p.min = Some(0.0);
    let phase = || {
        param("phase", ParamKind::Plugin("phase".into()), |p| {
            p.default = Some("isotropic".into());
        })
    };
    vec![
        plugin(
            "integrator",
            "pt",
            vec![
                param("max_depth", ParamKind::Int, |p| {
                    p.min = Some(-1.0);
                    p.default = Some(Value::Number(-1.0));
                }),
                param(
                    "strategy",
                    ParamKind::Choice(vec!["nee".into(), "unidirectional".into()]),
                    |p| {
                        p.default = Some("nee".into());
                    },
                ),
            ],
        ),
        plugin(
            "bsdf",
            "diffuse",
            vec![param("reflectance", ParamKind::Spectrum, |p| {
                unit(p);
                p.texturable = true;
                p.default = Some(Value::Number(0.5));
            })],
        ),
        plugin(
            "medium",
            "vdb",
            vec![
                param("file", ParamKind::File, |p| p.required = true),
                param("grid", ParamKind::Text, |_| {}),
                param("density_scale", ParamKind::Float, |p| {
                    positive(p);
                    p.unit = "1/m".into();
                    p.default = Some(Value::Number(1.0));
                }),
                param("albedo", ParamKind::Spectrum, |p| {
                    unit(p);
                    p.default = Some(Value::Number(1.0));
                }),
                param("interpolate", ParamKind::Bool, |p| {
                    p.default = Some(Value::Bool(true))
                }),
                param("place", ParamKind::Transform, |_| {}),
                param("offset", ParamKind::Vec3, |_| {}),
                param("table", ParamKind::Numbers, positive),
                phase(),
            ],
        ),
        plugin(
            "medium",
            "homogeneous",
            vec![param("sigma_t", ParamKind::Spectrum, positive), phase()],
        ),
        plugin(
            "phase",
            "hg",
            vec![param("g", ParamKind::Float, |p| {
                (p.min, p.max) = (Some(-1.0), Some(1.0));
                (p.min_excluded, p.max_excluded) = (true, true);
                p.default = Some(Value::Number(0.0));
            })],
        ),
        plugin("phase", "isotropic", vec![]),
    ]
}
