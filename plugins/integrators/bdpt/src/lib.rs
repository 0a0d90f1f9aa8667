//! Bidirectional path tracing through surfaces and media (Lafortune & Willems 1993; Veach 1997, ch. 10; Jakob 2013, ch. 3).
//!
//! Every sample of a pixel walks from the sensor and from a light, and connects the two by all strategies (s, t), s ≥ 0 vertices from
//! the light and t ≥ 1 from the sensor. Their weights are exact on null-collision paths and over lanes. Russian roulette ends the
//! walks; there is no limit on bounces unless one is asked for.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `max_depth` | int ≥ −1 | −1 | scattering events of a path, −1: any number. A limit makes the picture darker than it should be |
//! | `connections` | float > 0 | 4 | vertices of the light's walk that a vertex of the sensor's is joined to, on average; the picture's mean does not depend on it |
//! | `heuristic` | `balance`, `power`, `alone` | `balance` | how the strategies' densities make weights; `alone`: the one strategy asked for is the only one |
//! | `media_weights` | `exact`, `depth` | `exact` | what they take for media: the densities of null collisions as they came about, or smooth ones of an approximate optical depth |
//! | `verify` | bool | false | recompute every path from scratch, and end with an error that names the path and both figures if they differ; several times slower |
//! | `s`, `t` | int ≥ −1 | −1 | only the strategy with so many vertices from the light and from the sensor, −1: all |
//!
//! With `s` and `t` the picture of one strategy is seen, weighted as it is in the sum: the pictures of all pairs add up to that of all.
//!
//! ```json
//! { "integrator": { "plugin": "bdpt", "params": { "max_depth": -1 } } }
//! ```

mod kernel;

use kernel::Kernel;
use resolvent_api::abi::{ParamDecl, Tile};
use resolvent_api::integrator::Outcome;
use resolvent_api::params::Host;
use resolvent_api::{Decl, Error, Integrator, Output, Params, Plugin, SceneView};
use resolvent_pathspace::mis::{Heuristic, MediaDensities};
use resolvent_pathspace::orders::{Orders, Together};

/// The integrator.
struct Bidirectional {
    max_depth: u32,
    connections: f32,
    heuristic: Heuristic,
    media: MediaDensities,
    verify: bool,
    only: [Option<usize>; 2],
    host: Host,
}

impl Plugin for Bidirectional {
    const NAME: &'static str = "bdpt";
    const SUMMARY: &'static str = "bidirectional path tracing through surfaces and media";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::int("max_depth", "scattering events of a path; -1: any number")
            .default("-1")
            .at_least(-1.0)
            .build(),
        Decl::float(
            "connections",
            "vertices of the light's walk that a vertex of the sensor's is joined to, on average",
        )
        .default("4")
        .above(0.0)
        .build(),
        Decl::choice(
            "heuristic",
            "balance|power|alone",
            "how the strategies' densities make weights",
        )
        .default("\"balance\"")
        .build(),
        Decl::choice(
            "media_weights",
            "exact|depth",
            "what weights take for media: null collisions as they came about, or an approximate depth",
        )
        .default("\"exact\"")
        .build(),
        Decl::bool(
            "verify",
            "recompute every path from scratch, and stop where that differs",
        )
        .default("false")
        .build(),
        Decl::int(
            "s",
            "only strategies with this many vertices from the light; -1: all",
        )
        .default("-1")
        .at_least(-1.0)
        .build(),
        Decl::int(
            "t",
            "only strategies with this many vertices from the sensor; -1: all",
        )
        .default("-1")
        .at_least(-1.0)
        .build(),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let count = |name: &str| params.int(name).map(|v| usize::try_from(v).ok());
        let heuristic = match params.text("heuristic").as_deref() {
            Some("power") => Heuristic::Power,
            Some("alone") => Heuristic::Alone,
            _ => Heuristic::Balance,
        };
        let media = match params.text("media_weights").as_deref() {
            Some("depth") => MediaDensities::Depth,
            _ => MediaDensities::Exact,
        };
        let verify = params.bool("verify")?;
        if verify && heuristic == Heuristic::Alone {
            return Err(Error::new(
                "verify needs strategies that are weighed against each other: heuristic must not be \"alone\"",
            ));
        }
        Ok(Self {
            max_depth: u32::try_from(params.int("max_depth")?).unwrap_or(u32::MAX),
            connections: params.float("connections")? as f32,
            heuristic,
            media,
            verify,
            host: params.host(),
            only: [count("s")?, count("t")?],
        })
    }
}

impl Integrator for Bidirectional {
    fn render(&self, scene: &SceneView<'_>, tile: &Tile, out: &mut Output<'_>) -> Outcome<()> {
        let kernel = Kernel {
            scene,
            max_depth: self.max_depth,
            connections: self.connections,
            heuristic: self.heuristic,
            media: self.media,
            verify: self.verify,
            only: self.only,
            host: self.host,
        };
        // The facts about the scene choose the kernel once a tile; lanes cost nothing where no medium tells them apart.
        match (scene.is_grey(), out.orders()) {
            (true, 0) => kernel.tile::<false, _>(tile, out, Together),
            (true, n) => kernel.tile::<false, _>(tile, out, Orders::new(n)),
            (false, 0) => kernel.tile::<true, _>(tile, out, Together),
            (false, n) => kernel.tile::<true, _>(tile, out, Orders::new(n)),
        }
    }
}

resolvent_api::export_plugin!(integrator, Bidirectional);
