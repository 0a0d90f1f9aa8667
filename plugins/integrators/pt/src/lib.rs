//! Volumetric path tracing: the Neumann series of G K, summed from the sensor.
//!
//! At every vertex the light that a connection finds and the light that scattering finds are combined by the balance heuristic, over
//! techniques and lanes, exactly on null-collision paths (Miller et al. 2019). Russian roulette ends paths; there is no limit on
//! bounces unless one is asked for.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `max_depth` | int ≥ −1 | −1 | scattering events after which a path ends, −1: none. A limit makes the picture darker than it should be |
//! | `sample_lights` | bool | true | connect vertices to lights. Without, light is only met by scattering: cheaper where lights fill much of the view, as the sky does round a thick cloud, and blind to point and sun lights |
//! | `reuse` | int 1…8 | 1 | edge, in pixels, of the blocks whose paths share all that they find beyond their second vertices, 1: none. Not where media tell lanes apart, nor for layers by scattering order |
//! | `branching` | float 0…1 | 0.25 | probability of a branch towards the sun at a vertex in a medium; the picture's mean does not depend on it |
//!
//! ```json
//! { "integrator": { "plugin": "pt", "params": { "max_depth": -1 } } }
//! ```

mod kernel;
mod reuse;

use kernel::Kernel;
use resolvent_api::abi::{ParamDecl, Tile, scene_traits};
use resolvent_api::integrator::Outcome;
use resolvent_api::{Decl, Error, Integrator, Output, Params, Plugin, SceneView};
use resolvent_pathspace::orders::{Orders, Tally, Together};
use resolvent_pathspace::sampler::Sampler;
use resolvent_pathspace::samples;

/// The integrator.
struct PathTracer {
    max_depth: u32,
    sample_lights: bool,
    reuse: u32,
    branching: f32,
}

impl Plugin for PathTracer {
    const NAME: &'static str = "pt";
    const SUMMARY: &'static str = "volumetric path tracing with next-event estimation and MIS";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::int(
            "max_depth",
            "scattering events after which a path ends; -1: no limit",
        )
        .default("-1")
        .at_least(-1.0)
        .build(),
        Decl::bool(
            "sample_lights",
            "connect vertices to lights; false: light is only met by scattering, point lights and suns without a disk never",
        )
        .default("true")
        .build(),
        Decl::int(
            "reuse",
            "edge, in pixels, of the blocks whose paths share what they find beyond their second vertices (where media are grey); 1: none",
        )
        .default("1")
        .at_least(1.0)
        .at_most(8.0)
        .build(),
        Decl::float(
            "branching",
            "probability of a branch towards the sun at a vertex in a medium; 0: never",
        )
        .default("0.25")
        .at_least(0.0)
        .at_most(1.0)
        .build(),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        Ok(Self {
            max_depth: u32::try_from(params.int("max_depth")?).unwrap_or(u32::MAX),
            sample_lights: params.bool("sample_lights")?,
            reuse: params.int("reuse")? as u32,
            branching: params.float("branching")? as f32,
        })
    }
}

impl Integrator for PathTracer {
    fn render(&self, scene: &SceneView<'_>, tile: &Tile, out: &mut Output<'_>) -> Outcome<()> {
        let sun = scene
            .sun()
            .filter(|_| self.branching > 0.0 && scene.has(scene_traits::MEDIA));
        let kernel = Kernel {
            scene,
            max_depth: self.max_depth,
            connects: self.sample_lights && scene.has(scene_traits::LIGHTS),
            sun,
            branching: self.branching,
        };
        if self.reuse > 1 && out.orders() == 0 && scene.is_grey() {
            return reuse::render(&kernel, self.reuse, tile, out);
        }
        // The facts about the scene choose the kernel once a tile; lanes cost nothing where no medium tells them apart.
        match (scene.is_grey(), out.orders()) {
            (true, 0) => tile_of::<false, _>(&kernel, tile, out, Together),
            (true, n) => tile_of::<false, _>(&kernel, tile, out, Orders::new(n)),
            (false, 0) => tile_of::<true, _>(&kernel, tile, out, Together),
            (false, n) => tile_of::<true, _>(&kernel, tile, out, Orders::new(n)),
        }
    }
}

fn tile_of<const CHROMATIC: bool, T: Tally>(
    kernel: &Kernel<'_>,
    tile: &Tile,
    out: &mut Output<'_>,
    tally: T,
) -> Outcome<()> {
    let scene = kernel.scene;
    let (wanted, vacuum) = (tile.features != 0, !scene.has(scene_traits::MEDIA));
    samples::each(tile, out, tally, |_, tally, p| {
        let sampler = Sampler::new(tile.seed, p.index, p.sample, scene.lanes());
        let sampler = sampler.without_flights(vacuum);
        kernel.path::<CHROMATIC, T>(&sampler, p.pixel, wanted, tally)
    })
}

resolvent_api::export_plugin!(integrator, PathTracer);
