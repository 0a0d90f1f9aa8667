//! Directions and draws that break closures.

use super::Measured;
use crate::{Suite, property};
use resolvent_api::{Mode, Scatter, ScatterDraws, Vec3};

/// Poles, the horizon and what lies next to it, denormal components.
fn directions(measured: Measured) -> Vec<Vec3> {
    let mut out = vec![Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    for z in [1e-3, 1e-7, 1e-20, 1e-40f32] {
        for z in [z, -z] {
            out.push(Vec3::new((1.0 - z * z).sqrt(), 0.0, z));
            out.push(Vec3::new(0.6, -0.8, z).normalize());
            // Next to the pole.
            out.push(Vec3::new(z, 0.0, 1.0).normalize());
            out.push(Vec3::new(0.0, z, -1.0).normalize());
        }
    }
    if measured == Measured::Phase {
        out.push(Vec3::new(0.577_350_3, 0.577_350_3, 0.577_350_3));
    }
    out
}

const ALMOST_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Every answer is possible, at the ends of all ranges; what is no direction gets an answer of some kind.
pub fn edges(suite: &mut Suite, name: &str, k: &impl Scatter, measured: Measured) {
    suite.about(property::EDGES);
    let ways = directions(measured);
    let possible = |x: f32| x.is_finite() && x >= 0.0;
    for &wo in &ways {
        for &wi in &ways {
            let e = k.eval(wo, wi, Mode::Radiance);
            let fine =
                e.f.0.iter().all(|&f| possible(f)) && possible(e.forward) && possible(e.reverse);
            suite.claim(fine, || format!("{name}: {e:?} at wo = {wo}, wi = {wi}"));
        }
        for lobe in [0.0, 0.5, ALMOST_ONE] {
            for a in [0.0, 1e-30, 0.5, ALMOST_ONE] {
                for b in [0.0, 1e-30, 0.5, ALMOST_ONE] {
                    let u = ScatterDraws { lobe, dir: [a, b] };
                    for mode in [Mode::Radiance, Mode::Importance] {
                        let Some(s) = k.sample(wo, u, mode) else {
                            continue;
                        };
                        let unit = (Vec3::from(s.wi).length_squared() - 1.0).abs() < 1e-4;
                        let fine = s.weight.0.iter().all(|&w| possible(w))
                            && s.forward > 0.0
                            && s.forward.is_finite()
                            && possible(s.reverse)
                            && s.eta > 0.0
                            && s.eta.is_finite();
                        suite.claim(unit && fine, || {
                            format!("{name}: {s:?} at wo = {wo}, {u:?}")
                        });
                    }
                }
            }
        }
    }
    let eta = k.eta();
    suite.claim(eta > 0.0 && eta.is_finite(), || {
        format!("{name}: index of refraction {eta}")
    });
    // No answer to these is right or wrong, but there must be one.
    for bad in [
        Vec3::NAN,
        Vec3::ZERO,
        Vec3::splat(f32::INFINITY),
        Vec3::new(f32::NAN, 0.0, 1.0),
        Vec3::splat(1e30),
    ] {
        k.eval(bad, Vec3::Z, Mode::Radiance);
        k.eval(Vec3::Z, bad, Mode::Importance);
        k.sample(bad, ScatterDraws::default(), Mode::Radiance);
    }
    for u in [-1.0, 1.0, 2.0, f32::NAN, f32::INFINITY] {
        let u = ScatterDraws {
            lobe: u,
            dir: [u; 2],
        };
        k.sample(Vec3::Z, u, Mode::Radiance);
    }
}
