//! Smooth densities for the weights: flights through a deterministic, approximate optical depth.
//!
//! Weights may be any function of a path's vertices that sums to 1 over the strategies. With the exact densities of null-collision
//! paths ([`MediaDensities::Exact`](crate::mis::MediaDensities)) they are as random as the null collisions; here they are not,
//! at the price of one question about its depth for every edge. Every edge is asked about from its end nearer to the sensor (the
//! sensor's own from the other), so that the answer is the same whichever walk found it.

use super::connect::target;
use super::subpath::towards;
use resolvent_api::integrator::Outcome;
use resolvent_api::vertex::{LightSample, NONE, vertex_flags};
use resolvent_api::{SceneView, Spectrum, Vertex, VertexKind};

/// Smallest transmittance that is told from 0.
const LEAST: f32 = 1e-30;

/// A transmittance kept from 0, so that it can be divided by.
pub fn kept(t: Spectrum) -> Spectrum {
    t.map(|t| t.max(LEAST))
}

/// Transmittance of the approximate depth between neighbours, `near` being the one nearer to the sensor.
pub fn smooth(scene: &SceneView<'_>, near: &Vertex, far: &Vertex) -> Outcome<Spectrum> {
    let (from, to) = match near.is(VertexKind::Sensor) {
        true if far.is_infinite() => return Ok(Spectrum::ONE),
        true => (far, near),
        false => (near, far),
    };
    let w = towards(from, to);
    let end = if to.is_infinite() {
        LightSample {
            wi: w.into(),
            distance: f32::INFINITY,
            radiance: Spectrum::ONE,
            density: 1.0,
            light: NONE,
            flags: vertex_flags::INFINITE,
            p: to.p,
            ng: to.ng,
            primitive: to.primitive,
            p_error: to.p_error,
        }
    } else {
        target(to, w, (to.position() - from.position()).length())
    };
    Ok(kept(scene.approximate(from, &end)?))
}
