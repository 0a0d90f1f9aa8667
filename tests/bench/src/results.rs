//! What came out, as it is stored.

use crate::error::{Error, Result};
use crate::renderer::Cost;
use crate::scaling::Series;
use crate::score::Score;
use serde_json::{Value, json};
use std::path::Path;

/// One run of one renderer.
#[derive(Clone, Debug)]
pub struct Run {
    /// Samples per pixel.
    pub spp: u64,
    /// Seed.
    pub seed: u64,
    /// Samples in all.
    pub samples: f64,
    /// How far the picture is from the reference.
    pub score: Score,
    /// What it cost.
    pub cost: Cost,
}

/// What the runs of a renderer say together.
#[derive(Clone, Copy, Debug)]
pub struct Fit {
    /// The largest run is too noisy for its error to mean anything; the asymptote still does.
    pub saturated: bool,
    /// 1/(relMSE × CPU seconds) of the largest run.
    pub efficiency: Option<f64>,
    /// 1/(stated relative variance × CPU seconds): the efficiency of long runs, whatever the reference.
    pub asymptote: Option<f64>,
    /// Exponent of the error over CPU time, and its standard error; −1 without bias.
    pub slope: Option<[f64; 2]>,
    /// relMSE after 10 CPU seconds, by the fitted line.
    pub error_at_10: Option<f64>,
    /// CPU seconds to a relMSE of 0.01, by the fitted line.
    pub seconds_to_1e2: Option<f64>,
    /// CPU time of one sample of a pixel.
    pub microseconds_per_sample: f64,
    /// relMSE that no noise explains, and its standard error.
    pub floor: Option<[f64; 2]>,
    /// Mean over the reference's mean, less 1, and its standard error.
    pub mean_off: [f64; 2],
    /// Largest memory, bytes.
    pub memory: f64,
    /// Shortest time from the start to the first sample, seconds.
    pub load: f64,
}

/// A renderer on a scene.
#[derive(Clone, Debug)]
pub struct Line {
    /// The renderer.
    pub renderer: String,
    /// Its runs, from the shortest to the longest.
    pub runs: Vec<Run>,
    /// What they say.
    pub fit: Option<Fit>,
}

impl Line {
    /// Without runs.
    pub fn new(renderer: &str) -> Self {
        Self {
            renderer: renderer.to_owned(),
            runs: Vec::new(),
            fit: None,
        }
    }
}

/// All renderers on a scene.
#[derive(Clone, Debug)]
pub struct SceneResult {
    /// The scene.
    pub name: String,
    /// What it is for.
    pub purpose: String,
    /// Width and height.
    pub resolution: [usize; 2],
    /// What made the reference.
    pub reference: String,
    /// Renderers.
    pub lines: Vec<Line>,
    /// Renderers that cannot do it, and why.
    pub skipped: Vec<(String, String)>,
}

/// Everything.
#[derive(Clone, Debug)]
pub struct Results {
    /// Day, as 2026-01-31.
    pub date: String,
    /// The machine in words.
    pub machine: String,
    /// Smoke, quick or full.
    pub mode: String,
    /// Scenes.
    pub scenes: Vec<SceneResult>,
    /// Scaling.
    pub scaling: Vec<Series>,
}

impl Results {
    /// As JSON.
    pub fn json(&self) -> Value {
        json!({
            "resolvent_bench": 1,
            "version": env!("CARGO_PKG_VERSION"),
            "date": self.date,
            "machine": self.machine,
            "mode": self.mode,
            "scenes": self.scenes.iter().map(scene).collect::<Vec<_>>(),
            "scaling": self.scaling.iter().map(Series::json).collect::<Vec<_>>(),
        })
    }

    /// Writes them.
    pub fn write(&self, path: &Path) -> Result<()> {
        std::fs::write(path, format!("{:#}\n", self.json())).map_err(Error::io(path))
    }
}

fn scene(s: &SceneResult) -> Value {
    json!({
        "name": s.name,
        "purpose": s.purpose,
        "resolution": s.resolution,
        "reference": s.reference,
        "renderers": s.lines.iter().map(line).collect::<Vec<_>>(),
        "not_done_by": s.skipped.iter().map(|(r, why)| json!({"renderer": r, "why": why})).collect::<Vec<_>>(),
    })
}

fn line(l: &Line) -> Value {
    json!({
        "renderer": l.renderer,
        "fit": l.fit.map(|f| json!({
            "saturated": f.saturated,
            "efficiency": f.efficiency,
            "asymptotic_efficiency": f.asymptote,
            "slope": f.slope,
            "rel_mse_at_10_cpu_seconds": f.error_at_10,
            "cpu_seconds_to_rel_mse_0.01": f.seconds_to_1e2,
            "microseconds_per_sample": f.microseconds_per_sample,
            "floor": f.floor,
            "mean_off": f.mean_off,
            "memory_bytes": f.memory,
            "load_seconds": f.load,
        })),
        "runs": l.runs.iter().map(run).collect::<Vec<_>>(),
    })
}

fn run(r: &Run) -> Value {
    let s = &r.score;
    json!({
        "spp": r.spp,
        "seed": r.seed,
        "samples": r.samples,
        "rel_mse": s.rel_mse,
        "rel_mse_relative_error": s.rel_mse_error,
        "rel_mse_raw": s.rel_mse_raw,
        "rel_mse_of_black": s.black,
        "mse": s.mse,
        "stated_noise": s.noise,
        "reference_noise": s.reference_noise,
        "floor": s.floor.map(|f| [f, s.floor_error]),
        "mean_off": [s.mean_off, s.mean_off_error],
        "not_finite": s.not_finite,
        "cpu_seconds": r.cost.render_cpu,
        "wall_seconds": r.cost.render_wall,
        "process_cpu_seconds": r.cost.process_cpu,
        "load_seconds": r.cost.load,
        "memory_bytes": r.cost.memory,
        "counts": r.cost.counts,
    })
}

/// Today, as 2026-01-31 (Hinnant's days_from_civil, inverted).
pub fn today() -> String {
    let seconds = std::time::SystemTime::now()
        .duration_since(std::time::UNIX_EPOCH)
        .map_or(0, |d| d.as_secs() as i64);
    date(seconds.div_euclid(86400))
}

fn date(days: i64) -> String {
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let doe = z.rem_euclid(146_097);
    let yoe = (doe - doe / 1460 + doe / 36_524 - doe / 146_096) / 365;
    let doy = doe - (365 * yoe + yoe / 4 - yoe / 100);
    let mp = (5 * doy + 2) / 153;
    let (d, m) = (
        doy - (153 * mp + 2) / 5 + 1,
        if mp < 10 { mp + 3 } else { mp - 9 },
    );
    let y = yoe + era * 400 + i64::from(m <= 2);
    format!("{y:04}-{m:02}-{d:02}")
}

/// Processors, architecture and whether they are virtual.
pub fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let is_virtual = info
        .lines()
        .find(|l| l.starts_with("flags"))
        .is_some_and(|l| l.split_whitespace().any(|f| f == "hypervisor"));
    let kind = if is_virtual {
        "virtual machine"
    } else {
        "machine"
    };
    let arch = std::env::consts::ARCH.replace('_', "-");
    format!("{cores}-core {arch} {kind}")
}

#[cfg(test)]
mod tests {
    #[test]
    fn dates() {
        assert_eq!(super::date(0), "1970-01-01");
        assert_eq!(super::date(19_782), "2024-02-29");
        assert_eq!(super::date(20_783), "2026-11-26");
    }
}
