//! Renders a scene until its standard errors are small enough.

use rayon::prelude::*;
use resolvent_api::{Affine, PluginKind};
use resolvent_engine::film::Film;
use resolvent_engine::plugin::{ForeignIntegrator, Registry};
use resolvent_engine::scene::{Counters, Scene};
use resolvent_engine::{Goal, Rendered, Settings, render};
use resolvent_tests::Moments;
use serde_json::Value;
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

/// Edge of the film: enough tiles for all threads. All of its pixels see the same ray.
pub const EDGE: u32 = 32;
const PIXELS: f64 = (EDGE * EDGE) as f64;
/// Samples of a pixel that the sampler spreads evenly.
pub const BATCH: u32 = 16;
/// Samples per pixel that estimate how many are needed.
const PILOT: u32 = BATCH;
/// Goals are aimed at with this margin, since the estimate has an error of its own.
const MARGIN: f64 = 0.92;

/// Everything is run, not only the default part.
pub fn full() -> bool {
    std::env::var_os("RESOLVENT_FULL").is_some_and(|v| v == "1")
}

/// Whether a row is to be measured: those whose names contain `RESOLVENT_ONLY`, else all. Hours of rows can so be measured in
/// parts.
pub fn chosen(row: &str) -> bool {
    std::env::var("RESOLVENT_ONLY").map_or(true, |part| row.contains(&part))
}

/// What a pixel shows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Measured {
    /// Mean radiance per lane.
    pub mean: [f64; 3],
    /// Its standard error.
    pub error: [f64; 3],
    /// Mean coverage.
    pub alpha: f64,
    /// Samples taken.
    pub samples: f64,
    /// What was counted.
    pub counters: Counters,
}

/// How exact a measurement must be.
#[derive(Clone, Copy, Debug)]
pub struct Precision {
    /// Largest standard error per lane; infinite for lanes that do not matter.
    pub error: [f64; 3],
    /// Most samples that may be taken to reach it.
    pub limit: f64,
}

impl Precision {
    /// Standard errors of 0.3 % of the values; in debug builds, which are some twenty times slower, 1.5 %.
    pub fn of(values: [f64; 3]) -> Self {
        Self::relative(values, 0.003)
    }

    /// Standard errors of `share` of the values.
    pub fn relative(values: [f64; 3], share: f64) -> Self {
        Self {
            error: values.map(|v| v.abs() * share * slack()),
            limit: 4e9,
        }
    }

    /// At least this standard error will do.
    pub fn at_least(mut self, error: f64) -> Self {
        self.error = self.error.map(|e| e.max(error * slack()));
        self
    }

    /// Lanes from `n` on do not matter.
    pub fn lanes(mut self, n: usize) -> Self {
        self.error[n..].fill(f64::INFINITY);
        self
    }
}

fn slack() -> f64 {
    if cfg!(debug_assertions) { 5.0 } else { 1.0 }
}

/// The plugins beside the test's executable.
pub fn registry() -> &'static Registry {
    static REGISTRY: OnceLock<Registry> = OnceLock::new();
    REGISTRY.get_or_init(|| {
        let registry = Registry::new(&[]);
        let mode = if cfg!(debug_assertions) {
            ""
        } else {
            " --release"
        };
        for (kind, name) in [
            (PluginKind::Integrator, "pt"),
            (PluginKind::Medium, "homogeneous"),
            (PluginKind::Phase, "hg"),
            (PluginKind::Phase, "isotropic"),
            (PluginKind::Bsdf, "diffuse"),
        ] {
            if let Err(e) = registry.find(kind, name) {
                panic!("run `cargo build{mode}` first, which builds the plugins: {e}");
            }
        }
        registry
    })
}

/// A scene ready to be rendered.
pub struct Ready {
    scene: Scene,
    integrator: ForeignIntegrator,
    resolution: [u32; 2],
    orders: usize,
}

/// Builds what a JSON scene describes.
///
/// # Errors
/// What the program would print.
pub fn build(scene: &Value) -> Result<Ready, String> {
    let text = serde_json::to_vec_pretty(scene).map_err(|e| e.to_string())?;
    let described = resolvent_scene::Scene::parse(&text, "test.json").map_err(|e| e.to_string())?;
    build_described(&described)
}

