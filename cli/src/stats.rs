//! Figures about a run: `--stats`, and the metadata of pictures.

use crate::args::Render;
use crate::failure::{Outcome, failed};
use crate::overrides::Plan;
use resolvent_engine::plugin::{ForeignIntegrator, Registry};
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
    /// Times.
    pub seconds: Seconds,
    /// Estimated relative error.
    pub error: Option<f64>,
}

/// Samples taken over all pixels.
pub fn total_samples(rendered: &Rendered) -> u64 {
    let [w, h] = rendered.film.size();
    (0..w as usize * h as usize)
        .map(|i| u64::from(rendered.film.estimate(i).samples))
        .sum()
}

/// What pictures say about how they were made.
pub fn metadata(
    a: &Render,
    scene: &describe::Scene,
    plan: &Plan,
    rendered: &Rendered,
    integrator: &ForeignIntegrator,
    error: Option<f64>,
) -> BTreeMap<String, String> {
    let version = env!("CARGO_PKG_VERSION");
    let first = plan.samples.start;
    let mut all = BTreeMap::from([
        ("software".to_owned(), format!("resolvent {version}")),
        ("version".to_owned(), version.to_owned()),
        ("scene".to_owned(), a.input.display().to_string()),
        ("seed".to_owned(), scene.sampling.seed.to_string()),
        ("samples".to_owned(), rendered.samples.to_string()),
        (
            "sample_range".to_owned(),
            format!("{first}..{}", first + rendered.samples),
        ),
        ("integrator".to_owned(), integrator.title()),
        ("seconds".to_owned(), format!("{:.3}", rendered.seconds)),
    ]);
    if let Some(e) = error {
        all.insert("estimated_error".to_owned(), format!("{e:.6}"));
    }
    if rendered.interrupted {
        all.insert("interrupted".to_owned(), "true".to_owned());
    }
    all
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
        },
        "sampling": {
            "seed": run.described.sampling.seed,
            "sample_range": [run.plan.samples.start, run.plan.samples.start + r.samples],
            "samples_per_pixel": r.samples,
            "samples": total_samples(r),
            "goal": match run.plan.goal {
                Goal::Samples => json!({"samples": run.plan.samples.len()}),
                Goal::Time(t) => json!({"seconds": t.as_secs_f64()}),
                Goal::Error(e) => json!({"error": e}),
            },
            "interrupted": r.interrupted,
            "estimated_error": run.error,
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
            "rejected_samples": c.rejected,
            "rejected_at": r.rejected_at,
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
