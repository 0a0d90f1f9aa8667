//! Particle tracing: walks start at lights alone, and every vertex is connected to the lens (Arvo 1986; Veach 1997, strategy t = 1).
//!
//! The independent witness of the integrators that walk from the sensor. Lights at infinity seen directly are found by the camera's ray,
//! since no walk starts from where they are. It cannot see what no connection to the lens finds: delta reflections of the scene, and
//! the light that media emit.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `max_depth` | int ≥ −1 | −1 | scattering events of a path, −1: any number. A limit makes the picture darker than it should be |
//!
//! ```json
//! { "integrator": { "plugin": "light" } }
//! ```

use resolvent_api::abi::{ParamDecl, Tile, scene_traits};
use resolvent_api::integrator::Outcome;
use resolvent_api::{Decl, Error, Integrator, Output, Params, Plugin, SceneView};
use resolvent_pathspace::bidirectional::{Bidirectional, NetDraws};
use resolvent_pathspace::mis::{Heuristic, MediaDensities};
use resolvent_pathspace::orders::{Orders, Tally, Together};
use resolvent_pathspace::samples;

/// The integrator.
struct ParticleTracer {
    max_depth: u32,
}

impl Plugin for ParticleTracer {
    const NAME: &'static str = "light";
    const SUMMARY: &'static str = "particle tracing from lights to the lens";
    const PARAMS: &'static [ParamDecl] =
        &[
            Decl::int("max_depth", "scattering events of a path; -1: any number")
                .default("-1")
                .at_least(-1.0)
                .build(),
        ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let max_depth = u32::try_from(params.int("max_depth")?).unwrap_or(u32::MAX);
        Ok(Self { max_depth })
    }
}

impl Integrator for ParticleTracer {
    fn render(&self, scene: &SceneView<'_>, tile: &Tile, out: &mut Output<'_>) -> Outcome<()> {
        match (scene.is_grey(), out.orders()) {
            (true, 0) => self.tile::<false, _>(scene, tile, out, Together),
            (true, n) => self.tile::<false, _>(scene, tile, out, Orders::new(n)),
            (false, 0) => self.tile::<true, _>(scene, tile, out, Together),
            (false, n) => self.tile::<true, _>(scene, tile, out, Orders::new(n)),
        }
    }
}

impl ParticleTracer {
    fn tile<const CHROMATIC: bool, T: Tally>(
        &self,
        scene: &SceneView<'_>,
        tile: &Tile,
        out: &mut Output<'_>,
        tally: T,
    ) -> Outcome<()> {
        let mut paths = Bidirectional::new(1.0, Heuristic::Alone, MediaDensities::Exact);
        let emits = scene.has(scene_traits::LIGHTS) || scene.has(scene_traits::HITTABLE_LIGHTS);
        // The light's own vertex, and one for each scattering.
        let limit = (self.max_depth as usize).saturating_add(1);
        samples::each(tile, out, tally, |out, tally, p| {
            let mut draws = NetDraws::new(tile.seed, p.index, p.sample, scene.lanes());
            if emits {
                paths
                    .light
                    .from_light::<CHROMATIC, _>(scene, &mut draws, limit)?;
            }
            for s in 1..=paths.light.len() {
                if let Some(splat) = paths.project(scene, s, &mut draws)? {
                    tally.splat(out, splat.film, splat.radiance, s - 1)?;
                }
            }
            // The camera's ray finds lights at infinity, if it does not scatter before.
            let wanted = tile.features != 0;
            let mut sample = paths.look::<CHROMATIC, _>(scene, p.pixel, &mut draws, 2, wanted)?;
            let behind = paths.sensor.nodes().get(1);
            if behind.is_some_and(|n| n.vertex.is_infinite()) {
                sample.radiance = paths.hit(scene, 2)?;
                tally.add(0, sample.radiance);
            }
            Ok(sample)
        })
    }
}

resolvent_api::export_plugin!(integrator, ParticleTracer);
