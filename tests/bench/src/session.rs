//! Growing budgets on one scene, all renderers in turn.

use crate::error::{Error, Result};
use crate::fit::{Point, PowerLaw};
use crate::generate;
use crate::renderer::{Failure, Job, Renderer};
use crate::results::{Fit, Line, Run, SceneResult};
use crate::score::{Picture, score};
use crate::suite::{Case, Converged, Mode, Suite, resolution};
use crate::volume;
use std::path::Path;

/// Samples of a pixel that the sampler spreads evenly; the variance is known from two such batches on.
pub const BATCH: u64 = 16;
/// A figure above this share of a black picture's is saturated: the error no longer falls like 1/samples there.
pub const SATURATED: f64 = 0.1;
/// Relative error that one CPU time has on a shared machine.
pub const TIME_NOISE: f64 = 0.04;

/// How a session is run.
#[derive(Clone, Debug)]
pub struct Plan {
    /// How much.
    pub mode: Mode,
    /// CPU seconds of the longest run.
    pub budget: f64,
    /// Runs, each with half of the samples of the one after it.
    pub levels: u32,
    /// Runs with different seeds at every level.
    pub repeats: u64,
    /// Seed.
    pub seed: u64,
    /// Threads; 0: all.
    pub threads: usize,
}

impl Plan {
    /// What a mode stands for.
    pub fn new(mode: Mode, seed: u64, threads: usize) -> Self {
        let (budget, levels, repeats) = match mode {
            Mode::Smoke => (0.4, 2, 1),
            Mode::Quick => (7.0, 4, 1),
            Mode::Full => (40.0, 5, 2),
        };
        Self {
            mode,
            budget,
            levels,
            repeats,
            seed,
            threads,
        }
    }

    /// Pixels of the scene that become one.
    pub fn coarser(&self) -> usize {
        match self.mode {
            Mode::Full => 1,
            Mode::Quick | Mode::Smoke => 2,
        }
    }
}

/// Measures all renderers on a case. `say` hears of every run.
pub fn measure(
    suite: &Suite,
    case: &Case,
    renderers: &[Renderer],
    plan: &Plan,
    work: &Path,
    say: &dyn Fn(&str),
) -> Result<SceneResult> {
    if !matches!(case.converged, Converged::Constant(_)) && !suite.reference_path(case).is_file() {
        let why = "there is no reference yet: `resolvent bench --make-references` makes it";
        say(&format!("{}: not done: {why}", case.name));
        return Ok(SceneResult {
            name: case.name.to_owned(),
            purpose: case.purpose.to_owned(),
            resolution: [0; 2],
            reference: "none".into(),
            lines: Vec::new(),
            skipped: renderers
                .iter()
                .map(|r| (r.name().to_owned(), why.to_owned()))
                .collect(),
        });
    }
    let scene = suite.scene(case, work)?;
    let full = resolution(&scene)?;
    let reference = suite.reference(case, full, plan.coarser())?;
    if renderers.iter().any(|r| matches!(r, Renderer::Peer { .. })) {
        dense_volumes(&scene, work)?;
    }
    let mut bench = Bench {
        case,
        scene: &scene,
        reference: &reference,
        plan,
        work,
        say,
        seed: plan.seed.wrapping_mul(1000),
    };
    let mut lines: Vec<Line> = Vec::new();
    let mut levels: Vec<Vec<u64>> = Vec::new();
    let mut skipped = Vec::new();
    for r in renderers {
        match bench.levels(r) {
            Ok(l) => {
                lines.push(Line::new(r.name()));
                levels.push(l);
            }
            Err(Failure::Unsupported(why)) => {
                say(&format!("{}: not done by {}: {why}", case.name, r.name()));
                lines.push(Line::new(r.name()));
                levels.push(Vec::new());
                skipped.push((r.name().to_owned(), why));
            }
            Err(Failure::Broken(e)) => return Err(e),
        }
    }
    // In turn, so that a change of the machine's speed meets all renderers alike.
    let most = levels.iter().map(Vec::len).max().unwrap_or(0);
    for level in 0..most {
        for _ in 0..plan.repeats {
            bench.seed += 1;
            for (k, r) in renderers.iter().enumerate() {
                let Some(&spp) = levels[k].get(level) else {
                    continue;
                };
                let run = bench.run(r, spp).map_err(|f| match f {
                    Failure::Broken(e) => e,
                    Failure::Unsupported(why) => Error::invalid(why),
                })?;
                lines[k].runs.push(run);
            }
        }
    }
    for line in &mut lines {
        line.fit = fit(&line.runs);
    }
    lines.retain(|l| !l.runs.is_empty());
    let by = reference_maker(suite, case);
    Ok(SceneResult {
        name: case.name.to_owned(),
        purpose: case.purpose.to_owned(),
        resolution: reference.size,
        reference: by,
        lines,
        skipped,
    })
}

/// One scene at work.
struct Bench<'a> {
    case: &'a Case,
    scene: &'a Path,
    reference: &'a Picture,
    plan: &'a Plan,
    work: &'a Path,
    say: &'a dyn Fn(&str),
    seed: u64,
}

