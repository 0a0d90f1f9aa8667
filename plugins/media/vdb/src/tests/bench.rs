//! Timings, printed when `RESOLVENT_BENCH` is set:
//! `RESOLVENT_BENCH=1 cargo test --release -p resolvent-medium-vdb bench -- --nocapture`.

use super::{data, draws, medium};
use crate::settings::{Choice, Settings};
use resolvent_api::math::{Vec3, warp};
use resolvent_api::rng::Stream;
use resolvent_api::{FlightDraws, Medium, Segment, Spectrum};

/// Flights that start where light scatters: at collisions of earlier flights, in all directions.
pub fn inner_segments(medium: &dyn Medium, count: usize) -> Vec<Segment> {
    let bounds = medium.info().bounds;
    let mut stream = Stream::new(7);
    let mut out = Vec::new();
    while out.len() < count {
        let target = Vec3::from(bounds.min)
            + bounds.extent() * Vec3::new(stream.uniform(), stream.uniform(), stream.uniform());
        let mut d = warp::sphere(stream.uniform2());
        let mut o = target - d * (2.0 * bounds.extent().length());
        let mut t1 = f32::INFINITY;
        for _ in 0..200 {
            let s = Segment {
                o: o.into(),
                t0: 0.0,
                d: d.into(),
                t1,
            };
            let Some((_, far)) = bounds.clip(o, d, 0.0, f32::INFINITY) else {
                break;
            };
            t1 = far;
            if out.len() < count && t1 < 2.0 * bounds.extent().length() {
                out.push(s);
            }
            let u = draws(&mut stream);
            let f = medium.sample(&s, &u);
            if !f.collided() {
                break;
            }
            o = s.at(f.t);
            d = warp::sphere(stream.uniform2());
        }
    }
    out
}

/// Walks from the starts of `seeds`, up to 64 flights each; the number of look-ups.
fn walk(medium: &dyn Medium, seeds: &[Segment], flights: usize) -> u64 {
    let mut stream = Stream::new(11);
    let (mut done, mut lookups) = (0, 0);
    for seed in seeds.iter().step_by(37).cycle() {
        let mut s = *seed;
        for _ in 0..64 {
            let f = medium.sample(&s, &draws(&mut stream));
            lookups += u64::from(f.lookups);
            done += 1;
            if done == flights {
                return lookups;
            }
            if !f.collided() {
                break;
            }
            let d = warp::sphere(stream.uniform2());
            s = Segment {
                o: s.at(f.t).into(),
                t0: 0.0,
                d: d.into(),
                t1: 20.0,
            };
        }
    }
    lookups
}

/// Time this thread has run: other processes don't count.
fn cpu_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = text
        .split_whitespace()
        .next()
        .and_then(|n| n.parse::<f64>().ok());
    nanoseconds.unwrap_or(f64::NAN) * 1e-9
}

