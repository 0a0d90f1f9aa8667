//! Stated errors are true: over many seeds, intervals cover what they should, and adaptive renders have the mean of uniform ones.

use rayon::prelude::*;
use resolvent_api::{Affine, PluginKind};
use resolvent_engine::film::{Errors, student};
use resolvent_engine::plugin::{ForeignIntegrator, Registry};
use resolvent_engine::scene::Scene;
use resolvent_engine::{Goal, Rendered, Settings, render};
use resolvent_scene::Filter;
use resolvent_tests::Moments;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Everything is run, not only the default part.
fn full() -> bool {
    std::env::var_os("RESOLVENT_FULL").is_some_and(|v| v == "1")
}

/// An example scene in a small size.
struct Shot {
    scene: Scene,
    integrator: ForeignIntegrator,
    size: [u32; 2],
}

impl Shot {
    fn new(name: &str, integrator: &str, size: [u32; 2]) -> Self {
        let file = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../scenes")
            .join(name);
        let mut described = resolvent_scene::Scene::read(file).unwrap_or_else(|e| panic!("{e}"));
        described.film.resolution = size;
        described.film.filter = Filter::Box { radius: 0.5 };
        described.integrator = resolvent_scene::PluginBlock::new(integrator);
        let registry = Registry::new(&[]);
        let scene = Scene::build(&described, &registry).unwrap_or_else(|e| panic!("{e}"));
        let kind = PluginKind::Integrator;
        let block = &described.integrator;
        let instance = registry
            .instantiate(kind, block, &described, &Affine::IDENTITY, scene.lanes)
            .unwrap_or_else(|e| panic!("{e}"));
        Self {
            scene,
            integrator: ForeignIntegrator::new(instance).unwrap_or_else(|e| panic!("{e}")),
            size,
        }
    }

    fn render(&self, seed: u64, samples: u32, goal: Goal) -> Rendered {
        let settings = Settings {
            resolution: self.size,
            window: [0, 0, self.size[0], self.size[1]],
            samples: 0..samples,
            goal,
            seed,
            features: false,
        };
        let (scene, stop) = (&self.scene, AtomicBool::new(false));
        render(scene, &self.integrator, &settings, &stop, &|_| {})
            .unwrap_or_else(|e| panic!("{}", e.error))
    }

    fn pixels(&self) -> usize {
        (self.size[0] * self.size[1]) as usize
    }
}

/// What many renders say of themselves, against their mean.
#[derive(Debug)]
struct Calibration {
    /// Share of pixels and lanes whose 95 % interval covers the truth.
    pixels: f64,
    /// Share of pictures whose mean's interval covers the truth, over lanes.
    means: f64,
    /// Mean square of the true relative error over that of the stated one.
    error: f64,
    /// The same of the picture's mean: variance over the mean of stated variances.
    variance: f64,
    /// Share of pictures that doubt their error.
    doubtful: f64,
}