impl Bench<'_> {
    /// Samples per pixel of each level, from pilots that find the cost of a sample.
    fn levels(&self, r: &Renderer) -> std::result::Result<Vec<u64>, Failure> {
        let own = matches!(r, Renderer::Own { .. });
        if let (false, Converged::Of(name)) = (own, self.case.converged) {
            return Err(Failure::Unsupported(format!("the same there as {name}")));
        }
        let least = if own { 2 * BATCH } else { 1 };
        let mut spp = if own { 2 * BATCH } else { 4 };
        let mut last: Option<(u64, f64)> = None;
        let slope = loop {
            let job = self.job(spp, self.plan.seed ^ 0x70_696c);
            let (_, cost) = r.run(&job)?;
            let slope = match last {
                // What does not grow with the samples is not the samples' cost.
                Some((n, c)) if cost.render_cpu > 1.3 * c => {
                    (cost.render_cpu - c) / (spp - n) as f64
                }
                _ => cost.render_cpu / spp as f64,
            };
            if cost.render_cpu > 0.12 * self.plan.budget || spp > 1 << 14 {
                break slope;
            }
            last = Some((spp, cost.render_cpu));
            spp *= 4;
        };
        let top = (self.plan.budget / slope.max(1e-9)).max(1.0) as u64;
        let round = |n: u64| if own { n / BATCH * BATCH } else { n }.max(least);
        let mut levels: Vec<u64> = (0..self.plan.levels)
            .rev()
            .map(|k| round(top >> k))
            .collect();
        levels.dedup();
        if own && levels.len() == 1 && self.plan.mode != Mode::Smoke {
            // A slope needs two points.
            levels.push(levels[0] + BATCH);
        }
        Ok(levels)
    }

    fn job(&self, spp: u64, seed: u64) -> Job<'_> {
        Job {
            scene: self.scene,
            size: self.reference.size,
            spp,
            seed,
            threads: self.plan.threads,
            work: self.work,
        }
    }

    fn run(&self, r: &Renderer, spp: u64) -> std::result::Result<Run, Failure> {
        let (picture, cost) = r.run(&self.job(spp, self.seed))?;
        let score = score(&picture, self.reference)?;
        (self.say)(&format!(
            "{:13} {:24} {spp:6} spp {:8.2} CPU-s  relMSE {:.2e}",
            self.case.name,
            r.name(),
            cost.render_cpu,
            score.rel_mse
        ));
        let samples = spp as f64 * (self.reference.size[0] * self.reference.size[1]) as f64;
        Ok(Run {
            spp,
            seed: self.seed,
            samples,
            score,
            cost,
        })
    }
}

/// What the runs of a renderer say together.
pub fn fit(runs: &[Run]) -> Option<Fit> {
    let points: Vec<Point> = runs
        .iter()
        .filter(|r| r.score.rel_mse < SATURATED * r.score.black)
        .map(|r| Point {
            x: r.cost.render_cpu,
            y: r.score.rel_mse,
            relative: r.score.rel_mse_error.hypot(TIME_NOISE),
        })
        .collect();
    let top = runs.iter().max_by_key(|r| r.spp)?;
    let largest: Vec<&Run> = runs.iter().filter(|r| r.spp == top.spp).collect();
    let mean =
        |f: &dyn Fn(&Run) -> f64| largest.iter().map(|r| f(r)).sum::<f64>() / largest.len() as f64;
    let error = mean(&|r| r.score.rel_mse);
    let saturated = error >= SATURATED * top.score.black;
    let noise = top
        .score
        .noise
        .map(|_| mean(&|r| r.score.noise.unwrap_or(0.0)));
    let cpu = mean(&|r| r.cost.render_cpu);
    let law = PowerLaw::fit(&points);
    Some(Fit {
        saturated,
        efficiency: (!saturated && error > 0.0).then(|| 1.0 / (error * cpu)),
        asymptote: noise.filter(|n| *n > 0.0).map(|n| 1.0 / (n * cpu)),
        slope: law.map(|l| [l.slope, l.slope_error]),
        error_at_10: law.map(|l| l.at(10.0)),
        seconds_to_1e2: law.and_then(|l| l.reaches(0.01)),
        microseconds_per_sample: 1e6 * cpu / top.samples,
        floor: top.score.floor.map(|_| {
            let n = largest.len() as f64;
            let error = mean(&|r| r.score.floor_error.powi(2)) / n;
            [mean(&|r| r.score.floor.unwrap_or(0.0)), error.sqrt()]
        }),
        mean_off: {
            let n = largest.len() as f64;
            let error = mean(&|r| r.score.mean_off_error.powi(2)) / n;
            [mean(&|r| r.score.mean_off), error.sqrt()]
        },
        memory: runs.iter().map(|r| r.cost.memory).fold(0.0, f64::max),
        load: runs
            .iter()
            .map(|r| r.cost.load)
            .fold(f64::INFINITY, f64::min),
    })
}

/// Writes the volumes that a scene names as dense arrays, for peers.
fn dense_volumes(scene: &Path, work: &Path) -> Result<()> {
    let value = generate::read(scene)?;
    let base = scene.parent().unwrap_or(Path::new("."));
    for (name, medium) in value["media"].as_object().into_iter().flatten() {
        if let Some(file) = medium["params"]["file"].as_str() {
            let grid = medium["params"]["grid"].as_str().unwrap_or("density");
            let to = work.join(format!("{name}.raw"));
            volume::write_dense(&base.join(file), grid, &to)?;
        }
    }
    Ok(())
}

fn reference_maker(suite: &Suite, case: &Case) -> String {
    match case.converged {
        Converged::Constant(v) => format!("exactly {v}"),
        Converged::Stored | Converged::Of(_) => {
            resolvent_image::Image::read_exr(suite.reference_path(case))
                .ok()
                .and_then(|i| i.metadata.get("by").cloned())
                .unwrap_or_else(|| "unknown".into())
        }
    }
}