/// An example scene, by its path there, with this integrator.
///
/// # Panics
/// If it cannot be built.
pub fn open(path: &str, integrator: &str) -> Ready {
    open_with(path, |s| {
        s.integrator = resolvent_scene::PluginBlock::new(integrator);
    })
}

/// An example scene, by its path there, in [`EDGE`]² pixels.
///
/// # Panics
/// If it cannot be built.
pub fn open_small(path: &str) -> Ready {
    open_with(path, |s| s.film.resolution = [EDGE; 2])
}

/// An example scene, by its path there, changed.
///
/// # Panics
/// If it cannot be built.
pub fn open_with(path: &str, change: impl FnOnce(&mut resolvent_scene::Scene)) -> Ready {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../scenes")
        .join(path);
    let ready = resolvent_scene::Scene::read(&file)
        .map_err(|e| e.to_string())
        .and_then(|mut described| {
            change(&mut described);
            build_described(&described)
        });
    ready.unwrap_or_else(|e| panic!("{path}: {e}"))
}

fn build_described(described: &resolvent_scene::Scene) -> Result<Ready, String> {
    let scene = Scene::build(described, registry()).map_err(|e| e.to_string())?;
    let instance = registry()
        .instantiate(
            PluginKind::Integrator,
            &described.integrator,
            described,
            &Affine::IDENTITY,
            scene.lanes,
        )
        .map_err(|e| e.to_string())?;
    let integrator = ForeignIntegrator::new(instance).map_err(|e| e.to_string())?;
    Ok(Ready {
        scene,
        integrator,
        resolution: described.film.resolution,
        orders: described.film.order_layers(),
    })
}

impl Ready {
    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Renders samples `begin` to `end` of every pixel.
    ///
    /// # Panics
    /// If a plugin breaks or a sample is not finite.
    pub fn render(&self, seed: u64, begin: u32, end: u32) -> Rendered {
        let settings = Settings {
            resolution: self.resolution,
            window: [0, 0, self.resolution[0], self.resolution[1]],
            samples: begin..end,
            goal: Goal::Samples,
            seed,
            features: false,
            orders: self.orders,
        };
        let rendered = render(
            &self.scene,
            &self.integrator,
            &settings,
            &AtomicBool::new(false),
            &|_| {},
        )
        .unwrap_or_else(|e| panic!("{}", e.error));
        assert_eq!(rendered.counters.violations, 0, "majorants too small");
        rendered
    }

    /// Mean radiance of pixel `i`; of a scene with layers by scattering order, in the last that has one order alone.
    fn radiance(&self, film: &Film, i: usize) -> [f64; 3] {
        match self.orders {
            0 => film.estimate(i).mean,
            n => film.order(i, n - 2),
        }
    }

    /// The mean over all pixels of samples `begin` to `end`, and its standard error by the spread of the pixels, which are
    /// independent.
    pub fn measure_range(&self, seed: u64, begin: u32, end: u32) -> Measured {
        let rendered = self.render(seed, begin, end);
        let count = self.resolution[0] as usize * self.resolution[1] as usize;
        let mut lanes = [Moments::default(); 3];
        let mut out = Measured::default();
        for i in 0..count {
            let e = rendered.film.estimate(i);
            for (moments, mean) in lanes.iter_mut().zip(self.radiance(&rendered.film, i)) {
                moments.add(mean);
            }
            out.alpha += e.alpha / count as f64;
            out.samples += f64::from(e.samples);
        }
        out.mean = lanes.map(|m| m.mean());
        out.error = lanes.map(|m| m.standard_error());
        out.counters = rendered.counters;
        out
    }

