//! Renders scenes through the engine, and says how that failed.

use crate::build;
use resolvent_api::{Affine, PluginKind};
use resolvent_engine::plugin::{ForeignIntegrator, Registry};
use resolvent_engine::scene::{Counters, Scene};
use resolvent_engine::{Goal, Rendered, Settings, render};
use resolvent_tests::Moments;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Edge of the pictures: four tiles.
pub const EDGE: u32 = 32;

/// A failure as a program would print it, and what was kept.
#[derive(Debug)]
pub struct Fault {
    /// The message.
    pub text: String,
    /// What was finished before.
    pub kept: Option<Box<Picture>>,
}

/// A picture.
#[derive(Debug)]
pub struct Picture {
    /// Mean radiance of every pixel, three lanes.
    pub pixels: Vec<[f64; 3]>,
    /// Variance of the mean of every pixel.
    pub variances: Vec<Option<[f64; 3]>>,
    /// What was counted.
    pub counters: Counters,
    /// Samples that every pixel has.
    pub samples: u32,
}

impl Picture {
    fn new(r: &Rendered) -> Self {
        let [w, h] = r.film.size();
        let all = (0..(w * h) as usize).map(|i| r.film.estimate(i));
        let (pixels, variances) = all.map(|e| (e.mean, e.variance)).unzip();
        Self {
            pixels,
            variances,
            counters: r.counters,
            samples: r.samples,
        }
    }

    /// Mean over all pixels of a lane, with the standard error from the spread of the pixels: only for pictures whose pixels
    /// should be equal.
    pub fn flat(&self, lane: usize) -> Moments {
        Moments::of(self.pixels.iter().map(|p| p[lane]))
    }

    /// Mean over pixels and its standard error, of a lane in a block of the picture.
    pub fn block(&self, lane: usize, [x0, y0, x1, y1]: [u32; 4]) -> (f64, f64) {
        let (mut mean, mut variance, mut n) = (0.0, 0.0, 0.0);
        for y in y0..y1 {
            for x in x0..x1 {
                let i = (y * EDGE + x) as usize;
                mean += self.pixels[i][lane];
                variance += self.variances[i].map_or(f64::INFINITY, |v| v[lane]);
                n += 1.0;
            }
        }
        (mean / n, variance.sqrt() / n)
    }
}

/// The plugins beside the executable, after those of the fixtures.
pub fn registry() -> Registry {
    registry_before(&[build::unruly_folder()])
}

/// A registry that searches `first` before the plugins beside the executable.
pub fn registry_before(first: &[std::path::PathBuf]) -> Registry {
    let registry = Registry::new(first);
    let mode = if cfg!(debug_assertions) {
        ""
    } else {
        " --release"
    };
    for (kind, name) in [
        (PluginKind::Integrator, "pt"),
        (PluginKind::Medium, "homogeneous"),
        (PluginKind::Phase, "isotropic"),
        (PluginKind::Bsdf, "diffuse"),
    ] {
        if let Err(e) = registry.find(kind, name) {
            panic!("run `cargo build{mode}` first, which builds the plugins: {e}");
        }
    }
    registry
}

/// A scene in the light of a uniform environment and a point, seen from −z; the rest is to be filled in.
pub fn scene() -> Value {
    json!({
        "resolvent": 1,
        "camera": {
            "type": "perspective", "origin": [0.5, 0.5, -3], "target": [0.5, 0.5, 0], "fov_x_deg": 20
        },
        "film": { "resolution": [EDGE, EDGE] },
        "sampling": { "spp": 32 },
        "integrator": { "plugin": "pt" },
        "lights": [
            { "type": "environment", "radiance": 1 },
            { "type": "point", "position": [0.5, 3, -2], "intensity": 4 }
        ],
        "media": {},
        "materials": {},
        "shapes": []
    })
}

/// The unruly medium.
pub fn cloud(mode: &str) -> Value {
    let mut s = scene();
    s["media"]["cloud"] = json!({ "plugin": "unruly", "params": { "mode": mode } });
    s
}

