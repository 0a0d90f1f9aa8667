//! K at a vertex: frames, cosines and the corrections that keep transport symmetric, applied here and nowhere else.

use resolvent_api::operator::{Measure, Mode, Scatter, ScatterDraws, ScatterEval, ScatterSample};
use resolvent_api::{Vec3, Vertex, VertexKind};

/// f̄·D towards `wi`: the BSDF times |ns·wi|, or the phase function, with the densities per steradian.
///
/// In radiance mode the shading normal's cosine replaces the geometric one. In importance mode the BSDF is the
/// adjoint, which carries |wo·ns| |wi·ng| / (|wo·ng| |wi·ns|) (Veach 1997, eq. 5.19). σ_s of a medium vertex is not part of it:
/// it belongs to the collision.
#[inline(always)]
pub fn eval(v: &Vertex, wi: Vec3, mode: Mode) -> ScatterEval {
    let wo = Vec3::from(v.wo);
    if !v.is(VertexKind::Surface) {
        return v.scatter.eval(wo, wi, mode);
    }
    let Some(correction) = correction(v, wo, wi, mode) else {
        return ScatterEval::default();
    };
    let (lo, li) = (v.frame.to_local(wo), v.frame.to_local(wi));
    let mut e = v.scatter.eval(lo, li, mode);
    e.f *= correction * li.z.abs();
    e
}

/// Samples `wi`; the weight is f̄·D/density. Directions are in world coordinates.
#[inline(always)]
pub fn sample(v: &Vertex, u: ScatterDraws, mode: Mode) -> Option<ScatterSample> {
    let wo = Vec3::from(v.wo);
    if !v.is(VertexKind::Surface) {
        return v.scatter.sample(wo, u, mode);
    }
    let mut s = v.scatter.sample(v.frame.to_local(wo), u, mode)?;
    let wi = v.frame.to_world(s.wi.into()).normalize();
    s.weight *= correction(v, wo, wi, mode)?;
    s.wi = wi.into();
    Some(s)
}

/// True if the sample's density is a probability, not a density per steradian.
#[inline(always)]
pub fn is_delta(s: &ScatterSample) -> bool {
    s.measure == Measure::Discrete as u32
}

/// The factor for shading normals, or `None` where the two normals disagree about the side a direction is on: there
/// light would leak through the surface.
#[inline(always)]
fn correction(v: &Vertex, wo: Vec3, wi: Vec3, mode: Mode) -> Option<f32> {
    let (ng, ns) = (Vec3::from(v.ng), Vec3::from(v.frame.n));
    let (go, gi, so, si) = (ng.dot(wo), ng.dot(wi), ns.dot(wo), ns.dot(wi));
    if !(go * so > 0.0 && gi * si > 0.0) {
        return None;
    }
    Some(match mode {
        Mode::Radiance => 1.0,
        Mode::Importance => (so * gi / (go * si)).abs(),
    })
}
