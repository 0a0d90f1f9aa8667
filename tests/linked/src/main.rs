//! What the plugin boundary costs: renders a scene by plugins that are linked into this program and by the same ones loaded from
//! `target/release`, by turns, and compares the processor time. The pictures must agree bit for bit.
//!
//! ```sh
//! cargo build --release && cargo run --release --manifest-path tests/linked/Cargo.toml -- scenes/bench/cloud_sun.json
//! ```
//!
//! Ends with an error if loaded plugins take more than 3 % more. With a word, `linked` or `loaded`, after the samples it renders once that
//! way, for those who count instructions, which no other load on the machine disturbs:
//!
//! ```sh
//! valgrind --tool=callgrind --toggle-collect='resolvent_linked::Built::render*' tests/linked/target/release/resolvent-linked \
//!     scenes/bench/cloud_sun.json 1 loaded
//! ```

use nix::sys::resource::{UsageWho, getrusage};
use resolvent_api::{Affine, PluginKind};
use resolvent_engine::plugin::{ForeignIntegrator, Registry};
use resolvent_engine::scene::Scene;
use resolvent_engine::{Goal, Rendered, Settings, render, with_threads};
use std::error::Error;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Pairs of renders.
const PAIRS: usize = 12;
/// Most that loaded plugins may take, as a multiple.
const BOUND: f64 = 1.03;

/// The plugins of both ways; what a scene needs besides, it does not get.
const PLUGINS: [(PluginKind, &str); 4] = [
    (PluginKind::Integrator, "pt"),
    (PluginKind::Medium, "vdb"),
    (PluginKind::Phase, "hg"),
    (PluginKind::Bsdf, "diffuse"),
];

fn registry(linked: bool) -> Result<Registry, Box<dyn Error>> {
    let target = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/release");
    let mut registry = Registry::new(&[target]);
    if linked {
        registry.link(&linked_pt::resolvent_plugin)?;
        registry.link(&linked_vdb::resolvent_plugin)?;
        registry.link(&linked_hg::resolvent_plugin)?;
        registry.link(&linked_diffuse::resolvent_plugin)?;
    }
    for (kind, name) in PLUGINS {
        let path = registry.find(kind, name)?.path.clone();
        assert_eq!(path.is_file(), !linked, "{}", path.display());
    }
    Ok(registry)
}

/// A scene and its integrator.
struct Built {
    scene: Scene,
    integrator: ForeignIntegrator,
    settings: Settings,
}

impl Built {
    fn new(file: &str, spp: u32, linked: bool) -> Result<Self, Box<dyn Error>> {
        let described = resolvent_scene::Scene::read(file)?;
        let registry = registry(linked)?;
        let scene = Scene::build(&described, &registry)?;
        let instance = registry.instantiate(
            PluginKind::Integrator,
            &described.integrator,
            &described,
            &Affine::IDENTITY,
            scene.lanes,
        )?;
        Ok(Self {
            scene,
            integrator: ForeignIntegrator::new(instance)?,
            settings: Settings {
                resolution: described.film.resolution,
                window: described.film.window(),
                samples: 0..spp,
                goal: Goal::Samples,
                seed: described.sampling.seed,
                features: false,
                orders: 0,
            },
        })
    }

    /// Renders; also the processor time it took.
    fn render(&self) -> Result<(Rendered, f64), Box<dyn Error>> {
        let stop = AtomicBool::new(false);
        let start = cpu();
        let rendered = render(
            &self.scene,
            &self.integrator,
            &self.settings,
            &stop,
            &|_| {},
        );
        let took = cpu() - start;
        Ok((rendered.map_err(|broken| broken.error.to_string())?, took))
    }
}

/// User seconds of this process.
fn cpu() -> f64 {
    getrusage(UsageWho::RUSAGE_SELF).map_or(0.0, |u| {
        let t = u.user_time();
        t.tv_sec() as f64 + t.tv_usec() as f64 * 1e-6
    })
}

fn bits(r: &Rendered) -> Vec<[u64; 3]> {
    let [w, h] = r.film.size();
    let pixels = 0..w as usize * h as usize;
    let bits = |i| r.film.estimate(i).mean.map(f64::to_bits);
    pixels.map(bits).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let file = args.next().ok_or("which scene?")?;
    let spp = args.next().map_or(Ok(16), |n| n.parse())?;
    let way = args.next();
    // One thread: what others do at the same time would be in the time of both.
    with_threads(1, || -> Result<(), String> {
        run(&file, spp, way.as_deref()).map_err(|e| e.to_string())
    })??;
    Ok(())
}

fn run(file: &str, spp: u32, way: Option<&str>) -> Result<(), Box<dyn Error>> {
    if let Some(way) = way {
        Built::new(file, spp, way == "linked")?.render()?;
        return Ok(());
    }
    let both = [Built::new(file, spp, true)?, Built::new(file, spp, false)?];
    let mut ratios = Vec::new();
    for pair in 0..PAIRS {
        // Who goes first changes, too.
        let first = pair % 2;
        let (a, t) = both[first].render()?;
        let (b, u) = both[1 - first].render()?;
        if bits(&a) != bits(&b) {
            return Err("the pictures differ".into());
        }
        let ratio = if first == 0 { u / t } else { t / u };
        println!("loaded / linked {ratio:.4}  ({t:.2} s, {u:.2} s)");
        ratios.push(ratio.ln());
    }
    let n = ratios.len() as f64;
    let mean = ratios.iter().sum::<f64>() / n;
    let spread = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let (cost, error) = (mean.exp(), (spread / n).sqrt());
    println!(
        "{file}: loaded plugins take {:+.2} % ± {:.2} % of the time of linked ones, the pictures are the same",
        100.0 * (cost - 1.0),
        100.0 * error
    );
    if cost > BOUND {
        return Err(format!("more than {:.0} %", 100.0 * (BOUND - 1.0)).into());
    }
    Ok(())
}
