//! Stated errors are true: over many seeds, intervals cover what they should, and adaptive renders have the mean of uniform ones.

use rayon::prelude::*;
use resolvent_api::{Affine, PluginKind};
use resolvent_engine::film::Errors;
use resolvent_engine::plugin::{ForeignIntegrator, Registry};
use resolvent_engine::scene::Scene;
use resolvent_engine::{Goal, Rendered, Settings, render};
use resolvent_scene::{Filter, PluginBlock};
use resolvent_tests::Moments;
use std::collections::BTreeSet;
use std::ops::Range;
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
    fn new(name: &str, integrator: PluginBlock, size: [u32; 2]) -> Self {
        let file = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../scenes")
            .join(name);
        let mut described = resolvent_scene::Scene::read(file).unwrap_or_else(|e| panic!("{e}"));
        described.film.resolution = size;
        described.film.filter = Filter::Box { radius: 0.5 };
        described.integrator = integrator;
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
            window: self.window(),
            samples: 0..samples,
            goal,
            seed,
            features: false,
            orders: 0,
        };
        let (scene, stop) = (&self.scene, AtomicBool::new(false));
        render(scene, &self.integrator, &settings, &stop, &|_| {})
            .unwrap_or_else(|e| panic!("{}", e.error))
    }

    fn window(&self) -> [u32; 4] {
        [0, 0, self.size[0], self.size[1]]
    }

    fn pixels(&self) -> usize {
        (self.size[0] * self.size[1]) as usize
    }
}

/// What many renders say of themselves, against their mean.
#[derive(Debug)]
struct Calibration {
    /// Share of pixels and lanes whose 95 % interval covers the truth, of those that have any noise.
    pixels: f64,
    /// Share of pictures whose interval of the mean covers the truth, over lanes.
    means: f64,
    /// Mean square of the true relative error over that of the stated one.
    error: f64,
    /// The same of the picture's mean: variance over the mean of stated variances.
    variance: f64,
    /// Share of pictures that doubt their error.
    doubtful: f64,
}

