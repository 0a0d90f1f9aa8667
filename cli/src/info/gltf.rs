//! What is in a glTF model.

use super::{Report, short};
use crate::failure::{Outcome, input};
use resolvent_gltf::Model;
use resolvent_scene::{ImageSource, Light, Projection};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// Reads the model at `path`.
pub fn report(path: &Path) -> Outcome<Report> {
    let model = Model::read(path).map_err(input)?;
    let places: usize = model.meshes.iter().map(|m| m.places.len()).sum();
    let mut text = format!(
        "{}: glTF model, {} triangles in {} meshes at {places} places\n",
        path.display(),
        model.triangles(),
        model.meshes.len(),
    );
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "  {name:<12} {value}");
    };
    if let Some([lo, hi]) = model.bounds() {
        let point = |p: [f64; 3]| p.map(short).join(" ");
        row("bounds", format!("{} to {}", point(lo), point(hi)));
    }
    for mesh in &model.meshes {
        let (parts, places) = (mesh.shapes.len(), mesh.places.len());
        row(
            "mesh",
            format!(
                "{} ({parts} parts, {places} places)",
                mesh.name.escape_debug()
            ),
        );
    }
    for (name, material) in &model.materials {
        row(
            "material",
            format!("{} ({})", name.escape_debug(), material.block.plugin),
        );
    }
    for (name, texture) in &model.textures {
        row(
            "texture",
            format!(
                "{} ({})",
                name.escape_debug(),
                image(&texture.image).escape_debug()
            ),
        );
    }
    for camera in &model.cameras {
        row(
            "camera",
            format!(
                "{}, {}",
                camera.name.escape_debug(),
                match camera.camera.projection {
                    Projection::Perspective { fov_x_deg } =>
                        format!("{} degrees wide", short(fov_x_deg)),
                    Projection::Orthographic { width } => format!("{} units wide", short(width)),
                }
            ),
        );
    }
    for light in &model.lights {
        row("light", kind(light).into());
    }
    for warning in &model.warnings {
        row("not shown", warning.escape_debug().to_string());
    }
    let json = json!({
        "file": path,
        "kind": "gltf",
        "triangles": model.triangles(),
        "bounds": model.bounds(),
        "meshes": model.meshes.iter().map(|m| json!({
            "name": m.name, "parts": m.shapes.len(), "places": m.places.len(),
        })).collect::<Vec<_>>(),
        "materials": model.materials.iter().map(|(n, m)| json!({"name": n, "plugin": m.block.plugin})).collect::<Vec<_>>(),
        "textures": model.textures.iter().map(|(n, t)| json!({"name": n, "image": image(&t.image)})).collect::<Vec<_>>(),
        "media": model.media.keys().collect::<Vec<_>>(),
        "cameras": model.cameras.iter().map(|c| json!({
            "name": c.name, "aspect": c.aspect,
            "fov_x_deg": match c.camera.projection {
                Projection::Perspective { fov_x_deg } => Some(fov_x_deg),
                Projection::Orthographic { .. } => None,
            },
        })).collect::<Vec<Value>>(),
        "lights": model.lights.iter().map(kind).collect::<Vec<_>>(),
        "warnings": model.warnings,
    });
    Ok(Report { json, text })
}

fn image(source: &ImageSource) -> String {
    match source {
        ImageSource::File(file) => file.clone(),
        ImageSource::Memory(image) => format!("{}, {} bytes", image.name, image.bytes.len()),
        ImageSource::White => "vertex colours".into(),
    }
}

fn kind(light: &Light) -> &'static str {
    match light {
        Light::Distant { .. } => "directional",
        Light::Point { .. } => "point",
        Light::Spot { .. } => "spot",
        _ => "other",
    }
}
