//! The scheduler: work is divided into (tile × sample range) and done in passes over the image.

use crate::error::{Error, Result};
use crate::film::{Buffer, Film};
use crate::plugin::ForeignIntegrator;
use crate::scene::{Counters, Scene, View};
use rayon::prelude::*;
use resolvent_api::Spectrum;
use resolvent_api::abi::{OutputTable, PixelSample, Status, Tile};
use resolvent_pathspace::sampler::BATCH;
use std::ffi::c_void;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Edge of a tile, pixels.
const TILE: u32 = 16;
/// Samples of a pixel that one piece of work holds at the most. A multiple of the sampler's batch.
const LONGEST_PASS: u32 = 4 * BATCH;

/// When a render ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// All samples of the range are taken.
    Samples,
    /// The first of: this time is over, the samples are taken.
    Time(Duration),
    /// The first of: the estimated relative error (see [`Film::relative_error`]) is not above this, the samples are taken.
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
}

/// How far a render has come.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Share of the work done, 0 to 1 (of the time, the samples, or the error, by goal).
    pub done: f64,
    /// Samples per pixel that every pixel has.
    pub samples: u32,
    /// Estimated relative error, if known.
    pub error: Option<f64>,
    /// Since the start.
    pub elapsed: Duration,
}

/// What came out.
pub struct Rendered {
    /// The film; pixels may differ in their number of samples if the render was stopped.
    pub film: Film,
    /// Counts over all workers.
    pub counters: Counters,
    /// True if it was stopped before its goal.
    pub interrupted: bool,
    /// Samples per pixel that every pixel has.
    pub samples: u32,
    /// Seconds.
    pub seconds: f64,
    /// Where the first sample that was not finite came up.
    pub rejected_at: Option<[u32; 2]>,
}

/// Why a render ended without reaching its goal, with what was finished before.
pub struct Broken {
    /// What happened.
    pub error: Error,
    /// The work finished until then, if any pixel has samples.
    pub rendered: Option<Box<Rendered>>,
}

struct Work {
    film: Film,
    counters: Counters,
    rejected_at: Option<[u32; 2]>,
    error: Option<String>,
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
    let start = Instant::now();
    let work = Mutex::new(Work {
        film: Film::new(settings.window, settings.features).exposed(scene.camera.exposure()),
        counters: Counters::default(),
        rejected_at: None,
        error: None,
    });
    let tiles = tiles(settings.window);
    let broken = AtomicBool::new(false);
    let out_of_time = AtomicBool::new(false);
    let mut begin = settings.samples.start;
    let mut length = BATCH - begin % BATCH;
    let mut error = None;
    while begin < settings.samples.end && !stop.load(Ordering::Relaxed) {
        let end = begin.saturating_add(length).min(settings.samples.end);
        let finished = std::sync::atomic::AtomicUsize::new(0);
        tiles.par_iter().for_each(|(min, max)| {
            if stop.load(Ordering::Relaxed) || broken.load(Ordering::Relaxed) {
                return;
            }
            if let Goal::Time(limit) = settings.goal
                && start.elapsed() >= limit
            {
                out_of_time.store(true, Ordering::Relaxed);
                return;
            }
            let tile = Tile {
                min: *min,
                max: *max,
                sample_begin: begin,
                sample_end: end,
                seed: settings.seed,
                resolution: settings.resolution,
                window: settings.window,
                features: u32::from(settings.features),
                margin: (scene.camera.filter().radius() - 0.5).max(0.0),
            };
            if let Err(why) = piece(scene, integrator, &tile, &work) {
                broken.store(true, Ordering::Relaxed);
                lock(&work).error.get_or_insert(why);
            }
            let done = finished.fetch_add(1, Ordering::Relaxed) + 1;
            let share = (f64::from(begin - settings.samples.start)
                + f64::from(end - begin) * done as f64 / tiles.len() as f64)
                / f64::from(settings.samples.end - settings.samples.start);
            let elapsed = start.elapsed();
            let share = match settings.goal {
                Goal::Time(limit) => (elapsed.as_secs_f64() / limit.as_secs_f64()).max(share),
                _ => share,
            };
            report(Progress {
                done: share.min(1.0),
                samples: begin - settings.samples.start,
                error,
                elapsed,
            });
        });
        if broken.load(Ordering::Relaxed)
            || out_of_time.load(Ordering::Relaxed)
            || stop.load(Ordering::Relaxed)
        {
            break;
        }
        begin = end;
        length = length.saturating_mul(2).clamp(BATCH, LONGEST_PASS);
        length -= (begin + length) % BATCH;
        length = length.max(1);
        error = lock(&work).film.relative_error();
        if let (Goal::Error(goal), Some(e)) = (settings.goal, error)
            && e <= goal
        {
            break;
        }
    }
    let work = work.into_inner().unwrap_or_else(|e| e.into_inner());
    let rendered = Rendered {
        film: work.film,
        counters: work.counters,
        interrupted: stop.load(Ordering::Relaxed) && begin < settings.samples.end,
        samples: begin - settings.samples.start,
        seconds: start.elapsed().as_secs_f64(),
        rejected_at: work.rejected_at,
    };
    match work.error {
        None => Ok(rendered),
        Some(why) => Err(Box::new(Broken {
            error: Error::Plugin(why),
            rendered: (!rendered.film.is_empty()).then(|| Box::new(rendered)),
        })),
    }
}

