//! Phase functions and BSDFs.

use super::Stages;
use super::raw::{Failures, RawClosure, bsdf_traits};
use super::subject::Subject;
use super::variants::Variant;
use crate::failure::{Outcome, input};
use resolvent_api::math::Frame;
use resolvent_api::phase::MediumPoint;
use resolvent_api::surface::{SurfacePoint, bsdf_traits as traits};
use resolvent_api::{Mode, PluginKind, Scatter, Vec3};
use resolvent_conformance::scatter::{Measured, Symmetry, albedo_in, directions, edges, examine};
use resolvent_conformance::{Suite, property};
use resolvent_engine::plugin::Instance;

/// What tables of multiple scattering may be off by, as those of the materials here are.
const BSDF_GAIN: f64 = 0.02;
/// Phase functions need no tables.
const PHASE_GAIN: f64 = 1e-3;

/// The closure at the `i`-th of two places.
pub fn closure<'a>(instance: &Instance, i: usize, failures: &'a Failures) -> RawClosure<'a> {
    if instance.plugin.kind == PluginKind::Phase {
        let at = MediumPoint {
            p: [[0.0; 3], [3.0, -1.0, 0.5]][i],
            lanes: 3,
        };
        return RawClosure::phase(instance, &at, failures);
    }
    let n = [Vec3::Z, Vec3::new(0.36, 0.48, 0.8)][i];
    let at = SurfacePoint {
        p: [[0.0; 3], [3.0, -1.0, 0.5]][i],
        ng: n.into(),
        frame: Frame::around(n),
        uv: [[0.0; 2], [0.3, 0.7]][i],
        // As where a normal map has turned the shading normal a little.
        tangent: Frame::around(Vec3::new(n.x + 0.1, n.y - 0.2, n.z).normalize()),
        ..SurfacePoint::default()
    };
    RawClosure::bsdf(instance, &at, failures)
}

/// What a BSDF states about itself.
fn facts(instance: &Instance) -> u32 {
    if instance.plugin.kind == PluginKind::Bsdf {
        bsdf_traits(instance)
    } else {
        0
    }
}

fn measured(instance: &Instance) -> (Measured, f64) {
    if instance.plugin.kind == PluginKind::Phase {
        (Measured::Phase, PHASE_GAIN)
    } else {
        (Measured::Bsdf, BSDF_GAIN)
    }
}

/// Directions light comes from: steep, oblique, grazing, and from behind.
fn ways(measured: Measured) -> Vec<Vec3> {
    match measured {
        Measured::Phase => vec![Vec3::new(0.48, -0.6, 0.64), -Vec3::Z],
        Measured::Bsdf => vec![
            Vec3::new(0.25, 0.35, 0.9).normalize(),
            Vec3::new(-0.7, 0.5, 0.4).normalize(),
            Vec3::new(0.9, -0.4, 0.12).normalize(),
            Vec3::new(0.3, -0.6, -0.7).normalize(),
        ],
    }
}

/// All statistics, with one set of parameters.
pub fn thorough(suite: &mut Suite, subject: &Subject, v: &Variant, stages: Stages) -> Outcome<()> {
    let instance = subject.make(&v.params).map_err(input)?;
    let (measured, gain) = measured(&instance);
    let failures = Failures::default();
    stages(property::SAMPLING, &v.name);
    let bits = facts(&instance);
    let symmetry = if bits & traits::NON_RECIPROCAL != 0 {
        Symmetry::None
    } else if bits & traits::OWN_NORMALS != 0 {
        Symmetry::Adjoint
    } else {
        Symmetry::Reciprocal
    };
    let k = closure(&instance, 0, &failures);
    for wo in ways(measured) {
        examine(suite, &v.name, &k, measured, wo, gain, symmetry);
    }
    stages(property::EDGES, &v.name);
    edges(suite, &v.name, &k, measured);
    if bits & traits::UNIFORM != 0 {
        let other = closure(&instance, 1, &failures);
        suite.about(property::FACTS);
        for wi in directions(100, 0xfac7) {
            let wo = ways(measured)[0];
            let (a, b) = (
                k.eval(wo, wi, Mode::Radiance),
                other.eval(wo, wi, Mode::Radiance),
            );
            suite.claim(a == b, || {
                format!(
                    "{}: says it is the same everywhere, {a:?} and {b:?} at wi = {wi}",
                    v.name
                )
            });
        }
    }
    failures.file(suite, &v.name);
    Ok(())
}

/// Possible answers and no more energy than comes in.
pub fn brief(suite: &mut Suite, name: &str, instance: &Instance) {
    let (measured, gain) = measured(instance);
    let failures = Failures::default();
    let k = closure(instance, 1, &failures);
    edges(suite, name, &k, measured);
    suite.about(property::ENERGY);
    // Lobes with normals of their own keep within it in radiance mode only.
    let mode = if facts(instance) & traits::OWN_NORMALS != 0 {
        Mode::Radiance
    } else {
        Mode::Importance
    };
    for wo in ways(measured) {
        // Well spread draws: their error is some thousandths.
        let most = albedo_in(&k, wo, 4096, mode)
            .into_iter()
            .fold(0.0, f64::max);
        suite.at_most(most, 1.03 + gain, || {
            format!("{name}, wo = {wo}: makes energy, albedo {most:.4}")
        });
    }
    failures.file(suite, name);
}
