//! Renderers as processes: this one, other builds of it, and peers through their adapters.

use crate::error::{Error, Result};
use crate::score::Picture;
use nix::sys::resource::{UsageWho, getrusage};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Instant;

/// A program that renders scenes.
#[derive(Clone, Debug, PartialEq)]
pub enum Renderer {
    /// Resolvent.
    Own {
        /// Its name in reports.
        name: String,
        /// The executable.
        exe: PathBuf,
        /// The integrator, unless the scene's.
        integrator: Option<String>,
    },
    /// A peer.
    Peer {
        /// Its name in reports.
        name: String,
        /// Interpreter, adapter and its options.
        command: Vec<String>,
    },
}

/// What to render.
#[derive(Clone, Debug)]
pub struct Job<'a> {
    /// The scene's file.
    pub scene: &'a Path,
    /// Width and height.
    pub size: [usize; 2],
    /// Samples per pixel.
    pub spp: u64,
    /// Seed.
    pub seed: u64,
    /// Threads; 0: all.
    pub threads: usize,
    /// Folder for what is written.
    pub work: &'a Path,
}

/// What a run cost.
#[derive(Clone, Debug, Default)]
pub struct Cost {
    /// CPU seconds of rendering, over all threads.
    pub render_cpu: f64,
    /// Wall-clock seconds of rendering.
    pub render_wall: f64,
    /// CPU seconds of the whole process.
    pub process_cpu: f64,
    /// Wall-clock seconds from the start to the first sample.
    pub load: f64,
    /// Largest memory, bytes.
    pub memory: f64,
    /// Rays, flights, look-ups … as the program counts them.
    pub counts: Value,
}

/// Why there is no picture.
#[derive(Debug)]
pub enum Failure {
    /// The renderer cannot do this scene.
    Unsupported(String),
    /// Something broke.
    Broken(Error),
}

impl From<Error> for Failure {
    fn from(e: Error) -> Self {
        Self::Broken(e)
    }
}

/// Exit code of adapters for scenes that their renderer cannot do.
const UNSUPPORTED: i32 = 4;

impl Renderer {
    /// This executable.
    pub fn own(integrator: Option<String>) -> Result<Self> {
        let exe = std::env::current_exe()
            .map_err(|e| Error::invalid(format!("cannot find this program: {e}")))?;
        let name = match &integrator {
            None => "resolvent".to_owned(),
            Some(i) => format!("resolvent {i}"),
        };
        Ok(Self::Own {
            name,
            exe,
            integrator,
        })
    }

    /// Its name in reports.
    pub fn name(&self) -> &str {
        match self {
            Renderer::Own { name, .. } | Renderer::Peer { name, .. } => name,
        }
    }

    /// Renders.
    pub fn run(&self, job: &Job) -> std::result::Result<(Picture, Cost), Failure> {
        let picture = job.work.join("picture.exr");
        let stats = job.work.join("stats.json");
        for stale in [&picture, &stats] {
            let _ = std::fs::remove_file(stale);
        }
        let size = format!("{}x{}", job.size[0], job.size[1]);
        let mut command = match self {
            Renderer::Own {
                exe, integrator, ..
            } => {
                let mut c = Command::new(exe);
                c.arg("render").arg(job.scene).arg("--quiet");
                c.args(["--aov", "variance"]).arg("--stats").arg(&stats);
                if let Some(i) = integrator {
                    c.args(["--integrator", i]);
                }
                c
            }
            Renderer::Peer { command, .. } => {
                let mut c = Command::new(&command[0]);
                c.args(&command[1..]).arg(job.scene);
                c.arg("--volumes").arg(job.work);
                c
            }
        };
        command.arg("-o").arg(&picture);
        command.args(["--resolution", &size]);
        command.args(["--spp", &job.spp.to_string()]);
        command.args(["--seed", &job.seed.to_string()]);
        command.args(["--threads", &job.threads.to_string()]);
        let (before, start) = (children_cpu(), Instant::now());
        let output = command
            .output()
            .map_err(|e| self.broken(job, format!("cannot be started: {e}")))?;
        let wall = start.elapsed().as_secs_f64();
        let process_cpu = children_cpu() - before;
        if !output.status.success() {
            let said = last_line(&output);
            return Err(if output.status.code() == Some(UNSUPPORTED) {
                Failure::Unsupported(said)
            } else {
                Failure::Broken(self.broken(job, said))
            });
        }
        let mut cost = match self {
            Renderer::Own { .. } => own_cost(&stats)?,
            Renderer::Peer { .. } => peer_cost(&output, wall),
        };
        cost.process_cpu = process_cpu;
        if cost.render_cpu <= 0.0 {
            cost.render_cpu = process_cpu;
        }
        Ok((Picture::read(&picture)?, cost))
    }

