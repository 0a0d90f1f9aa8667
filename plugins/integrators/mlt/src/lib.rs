//! Metropolis light transport in the space of primary samples, multiplexed over the strategies of bidirectional path tracing
//! (Veach & Guibas 1997; Kelemen et al. 2002; Hachisuka et al. 2014), through surfaces and media.
//!
//! A sample is one of `bdpt`, whose light of each strategy is kept in full where it is faint; what is bright is shared with chains. The
//! weight is the balance heuristic's for independent samples and for states of chains, which visit a path in proportion to what it carries:
//! 1/(1 + n I/b) for the sample, with n steps of chains for each, the path's importance I, and b what a sample finds on average. So no
//! path that few samples find leaves more than b/n in one place.
//! Chains start from what samples found, so often in proportion to it, and all carry the same energy along their fixed number of steps
//! (Cline et al. 2005): they begin in equilibrium, nothing is to be normalised or forgotten, and each sample with its chains is
//! unbiased by itself, whatever b was taken to be. b is estimated once for a film, by samples that depend on the film alone.
//! A chain keeps its strategy but for rare large steps; small ones move the numbers of one walk, while the other is kept as it is, or of both.
//!
//! A chain stays within its piece of work, one net of samples in one tile, though its light falls on any pixel: pictures do not depend on threads, and
//! errors that nets' spread states are true. Ranges of samples that divide no net are, together, the same picture as one render.
//! Light that was not scattered comes from the camera's rays. Neighbouring pixels share a chain's luck: their errors go together, so
//! a region's error is more than its pixels' variances say, and is judged by several seeds. An instance is for one scene.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `max_depth` | int ≥ −1 | −1 | scattering events of a path, −1: any number. A limit makes the picture darker than it should be |
//! | `mutations` | float > 0 | 8 | mean number of steps of chains for each sample. A sample costs about as much as four |
//! | `length` | int > 0 | 128 | steps of a chain |
//! | `large_steps` | float in [0, 1] | 0.02 | share of steps that draw everything anew, the strategy, too |
//! | `sigma` | float > 0 | 0.01 | standard deviation of small steps, of the unit interval: the geometric mean of what steps draw |
//! | `sigma_range` | float ≥ 1 | 5 | largest over mean standard deviation, and mean over smallest |
//! | `mean_depth` | float > 0 | 4 | mean number of scattering events beyond the first that large steps propose; thick media want more |
//! | `connections` | float > 0 | 4 | as in `bdpt`, for samples |
//! | `verify` | bool | false | recompute every path from scratch, and end with an error that names the path and both figures if they differ; several times slower |
//!
//! ```json
//! { "integrator": { "plugin": "mlt", "params": { "mutations": 8 } } }
//! ```

mod kernel;
mod starts;

use kernel::{Kernel, Settings};
use resolvent_api::abi::{ParamDecl, Tile};
use resolvent_api::integrator::Outcome;
use resolvent_api::params::Host;
use resolvent_api::{Decl, Error, Integrator, Output, Params, Plugin, SceneView};
use resolvent_pathspace::chain::Sizes;
use resolvent_pathspace::orders::{Orders, Tally, Together};
use std::sync::Mutex;

/// The integrator.
struct Metropolis {
    settings: Settings,
    host: Host,
    /// What a sample finds, of this window and margin.
    brightness: Mutex<Option<(Film, f64)>>,
}

/// What film is rendered: window, and margin in bits.
type Film = ([u32; 4], u32);

impl Plugin for Metropolis {
    const NAME: &'static str = "mlt";
    const SUMMARY: &'static str = "multiplexed Metropolis light transport";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::int("max_depth", "scattering events of a path; -1: any number")
            .default("-1")
            .at_least(-1.0)
            .build(),
        Decl::float("large_steps", "share of steps that draw everything anew")
            .default("0.02")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
        Decl::float("sigma", "standard deviation of small steps")
            .default("0.01")
            .above(0.0)
            .at_most(1.0)
            .build(),
        Decl::float(
            "sigma_range",
            "largest over mean standard deviation, and mean over smallest",
        )
        .default("5")
        .at_least(1.0)
        .at_most(1e6)
        .build(),
        Decl::float(
            "mean_depth",
            "mean number of scattering events that large steps propose",
        )
        .default("4")
        .above(0.0)
        .build(),
        Decl::bool(
            "verify",
            "recompute every path from scratch, and stop where that differs",
        )
        .default("false")
        .build(),
        Decl::float(
            "mutations",
            "mean number of steps of chains for each sample",
        )
        .default("8")
        .above(0.0)
        .build(),
        Decl::int("length", "steps of a chain")
            .default("128")
            .at_least(1.0)
            .at_most(1e6)
            .build(),
        Decl::float(
            "connections",
            "vertices of the light's walk that a vertex of the sensor's is joined to, on average",
        )
        .default("4")
        .above(0.0)
        .build(),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let mean = params.float("mean_depth")?;
        let (sigma, range) = (params.float("sigma")?, params.float("sigma_range")?);
        Ok(Self {
            settings: Settings {
                max_depth: u32::try_from(params.int("max_depth")?).unwrap_or(u32::MAX),
                large_steps: params.float("large_steps")? as f32,
                sizes: Sizes {
                    least: (sigma / range) as f32,
                    most: (sigma * range).min(1.0) as f32,
                },
                ratio: mean / (1.0 + mean),
                mutations: params.float("mutations")?,
                length: u32::try_from(params.int("length")?).unwrap_or(u32::MAX),
                connections: params.float("connections")? as f32,
                verify: params.bool("verify")?,
            },
            host: params.host(),
            brightness: Mutex::new(None),
        })
    }
}

impl Metropolis {
    fn piece<const CHROMATIC: bool, T: Tally>(
        &self,
        kernel: &mut Kernel<'_>,
        tile: &Tile,
        out: &mut Output<'_>,
        tally: T,
    ) -> Outcome<()> {
        let brightness = self.brightness::<CHROMATIC>(kernel, tile)?;
        kernel.piece::<CHROMATIC, T>(tile, brightness, out, tally)
    }

    /// The same number for all pieces of work of a film: the first one finds it.
    fn brightness<const CHROMATIC: bool>(
        &self,
        kernel: &mut Kernel<'_>,
        tile: &Tile,
    ) -> Outcome<f64> {
        let film = (tile.window, tile.margin.to_bits());
        let mut known = self.brightness.lock().unwrap_or_else(|e| e.into_inner());
        match *known {
            Some((f, brightness)) if f == film => Ok(brightness),
            _ => {
                let brightness = kernel.brightness::<CHROMATIC>()?;
                *known = Some((film, brightness));
                Ok(brightness)
            }
        }
    }
}

impl Integrator for Metropolis {
    fn render(&self, scene: &SceneView<'_>, tile: &Tile, out: &mut Output<'_>) -> Outcome<()> {
        let mut kernel = Kernel::new(scene, self.settings, tile);
        let done = match (scene.is_grey(), out.orders()) {
            (true, 0) => self.piece::<false, _>(&mut kernel, tile, out, Together),
            (true, n) => self.piece::<false, _>(&mut kernel, tile, out, Orders::new(n)),
            (false, 0) => self.piece::<true, _>(&mut kernel, tile, out, Together),
            (false, n) => self.piece::<true, _>(&mut kernel, tile, out, Orders::new(n)),
        };
        if let Some(difference) = kernel.difference() {
            self.host.fail(difference);
        }
        done
    }
}

resolvent_api::export_plugin!(integrator, Metropolis);
