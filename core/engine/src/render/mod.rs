//! The scheduler: work is divided into pieces, a tile and samples of one net each, and the same pieces whatever the threads.
//!
//! A render to a number of samples or a time goes through the nets, all tiles each ([`uniform`]); one to an error decides for every
//! tile when it has enough ([`adaptive`]). What is done is kept in a [`State`], which [`go_on`] continues from.

mod adaptive;
mod job;
mod piece;
mod uniform;

pub use adaptive::Adaptive;
#[cfg(test)]
pub(crate) use adaptive::tests::unfinished;

use crate::checkpoint::State;
use crate::error::{Error, Result};
use crate::film::{self, Film, TOO_FAINT};
use crate::plugin::ForeignIntegrator;
use crate::scene::{Counters, Scene};
use job::Job;
use resolvent_pathspace::nets;
use serde_json::Value;
use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// When a render ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// All samples of the range are taken.
    Samples,
    /// The first of: this time is over, the samples are taken.
    Time(Duration),
    /// The first of: the estimated relative error (see [`crate::film::Errors`]) of no tile is above this, the samples are taken.
    Error(f64),
}

/// What to render.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Width and height of the full image.
    pub resolution: [u32; 2],
    /// Window: x0, y0, x1, y1.
    pub window: [u32; 4],
    /// Which samples of every pixel.
    pub samples: Range<u32>,
    /// When to stop.
    pub goal: Goal,
    /// Seed.
    pub seed: u64,
    /// Fill depth, albedo and normal.
    pub features: bool,
    /// Layers of light by scattering order; layer k has the light scattered k times, the last one all that was scattered more
    /// often. 0: none.
    pub orders: usize,
}

impl Settings {
    /// Bytes of memory that the sums take; `splats`: with light from walks that started at lights.
    pub fn film_bytes(&self, splats: bool) -> u64 {
        let (halves, parts) = match self.goal {
            Goal::Error(_) => (2, 1),
            _ => (1, parts_of_nets(&self.samples)),
        };
        let [x0, y0, x1, y1] = self.window;
        let pixels = u64::from(x1 - x0) * u64::from(y1 - y0);
        pixels * (halves * film::pixel_bytes(self.features, self.orders, splats, parts)) as u64
    }
}

/// How many nets a range, which is not empty, has only in part.
fn parts_of_nets(samples: &Range<u32>) -> usize {
    let (first, last) = (nets::around(samples.start), nets::around(samples.end - 1));
    let (front, back) = (first.start < samples.start, samples.end < last.end);
    usize::from(front) + usize::from(back) - usize::from(front && back && first == last)
}

/// How far a render has come.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Share of the work done, 0 to 1 (of the time, the samples, or the error, by goal).
    pub done: f64,
    /// Samples per pixel that every pixel has.
    pub samples: u32,
    /// Estimated relative error, if known: of the picture, or of its worst tile if that is what ends the render.
    pub error: Option<f64>,
    /// Since the start.
    pub elapsed: Duration,
}

/// What came out.
pub struct Rendered {
    /// The film; pixels may differ in their number of samples if the render was stopped, or adaptive.
    pub film: Film,
    /// Counts over all workers.
    pub counters: Counters,
    /// True if it was stopped before its goal.
    pub interrupted: bool,
    /// Samples per pixel that every pixel has.
    pub samples: u32,
    /// Seconds, with those of earlier parts that it went on from.
    pub seconds: f64,
    /// How far it came, if it was adaptive.
    pub adaptive: Option<Adaptive>,
}

impl From<State> for Rendered {
    /// The same as if it had just been rendered.
    fn from(s: State) -> Self {
        Self {
            interrupted: false,
            samples: s.film.least_samples(),
            film: s.film,
            counters: s.counters,
            seconds: s.seconds,
            adaptive: s.adaptive,
        }
    }
}

/// Why a render ended without reaching its goal, with what was finished before.
pub struct Broken {
    /// What happened.
    pub error: Error,
    /// The work finished until then, if any pixel has samples.
    pub rendered: Option<Box<Rendered>>,
}

