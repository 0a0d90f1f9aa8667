//! Pictures against those by other renderers, block by block.
//!
//! `data/peers/blocks.json` has the means of blocks of 16 × 16 pixels and their standard errors. Ours come from the spread of
//! several seeds, which makes no assumption on how a picture's pixels hang together. Default part: `surface_only`.

use crate::{harness, student};
use resolvent_tests::{Moments, Suite};
use serde_json::Value;

const SEEDS: u64 = 8;

/// The blocks of a scene: mean and standard error, rows from the top, lanes innermost.
struct Blocks {
    across: u32,
    down: u32,
    lanes: usize,
    mean: Vec<f64>,
    error: Vec<f64>,
    /// Degrees of freedom of the errors.
    freedom: f64,
}

fn blocks(name: &str) -> Blocks {
    let path = format!("{}/data/peers/blocks.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let all: Value = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{path}: {e}"));
    let s = &all["scenes"][name];
    let size = |k: usize| s["resolution"][k].as_u64().unwrap_or(0) as u32 / EDGE;
    let numbers = |key: &str| -> Vec<f64> {
        let list = harness::list(s, key);
        list.iter().filter_map(Value::as_f64).collect()
    };
    let out = Blocks {
        across: size(0),
        down: size(1),
        lanes: harness::number(s, "lanes") as usize,
        mean: numbers("mean"),
        error: numbers("error"),
        freedom: (harness::number(s, "pictures") - 1.0) * f64::from(EDGE * EDGE),
    };
    let count = (out.across * out.down) as usize * out.lanes;
    assert!(out.mean.len() == count && out.error.len() == count);
    out
}

/// Edge of a block, pixels.
const EDGE: u32 = 16;

/// Means of the blocks over the seeds, and of the whole picture as the last.
fn rendered(name: &str, integrator: &str, spp: u32, like: &Blocks) -> Vec<Moments> {
    let ready = harness::open(&format!("bench/{name}.json"), integrator);
    let width = like.across * EDGE;
    let count = like.mean.len();
    let mut out = vec![Moments::default(); count + like.lanes];
    for seed in 0..SEEDS {
        let film = ready.render(500 + seed, 0, spp).film;
        let mut sums = vec![0.0; count + like.lanes];
        for i in 0..width * like.down * EDGE {
            let (x, y) = (i % width, i / width);
            let block = ((y / EDGE * like.across + x / EDGE) as usize) * like.lanes;
            for (lane, v) in film.estimate(i as usize).mean[..like.lanes]
                .iter()
                .enumerate()
            {
                sums[block + lane] += v / f64::from(EDGE * EDGE);
                sums[count + lane] += v / f64::from(width * like.down * EDGE);
            }
        }
        for (m, v) in out.iter_mut().zip(sums) {
            m.add(v);
        }
    }
    out
}

#[test]
fn blocks_agree_with_other_renderers() {
    let mut suite = Suite::new();
    // Samples per pixel of pt, bdpt and mlt.
    for (name, samples) in [
        ("surface_only", [16, 4, 2]),
        ("box_fog", [16, 4, 2]),
        ("smoke_area", [16, 6, 2]),
        ("chromatic", [16, 6, 2]),
        ("cloud_sun", [8, 1, 1]),
    ] {
        if name != "surface_only" && !harness::full() {
            continue;
        }
        let reference = blocks(name);
        for (integrator, spp) in ["pt", "bdpt", "mlt"].into_iter().zip(samples) {
            if !harness::chosen(&format!("{name} {integrator}")) {
                continue;
            }
            let found = rendered(name, integrator, spp, &reference);
            let (mut squares, mut judged, mut worst) = (0.0, 0, 0f64);
            for (k, (m, exact)) in found.iter().zip(&reference.mean).enumerate() {
                let (a, b) = (m.standard_error(), reference.error[k]);
                let gap = m.mean() - exact;
                // Rounding of background that has no noise, in files and sums.
                if a.max(b) <= 1e-5 * exact.abs() {
                    assert!(gap.abs() < 1e-4 * exact.abs() + 1e-9, "{name} {k}: {gap}");
                    continue;
                }
                let parts = [(a * a, SEEDS as f64 - 1.0), (b * b, reference.freedom)];
                let (t, p) = student::difference(gap, parts);
                let what = format!(
                    "{name} {integrator}: {} +- {a:.1e}, {exact} +- {b:.1e} in block {} lane {}",
                    m.mean(),
                    k / reference.lanes,
                    k % reference.lanes
                );
                suite.p_value(what, p);
                squares += t * t;
                judged += 1;
                worst = worst.max(t.abs());
            }
            let whole = &found[reference.mean.len()..];
            let blocks = (reference.across * reference.down) as f64;
            let mut line = format!("peers: {name} {integrator}");
            for (lane, m) in whole.iter().enumerate() {
                let of = |v: &[f64]| {
                    v.iter()
                        .skip(lane)
                        .step_by(reference.lanes)
                        .copied()
                        .collect::<Vec<_>>()
                };
                let exact = of(&reference.mean).iter().sum::<f64>() / blocks;
                let error = of(&reference.error)
                    .iter()
                    .map(|e| e * e)
                    .sum::<f64>()
                    .sqrt()
                    / blocks;
                line += &format!(
                    " {:+.2} % (+- {:.2} %)",
                    100.0 * (m.mean() / exact - 1.0),
                    100.0 * m.standard_error().hypot(error) / exact
                );
            }
            println!(
                "{line}, {judged} blocks: rms t {:.2}, worst {worst:.1}",
                (squares / f64::from(judged.max(1))).sqrt()
            );
            assert!(judged > 50);
        }
    }
    let rejected = suite.rejected(1e-3);
    assert!(rejected.is_empty(), "{rejected:#?}");
}
