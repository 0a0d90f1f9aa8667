//! A scene for a bare volume or model: every choice follows a stated rule, is printed with the option that replaces it, and can be
//! saved as a scene.

mod camera;
mod emission;
mod grids;
mod model;

pub use model::scene as model;

use crate::args::{Guesses, Render, Up};
use crate::console;
use crate::failure::{Outcome, input};
use crate::info::short;
use crate::volume::{self, Measures};
use resolvent_scene::{
    Budget, Environment, Film, IndexMap, Light, Medium, PluginBlock, Sampling, Scene, Source,
    Transform, Units,
};
use resolvent_vdb::File;
use std::path::Path;

/// Optical thickness of the volume: the mean over three lines through its centre of mass.
const THICKNESS: f64 = 40.0;
/// The same where something glows inside, which smoke must let through.
const THICKNESS_OF_FIRE: f64 = 10.0;
/// Droplets scatter nearly everything, forward.
const ALBEDO: [f64; 3] = [0.99; 3];
const G: f64 = 0.85;
/// A warm sun and a blue sky, as bright as a display can show without exposure.
const SUN: [f64; 3] = [5.0, 4.75, 4.3];
const SKY: [f64; 3] = [0.06, 0.11, 0.2];
/// Full angle of the sun seen from the earth, degrees.
const SUN_ANGLE: f64 = 0.53;
const SPP: u64 = 64;

/// What was chosen, in lines `--option value   why`.
#[derive(Default)]
struct Notes(Vec<(String, String)>);

impl Notes {
    fn add(&mut self, option: &str, value: impl AsRef<str>, why: impl Into<String>) {
        self.0
            .push((format!("{option} {}", value.as_ref()), why.into()));
    }

    fn print(&self, path: &Path) {
        if self.0.is_empty() {
            return;
        }
        console::info(format!(
            "guessed for {}; each option replaces a guess, --save-scene writes them as a scene:",
            path.display()
        ));
        for (option, why) in &self.0 {
            console::info(format!("  {option:<44} {why}"));
        }
    }
}

/// A scene that shows the volume in the file at `path`.
pub fn scene(path: &Path, a: &Render) -> Outcome<Scene> {
    let name = path.to_str().ok_or_else(|| {
        input(format!(
            "{}: scenes cannot hold this path, which is no Unicode text",
            path.display()
        ))
    })?;
    let g = &a.guesses;
    let file = File::open(path).map_err(input)?;
    let mut notes = Notes::default();
    let density = grids::density(&file, g, &mut notes)?;
    let measures = volume::measure(&file, density)
        .map_err(input)?
        .ok_or_else(|| {
            input(format!(
                "{}: grid '{}': holds no positive values: there is nothing to render",
                path.display(),
                density.unique_name.escape_debug()
            ))
        })?;

    let glow = emission::find(&file, g, &measures, &mut notes)?;
    let thickness = if glow.is_empty() {
        THICKNESS
    } else {
        THICKNESS_OF_FIRE
    };
    let mut block = PluginBlock::new("vdb")
        .with("file", name)
        .with("grid", density.unique_name.as_str())
        .with("sigma_t", extinction(&measures, thickness, g, &mut notes))
        .with("albedo", albedo(g, &mut notes));
    for (name, value) in glow {
        block = block.with(name, value);
    }
    block = block.with("phase", phase(g, &mut notes));

    let up = up(&file, g, &mut notes);
    let view = camera::View::new(up);
    let shot = camera::frame(&view, &measures.outline, "volume", a, &mut notes);
    let lights = lights(&view, g, &mut notes);
    if a.spp.is_none() && a.time.is_none() && a.error.is_none() && a.sample_range.is_none() {
        notes.add("--spp", SPP.to_string(), "more samples, less noise");
    }
    notes.print(path);
    Ok(Scene {
        source: Source::default(),
        units: Units::default(),
        camera: shot.camera,
        film: Film {
            resolution: shot.resolution,
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
        media: IndexMap::from([(
            "volume".to_owned(),
            Medium {
                block,
                transform: Transform::IDENTITY,
            },
        )]),
        shapes: Vec::new(),
        prototypes: IndexMap::new(),
        instances: Vec::new(),
    })
}

/// Extinction where the grid is 1.
fn extinction(m: &Measures, thickness: f64, g: &Guesses, notes: &mut Notes) -> f64 {
    if let Some(scale) = g.density_scale {
        return scale;
    }
    let target = g.optical_thickness.unwrap_or(thickness);
    let mean = m.lines.iter().sum::<f64>() / 3.0;
    // A shell has nothing on the lines through its centre: then a third of its box, filled with its mean value.
    let [lo, hi] = m.bounds;
    let third = (0..3).map(|a| hi[a] - lo[a]).sum::<f64>() / 9.0 * m.mean;
    let (per_unit, rule) = if mean > 1e-3 * third {
        (
            mean,
            "on average along x, y and z through the centre of mass",
        )
    } else {
        (third, "through a third of its bounds at its mean density")
    };
    let scale = (target / per_unit).clamp(1e-30, 1e30);
    notes.add(
        "--density-scale",
        short(scale),
        format!("extinction where the grid is 1: optical thickness {target} {rule}"),
    );
    scale
}

fn albedo(g: &Guesses, notes: &mut Notes) -> [f64; 3] {
    g.albedo.map_or_else(
        || {
            notes.add("--albedo", short(ALBEDO[0]), "as clouds");
            ALBEDO
        },
        |a| a.0,
    )
}

fn phase(g: &Guesses, notes: &mut Notes) -> PluginBlock {
    let g = g.g.unwrap_or_else(|| {
        notes.add("--g", short(G), "scatters forward, as droplets do");
        G
    });
    PluginBlock::new("hg").with("g", g)
}

/// Blender's files say who wrote them, and have z up.
fn up(file: &File, g: &Guesses, notes: &mut Notes) -> Up {
    if let Some(up) = g.up {
        return up;
    }
    let blender = file.metadata().iter().any(|e| {
        e.name.starts_with("blender/")
            || e.name == "creator"
                && file
                    .metadata()
                    .string("creator")
                    .is_some_and(|c| c.contains("Blender"))
    });
    if blender {
        notes.add("--up", "z", "the file was written by Blender");
        Up::Z
    } else {
        notes.add("--up", "y", "as Houdini has it");
        Up::Y
    }
}

fn lights(view: &camera::View, g: &Guesses, notes: &mut Notes) -> Vec<Light> {
    let mut lights = Vec::new();
    let sun = match g.sun {
        Some(sun) => sun.0,
        None => {
            let d = view.sun();
            notes.add(
                "--sun",
                numbers(d),
                "direction to it, or none: behind the camera's left shoulder",
            );
            Some(d)
        }
    };
    if let Some(to_light) = sun {
        let irradiance = g.sun_irradiance.map_or_else(
            || {
                notes.add("--sun-irradiance", numbers(SUN), "a warm white");
                SUN
            },
            |c| c.0,
        );
        lights.push(Light::Distant {
            to_light,
            irradiance,
            angle_deg: SUN_ANGLE,
        });
    }
    let sky = match g.sky {
        Some(sky) => sky.0,
        None => {
            notes.add("--sky", numbers(SKY), "radiance from everywhere, or none");
            Some(SKY)
        }
    };
    if let Some(radiance) = sky {
        lights.push(Light::Environment(Environment::Constant { radiance }));
    }
    lights
}

/// `X,Y,Z`, as options take it.
fn numbers(v: [f64; 3]) -> String {
    v.map(short).join(",")
}
