//! Integrators, by the pictures of two small scenes.

use super::Stages;
use super::subject::{Params, Subject};
use super::variants::Variant;
use crate::failure::Outcome;
use resolvent_api::{Affine, PluginKind};
use resolvent_conformance::{Moments, Suite, property};
use resolvent_engine::plugin::ForeignIntegrator;
use resolvent_engine::scene::Scene;
use resolvent_engine::{Goal, Rendered, Settings, render, with_threads};
use serde_json::{Value, json};
use std::ops::Range;
use std::sync::atomic::AtomicBool;

/// Edge of the pictures: four tiles.
const EDGE: u32 = 32;
/// Samples per pixel.
const SAMPLES: u32 = 16;
/// Samples of a net, at the beginning of a pixel's sequence.
const NET: u32 = 64;
/// Seed of the pictures.
const SEED: u64 = 7;

/// A white ball in a white fog that fills a ball, in the light of a white sky: nothing is brighter than the sky.
fn furnace() -> Value {
    json!({
        "resolvent": 1,
        "camera": {"type": "perspective", "origin": [0, 0, 6], "target": [0, 0, 0], "fov_x_deg": 40},
        "lights": [{"type": "environment", "radiance": 1}],
        "materials": {"white": {"plugin": "diffuse", "params": {"reflectance": 1}}},
        "media": {"fog": {"plugin": "homogeneous", "params": {
            "sigma_t": 1, "albedo": 1, "bounds": [-1.5, -1.5, -1.5, 1.5, 1.5, 1.5]}}},
        "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "white"}],
    })
}

/// A floor in coloured fog under a lamp and a point light.
fn room() -> Value {
    json!({
        "resolvent": 1,
        "camera": {"type": "perspective", "origin": [0, 1, 5], "target": [0, 0, 0], "fov_x_deg": 50},
        "lights": [{"type": "point", "position": [1, 2, 1], "intensity": [3, 2, 1]}],
        "materials": {
            "grey": {"plugin": "diffuse", "params": {"reflectance": [0.6, 0.5, 0.4]}},
            "lamp": {"plugin": "diffuse", "params": {"reflectance": 0}}},
        "media": {"fog": {"plugin": "homogeneous", "params": {
            "sigma_t": [0.3, 0.5, 0.8], "albedo": 0.8, "bounds": [-2, -1, -2, 2, 1, 2]}}},
        "shapes": [
            {"type": "rectangle", "corner": [-2, -1, 2], "edge_u": [4, 0, 0], "edge_v": [0, 0, -4], "material": "grey"},
            {"type": "sphere", "center": [-0.5, 1.2, 0], "radius": 0.2, "material": "lamp", "emission": 6}],
    })
}

/// A scene of the kit with the integrator.
struct Stage {
    scene: Scene,
    integrator: ForeignIntegrator,
}

impl Stage {
    fn new(subject: &Subject, params: &Params, mut scene: Value) -> Result<Self, String> {
        let path = subject
            .plugin
            .path
            .canonicalize()
            .map_err(|e| e.to_string())?;
        scene["integrator"] = json!({"plugin": path, "params": params});
        scene["film"] = json!({"resolution": [EDGE, EDGE]});
        let described = resolvent_scene::Scene::parse(scene.to_string().as_bytes(), "parameters")
            .map_err(|e| e.to_string())?;
        let scene = Scene::build(&described, &subject.registry).map_err(|e| e.to_string())?;
        let instance = subject
            .registry
            .instantiate(
                PluginKind::Integrator,
                &described.integrator,
                &described,
                &Affine::IDENTITY,
                scene.lanes,
            )
            .map_err(|e| e.to_string())?;
        let integrator = ForeignIntegrator::new(instance).map_err(|e| e.to_string())?;
        Ok(Self { scene, integrator })
    }

    fn picture(&self, samples: Range<u32>, threads: usize) -> Result<Rendered, String> {
        self.seeded(SEED, samples, threads)
    }

    fn seeded(&self, seed: u64, samples: Range<u32>, threads: usize) -> Result<Rendered, String> {
        let settings = Settings {
            resolution: [EDGE; 2],
            window: [0, 0, EDGE, EDGE],
            samples,
            goal: Goal::Samples,
            seed,
            features: true,
            orders: 0,
        };
        let stop = AtomicBool::new(false);
        with_threads(threads, || {
            render(&self.scene, &self.integrator, &settings, &stop, &|_| {})
                .map_err(|b| b.error.to_string())
        })
        .map_err(|e| e.to_string())?
    }
}

/// Means of all pixels, bit by bit.
fn bits(r: &Rendered) -> Vec<u32> {
    let pixels = (0..(EDGE * EDGE) as usize).map(|i| r.film.estimate(i).mean);
    pixels
        .flatten()
        .flat_map(|v| [v.to_bits() as u32, (v.to_bits() >> 32) as u32])
        .collect()
}

