//! Integrator `@NAME@`: ambient occlusion, the share of the sky that is seen from what the camera sees.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `distance` | float | length | 1 | > 0 | what is farther away hides nothing |
//!
//! ```json
//! "integrator": { "plugin": "@NAME@", "params": { "distance": 2 } }
//! ```
//!
//! # How it works, and what to change
//!
//! The host divides the picture into pieces of work; [`Integrator::render`] adds every sample of every pixel of one of them. The
//! scene answers in vertices and edges: [`SceneView::emerge`] follows the camera's ray to the first vertex,
//! [`Transport::propagate`] goes on from there, and `edge.value/edge.track` is what the media on the way leave. What a sample is must depend on seed,
//! pixel and number of the sample alone: all random numbers come from a stream that has these as its key.

#[cfg(test)]
mod tests;

use core::f32::consts::TAU;
use resolvent_api::abi::{PixelSample, Tile};
use resolvent_api::integrator::{Outcome, SceneView};
use resolvent_api::rng::{Stream, derive};
use resolvent_api::{
    Decl, Edge, Error, FlightDraws, Integrator, Output, ParamDecl, Params, Plugin, Spectrum,
    Transport, Vec3, Vertex, VertexKind,
};

/// The plugin.
pub struct Occlusion {
    distance: f32,
}

impl Plugin for Occlusion {
    const NAME: &'static str = "@NAME@";
    const SUMMARY: &'static str = "Ambient occlusion: the share of the sky that is seen.";
    const PARAMS: &'static [ParamDecl] =
        &[Decl::float("distance", "what is farther away hides nothing")
            .unit("length")
            .default("1")
            .above(0.0)
            .build()];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        Ok(Self {
            distance: params.float("distance")? as f32,
        })
    }
}

impl Integrator for Occlusion {
    fn render(&self, scene: &SceneView<'_>, tile: &Tile, out: &mut Output<'_>) -> Outcome<()> {
        for y in tile.min[1]..tile.max[1] {
            for x in tile.min[0]..tile.max[0] {
                for i in tile.sample_begin..tile.sample_end {
                    let pixel = u64::from(y) << 32 | u64::from(x);
                    let key = derive(derive(tile.seed, pixel), u64::from(i));
                    let sample = self.sample(scene, [x, y], &mut Stream::new(key))?;
                    out.add(x, y, &sample)?;
                }
            }
        }
        Ok(())
    }
}

impl Occlusion {
    fn sample(
        &self,
        scene: &SceneView<'_>,
        pixel: [u32; 2],
        stream: &mut Stream,
    ) -> Outcome<PixelSample> {
        let mut out = PixelSample::default();
        let (film, lens) = (stream.uniform2(), stream.uniform2());
        let Some(ray) = scene.camera_ray(pixel, film, lens)? else {
            return Ok(out);
        };
        let (mut seen, mut beyond, mut edge) = (Vertex::empty(), Vertex::empty(), far());
        let met = scene.emerge(&ray, &flight(scene, stream), &mut edge, &mut seen)?;
        if !met || seen.is(VertexKind::Emitter) {
            out.radiance = Spectrum::splat(ray.weight);
            return Ok(out);
        }
        let wi = direction(&seen, stream.uniform2());
        let mut edge = far();
        scene.propagate(&seen, wi, &flight(scene, stream), &mut edge, &mut beyond)?;
        let open = edge.length > self.distance;
        out.radiance = Spectrum::splat(if open { ray.weight } else { 0.0 });
        out.alpha = 1.0;
        Ok(out)
    }
}

/// An edge on which nothing was met yet.
fn far() -> Edge {
    Edge {
        length: f32::INFINITY,
        ..Edge::default()
    }
}

/// The random numbers of a flight through media.
fn flight(scene: &SceneView<'_>, stream: &mut Stream) -> FlightDraws {
    let [tau, event] = stream.uniform2();
    FlightDraws {
        key: stream.bits(),
        tau,
        event,
        hero: (stream.bits() % u64::from(scene.lanes())) as u32,
        lanes: scene.lanes(),
        prior: Spectrum::ONE,
        ..FlightDraws::default()
    }
}

/// A direction from a surface, distributed like the cosine, on the side it is seen from; any from a medium.
fn direction(v: &Vertex, u: [f32; 2]) -> Vec3 {
    let (sin, cos) = (TAU * u[1]).sin_cos();
    if v.is(VertexKind::Medium) {
        let z = 1.0 - 2.0 * u[0];
        let r = (1.0 - z * z).max(0.0).sqrt();
        return Vec3::new(r * cos, r * sin, z);
    }
    let (r, z) = (u[0].sqrt(), (1.0 - u[0]).sqrt());
    let side = Vec3::from(v.wo).dot(v.frame.n.into());
    v.frame.to_world(Vec3::new(r * cos, r * sin, z.copysign(side)))
}

resolvent_api::export_plugin!(integrator, Occlusion);
