//! Models in scenes: shapes of the type `gltf` become the meshes and materials of their files.

use resolvent_scene::{Geometry, ImageSource, Instance, Scene, Shape, Transform};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use crate::error::Error;
use crate::model::Model;

/// True if the scene names models.
pub fn has_models(scene: &Scene) -> bool {
    scene
        .all_shapes()
        .any(|s| matches!(s.geometry, Geometry::Gltf { .. }))
}

/// Replaces every model by its meshes, with their materials, media and textures, and returns what could not be shown as it is
/// meant. A mesh that several nodes show becomes a prototype and its instances, in prototypes of the scene copies.
/// Cameras and punctual lights of models are for who renders a model alone: a scene has its own.
///
/// # Errors
/// If a model cannot be read.
pub fn expand(scene: &mut Scene) -> Result<Vec<String>, Error> {
    let mut expansion = Expansion {
        models: HashMap::new(),
        warnings: Vec::new(),
        numbers: HashMap::new(),
    };
    let mut shapes = Vec::new();
    for shape in std::mem::take(&mut scene.shapes) {
        expansion.shape(scene, shape, &mut shapes, true)?;
    }
    scene.shapes = shapes;
    for (name, group) in std::mem::take(&mut scene.prototypes) {
        let mut shapes = Vec::new();
        for shape in group {
            expansion.shape(scene, shape, &mut shapes, false)?;
        }
        scene.prototypes.insert(name, shapes);
    }
    Ok(expansion.warnings)
}

struct Expansion {
    models: HashMap<String, Arc<Model>>,
    warnings: Vec<String>,
    /// By a name that was taken, the number of the last one made of it.
    numbers: HashMap<String, usize>,
}

impl Expansion {
    fn shape(
        &mut self,
        scene: &mut Scene,
        shape: Shape,
        out: &mut Vec<Shape>,
        instances: bool,
    ) -> Result<(), Error> {
        let Geometry::Gltf { file, transform } = &shape.geometry else {
            out.push(shape);
            return Ok(());
        };
        let model = self.model(scene, file)?;
        let mut left = model.allowance;
        for mesh in &model.meshes {
            // Emitting copies are lights of their own, so nothing is shared between them.
            let emits = mesh.shapes.iter().any(|s| s.emission.is_some());
            if instances && !emits && mesh.places.len() > 1 {
                let name = self.unused(scene, format!("{file}: {}", mesh.name));
                scene.prototypes.insert(name.clone(), mesh.shapes.clone());
                scene
                    .instances
                    .extend(mesh.places.iter().map(|place| Instance {
                        prototype: name.clone(),
                        transform: place.then(transform),
                        transforms: None,
                        material: shape.material.clone(),
                    }));
                continue;
            }
            let copied = (mesh.places.len() - 1).saturating_mul(mesh.triangles());
            left = left.checked_sub(copied).ok_or_else(|| {
                let why = if emits {
                    "it emits, so nothing is shared between them; let one mesh emit, or fewer"
                } else {
                    "in a prototype nothing is shared between them; name the model outside of prototypes"
                };
                let places = mesh.places.len();
                Error::invalid(
                    &scene.resolve(file),
                    format!(
                        "the mesh '{}' at {places} places makes more triangles than a file of its size can describe: {why}",
                        mesh.name
                    ),
                )
            })?;
            for place in &mesh.places {
                for own in &mesh.shapes {
                    out.push(placed(own, &place.then(transform), &shape));
                }
            }
        }
        Ok(())
    }

    /// A name that no prototype has. Numbers go on where they ended, so that many meshes may have one name.
    fn unused(&mut self, scene: &Scene, name: String) -> String {
        if !scene.prototypes.contains_key(&name) {
            return name;
        }
        let n = self.numbers.entry(name.clone()).or_insert(1);
        loop {
            *n += 1;
            let unused = format!("{name} ({n})");
            if !scene.prototypes.contains_key(&unused) {
                return unused;
            }
        }
    }

    /// The model of a file, read once; its materials are the scene's from then on.
    fn model(&mut self, scene: &mut Scene, file: &str) -> Result<Arc<Model>, Error> {
        if let Some(model) = self.models.get(file) {
            return Ok(model.clone());
        }
        let mut model = Model::read(scene.resolve(file))?;
        // Another file of the same name, or a user, may have taken a name.
        let taken = |name: &String| {
            scene.materials.contains_key(name)
                || scene.textures.contains_key(name)
                || scene.media.contains_key(name)
        };
        let mut names = model
            .materials
            .keys()
            .chain(model.textures.keys())
            .chain(model.media.keys());
        if names.any(taken) {
            rename(&mut model, &format!("{file} "));
        }
        for warning in &model.warnings {
            self.warnings.push(format!("{file}: {warning}"));
        }
        // The model names images from its own folder.
        for texture in model.textures.values_mut() {
            if let ImageSource::File(image) = &mut texture.image
                && let Some(folder) = Path::new(file).parent()
            {
                *image = folder.join(&*image).to_string_lossy().into_owned();
            }
        }
        scene.textures.extend(model.textures.clone());
        scene.materials.extend(model.materials.clone());
        scene.media.extend(model.media.clone());
        let model = Arc::new(model);
        self.models.insert(file.to_owned(), model.clone());
        Ok(model)
    }
}

fn placed(own: &Shape, place: &Transform, given: &Shape) -> Shape {
    let mut shape = own.clone();
    if let Geometry::Mesh(mesh) = &mut shape.geometry {
        mesh.transform = *place;
    }
    if given.material.is_some() {
        shape.material = given.material.clone();
        shape.emission = None;
        shape.emission_texture = None;
    }
    if given.emission.is_some() {
        shape.emission = given.emission;
        shape.emission_texture = given.emission_texture.clone();
        shape.two_sided = given.two_sided;
        shape.shaping = given.shaping;
    }
    if given.interior.is_some() {
        shape.interior = given.interior.clone();
    }
    shape.priority = given.priority;
    shape
}

/// Puts `prefix` before all names of a model.
fn rename(model: &mut Model, prefix: &str) {
    let renamed = |name: &String| format!("{prefix}{name}");
    fn block(block: &mut resolvent_scene::PluginBlock, prefix: &str) {
        for param in block.params.values_mut() {
            match &mut param.value {
                resolvent_scene::Value::Texture(name) => *name = format!("{prefix}{name}"),
                resolvent_scene::Value::Object(inner) => block_of(inner, prefix),
                _ => {}
            }
        }
    }
    fn block_of(inner: &mut resolvent_scene::PluginBlock, prefix: &str) {
        block(inner, prefix);
    }
    model.textures = std::mem::take(&mut model.textures)
        .into_iter()
        .map(|(n, t)| (renamed(&n), t))
        .collect();
    model.media = std::mem::take(&mut model.media)
        .into_iter()
        .map(|(n, m)| (renamed(&n), m))
        .collect();
    model.materials = std::mem::take(&mut model.materials)
        .into_iter()
        .map(|(n, mut m)| {
            block(&mut m.block, prefix);
            if let Some(map) = &mut m.normal_map {
                map.texture = renamed(&map.texture);
            }
            (renamed(&n), m)
        })
        .collect();
    for shape in model.meshes.iter_mut().flat_map(|m| &mut m.shapes) {
        for name in [
            &mut shape.material,
            &mut shape.interior,
            &mut shape.emission_texture,
        ]
        .into_iter()
        .flatten()
        {
            *name = renamed(name);
        }
    }
}
