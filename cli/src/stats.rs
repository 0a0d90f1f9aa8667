//! Figures about a run: `--stats`, and the metadata of pictures.

use crate::args::Render;
use crate::console;
use crate::failure::{Outcome, failed};
use crate::overrides::Plan;
use crate::progress;
use resolvent_engine::film::{Errors, Film, Interval, TOO_FAINT};
use resolvent_engine::plugin::Registry;
use resolvent_engine::scene::{Preparation, Scene};
use resolvent_engine::{Goal, Rendered};
use resolvent_scene as describe;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Wall-clock seconds of the phases of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seconds {
    /// Reading the scene, or choosing one for a volume.
    pub parse: f64,
    /// Plugins and lights.
    pub plugins: f64,
    /// Media, their files included.
    pub media: f64,
    /// Surfaces and their hierarchy.
    pub geometry: f64,
    /// Rendering.
    pub render: f64,
    /// Writing pictures.
    pub write: f64,
    /// Everything.
    pub total: f64,
    /// CPU seconds of all threads while rendering; 0 where the system does not say.
    pub render_cpu: f64,
}

impl Seconds {
    /// Takes the times of building a scene.
    pub fn build(&mut self, p: &Preparation) {
        self.media = p.media_seconds;
        self.geometry = p.geometry_seconds;
        self.plugins = (p.total_seconds - p.media_seconds - p.geometry_seconds).max(0.0);
    }
}

/// A finished run.
pub struct Run<'r> {
    /// Options.
    pub args: &'r Render,
    /// The scene as described.
    pub described: &'r describe::Scene,
    /// Plugins.
    pub registry: &'r Registry,
    /// The scene as built.
    pub scene: &'r Scene,
    /// What came out.
    pub rendered: &'r Rendered,
    /// What was to be done.
    pub plan: &'r Plan,
    /// Bytes of memory that sums and picture take.
    pub memory: u64,
    /// Times.
    pub seconds: Seconds,
    /// How certain it is.
    pub certainty: &'r Certainty,
}

/// Samples taken over all pixels.
pub fn total_samples(rendered: &Rendered) -> u64 {
    let [w, h] = rendered.film.size();
    (0..w as usize * h as usize)
        .map(|i| u64::from(rendered.film.estimate(i).samples))
        .sum()
}

/// How certain a picture is.
pub struct Certainty {
    faint: bool,
    errors: Option<Errors>,
    interval: Option<Interval>,
}

impl Certainty {
    /// Of a film.
    pub fn of(film: &Film) -> Self {
        Self {
            faint: film.is_faint(),
            errors: film.errors(),
            interval: film.interval(),
        }
    }

    /// Says so if the error is not known, or not to be trusted.
    pub fn tell(&self) {
        if self.faint {
            console::warning(TOO_FAINT);
        }
        if self.errors.is_some_and(|e| e.are_doubtful()) {
            console::info(
                "few pixels have most of the estimated error: light that is rare and bright may be missing, and the true error be larger than stated",
            );
        }
    }

    /// For people: samples, error, time.
    pub fn summary(&self, rendered: &Rendered) -> String {
        let mut text = spp(rendered);
        if let Some(e) = self.errors {
            text += &format!(
                ", estimated error {}, worst tile {}",
                progress::percent(e.picture),
                progress::percent(e.worst_tile)
            );
        }
        text + &format!(", {}", progress::duration(rendered.seconds))
    }
}

/// Samples per pixel for people.
fn spp(rendered: &Rendered) -> String {
    let [low, mean, high] = samples(rendered);
    if low == high {
        format!("{low} spp")
    } else {
        format!("{low} to {high} spp, on average {mean:.0}")
    }
}