    fn broken(&self, job: &Job, why: String) -> Error {
        let scene = job.scene.file_stem().unwrap_or_default();
        Error::Renderer {
            renderer: self.name().to_owned(),
            scene: scene.to_string_lossy().into_owned(),
            why,
        }
    }
}

/// CPU seconds of all finished children.
fn children_cpu() -> f64 {
    getrusage(UsageWho::RUSAGE_CHILDREN).map_or(0.0, |u| {
        [u.user_time(), u.system_time()]
            .iter()
            .map(|t| t.tv_sec() as f64 + t.tv_usec() as f64 * 1e-6)
            .sum()
    })
}

fn last_line(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr);
    let line = text.lines().rev().find(|l| !l.trim().is_empty());
    line.map_or_else(|| output.status.to_string(), |l| l.trim().to_owned())
}

fn own_cost(stats: &Path) -> Result<Cost> {
    let text = std::fs::read(stats).map_err(Error::io(stats))?;
    let v: Value = serde_json::from_slice(&text)
        .map_err(|e| Error::invalid(format!("{}: {e}", stats.display())))?;
    let number = |path: &str| v.pointer(path).and_then(Value::as_f64);
    let seconds = |name: &str| number(&format!("/seconds/{name}")).unwrap_or(0.0);
    Ok(Cost {
        render_cpu: number("/cpu_seconds/render").unwrap_or(0.0),
        render_wall: seconds("render"),
        load: ["parse", "plugins", "media", "geometry"]
            .map(seconds)
            .iter()
            .sum(),
        memory: number("/peak_memory_bytes").unwrap_or(0.0),
        counts: v["counts"].clone(),
        process_cpu: 0.0,
    })
}

/// Adapters print a line `RESULT {"render_cpu": …, "render_wall": …, "load": …, "memory": …}`.
fn peer_cost(output: &Output, wall: f64) -> Cost {
    let text = String::from_utf8_lossy(&output.stdout);
    let line = text.lines().rev().find_map(|l| l.strip_prefix("RESULT "));
    let v: Value = line
        .and_then(|l| serde_json::from_str(l).ok())
        .unwrap_or_default();
    let number = |key: &str| v[key].as_f64().unwrap_or(0.0);
    Cost {
        render_cpu: number("render_cpu"),
        render_wall: v["render_wall"].as_f64().unwrap_or(wall),
        load: number("load"),
        memory: number("memory"),
        counts: json!({}),
        process_cpu: 0.0,
    }
}

/// The peers that `--against` knows, with what they are called on.
pub const PEERS: &[(&str, &str, &[&str])] = &[
    ("mitsuba", "mitsuba_peer.py", &["--variant", "llvm_ad_rgb"]),
    (
        "mitsuba-scalar",
        "mitsuba_peer.py",
        &["--variant", "scalar_rgb"],
    ),
    ("cycles", "cycles_peer.py", &[]),
];

/// A peer by name; `python` runs its adapter.
pub fn peer(name: &str, python: &str, root: &Path) -> Result<Renderer> {
    let known = PEERS.iter().find(|p| p.0 == name);
    let Some((_, adapter, options)) = known else {
        let names: Vec<_> = PEERS.iter().map(|p| p.0).collect();
        return Err(Error::invalid(format!(
            "--against {name}: known are {}",
            names.join(", ")
        )));
    };
    let adapter = root.join("tests/bench/peers").join(adapter);
    let mut command = vec![python.to_owned(), adapter.display().to_string()];
    command.extend(options.iter().map(|o| (*o).to_owned()));
    let check = Command::new(&command[0])
        .args(&command[1..])
        .arg("--check")
        .output()
        .map_err(|e| Error::invalid(format!("--python {python}: cannot be started: {e}")))?;
    if !check.status.success() {
        return Err(Error::invalid(format!(
            "--against {name}: {} (tests/bench/peers/README.md says how to install it; --python names the interpreter)",
            last_line(&check)
        )));
    }
    let version = String::from_utf8_lossy(&check.stdout).trim().to_owned();
    Ok(Renderer::Peer {
        name: format!("{name} {version}"),
        command,
    })
}
