//! Metropolis light transport in the space of primary samples, multiplexed over the strategies of bidirectional path tracing
//! (Veach & Guibas 1997; Kelemen et al. 2002; Hachisuka et al. 2014), through surfaces and media.
//!
//! Every piece of work runs a chain of its own over the whole picture. It starts from one of a set of independent paths, chosen in
//! proportion to what they carry, and is weighted by their mean: that makes it unbiased from its first step (Veach & Guibas 1997, §5.1),
//! and normalises it. A state decides length and strategy of its path with the rest of its numbers; large steps draw all of them anew.
//! Sample ranges are other chains: those of ranges that divide no net of samples are, together, the chains of one render.
//! Light that was not scattered comes from the camera's rays. Neighbouring pixels share a chain's luck: their errors go together, so
//! a region's error is more than its pixels' variances say, and is judged by several seeds.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `max_depth` | int ≥ −1 | −1 | scattering events of a path, −1: any number. A limit makes the picture darker than it should be |
//! | `large_steps` | float in (0, 1] | 0.6 | share of large steps |
//! | `sigma` | float > 0 | 0.01 | standard deviation of small steps, of the unit interval: the geometric mean of what steps draw |
//! | `sigma_range` | float ≥ 1 | 16 | largest over mean standard deviation, and mean over smallest |
//! | `mean_depth` | float > 0 | 4 | mean number of scattering events beyond the first that large steps propose; thick media want more |
//! | `verify` | bool | false | recompute every path from scratch, and end with an error that names the path and both figures if they differ; several times slower |
//! | `seeds` | float > 0 | 0.25 | independent paths that start a chain, for each of its steps |
//!
//! ```json
//! { "integrator": { "plugin": "mlt", "params": { "sigma": 0.01 } } }
//! ```

mod kernel;

use kernel::{Kernel, Settings};
use resolvent_api::abi::{ParamDecl, Tile};
use resolvent_api::integrator::Outcome;
use resolvent_api::params::Host;
use resolvent_api::{Decl, Error, Integrator, Output, Params, Plugin, SceneView};
use resolvent_pathspace::chain::Sizes;
use resolvent_pathspace::orders::{Orders, Together};

/// The integrator.
struct Metropolis {
    settings: Settings,
    host: Host,
}

impl Plugin for Metropolis {
    const NAME: &'static str = "mlt";
    const SUMMARY: &'static str = "multiplexed Metropolis light transport";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::int("max_depth", "scattering events of a path; -1: any number")
            .default("-1")
            .at_least(-1.0)
            .build(),
        Decl::float("large_steps", "share of steps that draw everything anew")
            .default("0.6")
            .above(0.0)
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
        .default("16")
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
            "seeds",
            "independent paths that start a chain, for each of its steps",
        )
        .default("0.25")
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
                seeds: params.float("seeds")?,
                verify: params.bool("verify")?,
            },
            host: params.host(),
        })
    }
}

impl Integrator for Metropolis {
    fn render(&self, scene: &SceneView<'_>, tile: &Tile, out: &mut Output<'_>) -> Outcome<()> {
        let mut kernel = Kernel::new(scene, self.settings, tile);
        let done = match (scene.is_grey(), out.orders()) {
            (true, 0) => kernel.piece::<false, _>(tile, out, Together),
            (true, n) => kernel.piece::<false, _>(tile, out, Orders::new(n)),
            (false, 0) => kernel.piece::<true, _>(tile, out, Together),
            (false, n) => kernel.piece::<true, _>(tile, out, Orders::new(n)),
        };
        if let Some(difference) = kernel.difference() {
            self.host.fail(difference);
        }
        done
    }
}

resolvent_api::export_plugin!(integrator, Metropolis);
