//! A scene for a bare glTF model: what it says itself, and guesses for what it does not.

use super::{Notes, SPP, camera, lights};
use crate::args::{Guesses, Render, Up};
use crate::console;
use crate::failure::{Outcome, input};
use resolvent_gltf::Model;
use resolvent_scene::{
    Budget, Camera, Film, Geometry, IndexMap, Light, PluginBlock, Projection, Sampling, Scene,
    Shape, Source, Transform, Units,
};
use std::path::Path;

/// Directions in which the outline is searched.
const DIRECTIONS: usize = 256;

/// A scene that shows the model in the file at `path`.
pub fn scene(path: &Path, a: &Render) -> Outcome<Scene> {
    let name = path.to_str().ok_or_else(|| {
        input(format!(
            "{}: scenes cannot hold this path, which is no Unicode text",
            path.display()
        ))
    })?;
    if let Some(option) = a.guesses.of_volumes() {
        return Err(input(format!(
            "{option} is for VDB files; {} is a model",
            path.display()
        )));
    }
    let model = Model::read(path).map_err(input)?;
    if model.bounds().is_none() {
        return Err(input(format!(
            "{}: has no triangles: there is nothing to render",
            path.display()
        )));
    }
    let mut notes = Notes::default();
    let g = &a.guesses;
    // Up is y by the specification.
    let view = camera::View::new(g.up.unwrap_or(Up::Y));
    let (camera, resolution) = shot(&view, &model, path, a, &mut notes);
    let lights = light(&view, &model, g, &mut notes);
    if a.spp.is_none() && a.time.is_none() && a.error.is_none() && a.sample_range.is_none() {
        notes.add("--spp", SPP.to_string(), "more samples, less noise");
    }
    notes.print(path);
    Ok(Scene {
        source: Source::default(),
        units: Units::default(),
        camera,
        film: Film {
            resolution,
            ..Film::default()
        },
        sampling: Sampling {
            budget: Budget::Spp(SPP),
            seed: 0,
        },
        integrator: PluginBlock::new("pt"),
        lights,
        textures: IndexMap::new(),
        materials: IndexMap::new(),
        media: IndexMap::new(),
        shapes: vec![Shape {
            geometry: Geometry::Gltf {
                file: name.to_owned(),
                transform: Transform::IDENTITY,
            },
            material: None,
            emission: None,
            emission_texture: None,
            two_sided: false,
            shaping: None,
            interior: None,
            priority: 0,
        }],
        prototypes: IndexMap::new(),
        instances: Vec::new(),
    })
}

/// The model's first camera, or one that has all of it in its picture.
fn shot(
    view: &camera::View,
    model: &Model,
    path: &Path,
    a: &Render,
    notes: &mut Notes,
) -> (Camera, [u32; 2]) {
    let g = &a.guesses;
    let Some(own) = model.cameras.first().filter(|_| g.camera.is_none()) else {
        let shot = camera::frame(view, &outline(model), "model", a, notes);
        return (shot.camera, shot.resolution);
    };
    let all = model.cameras.len();
    let rest = if all > 1 {
        format!(", the first of {all}")
    } else {
        String::new()
    };
    console::info(format!(
        "{}: the camera is the model's '{}'{rest}; --camera and --fov replace it",
        path.display(),
        own.name.escape_debug()
    ));
    let aspect = own.aspect.unwrap_or(16.0 / 9.0);
    let resolution = a.resolution.map_or_else(
        || {
            let [w, h] = camera::size(aspect);
            notes.add(
                "--resolution",
                format!("{w}x{h}"),
                "in the shape of the camera's picture",
            );
            [w, h]
        },
        |r| r.0,
    );
    let mut camera = own.camera.clone();
    if let Projection::Perspective { fov_x_deg } = &mut camera.projection {
        if own.aspect.is_none() {
            // The field of view is that of a square picture, and the height is what glTF states.
            let [w, h] = resolution.map(f64::from);
            let half = (0.5 * *fov_x_deg).to_radians().tan() * w / h;
            *fov_x_deg = 2.0 * half.atan().to_degrees();
        }
        if let Some(fov) = g.fov {
            *fov_x_deg = fov.min(179.0);
        }
    }
    (camera, resolution)
}

/// The model's lights; a sun and a sky if nothing in it shines, or if they are asked for.
fn light(view: &camera::View, model: &Model, g: &Guesses, notes: &mut Notes) -> Vec<Light> {
    let shines = !model.lights.is_empty() || model.glows();
    let mut all = model.lights.clone();
    if !shines {
        all.extend(lights(view, g, notes));
    } else if g.sun.is_some() || g.sky.is_some() {
        // What is not asked for is not added.
        let asked = Guesses {
            sun: g.sun.or(Some(crate::values::MaybeDirection(None))),
            sky: g.sky.or(Some(crate::values::MaybeColor(None))),
            sun_irradiance: g.sun_irradiance,
            ..Guesses::default()
        };
        all.extend(lights(view, &asked, notes));
    }
    all
}

/// The farthest vertices in many directions: the vertices of a polytope inside the convex hull.
fn outline(model: &Model) -> Vec<[f64; 3]> {
    let directions: Vec<[f64; 3]> = (0..DIRECTIONS)
        .map(|i| crate::volume::spread(i, DIRECTIONS))
        .collect();
    let mut best = vec![(f64::NEG_INFINITY, [0.0; 3]); DIRECTIONS];
    model.for_each_point(|p| {
        for (d, best) in directions.iter().zip(&mut best) {
            let reach = d[0] * p[0] + d[1] * p[1] + d[2] * p[2];
            if reach > best.0 {
                *best = (reach, p);
            }
        }
    });
    best.into_iter().map(|(_, p)| p).collect()
}