/// The picture of the room by a new instance.
pub fn fingerprint(subject: &Subject, threads: usize) -> Vec<u32> {
    Stage::new(subject, &subject.base, room())
        .and_then(|s| s.picture(0..4, threads))
        .map_or_else(|_| Vec::new(), |r| bits(&r))
}

/// All checks, with one set of parameters.
pub fn thorough(suite: &mut Suite, subject: &Subject, v: &Variant, stages: Stages) -> Outcome<()> {
    for (name, scene) in [("furnace", furnace()), ("room", room())] {
        let what = format!("{}, {name}", v.name);
        stages(property::SAMPLES, &what);
        suite.about(property::FAILURES);
        let stage = Stage::new(subject, &v.params, scene);
        let whole = stage.and_then(|s| Ok((s.picture(0..SAMPLES, 0)?, s)));
        suite.claim(whole.is_ok(), || {
            format!(
                "{what}: {}",
                whole.as_ref().err().map_or("", String::as_str)
            )
        });
        let Ok((whole, stage)) = whole else { continue };
        suite.about(property::SAMPLES);
        if name == "furnace" {
            furnace_holds(suite, &what, &whole);
        }
        stages(property::THREADS, &what);
        let mut same = |property, how: &str, other: Result<Rendered, String>| {
            suite.about(property);
            let equal = other.is_ok_and(|o| bits(&o) == bits(&whole));
            suite.claim(equal, || format!("{what}: the picture differs {how}"));
        };
        same(
            property::DETERMINISM,
            "when repeated",
            stage.picture(0..SAMPLES, 0),
        );
        for threads in [1, 8] {
            let how = format!("with {threads} threads");
            same(property::THREADS, &how, stage.picture(0..SAMPLES, threads));
        }
        stages(property::PREFIX, &what);
        parts(suite, &what, &stage, &whole);
        stages(property::SAMPLES, &what);
        numbered(suite, &what, &stage);
    }
    Ok(())
}

/// No light where there is more than comes from the sky.
fn furnace_holds(suite: &mut Suite, what: &str, whole: &Rendered) {
    suite.about(property::ENERGY);
    let all = Moments::of((0..(EDGE * EDGE) as usize).map(|i| whole.film.estimate(i).mean[0]));
    let most = 1.0 + 5.0 * all.standard_error() + 1e-5;
    suite.at_most(all.mean(), most, || {
        format!(
            "{what}: a picture of mean {:.5} under a sky of 1",
            all.mean()
        )
    });
}

/// Two halves of the samples are the whole. Integrators that splat may have chains, one for each net: they are divided between nets.
fn parts(suite: &mut Suite, what: &str, stage: &Stage, whole: &Rendered) {
    suite.about(property::PREFIX);
    let chains = whole.film.has_splats();
    let half = if chains { NET } else { SAMPLES / 2 };
    let longer = chains.then(|| stage.picture(0..2 * half, 0));
    let parts = stage
        .picture(0..half, 0)
        .and_then(|a| Ok((a, stage.picture(half..2 * half, 0)?, longer.transpose()?)));
    let Ok((a, b, longer)) = parts else {
        suite.claim(false, || format!("{what}: a part of the samples fails"));
        return;
    };
    let whole = longer.as_ref().unwrap_or(whole);
    for i in 0..(EDGE * EDGE) as usize {
        let (a, b, all) = (
            a.film.estimate(i),
            b.film.estimate(i),
            whole.film.estimate(i),
        );
        for lane in 0..3 {
            let mean = 0.5 * (a.mean[lane] + b.mean[lane]);
            let off = (mean - all.mean[lane]).abs();
            suite.at_most(off, 1e-9 * all.mean[lane].abs() + 1e-12, || {
                format!(
                    "{what}: pixel {i} is {:.6}, but {mean:.6} in two parts",
                    all.mean[lane]
                )
            });
        }
    }
}

/// Samples of another number are other samples. Two parts alone don't show that: pieces of work may begin in the same places as in
/// the whole.
fn numbered(suite: &mut Suite, what: &str, stage: &Stage) {
    suite.about(property::SAMPLES);
    let one = |seed, i| stage.seeded(seed, i..i + 1, 0).map(|r| bits(&r));
    let (Ok(first), Ok(second), Ok(other)) = (one(SEED, 0), one(SEED, 1), one(SEED + 1, 0)) else {
        suite.claim(false, || format!("{what}: a single sample fails"));
        return;
    };
    // Where no seed changes anything, there are no random numbers that could repeat.
    suite.claim(first != second || first == other, || {
        format!("{what}: samples 0 and 1 are the same in every pixel: their numbers don't count")
    });
}