/// How a render keeps what it has done.
#[derive(Clone, Copy)]
pub struct Keep<'k> {
    /// How often.
    pub every: Duration,
    /// What is rendered, and with what.
    pub identity: &'k Value,
    /// Anything else worth telling.
    pub about: &'k Value,
    /// Writes a checkpoint; called by one thread at a time, while others go on.
    pub save: &'k (dyn Fn(&[u8]) + Sync),
}

/// Renders with the threads of the current rayon pool. `stop` ends it early, `report` hears of its progress.
///
/// # Errors
/// If a plugin breaks; what was finished comes along.
pub fn render(
    scene: &Scene,
    integrator: &ForeignIntegrator,
    settings: &Settings,
    stop: &AtomicBool,
    report: &(dyn Fn(Progress) + Sync),
) -> std::result::Result<Rendered, Box<Broken>> {
    go_on(None, scene, integrator, settings, None, stop, report)
}

/// As [`render`], from where another render of the same scene and settings left off, and with checkpoints now and then.
///
/// # Errors
/// As [`render`]; and if the state is not one that this render could have come to.
pub fn go_on(
    from: Option<State>,
    scene: &Scene,
    integrator: &ForeignIntegrator,
    settings: &Settings,
    keep: Option<Keep>,
    stop: &AtomicBool,
    report: &(dyn Fn(Progress) + Sync),
) -> std::result::Result<Rendered, Box<Broken>> {
    let state = match from {
        Some(state) => check(&state, settings).map(|()| state),
        None => Ok(begin(settings)),
    };
    let state = state.map_err(|why| {
        Box::new(Broken {
            error: Error::Input(why),
            rendered: None,
        })
    })?;
    let job = Job::new(scene, integrator, settings, keep, stop, report, state);
    let finished = match settings.goal {
        Goal::Error(goal) if job.is_adaptive() => adaptive::run(&job, goal),
        _ => uniform::run(&job),
    };
    let (state, error) = job.end();
    let rendered = Rendered {
        interrupted: !finished && error.is_none(),
        ..Rendered::from(state)
    };
    match error {
        None => Ok(rendered),
        Some(why) => Err(Box::new(Broken {
            error: Error::Plugin(why),
            rendered: (!rendered.film.is_empty()).then(|| Box::new(rendered)),
        })),
    }
}

/// Why a render to an error that cannot be told ends.
fn too_faint() -> String {
    format!("{TOO_FAINT}, or ask for a number of samples instead of an error")
}

/// The state in which a render begins.
fn begin(settings: &Settings) -> State {
    match settings.goal {
        Goal::Error(goal) => {
            let film = Film::in_halves(settings.window, settings.features);
            let film = film.with_orders(settings.orders);
            let adaptive = Adaptive::new(goal, film.tiles().len());
            State {
                adaptive: Some(adaptive),
                ..State::new(film)
            }
        }
        _ => {
            let film = Film::new(settings.window, settings.features);
            State::new(film.with_orders(settings.orders))
        }
    }
}

/// Makes sure that the render that `settings` ask for can go on from a state.
fn check(state: &State, settings: &Settings) -> std::result::Result<(), String> {
    let film = &state.film;
    let layers = (film.has_features(), film.orders());
    if film.window() != settings.window || layers != (settings.features, settings.orders) {
        return Err("the checkpoint is of another window or has other layers".into());
    }
    match (&state.adaptive, settings.goal) {
        (Some(a), Goal::Error(goal)) if a.goal() == goal => return Ok(()),
        (Some(a), _) => {
            let goal = a.goal();
            return Err(format!(
                "the checkpoint is of a render to an error of {goal}, which has decided by that what to sample: go on with the same goal"
            ));
        }
        (None, _) => {}
    }
    for i in 0..film.tiles().len() {
        let there = film.coverage(i);
        if there.beyond(&settings.samples).is_some() {
            let Range { start, end } = settings.samples;
            return Err(format!(
                "the checkpoint has samples {there}, and only {start}..{end} are asked for: ask for all of them, or more"
            ));
        }
    }
    Ok(())
}

/// Runs `f` in a pool of `threads` threads (0: as many as there are processors).
///
/// # Errors
/// If the threads cannot be started.
pub fn with_threads<R: Send>(threads: usize, f: impl FnOnce() -> R + Send) -> Result<R> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Error::Input(format!("cannot start {threads} threads: {e}")))?;
    Ok(pool.install(f))
}
