//! K at a vertex: frames, cosines and the corrections that keep transport symmetric, applied here and nowhere else.

use resolvent_api::integrator::{Outcome, SceneView, Stopped};
use resolvent_api::operator::{Measure, Mode, Scatter, ScatterDraws, ScatterEval, ScatterSample};
use resolvent_api::{Vec3, Vertex, VertexKind};

/// f̄·D towards `wi`: the BSDF times |ns·wi|, or the phase function, with the densities per steradian.
///
/// In radiance mode the shading normal's cosine replaces the geometric one. In importance mode the BSDF is the
/// adjoint, which carries |wo·ns| |wi·ng| / (|wo·ng| |wi·ns|) (Veach 1997, eq. 5.19). Radiance that is refracted is divided by η²,
/// see [`Mode`]. σ_s of a medium vertex is not part of it:
/// it belongs to the collision.
///
/// # Errors
/// If the plugin panicked or its value is not finite: the render ends, the plugin is named.
#[inline(always)]
pub fn eval(scene: &SceneView<'_>, v: &Vertex, wi: Vec3, mode: Mode) -> Outcome<ScatterEval> {
    let wo = Vec3::from(v.wo);
    let e = if v.is(VertexKind::Surface) {
        let Some(correction) = correction(v, wo, wi, mode) else {
            return Ok(ScatterEval::default());
        };
        let (lo, li) = (v.frame.to_local(wo), v.frame.to_local(wi));
        v.scatter.try_eval(lo, li, mode).map(|mut e| {
            e.f *= correction * li.z.abs();
            if lo.z * li.z < 0.0 {
                let eta = v.scatter.eta();
                e.f *= refraction(if lo.z > 0.0 { eta } else { 1.0 / eta }, mode);
            }
            e
        })
    } else {
        v.scatter.try_eval(wo, wi, mode)
    };
    match e {
        Ok(e) if e.f.is_finite() && e.forward.is_finite() && e.reverse.is_finite() => Ok(e),
        Ok(e) => {
            let what = format!("eval gave a value that is not finite: {e:?}");
            Err(broken(scene, v, &what, &format!("wi {wi:?}")))
        }
        Err(_) => Err(broken(scene, v, "panicked in eval", &format!("wi {wi:?}"))),
    }
}

/// Ends the render: what went wrong, and what the plugin had been asked.
#[cold]
fn broken(scene: &SceneView<'_>, v: &Vertex, what: &str, asked: &str) -> Stopped {
    let frame = if v.is(VertexKind::Surface) {
        format!(", shading normal {:?}", v.frame.n)
    } else {
        String::new()
    };
    scene.fault(v, &format!("{what} (wo {:?}, {asked}{frame})", v.wo))
}

/// Samples `wi`; the weight is f̄·D/density. Directions are in world coordinates.
///
/// # Errors
/// As [`eval`].
#[inline(always)]
pub fn sample(
    scene: &SceneView<'_>,
    v: &Vertex,
    u: ScatterDraws,
    mode: Mode,
) -> Outcome<Option<ScatterSample>> {
    let wo = Vec3::from(v.wo);
    let surface = v.is(VertexKind::Surface);
    let local = if surface { v.frame.to_local(wo) } else { wo };
    let mut s = match v.scatter.try_sample(local, u, mode) {
        Ok(Some(s)) => s,
        Ok(None) => return Ok(None),
        Err(_) => return Err(broken(scene, v, "panicked in sample", &format!("{u:?}"))),
    };
    let good = s.weight.is_finite() && Vec3::from(s.wi).is_finite() && s.forward.is_finite();
    if !good {
        let what = format!("sample gave a value that is not finite: {s:?}");
        return Err(broken(scene, v, &what, &format!("{u:?}")));
    }
    if surface {
        let wi = v.frame.to_world(s.wi.into()).normalize();
        let Some(correction) = correction(v, wo, wi, mode) else {
            return Ok(None);
        };
        s.weight *= correction * refraction(s.eta, mode);
        s.wi = wi.into();
    }
    Ok(Some(s))
}

/// True if the sample's density is a probability, not a density per steradian.
#[inline(always)]
pub fn is_delta(s: &ScatterSample) -> bool {
    s.measure == Measure::Discrete as u32
}

/// The factor for refraction: radiance is compressed by η² where `eta` is the index on the side of `wi` over that on the side
/// of `wo` (Veach 1997, eq. 5.14); power, which importance walks carry, is not.
#[inline(always)]
fn refraction(eta: f32, mode: Mode) -> f32 {
    match mode {
        Mode::Radiance => 1.0 / (eta * eta),
        Mode::Importance => 1.0,
    }
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