#[test]
fn bench() {
    // "1" for everything, or words of which each must be in a row's name: "cloud_s Survival sample".
    let Ok(wanted) = std::env::var("RESOLVENT_BENCH") else {
        return;
    };
    let grey = |v: f32| Spectrum::rgb(v, v, v);
    let scenes = [
        ("cloud_s", "cloud_s.vdb", grey(24.56)),
        (
            "cloud_rgb",
            "cloud_s.vdb",
            Spectrum::rgb(2.72889, 8.18667, 24.56),
        ),
        ("cloud_dense", "cloud_s.vdb", grey(200.0)),
        ("smoke_thin", "real/smoke.vdb", grey(0.2)),
        ("smoke_half", "real/smoke.vdb", grey(0.6)),
        ("smoke", "real/smoke.vdb", grey(1.492)),
    ];
    for (name, file, sigma) in scenes {
        let mut settings = Settings::new(data(file).to_string_lossy(), "density");
        settings.sigma_t = sigma;
        for choice in [Choice::Survival, Choice::Ratio] {
            settings.transmittance = choice;
            let m = medium(&settings);
            let segments = inner_segments(&*m, 200_000);
            let mut stream = Stream::new(1);
            let all: Vec<_> = segments.iter().map(|_| draws(&mut stream)).collect();
            let run = |what: &str, f: &dyn Fn(&Segment, &FlightDraws) -> (f32, u32, u32)| {
                let row = format!("{name} {choice:?} {what}");
                if wanted != "1" && !wanted.split(' ').all(|w| row.contains(w)) {
                    return;
                }
                let mut best = f64::MAX;
                let (mut sum, mut squares, mut lookups, mut ends) = (0.0f64, 0.0f64, 0u64, 0u64);
                for _ in 0..15 {
                    (sum, squares, lookups, ends) = (0.0, 0.0, 0, 0);
                    let start = cpu_seconds();
                    for (s, u) in segments.iter().zip(&all) {
                        let (v, l, e) = f(s, u);
                        sum += f64::from(v);
                        squares += f64::from(v) * f64::from(v);
                        lookups += u64::from(l);
                        ends += u64::from(e);
                    }
                    best = best.min(cpu_seconds() - start);
                }
                let n = segments.len() as f64;
                println!(
                    "{name:10} {choice:?} {what:9} {:7.1} ns, {:.2} look-ups, mean {:.5}, second moment {:.5}, ends {:.3}",
                    best * 1e9 / n,
                    lookups as f64 / n,
                    sum / n,
                    squares / n,
                    ends as f64 / n
                );
            };
            // Paths as an integrator walks them: each flight starts where the one before collided.
            let row = format!("{name} {choice:?} walk");
            if wanted == "1" || wanted.split(' ').all(|w| row.contains(w)) {
                let flights = 1_000_000;
                let (mut best, mut lookups) = (f64::MAX, 0u64);
                for _ in 0..9 {
                    let start = cpu_seconds();
                    lookups = walk(&*m, &segments, flights);
                    best = best.min(cpu_seconds() - start);
                }
                println!(
                    "{name:10} {choice:?} walk      {:7.1} ns, {:.2} look-ups",
                    best * 1e9 / flights as f64,
                    lookups as f64 / flights as f64
                );
            }
            run("sample", &|s, u| {
                let f = m.sample(s, u);
                (f.t - s.t0, f.lookups, f.event)
            });
            run("transmit", &|s, u| {
                let f = m.transmit(s, u);
                (f.value[0] / f.ratio[0], f.lookups, f.event)
            });
            // Two estimates of each transmittance tell the noise from what differs between segments.
            let (mut within, mut total, mut square) = (0.0f64, 0.0, 0.0);
            let mut other = Stream::new(2);
            for (s, u) in segments.iter().zip(&all).take(50_000) {
                let value = |u: &FlightDraws| {
                    let f = m.transmit(s, u);
                    f64::from(f.value[2] / f.ratio.mean(3))
                };
                let (a, b) = (value(u), value(&draws(&mut other)));
                within += 0.5 * (a - b) * (a - b) / 50_000.0;
                total += a / 50_000.0;
                square += a * b / 50_000.0;
            }
            println!(
                "{name:10} {choice:?} mean T {total:.4}, its square {square:.4}, variance within a segment {within:.5}"
            );
            run("depth", &|s, _| (m.depth(s)[0], 0, 0));
        }
    }
}

/// Two threads that take tasks from a common counter.
struct Pair;

impl resolvent_vdb::Parallel for Pair {
    fn run(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
        let next = std::sync::atomic::AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    loop {
                        let i = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                        if i >= count {
                            return;
                        }
                        task(i);
                    }
                });
            }
        });
    }
}

/// Time and memory of loading the file that `RESOLVENT_VDB` names.
#[test]
fn bench_load() {
    let Ok(path) = std::env::var("RESOLVENT_VDB") else {
        return;
    };
    let status = |key: &str| {
        let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let line = text
            .lines()
            .find(|l| l.starts_with(key))
            .unwrap_or_default();
        line.split_whitespace()
            .nth(1)
            .and_then(|v| v.parse::<f64>().ok())
            .unwrap_or(f64::NAN)
            * 1024.0
    };
    let before = status("VmRSS");
    let start = std::time::Instant::now();
    let services = crate::load::Services {
        parallel: &Pair,
        warn: &|w| println!("{w}"),
    };
    let m = crate::build::build(&Settings::new(path, "density"), services).unwrap();
    let info = m.info();
    println!(
        "{:.2} s, {:.1} MB active voxels, {:.1} MB held, peak {:.1} MB above the start",
        start.elapsed().as_secs_f64(),
        info.voxels as f64 * 4e-6,
        info.memory as f64 * 1e-6,
        (status("VmHWM") - before) * 1e-6
    );
}
