//! What Metropolis transport gains where light is hard to find: `ajar`, a room lit by a lamp in the hall behind a door that stands six
//! degrees open (Veach & Guibas 1997, fig. 7, has the like).
//!
//! Pictures of several seeds by `bdpt` and `mlt` in about equal time, in turns. Their spread over the seeds, relative to the squared
//! reference plus 0.01 (the relMSE of `resolvent bench`), is the squared error if there is no bias; that there is none is tested block by block.
//! The reference was made by `resolvent render scenes/ajar/ajar.json --integrator bdpt --resolution 64x48 --spp 8192 --seed 999 --aov variance`;
//! each of its pixels is four of those here.

use crate::harness::{self, Ready};
use crate::student;
use nix::sys::resource::{UsageWho, getrusage};
use resolvent_bench::score::{DARK, Picture};
use resolvent_tests::{Moments, Suite};

const SIZE: [u32; 2] = [128, 96];
const SEEDS: usize = 8;
/// Edge of a block, pixels.
const BLOCK: usize = 16;

/// Pictures of an integrator.
struct Trial {
    name: &'static str,
    spp: u32,
    ready: Ready,
    seconds: Vec<f64>,
    pictures: Vec<Vec<[f64; 3]>>,
}

impl Trial {
    fn new(name: &'static str, spp: u32) -> Self {
        Self {
            name,
            spp,
            ready: harness::open_with("ajar/ajar.json", |s| {
                s.integrator = resolvent_scene::PluginBlock::new(name);
                s.film.resolution = SIZE;
            }),
            seconds: Vec::new(),
            pictures: Vec::new(),
        }
    }

    /// One more picture, on one thread, whose CPU time counts.
    fn run(&mut self, pool: &rayon::ThreadPool, seed: u64) {
        let (seconds, picture) = pool.install(|| {
            let start = cpu();
            let film = self.ready.render(seed, 0, self.spp).film;
            let seconds = cpu() - start;
            let pixels = SIZE[0] as usize * SIZE[1] as usize;
            let picture = (0..pixels).map(|i| film.estimate(i).mean).collect();
            (seconds, picture)
        });
        self.seconds.push(seconds);
        self.pictures.push(picture);
    }

    /// relMSE times CPU seconds, without the picture `left`.
    fn cost(&self, reference: &[[f64; 3]], left: Option<usize>) -> f64 {
        let kept = |k: &usize| Some(*k) != left;
        let n = (0..SEEDS).filter(kept).count() as f64;
        let mut sum = 0.0;
        for (i, r) in reference.iter().enumerate() {
            for (lane, r) in r.iter().enumerate() {
                let values = (0..SEEDS).filter(kept).map(|k| self.pictures[k][i][lane]);
                sum += Moments::of(values).variance() / (r * r + DARK);
            }
        }
        let seconds = (0..SEEDS).filter(kept).map(|k| self.seconds[k]);
        sum / (3.0 * reference.len() as f64) * seconds.sum::<f64>() / n
    }

    /// Logarithm of the cost, and its standard error by the jackknife over pictures.
    fn log_cost(&self, reference: &[[f64; 3]]) -> (f64, f64) {
        let parts = (0..SEEDS).map(|k| self.cost(reference, Some(k)).ln());
        let m = Moments::of(parts);
        let n = SEEDS as f64;
        let error = (m.variance() * (n - 1.0) * (n - 1.0) / n).sqrt();
        (self.cost(reference, None).ln(), error)
    }

    /// Tests the means of blocks against the reference's.
    fn judge(&self, reference: &Picture, suite: &mut Suite) -> f64 {
        let half = BLOCK / 2;
        let (width, across) = (SIZE[0] as usize, SIZE[0] as usize / BLOCK);
        let mut squares = 0.0;
        let blocks = across * (SIZE[1] as usize / BLOCK);
        for block in 0..blocks {
            let (x0, y0) = (block % across, block / across);
            for lane in 0..3 {
                let found = Moments::of(self.pictures.iter().map(|p| {
                    let pixel = |k| p[(y0 * BLOCK + k / BLOCK) * width + x0 * BLOCK + k % BLOCK];
                    (0..BLOCK * BLOCK).map(|k| pixel(k)[lane]).sum::<f64>() / (BLOCK * BLOCK) as f64
                }));
                let (mut exact, mut variance) = (0.0, 0.0);
                for k in 0..half * half {
                    let i = (y0 * half + k / half) * (width / 2) + x0 * half + k % half;
                    exact += reference.color[i][lane];
                    variance += reference.variance.as_ref().map_or(0.0, |v| v[i][lane]);
                }
                let n = (half * half) as f64;
                (exact, variance) = (exact / n, variance / (n * n));
                let own = found.standard_error().powi(2);
                // The reference's part of the variance is known well.
                let parts = [(own, SEEDS as f64 - 1.0), (variance, f64::INFINITY)];
                let (t, p) = student::difference(found.mean() - exact, parts);
                let what = format!(
                    "{}: {} for {exact} in block {block} lane {lane}, t {t:.1}",
                    self.name,
                    found.mean()
                );
                suite.p_value(what, p);
                squares += t * t / (3.0 * blocks as f64);
            }
        }
        squares.sqrt()
    }
}

fn cpu() -> f64 {
    let used = getrusage(UsageWho::RUSAGE_THREAD).expect("this thread's usage");
    let seconds = |t: nix::sys::time::TimeVal| t.tv_sec() as f64 + 1e-6 * t.tv_usec() as f64;
    seconds(used.user_time()) + seconds(used.system_time())
}

#[test]
fn metropolis_gains_behind_a_door() {
    if cfg!(debug_assertions) {
        // Times of debug builds mean nothing.
        return;
    }
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("data/ajar/reference.exr");
    let reference = Picture::read(&path).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(reference.size, SIZE.map(|s| s as usize / 2));
    let (width, half) = (SIZE[0] as usize, SIZE[0] as usize / 2);
    let relative: Vec<[f64; 3]> = (0..width * SIZE[1] as usize)
        .map(|i| reference.color[i / width / 2 * half + i % width / 2])
        .collect();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    let mut trials = [Trial::new("bdpt", 36), Trial::new("mlt", 14)];
    for seed in 0..SEEDS as u64 {
        for (k, trial) in trials.iter_mut().enumerate() {
            trial.run(&pool, 7000 + 100 * k as u64 + seed);
        }
    }
    let mut suite = Suite::new();
    for t in &trials {
        let rms = t.judge(&reference, &mut suite);
        let (cost, error) = t.log_cost(&relative);
        let seconds = t.seconds.iter().sum::<f64>() / SEEDS as f64;
        println!(
            "gain: {} {} spp, {seconds:.2} CPU-s, relMSE {:.4} +- {:.1} %, efficiency {:.3}, blocks: rms t {rms:.2}",
            t.name,
            t.spp,
            cost.exp() / seconds,
            100.0 * error,
            (-cost).exp()
        );
    }
    let [(bdpt, e), (mlt, f)] = [0, 1].map(|k: usize| trials[k].log_cost(&relative));
    let (log, error) = (bdpt - mlt, e.hypot(f));
    println!(
        "gain: of mlt over bdpt {:.2} +- {:.2}",
        log.exp(),
        log.exp() * error
    );
    assert!(log > 2.0 * error, "e^{log} +- {error}");
    let rejected = suite.rejected(1e-3);
    assert!(rejected.is_empty(), "{rejected:#?}");
}
