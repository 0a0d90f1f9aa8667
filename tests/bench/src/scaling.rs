//! How costs grow: with the optical thickness, the voxels, the depth of scattering, the media, the lights, the pixels, the threads.

use crate::error::{Error, Result};
use crate::fit::{Point, PowerLaw};
use crate::generate;
use crate::renderer::{Failure, Job, Renderer};
use crate::session::TIME_NOISE;
use crate::suite::{Mode, Suite};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Costs at one abscissa.
#[derive(Clone, Debug)]
pub struct Cost {
    /// The abscissa.
    pub x: f64,
    /// What the exponent is of.
    pub y: f64,
    /// CPU microseconds of one sample of a pixel.
    pub microseconds: f64,
    /// Look-ups of one sample.
    pub lookups: f64,
    /// Flights and transmittances of one sample.
    pub flights: f64,
    /// Seconds to the first sample.
    pub load: f64,
    /// Largest memory, bytes.
    pub memory: f64,
}

/// Costs over one quantity.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name.
    pub name: &'static str,
    /// What varies.
    pub x: &'static str,
    /// What is measured.
    pub y: &'static str,
    /// Points.
    pub points: Vec<Cost>,
    /// Exponent over all points, with its standard error.
    pub exponent: Option<[f64; 2]>,
    /// Exponent over the upper half of the points.
    pub upper: Option<[f64; 2]>,
}

impl Series {
    /// As JSON.
    pub fn json(&self) -> Value {
        json!({
            "name": self.name, "x": self.x, "y": self.y,
            "exponent": self.exponent, "exponent_of_upper_half": self.upper,
            "points": self.points.iter().map(|p| json!({
                "x": p.x, "y": p.y, "microseconds_per_sample": p.microseconds,
                "lookups_per_sample": p.lookups, "flights_per_sample": p.flights,
                "load_seconds": p.load, "memory_bytes": p.memory,
            })).collect::<Vec<_>>(),
        })
    }
}

/// A series that can be run.
struct Plan {
    name: &'static str,
    x: &'static str,
    y: &'static str,
    points: Vec<(f64, Setting)>,
    /// What the exponent is of.
    of: fn(&Cost, f64, f64) -> f64,
}

/// One point's job.
struct Setting {
    scene: PathBuf,
    size: [usize; 2],
    spp: u64,
    threads: usize,
}

/// Names of the series.
pub const NAMES: &[&str] = &[
    "optical_thickness",
    "voxels",
    "depth",
    "media",
    "lights",
    "pixels",
    "threads",
];

const SMALL: [u32; 2] = [64, 48];
/// Where a sample costs a millisecond.
const FEW: [u32; 2] = [24, 18];

/// Runs the series named, or all.
pub fn measure(
    suite: &Suite,
    own: &Renderer,
    mode: Mode,
    named: &[String],
    work: &Path,
    say: &dyn Fn(&str),
) -> Result<Vec<Series>> {
    if let Some(n) = named.iter().find(|n| !NAMES.contains(&n.as_str())) {
        return Err(Error::invalid(format!(
            "--scaling {n}: known are {}",
            NAMES.join(", ")
        )));
    }
    let wanted = |n: &&&str| named.is_empty() || named.iter().any(|w| w == **n);
    NAMES
        .iter()
        .filter(wanted)
        .map(|name| run(&plan(name, suite, mode, work)?, own, work, say))
        .collect()
}

fn run(plan: &Plan, own: &Renderer, work: &Path, say: &dyn Fn(&str)) -> Result<Series> {
    let mut points = Vec::new();
    for (x, s) in &plan.points {
        let job = Job {
            scene: &s.scene,
            size: s.size,
            spp: s.spp,
            seed: 1,
            threads: s.threads,
            work,
        };
        let (_, cost) = own.run(&job).map_err(|f| match f {
            Failure::Broken(e) => e,
            Failure::Unsupported(why) => Error::invalid(why),
        })?;
        let samples = (s.size[0] * s.size[1]) as f64 * s.spp as f64;
        let count = |k: &str| cost.counts[k].as_f64().unwrap_or(0.0) / samples;
        let mut point = Cost {
            x: *x,
            y: 0.0,
            microseconds: 1e6 * cost.render_cpu / samples,
            lookups: count("lookups"),
            flights: count("flights") + count("transmittances"),
            load: cost.load,
            memory: cost.memory,
        };
        point.y = (plan.of)(&point, cost.render_cpu, cost.render_wall);
        say(&format!(
            "{:18} {:10.4} {} {:.3e}, {:.2} µs and {:.1} look-ups a sample, {:.3} s to load, {:.1} MB",
            plan.name,
            x,
            plan.y,
            point.y,
            point.microseconds,
            point.lookups,
            point.load,
            point.memory / 1e6
        ));
        points.push(point);
    }
    let exponent = |points: &[Cost]| {
        let points: Vec<Point> = points
            .iter()
            .map(|p| Point {
                x: p.x,
                y: p.y,
                relative: TIME_NOISE,
            })
            .collect();
        PowerLaw::fit(&points).map(|l| [l.slope, l.slope_error])
    };
    Ok(Series {
        name: plan.name,
        x: plan.x,
        y: plan.y,
        exponent: exponent(&points),
        upper: exponent(&points[points.len() / 2..]),
        points,
    })
}

