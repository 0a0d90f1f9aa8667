//! Time against error: the command `resolvent bench`.
//!
//! Every run is a process of its own, of this program or of a peer, so that what is measured is what users get: CPU seconds of
//! rendering, time to the first sample, memory. Pictures are compared with stored references ([`mod@reference`]); what the
//! stated noise of both explains is told apart from bias ([`score`]).
//!
//! - [`suite`]: the scenes, each with its purpose; [`generate`] and [`volume`] make those that are too big to be files.
//! - [`session`]: growing budgets on a scene, all renderers in turn.
//! - [`scaling`]: exponents of costs.
//! - [`compare`]: regressions against earlier results.
//! - [`results`], [`markdown`], [`plot`]: what is written.

mod canvas;
pub mod compare;
mod error;
mod fit;
pub mod generate;
pub mod markdown;
mod options;
pub mod plot;
pub mod reference;
pub mod renderer;
pub mod results;
pub mod scaling;
pub mod score;
pub mod session;
pub mod suite;
pub mod volume;

pub use error::{Error, Result};
pub use options::Options;

use renderer::Renderer;
use results::{Results, machine, today};
use session::Plan;
use std::path::{Path, PathBuf};
use suite::{CASES, Converged, Suite};

/// A folder for what is only needed while the command runs.
struct Work(PathBuf);

impl Work {
    fn new() -> Result<Self> {
        let path = std::env::temp_dir().join(format!("resolvent-bench-{}", std::process::id()));
        std::fs::create_dir_all(&path).map_err(Error::io(&path))?;
        Ok(Self(path))
    }
}

impl Drop for Work {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Runs the command; progress goes to standard error, results to standard output and files. `false` if `--fail` is given and
/// something got worse.
///
/// # Errors
/// What is wrong with the options, the files, or a renderer.
pub fn run(options: &Options) -> Result<bool> {
    let say = |line: &str| {
        if !options.quiet {
            eprintln!("{line}");
        }
    };
    if options.list {
        for c in CASES {
            println!("{:14} {:6} {}", c.name, c.mode.name(), c.purpose);
        }
        return Ok(true);
    }
    let suite = Suite::find(options.root.as_deref())?;
    let work = Work::new()?;
    let mode = options.mode();
    let cases = suite.cases(mode, &options.scene)?;
    if let Some(folder) = &options.write_scenes {
        for path in reference::write_scenes(&suite, &cases, folder)? {
            println!("{}", path.display());
        }
        return Ok(true);
    }
    if options.make_references {
        for case in cases {
            if case.converged != Converged::Stored {
                println!("{}: needs no picture of its own", case.name);
                continue;
            }
            let made = if options.from.is_empty() {
                let (i, t) = (&options.reference_integrator, options.reference_seconds);
                reference::render(&suite, case, i, t, options.seed, &work.0)?
            } else {
                reference::merge(&suite, case, &options.from, &options.by)?
            };
            println!("{made}");
        }
        return Ok(true);
    }
    // What can be wrong is found before hours are spent.
    let base = options.compare.as_deref().map(compare::read).transpose()?;
    let stem = options.output.with_extension("");
    check_folder(&stem)?;
    let own = Renderer::own(options.integrator.clone())?;
    let mut renderers = vec![own.clone()];
    for name in &options.against {
        renderers.push(renderer::peer(name, &options.python, &suite.root)?);
    }
    for exe in &options.build {
        renderers.push(Renderer::Own {
            name: exe.display().to_string(),
            exe: exe.clone(),
            integrator: options.integrator.clone(),
        });
    }
    let mut plan = Plan::new(mode, options.seed, options.threads);
    if let Some(budget) = options.budget {
        plan.budget = budget;
    }
    let mut results = Results {
        date: today(),
        machine: machine(),
        mode: mode.name().to_owned(),
        scenes: Vec::new(),
        scaling: Vec::new(),
    };
    if !options.only_scaling {
        for case in cases {
            let scene = session::measure(&suite, case, &renderers, &plan, &work.0, &say)?;
            results.scenes.push(scene);
        }
    }
    if options.scaling || options.only_scaling {
        results.scaling = scaling::measure(&suite, &own, mode, &options.series, &work.0, &say)?;
    }
    write(&results, &stem)?;
    say(&format!("wrote {}.json, .md, .svg, .png", stem.display()));
    let Some(base) = base else { return Ok(true) };
    let new = results.json();
    let rows = compare::compare(&base, &new);
    print!("{}", compare::text(&rows, &base, &new));
    Ok(!(options.fail && rows.iter().any(compare::Row::worse)))
}

fn check_folder(stem: &Path) -> Result<()> {
    match stem.parent() {
        Some(p) if !p.as_os_str().is_empty() && !p.is_dir() => Err(Error::invalid(format!(
            "-o {}: there is no folder {}",
            stem.display(),
            p.display()
        ))),
        _ => Ok(()),
    }
}

fn write(results: &Results, stem: &Path) -> Result<()> {
    results.write(&stem.with_extension("json"))?;
    if !results.scenes.is_empty() {
        plot::errors(results).write(stem)?;
    }
    let name = stem.file_name().unwrap_or_default().to_string_lossy();
    if !results.scaling.is_empty() {
        let beside = stem.with_file_name(format!("{name}-scaling"));
        plot::scaling(&results.scaling).write(&beside)?;
    }
    let words: Vec<String> = std::env::args().skip(1).collect();
    let command = format!("resolvent {}", words.join(" "));
    let path = stem.with_extension("md");
    let page = markdown::page(results, &command, &name);
    std::fs::write(&path, page).map_err(Error::io(&path))
}