    /// Samples until the precision is reached or its limit is.
    ///
    /// A pilot run with other random numbers decides how many samples are taken, so that the number does not depend on
    /// the result; only if that turns out to be too few are more added.
    pub fn measure(&self, seed: u64, p: &Precision) -> Measured {
        assert_eq!(self.resolution, [EDGE; 2]);
        let pilot = self.measure_range(seed ^ 0x70_696c_6f74, 0, PILOT);
        let most = (p.limit / PIXELS) as u32 / BATCH * BATCH;
        let mut needed = f64::from(BATCH);
        for (have, want) in pilot.error.iter().zip(p.error) {
            if have.is_finite() && *have > 0.0 {
                let factor = (have / (want * MARGIN)).powi(2);
                needed = needed.max(f64::from(PILOT) * factor);
            }
        }
        let mut end = round(needed, most);
        let mut all = self.measure_range(seed, 0, end);
        while !all.reaches(p) && end < most {
            let worst = all
                .error
                .iter()
                .zip(p.error)
                .map(|(have, want)| have / (want * MARGIN))
                .fold(1.0, f64::max);
            let next = round(f64::from(end) * (worst * worst).clamp(1.2, 4.0), most);
            let more = self.measure_range(seed, end, next.max(end + BATCH));
            all = all.with(&more);
            end = next.max(end + BATCH);
        }
        all
    }
}

fn round(spp: f64, most: u32) -> u32 {
    let batches = (spp / f64::from(BATCH)).ceil().min(1e8) as u32;
    (batches * BATCH).clamp(BATCH, most.max(BATCH))
}

impl Measured {
    /// True if all standard errors are small enough.
    pub fn reaches(&self, p: &Precision) -> bool {
        self.error
            .iter()
            .zip(p.error)
            .all(|(have, want)| *have <= want)
    }

    /// Of the samples of both.
    fn with(&self, o: &Self) -> Self {
        let total = self.samples + o.samples;
        let (a, b) = (self.samples / total, o.samples / total);
        let mut counters = self.counters;
        counters.add(&o.counters);
        let lanes = |f: &dyn Fn(usize) -> f64| [f(0), f(1), f(2)];
        Self {
            mean: lanes(&|i| a * self.mean[i] + b * o.mean[i]),
            error: lanes(&|i| (a * self.error[i]).hypot(b * o.error[i])),
            alpha: a * self.alpha + b * o.alpha,
            samples: total,
            counters,
        }
    }
}

/// Builds and measures a scene; its name decides the random numbers. `RESOLVENT_ROWS` prints every result at once.
///
/// # Panics
/// If it cannot be built or rendered.
pub fn measure(scene: &Value, name: &str, p: &Precision) -> Measured {
    let start = std::time::Instant::now();
    let ready = build(scene).unwrap_or_else(|e| panic!("{name}: {e}"));
    let m = ready.measure(hash(name), p);
    if std::env::var_os("RESOLVENT_ROWS").is_some() {
        let (mean, error, seconds) = (m.mean, m.error, start.elapsed().as_secs_f64());
        println!(
            "{name}: {:.4e} {:.4e} {:.4e} ± {:.1e} {:.1e} {:.1e}, {:.1e} samples, {seconds:.2} s",
            mean[0], mean[1], mean[2], error[0], error[1], error[2], m.samples
        );
    }
    m
}

/// Calls `f` for all rows, in parallel, and keeps their order.
pub fn each<T: Sync, R: Send>(rows: &[T], f: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    rows.par_iter().map(f).collect()
}

/// A table of `data/physics`.
///
/// # Panics
/// If it cannot be read.
pub fn table(name: &str) -> Value {
    let path = format!("{}/data/physics/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The list under a key.
pub fn list<'a>(v: &'a Value, key: &str) -> &'a [Value] {
    v[key]
        .as_array()
        .unwrap_or_else(|| panic!("no list '{key}'"))
}

/// The number under a key.
pub fn number(v: &Value, key: &str) -> f64 {
    v[key]
        .as_f64()
        .unwrap_or_else(|| panic!("no number '{key}' in {v}"))
}

/// The three numbers under a key.
pub fn vector(v: &Value, key: &str) -> [f64; 3] {
    let all = list(v, key);
    [0, 1, 2].map(|i| {
        all[i]
            .as_f64()
            .unwrap_or_else(|| panic!("'{key}' is no vector"))
    })
}

/// The text under a key.
pub fn text<'a>(v: &'a Value, key: &str) -> &'a str {
    v[key].as_str().unwrap_or_else(|| panic!("no text '{key}'"))
}

/// A number made of a text, for seeds and for choosing rows (FNV-1a).
pub fn hash(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |h, b| {
        (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
    })
}