/// Samples per pixel: the least, the mean, the most.
fn samples(rendered: &Rendered) -> [f64; 3] {
    let film = &rendered.film;
    let [w, h] = film.size();
    let count = w as usize * h as usize;
    let all = (0..count).map(|i| f64::from(film.estimate(i).samples));
    let (low, sum, high) = all.fold((f64::INFINITY, 0.0, 0f64), |(low, sum, high), n| {
        (low.min(n), sum + n, high.max(n))
    });
    [low, sum / count.max(1) as f64, high]
}

/// What a picture was made from.
pub struct About {
    /// The file that was rendered.
    pub input: String,
    /// The integrator as errors name it.
    pub integrator: String,
}

/// What pictures say about how they were made.
pub fn metadata(
    about: &About,
    scene: &describe::Scene,
    rendered: &Rendered,
    certainty: &Certainty,
) -> BTreeMap<String, String> {
    let version = env!("CARGO_PKG_VERSION");
    let mut all = BTreeMap::new();
    let mut put = |key: &str, value: String| drop(all.insert(key.to_owned(), value));
    put("software", format!("resolvent {version}"));
    put("version", version.to_owned());
    put("scene", about.input.clone());
    put("seed", scene.sampling.seed.to_string());
    put("samples", rendered.samples.to_string());
    put("integrator", about.integrator.clone());
    put("seconds", format!("{:.3}", rendered.seconds));
    match &rendered.adaptive {
        Some(adaptive) => put("error_goal", adaptive.goal().to_string()),
        None => put("sample_range", sample_range(&rendered.film)),
    }
    let [low, mean, high] = samples(rendered);
    if low < high {
        put("mean_samples", format!("{mean:.3}"));
        put("most_samples", high.to_string());
    }
    if let Some(e) = certainty.errors {
        put("estimated_error", format!("{:.6}", e.picture));
        put("worst_tile_error", format!("{:.6}", e.worst_tile));
        put("error_is_doubtful", e.are_doubtful().to_string());
    }
    if let Some(i) = certainty.interval {
        let three = |v: [f64; 3]| v.map(|x| format!("{x:e}")).join(" ");
        put("mean", three(i.mean));
        put("mean_error_95", three(i.half_width));
    }
    if rendered.interrupted {
        put("interrupted", "true".to_owned());
    }
    all
}

/// The samples that every pixel has.
fn sample_range(film: &Film) -> String {
    let tiles = 0..film.tiles().len();
    tiles
        .map(|i| film.coverage(i))
        .min_by_key(|c| c.samples())
        .map_or_else(String::new, ToString::to_string)
}

/// Writes the figures.
pub fn write(run: &Run, file: &Path) -> Outcome<()> {
    let text = format!("{:#}\n", figures(run));
    resolvent_image::write_atomically(file, |out| {
        use std::io::Write;
        out.write_all(text.as_bytes())
            .map_err(|source| resolvent_image::Error::Io {
                file: file.to_path_buf(),
                what: "cannot write: ",
                source,
            })
    })
    .map_err(failed)
}