fn calibrate(shot: &Shot, seeds: u64, samples: u32, goal: Goal) -> Calibration {
    let all: Vec<Rendered> = (0..seeds)
        .into_par_iter()
        .map(|seed| shot.render(seed + 5001, samples, goal))
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
            for (sum, v) in mean.iter_mut().zip(e.mean) {
                *sum += v / n;
            }
        }
    }
    let level = pixel_means.iter().flatten().sum::<f64>() / (3 * shot.pixels()) as f64;
    let mut tile_means = pixel_means.clone();
    for tile in all[0].film.tiles() {
        let pixels = || tile.indices(shot.window());
        let sum = |k: usize| pixels().map(|i| pixel_means[i][k]).sum::<f64>();
        let mean = [0, 1, 2].map(|k| sum(k) / tile.pixels() as f64);
        pixels().for_each(|i| tile_means[i] = mean);
    }
    let (mut sum_of_variance, mut sum_of_squares, mut noisy) = (0.0, 0.0, 0.0);
    let half_widths: Vec<_> = all.iter().map(|r| r.film.half_widths()).collect();
    for (i, truth) in pixel_means.iter().enumerate() {
        // Of a constant sky there is nothing to cover.
        let first = all[0].film.estimate(i).mean[0];
        let is_noisy = |r: &Rendered| (r.film.estimate(i).mean[0] / first - 1.0).abs() > 1e-9;
        let counts = f64::from(u8::from(all.iter().any(is_noisy)));
        for (r, half_widths) in all.iter().zip(&half_widths) {
            let e = r.film.estimate(i);
            let variance = e.variance.unwrap_or_else(|| panic!("no variance"));
            for k in 0..3 {
                let off = (e.mean[k] - truth[k]) * n / (n - 1.0);
                let inside = off.abs() <= half_widths[i][k] * widening.sqrt();
                covered += counts * f64::from(u8::from(inside));
                noisy += counts;
                tested += 1.0;
                let mean = tile_means[i][k];
                true_error += off * off / widening / (mean * mean + 0.01 * level * level);
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
        pixels: covered / noisy,
        means,
        error: true_error / tested / stated_error,
        variance: sum_of_squares / sum_of_variance,
        doubtful: all.iter().filter(doubtful).count() as f64 / n,
    }
}

/// What 200 renders say of their errors is true on average, with light tails and heavy ones, and 95 % intervals of pixels and of
/// pictures' means cover the truth 93 to 97 % of the time.
fn covers_the_truth(name: &str, integrator: PluginBlock, size: [u32; 2], samples: u32) {
    let shot = Shot::new(name, integrator, size);
    let samples = samples * if full() { 4 } else { 1 };
    let c = calibrate(&shot, 200, samples, Goal::Samples);
    println!("{name} {samples}: {c:?}");
    is_true(name, &c);
}

fn is_true(name: &str, c: &Calibration) {
    assert!((0.93..0.97).contains(&c.pixels), "{name}: {c:?}");
    // Of 200 pictures 1.5 % is the standard error of a share of 95 %.
    assert!((0.915..0.985).contains(&c.means), "{name}: {c:?}");
    // Small nets are the noisier ones: with nets of two sizes the variance is overstated where they help, up to 1.4 times.
    assert!((0.7..1.15).contains(&c.variance), "{name}: {c:?}");
    assert!((0.7..1.15).contains(&c.error), "{name}: {c:?}");
    assert!(c.doubtful < 0.25, "{name}: {c:?}");
}

#[test]
fn intervals_cover_the_truth_on_surfaces() {
    // 64 samples are four nets of 16, 256 ten of two sizes.
    covers_the_truth(
        "bench/surface_only.json",
        PluginBlock::new("pt"),
        [12, 8],
        64,
    );
    covers_the_truth(
        "bench/surface_only.json",
        PluginBlock::new("pt"),
        [8, 6],
        256,
    );
}

/// Where blocks of pixels share their paths, errors are alike around a pixel, whose variance is taken from there.
#[test]
fn intervals_cover_the_truth_where_paths_are_shared() {
    let pt = PluginBlock::new("pt").with("reuse", 4.0);
    covers_the_truth("bench/surface_only.json", pt, [12, 8], 64);
}

#[test]
fn intervals_cover_the_truth_in_fog() {
    covers_the_truth("bench/box_fog.json", PluginBlock::new("pt"), [12, 8], 64);
}

#[test]
fn intervals_cover_the_truth_in_a_cloud() {
    covers_the_truth("bench/cloud_sun.json", PluginBlock::new("pt"), [12, 8], 64);
}

#[test]
fn intervals_cover_the_truth_from_both_ends() {
    covers_the_truth(
        "lampshade/lampshade.json",
        PluginBlock::new("bdpt"),
        [8, 6],
        64,
    );
}

/// What adaptive renders say of themselves is as true, though their samples end where the error is small.
#[test]
fn intervals_cover_the_truth_where_samples_follow_errors() {
    for (name, goal) in [
        ("bench/cloud_sun.json", 0.15),
        ("bench/box_fog.json", 0.1),
        ("bench/surface_only.json", 0.03),
    ] {
        let shot = Shot::new(name, PluginBlock::new("pt"), [12, 8]);
        let c = calibrate(&shot, 400, 1 << 20, Goal::Error(goal));
        println!("{name} {goal}: {c:?}");
        is_true(name, &c);
    }
}

/// Caustics found by chance: fewer pixels are covered, and the picture says so.
#[test]
fn heavy_tails_are_told() {
    let shot = Shot::new("caustic/caustic.json", PluginBlock::new("pt"), [16, 16]);
    let c = calibrate(&shot, 24, 64, Goal::Samples);
    println!("{c:?}");
    assert!(c.pixels < 0.93 && c.doubtful > 0.9, "{c:?}");
}

/// Adaptive renders have the mean of uniform ones.
#[test]
fn adaptive_means_are_not_biased() {
    let shot = Shot::new("bench/cloud_sun.json", PluginBlock::new("pt"), [20, 12]);
    let seeds: u64 = if full() { 200 } else { 12 };
    let goal = 0.15;
    let run = |seed: u64, samples: u32, goal: Goal| {
        let film = shot.render(seed, samples, goal).film;
        let all = (0..shot.pixels()).map(|i| film.estimate(i).mean[0]);
        let mean = all.sum::<f64>() / shot.pixels() as f64;
        (mean, film.estimate(0).samples)
    };
    let adaptive: Vec<_> = (0..seeds)
        .into_par_iter()
        .map(|s| run(s + 1000, 1 << 20, Goal::Error(goal)))
        .collect();
    let uniform: Vec<_> = (0..seeds)
        .into_par_iter()
        .map(|s| run(s + 5000, 256, Goal::Samples))
        .collect();
    let a = Moments::of(adaptive.iter().map(|r| r.0));
    let b = Moments::of(uniform.iter().map(|r| r.0));
    let z = (a.mean() - b.mean()) / a.standard_error().hypot(b.standard_error());
    println!("{} {} z {z}", a.mean(), b.mean());
    assert!(z.abs() < 3.5, "{z}");
    // Their numbers of samples were decided by samples.
    let counts: BTreeSet<u32> = adaptive.iter().map(|r| r.1).collect();
    assert!(counts.len() > 1, "{counts:?}");
}

/// Where walks leave their light on any pixel, all pixels have the same samples, and the goal is met.
#[test]
fn walks_from_lights_are_sampled_alike() {
    let shot = Shot::new(
        "lampshade/lampshade.json",
        PluginBlock::new("bdpt"),
        [20, 6],
    );
    let goal = 0.2;
    let film = shot.render(1, 1 << 20, Goal::Error(goal)).film;
    let samples = film.estimate(0).samples;
    assert!((0..shot.pixels()).all(|i| film.estimate(i).samples == samples));
    let worst = film.errors().map_or(f64::NAN, |e| e.worst_tile);
    println!("{samples} samples, worst tile {worst:.3}");
    assert!(samples > 32 && worst <= goal, "{samples} {worst}");
}

/// What several renders of a shot tell together.
struct Survey {
    /// Of every pixel.
    means: Vec<f64>,
    /// Tile by tile what squares of errors are relative to, see `Errors`.
    scales: Vec<f64>,
    /// Tile by tile the square of the relative error that a render states, in the mean.
    squares: Vec<f64>,
    /// Look-ups of a density that a render takes.
    lookups: f64,
    renders: Vec<Rendered>,
}

impl Survey {
    fn of(shot: &Shot, seeds: Range<u64>, samples: u32, goal: Goal) -> Self {
        let renders: Vec<Rendered> = seeds
            .into_par_iter()
            .map(|s| shot.render(s, samples, goal))
            .collect();
        let n = renders.len() as f64;
        let over = |f: &dyn Fn(&Rendered) -> f64| renders.iter().map(f).sum::<f64>() / n;
        let variance = |r: &Rendered, i| r.film.estimate(i).variance.map_or(f64::NAN, |v| v[0]);
        let means: Vec<f64> = (0..shot.pixels())
            .map(|i| over(&|r| r.film.estimate(i).mean[0]))
            .collect();
        let level = means.iter().sum::<f64>() / shot.pixels() as f64;
        let (mut scales, mut squares) = (Vec::new(), Vec::new());
        for tile in renders[0].film.tiles() {
            let pixels = || tile.indices(shot.window());
            let count = tile.pixels() as f64;
            let mean = pixels().map(|i| means[i]).sum::<f64>() / count;
            let scale = mean * mean + 0.01 * level * level;
            let sum = over(&|r| pixels().map(|i| variance(r, i)).sum());
            squares.push(sum / count / scale);
            scales.push(scale);
        }
        Self {
            means,
            scales,
            squares,
            lookups: over(&|r| r.counters.lookups as f64),
            renders,
        }
    }

    /// Square of the worst tile's error, root mean square over renders.
    fn worst(&self) -> f64 {
        self.squares.iter().copied().fold(0.0, f64::max)
    }

    /// Squares of what these renders are off the mean of others, over what all of them state, and the standard error of that if
    /// differences are normal.
    fn excess(&self, shot: &Shot, others: &Self) -> (f64, f64) {
        let (mut found, mut stated, mut noise) = (0.0, 0.0, 0.0);
        let count = others.renders.len() as f64;
        for r in &self.renders {
            for (t, tile) in r.film.tiles().enumerate() {
                let square = self.squares[t] + others.squares[t] / count;
                for i in tile.indices(shot.window()) {
                    let off = r.film.estimate(i).mean[0] - others.means[i];
                    found += off * off / others.scales[t];
                    stated += square;
                    noise += 2.0 * square * square;
                }
            }
        }
        (found / stated, noise.sqrt() / stated)
    }
}

/// Samples go where the error is: for the same largest error of a tile, `--error` does less work than a uniform render, and that
/// error is what was asked for. What renders state of it is the truth.
///
/// A tile's error is the root of the mean over renders of its stated squares. In a single one the worst of many tiles that are
/// as good as another is the one that got too few samples by chance.
#[test]
fn adaptive_sampling_pays() {
    // The larger the picture, the more tiles are easy.
    let (size, goal, least) = if full() {
        ([256, 192], 0.15, 1.5)
    } else {
        ([48, 32], 0.12, 1.05)
    };
    let shot = Shot::new("bench/cloud_sun.json", PluginBlock::new("pt"), size);
    let samples = 64;
    let uniform = Survey::of(&shot, 100..108, samples, Goal::Samples);
    let adaptive = Survey::of(&shot, 1..9, 1 << 20, Goal::Error(goal));
    let (excess, error) = adaptive.excess(&shot, &uniform);
    let worst = adaptive.worst().sqrt();
    // A uniform render's variance falls as the inverse of its samples.
    let more = uniform.worst() / adaptive.worst();
    let gain = more * uniform.lookups / adaptive.lookups;
    println!(
        "goal {goal}: worst tile {worst:.4}, true over stated squares {excess:.3} ± {error:.3}, {:.4e} look-ups; uniform needs {:.0} samples, {gain:.3} times the look-ups",
        adaptive.lookups,
        more * f64::from(samples),
    );
    assert!(
        (excess - 1.0).abs() < 0.05 + 3.0 * error,
        "{excess} ± {error}"
    );
    assert!(worst < goal, "{worst}");
    assert!(gain > least, "{gain}");
}