fn calibrate(shot: &Shot, seeds: u64, samples: u32) -> Calibration {
    let all: Vec<Rendered> = (0..seeds)
        .into_par_iter()
        .map(|seed| shot.render(seed + 1, samples, Goal::Samples))
        .collect();
    let n = seeds as f64;
    // The truth is the mean of all others, whose own error widens the difference a little.
    let widening = 1.0 + 1.0 / (n - 1.0);
    let (mut covered, mut tested) = (0.0, 0.0);
    let mut true_error = 0.0;
    let mut pixel_means = vec![[0.0; 3]; shot.pixels()];
    for (i, mean) in pixel_means.iter_mut().enumerate() {
        for r in &all {
            let e = r.film.estimate(i);
            for k in 0..3 {
                mean[k] += e.mean[k] / n;
            }
        }
    }
    let level = pixel_means.iter().flatten().sum::<f64>() / (3 * shot.pixels()) as f64;
    let (mut sum_of_variance, mut sum_of_squares) = (0.0, 0.0);
    for (i, truth) in pixel_means.iter().enumerate() {
        for r in &all {
            let e = r.film.estimate(i);
            let variance = e.variance.unwrap_or_else(|| panic!("no variance"));
            for k in 0..3 {
                let off = (e.mean[k] - truth[k]) * n / (n - 1.0);
                let half = student(f64::from(e.degrees)) * variance[k].sqrt();
                covered += f64::from(u8::from(off.abs() <= half * widening.sqrt()));
                tested += 1.0;
                true_error += off * off / widening / (truth[k] * truth[k] + 0.01 * level * level);
                sum_of_variance += variance[k];
                sum_of_squares += off * off / widening;
            }
        }
    }
    let stated = |e: Option<Errors>| e.map_or(f64::NAN, |e| e.picture * e.picture);
    let stated_error = all.iter().map(|r| stated(r.film.errors())).sum::<f64>() / n;
    let mut means = 0.0;
    for k in 0..3 {
        let of = |r: &Rendered| {
            r.film
                .interval()
                .map_or((f64::NAN, 0.0), |i| (i.mean[k], i.half_width[k]))
        };
        let truth = Moments::of(all.iter().map(|r| of(r).0)).mean();
        let inside = |r: &&Rendered| {
            let (mean, half) = of(r);
            ((mean - truth) * n / (n - 1.0)).abs() <= half * widening.sqrt()
        };
        means += all.iter().filter(inside).count() as f64 / n / 3.0;
    }
    let doubtful = |r: &&Rendered| r.film.errors().is_some_and(|e| e.are_doubtful());
    Calibration {
        pixels: covered / tested,
        means,
        error: true_error / tested / stated_error,
        variance: sum_of_squares / sum_of_variance,
        doubtful: all.iter().filter(doubtful).count() as f64 / n,
    }
}

/// 95 % intervals of 200 renders cover the truth 93 to 97 % of the time, pixel by pixel and for the whole picture, and the stated error
/// is the true one; where tails are so heavy that this cannot be, the picture says so.
#[test]
fn intervals_cover_the_truth() {
    // Net by net: 64 samples are four of 16; smooth surfaces, fog, a cloud in the sun, walks from both ends, chains.
    let scenes: [(&str, &str, u32); 5] = [
        ("bench/surface_only.json", "pt", 64),
        ("bench/surface_only.json", "pt", 256),
        ("bench/box_fog.json", "pt", 128),
        ("bench/cloud_sun.json", "pt", 64),
        ("lampshade/lampshade.json", "bdpt", 64),
    ];
    for (name, integrator, samples) in scenes {
        let begin = std::time::Instant::now();
        let shot = Shot::new(name, integrator, [8, 6]);
        let samples = samples * if full() { 4 } else { 1 };
        let c = calibrate(&shot, 200, samples);
        println!("{name} {integrator} {samples}: {c:?} {:?}", begin.elapsed());
    }
}

/// Caustics found by chance: whatever the picture says of its error is wrong, and it says that as well.
#[test]
fn heavy_tails_are_told() {
    let shot = Shot::new("caustic/caustic.json", "pt", [24, 16]);
    let c = calibrate(&shot, 24, 64);
    println!("{c:?}");
}

/// Adaptive renders have the mean of uniform ones, tile by tile.
#[test]
fn adaptive_means_are_not_biased() {
    let shot = Shot::new("bench/cloud_sun.json", "pt", [20, 12]);
    let seeds: u64 = if full() { 200 } else { 24 };
    let goal = 0.3;
    let mean = |r: &Rendered| -> f64 {
        let all = (0..shot.pixels()).map(|i| r.film.estimate(i).mean[0]);
        all.sum::<f64>() / shot.pixels() as f64
    };
    let run = |seed: u64, samples: u32, goal: Goal| {
        let r = shot.render(seed, samples, goal);
        (mean(&r), f64::from(r.samples))
    };
    let adaptive: Vec<_> = (0..seeds)
        .into_par_iter()
        .map(|s| run(s + 1000, 1 << 20, Goal::Error(goal)))
        .collect();
    let uniform: Vec<_> = (0..seeds)
        .into_par_iter()
        .map(|s| run(s + 5000, 96, Goal::Samples))
        .collect();
    let a = Moments::of(adaptive.iter().map(|r| r.0));
    let b = Moments::of(uniform.iter().map(|r| r.0));
    let z = (a.mean() - b.mean()) / a.standard_error().hypot(b.standard_error());
    println!("{} {} z {z}", a.mean(), b.mean());
    assert!(z.abs() < 3.5, "{z}");
}