fn lock(work: &Mutex<Work>) -> std::sync::MutexGuard<'_, Work> {
    work.lock().unwrap_or_else(|e| e.into_inner())
}

/// One piece of work, added to the film when it is complete.
fn piece(
    scene: &Scene,
    integrator: &ForeignIntegrator,
    tile: &Tile,
    work: &Mutex<Work>,
) -> std::result::Result<(), String> {
    let view = View::new(scene);
    let mut sink = Sink {
        buffer: Buffer::new(tile.min, tile.max, tile.sample_begin, tile.features != 0),
        error: None,
    };
    let out = OutputTable {
        size: size_of::<OutputTable>() as u32,
        reserved: 0,
        ctx: (&raw mut sink).cast(),
        add,
        splat,
    };
    let result = integrator.render(&view.table(), tile, &out);
    if let Some(why) = view.take_error().or_else(|| {
        sink.error
            .take()
            .map(|e| format!("{} {e}", integrator.title()))
    }) {
        return Err(why);
    }
    if let Err(f) = result {
        return Err(format!("{}: {}", integrator.title(), f.0));
    }
    let wanted = tile.sample_end - tile.sample_begin;
    if let Some(([x, y], n)) = sink.buffer.uneven(wanted) {
        let title = integrator.title();
        return Err(format!(
            "{title} added {n} samples to pixel ({x}, {y}) instead of {wanted}"
        ));
    }
    let mut counters = view.counters();
    counters.rejected = sink.buffer.rejected;
    let mut work = lock(work);
    work.counters.add(&counters);
    if let Some(at) = sink.buffer.rejected_at {
        let first = work.rejected_at.map_or(at, |old| old.min(at));
        work.rejected_at = Some(first);
    }
    work.film.merge(sink.buffer, scene.camera.filter());
    Ok(())
}

struct Sink {
    buffer: Buffer,
    error: Option<String>,
}

unsafe extern "C" fn add(ctx: *mut c_void, x: u32, y: u32, sample: *const PixelSample) -> Status {
    // SAFETY: ctx is the `Sink` of this table, used by one integrator call on one thread.
    let (sink, sample) = unsafe { (&mut *ctx.cast::<Sink>(), &*sample) };
    match sink.buffer.add(x, y, sample) {
        Ok(()) => Status::OK,
        Err(why) => {
            sink.error.get_or_insert(why);
            Status::ERROR
        }
    }
}

unsafe extern "C" fn splat(
    ctx: *mut c_void,
    film: *const [f32; 2],
    radiance: *const Spectrum,
) -> Status {
    // SAFETY: as above.
    let (sink, film, radiance) = unsafe { (&mut *ctx.cast::<Sink>(), *film, *radiance) };
    if !sink.buffer.splats.add(film, radiance) {
        sink.buffer.rejected += 1;
        let at = film.map(|v| v.max(0.0) as u32);
        sink.buffer.rejected_at.get_or_insert(at);
    }
    Status::OK
}

/// The tiles of a window, in rows from its top.
fn tiles(window: [u32; 4]) -> Vec<([u32; 2], [u32; 2])> {
    let [x0, y0, x1, y1] = window;
    let mut out = Vec::new();
    for y in (y0..y1).step_by(TILE as usize) {
        for x in (x0..x1).step_by(TILE as usize) {
            out.push(([x, y], [(x + TILE).min(x1), (y + TILE).min(y1)]));
        }
    }
    out
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
