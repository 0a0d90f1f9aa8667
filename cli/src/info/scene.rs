//! What is in a scene.

use super::Report;
use crate::failure::{Outcome, input};
use resolvent_api::PluginKind;
use resolvent_engine::plugin::Registry;
use resolvent_scene::{
    Budget, Environment, Geometry, ImageSource, Light, ParamKind, PluginBlock, PluginDecl, Scene,
    Value,
};
use serde_json::json;
use std::collections::HashSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Reads the scene at `path`.
pub fn report(path: &Path) -> Outcome<Report> {
    let scene = Scene::read(path).map_err(input)?;
    let registry = Registry::new(&[]);
    let plugins = plugins(&scene, &registry);
    let files = named_files(&scene, &registry);
    let [w, h] = scene.film.resolution;
    let budget = match scene.sampling.budget {
        Budget::Spp(n) => format!("{n} samples per pixel"),
        Budget::Time(t) => format!("{t} seconds"),
        Budget::Error(e) => format!("until the error is {e}"),
    };
    let lights: Vec<&str> = scene.lights.iter().map(light).collect();
    let shapes: Vec<&str> = scene.shapes.iter().map(|s| geometry(&s.geometry)).collect();
    let emitting = scene.all_shapes().filter(|s| s.emission.is_some()).count();

    let mut text = format!(
        "{}: scene, {w} x {h} pixels, {budget}, seed {}\n",
        path.display(),
        scene.sampling.seed
    );
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "  {name:<12} {value}");
    };
    row("integrator", scene.integrator.plugin.clone());
    row("lights", counted(&lights));
    row("shapes", counted(&shapes));
    for (name, shapes) in &scene.prototypes {
        let shapes: Vec<&str> = shapes.iter().map(|s| geometry(&s.geometry)).collect();
        let copies = scene.instances.iter().filter(|i| i.prototype == *name);
        row(
            "prototype",
            format!(
                "{name} ({}), {} instances{}",
                counted(&shapes),
                copies.clone().count(),
                if copies.clone().any(|i| i.transforms.is_some()) {
                    " (tables count as one)"
                } else {
                    ""
                }
            ),
        );
    }
    if emitting > 0 {
        row("", format!("{emitting} shapes emit"));
    }
    for (name, texture) in &scene.textures {
        row("texture", format!("{name} ({:?})", texture.image));
    }
    for (name, material) in &scene.materials {
        row("material", format!("{name} ({})", material.block.plugin));
    }
    for (name, medium) in &scene.media {
        row("medium", format!("{name} ({})", medium.block.plugin));
    }
    for p in &plugins {
        let found = match &p.found {
            Some(path) => path.display().to_string(),
            None => "not found".into(),
        };
        row("plugin", format!("{} {}: {found}", p.kind, p.name));
    }
    for file in &files {
        let size = match std::fs::metadata(file) {
            Ok(m) => crate::output::bytes(m.len()),
            Err(_) => "missing".into(),
        };
        row("file", format!("{} ({size})", file.display()));
    }
    let json = json!({
        "file": path,
        "kind": "scene",
        "resolution": [w, h],
        "window": scene.film.window(),
        "sampling": {
            "budget": match scene.sampling.budget {
                Budget::Spp(n) => json!({"spp": n}),
                Budget::Time(t) => json!({"time": t}),
                Budget::Error(e) => json!({"error": e}),
            },
            "seed": scene.sampling.seed,
        },
        "integrator": scene.integrator.plugin,
        "lights": lights,
        "shapes": shapes,
        "emitting_shapes": emitting,
        "prototypes": scene.prototypes.iter().map(|(n, s)| json!({"name": n, "shapes": s.len()})).collect::<Vec<_>>(),
        "instances": scene.instances.len(),
        "textures": scene.textures.iter().map(|(n, t)| json!({"name": n, "image": format!("{:?}", t.image)})).collect::<Vec<_>>(),
        "materials": scene.materials.iter().map(|(n, m)| json!({"name": n, "plugin": m.block.plugin})).collect::<Vec<_>>(),
        "media": scene.media.iter().map(|(n, m)| json!({"name": n, "plugin": m.block.plugin})).collect::<Vec<_>>(),
        "plugins": plugins.iter().map(|p| json!({"kind": p.kind, "name": p.name, "path": p.found})).collect::<Vec<_>>(),
        "files": files.iter().map(|f| json!({"path": f, "bytes": std::fs::metadata(f).ok().map(|m| m.len())})).collect::<Vec<_>>(),
    });
    Ok(Report { json, text })
}

fn light(l: &Light) -> &'static str {
    match l {
        Light::Environment(Environment::Constant { .. }) => "constant environment",
        Light::Environment(Environment::Image { .. }) => "environment image",
        Light::Distant { .. } => "distant",
        Light::Point { .. } => "point",
        Light::Spot { .. } => "spot",
        Light::SunSky { .. } => "sun and sky",
        Light::Rectangle { .. } => "rectangle",
    }
}

