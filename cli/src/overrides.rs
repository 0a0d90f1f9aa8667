//! What the command line changes in a scene, and the work that follows.

use crate::args::Render;
use crate::failure::{Outcome, input};
use resolvent_engine::Goal;
use resolvent_engine::film::MOST_SAMPLES;
use resolvent_scene::{Budget, PluginBlock, Scene};
use std::ops::Range;
use std::time::Duration;

/// Which samples to take, and when to stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Samples of every pixel's sequence.
    pub samples: Range<u32>,
    /// When to stop.
    pub goal: Goal,
}

/// Puts the options into the scene.
pub fn apply(a: &Render, scene: &mut Scene) -> Outcome<Plan> {
    if let Some(size) = a.resolution {
        scene.film.resolution = size.0;
    }
    if let Some(window) = a.crop {
        scene.film.crop = Some(window.0);
    }
    let [w, h] = scene.film.resolution;
    if let Some([x0, y0, x1, y1]) = scene.film.crop
        && (x1 > w || y1 > h)
    {
        let whose = if a.crop.is_some() {
            "--crop"
        } else {
            "the scene's crop, which --crop replaces,"
        };
        return Err(input(format!(
            "{whose} {x0},{y0},{x1},{y1} leaves the picture of {w}x{h} pixels"
        )));
    }
    for aov in &a.aov {
        // Of layers by scattering order, the last number given counts.
        scene.film.aovs.retain(|b| b.name() != aov.name());
        scene.film.aovs.push(*aov);
    }
    if let Some(seed) = a.seed {
        scene.sampling.seed = seed;
    }
    if let Some(name) = &a.integrator
        && *name != scene.integrator.plugin
    {
        // Paths on the command line start from the current folder, those in scenes from the scene's.
        let mut block = PluginBlock::new(name.as_str());
        if block.is_path() {
            let path = std::path::absolute(name).map_err(|e| input(format!("{name}: {e}")))?;
            block.plugin = path.to_string_lossy().into_owned();
        }
        scene.integrator = block;
    }
    if let Some(edge) = a.reuse {
        let block = std::mem::take(&mut scene.integrator);
        if block.plugin != "pt" {
            return Err(input(format!(
                "--reuse is for the integrator pt; this is {}",
                block.plugin
            )));
        }
        scene.integrator = block.with("reuse", f64::from(edge));
    }
    if let Some(n) = a.spp {
        scene.sampling.budget = Budget::Spp(n);
    } else if let Some(t) = a.time {
        scene.sampling.budget = Budget::Time(t);
    } else if let Some(e) = a.error {
        scene.sampling.budget = Budget::Error(e);
    }
    plan(a, scene)
}

fn plan(a: &Render, scene: &Scene) -> Outcome<Plan> {
    let all = 0..MOST_SAMPLES;
    let plan = |samples, goal| Ok(Plan { samples, goal });
    if let Some(range) = &a.sample_range {
        let Range { start, end } = range.0;
        if end > MOST_SAMPLES {
            return Err(input(format!(
                "--sample-range {start}..{end} is beyond {MOST_SAMPLES}, the most samples that a pixel can have"
            )));
        }
        return plan(range.0.clone(), Goal::Samples);
    }
    match scene.sampling.budget {
        Budget::Spp(n) if n > u64::from(MOST_SAMPLES) => Err(input(format!(
            "{n} samples per pixel are asked for; at most {MOST_SAMPLES} can be taken"
        ))),
        Budget::Spp(n) => plan(0..n as u32, Goal::Samples),
        Budget::Time(t) => plan(all, Goal::Time(Duration::from_secs_f64(t.min(1e9)))),
        Budget::Error(e) => plan(all, Goal::Error(e)),
    }
}
