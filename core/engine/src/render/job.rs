//! A render in progress: what its workers share.

use super::{Goal, Keep, Progress, Settings, piece};
use crate::checkpoint::State;
use crate::film::Rect;
use crate::plugin::ForeignIntegrator;
use crate::scene::{Scene, Until};
use resolvent_api::abi::Tile;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// Where the samples of a piece go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Into {
    /// To the film, or to a half of it.
    Film {
        /// Which half.
        second: bool,
    },
    /// To what an adaptive render knows of a tile beyond the picture.
    Probe {
        /// Of which half.
        second: bool,
    },
}

/// How far beyond its end of time a render may still finish what it has begun, as a share of that time, and seconds.
const PATIENCE: f64 = 0.1;
const PATIENCE_SECONDS: f64 = 1.0;

/// What is shared.
pub struct Job<'j> {
    scene: &'j Scene,
    integrator: &'j ForeignIntegrator,
    pub settings: &'j Settings,
    keep: Option<Keep<'j>>,
    stop: &'j AtomicBool,
    report: &'j (dyn Fn(Progress) + Sync),
    start: Instant,
    /// Seconds of what this goes on from.
    before: f64,
    state: Mutex<State>,
    error: Mutex<Option<String>>,
    broken: AtomicBool,
    out_of_time: AtomicBool,
    /// Seconds after the start at which the next checkpoint is due; taken away while one is being written.
    due: Mutex<Option<f64>>,
    /// Least samples of a pixel, for progress.
    pub samples: AtomicU64,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}

impl<'j> Job<'j> {
    pub fn new(
        scene: &'j Scene,
        integrator: &'j ForeignIntegrator,
        settings: &'j Settings,
        keep: Option<Keep<'j>>,
        stop: &'j AtomicBool,
        report: &'j (dyn Fn(Progress) + Sync),
        state: State,
    ) -> Self {
        Self {
            scene,
            integrator,
            settings,
            keep,
            stop,
            report,
            start: Instant::now(),
            before: state.seconds,
            samples: AtomicU64::new(state.film.least_samples().into()),
            state: Mutex::new(state),
            error: Mutex::new(None),
            broken: AtomicBool::new(false),
            out_of_time: AtomicBool::new(false),
            due: Mutex::new(keep.map(|k| k.every.as_secs_f64())),
        }
    }

    /// What is done so far.
    pub fn state(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }

    /// True if samples go where the error is.
    pub fn is_adaptive(&self) -> bool {
        self.state().adaptive.is_some()
    }

    /// True if it was stopped from outside, or a plugin broke.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.broken.load(Ordering::Relaxed)
    }

    /// True if its time is over.
    pub fn is_out_of_time(&self) -> bool {
        self.out_of_time.load(Ordering::Relaxed)
    }

    fn seconds(&self) -> f64 {
        self.before + self.start.elapsed().as_secs_f64()
    }

    /// Renders a piece of work and adds it, unless the render has ended. True if it has been done.
    pub fn piece(&self, rect: Rect, index: usize, samples: Range<u32>, into: Into) -> bool {
        if self.is_stopped() || self.is_out_of_time() {
            return false;
        }
        if let Goal::Time(limit) = self.settings.goal
            && self.seconds() >= limit.as_secs_f64()
        {
            self.out_of_time.store(true, Ordering::Relaxed);
            return false;
        }
        let s = self.settings;
        let tile = Tile {
            min: rect.min,
            max: rect.max,
            sample_begin: samples.start,
            sample_end: samples.end,
            seed: s.seed,
            resolution: s.resolution,
            window: s.window,
            features: u32::from(s.features),
            margin: (self.scene.camera.filter().radius() - 0.5).max(0.0),
        };
        let done = piece::render(self.scene, self.integrator, &tile, s.orders, self.until())
            .and_then(|piece| piece.map(|p| self.add(p, index, into)).transpose());
        match done {
            Ok(Some(())) => {}
            Ok(None) => {
                let out_of_time = !self.is_stopped();
                self.out_of_time.fetch_or(out_of_time, Ordering::Relaxed);
                return false;
            }
            Err(why) => {
                self.fail(why);
                return false;
            }
        }
        self.keep();
        true
    }

    /// What ends a piece that has begun: the render is stopped, or a plugin broke, or time is over by so much that it is not worth
    /// waiting for.
    fn until(&self) -> Until<'_> {
        let limit = match self.settings.goal {
            Goal::Time(limit) => Some(limit.as_secs_f64()),
            _ => None,
        };
        let left = limit.map(|l| (1.0 + PATIENCE) * l + PATIENCE_SECONDS - self.before);
        let deadline = left
            .and_then(|s| Duration::try_from_secs_f64(s.max(0.0)).ok())
            .and_then(|s| self.start.checked_add(s));
        Until {
            flags: [self.stop, &self.broken],
            deadline,
        }
    }

    /// Ends the render with an error.
    pub fn fail(&self, why: String) {
        self.broken.store(true, Ordering::Relaxed);
        lock(&self.error).get_or_insert(why);
    }

    fn add(&self, piece: piece::Finished, index: usize, into: Into) -> Result<(), String> {
        let filter = self.scene.camera.filter();
        let mut state = self.state();
        let state = &mut *state;
        state.counters.add(&piece.counters);
        match into {
            Into::Film { second } => state.film.half(second).merge(piece.buffer, filter),
            Into::Probe { second } => match &mut state.adaptive {
                Some(a) => a.probe(index, second).merge(piece.buffer.bare(), filter),
                None => Ok(()),
            },
        }
    }

    /// Writes a checkpoint if it is time.
    fn keep(&self) {
        let Some(keep) = self.keep else {
            return;
        };
        {
            let mut due = lock(&self.due);
            match *due {
                Some(when) if self.start.elapsed().as_secs_f64() >= when => *due = None,
                _ => return,
            }
        }
        let bytes = {
            let mut state = self.state();
            state.seconds = self.seconds();
            state.to_bytes(keep.identity, keep.about)
        };
        (keep.save)(&bytes);
        let next = self.start.elapsed() + keep.every;
        *lock(&self.due) = Some(next.as_secs_f64());
    }

    /// Tells of progress.
    pub fn report(&self, done: f64, error: Option<f64>) {
        let seconds = self.seconds();
        let done = match self.settings.goal {
            Goal::Time(limit) => (seconds / limit.as_secs_f64()).max(done),
            _ => done,
        };
        (self.report)(Progress {
            done: done.min(1.0),
            samples: self.samples.load(Ordering::Relaxed) as u32,
            error,
            elapsed: Duration::from_secs_f64(self.start.elapsed().as_secs_f64()),
        });
    }

    /// What was done, and what broke.
    pub fn end(self) -> (State, Option<String>) {
        let seconds = self.seconds();
        let mut state = self.state.into_inner().unwrap_or_else(|e| e.into_inner());
        state.seconds = seconds;
        let error = self.error.into_inner().unwrap_or_else(|e| e.into_inner());
        (state, error)
    }
}