fn geometry(g: &Geometry) -> &'static str {
    match g {
        Geometry::Sphere { .. } => "sphere",
        Geometry::Rectangle { .. } => "rectangle",
        Geometry::Disk { .. } => "disk",
        Geometry::Cylinder { .. } => "cylinder",
        Geometry::Mesh(_) => "mesh",
        Geometry::Ply { .. } => "ply",
        Geometry::Gltf { .. } => "gltf",
    }
}

/// `2 sphere, 1 mesh`.
fn counted(names: &[&str]) -> String {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for name in names {
        match counts.iter_mut().find(|(n, _)| n == name) {
            Some((_, count)) => *count += 1,
            None => counts.push((name, 1)),
        }
    }
    if counts.is_empty() {
        return "none".into();
    }
    let parts: Vec<_> = counts.iter().map(|(n, c)| format!("{c} {n}")).collect();
    parts.join(", ")
}

/// A plugin that a scene names.
struct Named {
    kind: String,
    name: String,
    found: Option<PathBuf>,
}

/// Every plugin that the scene names, once.
fn plugins(scene: &Scene, registry: &Registry) -> Vec<Named> {
    let mut out: Vec<Named> = Vec::new();
    walk(scene, registry, &mut |kind, block, decl| {
        if out.iter().any(|n| n.kind == kind && n.name == block.plugin) {
            return;
        }
        let loaded = registry.loaded();
        let found = decl.and_then(|d| {
            let same = |p: &&std::sync::Arc<resolvent_engine::plugin::Plugin>| {
                p.decl.name == d.name && p.decl.kind == d.kind
            };
            loaded.iter().find(same).map(|p| p.path.clone())
        });
        out.push(Named {
            kind: kind.to_owned(),
            name: block.plugin.clone(),
            found,
        });
    });
    out
}

/// The files that the scene names, as paths from the current folder, each once.
pub fn named_files(scene: &Scene, registry: &Registry) -> Vec<PathBuf> {
    let mut out = files_of_parts(scene);
    // Tiled images have no file of their own name.
    out.retain(|path| !path.to_string_lossy().contains("<UDIM>"));
    let mut known: HashSet<_> = out.iter().cloned().collect();
    walk(scene, registry, &mut |_, block, decl| {
        for p in decl.iter().flat_map(|d| &d.params) {
            if p.kind == ParamKind::File
                && let Some(Value::Text(file)) = block.params.get(&p.name).map(|v| &v.value)
            {
                let path = scene.resolve(file);
                if known.insert(path.clone()) {
                    out.push(path);
                }
            }
        }
    });
    out
}

/// The files that lights, textures, shapes and instances name, each once. What plugins are given is theirs.
pub fn files_of_parts(scene: &Scene) -> Vec<PathBuf> {
    let mut out = Vec::new();
    let mut known = HashSet::new();
    let mut add = |file: &str| {
        let path = scene.resolve(file);
        if known.insert(path.clone()) {
            out.push(path);
        }
    };
    for l in &scene.lights {
        if let Light::Environment(Environment::Image { file, .. }) = l {
            add(file);
        }
    }
    for t in scene.textures.values() {
        if let ImageSource::File(file) = &t.image {
            add(file);
        }
    }
    for s in scene.all_shapes() {
        if let Geometry::Ply { file, .. } | Geometry::Gltf { file, .. } = &s.geometry {
            add(file);
        }
    }
    for i in &scene.instances {
        if let Some(file) = &i.transforms {
            add(file);
        }
    }
    out
}

type Visit<'v> = &'v mut dyn FnMut(&str, &PluginBlock, Option<&PluginDecl>);

/// Calls `visit` with every plugin block of the scene, its kind, and its declaration if the plugin can be loaded.
fn walk(scene: &Scene, registry: &Registry, visit: Visit) {
    let integrator = [(PluginKind::Integrator, &scene.integrator)];
    let materials = scene
        .materials
        .values()
        .map(|m| (PluginKind::Bsdf, &m.block));
    let media = scene.media.values().map(|m| (PluginKind::Medium, &m.block));
    for (kind, block) in integrator.into_iter().chain(materials).chain(media) {
        walk_block(scene, registry, kind, block, visit);
    }
}

fn walk_block(
    scene: &Scene,
    registry: &Registry,
    kind: PluginKind,
    block: &PluginBlock,
    visit: Visit,
) {
    let plugin = if block.is_path() {
        registry.load(kind, &scene.resolve(&block.plugin))
    } else {
        registry.find(kind, &block.plugin)
    };
    let plugin = plugin.ok();
    let decl = plugin.as_ref().map(|p| &p.decl);
    visit(kind.name(), block, decl);
    for p in decl.iter().flat_map(|d| &d.params) {
        let ParamKind::Plugin(kind) = &p.kind else {
            continue;
        };
        let Some(kind) = PluginKind::ALL.into_iter().find(|k| k.name() == kind) else {
            continue;
        };
        match block.params.get(&p.name).map(|v| &v.value) {
            Some(Value::Object(inner)) => walk_block(scene, registry, kind, inner, visit),
            Some(Value::Text(name)) => {
                walk_block(
                    scene,
                    registry,
                    kind,
                    &PluginBlock::new(name.as_str()),
                    visit,
                );
            }
            _ => {}
        }
    }
}