fn figures(run: &Run) -> Value {
    let r = run.rendered;
    let c = &r.counters;
    let s = &run.seconds;
    let errors = run.certainty.errors;
    let [_, mean_samples, most_samples] = samples(r);
    json!({
        "resolvent": env!("CARGO_PKG_VERSION"),
        "input": run.args.input,
        "plugins": plugins(run.registry),
        "files": files(run.described, run.registry),
        "media": media(run.scene),
        "textures": textures(run.scene),
        "geometry": geometry(run.scene),
        "lights": run.scene.light_count(),
        "image": {
            "resolution": run.described.film.resolution,
            "window": run.described.film.window(),
            "memory_bytes": run.memory,
        },
        "sampling": {
            "seed": run.described.sampling.seed,
            "sample_range": r.adaptive.is_none().then(|| sample_range(&r.film)),
            "samples_per_pixel": r.samples,
            "mean_samples_per_pixel": mean_samples,
            "most_samples_per_pixel": most_samples,
            "samples": total_samples(r),
            "goal": match run.plan.goal {
                Goal::Samples => json!({"samples": run.plan.samples.len()}),
                Goal::Time(t) => json!({"seconds": t.as_secs_f64()}),
                Goal::Error(e) => json!({"error": e}),
            },
            "interrupted": r.interrupted,
            "estimated_error": errors.map(|e| e.picture),
            "worst_tile_error": errors.map(|e| e.worst_tile),
            "error_is_doubtful": errors.map(|e| e.are_doubtful()),
            "mean": run.certainty.interval.map(|i| json!({
                "value": i.mean,
                "error_95": i.half_width,
                "degrees_of_freedom": i.degrees.is_finite().then_some(i.degrees),
            })),
        },
        "counts": {
            "rays": c.rays,
            "shadow_rays": c.shadow_rays,
            "flights": c.flights,
            "transmittances": c.transmittances,
            "depths": c.depths,
            "collisions": {"real": c.collisions, "null": c.nulls},
            "lookups": c.lookups,
            "majorant_violations": c.violations,
        },
        "seconds": {
            "parse": s.parse,
            "plugins": s.plugins,
            "media": s.media,
            "geometry": s.geometry,
            "render": s.render,
            "write": s.write,
            "total": s.total,
        },
        "cpu_seconds": {
            "render": s.render_cpu,
            "total": crate::system::cpu_seconds(),
        },
        "peak_memory_bytes": crate::system::peak_memory(),
        "threads": rayon::current_num_threads(),
    })
}

fn plugins(registry: &Registry) -> Value {
    registry
        .loaded()
        .iter()
        .map(|p| {
            json!({"kind": p.kind.name(), "name": p.name(), "version": p.decl.version, "path": p.path})
        })
        .collect()
}

/// The files that the scene names, with their sizes.
fn files(scene: &describe::Scene, registry: &Registry) -> Value {
    let mut paths = Vec::new();
    if scene.source.file.is_file() {
        paths.push(scene.source.file.clone());
    }
    paths.extend(crate::info::named_files(scene, registry));
    paths
        .iter()
        .map(|p| json!({"path": p, "bytes": std::fs::metadata(p).ok().map(|m| m.len())}))
        .collect()
}

fn media(scene: &Scene) -> Value {
    scene
        .media
        .iter()
        .map(|m| {
            let info = &m.medium.info;
            json!({
                "name": m.name,
                "plugin": m.medium.instance.plugin.name(),
                "free_standing": m.free,
                "grids_read": info.grids_read,
                "voxels": info.voxels,
                "bytes_read": info.bytes_read,
                "memory_bytes": info.memory,
                "largest_extinction": info.sigma_max.to_rgb(),
            })
        })
        .collect()
}

/// The images that textures in use were read from.
fn textures(scene: &Scene) -> Value {
    let all = &scene.textures;
    json!({
        "read": all.len(),
        "bytes_read": all.iter().map(|t| t.file_bytes).sum::<u64>(),
        "memory_bytes": all.iter().map(|t| t.texels.data.bytes()).sum::<usize>(),
        "images": all.iter().map(|t| json!({
            "name": t.name,
            "size": [t.texels.width, t.texels.height],
            "channels": t.texels.channels,
            "bytes_read": t.file_bytes,
            "memory_bytes": t.texels.data.bytes(),
        })).collect::<Vec<_>>(),
    })
}

fn geometry(scene: &Scene) -> Value {
    let s = scene.accel().map(|a| a.stats()).unwrap_or_default();
    json!({
        "bvhs": s.bvhs,
        "instances": s.instances,
        "nodes": s.nodes,
        "depth": s.depth,
        "triangles": s.triangles,
        "quadrics": s.quadrics,
        "degenerate_triangles": s.degenerate_triangles,
        "memory_bytes": s.bytes,
        "build_seconds": s.build_seconds,
        "kernel": scene.accel().map(|a| a.kernel()),
    })
}