/// A well-behaved medium with the unruly phase function.
pub fn haze(mode: &str) -> Value {
    let mut s = scene();
    s["media"]["haze"] = json!({
        "plugin": "homogeneous",
        "params": {
            "sigma_t": 2, "albedo": 0.9, "bounds": [0, 0, 0, 1, 1, 1],
            "phase": { "plugin": "unruly", "params": { "mode": mode } }
        }
    });
    s
}

/// A wall with the unruly BSDF.
pub fn wall(mode: &str) -> Value {
    let mut s = scene();
    s["materials"]["plaster"] = json!({ "plugin": "unruly", "params": { "mode": mode } });
    s["shapes"] = json!([{
        "type": "rectangle", "corner": [0, 0, 0], "edge_u": [0, 1, 0], "edge_v": [1, 0, 0], "material": "plaster"
    }]);
    s
}

/// An empty scene with the unruly integrator.
pub fn walk(mode: &str) -> Value {
    let mut s = scene();
    s["integrator"] = json!({ "plugin": "unruly", "params": { "mode": mode } });
    s
}

/// A scene ready to be rendered.
pub struct Ready {
    scene: Scene,
    integrator: ForeignIntegrator,
    orders: usize,
}

/// The description, as if read from a file in the sources of these tests.
pub fn describe(scene: &Value) -> Result<resolvent_scene::Scene, String> {
    let text = serde_json::to_vec_pretty(scene).map_err(|e| e.to_string())?;
    let file = build::package().join("fixtures/test.json");
    resolvent_scene::Scene::parse(&text, file).map_err(|e| e.to_string())
}

/// Builds what a JSON scene describes.
pub fn ready(scene: &Value, registry: &Registry) -> Result<Ready, String> {
    let described = describe(scene)?;
    let scene = Scene::build(&described, registry).map_err(|e| e.to_string())?;
    let block = &described.integrator;
    let instance = registry
        .instantiate(
            PluginKind::Integrator,
            block,
            &described,
            &Affine::IDENTITY,
            scene.lanes,
        )
        .map_err(|e| e.to_string())?;
    let integrator = ForeignIntegrator::new(instance).map_err(|e| e.to_string())?;
    Ok(Ready {
        scene,
        integrator,
        orders: described.film.order_layers(),
    })
}

/// Renders `samples` per pixel.
pub fn picture(scene: &Value, registry: &Registry, samples: u32) -> Result<Picture, Fault> {
    let ready = ready(scene, registry).map_err(|text| Fault { text, kept: None })?;
    let settings = Settings {
        resolution: [EDGE; 2],
        window: [0, 0, EDGE, EDGE],
        samples: 0..samples,
        goal: Goal::Samples,
        seed: 1,
        features: false,
        orders: ready.orders,
    };
    let stop = AtomicBool::new(false);
    match render(&ready.scene, &ready.integrator, &settings, &stop, &|_| {}) {
        Ok(r) => Ok(Picture::new(&r)),
        Err(b) => Err(Fault {
            text: b.error.to_string(),
            kept: b.rendered.map(|r| Box::new(Picture::new(&r))),
        }),
    }
}

/// The message of a scene that must fail.
#[track_caller]
pub fn fault(scene: &Value) -> Fault {
    match picture(scene, &registry(), 32) {
        Err(fault) => fault,
        Ok(_) => panic!("no error from {scene}"),
    }
}

/// Checks that a message is one sentence that has all of these words.
#[track_caller]
pub fn says(text: &str, words: &[&str]) {
    for word in words {
        assert!(text.contains(word), "'{word}' is not in: {text}");
    }
    assert_eq!(text.lines().count(), 1, "more than one line: {text}");
    for noise in ["RUST_BACKTRACE", "called `Result", "stack backtrace"] {
        assert!(!text.contains(noise), "'{noise}' is in: {text}");
    }
}

/// Checks that a message is one sentence that names the plugin of a kind by name and library, and has these words.
#[track_caller]
pub fn blames(text: &str, kind: &str, library: &Path, words: &[&str]) {
    says(
        text,
        &[&format!("{kind} plugin 'unruly' ({})", library.display())],
    );
    says(text, words);
}