fn plan(name: &str, suite: &Suite, mode: Mode, work: &Path) -> Result<Plan> {
    let full = mode == Mode::Full;
    let spp = match mode {
        Mode::Smoke => 32,
        Mode::Quick => 64,
        Mode::Full => 256,
    };
    let small = SMALL.map(|n| n as usize);
    let of_sample: fn(&Cost, f64, f64) -> f64 = |c, _, _| c.microseconds;
    let save = |x: f64, scene: &Value, size: [usize; 2], spp: u64| -> Result<(f64, Setting)> {
        let path = work.join(format!("{name}-{x}.json"));
        generate::write(scene, &path)?;
        Ok((
            x,
            Setting {
                scene: path,
                size,
                spp,
                threads: 0,
            },
        ))
    };
    let cut = |all: &[f64], quick: usize| -> Vec<f64> {
        let n = match mode {
            Mode::Smoke => 2,
            Mode::Quick => quick,
            Mode::Full => all.len(),
        };
        all[..n.min(all.len())].to_vec()
    };
    let sample = "CPU µs a sample";
    Ok(match name {
        "optical_thickness" => Plan {
            name: "optical_thickness",
            x: "optical thickness",
            y: sample,
            of: of_sample,
            points: cut(&[1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0], 7)
                .into_iter()
                .map(|tau| {
                    let mut s =
                        generate::scene(SMALL, [1.66, 5.73, 10.42], [-4.34, 5.23, -6.58], 44.0);
                    s["lights"] = json!([{"type": "environment", "radiance": 1}]);
                    s["media"]["cloud"] = json!({"plugin": "vdb", "params": {
                        "file": suite.root.join("scenes/cloud/cloud_s.vdb"), "albedo": 0.99,
                        // 24.56 is an optical thickness of 60 through the middle.
                        "sigma_t": 24.56 * tau / 60.0, "phase": {"plugin": "hg", "params": {"g": 0.85}}
                    }});
                    save(tau, &s, small, spp)
                })
                .collect::<Result<_>>()?,
        },
        "voxels" => Plan {
            name: "voxels",
            x: "voxels",
            y: sample,
            of: of_sample,
            points: cut(&[1e4, 1e5, 1e6, 1e7, 1e8], 4)
                .into_iter()
                .map(|n| {
                    let vdb = work.join(format!("ball-{n}.vdb"));
                    save(n, &generate::ball(n, 10.0, SMALL, &vdb)?, small, spp)
                })
                .collect::<Result<_>>()?,
        },
        "depth" => Plan {
            name: "depth",
            x: "scatterings",
            y: sample,
            of: of_sample,
            points: cut(&[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0], 10)
                .into_iter()
                .map(|n| save(n, &generate::depth(n as i64, SMALL), small, spp))
                .collect::<Result<_>>()?,
        },
        "media" => Plan {
            name: "media",
            x: "media",
            y: sample,
            of: of_sample,
            points: cut(&[1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0], 6)
                .into_iter()
                .map(|n| save(n, &generate::puffs(n as usize, 0.35, FEW), FEW.map(|n| n as usize), 32))
                .collect::<Result<_>>()?,
        },
        "lights" => Plan {
            name: "lights",
            x: "lights",
            y: sample,
            of: of_sample,
            points: cut(&[1.0, 10.0, 100.0, 1e3, 1e4, 1e5], 5)
                .into_iter()
                .map(|n| save(n, &generate::lights(n as usize, SMALL), small, spp))
                .collect::<Result<_>>()?,
        },
        "pixels" => Plan {
            name: "pixels",
            x: "pixels",
            y: "CPU seconds a picture",
            of: |_, cpu, _| cpu,
            points: cut(&[1.0, 2.0, 4.0, 8.0, 16.0], if full { 5 } else { 4 })
                .into_iter()
                .map(|k| {
                    let size = small.map(|n| n * k as usize);
                    let s = generate::lights(3, SMALL);
                    save((size[0] * size[1]) as f64, &s, size, 64)
                })
                .collect::<Result<_>>()?,
        },
        _ => {
            let cores = std::thread::available_parallelism().map_or(1, usize::from);
            let counts = (0..).map(|k| 1usize << k).take_while(|n| *n < cores);
            let scene = suite.root.join("scenes/bench/smoke_area.json");
            Plan {
                name: "threads",
                x: "threads",
                y: "seconds a picture",
                of: |_, _, wall| wall,
                points: counts
                    .chain([cores])
                    .map(|n| {
                        let s = Setting {
                            scene: scene.clone(),
                            size: [96, 96],
                            spp: if mode == Mode::Smoke { 32 } else { 128 },
                            threads: n,
                        };
                        (n as f64, s)
                    })
                    .collect(),
            }
        }
    })
}
